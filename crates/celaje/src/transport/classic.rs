//! The textbook integrator: one wavelength at a time, one global majorant.
//!
//! Delta tracking for free paths, ratio tracking towards the sun, next-event estimation at every vertex, Russian
//! roulette on the throughput. Slow and short, in f64: the oracle of every other integrator, and the yardstick of the
//! benchmarks. Nothing is shared between wavelengths but the first ray.

use super::render::{monte_carlo, Control, Estimator, Observer, Sampling, Start};
use super::scene::Scene;
use super::Integrator;
use crate::error::Result;
use crate::film::Film;
use crate::math::{Rng, Vec3};
use crate::medium::{Medium, Ray, Span};
use crate::sensor::Sensor;

/// One wavelength at a time, with a global majorant per wavelength.
#[derive(Debug, Clone, Copy, Default)]
pub struct Classic;

impl<M: Medium> Integrator<M> for Classic {
    fn render(
        &self,
        scene: &Scene<'_, M>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let max_order = control.budget.max_order;
        let w = scene.medium.wavelength_nm().len();
        monte_carlo(
            scene,
            observer,
            sensor,
            control,
            Sampling::Independent,
            || {
                Walkers(
                    (0..w)
                        .map(|lane| Walker::new(scene, lane, max_order))
                        .collect(),
                )
            },
        )
    }
}

/// One walker per wavelength.
struct Walkers<'a, M: Medium>(Vec<Walker<'a, M>>);

impl<M: Medium> Estimator for Walkers<'_, M> {
    const DISC_POINTS: u32 = 4;

    fn add_estimates(&mut self, starts: &mut [Start], out: &mut [f32]) {
        for Start { ray, sampler } in starts {
            for (walker, out) in self.0.iter().zip(&mut *out) {
                *out += walker.radiance(ray, sampler.rng()) as f32;
            }
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
        for (walker, out) in self.0.iter().zip(out) {
            *out += factor * walker.sun_seen(ray, mu_squared, rng) as f32;
        }
    }
}

/// Throughput below which Russian roulette begins.
const ROULETTE_BELOW: f64 = 0.25;

/// Walks paths at one wavelength.
struct Walker<'a, M: Medium> {
    scene: &'a Scene<'a, M>,
    lane: usize,
    majorant: f64,
    max_order: u32,
}

impl<'a, M: Medium> Walker<'a, M> {
    fn new(scene: &'a Scene<'a, M>, lane: usize, max_order: Option<u32>) -> Self {
        Self {
            scene,
            lane,
            majorant: scene.medium.global_majorant(lane),
            max_order: max_order.unwrap_or(u32::MAX),
        }
    }

    /// One unbiased estimate of the radiance arriving along a ray \[W m⁻² sr⁻¹ nm⁻¹\].
    fn radiance(&self, ray: &Ray, rng: &mut Rng) -> f64 {
        let (scene, medium) = (self.scene, self.scene.medium);
        let mut ray = *ray;
        let mut throughput = 1.0;
        let mut radiance = 0.0;
        for order in 0..=self.max_order {
            let through = ray.through_air(medium.ground_radius_m(), medium.top_radius_m());
            let collision = through.and_then(|(span, _)| self.free_path(&ray, span, rng));
            ray = if let Some(distance) = collision {
                if order == self.max_order {
                    break;
                }
                // A collision: scatter, weighted by the single-scattering albedo.
                let at = ray.at(distance);
                let (sigma_t, sigma_s) = medium.coefficients_at(self.lane, at);
                throughput *= sigma_s / sigma_t;
                if throughput == 0.0 {
                    break;
                }
                radiance += throughput * self.sun_scattered(at, ray.direction, sigma_s, rng);
                Ray {
                    origin: at,
                    direction: self.scatter(at, ray.direction, sigma_s, rng),
                }
            } else if let Some((span, true)) = through {
                if order == self.max_order {
                    break;
                }
                // The ground: reflect diffusely.
                let at = ray.at(span.end_m);
                let normal = at.normalized();
                throughput *= f64::from(scene.albedo[self.lane]);
                radiance += throughput * self.sun_reflected(at, normal, rng);
                let direction =
                    normal.deflected(rng.uniform().sqrt(), std::f64::consts::TAU * rng.uniform());
                Ray {
                    origin: at,
                    direction,
                }
            } else {
                // Out of the air: the universe.
                radiance += throughput * f64::from(scene.background[self.lane]);
                break;
            };
            if throughput < ROULETTE_BELOW {
                let survival = throughput / ROULETTE_BELOW;
                if rng.uniform() >= survival {
                    break;
                }
                throughput = ROULETTE_BELOW;
            }
        }
        radiance
    }

    /// Delta tracking under the global majorant.
    fn free_path(&self, ray: &Ray, span: Span, rng: &mut Rng) -> Option<f64> {
        let mut at = span.start_m;
        if self.majorant > 0.0 {
            loop {
                at += rng.exponential() / self.majorant;
                if at >= span.end_m {
                    break;
                }
                let (sigma_t, _) = self.scene.medium.coefficients_at(self.lane, ray.at(at));
                if rng.uniform() * self.majorant < sigma_t {
                    return Some(at);
                }
            }
        }
        None
    }

    /// Ratio tracking under the global majorant, to the edge of the air; 0 behind the planet.
    fn transmittance(&self, from: Vec3, towards: Vec3, rng: &mut Rng) -> f64 {
        let ray = Ray {
            origin: from,
            direction: towards,
        };
        let medium = self.scene.medium;
        let Some((span, ground)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m())
        else {
            return 1.0;
        };
        if ground {
            return 0.0;
        }
        let (mut t, mut at) = (1.0, span.start_m);
        if self.majorant > 0.0 {
            loop {
                at += rng.exponential() / self.majorant;
                if at >= span.end_m {
                    break;
                }
                t *= 1.0 - medium.coefficients_at(self.lane, ray.at(at)).0 / self.majorant;
            }
        }
        t
    }

    /// Irradiance of a point of the sun's disc \[W m⁻² nm⁻¹\], after the air, and its direction.
    fn sunlight(&self, at: Vec3, rng: &mut Rng) -> (Vec3, f64) {
        let sun = &self.scene.sun;
        let (towards, mu_squared) = sun.sample(rng.uniform(), rng.uniform());
        let irradiance = f64::from(sun.irradiance[self.lane]) * sun.limb_at(mu_squared, self.lane);
        (towards, irradiance * self.transmittance(at, towards, rng))
    }

    fn sun_scattered(&self, at: Vec3, direction: Vec3, sigma_s: f64, rng: &mut Rng) -> f64 {
        let (towards, irradiance) = self.sunlight(at, rng);
        let cos_theta = direction.dot(towards);
        let phases = self.scene.medium.phases().iter().enumerate();
        let p: f64 = phases
            .map(|(k, phase)| {
                let share = self.scene.medium.species_scattering_at(k, self.lane, at) / sigma_s;
                share * phase.eval_at(self.lane, cos_theta)
            })
            .sum();
        p * irradiance
    }

    fn sun_reflected(&self, at: Vec3, normal: Vec3, rng: &mut Rng) -> f64 {
        let (towards, irradiance) = self.sunlight(at, rng);
        irradiance * normal.dot(towards).max(0.0) / std::f64::consts::PI
    }

    /// Radiance of a point of the sun's disc, after the air.
    fn sun_seen(&self, ray: &Ray, mu_squared: f64, rng: &mut Rng) -> f64 {
        let sun = &self.scene.sun;
        let irradiance = f64::from(sun.irradiance[self.lane]) * sun.limb_at(mu_squared, self.lane);
        irradiance / sun.solid_angle_sr() * self.transmittance(ray.origin, ray.direction, rng)
    }

    /// A new direction: one species by its share of the scattering, then its phase function.
    fn scatter(&self, at: Vec3, direction: Vec3, sigma_s: f64, rng: &mut Rng) -> Vec3 {
        let medium = self.scene.medium;
        let mut target = rng.uniform() * sigma_s;
        let mut chosen = 0;
        for k in 0..medium.phases().len() {
            let share = medium.species_scattering_at(k, self.lane, at);
            if share > 0.0 {
                chosen = k;
                target -= share;
                if target < 0.0 {
                    break;
                }
            }
        }
        let cos_theta = medium.phases()[chosen].sample(self.lane, rng.uniform());
        direction.deflected(cos_theta, std::f64::consts::TAU * rng.uniform())
    }
}
