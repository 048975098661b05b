//! The loop over pixels that every Monte Carlo integrator shares: budget, progress, interruption, statistics.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use super::disc::DiscRegion;
use super::scene::Scene;
use crate::error::{check_range, Error, Result};
use crate::film::Film;
use crate::math::{Rng, Sampler, Vec3};
use crate::medium::{Medium, Ray};
use crate::sensor::Sensor;

/// Where the observer stands: straight above the planet's centre along z, x east and y north.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    /// Distance from the planet's centre \[m\].
    pub radius_m: f64,
    /// Whether the sun's disc is seen where it stands.
    pub sun_disc: bool,
}

/// How much work to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Paths per pixel, at least 1; rounded up to whole replicates. The variance needs at least 2.
    pub spp: u32,
    /// Seed of all random numbers: the same seed gives the same bits on any number of threads.
    pub seed: u64,
    /// Number of scatterings and reflections counted; `None` for all.
    pub max_order: Option<u32>,
}

/// Budget, and the two strings by which a caller holds a running job.
pub struct Control<'a> {
    /// How much work to do.
    pub budget: Budget,
    /// Set to `true` to stop the work within milliseconds.
    pub cancel: &'a AtomicBool,
    /// Called from any thread with (work done, work in all), often.
    pub progress: &'a (dyn Fn(u64, u64) + Sync),
}

/// Paths that are handed to an estimator together, and between two looks at the cancel flag: below 50 ms even for long twilight
/// paths.
const BATCH: u32 = 256;

/// Sets the random numbers of the sun's disc apart from those of the paths.
const DISC_STREAM: u64 = 0x5d15_c0ff_5ee0_f1a6;

/// Points across a pixel, each way, at which it is looked whether a sensor sees anything through it.
const VIEW_POINTS: usize = 32;

/// Most points tried for one path through a pixel of which the sensor sees a part only.
const MOST_TRIES: u32 = 1 << 14;

/// Whether a sensor sees anything through a pixel; a part of less than about a thousandth may be missed, and is black.
///
/// `look` is the direction through a point of the pixel, in [0, 1]².
fn sees_anything(look: impl Fn(f64, f64) -> Option<Ray>) -> bool {
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    let place = |k: usize| (k as f64 + 0.5) / VIEW_POINTS as f64;
    let points =
        (0..VIEW_POINTS * VIEW_POINTS).map(|i| (place(i % VIEW_POINTS), place(i / VIEW_POINTS)));
    corners
        .into_iter()
        .chain(points)
        .any(|(u, v)| look(u, v).is_some())
}

/// A ray through a pixel, uniform over the part of it that the sensor sees, and how many points were tried for it: on average
/// the inverse of that part.
///
/// Every path then sees the sky. If those beside it counted as paths that see nothing, a pixel on the rim of a fisheye would be
/// left with a few per cent of its paths, and with an error told from hardly any.
#[inline(always)]
fn ray_through(
    look: impl Fn(f64, f64) -> Option<Ray>,
    sampler: &mut Sampler,
) -> (Option<Ray>, u32) {
    let (mut u, mut v) = (sampler.uniform(), sampler.uniform());
    for tries in 1..=MOST_TRIES {
        if let Some(ray) = look(u, v) {
            return (Some(ray), tries);
        }
        (u, v) = (sampler.rng().uniform(), sampler.rng().uniform());
    }
    (None, MOST_TRIES)
}

/// Where a path begins: its ray, and where it takes its numbers from.
pub(crate) struct Start {
    pub ray: Ray,
    pub sampler: Sampler,
}

/// One unbiased estimate of the light along a ray after another.
pub(crate) trait Estimator {
    /// Called once before a pixel's estimates, with the ray through its centre if that sees anything.
    fn prepare(&mut self, _centre: Option<&Ray>) {}

    /// Stokes components of an estimate: 1 for the radiance alone, 4 for I, Q, U, V.
    const COMPONENTS: usize = 1;

    /// Points of the sun's disc that are looked at for every path through a pixel that shows it.
    const DISC_POINTS: u32;

    /// Adds one estimate of the spectral radiance along each ray, without the sun's disc behind the air, to a row for each
    /// component, one after the other.
    fn add_estimates(&mut self, starts: &mut [Start], out: &mut [f32]);

    /// Adds `factor` times one estimate of the radiance of the sun's disc, behind the air, to the first row.
    ///
    /// `ray` meets the disc where the squared cosine of [`super::SunLight::sample`] is `mu_squared`.
    fn add_disc(&mut self, ray: &Ray, mu_squared: f64, factor: f32, rng: &mut Rng, out: &mut [f32]);
}

/// How a pixel's estimates relate to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sampling {
    /// All independent, from random numbers.
    Independent,
    /// In independent replicates of one scrambled Sobol sequence each; the scatter of their means is the error.
    Replicated,
}

impl Sampling {
    /// Number of replicates and estimates in each, for at least `spp` estimates in all.
    fn split(self, spp: u32) -> (u32, u32) {
        match self {
            Self::Independent => (spp, 1),
            Self::Replicated => {
                // Few replicates make long, even sequences; many make a reliable error. A sequence has 2^16 points.
                let replicates = (spp / 8).clamp(2, 16).min(spp).max(spp.div_ceil(1 << 16));
                (replicates, spp.div_ceil(replicates))
            }
        }
    }
}

/// Renders by asking an estimator for every path; `worker()` makes one for each thread that needs it.
pub(crate) fn monte_carlo<M: Medium, E: Estimator>(
    scene: &Scene<'_, M>,
    observer: &Observer,
    sensor: &dyn Sensor,
    control: &Control<'_>,
    sampling: Sampling,
    worker: impl Fn() -> E + Sync,
) -> Result<Film> {
    let (medium, budget) = (scene.medium, control.budget);
    check_range("spp", f64::from(budget.spp), "", 1.0..=1e9)?;
    let (width, height) = sensor.size();
    let wavelength_nm = medium.wavelength_nm();
    let mut film = match E::COMPONENTS {
        1 => Film::new(width, height, wavelength_nm)?,
        _ => Film::new_polarised(width, height, wavelength_nm)?,
    };
    let total = (width * height) as u64;
    let done = AtomicU64::new(0);
    let origin = Vec3::new(0.0, 0.0, observer.radius_m);
    let (replicates, length) = sampling.split(budget.spp);

    film.pixels_mut()
        .into_par_iter()
        .enumerate()
        .try_for_each_init(
            || {
                let statistics = PixelStatistics::new(E::COMPONENTS * medium.lanes());
                (worker(), statistics, DiscRegion::default(), Vec::new())
            },
            |(estimator, statistics, disc, starts), (pixel, out)| {
                let (row, column) = (pixel / width, pixel % width);
                let direction = |u, v| sensor.direction(column, row, u, v);
                let towards = |direction| Ray { origin, direction };
                let look = |u, v| direction(u, v).map(towards);
                let mut rng = Rng::new(budget.seed, sensor.stream(pixel));
                let scramble = rng.bits();
                statistics.clear();
                estimator.prepare(look(0.5, 0.5).as_ref());
                let replicates = if sees_anything(look) { replicates } else { 0 };
                if observer.sun_disc && replicates > 0 {
                    disc.find(&scene.sun, &direction);
                }
                // Numbers of its own, so that the sky beside the disc is the same without it.
                let mut disc_rng = Rng::new(budget.seed ^ DISC_STREAM, sensor.stream(pixel));
                for replicate in 0..replicates {
                    let (mut seen, mut tried) = (0, 0);
                    for first in (0..length).step_by(BATCH as usize) {
                        if control.cancel.load(Ordering::Relaxed) {
                            return Err(Error::Interrupted);
                        }
                        starts.clear();
                        for index in first..length.min(first + BATCH) {
                            let point = (scramble.wrapping_add(replicate), index);
                            let point = (sampling == Sampling::Replicated).then_some(point);
                            let mut sampler = Sampler::new(rng.fork(), point);
                            let (ray, tries) = ray_through(look, &mut sampler);
                            tried += tries;
                            starts.extend(ray.map(|ray| Start { ray, sampler }));
                        }
                        estimator.add_estimates(starts, &mut statistics.estimate);
                        seen += starts.len() as u32;
                    }
                    if !disc.is_empty() && observer.sun_disc {
                        // Tries per path are, on average, the inverse of the part of the pixel that is seen, and that is what
                        // the mean over this part is divided by.
                        let (points, rng) = (E::DISC_POINTS * length, &mut disc_rng);
                        let out = &mut statistics.estimate;
                        let add = |towards_disc, mu_squared, area: f64, rng: &mut Rng| {
                            let factor = (f64::from(tried) * area) as f32;
                            estimator.add_disc(
                                &towards(towards_disc),
                                mu_squared,
                                factor,
                                rng,
                                out,
                            );
                        };
                        disc.scatter(&scene.sun, &direction, points, rng, add);
                    }
                    statistics.push(seen);
                }
                *out.samples = statistics.samples;
                for (c, (mean, variance)) in out.stokes.into_iter().enumerate() {
                    statistics.mean_into(c * medium.lanes(), mean);
                    statistics.variance_of_mean_into(c * medium.lanes(), variance);
                }
                let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
                (control.progress)(so_far, total);
                Ok(())
            },
        )?;
    Ok(film)
}

/// Sums of one pixel's replicate means and of their squares, f64.
///
/// Means are shifted by the first one, so that squares do not cancel against the squared mean.
struct PixelStatistics {
    /// Sum of the estimates of the replicate under way.
    estimate: Vec<f32>,
    shift: Vec<f64>,
    sum: Vec<f64>,
    sum_of_squares: Vec<f64>,
    replicates: u32,
    samples: u32,
}

impl PixelStatistics {
    fn new(lanes: usize) -> Self {
        Self {
            estimate: vec![0.0; lanes],
            shift: vec![0.0; lanes],
            sum: vec![0.0; lanes],
            sum_of_squares: vec![0.0; lanes],
            replicates: 0,
            samples: 0,
        }
    }

    fn clear(&mut self) {
        self.estimate.fill(0.0);
        self.sum.fill(0.0);
        self.sum_of_squares.fill(0.0);
        self.replicates = 0;
        self.samples = 0;
    }

    /// Takes the mean of a replicate of `n` estimates and zeroes their sum for the next; an empty one does not count.
    fn push(&mut self, n: u32) {
        if n == 0 {
            return;
        }
        let scale = 1.0 / f64::from(n);
        if self.replicates == 0 {
            for (shift, &e) in self.shift.iter_mut().zip(&self.estimate) {
                *shift = f64::from(e) * scale;
            }
        }
        self.replicates += 1;
        self.samples += n;
        let sums = self.sum.iter_mut().zip(&mut self.sum_of_squares);
        for ((sum, squares), (e, &shift)) in sums.zip(self.estimate.iter_mut().zip(&self.shift)) {
            let d = f64::from(*e) * scale - shift;
            *sum += d;
            *squares += d * d;
            *e = 0.0;
        }
    }

    /// Means of the values from `first` on.
    fn mean_into(&self, first: usize, mean: &mut [f32]) {
        let n = f64::from(self.replicates.max(1));
        for (i, m) in (first..).zip(mean) {
            *m = if self.replicates == 0 {
                0.0
            } else {
                (self.shift[i] + self.sum[i] / n) as f32
            };
        }
    }

    fn variance_of_mean_into(&self, first: usize, variance: &mut [f32]) {
        let n = f64::from(self.replicates);
        for (i, v) in (first..).zip(variance) {
            let spread = self.sum_of_squares[i] - self.sum[i] * self.sum[i] / n;
            *v = if self.replicates < 2 {
                0.0
            } else {
                (spread.max(0.0) / (n * (n - 1.0))) as f32
            };
        }
    }
}
