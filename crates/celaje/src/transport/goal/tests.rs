//! Rendering towards a goal, with a renderer that only rolls dice: its truth is known, and it is as skewed as one likes.

use std::cell::{Cell, RefCell};
use std::sync::Mutex;

use celaje_harness::{assert_unbiased, estimate, seed_from_name, BATCHES};

use super::*;
use crate::math::statistics::Moments;
use crate::math::Rng;
use crate::sensor::{Directions, Fisheye};

/// A light seen by one path in fifty: mean 1, variance 49, skewness 7.
const CHANCE: f64 = 0.02;

/// Renders by rolling dice, with the streams that the sensor gives.
fn dice(seed: u64) -> impl Fn(&dyn Sensor, u32, &(dyn Fn(u64, u64) + Sync)) -> Result<Film> + Sync {
    move |sensor, spp, progress| {
        let (width, height) = sensor.size();
        let mut film = Film::new(width, height, &[550.0])?;
        for pixel in 0..width * height {
            let seen = sensor.direction(pixel % width, pixel / width, 0.5, 0.5);
            if seen.is_none() {
                continue;
            }
            let mut rng = Rng::new(seed, sensor.stream(pixel));
            let mut moments = Moments::default();
            for _ in 0..spp {
                let hit = rng.uniform() < CHANCE;
                moments.push(if hit { 1.0 / CHANCE } else { 0.0 });
            }
            film.samples[pixel] = spp;
            film.radiance[pixel] = moments.mean() as f32;
            film.variance[pixel] = (moments.variance() / f64::from(spp)) as f32;
            progress(pixel as u64 + 1, (width * height) as u64);
        }
        Ok(film)
    }
}

fn silent() -> Reins<'static> {
    Reins {
        resume: None,
        keep: None,
        progress: &|_, _| {},
    }
}

fn list(n: usize) -> Directions {
    Directions::new(&vec![0.0; n], &vec![30.0; n]).unwrap()
}

fn noise(noise: f64) -> Goal {
    Goal {
        noise: Some(noise),
        time_limit: None,
    }
}

/// Means over the pixels of each of 64 groups.
fn groups(values: &[f32]) -> Vec<f64> {
    let size = values.len() / BATCHES;
    let groups = values.chunks_exact(size);
    groups
        .map(|g| g.iter().map(|&v| f64::from(v)).sum::<f64>() / size as f64)
        .collect()
}

/// Rationale: whoever stops when his own samples look good stops early when they are lucky. Expected: stopped by the other half,
/// 8192 pixels are right on average; stopped by their own noise, they are 4 % too bright (rare light looks less noisy where
/// more of it was met), which shows that the test could see it. Power: the standard error is held below 0.3 %, a bias of 2.2 %
/// is caught 99 % of the time.
#[test]
fn stopping_by_noise_is_unbiased() {
    let look = dice(seed_from_name("stopping by noise"));
    let sensor = list(128 * BATCHES);
    let outcome = render_until(&look, &sensor, 1 << 20, &noise(0.25), silent()).unwrap();
    assert!(outcome.reached);
    let means = groups(&outcome.film.radiance);
    assert_unbiased("stopping by noise", &means, 1.0, 0.003, 1);

    let plain = plainly_stopped(&look, &sensor, 0.25);
    let e = estimate(&groups(&plain));
    println!("plain rule: {:.4} ± {:.4}", e.mean, e.standard_error);
    assert!((e.mean - 1.0).abs() > 7.3 * e.standard_error, "{e:?}");
}

/// The rule that is not used: twice as many paths until a pixel's own noise is small.
fn plainly_stopped(look: Look<'_>, sensor: &dyn Sensor, noise: f64) -> Vec<f32> {
    let n = sensor.size().0;
    let mut all: Option<Film> = None;
    let mut result = vec![f32::NAN; n];
    for (stream, spp) in (1..).zip([512, 512, 1024, 2048, 4096, 8192]) {
        let pixels = (0..n).map(|p| (p, stream)).collect();
        let film = look(&Selected::new(sensor, pixels), spp, &|_, _| {}).unwrap();
        match &mut all {
            None => all = Some(film),
            Some(all) => all.add_pixels(&film, (0..n).map(|p| (p, p)), Weights::Samples),
        }
        let all = all.as_ref().unwrap();
        for (pixel, value) in result.iter_mut().enumerate() {
            let small = all.noise_of(&[pixel]).is_some_and(|own| own <= noise);
            if value.is_nan() && small {
                *value = all.radiance[pixel];
            }
        }
    }
    assert!(result.iter().all(|v| v.is_finite()));
    result
}

/// The variance that is stated is that of the values, though the data chose the number of paths: 10 % is some four of its own
/// standard errors here.
#[test]
fn the_stated_noise_is_true() {
    let look = dice(seed_from_name("stated noise"));
    let sensor = list(128 * BATCHES);
    let film = render_until(&look, &sensor, 1 << 20, &noise(0.25), silent())
        .unwrap()
        .film;
    let n = film.radiance.len() as f64;
    let scatter = film
        .radiance
        .iter()
        .map(|&l| (f64::from(l) - 1.0).powi(2))
        .sum::<f64>()
        / n;
    let stated = film.variance.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
    assert!((stated / scatter - 1.0).abs() < 0.1, "{stated} {scatter}");
    assert!(stated.sqrt() < 0.25, "{stated}");
}

/// A picture in pieces, interrupted after any of them and gone on with, has the bits of one rendered at once.
#[test]
fn an_interrupted_picture_is_the_same_picture() {
    let look = dice(7);
    let sensor = Fisheye::new(45, 37, 180.0).unwrap();
    for goal in [Goal::default(), noise(0.1)] {
        let spp = if goal == Goal::default() { 40 } else { 1 << 20 };
        let whole = render_until(&look, &sensor, spp, &goal, silent()).unwrap();
        if goal == Goal::default() {
            assert!(whole.film == look(&sensor, spp, &|_, _| {}).unwrap());
        }
        for pieces in [1, 2, 3] {
            let kept: RefCell<Option<Partial>> = RefCell::new(None);
            let left = Cell::new(pieces);
            let keep = |partial: &Partial| {
                *kept.borrow_mut() = Some(partial.clone());
                left.set(left.get() - 1);
                if left.get() == 0 {
                    return Err(Error::Interrupted);
                }
                Ok(())
            };
            let reins = Reins {
                keep: Some(&keep),
                ..silent()
            };
            let interrupted = render_until(&look, &sensor, spp, &goal, reins);
            assert!(matches!(interrupted, Err(Error::Interrupted)));
            let kept = kept.into_inner().unwrap();
            assert!(kept.blocks_finished > 0 && kept.blocks_finished < 30);
            let reins = Reins {
                resume: Some(kept),
                keep: Some(&|_| Ok(())),
                ..silent()
            };
            let resumed = render_until(&look, &sensor, spp, &goal, reins).unwrap();
            assert!(resumed == whole);
        }
    }
}

/// Where paths run out first, it is said, and no pixel has more.
#[test]
fn paths_are_a_limit_too() {
    let sensor = list(16);
    let outcome = render_until(&dice(3), &sensor, 1000, &noise(1e-3), silent()).unwrap();
    assert!(!outcome.reached);
    assert!(outcome.film.samples.iter().all(|&n| n == 1000));
}

#[test]
fn time_is_a_limit_too() {
    let sensor = list(200);
    let seen = Mutex::new(Vec::new());
    let goal = Goal {
        noise: None,
        time_limit: Some(Duration::from_millis(400)),
    };
    let begun = Instant::now();
    let reins = Reins {
        progress: &|done, total| seen.lock().unwrap().push((done, total)),
        ..silent()
    };
    let outcome = render_until(&dice(5), &sensor, 1 << 30, &goal, reins).unwrap();
    // A busy machine may halt any batch for as long as it likes; without a limit this would take hours.
    assert!(begun.elapsed() < Duration::from_secs(20));
    let paths = outcome.film.samples[0];
    assert!(paths > 16 && outcome.film.samples.iter().all(|&n| n == paths));
    let seen = seen.into_inner().unwrap();
    assert!(!seen.is_empty() && seen.iter().all(|(done, total)| done < total));

    let both = Goal {
        noise: Some(1e-4),
        ..goal
    };
    let outcome = render_until(&dice(5), &sensor, 1 << 30, &both, silent()).unwrap();
    assert!(!outcome.reached && outcome.film.samples[0] >= 512);
    let keep = Reins {
        keep: Some(&|_| Ok(())),
        ..silent()
    };
    let e = render_until(&dice(5), &sensor, 1, &goal, keep).unwrap_err();
    assert!(!e.hint().is_empty());
}

#[test]
fn progress_ends_with_the_work() {
    let sensor = Fisheye::new(20, 20, 180.0).unwrap();
    for goal in [Goal::default(), noise(0.2)] {
        let shares = Mutex::new(Vec::new());
        let reins = Reins {
            progress: &|done, total| shares.lock().unwrap().push(done as f64 / total as f64),
            keep: Some(&|_| Ok(())),
            ..silent()
        };
        render_until(&dice(2), &sensor, 1 << 16, &goal, reins).unwrap();
        let shares = shares.into_inner().unwrap();
        assert!(shares.iter().all(|s| (0.0..=1.0).contains(s)));
        assert!(shares.last().unwrap() > &0.7, "{:?}", shares.last());
    }
}
