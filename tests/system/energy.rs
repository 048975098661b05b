//! Energy in = absorbed by the air + absorbed by the ground + escaped, over the whole planet.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use celaje::math::{Rng, Vec3};
use celaje::medium::{LayeredMedium, Medium};
use celaje::sensor::Sensor;
use celaje::transport::{Budget, Control, Integrator, Observer, Path, Tracker};
use celaje_harness::{assert_unbiased, estimate, seed_from_name, BATCHES};

use crate::scenes::{hazy_air, under_sun, WAVELENGTH_NM};

/// Sees the whole sphere or one hemisphere through its single pixel.
enum Meter {
    /// Every direction alike: the mean radiance is the actinic flux over 4π.
    Sphere,
    /// By the cosine about +z or −z: the mean radiance is the irradiance over π.
    Hemisphere(f64),
}

impl Sensor for Meter {
    fn size(&self) -> (usize, usize) {
        (1, 1)
    }

    fn direction(&self, _column: usize, _row: usize, u: f64, v: f64) -> Option<Vec3> {
        let z = match self {
            Meter::Sphere => 2.0 * u - 1.0,
            Meter::Hemisphere(sign) => sign * u.sqrt(),
        };
        let (sin, cos) = (2.0 * PI * v).sin_cos();
        let horizontal = (1.0 - z * z).sqrt();
        Some(Vec3::new(horizontal * cos, horizontal * sin, z))
    }
}

const ALBEDO: f64 = 0.3;

/// The height of a random point of the air \[m\] and its density there \[m⁻¹\]: half from the haze's exponential, half from a
/// logistic distribution about the ozone; `u` uniform in (0, 1). Heights outside the air are drawn too, and count nothing.
fn random_height(u: f64) -> (f64, f64) {
    const HAZE_M: f64 = 1500.0;
    const OZONE_M: f64 = 22_000.0;
    const WIDTH_M: f64 = 3500.0;
    let h = if u < 0.5 {
        -HAZE_M * (1.0 - 2.0 * u).ln()
    } else {
        let v = (2.0 * u - 1.0).max(1e-12);
        OZONE_M + WIDTH_M * (v / (1.0 - v)).ln()
    };
    let haze = if h >= 0.0 {
        (-h / HAZE_M).exp() / HAZE_M
    } else {
        0.0
    };
    let e = (-(h - OZONE_M).abs() / WIDTH_M).exp();
    let ozone = e / (WIDTH_M * (1.0 + e).powi(2));
    (h, 0.5 * haze + 0.5 * ozone)
}

/// Batch means of absorbed + escaped over incoming, shape (wavelength, batch).
fn balance(
    name: &str,
    integrator: &dyn Integrator<LayeredMedium>,
    places: usize,
    spp: u32,
) -> Vec<Vec<f64>> {
    let medium = hazy_air(0.5, true);
    let mut scene = under_sun(&medium, 30.0, ALBEDO, 45.0);
    let (ground, top) = (medium.ground_radius_m(), medium.top_radius_m());
    let mut rng = Rng::new(seed_from_name(&format!("energy balance {name}")), 0);
    let mut means = vec![vec![0.0; BATCHES]; WAVELENGTH_NM.len()];
    let (mut sigma_t, mut sigma_s) = (vec![0.0; medium.lanes()], vec![0.0; medium.lanes()]);
    let area = |radius: f64| 4.0 * PI * radius.powi(2);
    for sample in 0..BATCHES * places {
        let (batch, place) = (sample / places, sample % places);
        // A random place on the planet is a random sun above a fixed one. The places of a batch are stratified in the
        // sun's height and, in another order, in the height above the ground.
        let stratum = |k: usize, u: f64| ((k % places) as f64 + u) / places as f64;
        let z = 2.0 * stratum(place, rng.uniform()) - 1.0;
        let (sin, cos) = (2.0 * PI * rng.uniform()).sin_cos();
        let across = (1.0 - z * z).sqrt();
        scene.sun.direction = Vec3::new(across * cos, across * sin, z);
        let (h, density) = random_height(stratum(13 * place + batch, rng.uniform()));
        let mean = |radius_m: f64, meter: Meter| {
            let control = Control {
                budget: Budget {
                    spp,
                    seed: sample as u64,
                    max_order: None,
                },
                cancel: &AtomicBool::new(false),
                progress: &|_, _| {},
            };
            let observer = Observer {
                radius_m,
                sun_disc: true,
            };
            integrator
                .render(&scene, &observer, &meter, &control)
                .unwrap()
                .radiance
        };
        let escaped = mean(top, Meter::Hemisphere(-1.0));
        let reached_ground = mean(ground, Meter::Hemisphere(1.0));
        let in_air = h > 0.0 && ground + h < top;
        let actinic = in_air.then(|| mean(ground + h, Meter::Sphere));
        let at = Vec3::new(0.0, 0.0, ground + h);
        medium.extinction_and_scattering(at, &mut sigma_t, &mut sigma_s);
        for (lane, means) in means.iter_mut().enumerate() {
            let mut sinks = area(top) * PI * f64::from(escaped[lane])
                + area(ground) * PI * (1.0 - ALBEDO) * f64::from(reached_ground[lane]);
            if let Some(actinic) = &actinic {
                let absorption = f64::from(sigma_t[lane] - sigma_s[lane]);
                sinks +=
                    area(ground + h) / density * absorption * 4.0 * PI * f64::from(actinic[lane]);
            }
            means[batch] += sinks / (PI * top.powi(2)) / places as f64;
        }
    }
    means
}

/// Rationale: the balance ties scattering, absorption, reflection and the sun's disc together at once. Expected: the sum
/// of the three sinks is `π R² E` at every wavelength. The sun is a disc of 45° so that random directions meet it. Power:
/// standard errors are held below 1 %, where 8 % of imbalance is caught 99 % of the time.
#[test]
fn what_comes_in_goes_somewhere() {
    // Path makes its tables anew for every sun, so it gets few places with more paths each.
    let integrators: [(&str, &dyn Integrator<_>, usize, u32); 2] =
        [("path", &Path, 8, 512), ("tracker", &Tracker, 512, 8)];
    for (name, integrator, places, spp) in integrators {
        let means = balance(name, integrator, places, spp);
        for (wavelength_nm, batch_means) in WAVELENGTH_NM.iter().zip(&means) {
            let e = estimate(batch_means);
            println!(
                "{name}, {wavelength_nm} nm: {:.4} ± {:.4}",
                e.mean, e.standard_error
            );
            let label = format!("energy by {name} at {wavelength_nm} nm");
            assert_unbiased(&label, batch_means, 1.0, 0.01, 8);
        }
    }
}
