//! Successive orders of scattering on the grid of a [`Field`].

use std::sync::atomic::{AtomicBool, Ordering};

use multiversion::multiversion;
use rayon::prelude::*;

use super::field::Field;
use super::harmonics::{self, gauss_legendre, legendre, Harmonics};
use super::march::{Levels, March};
use super::scaled::{cos_azimuth, Scaled, Sunlit};
use super::Resolution;
use crate::error::{Error, Result};
use crate::math::{lanes, Vec3};
use crate::medium::{Medium, Ray};

/// What shines on the medium, at the chosen wavelengths.
pub struct Light {
    /// Irradiance above the air, one row.
    pub irradiance: Vec<f32>,
    /// Albedo of the ground, one row.
    pub albedo: Vec<f32>,
    /// Angular radius of the sun.
    pub sun_radius_rad: f64,
}

/// Solves for the moments of all orders of scattering, over a range of sun zenith angles.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn solve(
    scaled: &Scaled,
    light: &Light,
    resolution: &Resolution,
    sun_zenith_deg: (f64, f64),
    cancel: &AtomicBool,
) -> Result<Field> {
    let grid = Grid::new(scaled, resolution, sun_zenith_deg);
    let sweep = |source: Source<'_>| -> Result<Field> {
        let mut field = grid.dark(scaled);
        let stride = field.stride();
        let flux = std::sync::Mutex::new(Vec::new());
        field
            .moments
            .par_chunks_mut(stride)
            .enumerate()
            .try_for_each(|(a, moments)| {
                if cancel.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                let mut worker = Worker::new(scaled, light, &grid);
                sweep_altitude(&mut worker, &source, a, moments);
                if a == 0 {
                    if let Ok(mut f) = flux.lock() {
                        *f = std::mem::take(&mut worker.flux);
                    }
                }
                Ok(())
            })?;
        field.flux = flux.into_inner().unwrap_or_default();
        field.set_references();
        Ok(field)
    };
    let first = sweep(Source::Sun)?;
    let mut total = first.clone();
    for _ in 0..resolution.max_orders {
        let mut next = sweep(Source::Field(&total))?;
        add(&mut next.moments, &first.moments);
        add(&mut next.flux, &first.flux);
        next.set_references();
        let change = largest_change(&total, &next);
        total = next;
        if change < resolution.converged {
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
fn largest_change(before: &Field, after: &Field) -> f32 {
    let row = harmonics::count(after.degree) * after.lanes;
    let rows = before
        .moments
        .chunks_exact(row)
        .zip(after.moments.chunks_exact(row));
    rows.map(|(b, a)| {
        let (b, a) = (lanes::sum(&b[..after.lanes]), lanes::sum(&a[..after.lanes]));
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
    sun_zenith: Vec<f64>,
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
        Self {
            radius_m,
            sun_zenith: sun_angles(sun_zenith_deg, resolution.sun_step_deg),
            levels: Levels::new(&scaled.medium, resolution.level_m, resolution.level_growth),
            harmonics: Harmonics::new(scaled.degree),
            cos_phi: (0..azimuths)
                .map(|j| ((j as f64 + 0.5) * std::f64::consts::PI / azimuths as f64).cos())
                .collect(),
            phi_weight: 2.0 * std::f64::consts::PI / azimuths as f64,
            directions: resolution.directions,
        }
    }

    fn dark(&self, scaled: &Scaled) -> Field {
        Field::new(
            self.radius_m.clone(),
            self.sun_zenith.clone(),
            scaled.degree,
            scaled.medium.lanes(),
        )
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

/// Sun zenith angles [rad] over a range [deg]: fine about the terminator, where the light falls fast.
fn sun_angles((from, to): (f64, f64), step_deg: f64) -> Vec<f64> {
    let mut angles = vec![from.max(0.0)];
    let mut z = from.max(0.0);
    while z < to.min(180.0) - 1e-9 {
        let step = match z {
            z if z < 70.0 => 6.0 * step_deg,
            z if z < 82.0 => 3.0 * step_deg,
            z if z < 110.0 => step_deg,
            _ => 6.0 * step_deg,
        };
        z = (z + step).min(to.min(180.0));
        angles.push(z);
    }
    angles.iter().map(|d| d.to_radians()).collect()
}

/// Memory of one thread.
struct Worker<'a> {
    scaled: &'a Scaled,
    light: &'a Light,
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
    fn new(scaled: &'a Scaled, light: &'a Light, grid: &'a Grid) -> Self {
        let n = scaled.medium.lanes();
        Self {
            scaled,
            light,
            grid,
            march: March::default(),
            sunlit: Sunlit::new(&scaled.columns, n, light.sun_radius_rad),
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
            let lit = self.beam.iter().zip(&self.light.irradiance);
            for (((l, &s), &w), (&t, &e)) in self
                .radiance
                .iter_mut()
                .zip(&self.source)
                .zip(weights)
                .zip(lit)
            {
                *l += s * w * t * e;
            }
        }
        if self.march.meets_ground {
            let ground_m = self.grid.radius_m[0];
            let mu_sun = (radius_m * cos_sun + self.march.length_m * cos_theta) / ground_m;
            if mu_sun > -self.light.sun_radius_rad
                && self
                    .scaled
                    .sun_transmittance(&mut self.sunlit, ground_m, mu_sun, &mut self.beam)
            {
                let factor = (mu_sun.max(0.0) / std::f64::consts::PI) as f32;
                for i in 0..n {
                    self.radiance[i] += factor
                        * self.beam[i]
                        * self.light.irradiance[i]
                        * self.light.albedo[i]
                        * self.march.through[i];
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
                self.radiance[i] += self.source[i] * self.light.albedo[i] * self.march.through[i]
                    / std::f32::consts::PI;
            }
        }
    }
}
