//! The reference integrator for layered media: unbiased, with nothing left to chance that one lookup can tell.
//!
//! Optical depths come from tables of columns (see `medium/columns.rs`), so that
//!
//! * single scattering is a line integral, done by stratified quadrature along the first ray;
//! * every later collision is forced: a path never leaves the air unseen, its weight shrinks instead. Where it collides is drawn
//!   by inverting the optical depth of one wavelength, chosen by what the wavelengths would lose on the way, and divided by the
//!   mean density over all wavelengths (see `weights.rs`);
//! * sunlight at a vertex is attenuated exactly.
//!
//! Each path uses a fixed number of random dimensions per vertex, so a scrambled Sobol sequence evens out the first ones.
//! Weights start at the inverse of a first guess of the pixel's own spectrum: choices and Russian roulette then act on
//! relative errors, and no colour is neglected for being dark.

use multiversion::multiversion;

use super::first_order::{sun_columns, FirstOrder};
use super::render::{monte_carlo, Control, Estimator, Observer, Sampling};
use super::scene::Scene;
use super::stokes::{Stokes, COMPONENTS};
use super::weights::Weights;
use super::Integrator;
use crate::error::Result;
use crate::film::Film;
use crate::math::{lanes, Sampler, Vec3};
use crate::medium::{Columns, LayeredMedium, Medium, Ray, RayColumns, Span};
use crate::sensor::Sensor;

/// All wavelengths on one path through concentric shells, every collision forced.
#[derive(Debug, Clone, Copy, Default)]
pub struct Path;

impl Integrator<LayeredMedium> for Path {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let columns = Columns::new(scene.medium);
        monte_carlo(
            scene.medium,
            observer,
            sensor,
            control,
            Sampling::Replicated,
            || Walker::new(scene, &columns, control.budget.max_order),
        )
    }
}

/// [`Path`] with polarisation, by scattering matrices along the same paths.
///
/// Light scattered twice or more was polarised on the way: the radiance itself differs from that of scalar transport, by several
/// per cent in clear blue skies.
#[derive(Debug, Clone, Copy, Default)]
pub struct PolarisedPath {
    /// Whether all Stokes components I, Q, U, V are wanted; the radiance alone is cheaper.
    pub stokes: bool,
}

impl Integrator<LayeredMedium> for PolarisedPath {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let columns = Columns::new(scene.medium);
        let (medium, sampling) = (scene.medium, Sampling::Replicated);
        let max_order = control.budget.max_order;
        let walker = || Walker::new(scene, &columns, max_order).polarised(self.stokes);
        if self.stokes {
            let worker = || StokesWalker(walker());
            monte_carlo(medium, observer, sensor, control, sampling, worker)
        } else {
            monte_carlo(medium, observer, sensor, control, sampling, walker)
        }
    }
}

/// Share of what the first collision could scatter, below which Russian roulette begins; the best of several measured.
const ROULETTE_BELOW: f32 = 0.1;

/// Share of the scattered directions that are drawn about the sun.
const ABOUT_SUN: f64 = 0.2;

/// Sine of the sun's elevation at a vertex above which directions are drawn about it.
const SUN_IN_REACH: f64 = -0.02;

/// A path that has scattered this often is let go on by roulette alone; it only guards against endless loops in a medium
/// that absorbs nothing over a white ground.
const MAX_VERTICES: u32 = 10_000;

/// Rows that both the first order and the later ones work on.
pub(super) struct Rows {
    pub tau: Vec<f32>,
    pub transmittance: Vec<f32>,
    pub sigma_t: Vec<f32>,
    pub columns: Vec<f32>,
    pub start: Vec<f32>,
    pub tangent: Vec<f32>,
    /// Columns of a second ray, towards the sun.
    pub sun_columns: Vec<f32>,
    pub sun_scratch: Vec<f32>,
}

impl Rows {
    fn new(lanes: usize, columns: usize) -> Self {
        Self {
            tau: vec![0.0; lanes],
            transmittance: vec![0.0; lanes],
            sigma_t: vec![0.0; lanes],
            columns: vec![0.0; columns],
            start: vec![0.0; columns],
            tangent: vec![0.0; columns],
            sun_columns: vec![0.0; columns],
            sun_scratch: vec![0.0; columns],
        }
    }
}

/// Walks paths; holds the rows it works on.
struct Walker<'a> {
    scene: &'a Scene<'a, LayeredMedium>,
    columns: &'a Columns,
    max_order: u32,
    first: FirstOrder,
    weights: Weights,
    rows: Rows,
    /// What the first collision could scatter, in all wavelengths.
    first_mass: f32,
    /// Probabilities of the wavelengths to place the next collision.
    lost: Vec<f32>,
    /// What the path finds, still in units of `first.guess`.
    found: Vec<f32>,
    /// What becomes of polarisation, if anyone wants to know.
    stokes: Option<Stokes>,
}

impl Estimator for Walker<'_> {
    fn prepare(&mut self, centre: Option<&Ray>) {
        prepare(self, centre);
    }

    fn add_estimate(&mut self, ray: &Ray, sun_disc: bool, sampler: &mut Sampler, out: &mut [f32]) {
        add_estimate(self, ray, sun_disc, sampler, out);
    }
}

/// A walker of all four Stokes components.
struct StokesWalker<'a>(Walker<'a>);

impl Estimator for StokesWalker<'_> {
    const COMPONENTS: usize = COMPONENTS;

    fn prepare(&mut self, centre: Option<&Ray>) {
        prepare(&mut self.0, centre);
    }

    fn add_estimate(&mut self, ray: &Ray, sun_disc: bool, sampler: &mut Sampler, out: &mut [f32]) {
        add_estimate(&mut self.0, ray, sun_disc, sampler, out);
    }
}

/// These two are where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn add_estimate<'a>(
    walker: &mut Walker<'a>,
    ray: &Ray,
    sun_disc: bool,
    sampler: &mut Sampler,
    out: &mut [f32],
) {
    walker.walk(ray, sun_disc, sampler, out);
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn prepare<'a>(walker: &mut Walker<'a>, centre: Option<&Ray>) {
    walker
        .first
        .prepare(walker.scene, walker.columns, &mut walker.rows, centre);
}

impl<'a> Walker<'a> {
    fn new(
        scene: &'a Scene<'a, LayeredMedium>,
        columns: &'a Columns,
        max_order: Option<u32>,
    ) -> Self {
        let lanes = scene.medium.lanes();
        Self {
            scene,
            columns,
            max_order: max_order.unwrap_or(u32::MAX),
            first: FirstOrder::new(scene.medium),
            weights: Weights::new(scene.medium),
            rows: Rows::new(lanes, columns.count()),
            first_mass: 0.0,
            lost: vec![0.0; lanes],
            found: vec![0.0; lanes],
            stokes: None,
        }
    }

    /// The same, with polarisation; `all` for Q, U and V beside the radiance.
    fn polarised(mut self, all: bool) -> Self {
        self.stokes = Some(Stokes::new(self.scene.medium, all));
        if all {
            self.first.polarise();
        }
        self
    }

    /// Adds one unbiased estimate of the radiance arriving along a ray, at every wavelength.
    #[inline(always)]
    fn walk(&mut self, ray: &Ray, sun_disc: bool, sampler: &mut Sampler, out: &mut [f32]) {
        let medium = self.scene.medium;
        // Light that was not scattered, and light scattered once.
        self.first.add(
            self.scene,
            self.columns,
            &mut self.rows,
            ray,
            (sun_disc, self.max_order >= 1),
            sampler,
            out,
        );
        if self.max_order < 2 {
            return;
        }
        // All later orders.
        let w = medium.wavelength_nm().len();
        for (weight, &guess) in self.weights.weight[..w].iter_mut().zip(&self.first.guess) {
            *weight = 1.0 / guess;
        }
        self.first_mass = 0.0;
        self.found.fill(0.0);
        if let Some(stokes) = &mut self.stokes {
            stokes.start(ray.direction);
        }
        let mut ray = *ray;
        for order in 1..=self.max_order.min(MAX_VERTICES) {
            match self.collide(&ray, order, sampler) {
                Some(next) if order < self.max_order => ray = next,
                _ => break,
            }
        }
        for ((o, &f), &guess) in out.iter_mut().zip(&self.found).zip(&self.first.guess) {
            *o += f * guess;
        }
        if let Some(stokes) = &self.stokes {
            stokes.add_found(&self.first.guess, out);
        }
    }

    /// Forces the next collision, in the air or with the ground; finds the sun there, unless it is the first vertex,
    /// whose sun the line integral has found; and leaves in a new direction.
    ///
    /// `None` when roulette ends the path, or there is nothing to meet.
    #[inline(always)]
    fn collide(&mut self, ray: &Ray, order: u32, sampler: &mut Sampler) -> Option<Ray> {
        let medium = self.scene.medium;
        let (span, meets_ground) =
            ray.through_air(medium.ground_radius_m(), medium.top_radius_m())?;
        let inside = Ray {
            origin: ray.at(span.start_m),
            direction: ray.direction,
        };
        let length_m = span.end_m - span.start_m;

        // What each wavelength loses in the air on the way, and what reaches the ground and comes back.
        let Rows {
            tau,
            transmittance,
            columns,
            start,
            tangent,
            sigma_t,
            ..
        } = &mut self.rows;
        let along = RayColumns::new(self.columns, &inside, start, tangent);
        if meets_ground {
            along.to(length_m, columns);
        } else {
            along.to_space(columns);
        }
        self.columns.optical_depth(columns, tau);
        lanes::exp_neg(tau, transmittance);
        let weight = &mut self.weights.weight;
        for i in 0..weight.len() {
            let t = tau[i];
            let lost = if t < 0.01 {
                t * (1.0 - t * (0.5 - t / 6.0))
            } else {
                1.0 - transmittance[i]
            };
            self.lost[i] = weight[i] * lost;
        }
        let in_air = lanes::sum(&self.lost);
        let mut on_ground = 0.0;
        if !meets_ground && order > 1 {
            let light = &mut self.weights.light;
            for i in 0..weight.len() {
                light[i] = weight[i] * transmittance[i] * self.scene.background[i];
            }
            match &mut self.stokes {
                Some(stokes) => stokes.find_unpolarised(light, &mut self.found),
                None => lanes::add_scaled(light, 1.0, &mut self.found),
            }
        }
        if meets_ground {
            for i in 0..weight.len() {
                transmittance[i] *= weight[i] * self.scene.albedo[i];
            }
            on_ground = lanes::sum(transmittance);
        }
        let mass = in_air + on_ground;
        let (u_event, u_distance, u_roulette) =
            (sampler.uniform(), sampler.uniform(), sampler.uniform());
        if order == 1 {
            self.first_mass = mass;
        }
        let survival = mass / (ROULETTE_BELOW * self.first_mass);
        // Asked this way round, a weight that is not a number ends the path too; so do the two checks below.
        let survives = survival > 0.0 && (u_roulette as f32) < survival;
        if !survives {
            return None;
        }
        let gain = 1.0 / survival.min(1.0);
        let target = u_event as f32 * mass;
        let turn = [sampler.uniform(), sampler.uniform(), sampler.uniform()];
        let sun = [sampler.uniform(), sampler.uniform()];

        if target < on_ground {
            // The ground: everything that arrives there, divided by the probability of going there.
            let scale = gain * mass / on_ground;
            for (w, &arrived) in weight.iter_mut().zip(transmittance.iter()) {
                *w = arrived * scale;
            }
            let at = inside.at(length_m);
            let normal = at.normalized();
            if let Some(stokes) = &mut self.stokes {
                stokes.depolarise();
            }
            if order > 1 {
                self.weights.light.copy_from_slice(&self.weights.weight);
                self.find_sun(at, Vertex::Ground(normal), sun);
            }
            let direction = normal.deflected(turn[0].sqrt(), std::f64::consts::TAU * turn[1]);
            return Some(Ray {
                origin: at,
                direction,
            });
        }

        // The air: one wavelength places the collision.
        let lane = lanes::pick(&self.lost, target - on_ground);
        let tau_end = f64::from(tau[lane]);
        let wanted = -(u_distance * (-tau_end).exp_m1()).ln_1p();
        let span = Span {
            start_m: 0.0,
            end_m: length_m,
        };
        let distance = invert(self.columns, &along, lane, wanted, tau_end, span, columns);
        let at = inside.at(distance);
        self.columns.optical_depth(columns, tau);
        lanes::exp_neg(tau, transmittance);
        medium.extinction(at, sigma_t);
        // Mean density of collisions here over all wavelengths: Σ w σ_t T / mass.
        for (w, &t) in weight.iter_mut().zip(transmittance.iter()) {
            *w *= t;
        }
        let density = lanes::dot(weight, sigma_t);
        if density.is_nan() || density <= 0.0 {
            return None;
        }
        lanes::scale(weight, gain * mass / density);
        self.weights.split_by_species(medium, at);
        let total = self.weights.total;
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        if order > 1 {
            self.find_sun(at, Vertex::Air(inside.direction), sun);
        }
        let towards_sun = self.scene.sun.direction;
        let direction = if at.dot(towards_sun) > SUN_IN_REACH * at.length() {
            self.weights
                .scatter_with_sun(medium, inside.direction, towards_sun, ABOUT_SUN, turn)
        } else {
            self.weights.scatter(medium, inside.direction, turn)
        };
        if let Some(stokes) = &mut self.stokes {
            let Weights {
                split,
                split_sum,
                light,
                ..
            } = &self.weights;
            stokes.scatter(
                medium,
                (split, split_sum),
                light,
                (inside.direction, direction),
            );
        }
        Some(Ray {
            origin: at,
            direction,
        })
    }

    /// Adds the sunlight that a vertex sends into the path: light × p or cos/π × transmittance × irradiance.
    #[inline(always)]
    fn find_sun(&mut self, at: Vec3, vertex: Vertex, u: [f64; 2]) {
        let (medium, sun) = (self.scene.medium, &self.scene.sun);
        let (towards, mu_squared) = sun.sample(u[0], u[1]);
        let factor = match vertex {
            Vertex::Ground(normal) => normal.dot(towards) / std::f64::consts::PI,
            Vertex::Air(_) => 1.0,
        };
        let Rows {
            tau,
            transmittance,
            sun_columns: to_sun,
            sun_scratch,
            ..
        } = &mut self.rows;
        if factor <= 0.0 || !sun_columns(self.columns, medium, at, towards, to_sun, sun_scratch) {
            return;
        }
        if let Vertex::Air(direction) = vertex {
            self.weights.mix_phases(medium, direction.dot(towards));
        }
        self.columns.optical_depth(to_sun, tau);
        lanes::exp_neg(tau, transmittance);
        let Weights {
            split,
            split_sum,
            light,
            scratch,
            ..
        } = &mut self.weights;
        scratch.copy_from_slice(light);
        sun.limb(mu_squared, light);
        let factor = factor as f32;
        for i in 0..light.len() {
            light[i] *= transmittance[i] * sun.irradiance[i] * factor;
        }
        match (&mut self.stokes, vertex) {
            (None, _) => lanes::add_scaled(light, 1.0, &mut self.found),
            (Some(stokes), Vertex::Ground(_)) => stokes.find_unpolarised(light, &mut self.found),
            (Some(stokes), Vertex::Air(direction)) => stokes.find_sun(
                medium,
                (split, split_sum),
                scratch,
                (direction, towards),
                light,
                &mut self.found,
            ),
        }
    }
}

/// What a path meets the sun at.
#[derive(Clone, Copy)]
enum Vertex {
    /// In the air, coming along a direction.
    Air(Vec3),
    /// On the ground, with its normal.
    Ground(Vec3),
}

/// Where along a ray the optical depth at one wavelength reaches a value; leaves the columns up to there.
///
/// Newton's method kept inside a bracket. Rising rays see the air thin out exponentially, so there the step is taken in
/// the logarithm of what remains.
#[inline(always)]
fn invert(
    columns: &Columns,
    along: &RayColumns<'_>,
    lane: usize,
    wanted: f64,
    tau_end: f64,
    span: Span,
    at: &mut [f32],
) -> f64 {
    const ITERATIONS: usize = 40;
    let (mut low, mut high) = (span.start_m, span.end_m);
    let tolerance = 1e-6 + 1e-5 * wanted;
    let rises = along.rises();
    let mut s = low;
    let mut tau = 0.0;
    for _ in 0..ITERATIONS {
        let sigma = along.extinction(s, lane);
        let newton = if rises && tau_end > tau && wanted < tau_end {
            let remains = tau_end - tau;
            s + remains / sigma * (remains / (tau_end - wanted)).ln()
        } else {
            s + (wanted - tau) / sigma
        };
        s = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        along.to(s, at);
        tau = columns.optical_depth_at(at, lane);
        if (tau - wanted).abs() < tolerance {
            break;
        }
        if tau < wanted {
            low = s;
        } else {
            high = s;
        }
    }
    s
}
