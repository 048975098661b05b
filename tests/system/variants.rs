//! The integrators against each other, all orders.

use celaje::transport::{Classic, Tracker};
use celaje_harness::{assert_equal, estimate, seed_from_name, BATCHES};

use crate::scenes::{hazy_air, look, under_sun, PLANET_RADIUS_M};
use crate::support::{batches, value, Job};

/// Rationale: [`Classic`] shares no code with [`Tracker`] but the medium and the rays. Expected: equal in thin and thick air,
/// by day and in twilight, from the ground, the stratosphere and orbit. Power: standard errors below 1.5 % (printed; most
/// are near 0.4 %), so a bias of 11 % at worst and 3 % typically is caught 99 % of the time; the accuracy target runs
/// the same with more paths.
#[test]
fn tracker_equals_classic() {
    let scenes = [
        ("thin", 0.0, 50.0, 0.0),
        ("thick", 1.0, 20.0, 0.0),
        ("low sun", 0.2, 0.0, 0.0),
        ("stratosphere", 0.2, 10.0, 20_000.0),
        ("orbit", 0.2, 40.0, 400_000.0),
    ];
    let looks = [look(170.0, 40.0), look(60.0, 5.0), look(0.0, -25.0)];
    for (name, aerosol_tau, sun_deg, altitude_m) in scenes {
        let medium = hazy_air(aerosol_tau, true);
        let scene = under_sun(&medium, sun_deg, 0.3, 0.27);
        let seen: Vec<_> = looks
            .iter()
            .copied()
            .filter(|l| {
                if altitude_m > 100_000.0 {
                    l.z < -0.4
                } else {
                    altitude_m > 0.0 || l.z > 0.0
                }
            })
            .collect();
        let run = |path: bool, spp: u32| {
            let seed = seed_from_name(&format!("variants {name} {path}"));
            let job = Job {
                seed,
                batches: BATCHES,
                spp,
                max_order: None,
            };
            let radius_m = PLANET_RADIUS_M + altitude_m;
            if path {
                batches(&Tracker, &scene, radius_m, &seen, job)
            } else {
                batches(&Classic, &scene, radius_m, &seen, job)
            }
        };
        let (ours, classic) = (run(true, 2048), run(false, 1024));
        for direction in 0..seen.len() {
            for lane in 0..4 {
                let (a, b) = (
                    value(&ours, direction, lane),
                    value(&classic, direction, lane),
                );
                let (ea, eb) = (estimate(&a), estimate(&b));
                println!(
                    "{name} {direction} {lane}: ratio {:.4} ± {:.4}",
                    ea.mean / eb.mean,
                    ea.standard_error.hypot(eb.standard_error) / eb.mean
                );
                assert_equal(
                    &format!("{name}, direction {direction}, lane {lane}"),
                    &a,
                    &b,
                    0.02,
                    44,
                );
            }
        }
    }
}
