//! All wavelengths on one path, unbiased in any medium.
//!
//! A path is sampled for no single wavelength: every decision (collide or not, which species scatters, where to) is
//! drawn from the mean of the wavelengths' own probabilities, each weighted by what that wavelength still carries, and
//! every wavelength's weight is divided by that mean. This is the one-sample balance heuristic over hero wavelengths
//! (Wilkie et al. 2014, doi:10.1111/cgf.12419) with the hero redrawn at every event and summed over analytically:
//! weights stay bounded, their sum changes only by absorption, and no wavelength can be starved.
//!
//! Distances come from delta tracking under local majorants that bound all wavelengths at once, so tentative collisions
//! fall in the same places for all, and a null collision multiplies each wavelength's weight by its own
//! `1 − σ_t / σ_maj` (Miller, Georgiev & Jarosz 2019, doi:10.1145/3306346.3323025). The sun is met by next-event
//! estimation with ratio-tracked transmittance.

use multiversion::multiversion;

use super::render::{monte_carlo, Control, Observer};
use super::scene::Scene;
use super::tracking::{tentative_collisions, transmittance};
use super::Integrator;
use crate::error::Result;
use crate::film::Film;
use crate::math::{lanes, Rng, Vec3};
use crate::medium::{Medium, Ray, Span};
use crate::sensor::Sensor;

/// All wavelengths on one path.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tracker;

impl<M: Medium> Integrator<M> for Tracker {
    fn render(
        &self,
        scene: &Scene<'_, M>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let medium = scene.medium;
        monte_carlo(
            medium.wavelength_nm(),
            medium.lanes(),
            observer,
            sensor,
            control,
            || {
                let mut walker = Walker::new(scene, control.budget.max_order);
                move |ray: &Ray, sun_disc, rng: &mut Rng, out: &mut [f32]| {
                    add_estimate(&mut walker, ray, sun_disc, rng, out);
                }
            },
        )
    }
}

/// The mean weight, relative to the start, below which Russian roulette begins; 0.4 was the best of several measured.
const ROULETTE_BELOW: f32 = 0.4;

/// The one place where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn add_estimate<M: Medium>(
    walker: &mut Walker<'_, M>,
    ray: &Ray,
    sun_disc: bool,
    rng: &mut Rng,
    out: &mut [f32],
) {
    walker.add_estimate(ray, sun_disc, rng, out);
}

/// What stopped a free flight.
enum Event {
    Scattered(f64),
    Passed,
    Absorbed,
}

/// Walks paths; holds the rows it works on.
struct Walker<'a, M: Medium> {
    scene: &'a Scene<'a, M>,
    max_order: u32,
    /// What each wavelength carries.
    weight: Vec<f32>,
    /// Sum of the weights.
    total: f32,
    /// Weights at a vertex split by species, shape (species, lanes), and their sums.
    split: Vec<f32>,
    split_sum: Vec<f32>,
    sigma_t: Vec<f32>,
    sigma_s: Vec<f32>,
    light: Vec<f32>,
    scratch: Vec<f32>,
}

impl<'a, M: Medium> Walker<'a, M> {
    fn new(scene: &'a Scene<'a, M>, max_order: Option<u32>) -> Self {
        let (lanes, species) = (scene.medium.lanes(), scene.medium.phases().len());
        let row = vec![0.0; lanes];
        Self {
            scene,
            max_order: max_order.unwrap_or(u32::MAX),
            weight: row.clone(),
            total: 0.0,
            split: vec![0.0; lanes * species],
            split_sum: vec![0.0; species],
            sigma_t: row.clone(),
            sigma_s: row.clone(),
            light: row.clone(),
            scratch: row,
        }
    }

    /// Adds one unbiased estimate of the radiance arriving along a ray, at every wavelength.
    #[inline(always)]
    fn add_estimate(&mut self, ray: &Ray, sun_disc: bool, rng: &mut Rng, out: &mut [f32]) {
        let medium = self.scene.medium;
        let w = medium.wavelength_nm().len();
        self.weight[..w].fill(1.0);
        self.total = w as f32;
        let mut ray = *ray;
        for order in 0..=self.max_order {
            let through = ray.through_air(medium.ground_radius_m(), medium.top_radius_m());
            let event = match through {
                Some((span, _)) => self.fly(&ray, span, rng),
                None => Event::Passed,
            };
            ray = match (event, through) {
                (Event::Absorbed, _) => return,
                (Event::Scattered(distance), _) => {
                    if order == self.max_order {
                        return;
                    }
                    let at = ray.at(distance);
                    self.add_scattered_sun(at, ray.direction, rng, out);
                    let direction = self.scatter(ray.direction, rng);
                    Ray {
                        origin: at,
                        direction,
                    }
                }
                (Event::Passed, Some((span, true))) => {
                    if order == self.max_order {
                        return;
                    }
                    let at = ray.at(span.end_m);
                    let normal = at.normalized();
                    self.add_reflected_sun(at, normal, rng, out);
                    let direction = normal
                        .deflected(rng.uniform().sqrt(), std::f64::consts::TAU * rng.uniform());
                    Ray {
                        origin: at,
                        direction,
                    }
                }
                (Event::Passed, _) => {
                    self.add_outer_space(ray.direction, order == 0 && sun_disc, out);
                    return;
                }
            };
            if !self.survives(w, rng) {
                return;
            }
        }
    }

    /// Flies to the next collision or through the whole span, updating the weights on the way.
    #[inline(always)]
    fn fly(&mut self, ray: &Ray, span: Span, rng: &mut Rng) -> Event {
        let medium = self.scene.medium;
        let mut event = Event::Passed;
        let (weight, total) = (&mut self.weight, &mut self.total);
        let (sigma_t, sigma_s) = (&mut self.sigma_t, &mut self.sigma_s);
        tentative_collisions(medium, ray, span, rng, |rng, distance, sigma_maj| {
            medium.extinction_and_scattering(ray.at(distance), sigma_t, sigma_s);
            let sigma_maj = sigma_maj as f32;
            // What goes on as null and as scattered; the rest is absorbed, by weight rather than by chance.
            let scattered = lanes::dot(weight, sigma_s);
            let null = (*total * sigma_maj - lanes::dot(weight, sigma_t)).max(0.0);
            let kept = scattered + null;
            if kept <= 0.0 {
                event = Event::Absorbed;
                return false;
            }
            let gain = kept / sigma_maj;
            if rng.uniform() as f32 * kept < scattered {
                // The weights are split over species, and summed again, in `split_by_species`.
                lanes::scale(weight, gain / scattered);
                event = Event::Scattered(distance);
                return false;
            }
            let scale = gain / null;
            for (w, &sigma) in weight.iter_mut().zip(sigma_t.iter()) {
                *w *= (sigma_maj - sigma) * scale;
            }
            *total = lanes::sum(weight);
            true
        });
        if let Event::Scattered(distance) = event {
            self.split_by_species(ray.at(distance));
        }
        event
    }

    /// Splits the weights, times σ_s, over the species present at a scattering vertex.
    #[inline(always)]
    fn split_by_species(&mut self, at: Vec3) {
        let n = self.weight.len();
        self.total = 0.0;
        for (k, row) in self.split.chunks_exact_mut(n).enumerate() {
            self.scene.medium.species_scattering(k, at, row);
            for (v, &w) in row.iter_mut().zip(&self.weight) {
                *v *= w;
            }
            self.split_sum[k] = lanes::sum(row);
            self.total += self.split_sum[k];
        }
    }

    /// Sunlight scattered once more into the path's direction: the split weights × p × transmittance × irradiance.
    #[inline(always)]
    fn add_scattered_sun(&mut self, at: Vec3, direction: Vec3, rng: &mut Rng, out: &mut [f32]) {
        let (towards, mu_squared) = self.scene.sun.sample(rng);
        if self.sunlight_is_blocked(at, towards) {
            return;
        }
        self.mix_phases(direction.dot(towards));
        self.add_sunlight(at, towards, mu_squared, 1.0, rng, out);
    }

    /// Sunlight reflected by the ground: weights × albedo × cos / π × transmittance × irradiance. The weights take up
    /// the albedo, which is also what the reflected path carries on: cosine sampling leaves no other factor.
    #[inline(always)]
    fn add_reflected_sun(&mut self, at: Vec3, normal: Vec3, rng: &mut Rng, out: &mut [f32]) {
        for (w, &albedo) in self.weight.iter_mut().zip(&self.scene.albedo) {
            *w *= albedo;
        }
        self.total = lanes::sum(&self.weight);
        let (towards, mu_squared) = self.scene.sun.sample(rng);
        let cosine = normal.dot(towards);
        if cosine <= 0.0 || self.sunlight_is_blocked(at, towards) {
            return;
        }
        self.light.copy_from_slice(&self.weight);
        self.add_sunlight(
            at,
            towards,
            mu_squared,
            cosine / std::f64::consts::PI,
            rng,
            out,
        );
    }

    /// Whether the planet stands before a point of the sun's disc.
    #[inline(always)]
    fn sunlight_is_blocked(&self, at: Vec3, towards: Vec3) -> bool {
        let medium = self.scene.medium;
        let ray = Ray {
            origin: at,
            direction: towards,
        };
        matches!(
            ray.through_air(medium.ground_radius_m(), medium.top_radius_m()),
            Some((_, true))
        )
    }

    /// `out += light × factor × transmittance × irradiance`; uses up the row `light`.
    #[inline(always)]
    fn add_sunlight(
        &mut self,
        at: Vec3,
        towards: Vec3,
        mu_squared: f64,
        factor: f64,
        rng: &mut Rng,
        out: &mut [f32],
    ) {
        let (medium, sun) = (self.scene.medium, &self.scene.sun);
        let ray = Ray {
            origin: at,
            direction: towards,
        };
        if let Some((span, _)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m()) {
            transmittance(medium, &ray, span, rng, &mut self.light, &mut self.scratch);
        }
        sun.limb(mu_squared, &mut self.light);
        let factor = factor as f32;
        for ((o, &l), &e) in out.iter_mut().zip(&self.light).zip(&sun.irradiance) {
            *o += l * factor * e;
        }
    }

    /// `light = Σ_k split_k p_k(cos θ)` over the species present.
    #[inline(always)]
    fn mix_phases(&mut self, cos_theta: f64) {
        let n = self.weight.len();
        self.light.fill(0.0);
        for (k, phase) in self.scene.medium.phases().iter().enumerate() {
            if self.split_sum[k] > 0.0 {
                phase.eval(cos_theta, &mut self.scratch);
                let split = &self.split[k * n..(k + 1) * n];
                for ((l, &p), &s) in self.light.iter_mut().zip(&self.scratch).zip(split) {
                    *l += p * s;
                }
            }
        }
    }

    /// Draws a direction from the mean of all wavelengths' phase functions and divides the weights by that mean.
    #[inline(always)]
    fn scatter(&mut self, direction: Vec3, rng: &mut Rng) -> Vec3 {
        let n = self.weight.len();
        // One species and one wavelength, by what they carry; which ones is then forgotten.
        let species = lanes::pick(&self.split_sum, rng.uniform() as f32 * self.total);
        let row = &self.split[species * n..(species + 1) * n];
        let lane = lanes::pick(row, rng.uniform() as f32 * self.split_sum[species]);
        let cos_theta = self.scene.medium.phases()[species].sample(lane, rng.uniform());
        self.mix_phases(cos_theta);
        let density = lanes::sum(&self.light);
        // A density of zero (a hole in a table, met by rounding) ends the path.
        let scale = if density > 0.0 {
            self.total / density
        } else {
            0.0
        };
        self.total = if density > 0.0 { self.total } else { 0.0 };
        for (w, &l) in self.weight.iter_mut().zip(&self.light) {
            *w = l * scale;
        }
        direction.deflected(cos_theta, std::f64::consts::TAU * rng.uniform())
    }

    /// Light from outside the air, where the path leaves it.
    #[inline(always)]
    fn add_outer_space(&mut self, direction: Vec3, sun_disc: bool, out: &mut [f32]) {
        for ((o, &w), &b) in out.iter_mut().zip(&self.weight).zip(&self.scene.background) {
            *o += w * b;
        }
        let sun = &self.scene.sun;
        if let (true, Some(mu_squared)) = (sun_disc, sun.disc(direction)) {
            self.light.copy_from_slice(&self.weight);
            sun.limb(mu_squared, &mut self.light);
            let scale = (1.0 / sun.solid_angle_sr()) as f32;
            for ((o, &l), &e) in out.iter_mut().zip(&self.light).zip(&sun.irradiance) {
                *o += l * e * scale;
            }
        }
    }

    /// Russian roulette on the sum of the weights.
    #[inline(always)]
    fn survives(&mut self, wavelengths: usize, rng: &mut Rng) -> bool {
        let survival = self.total / (ROULETTE_BELOW * wavelengths as f32);
        if survival >= 1.0 {
            return true;
        }
        if rng.uniform() as f32 >= survival {
            return false;
        }
        lanes::scale(&mut self.weight, 1.0 / survival);
        self.total /= survival;
        true
    }
}
