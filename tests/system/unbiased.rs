//! The three integrators against each other to a standard error of a thousandth, under real skies.

use std::sync::atomic::AtomicBool;

use celaje::climate::{Albedo, Conditions, Overrides};
use celaje::math::Vec3;
use celaje::medium::{LayeredMedium, Medium};
use celaje::sky::PLANET_RADIUS_M;
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Budget, Classic, Control, Integrator, Observer, Path, Scene, Tracker};
use celaje::{Sky, WavelengthGrid};
use celaje_harness::{assert_equal, estimate, seed_from_name};

use crate::scenes::look;
use crate::support::Looks;

/// Independent batches: enough of them to see how skewed they are. Each is a pixel that looks the same way.
const BATCHES: usize = 1024;

/// A sky, where it is seen from and in which direction; thousands of paths of `path`, `tracker` and `classic` in all, and the
/// standard error \[1\] of each at most, relative: a thousandth where that takes minutes, not hours.
struct Case {
    name: &'static str,
    sun_deg: f64,
    aerosol: &'static str,
    aod_550: f64,
    altitude_m: f64,
    look: (f64, f64),
    thousands: [u32; 3],
    budget: [f64; 3],
}

const CASES: [Case; 7] = [
    Case {
        name: "thin: air alone",
        sun_deg: 50.0,
        aerosol: "rural",
        aod_550: 0.0,
        altitude_m: 0.0,
        look: (170.0, 40.0),
        thousands: [128, 9000, 9000],
        budget: [0.001; 3],
    },
    Case {
        name: "thick: smog of optical depth 2",
        sun_deg: 20.0,
        aerosol: "opac:urban",
        aod_550: 2.0,
        altitude_m: 0.0,
        look: (60.0, 30.0),
        thousands: [2500, 26_000, 20_000],
        budget: [0.001; 3],
    },
    Case {
        name: "aureole: 6 degrees beside the sun",
        sun_deg: 40.0,
        aerosol: "opac:continental-average",
        aod_550: 0.3,
        altitude_m: 0.0,
        look: (180.0, 46.0),
        thousands: [100, 3600, 2800],
        budget: [0.001; 3],
    },
    Case {
        name: "sun on the horizon",
        sun_deg: 0.0,
        aerosol: "opac:continental-average",
        aod_550: 0.1,
        altitude_m: 0.0,
        look: (60.0, 5.0),
        thousands: [10_000, 55_000, 18_000],
        budget: [0.001; 3],
    },
    Case {
        name: "twilight: sun 4 degrees under it",
        sun_deg: -4.0,
        aerosol: "rural",
        aod_550: 0.1,
        altitude_m: 0.0,
        look: (180.0, 8.0),
        thousands: [1500, 200_000, 60_000],
        budget: [0.001, 0.001, 0.0015],
    },
    Case {
        name: "from 20 km",
        sun_deg: 10.0,
        aerosol: "opac:continental-average",
        aod_550: 0.2,
        altitude_m: 20_000.0,
        look: (90.0, -10.0),
        thousands: [3000, 5500, 3000],
        budget: [0.001; 3],
    },
    Case {
        name: "from orbit",
        sun_deg: 40.0,
        aerosol: "opac:maritime-clean",
        aod_550: 0.2,
        altitude_m: 400_000.0,
        look: (0.0, -50.0),
        thousands: [1000, 4000, 2400],
        budget: [0.001; 3],
    },
];

fn sky(case: &Case) -> Sky {
    let overrides = Overrides {
        aerosol: Some(case.aerosol.to_owned()),
        aod_550: Some(case.aod_550),
        altitude_m: Some(0.0),
        albedo: Some("0.3".parse::<Albedo>().unwrap()),
        ..Overrides::default()
    };
    let conditions = Conditions::from_sun(case.sun_deg, 180.0, &overrides).unwrap();
    let grid = WavelengthGrid::new(vec![450.0, 650.0]).unwrap();
    Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap()
}

/// Batch means at both wavelengths.
fn run(
    integrator: &dyn Integrator<LayeredMedium>,
    sky: &Sky,
    case: &Case,
    direction: Vec3,
    spp: u32,
    seed: u64,
) -> [Vec<f64>; 2] {
    let scene = Scene::new(&sky.medium, sky.sun.clone(), &sky.albedo).unwrap();
    let observer = Observer {
        radius_m: PLANET_RADIUS_M + case.altitude_m,
        sun_disc: false,
    };
    let control = Control {
        budget: Budget {
            spp,
            seed,
            max_order: None,
        },
        cancel: &AtomicBool::new(false),
        progress: &|_, _| {},
    };
    let sensor = Looks(vec![direction; BATCHES]);
    let film = integrator
        .render(&scene, &observer, &sensor, &control)
        .unwrap();
    [0, 1].map(|lane| {
        (0..BATCHES)
            .map(|b| f64::from(film.spectrum(b)[lane]))
            .collect()
    })
}

/// Rationale: no approximation may hide in any of the three, in thin air and thick, at a forward peak, in twilight, from above.
/// Expected: equal at both wavelengths. Power: each is known to its budget (asserted), 0.1 % but for `tracker` and `classic` in dust and
/// `classic` in twilight, their differences to 0.14 %; in 42 comparisons of all seven scenes a bias of 1.2 % in any is caught 99 % of
/// the time, one of 0.85 % half of the time. False alarms: at most 1.2·10⁻⁵ for all of them together, as far as the batch means are no
/// more skewed than 1.02 (asserted; `docs/testing.md` tells what that does).
fn agree(case: &Case) {
    let sky = sky(case);
    assert_eq!(sky.medium.wavelength_nm().len(), 2);
    let direction = look(case.look.0, case.look.1);
    let integrators: [(&str, &dyn Integrator<LayeredMedium>); 3] = [
        ("path", &Path),
        ("tracker", &Tracker),
        ("classic", &Classic),
    ];
    let mut results = Vec::new();
    for ((name, integrator), thousands) in integrators.into_iter().zip(case.thousands) {
        let seed = seed_from_name(&format!("unbiased {} {name}", case.name));
        let begun = cpu_time::ProcessTime::now();
        let spp = thousands * 1000 / BATCHES as u32;
        let means = run(integrator, &sky, case, direction, spp, seed);
        for (lane, means) in means.iter().enumerate() {
            let e = estimate(means);
            println!(
                "{}, lane {lane}, {name}: {:.5e} ± {:.3} %, skewness {:.2}, {:.0} s of processor",
                case.name,
                e.mean,
                100.0 * e.standard_error / e.mean,
                e.skewness,
                begun.elapsed().as_secs_f64()
            );
        }
        results.push((name, means));
    }
    for (i, (a_name, a)) in results.iter().enumerate() {
        for (k, (b_name, b)) in results[..i].iter().enumerate() {
            let budget = case.budget[i].hypot(case.budget[k]);
            for lane in 0..2 {
                let label = format!("{}, lane {lane}: {a_name} and {b_name}", case.name);
                let (ea, eb) = (estimate(&a[lane]), estimate(&b[lane]));
                println!("{label}: ratio {:.5}", ea.mean / eb.mean);
                assert_equal(&label, &a[lane], &b[lane], budget, 6 * CASES.len());
            }
        }
    }
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn thin_air() {
    agree(&CASES[0]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn thick_smog() {
    agree(&CASES[1]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn aureole() {
    agree(&CASES[2]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn sun_on_the_horizon() {
    agree(&CASES[3]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn twilight() {
    agree(&CASES[4]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn from_20_km() {
    agree(&CASES[5]);
}

#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn from_orbit() {
    agree(&CASES[6]);
}
