//! The solved light, scattered once more along a ray: for many suns and azimuths at a time.
//!
//! The way through the air, its transmittance and the air's phase functions are the same for all azimuths and suns. So the
//! source is first summed over the degrees of its harmonics at each point and sun node; what is left for each sun and azimuth
//! is a short sum over orders, `Σ_m cos mφ' S_m`, and the interpolation between suns.

use super::field::{Field, SunPlace};
use super::harmonics::{self, Harmonics};
use super::march::{March, Step};
use super::scaled::{cos_azimuth, Scaled};
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

/// Memory of one thread.
#[derive(Debug, Default)]
pub struct Along {
    /// Coefficients at a point times the weight of the step.
    coefficients: Vec<f32>,
    polar: Vec<f32>,
    /// `S_m` of a point, shape (sun node, degree + 1, lanes), and the logarithms of their references.
    by_order: Vec<f32>,
    logs: Vec<f32>,
    places: Vec<(SunPlace, f32)>,
    cosines: Vec<f32>,
    ground: Vec<f32>,
}

impl Along {
    /// Adds the light that a field scatters towards the observer, and that its ground reflects, along the ray cut last.
    ///
    /// * `albedo` — of the ground, one row
    /// * `out` — shape (target, lanes)
    #[inline(always)]
    pub fn add_scattered(
        &mut self,
        (field, scaled, harmonics): (&Field, &Scaled, &Harmonics),
        albedo: &[f32],
        march: &March,
        stand: Stand,
        targets: &[Target],
        out: &mut [f32],
    ) {
        let n = scaled.medium.lanes();
        self.coefficients.resize((scaled.degree + 1) * n, 0.0);
        self.polar.resize(harmonics::count(scaled.degree), 0.0);
        self.cosines.resize(scaled.degree + 1, 0.0);
        for (step, weights) in march.steps.iter().zip(march.weights.chunks_exact(n)) {
            let degree = scaled.coefficients_at(step.radius_m, &mut self.coefficients);
            for row in self.coefficients.chunks_exact_mut(n).take(degree + 1) {
                for (c, &w) in row.iter_mut().zip(weights) {
                    *c *= w;
                }
            }
            harmonics.polar(degree, step.mu, &mut self.polar);
            let (first, last) = self.place(field, step, stand, targets);
            self.scatter(field, step, degree, (first, last));
            self.spread(first, degree, n, out);
        }
        if march.meets_ground {
            self.ground.resize(n, 0.0);
            for ((g, &a), &t) in self.ground.iter_mut().zip(albedo).zip(&march.through) {
                *g = a * t / std::f32::consts::PI;
            }
            let ground_m = scaled.medium.ground_radius_m();
            for (target, out) in targets.iter().zip(out.chunks_exact_mut(n)) {
                let place = field.sun_place(stand.mu_sun(target, march.length_m, ground_m));
                field.add_flux(&place, &self.ground, out);
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
        degree: usize,
        (first, last): (usize, usize),
    ) {
        let rows = (degree + 1) * field.solution().lanes();
        self.by_order.resize(((last - first).max(4)) * rows, 0.0);
        self.logs.clear();
        self.logs.resize((last - first).max(4), 0.0);
        let height = field.height(step.radius_m);
        for (k, sun) in (first..last).enumerate() {
            self.logs[k] = field.source_by_order(
                height,
                sun,
                degree,
                &self.coefficients,
                &self.polar,
                &mut self.by_order[k * rows..(k + 1) * rows],
            );
        }
    }

    /// Adds the source of a point to every target.
    #[inline(always)]
    fn spread(&mut self, first: usize, degree: usize, n: usize, out: &mut [f32]) {
        let rows = (degree + 1) * n;
        for ((place, cos_phi), out) in self.places.iter().zip(out.chunks_exact_mut(n)) {
            let at = place.first - first;
            let logs = &self.logs[at..at + 4];
            let w = place.weight;
            let log = w[0] * logs[0] + w[1] * logs[1] + w[2] * logs[2] + w[3] * logs[3];
            let scale = log.exp();
            harmonics::cosines(*cos_phi, &mut self.cosines[..=degree]);
            let sources = &self.by_order[at * rows..(at + 4) * rows];
            let (s0, rest) = sources.split_at(rows);
            let (s1, rest) = rest.split_at(rows);
            let (s2, s3) = rest.split_at(rows);
            for block in (0..n).step_by(lanes::BLOCK) {
                let mut sums = [[0.0f32; lanes::BLOCK]; 4];
                for m in 0..=degree {
                    let c = self.cosines[m];
                    let at = m * n + block..m * n + block + lanes::BLOCK;
                    let node = [&s0[at.clone()], &s1[at.clone()], &s2[at.clone()], &s3[at]];
                    for (sum, node) in sums.iter_mut().zip(node) {
                        for (s, &x) in sum.iter_mut().zip(node) {
                            *s += c * x;
                        }
                    }
                }
                let w = w.map(|w| w * scale);
                for (i, o) in out[block..block + lanes::BLOCK].iter_mut().enumerate() {
                    *o += w[0] * sums[0][i]
                        + w[1] * sums[1][i]
                        + w[2] * sums[2][i]
                        + w[3] * sums[3][i];
                }
            }
        }
    }
}
