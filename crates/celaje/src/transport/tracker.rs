//! All wavelengths on one path, unbiased in any medium.
//!
//! Distances come from delta tracking under local majorants that bound all wavelengths at once, so tentative collisions
//! fall in the same places for all, and a null collision multiplies each wavelength's weight by its own
//! `1 − σ_t / σ_maj` (Miller, Georgiev & Jarosz 2019, doi:10.1145/3306346.3323025). The sun is met by next-event
//! estimation with ratio-tracked transmittance. How all wavelengths share a path is told in `weights.rs`.

use multiversion::multiversion;

use super::render::{monte_carlo, Control, Estimator, Observer, Sampling, Start};
use super::scene::Scene;
use super::tracking::{tentative_collisions, transmittance};
use super::weights::Weights;
use super::Integrator;
use crate::error::Result;
use crate::film::Film;
use crate::math::{lanes, Rng, Vec3};
use crate::medium::{Medium, Ray, Span};
use crate::sensor::Sensor;

/// All wavelengths on one path through any medium.
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
        monte_carlo(
            scene,
            observer,
            sensor,
            control,
            Sampling::Independent,
            || Walker::new(scene, control.budget.max_order),
        )
    }
}

/// The mean weight, relative to the start, below which Russian roulette begins.
const ROULETTE_BELOW: f32 = 0.4;

/// The one place where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn add_estimate<M: Medium>(walker: &mut Walker<'_, M>, ray: &Ray, rng: &mut Rng, out: &mut [f32]) {
    walker.walk(ray, rng, out);
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
    weights: Weights,
    sigma_t: Vec<f32>,
    sigma_s: Vec<f32>,
}

impl<M: Medium> Estimator for Walker<'_, M> {
    const DISC_POINTS: u32 = 4;

    fn add_estimates(&mut self, starts: &mut [Start], out: &mut [f32]) {
        for Start { ray, sampler } in starts {
            add_estimate(self, ray, sampler.rng(), out);
        }
    }

    fn add_disc(
        &mut self,
        ray: &Ray,
        mu_squared: f64,
        factor: f32,
        rng: &mut Rng,
        out: &mut [f32],
    ) {
        if self.sunlight_is_blocked(ray.origin, ray.direction) {
            return;
        }
        self.weights.light.fill(1.0);
        let factor = f64::from(factor) / self.scene.sun.solid_angle_sr();
        self.add_sunlight(ray.origin, ray.direction, mu_squared, factor, rng, out);
    }
}

impl<'a, M: Medium> Walker<'a, M> {
    fn new(scene: &'a Scene<'a, M>, max_order: Option<u32>) -> Self {
        Self {
            scene,
            max_order: max_order.unwrap_or(u32::MAX),
            weights: Weights::new(scene.medium),
            sigma_t: vec![0.0; scene.medium.lanes()],
            sigma_s: vec![0.0; scene.medium.lanes()],
        }
    }

    /// Adds one unbiased estimate of the radiance arriving along a ray, at every wavelength.
    #[inline(always)]
    fn walk(&mut self, ray: &Ray, rng: &mut Rng, out: &mut [f32]) {
        let medium = self.scene.medium;
        let w = medium.wavelength_nm().len();
        self.weights.weight[..w].fill(1.0);
        self.weights.total = w as f32;
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
                    let u = [rng.uniform(), rng.uniform(), rng.uniform()];
                    let direction = self.weights.scatter(medium, ray.direction, u);
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
                    let turn = std::f64::consts::TAU * rng.uniform();
                    Ray {
                        origin: at,
                        direction: normal.deflected(rng.uniform().sqrt(), turn),
                    }
                }
                (Event::Passed, _) => {
                    self.add_outer_space(out);
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
        let Weights { weight, total, .. } = &mut self.weights;
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
                // The factor σ_s comes with the split over species.
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
            self.weights.split_by_species(medium, ray.at(distance));
        }
        event
    }

    /// Sunlight scattered once more into the path's direction: the split weights × p × transmittance × irradiance.
    #[inline(always)]
    fn add_scattered_sun(&mut self, at: Vec3, direction: Vec3, rng: &mut Rng, out: &mut [f32]) {
        let (towards, mu_squared) = self.scene.sun.sample(rng.uniform(), rng.uniform());
        if self.sunlight_is_blocked(at, towards) {
            return;
        }
        self.weights
            .mix_phases(self.scene.medium, direction.dot(towards));
        self.add_sunlight(at, towards, mu_squared, 1.0, rng, out);
    }

    /// Sunlight reflected by the ground: weights × albedo × cos / π × transmittance × irradiance. The weights take up
    /// the albedo, which is also what the reflected path carries on: cosine sampling leaves no other factor.
    #[inline(always)]
    fn add_reflected_sun(&mut self, at: Vec3, normal: Vec3, rng: &mut Rng, out: &mut [f32]) {
        let w = &mut self.weights;
        for (w, &albedo) in w.weight.iter_mut().zip(&self.scene.albedo) {
            *w *= albedo;
        }
        w.total = lanes::sum(&w.weight);
        let (towards, mu_squared) = self.scene.sun.sample(rng.uniform(), rng.uniform());
        let cosine = normal.dot(towards);
        if cosine <= 0.0 || self.sunlight_is_blocked(at, towards) {
            return;
        }
        let w = &mut self.weights;
        w.light.copy_from_slice(&w.weight);
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
        let Weights { light, scratch, .. } = &mut self.weights;
        let ray = Ray {
            origin: at,
            direction: towards,
        };
        if let Some((span, _)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m()) {
            transmittance(medium, &ray, span, rng, light, scratch);
        }
        sun.limb(mu_squared, light);
        let factor = factor as f32;
        for ((o, &l), &e) in out.iter_mut().zip(light.iter()).zip(&sun.irradiance) {
            *o += l * factor * e;
        }
    }

    /// Light from outside the air, where the path leaves it.
    #[inline(always)]
    fn add_outer_space(&self, out: &mut [f32]) {
        let weights = self.weights.weight.iter().zip(&self.scene.background);
        for (o, (&w, &b)) in out.iter_mut().zip(weights) {
            *o += w * b;
        }
    }

    /// Russian roulette on the sum of the weights.
    #[inline(always)]
    fn survives(&mut self, wavelengths: usize, rng: &mut Rng) -> bool {
        let w = &mut self.weights;
        let survival = w.total / (ROULETTE_BELOW * wavelengths as f32);
        if survival >= 1.0 {
            return true;
        }
        if rng.uniform() as f32 >= survival {
            return false;
        }
        lanes::scale(&mut w.weight, 1.0 / survival);
        w.total /= survival;
        true
    }
}
