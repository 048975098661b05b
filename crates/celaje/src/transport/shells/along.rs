//! The solved light, scattered once more along a ray: for many suns and azimuths at a time.
//!
//! The way through the air, its transmittance and the air's phase functions are the same for all azimuths and suns. So the
//! source is first summed over the degrees of its harmonics at each point and sun node; what is left for each sun and azimuth
//! is a short sum over orders, `Σ_m cos mφ' S_m`, and the interpolation between suns.

use super::field::{Field, Scattering, SunPlace};
use super::harmonics::{self, Harmonics};
use super::march::{March, Step};
use super::scaled::{cos_azimuth, Scaled};
use super::spin::{self, Spin};
use crate::math::lanes;
use crate::medium::Medium;

/// A sun and a direction, for a ray of a given zenith angle.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Cosine of the sun's zenith angle at the observer.
    pub cos_sun: f64,
    /// Cosine of the angle between the ray and the sun.
    pub cos_theta: f64,
}

/// Where the observer stands on the ray that a [`March`] cut.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// Distance from the planet's centre \[m\].
    pub radius_m: f64,
    /// Distance from the observer to where the march starts \[m\].
    pub offset_m: f64,
}

impl Stand {
    /// Cosine of the sun's zenith angle at a point of the ray.
    #[inline(always)]
    pub fn mu_sun(&self, target: &Target, distance_m: f64, radius_m: f64) -> f64 {
        let along = self.offset_m + distance_m;
        (self.radius_m * target.cos_sun + along * target.cos_theta) / radius_m
    }
}

/// The harmonics of a solution.
#[derive(Debug, Clone)]
pub struct Bases {
    pub radiance: Harmonics,
    pub polarisation: Spin,
}

impl Bases {
    /// * `polarised_degree` — 0 for scalar light
    pub fn new(degree: usize, polarised_degree: usize) -> Self {
        Self {
            radiance: Harmonics::new(degree),
            polarisation: Spin::new(polarised_degree),
        }
    }
}

/// Memory of one thread.
#[derive(Debug, Default)]
pub struct Along {
    /// Coefficients at a point times the weight of the step.
    coefficients: Vec<f32>,
    polar: Vec<f32>,
    /// The same of polarisation: b, e, h and `W`, `X`.
    polarising: Vec<f32>,
    w: Vec<f32>,
    x: Vec<f32>,
    /// `S_m` of a point, of the radiance and, if wanted, of Q and U, shape (sun node, orders, lanes), and the logarithms of their
    /// references.
    by_order: Vec<f32>,
    logs: Vec<f32>,
    places: Vec<(SunPlace, f32)>,
    cosines: Vec<f32>,
    sines: Vec<f32>,
    ground: Vec<f32>,
}

impl Along {
    /// Adds the light that a field scatters towards the observer, and that its ground reflects, along the ray cut last.
    ///
    /// * `albedo` — of the ground, one row
    /// * `out` — shape (target, components, lanes), 1 component for the radiance, 3 for I, Q, U
    #[inline(always)]
    pub fn add_scattered(
        &mut self,
        (field, scaled, bases): (&Field, &Scaled, &Bases),
        albedo: &[f32],
        march: &March,
        stand: Stand,
        targets: &[Target],
        out: &mut [f32],
    ) {
        let n = scaled.medium.lanes();
        let stride = out.len() / targets.len();
        let stokes = stride > n;
        self.coefficients.resize((scaled.degree + 1) * n, 0.0);
        self.polar.resize(harmonics::count(scaled.degree), 0.0);
        self.cosines.resize(scaled.degree + 1, 0.0);
        let polarised = scaled.polarised_degree > 0;
        if polarised {
            self.polarising.resize(scaled.polarising_length(), 0.0);
            let count = spin::count(scaled.polarised_degree);
            self.w.resize(count, 0.0);
            self.x.resize(count, 0.0);
            self.sines.resize(scaled.polarised_degree + 1, 0.0);
        }
        for (step, weights) in march.steps.iter().zip(march.weights.chunks_exact(n)) {
            let degree = scaled.coefficients_at(step.radius_m, &mut self.coefficients);
            for row in self.coefficients.chunks_exact_mut(n).take(degree + 1) {
                for (c, &w) in row.iter_mut().zip(weights) {
                    *c *= w;
                }
            }
            bases.radiance.polar(degree, step.mu, &mut self.polar);
            let mut polarised_degree = 0;
            if polarised {
                polarised_degree = scaled.polarising_at(step.radius_m, &mut self.polarising);
                let used = (polarised_degree - 1) * 3;
                for row in self.polarising.chunks_exact_mut(n).take(used) {
                    for (c, &w) in row.iter_mut().zip(weights) {
                        *c *= w;
                    }
                }
                if stokes {
                    let (w, x) = (&mut self.w, &mut self.x);
                    bases.polarisation.polar(step.mu, w, x);
                }
            }
            let degrees = (degree, polarised_degree);
            let (first, last) = self.place(field, step, stand, targets);
            self.scatter(field, step, degrees, stokes, (first, last));
            let rows = orders(degrees, stokes) * n;
            self.spread(first, degree, (n, rows, stride), out);
            if stokes {
                self.spread_polarisation(first, degrees, n, out);
            }
        }
        if march.meets_ground {
            self.ground.resize(n, 0.0);
            for ((g, &a), &t) in self.ground.iter_mut().zip(albedo).zip(&march.through) {
                *g = a * t / std::f32::consts::PI;
            }
            let ground_m = scaled.medium.ground_radius_m();
            for (target, out) in targets.iter().zip(out.chunks_exact_mut(stride)) {
                let place = field.sun_place(stand.mu_sun(target, march.length_m, ground_m));
                field.add_flux(&place, &self.ground, &mut out[..n]);
            }
        }
    }

    /// Finds every target's sun and azimuth at a point; returns the first sun node met and the one after the last.
    #[inline(always)]
    fn place(
        &mut self,
        field: &Field,
        step: &Step,
        stand: Stand,
        targets: &[Target],
    ) -> (usize, usize) {
        let (mut first, mut last) = (usize::MAX, 0);
        self.places.clear();
        for target in targets {
            let mu_sun = stand.mu_sun(target, step.distance_m, step.radius_m);
            let place = field.sun_place(mu_sun);
            let cos_phi = cos_azimuth(step.mu, mu_sun, target.cos_theta);
            first = first.min(place.first);
            last = last.max(place.first + 4);
            self.places.push((place, cos_phi as f32));
        }
        (first, last.min(field.solution().sun_zenith_deg.len()))
    }

    /// `S_m` at a point for a range of sun nodes.
    #[inline(always)]
    fn scatter(
        &mut self,
        field: &Field,
        step: &Step,
        degrees: (usize, usize),
        stokes: bool,
        (first, last): (usize, usize),
    ) {
        let rows = orders(degrees, stokes) * field.solution().lanes();
        self.by_order.resize(((last - first).max(4)) * rows, 0.0);
        self.logs.clear();
        self.logs.resize((last - first).max(4), 0.0);
        let height = field.height(step.radius_m);
        for (k, sun) in (first..last).enumerate() {
            let scattering = Scattering {
                degree: degrees.0,
                polarised_degree: degrees.1,
                coefficients: &self.coefficients,
                polar: &self.polar,
                polarising: &self.polarising,
                w: &self.w,
                x: &self.x,
            };
            let out = &mut self.by_order[k * rows..(k + 1) * rows];
            self.logs[k] = field.source_by_order(height, sun, &scattering, out);
        }
    }

    /// Adds the source of a point to every target. `rows` and `stride` are lengths of what a sun node and a target hold.
    #[inline(always)]
    fn spread(
        &mut self,
        first: usize,
        degree: usize,
        (n, rows, stride): (usize, usize, usize),
        out: &mut [f32],
    ) {
        for ((place, cos_phi), out) in self.places.iter().zip(out.chunks_exact_mut(stride)) {
            let at = place.first - first;
            let logs = &self.logs[at..at + 4];
            let w = place.weight;
            let log = w[0] * logs[0] + w[1] * logs[1] + w[2] * logs[2] + w[3] * logs[3];
            let scale = log.exp();
            harmonics::cosines(*cos_phi, &mut self.cosines[..=degree]);
            let cosines = &self.cosines[..=degree];
            let w = w.map(|w| w * scale);
            for (block, out) in lanes::blocks_mut(out).take(n / lanes::BLOCK).enumerate() {
                let from = at * rows + block * lanes::BLOCK;
                let mut sum = [0.0f32; lanes::BLOCK];
                for (k, &w) in w.iter().enumerate() {
                    let mut of_node = [0.0f32; lanes::BLOCK];
                    for (m, &c) in cosines.iter().enumerate() {
                        let order = *lanes::block(&self.by_order, from + k * rows + m * n);
                        of_node = lanes::each(|i| of_node[i] + c * order[i]);
                    }
                    sum = lanes::each(|i| sum[i] + w * of_node[i]);
                }
                let before = *out;
                *out = lanes::each(|i| before[i] + sum[i]);
            }
        }
    }

    /// Adds the Q and U of a point to every target.
    #[inline(always)]
    fn spread_polarisation(
        &mut self,
        first: usize,
        (degree, most): (usize, usize),
        n: usize,
        out: &mut [f32],
    ) {
        let rows = orders((degree, most), true) * n;
        let at_q = (degree + 1) * n;
        let at_u = at_q + (most + 1) * n;
        for ((place, cos_phi), out) in self.places.iter().zip(out.chunks_exact_mut(3 * n)) {
            let at = place.first - first;
            let logs = &self.logs[at..at + 4];
            let w = place.weight;
            let log = w[0] * logs[0] + w[1] * logs[1] + w[2] * logs[2] + w[3] * logs[3];
            let w = w.map(|w| w * log.exp());
            harmonics::cosines(*cos_phi, &mut self.cosines[..=most]);
            spin::sines(*cos_phi, &mut self.sines[..=most]);
            let (_, out) = out.split_at_mut(n);
            let (out_q, out_u) = out.split_at_mut(n);
            for block in (0..n).step_by(lanes::BLOCK) {
                let (mut q, mut u) = ([0.0f32; lanes::BLOCK], [0.0f32; lanes::BLOCK]);
                for (k, w) in w.into_iter().enumerate() {
                    let node = (at + k) * rows + block;
                    for m in 0..=most {
                        let (c, s) = (w * self.cosines[m], w * self.sines[m]);
                        let of_q = *lanes::block(&self.by_order, node + at_q + m * n);
                        let of_u = *lanes::block(&self.by_order, node + at_u + m * n);
                        q = lanes::each(|i| q[i] + c * of_q[i]);
                        u = lanes::each(|i| u[i] + s * of_u[i]);
                    }
                }
                lanes::add_scaled(&q, 1.0, &mut out_q[block..block + lanes::BLOCK]);
                lanes::add_scaled(&u, 1.0, &mut out_u[block..block + lanes::BLOCK]);
            }
        }
    }
}

/// Orders of a point's source: those of the radiance and, if wanted, of Q and U.
fn orders((degree, polarised_degree): (usize, usize), stokes: bool) -> usize {
    if stokes {
        degree + 1 + 2 * (polarised_degree + 1)
    } else {
        degree + 1
    }
}
