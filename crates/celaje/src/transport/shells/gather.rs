//! From a solved field to pixels.

use std::sync::atomic::{AtomicU64, Ordering};

use multiversion::multiversion;
use rayon::prelude::*;

use super::field::Field;
use super::harmonics;
use super::march::March;
use super::scaled::{cos_azimuth, Sunlit};
use super::tables::Tables;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::math::{lanes, Vec3};
use crate::medium::{Medium, Ray, RayColumns};
use crate::sensor::Sensor;
use crate::transport::render::{Control, Observer};
use crate::transport::scene::SunLight;

/// Points across a pixel, each way, at which the sun's disc is looked for.
const DISC_POINTS: usize = 6;

/// Tables looked at under one sun.
pub struct Gatherer<'a> {
    tables: &'a Tables,
    sun: &'a SunLight,
    /// Orders that are seen: 0, 1, or all of the tables.
    max_order: Option<u32>,
    /// Cubic interpolation from the coarse wavelengths: first of four, and their weights.
    stencil: Vec<(usize, [f32; 4])>,
}

impl<'a> Gatherer<'a> {
    pub fn new(tables: &'a Tables, sun: &'a SunLight, max_order: Option<u32>) -> Self {
        let nm = tables.medium.wavelength_nm();
        let few: Vec<f64> = tables.coarse.chosen.iter().map(|&i| nm[i]).collect();
        Self {
            tables,
            sun,
            max_order,
            stencil: nm.iter().map(|&w| stencil(&few, w)).collect(),
        }
    }

    /// The film of a sensor.
    pub fn render(
        &self,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let (width, height) = sensor.size();
        let nm = self.tables.medium.wavelength_nm();
        let w = nm.len();
        let mut film = Film::new(width, height, nm)?;
        let done = AtomicU64::new(0);
        let total = (width * height) as u64;
        let origin = Vec3::new(0.0, 0.0, observer.radius_m);
        film.samples
            .par_iter_mut()
            .zip(film.radiance.par_chunks_mut(w))
            .enumerate()
            .try_for_each_init(
                || Worker::new(self),
                |worker, (pixel, (samples, out))| {
                    if control.cancel.load(Ordering::Relaxed) {
                        return Err(Error::Interrupted);
                    }
                    let (row, column) = (pixel / width, pixel % width);
                    if let Some(direction) = sensor.direction(column, row, 0.5, 0.5) {
                        let ray = Ray { origin, direction };
                        gather_pixel(worker, &ray);
                        if observer.sun_disc {
                            worker.add_disc(&ray, |u, v| sensor.direction(column, row, u, v));
                        }
                        out.copy_from_slice(&worker.radiance[..w]);
                        *samples = 1;
                    }
                    let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
                    (control.progress)(so_far, total);
                    Ok(())
                },
            )?;
        Ok(film)
    }

    /// Radiances in directions, without the disc, shape (direction, w).
    pub fn radiance(&self, observer_m: f64, directions: &[Vec3]) -> Vec<f32> {
        let w = self.tables.medium.wavelength_nm().len();
        let origin = Vec3::new(0.0, 0.0, observer_m);
        let mut out = vec![0.0; directions.len() * w];
        out.par_chunks_mut(w).zip(directions).for_each_init(
            || Worker::new(self),
            |worker, (out, &direction)| {
                gather_pixel(worker, &Ray { origin, direction });
                out.copy_from_slice(&worker.radiance[..w]);
            },
        );
        out
    }
}

/// Four nodes about a wavelength and the weights of Lagrange's cubic; fewer where there are fewer nodes.
fn stencil(few: &[f64], nm: f64) -> (usize, [f32; 4]) {
    let points = few.len().min(4);
    let below = few.partition_point(|&x| x <= nm);
    let first = below.saturating_sub(points / 2).min(few.len() - points);
    let mut weights = [0.0; 4];
    for i in 0..points {
        let xi = few[first + i];
        weights[i] = (0..points)
            .filter(|&j| j != i)
            .map(|j| (nm - few[first + j]) / (xi - few[first + j]))
            .product::<f64>() as f32;
    }
    (first, weights)
}

/// Memory of one thread.
struct Worker<'a> {
    gatherer: &'a Gatherer<'a>,
    fine_march: March,
    coarse_march: March,
    sunlit: Sunlit,
    radiance: Vec<f32>,
    phase: Vec<f32>,
    sigma_s: Vec<f32>,
    source: Vec<f32>,
    beam: Vec<f32>,
    multiple: Vec<f32>,
    few_source: Vec<f32>,
    coefficients: Vec<f32>,
    harmonic: Vec<f32>,
}

impl<'a> Worker<'a> {
    fn new(gatherer: &'a Gatherer<'a>) -> Self {
        let Tables {
            fine,
            coarse,
            medium,
            ..
        } = gatherer.tables;
        let n = medium.lanes();
        let few = coarse.medium.lanes();
        let degree = fine.degree;
        Self {
            gatherer,
            fine_march: March::default(),
            coarse_march: March::default(),
            sunlit: Sunlit::new(&fine.columns, n, gatherer.sun.angular_radius_rad()),
            radiance: vec![0.0; n],
            phase: vec![0.0; n * medium.phases().len()],
            sigma_s: vec![0.0; n],
            source: vec![0.0; n],
            beam: vec![0.0; n],
            multiple: vec![0.0; few],
            few_source: vec![0.0; few],
            coefficients: vec![0.0; (degree + 1) * few],
            harmonic: vec![0.0; harmonics::count(degree)],
        }
    }
}

/// Where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn gather_pixel<'a>(worker: &mut Worker<'a>, ray: &Ray) {
    worker.gather(ray);
}

impl Worker<'_> {
    /// The radiance along a ray, without the sun's disc.
    #[inline(always)]
    fn gather(&mut self, ray: &Ray) {
        self.radiance.fill(0.0);
        let g = self.gatherer;
        let Tables {
            fine,
            medium,
            levels,
            ..
        } = g.tables;
        if g.max_order == Some(0) {
            return;
        }
        // A ray from space starts where it meets the air.
        let Some((span, _)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m())
        else {
            return;
        };
        let inside = Ray {
            origin: ray.at(span.start_m),
            direction: ray.direction,
        };
        self.fine_march
            .cut(&fine.medium, &fine.columns, levels, &inside);
        self.add_single(&inside);
        if let Some(field) = g.tables.field.as_ref().filter(|_| g.max_order != Some(1)) {
            self.add_multiple(&inside, field);
        }
    }

    /// Sunlight scattered once, with the true phase functions, and reflected by the ground.
    #[inline(always)]
    fn add_single(&mut self, ray: &Ray) {
        let g = self.gatherer;
        let Tables { fine, medium, .. } = g.tables;
        let n = medium.lanes();
        let towards = g.sun.direction;
        let cos_theta = ray.direction.dot(towards);
        for (row, phase) in self.phase.chunks_exact_mut(n).zip(medium.phases()) {
            phase.eval(cos_theta, row);
        }
        for (k, step) in self.fine_march.steps.iter().enumerate() {
            let at = ray.at(step.distance_m);
            let mu_sun = at.dot(towards) / step.radius_m;
            if !fine.sun_transmittance(&mut self.sunlit, step.radius_m, mu_sun, &mut self.beam) {
                continue;
            }
            self.source.fill(0.0);
            for (species, p) in self.phase.chunks_exact(n).enumerate() {
                medium.species_scattering(species, at, &mut self.sigma_s);
                for ((s, &sigma), &p) in self.source.iter_mut().zip(&self.sigma_s).zip(p) {
                    *s += sigma * p;
                }
            }
            let weights = &self.fine_march.weights[k * n..(k + 1) * n];
            let lit = self.beam.iter().zip(&g.sun.irradiance);
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
        if self.fine_march.meets_ground {
            let at = ray.at(self.fine_march.length_m);
            let ground_m = medium.ground_radius_m();
            let mu_sun = at.dot(towards) / at.length();
            if mu_sun > -self.sunlit.radius_rad
                && fine.sun_transmittance(&mut self.sunlit, ground_m, mu_sun, &mut self.beam)
            {
                let factor = (mu_sun.max(0.0) / std::f64::consts::PI) as f32;
                for i in 0..n {
                    self.radiance[i] += factor
                        * self.beam[i]
                        * g.sun.irradiance[i]
                        * g.tables.albedo[i]
                        * self.fine_march.through[i];
                }
            }
        }
    }

    /// The solved source along the ray, at the coarse wavelengths, interpolated to all.
    #[inline(always)]
    fn add_multiple(&mut self, ray: &Ray, field: &Field) {
        let g = self.gatherer;
        let Tables { coarse, levels, .. } = g.tables;
        let n = coarse.medium.lanes();
        let towards = g.sun.direction;
        let cos_theta = ray.direction.dot(towards);
        self.coarse_march
            .cut(&coarse.medium, &coarse.columns, levels, ray);
        self.multiple.fill(0.0);
        for (k, step) in self.coarse_march.steps.iter().enumerate() {
            let mu_sun = ray.at(step.distance_m).dot(towards) / step.radius_m;
            let degree = coarse.coefficients_at(step.radius_m, &mut self.coefficients);
            let cos_phi = cos_azimuth(step.mu, mu_sun, cos_theta);
            g.tables
                .harmonics
                .evaluate(degree, step.mu, cos_phi, &mut self.harmonic);
            let corners = field.corners(step.radius_m, mu_sun);
            self.few_source.fill(0.0);
            field.add_source(
                &corners,
                degree,
                &self.coefficients,
                &self.harmonic,
                &mut self.few_source,
            );
            let weights = &self.coarse_march.weights[k * n..(k + 1) * n];
            for ((l, &s), &w) in self.multiple.iter_mut().zip(&self.few_source).zip(weights) {
                *l += s * w;
            }
        }
        if self.coarse_march.meets_ground {
            let at = ray.at(self.coarse_march.length_m);
            self.few_source.fill(0.0);
            field.add_flux(at.dot(towards) / at.length(), &mut self.few_source);
            for i in 0..n {
                self.multiple[i] +=
                    self.few_source[i] * g.tables.few_albedo[i] * self.coarse_march.through[i]
                        / std::f32::consts::PI;
            }
        }
        // What is smooth in wavelength is the share of the sunlight, not the light.
        for ((l, &(first, w)), &e) in self
            .radiance
            .iter_mut()
            .zip(&g.stencil)
            .zip(&g.sun.irradiance)
        {
            let last = self.multiple.len() - 1;
            let m = |i: usize| self.multiple[(first + i).min(last)];
            let share = w[0] * m(0) + w[1] * m(1) + w[2] * m(2) + w[3] * m(3);
            *l += share.max(0.0) * e;
        }
    }

    /// The sun's disc behind the true air, by its share of the pixel.
    fn add_disc(&mut self, ray: &Ray, look: impl Fn(f64, f64) -> Option<Vec3>) {
        let g = self.gatherer;
        let sun = g.sun;
        let points = (0..DISC_POINTS * DISC_POINTS).filter_map(|i| {
            let place = |k: usize| (k as f64 + 0.5) / DISC_POINTS as f64;
            look(place(i % DISC_POINTS), place(i / DISC_POINTS))
        });
        let (mut seen, mut hits) = (0, Vec::new());
        for direction in points {
            seen += 1;
            if let Some(mu_squared) = sun.disc(direction) {
                hits.push((direction, mu_squared));
            }
        }
        if hits.is_empty() {
            return;
        }
        let medium = &g.tables.medium;
        let columns = &g.tables.true_columns;
        let (mut start, mut tangent, mut through) = (
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
        );
        for (direction, mu_squared) in &hits {
            let view = Ray {
                origin: ray.origin,
                direction: *direction,
            };
            self.beam.fill(1.0);
            if let Some((span, ground)) =
                view.through_air(medium.ground_radius_m(), medium.top_radius_m())
            {
                if ground {
                    continue;
                }
                let inside = Ray {
                    origin: view.at(span.start_m),
                    direction: *direction,
                };
                RayColumns::new(columns, &inside, &mut start, &mut tangent).to_space(&mut through);
                columns.optical_depth(&through, &mut self.source);
                lanes::exp_neg(&self.source, &mut self.beam);
            }
            sun.limb(*mu_squared, &mut self.beam);
            let scale = (1.0 / (sun.solid_angle_sr() * f64::from(seen))) as f32;
            for ((l, &b), &e) in self
                .radiance
                .iter_mut()
                .zip(&self.beam)
                .zip(&sun.irradiance)
            {
                *l += b * e * scale;
            }
        }
    }
}
