//! The reference integrator for layered media: unbiased, with nothing left to chance that one lookup can tell.
//!
//! Optical depths come from tables of columns (see `medium/columns.rs`), so that
//!
//! * single scattering is a line integral, done by stratified quadrature along the first ray;
//! * every later collision is forced: a path never leaves the air unseen, its weight shrinks instead. Where it collides is drawn
//!   by inverting the optical depth of one wavelength, chosen by what the wavelengths would lose on the way, and divided by the
//!   mean density over all wavelengths (see `weights.rs`);
//! * sunlight at a vertex is attenuated exactly, and the sunlit ground at the end of a way is seen whether the path goes on from there or
//!   not (`docs/decisions/0017-light-found-for-certain.md`).
//!
//! Each path uses a fixed number of random dimensions per vertex, so a scrambled Sobol sequence evens out the first ones.
//! Weights start at the inverse of a first guess of the pixel's own spectrum: choices and Russian roulette then act on
//! relative errors, and no colour is neglected for being dark.

use multiversion::multiversion;

use super::guide::Guide;
use super::present::Peak;
use super::render::{monte_carlo, Control, Estimator, Observer, Sampling, Start};
use super::scene::Scene;
use super::stokes::COMPONENTS;
use super::walker::{Walker, GUIDED_BELOW};
use super::Integrator;
use crate::error::Result;
use crate::film::Film;
use crate::math::Rng;
use crate::medium::{Columns, LayeredMedium, Medium, Ray};
use crate::sensor::Sensor;

/// All wavelengths on one path through concentric shells, every collision forced. Where the sun is low, a coarse solution leads
/// paths to the light.
#[derive(Debug, Clone, Copy, Default)]
pub struct Path;

/// [`Path`] without the coarse solution, for tests of both.
#[derive(Debug, Clone, Copy, Default)]
pub struct UnguidedPath;

impl Integrator<LayeredMedium> for Path {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        render(scene, observer, sensor, control, true)
    }
}

impl Integrator<LayeredMedium> for UnguidedPath {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        render(scene, observer, sensor, control, false)
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
        let (columns, guide, peak) = prepared(scene, observer, control, true);
        let sampling = Sampling::Replicated;
        let orders = control.budget.max_order;
        let walker = || {
            Walker::new(scene, &columns, guide.as_ref(), peak.as_ref(), orders)
                .polarised(self.stokes)
        };
        if self.stokes {
            let worker = || StokesWalker(walker());
            monte_carlo(scene, observer, sensor, control, sampling, worker)
        } else {
            monte_carlo(scene, observer, sensor, control, sampling, walker)
        }
    }
}

fn render(
    scene: &Scene<'_, LayeredMedium>,
    observer: &Observer,
    sensor: &dyn Sensor,
    control: &Control<'_>,
    guided: bool,
) -> Result<Film> {
    let (columns, guide, peak) = prepared(scene, observer, control, guided);
    let orders = control.budget.max_order;
    monte_carlo(
        scene,
        observer,
        sensor,
        control,
        Sampling::Replicated,
        || Walker::new(scene, &columns, guide.as_ref(), peak.as_ref(), orders),
    )
}

/// What all paths of a picture share. From the ground to the top of the air the sun's elevation is that of the observer; from
/// outside any may be seen, and a guide is made in any case.
fn prepared(
    scene: &Scene<'_, LayeredMedium>,
    observer: &Observer,
    control: &Control<'_>,
    guided: bool,
) -> (Columns, Option<Guide>, Option<Peak>) {
    let columns = Columns::new(scene.medium);
    let may_be_low =
        observer.radius_m > scene.medium.top_radius_m() || scene.sun.direction.z < GUIDED_BELOW;
    let guided = guided
        && may_be_low
        && control.budget.max_order.unwrap_or(u32::MAX) > 1
        && scene.background.iter().all(|&l| l == 0.0);
    let peak = Peak::new(scene.medium);
    let guide = guided.then(|| Guide::new(scene, &columns, peak.as_ref()));
    (columns, guide, peak)
}

/// A point of the disc costs some twentieth of a path.
const DISC_POINTS: u32 = 16;

impl Estimator for Walker<'_> {
    fn prepare(&mut self, centre: Option<&Ray>) {
        prepare(self, centre);
    }

    const DISC_POINTS: u32 = DISC_POINTS;

    fn add_estimates(&mut self, starts: &mut [Start], out: &mut [f32]) {
        add_estimates(self, starts, out);
    }

    fn add_disc(
        &mut self,
        ray: &Ray,
        mu_squared: f64,
        factor: f32,
        _rng: &mut Rng,
        out: &mut [f32],
    ) {
        add_disc(self, ray, mu_squared, factor, out);
    }
}

/// A walker of all four Stokes components.
struct StokesWalker<'a>(Walker<'a>);

impl Estimator for StokesWalker<'_> {
    const COMPONENTS: usize = COMPONENTS;

    fn prepare(&mut self, centre: Option<&Ray>) {
        prepare(&mut self.0, centre);
    }

    const DISC_POINTS: u32 = DISC_POINTS;

    fn add_estimates(&mut self, starts: &mut [Start], out: &mut [f32]) {
        add_estimates(&mut self.0, starts, out);
    }

    /// Sunlight is unpolarised, and the air does not change that on a straight way.
    fn add_disc(
        &mut self,
        ray: &Ray,
        mu_squared: f64,
        factor: f32,
        _rng: &mut Rng,
        out: &mut [f32],
    ) {
        add_disc(&mut self.0, ray, mu_squared, factor, out);
    }
}

/// These three are where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn add_estimates<'a>(walker: &mut Walker<'a>, starts: &mut [Start], out: &mut [f32]) {
    walker.walk(starts, out);
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn add_disc<'a>(walker: &mut Walker<'a>, ray: &Ray, mu_squared: f64, factor: f32, out: &mut [f32]) {
    walker.add_disc(ray, mu_squared, factor, out);
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn prepare<'a>(walker: &mut Walker<'a>, centre: Option<&Ray>) {
    walker.prepare(centre);
}
