//! Successive orders of scattering on the grid of a [`Field`].

use std::sync::atomic::{AtomicBool, Ordering};

use multiversion::multiversion;
use rayon::prelude::*;

use super::field::{Field, Solution};
use super::harmonics::{self, gauss_legendre, legendre, Harmonics};
use super::march::{Levels, March};
use super::scaled::{cos_azimuth, Scaled, Sunlit};
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
        let stride =
            grid.sun_zenith.len() * harmonics::count(scaled.degree) * scaled.medium.lanes();
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
    let mut total = first.clone();
    let most = problem.orders.unwrap_or(resolution.max_orders);
    for _ in 1..most {
        let mut next = sweep(Source::Field(&total))?.into_solution();
        add(&mut next.moments, &first.solution().moments);
        add(&mut next.flux, &first.solution().flux);
        let change = largest_change(total.solution(), &next);
        total = Field::new(next);
        if problem.orders.is_none() && change < resolution.converged {
            break;
        }
    }
    Ok(total)
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

/// Largest relative change of the mean radiance at any node that is not dark.
fn largest_change(before: &Solution, after: &Solution) -> f32 {
    let n = after.lanes();
    let row = harmonics::count(after.degree) * n;
    let rows = before
        .moments
        .chunks_exact(row)
        .zip(after.moments.chunks_exact(row));
    rows.map(|(b, a)| {
        let (b, a) = (lanes::sum(&b[..n]), lanes::sum(&a[..n]));
        if a > 0.0 {
            (a - b).abs() / a
        } else {
            0.0
        }
    })
    .fold(0.0, f32::max)
}

/// Heights, sun angles and directions.
struct Grid {
    radius_m: Vec<f64>,
    /// In radians, and in degrees.
    sun_zenith: Vec<f64>,
    sun_zenith_deg: Vec<f64>,
    levels: Levels,
    harmonics: Harmonics,
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
            harmonics: Harmonics::new(scaled.degree),
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
        Solution {
            radius_m: self.radius_m.clone(),
            sun_zenith_deg: self.sun_zenith_deg.clone(),
            degree: scaled.degree,
            chosen: scaled.chosen.clone(),
            moments: vec![0.0; nodes * harmonics::count(scaled.degree) * n],
            flux: vec![0.0; self.sun_zenith.len() * n],
        }
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
            z if z < 70.0 => 6.0 * step_deg,
            z if z < 82.0 => 3.0 * step_deg,
            z if z < 110.0 => step_deg,
            _ => 6.0 * step_deg,
        };
        z = f64::min(z + step, 180.0);
        all.push(z);
    }
    let first = all.partition_point(|&z| z <= from).saturating_sub(1);
    let last = all.partition_point(|&z| z < to).min(all.len() - 1);
    let first = first.min(last - 1);
    all[first..=last].to_vec()
}

/// Memory of one thread.
struct Worker<'a> {
    scaled: &'a Scaled,
    problem: &'a Problem<'a>,
    grid: &'a Grid,
    march: March,
    sunlit: Sunlit,
    /// Diffuse irradiance of the ground, filled at the lowest altitude, shape (s, lanes).
    flux: Vec<f32>,
    radiance: Vec<f32>,
    source: Vec<f32>,
    coefficients: Vec<f32>,
    beam: Vec<f32>,
    harmonic: Vec<f32>,
    polynomial: Vec<f32>,
}

impl<'a> Worker<'a> {
    fn new(scaled: &'a Scaled, problem: &'a Problem<'a>, grid: &'a Grid) -> Self {
        let n = scaled.medium.lanes();
        Self {
            scaled,
            problem,
            grid,
            march: March::default(),
            sunlit: Sunlit::new(&scaled.columns, n, problem.sun_radius_rad),
            flux: vec![0.0; grid.sun_zenith.len() * n],
            radiance: vec![0.0; n],
            source: vec![0.0; n],
            coefficients: vec![0.0; (scaled.degree + 1) * n],
            beam: vec![0.0; n],
            harmonic: vec![0.0; harmonics::count(scaled.degree)],
            polynomial: vec![0.0; scaled.degree + 1],
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
        let n = self.scaled.medium.lanes();
        let rows = harmonics::count(self.scaled.degree) * n;
        let radius_m = self.grid.radius_m[a];
        for (mu, mu_weight) in self.grid.zenith_quadrature(radius_m) {
            let across = (1.0 - mu * mu).sqrt();
            let ray = Ray {
                origin: Vec3::new(0.0, 0.0, radius_m),
                direction: Vec3::new(across, 0.0, mu),
            };
            let (medium, columns) = (&self.scaled.medium, &self.scaled.columns);
            self.march.cut(medium, columns, &self.grid.levels, &ray);
            for (s, &zenith) in self.grid.sun_zenith.iter().enumerate() {
                let (sin_sun, cos_sun) = zenith.sin_cos();
                for j in 0..self.grid.cos_phi.len() {
                    let cos_phi = self.grid.cos_phi[j];
                    let cos_theta = mu * cos_sun + across * sin_sun * cos_phi;
                    self.radiance.fill(0.0);
                    match source {
                        Source::Sun => self.add_first_order(radius_m, cos_sun, cos_theta),
                        Source::Field(field) => {
                            self.add_next_order(field, radius_m, cos_sun, cos_theta);
                        }
                    }
                    let weight = (mu_weight * self.grid.phi_weight) as f32;
                    self.grid.harmonics.evaluate(
                        self.scaled.degree,
                        mu,
                        cos_phi,
                        &mut self.harmonic,
                    );
                    let node = &mut moments[s * rows..(s + 1) * rows];
                    for (row, &y) in node.chunks_exact_mut(n).zip(&self.harmonic) {
                        let w = weight * y;
                        for (m, &l) in row.iter_mut().zip(&self.radiance) {
                            *m += w * l;
                        }
                    }
                    if a == 0 && mu > 0.0 {
                        let w = weight * mu as f32;
                        let row = &mut self.flux[s * n..(s + 1) * n];
                        for (f, &l) in row.iter_mut().zip(&self.radiance) {
                            *f += w * l;
                        }
                    }
                }
            }
        }
    }

    /// Sunlight scattered once, and reflected by the ground, along the ray cut last.
    #[inline(always)]
    fn add_first_order(&mut self, radius_m: f64, cos_sun: f64, cos_theta: f64) {
        let n = self.scaled.medium.lanes();
        legendre(self.scaled.degree, cos_theta, &mut self.polynomial);
        for (k, step) in self.march.steps.iter().enumerate() {
            let mu_sun = (radius_m * cos_sun + step.distance_m * cos_theta) / step.radius_m;
            if !self.scaled.sun_transmittance(
                &mut self.sunlit,
                step.radius_m,
                mu_sun,
                &mut self.beam,
            ) {
                continue;
            }
            let degree = self
                .scaled
                .coefficients_at(step.radius_m, &mut self.coefficients);
            self.source.fill(0.0);
            for (l, c) in self
                .coefficients
                .chunks_exact(n)
                .enumerate()
                .take(degree + 1)
            {
                let p = self.polynomial[l];
                for (s, &c) in self.source.iter_mut().zip(c) {
                    *s += p * c;
                }
            }
            let weights = &self.march.weights[k * n..(k + 1) * n];
            for (((l, &s), &w), &t) in self
                .radiance
                .iter_mut()
                .zip(&self.source)
                .zip(weights)
                .zip(&self.beam)
            {
                *l += s * w * t;
            }
        }
        if self.march.meets_ground {
            let ground_m = self.grid.radius_m[0];
            let mu_sun = (radius_m * cos_sun + self.march.length_m * cos_theta) / ground_m;
            if mu_sun > -self.problem.sun_radius_rad
                && self
                    .scaled
                    .sun_transmittance(&mut self.sunlit, ground_m, mu_sun, &mut self.beam)
            {
                let factor = (mu_sun.max(0.0) / std::f64::consts::PI) as f32;
                for i in 0..n {
                    self.radiance[i] +=
                        factor * self.beam[i] * self.problem.albedo[i] * self.march.through[i];
                }
            }
        }
    }

    /// The light of a field, scattered once more along the ray cut last.
    #[inline(always)]
    fn add_next_order(&mut self, field: &Field, radius_m: f64, cos_sun: f64, cos_theta: f64) {
        let n = self.scaled.medium.lanes();
        for (k, step) in self.march.steps.iter().enumerate() {
            let mu_sun = (radius_m * cos_sun + step.distance_m * cos_theta) / step.radius_m;
            let degree = self
                .scaled
                .coefficients_at(step.radius_m, &mut self.coefficients);
            let cos_phi = cos_azimuth(step.mu, mu_sun, cos_theta);
            self.grid
                .harmonics
                .evaluate(degree, step.mu, cos_phi, &mut self.harmonic);
            let corners = field.corners(step.radius_m, mu_sun);
            self.source.fill(0.0);
            field.add_source(
                &corners,
                degree,
                &self.coefficients,
                &self.harmonic,
                &mut self.source,
            );
            let weights = &self.march.weights[k * n..(k + 1) * n];
            for ((l, &s), &w) in self.radiance.iter_mut().zip(&self.source).zip(weights) {
                *l += s * w;
            }
        }
        if self.march.meets_ground {
            let mu_sun =
                (radius_m * cos_sun + self.march.length_m * cos_theta) / self.grid.radius_m[0];
            self.source.fill(0.0);
            field.add_flux(mu_sun, &mut self.source);
            for i in 0..n {
                self.radiance[i] += self.source[i] * self.problem.albedo[i] * self.march.through[i]
                    / std::f32::consts::PI;
            }
        }
    }
}
