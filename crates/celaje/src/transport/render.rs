//! The loop over pixels that every Monte Carlo integrator shares: budget, progress, interruption, statistics.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::prelude::*;

use crate::error::{check_range, Error, Result};
use crate::film::Film;
use crate::math::{Rng, Vec3};
use crate::medium::Ray;
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
    /// Paths per pixel, at least 1. The variance needs at least 2.
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

/// Paths between two looks at the cancel flag: below 50 ms even for long twilight paths.
const CANCEL_STRIDE: u32 = 64;

/// Renders by calling `sample(ray, rng, radiance)` for every path; it adds one estimate into a zeroed row of f32.
///
/// `worker()` builds a sampler with its scratch memory, once per pixel block.
pub(crate) fn monte_carlo<S>(
    wavelength_nm: &[f64],
    lanes: usize,
    observer: &Observer,
    sensor: &dyn Sensor,
    control: &Control<'_>,
    worker: impl Fn() -> S + Sync,
) -> Result<Film>
where
    S: FnMut(&Ray, bool, &mut Rng, &mut [f32]),
{
    let budget = control.budget;
    check_range("spp", f64::from(budget.spp), "", 1.0..=f64::from(u32::MAX))?;
    let (width, height) = sensor.size();
    let mut film = Film::new(width, height, wavelength_nm)?;
    let w = wavelength_nm.len();
    let total = (width * height) as u64;
    let done = AtomicU64::new(0);
    let origin = Vec3::new(0.0, 0.0, observer.radius_m);

    film.samples
        .par_iter_mut()
        .zip(film.radiance.par_chunks_mut(w))
        .zip(film.variance.par_chunks_mut(w))
        .enumerate()
        .try_for_each_init(
            || (worker(), PixelStatistics::new(lanes)),
            |(sample, statistics), (pixel, ((samples, radiance), variance))| {
                let (row, column) = (pixel / width, pixel % width);
                let mut rng = Rng::new(budget.seed, pixel as u64);
                statistics.clear();
                for n in 0..budget.spp {
                    if n % CANCEL_STRIDE == 0 && control.cancel.load(Ordering::Relaxed) {
                        return Err(Error::Interrupted);
                    }
                    let (u, v) = (rng.uniform(), rng.uniform());
                    let Some(direction) = sensor.direction(column, row, u, v) else {
                        continue;
                    };
                    let ray = Ray { origin, direction };
                    sample(&ray, observer.sun_disc, &mut rng, &mut statistics.estimate);
                    statistics.push();
                }
                *samples = statistics.count;
                statistics.mean_into(radiance);
                statistics.variance_of_mean_into(variance);
                let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
                (control.progress)(so_far, total);
                Ok(())
            },
        )?;
    Ok(film)
}

/// Sums of one pixel's estimates and of their squares, f64.
///
/// Estimates are shifted by the first one, so that squares do not cancel against the squared mean.
struct PixelStatistics {
    estimate: Vec<f32>,
    shift: Vec<f32>,
    sum: Vec<f64>,
    sum_of_squares: Vec<f64>,
    count: u32,
}

impl PixelStatistics {
    fn new(lanes: usize) -> Self {
        Self {
            estimate: vec![0.0; lanes],
            shift: vec![0.0; lanes],
            sum: vec![0.0; lanes],
            sum_of_squares: vec![0.0; lanes],
            count: 0,
        }
    }

    fn clear(&mut self) {
        self.estimate.fill(0.0);
        self.sum.fill(0.0);
        self.sum_of_squares.fill(0.0);
        self.count = 0;
    }

    /// Takes the estimate and zeroes it for the next path.
    fn push(&mut self) {
        if self.count == 0 {
            self.shift.copy_from_slice(&self.estimate);
        }
        self.count += 1;
        let sums = self.sum.iter_mut().zip(&mut self.sum_of_squares);
        for ((sum, squares), (e, &shift)) in sums.zip(self.estimate.iter_mut().zip(&self.shift)) {
            let d = f64::from(*e - shift);
            *sum += d;
            *squares += d * d;
            *e = 0.0;
        }
    }

    fn mean_into(&self, mean: &mut [f32]) {
        let n = f64::from(self.count.max(1));
        for (i, m) in mean.iter_mut().enumerate() {
            *m = if self.count == 0 {
                0.0
            } else {
                (f64::from(self.shift[i]) + self.sum[i] / n) as f32
            };
        }
    }

    fn variance_of_mean_into(&self, variance: &mut [f32]) {
        let n = f64::from(self.count);
        for (i, v) in variance.iter_mut().enumerate() {
            let spread = self.sum_of_squares[i] - self.sum[i] * self.sum[i] / n;
            *v = if self.count < 2 {
                0.0
            } else {
                (spread.max(0.0) / (n * (n - 1.0))) as f32
            };
        }
    }
}
