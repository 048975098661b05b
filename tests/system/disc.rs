//! The sun's disc in pixels wider than itself.

use std::sync::atomic::AtomicBool;

use celaje::math::{Rng, Vec3};
use celaje::medium::LayeredMedium;
use celaje::sensor::{Fisheye, Sensor};
use celaje::transport::{Budget, Classic, Control, Integrator, Observer, Path, Scene, Tracker};
use celaje_harness::{assert_equal, estimate, seed_from_name, BATCHES};

use crate::scenes::{hazy_air, under_sun, PLANET_RADIUS_M};
use crate::support::Looks;

/// Twelve pixels from horizon to horizon, 15° each.
fn fisheye() -> Fisheye {
    Fisheye::new(12, 12, 180.0).unwrap()
}

/// One pixel of the fisheye, as often as there are batches.
struct Again {
    column: usize,
    row: usize,
}

impl Sensor for Again {
    fn size(&self) -> (usize, usize) {
        (BATCHES, 1)
    }

    fn direction(&self, _column: usize, _row: usize, u: f64, v: f64) -> Option<Vec3> {
        fisheye().direction(self.column, self.row, u, v)
    }
}

/// The disc alone: values of every pixel, shape (pixel, w).
fn disc_alone(
    integrator: &dyn Integrator<LayeredMedium>,
    scene: &Scene<'_, LayeredMedium>,
    sensor: &dyn Sensor,
    spp: u32,
    seed: u64,
) -> Vec<f32> {
    let observer = Observer {
        radius_m: PLANET_RADIUS_M,
        sun_disc: true,
    };
    let control = Control {
        budget: Budget {
            spp,
            seed,
            max_order: Some(0),
        },
        cancel: &AtomicBool::new(false),
        progress: &|_, _| {},
    };
    let film = integrator
        .render(scene, &observer, sensor, &control)
        .unwrap();
    film.radiance
}

/// The plain estimate: directions spread at random over the part of the pixel that is seen, black unless they meet the disc.
fn plainly(scene: &Scene<'_, LayeredMedium>, pixel: &Again, rng: &mut Rng) -> [Vec<f64>; 4] {
    const DIRECTIONS: usize = 1 << 21;
    let mut batches = [(); 4].map(|()| vec![0.0; BATCHES]);
    let (mut hits, mut batch_of) = (Vec::new(), Vec::new());
    for k in 0..DIRECTIONS {
        let direction = loop {
            if let Some(d) = pixel.direction(0, 0, rng.uniform(), rng.uniform()) {
                break d;
            }
        };
        if scene.sun.disc(direction).is_some() {
            hits.push(direction);
            batch_of.push(k % BATCHES);
        }
    }
    let values = disc_alone(&Path, scene, &Looks(hits), 1, 1);
    for (values, &b) in values.chunks_exact(4).zip(&batch_of) {
        for (batches, &v) in batches.iter_mut().zip(values) {
            batches[b] += f64::from(v) * BATCHES as f64 / DIRECTIONS as f64;
        }
    }
    batches
}

/// Rationale: points are put on the disc instead of waiting for paths to meet it; a wrong share of the pixel, a lost strip, a wrong
/// limb would make the sun too bright or too dark. Expected: in a pixel around the disc, in one that has a corner of it, and on the
/// rim, where the sensor sees a part of the pixel and the horizon cuts the disc, the mean is that of the plain estimate, by all
/// three integrators. Power: standard errors are held below 1 %; 8 % would be caught 99 % of the time, less in most values.
#[test]
fn the_disc_in_a_wide_pixel() {
    let medium = hazy_air(0.0, true);
    // Plain tracking needs more: on the horizon it finds a way through the air by luck.
    let integrators: [(&str, &dyn Integrator<LayeredMedium>, u32); 3] = [
        ("path", &Path, 64),
        ("tracker", &Tracker, 512),
        ("classic", &Classic, 512),
    ];
    // The sun stands in the south; rows 6 to 11 of columns 5 and 6 look there.
    for (name, elevation_deg, column, row) in [
        ("inside", 37.0, 5, 9),
        ("corner", 30.0, 6, 10),
        ("rim", 0.5, 5, 11),
    ] {
        let scene = under_sun(&medium, elevation_deg, 0.3, 1.5);
        let pixel = Again { column, row };
        let seed = seed_from_name(&format!("disc {name}"));
        let plain = plainly(&scene, &pixel, &mut Rng::new(seed, 0));
        for (by, integrator, spp) in integrators {
            let values = disc_alone(integrator, &scene, &pixel, spp, seed);
            for lane in [2, 3] {
                let values: Vec<f64> = (0..BATCHES)
                    .map(|b| f64::from(values[b * 4 + lane]))
                    .collect();
                let (own, truth) = (estimate(&values), estimate(&plain[lane]));
                println!(
                    "{name}, {by}, lane {lane}: ratio {:.4}, standard errors {:.4} {:.4}",
                    own.mean / truth.mean,
                    own.standard_error / own.mean,
                    truth.standard_error / truth.mean
                );
                let label = format!("{name}, {by}, lane {lane}");
                assert_equal(&label, &values, &plain[lane], 0.01, 18);
            }
        }
    }
}
