//! Successive orders of scattering on the grid of a [`Field`].

use std::sync::atomic::{AtomicBool, Ordering};

use multiversion::multiversion;
use rayon::prelude::*;

use super::along::{Along, Bases, Stand, Target};
use super::field::{Field, Solution};
use super::harmonics::{self, gauss_legendre, legendre};
use super::march::{Levels, March};
use super::scaled::{Scaled, Sunlit};
use super::spin;
use super::tail::Tail;
use super::Resolution;
use crate::error::{Error, Result};
use crate::math::{lanes, Vec3};
use crate::medium::{Medium, Ray};

/// What the solver is asked for, beside the medium.
pub struct Problem<'a> {
    /// Albedo of the ground at the chosen wavelengths, one row.
    pub albedo: &'a [f32],
    /// Angular radius of the sun.
    pub sun_radius_rad: f64,
    /// Range of sun zenith angles anywhere in the air.
    pub sun_zenith_deg: (f64, f64),
    /// Orders of scattering in the field: one less than what is seen; `None` for all.
    pub orders: Option<u32>,
}

/// Solves for the moments of all orders of scattering, under a sun of unit irradiance.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn solve(
    scaled: &Scaled,
    problem: &Problem<'_>,
    resolution: &Resolution,
    cancel: &AtomicBool,
) -> Result<Field> {
    let grid = Grid::new(scaled, resolution, problem.sun_zenith_deg);
    let sweep = |source: Source<'_>| -> Result<Field> {
        let mut solution = grid.dark(scaled);
        let rows = solution.moments_per_node() * scaled.medium.lanes();
        let stride = grid.sun_zenith.len() * rows;
        let flux = std::sync::Mutex::new(Vec::new());
        solution
            .moments
            .par_chunks_mut(stride)
            .enumerate()
            .try_for_each(|(a, moments)| {
                if cancel.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                let mut worker = Worker::new(scaled, problem, &grid);
                sweep_altitude(&mut worker, &source, a, moments);
                if a == 0 {
                    if let Ok(mut f) = flux.lock() {
                        *f = std::mem::take(&mut worker.flux);
                    }
                }
                Ok(())
            })?;
        solution.flux = flux.into_inner().unwrap_or_default();
        Ok(Field::new(solution))
    };
    let first = sweep(Source::Sun)?;
    let mut total = first.solution().clone();
    let mut order = first;
    let most = problem.orders.unwrap_or(resolution.max_orders);
    for _ in 1..most {
        let next = sweep(Source::Field(&order))?;
        add(&mut total.moments, &next.solution().moments);
        add(&mut total.flux, &next.solution().flux);
        if problem.orders.is_none() {
            let tail = Tail::new(order.solution(), next.solution());
            if tail.largest(next.solution(), &total) < resolution.converged {
                tail.add(next.solution(), &mut total);
                break;
            }
        }
        order = next;
    }
    Ok(Field::new(total))
}

/// Where the light of a sweep comes from.
enum Source<'a> {
    /// The sun alone: the first order.
    Sun,
    /// The light of a field, scattered once more.
    Field(&'a Field),
}

fn add(to: &mut [f32], from: &[f32]) {
    for (t, &f) in to.iter_mut().zip(from) {
        *t += f;
    }
}

/// Heights, sun angles and directions.
struct Grid {
    radius_m: Vec<f64>,
    /// In radians, and in degrees.
    sun_zenith: Vec<f64>,
    sun_zenith_deg: Vec<f64>,
    levels: Levels,
    bases: Bases,
    /// Cosines of the azimuths, and the weight of each (both sides of the sun's plane).
    cos_phi: Vec<f64>,
    phi_weight: f64,
    directions: (usize, usize),
}

impl Grid {
    fn new(scaled: &Scaled, resolution: &Resolution, sun_zenith_deg: (f64, f64)) -> Self {
        let nodes = scaled.medium.node_radii_m();
        let (ground, top) = (nodes[0], nodes[nodes.len() - 1]);
        let count = resolution.altitudes;
        let radius_m = (0..count)
            .map(|i| ground + (top - ground) * (i as f64 / (count - 1) as f64).powf(2.2))
            .collect();
        let azimuths = resolution.azimuths;
        let sun_zenith_deg = sun_angles(sun_zenith_deg, resolution.sun_step_deg);
        Self {
            radius_m,
            sun_zenith: sun_zenith_deg.iter().map(|d| d.to_radians()).collect(),
            sun_zenith_deg,
            levels: Levels::new(&scaled.medium, resolution.level_m, resolution.level_growth),
            bases: Bases::new(scaled.degree, scaled.polarised_degree),
            cos_phi: (0..azimuths)
                .map(|j| ((j as f64 + 0.5) * std::f64::consts::PI / azimuths as f64).cos())
                .collect(),
            phi_weight: 2.0 * std::f64::consts::PI / azimuths as f64,
            directions: resolution.directions,
        }
    }

    fn dark(&self, scaled: &Scaled) -> Solution {
        let n = scaled.medium.lanes();
        let nodes = self.radius_m.len() * self.sun_zenith.len();
        let mut solution = Solution {
            radius_m: self.radius_m.clone(),
            sun_zenith_deg: self.sun_zenith_deg.clone(),
            degree: scaled.degree,
            polarised_degree: scaled.polarised_degree,
            chosen: scaled.chosen.clone(),
            moments: Vec::new(),
            flux: vec![0.0; self.sun_zenith.len() * n],
        };
        solution.moments = vec![0.0; nodes * solution.moments_per_node() * n];
        solution
    }

    /// Cosines of zenith angles and weights at a height: below the horizon and above it.
    fn zenith_quadrature(&self, radius_m: f64) -> Vec<(f64, f64)> {
        let ratio = (self.radius_m[0] / radius_m).min(1.0);
        let horizon = -(1.0 - ratio * ratio).max(0.0).sqrt();
        let (below, above) = self.directions;
        // Distances from the horizon as t², on both sides: light changes fastest there.
        let side = |n: usize, reach: f64| {
            gauss_legendre(n, 0.0, 1.0)
                .into_iter()
                .map(move |(t, w)| (horizon + reach * t * t, 2.0 * reach.abs() * t * w))
        };
        let mut all: Vec<(f64, f64)> = side(below, -1.0 - horizon).collect();
        all.extend(side(above, 1.0 - horizon));
        all
    }
}

/// Sun zenith angles [deg] that cover a range: a choice of nodes that are the same for every range, so that an answer does
/// not depend on which others were asked for with it. Fine about the terminator, where the light falls fast.
fn sun_angles((from, to): (f64, f64), step_deg: f64) -> Vec<f64> {
    let mut all = vec![0.0];
    let mut z = 0.0;
    while z < 180.0 - 1e-9 {
        let step = match z {
            z if z < 60.0 => 9.0 * step_deg,
            z if z < 75.0 => 4.5 * step_deg,
            z if z < 84.0 => 2.5 * step_deg,
            z if z < 88.0 => 1.5 * step_deg,
            z if z < 102.0 => step_deg,
            z if z < 110.0 => 1.5 * step_deg,
            z if z < 118.0 => 2.5 * step_deg,
            _ => 9.0 * step_deg,
        };
        z = f64::min(z + step, 180.0);
        all.push(z);
    }
    // One more on either side, for cubics.
    let first = all.partition_point(|&z| z <= from).saturating_sub(2);
    let last = (all.partition_point(|&z| z < to) + 1).min(all.len() - 1);
    all[first..=last].to_vec()
}

/// Memory of one thread.
struct Worker<'a> {
    scaled: &'a Scaled,
    problem: &'a Problem<'a>,
    grid: &'a Grid,
    march: March,
    along: Along,
    sunlit: Sunlit,
    targets: Vec<Target>,
    /// Diffuse irradiance of the ground, filled at the lowest altitude, shape (s, lanes).
    flux: Vec<f32>,
    /// Radiance of the targets, and Q and U of polarised light, shape (s, azimuth, components, lanes).
    radiance: Vec<f32>,
    coefficients: Vec<f32>,
    beam: Vec<f32>,
    /// `Ŷ_lm` of the ray without `cos mφ`.
    polar: Vec<f32>,
    /// `cos mφ` of the azimuths, shape (azimuth, degree + 1).
    cosines: Vec<f32>,
    /// `P_l(cos Θ)` of the targets, shape (s, azimuth, degree + 1).
    polynomial: Vec<f32>,
    /// The radiance's sum over azimuths for one order m.
    by_order: Vec<f32>,
    /// The same as the four above, of Q and U: `W_lm`, `X_lm`; `sin mφ`; `d^l_0,2(cos Θ)`; their sums.
    w: Vec<f32>,
    x: Vec<f32>,
    sines: Vec<f32>,
    spin_polynomial: Vec<f32>,
    by_order_q_u: Vec<f32>,
    polarising: Vec<f32>,
}

impl<'a> Worker<'a> {
    fn new(scaled: &'a Scaled, problem: &'a Problem<'a>, grid: &'a Grid) -> Self {
        let n = scaled.medium.lanes();
        let terms = scaled.degree + 1;
        let targets = grid.sun_zenith.len() * grid.cos_phi.len();
        let mut cosines = vec![0.0; grid.cos_phi.len() * terms];
        for (row, &c) in cosines.chunks_exact_mut(terms).zip(&grid.cos_phi) {
            harmonics::cosines(c as f32, row);
        }
        let polarised = scaled.polarised_degree;
        let spin_terms = if polarised > 0 { polarised + 1 } else { 0 };
        let mut sines = vec![0.0; grid.cos_phi.len() * spin_terms];
        for (row, &c) in sines.chunks_exact_mut(spin_terms.max(1)).zip(&grid.cos_phi) {
            spin::sines(c as f32, row);
        }
        Self {
            scaled,
            problem,
            grid,
            march: March::default(),
            along: Along::default(),
            sunlit: Sunlit::new(&scaled.columns, n, problem.sun_radius_rad),
            targets: Vec::with_capacity(targets),
            flux: vec![0.0; grid.sun_zenith.len() * n],
            radiance: vec![0.0; targets * scaled.components() * n],
            coefficients: vec![0.0; terms * n],
            beam: vec![0.0; n],
            polar: vec![0.0; harmonics::count(scaled.degree)],
            cosines,
            polynomial: vec![0.0; targets * terms],
            by_order: vec![0.0; n],
            w: vec![0.0; spin::count(polarised)],
            x: vec![0.0; spin::count(polarised)],
            sines,
            spin_polynomial: vec![0.0; targets * polarised.saturating_sub(1)],
            by_order_q_u: vec![0.0; 2 * n],
            polarising: vec![0.0; scaled.polarising_length()],
        }
    }
}

/// Where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn sweep_altitude<'a, 'b, 'c>(
    worker: &mut Worker<'a>,
    source: &'b Source<'c>,
    a: usize,
    moments: &mut [f32],
) {
    worker.sweep(source, a, moments);
}

impl Worker<'_> {
    /// Moments of the radiance at one height, for all sun angles.
    #[inline(always)]
    fn sweep(&mut self, source: &Source<'_>, a: usize, moments: &mut [f32]) {
        let radius_m = self.grid.radius_m[a];
        for (mu, mu_weight) in self.grid.zenith_quadrature(radius_m) {
            let across = (1.0 - mu * mu).max(0.0).sqrt();
            let ray = Ray {
                origin: Vec3::new(0.0, 0.0, radius_m),
                direction: Vec3::new(across, 0.0, mu),
            };
            let (medium, columns) = (&self.scaled.medium, &self.scaled.columns);
            self.march.cut(medium, columns, &self.grid.levels, &ray);
            self.targets.clear();
            for &zenith in &self.grid.sun_zenith {
                let (sin_sun, cos_sun) = zenith.sin_cos();
                self.targets
                    .extend(self.grid.cos_phi.iter().map(|cos_phi| Target {
                        cos_sun,
                        cos_theta: mu * cos_sun + across * sin_sun * cos_phi,
                    }));
            }
            self.radiance.fill(0.0);
            let stand = Stand {
                radius_m,
                offset_m: 0.0,
            };
            match source {
                Source::Sun => self.add_first_order(mu, stand),
                Source::Field(field) => self.along.add_scattered(
                    (field, self.scaled, &self.grid.bases),
                    self.problem.albedo,
                    &self.march,
                    stand,
                    &self.targets,
                    &mut self.radiance,
                ),
            }
            let weight = mu_weight * self.grid.phi_weight;
            self.add_moments(mu, weight as f32, moments);
            if self.scaled.polarised_degree > 0 {
                self.add_polarised_moments(mu, weight as f32, moments);
            }
            if a == 0 && mu > 0.0 {
                self.add_flux((weight * mu) as f32);
            }
        }
    }

    /// Adds one zenith angle's share of the moments.
    #[inline(always)]
    fn add_moments(&mut self, mu: f64, weight: f32, moments: &mut [f32]) {
        let n = self.scaled.medium.lanes();
        let degree = self.scaled.degree;
        let azimuths = self.grid.cos_phi.len();
        let stride = self.scaled.components() * n;
        let suns = moments.chunks_exact_mut(moments.len() / self.grid.sun_zenith.len());
        self.grid.bases.radiance.polar(degree, mu, &mut self.polar);
        for (node, radiance) in suns.zip(self.radiance.chunks_exact(azimuths * stride)) {
            for m in 0..=degree {
                self.by_order.fill(0.0);
                for (j, l) in radiance.chunks_exact(stride).enumerate() {
                    let c = weight * self.cosines[j * (degree + 1) + m];
                    for (b, &l) in self.by_order.iter_mut().zip(l) {
                        *b += c * l;
                    }
                }
                for l in m..=degree {
                    let k = harmonics::index(l, m);
                    let y = self.polar[k];
                    for (o, &b) in node[k * n..(k + 1) * n].iter_mut().zip(&self.by_order) {
                        *o += y * b;
                    }
                }
            }
        }
    }

    /// Adds one zenith angle's share of the moments of polarisation.
    #[inline(always)]
    fn add_polarised_moments(&mut self, mu: f64, weight: f32, moments: &mut [f32]) {
        let n = self.scaled.medium.lanes();
        let degree = self.scaled.polarised_degree;
        let azimuths = self.grid.cos_phi.len();
        let terms = self.scaled.degree + 1;
        let electric = harmonics::count(self.scaled.degree);
        let magnetic = electric + spin::count(degree);
        let bases = &self.grid.bases;
        bases.polarisation.polar(mu, &mut self.w, &mut self.x);
        let suns = moments.chunks_exact_mut(moments.len() / self.grid.sun_zenith.len());
        for (node, stokes) in suns.zip(self.radiance.chunks_exact(azimuths * 3 * n)) {
            for m in 0..=degree {
                let (by_q, by_u) = self.by_order_q_u.split_at_mut(n);
                by_q.fill(0.0);
                by_u.fill(0.0);
                for (j, row) in stokes.chunks_exact(3 * n).enumerate() {
                    let c = weight * self.cosines[j * terms + m];
                    let s = weight * self.sines[j * (degree + 1) + m];
                    lanes::add_scaled(&row[n..2 * n], c, by_q);
                    lanes::add_scaled(&row[2 * n..], s, by_u);
                }
                for l in m.max(2)..=degree {
                    let k = spin::index(l, m);
                    let (w, x) = (self.w[k], self.x[k]);
                    let to_e = &mut node[(electric + k) * n..(electric + k + 1) * n];
                    lanes::add_scaled(by_q, w, to_e);
                    lanes::add_scaled(by_u, -x, to_e);
                    if m > 0 {
                        let to_b = &mut node[(magnetic + k) * n..(magnetic + k + 1) * n];
                        lanes::add_scaled(by_q, -x, to_b);
                        lanes::add_scaled(by_u, w, to_b);
                    }
                }
            }
        }
    }

    /// Adds one zenith angle's share of the ground's irradiance.
    #[inline(always)]
    fn add_flux(&mut self, weight: f32) {
        let n = self.scaled.medium.lanes();
        let azimuths = self.grid.cos_phi.len();
        let stride = self.scaled.components() * n;
        let suns = self.flux.chunks_exact_mut(n);
        for (flux, radiance) in suns.zip(self.radiance.chunks_exact(azimuths * stride)) {
            for l in radiance.chunks_exact(stride) {
                for (f, &l) in flux.iter_mut().zip(l) {
                    *f += weight * l;
                }
            }
        }
    }

    /// Sunlight scattered once, and reflected by the ground, along the ray cut last.
    #[inline(always)]
    fn add_first_order(&mut self, mu: f64, stand: Stand) {
        let n = self.scaled.medium.lanes();
        let terms = self.scaled.degree + 1;
        let stride = self.scaled.components() * n;
        let spin_terms = self.scaled.polarised_degree.saturating_sub(1);
        let mut polarised_terms = 0;
        if spin_terms > 0 {
            let rows = self.spin_polynomial.chunks_exact_mut(spin_terms);
            for (row, t) in rows.zip(&self.targets) {
                self.grid.bases.polarisation.legendre(t.cos_theta, row);
            }
        }
        for (row, t) in self.polynomial.chunks_exact_mut(terms).zip(&self.targets) {
            legendre(terms - 1, t.cos_theta, row);
        }
        for (step, weights) in self
            .march
            .steps
            .iter()
            .zip(self.march.weights.chunks_exact(n))
        {
            let degree = self
                .scaled
                .coefficients_at(step.radius_m, &mut self.coefficients);
            if spin_terms > 0 {
                let degree = self
                    .scaled
                    .polarising_at(step.radius_m, &mut self.polarising);
                polarised_terms = degree - 1;
            }
            let outs = self.radiance.chunks_exact_mut(stride);
            for (k, ((t, out), p)) in self
                .targets
                .iter()
                .zip(outs)
                .zip(self.polynomial.chunks_exact(terms))
                .enumerate()
            {
                let mu_sun = stand.mu_sun(t, step.distance_m, step.radius_m);
                let beam = &mut self.beam;
                if !self
                    .scaled
                    .sun_transmittance(&mut self.sunlit, step.radius_m, mu_sun, beam)
                {
                    continue;
                }
                for (b, &w) in beam.iter_mut().zip(weights) {
                    *b *= w;
                }
                for (&p, c) in p
                    .iter()
                    .zip(self.coefficients.chunks_exact(n))
                    .take(degree + 1)
                {
                    for ((o, &b), &c) in out.iter_mut().zip(beam.iter()).zip(c) {
                        *o += p * c * b;
                    }
                }
                // Along the plane of view and sun; turned to the vertical one below.
                for l in 0..polarised_terms {
                    let p = self.spin_polynomial[k * spin_terms + l];
                    let f12 = self.polarising[3 * l * n..].iter();
                    for ((q, &b), &c) in out[n..2 * n].iter_mut().zip(beam.iter()).zip(f12) {
                        *q += p * c * b;
                    }
                }
            }
        }
        if spin_terms > 0 {
            self.turn_to_vertical(mu);
        }
        if self.march.meets_ground {
            let ground_m = self.grid.radius_m[0];
            let outs = self.radiance.chunks_exact_mut(stride);
            for (t, out) in self.targets.iter().zip(outs) {
                let mu_sun = stand.mu_sun(t, self.march.length_m, ground_m);
                let beam = &mut self.beam;
                if mu_sun <= -self.problem.sun_radius_rad
                    || !self
                        .scaled
                        .sun_transmittance(&mut self.sunlit, ground_m, mu_sun, beam)
                {
                    continue;
                }
                let factor = (mu_sun.max(0.0) / std::f64::consts::PI) as f32;
                let ground = self.problem.albedo.iter().zip(&self.march.through);
                for ((o, &b), (&a, &t)) in out.iter_mut().zip(beam.iter()).zip(ground) {
                    *o += factor * b * a * t;
                }
            }
        }
    }

    /// Turns what is polarised along the planes of view and sun to the vertical plane of the view.
    #[inline(always)]
    fn turn_to_vertical(&mut self, mu: f64) {
        let n = self.scaled.medium.lanes();
        let azimuths = self.grid.cos_phi.len();
        let outs = self.radiance.chunks_exact_mut(3 * n);
        for (k, (t, out)) in self.targets.iter().zip(outs).enumerate() {
            let [cos2, sin2] = spin::turn(mu, t.cos_sun, self.grid.cos_phi[k % azimuths]);
            let (q, u) = out[n..].split_at_mut(n);
            for (q, u) in q.iter_mut().zip(u) {
                *u = sin2 * *q;
                *q *= cos2;
            }
        }
    }
}
