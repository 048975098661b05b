//! A furnace: nothing absorbs, the ground is white, the same light comes from everywhere. Then the same radiance is
//! everywhere, in every direction.

use celaje::medium::Medium;
use celaje::transport::{Classic, Integrator, Path, Scene, Tracker};
use celaje_harness::{assert_unbiased, seed_from_name, BATCHES};

use crate::scenes::{hazy_air, look, under_sun, PLANET_RADIUS_M};
use crate::support::{batches, value, Job};

fn furnace<'a, M: Medium>(scene: Scene<'a, M>) -> Scene<'a, M> {
    scene.with_background(&[1.0, 2.0, 3.0, 4.0]).unwrap()
}

/// Rationale: any weight lost or gained at a collision, a null collision, a reflection or an escape shows here.
/// Expected: radiance equals the background at every wavelength, altitude and direction. Power: standard errors are held
/// below 0.4 %, so 3.4 % of bias is caught 99 % of the time.
#[test]
fn radiance_is_uniform() {
    let medium = hazy_air(0.5, false);
    let mut scene = under_sun(&medium, 30.0, 1.0, 0.0);
    scene.sun.irradiance.fill(0.0);
    let scene = furnace(scene);
    let looks = [
        look(0.0, 90.0),
        look(40.0, 0.5),
        look(200.0, -0.8),
        look(300.0, -60.0),
    ];
    let integrators: [(&str, &dyn Integrator<_>, u32); 3] = [
        ("path", &Path, 2048),
        ("tracker", &Tracker, 4096),
        ("classic", &Classic, 256),
    ];
    for (name, integrator, spp) in integrators {
        for altitude_m in [1.0, 10_000.0, 120_000.0] {
            let test = format!("white furnace {name} {altitude_m}");
            let job = Job {
                seed: seed_from_name(&test),
                batches: BATCHES,
                spp,
                max_order: None,
            };
            let films = batches(
                integrator,
                &scene,
                PLANET_RADIUS_M + altitude_m,
                &looks,
                job,
            );
            for direction in 0..looks.len() {
                for lane in 0..4 {
                    let truth = (lane + 1) as f64;
                    assert_unbiased(&test, &value(&films, direction, lane), truth, 0.004, 48);
                }
            }
        }
    }
}
