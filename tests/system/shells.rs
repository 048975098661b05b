//! The fast solver against the reference integrator.

use celaje::transport::{Path, Shells};
use celaje_harness::{estimate, seed_from_name};

use crate::scenes::{hazy_air, look, under_sun, PLANET_RADIUS_M};
use crate::support::{batches, value, Job};

/// Rationale: [`Shells`] shares the columns and the phase functions with [`Path`], but solves by quadrature and cut-off
/// peaks what the other samples. Expected: in haze with a narrow forward peak, from a high to a setting sun, from the
/// ground and from the air, directions more than 5° from the sun agree to 1.5 % rms over all and 5 % in any one. Power:
/// [`Path`] is known to 0.6 % rms (asserted), so the bounds bind at discretisation errors, not at noise.
#[test]
fn shells_agree_with_path() {
    let looks = [
        look(180.0, 90.0),
        look(180.0, 55.0),
        look(90.0, 30.0),
        look(0.0, 15.0),
        look(120.0, 6.0),
        look(40.0, -30.0),
    ];
    for (sun_deg, altitude_m) in [(40.0, 0.0), (10.0, 0.0), (1.0, 0.0), (20.0, 12_000.0)] {
        let medium = hazy_air(0.3, true);
        let scene = under_sun(&medium, sun_deg, 0.3, 0.27);
        let seen: Vec<_> = looks
            .iter()
            .copied()
            .filter(|l| altitude_m > 0.0 || l.z > 0.0)
            .collect();
        let radius_m = PLANET_RADIUS_M + altitude_m;
        let name = format!("shells {sun_deg} {altitude_m}");
        let job = |batches, spp| Job {
            seed: seed_from_name(&name),
            batches,
            spp,
            max_order: None,
        };
        let shells = batches(&Shells::default(), &scene, radius_m, &seen, job(1, 1));
        let path = batches(&Path, &scene, radius_m, &seen, job(16, 16_384));
        let (mut squares, mut noise, mut n) = (0.0, 0.0, 0.0);
        for direction in 0..seen.len() {
            for lane in 0..4 {
                let reference = estimate(&value(&path, direction, lane));
                let ours = value(&shells, direction, lane)[0];
                let off = ours / reference.mean - 1.0;
                let error = reference.standard_error / reference.mean;
                println!("{name}, direction {direction}, lane {lane}: {off:+.4} ± {error:.4}");
                assert!(
                    off.abs() < 0.05 + 3.0 * error,
                    "{name}, direction {direction}, lane {lane}: {off}"
                );
                squares += off * off;
                noise += error * error;
                n += 1.0;
            }
        }
        let (rms, noise) = (f64::sqrt(squares / n), f64::sqrt(noise / n));
        println!("{name}: rms {rms:.4}, noise {noise:.4}");
        assert!(
            noise < 0.006,
            "{name}: the reference is known to {noise} only"
        );
        assert!(rms < 0.015, "{name}: rms {rms}");
    }
}
