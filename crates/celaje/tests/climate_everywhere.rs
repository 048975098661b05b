//! The climate as a whole: amounts of aerosol against measured ones, continuity, and speed.

use std::time::Instant as Clock;

use celaje::climate::{aerosol_climate, Conditions, Overrides};
use celaje::math::Table;
use celaje::place::{Instant, Site, SunPosition};
use celaje::sensor::Directions;
use celaje::sky::{Method, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::Budget;
use celaje::{Sky, WavelengthGrid};

const SITES: &str = include_str!("../../../tests/reference/aod_sites.csv");

/// Total optical depth at 550 nm of a year, the mean of its mid-months.
fn annual_aod(latitude_deg: f64, longitude_deg: f64, altitude_m: f64, year: i32) -> f64 {
    let month = |m: i32| {
        let time: Instant = format!("{year}-{m:02}-16T00:00Z").parse().unwrap();
        let found = aerosol_climate(latitude_deg, longitude_deg, altitude_m, &time).unwrap();
        found.aod_550 + found.stratospheric_aod_550
    };
    (1..=12).map(month).sum::<f64>() / 12.0
}

/// Sites of sun photometers: two thirds within a factor of 1.6 or ±0.03 of their published annual means, and none of the
/// clean ones above 0.06.
#[test]
fn optical_depths_are_those_of_measured_sites() {
    let sites = Table::parse("sites", SITES).unwrap();
    let column = |name: &str| sites.numbers(name).unwrap();
    let (lat, lon, alt) = (
        column("latitude_deg"),
        column("longitude_deg"),
        column("altitude_m"),
    );
    let (names, clean) = (sites.words("site").unwrap(), sites.words("clean").unwrap());
    let cited = column("aod_550");
    let mut near = 0;
    println!("{:15} {:>6} {:>6} {:>6}", "site", "cited", "ours", "ratio");
    for i in 0..sites.len() {
        let ours = annual_aod(lat[i], lon[i], alt[i], 2008);
        let ratio = ours / cited[i];
        let fits = (1.0 / 1.6..=1.6).contains(&ratio) || (ours - cited[i]).abs() <= 0.03;
        near += usize::from(fits);
        let (name, mark) = (names[i], if fits { "" } else { " off" });
        println!("{name:15} {:6.3} {ours:6.3} {ratio:6.2}{mark}", cited[i]);
        assert!(clean[i] != "yes" || ours <= 0.06, "{name} is clean: {ours}");
    }
    println!("{near} of {}", sites.len());
    assert!(3 * near >= 2 * sites.len(), "{near} of {}", sites.len());
}

/// A lookup within a millisecond, a year of hours at one place within a second.
#[test]
fn lookups_are_quick() {
    let site = Site::new(41.65, -0.88, 208.0).unwrap();
    let at = |hour: i64| {
        let (day, hour) = (hour / 24, hour % 24);
        // 2026 by months of 28 days or more: no calendar needed.
        let text = format!(
            "2026-{:02}-{:02}T{hour:02}:00Z",
            day / 28 % 12 + 1,
            day % 28 + 1
        );
        Conditions::at(&site, &text.parse().unwrap(), &Overrides::default()).unwrap()
    };
    let start = Clock::now();
    at(0);
    let first = start.elapsed();
    let start = Clock::now();
    let mean: f64 = (0..8760).map(|h| at(h).aod_550.value).sum::<f64>() / 8760.0;
    let year = start.elapsed();
    println!("first lookup {first:?}, a year of hours {year:?} (mean AOD {mean:.3})");
    // The first one reads the tables.
    assert!(year.as_secs_f64() < 1.0, "{year:?}");
    assert!(year.as_secs_f64() / 8760.0 < 1e-3);
}

/// Zenith luminance of single scattering at 550 nm by hand, relative to the sun's irradiance: plane-parallel, sun at 50°,
/// Rayleigh by the air's pressure, aerosol of the place by its optical depth, and the ground's light scattered down.
///
/// A stand-in that needs no Mie integral and holds every input that differs from place to place.
fn zenith(c: &Conditions) -> f64 {
    let rayleigh = 0.0972 * (-c.altitude_m.value / 8.0e3).exp();
    let aod = c.aod_550.value;
    let mu = 50f64.to_radians().sin();
    let cos = mu;
    let p_rayleigh = 3.0 / (16.0 * std::f64::consts::PI) * (1.0 + cos * cos);
    let g: f64 = 0.7;
    let henyey = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5);
    let p_aerosol = henyey / (4.0 * std::f64::consts::PI);
    // Ozone at 550 nm: 3.4e-25 m² per molecule, 2.687e20 m⁻² per DU.
    let ozone = c.ozone_du.value * 3.4e-25 * 2.687e20;
    let total = rayleigh + aod;
    let single = (rayleigh * p_rayleigh + aod * p_aerosol) * (-(total + ozone) / mu).exp();
    let albedo = c.spectral_albedo(&[550.0]).unwrap()[0];
    let from_ground = albedo * mu / std::f64::consts::PI * (0.5 * rayleigh + 0.2 * aod);
    single + from_ground
}

/// Walks along meridians and the date line in steps of 0.1°, over both poles: the sky of one place is the next one's.
///
/// Terrain is real: where the ground itself rises by more than 50 m from one step to the next, air thins out by more than
/// a step should tell, so that the walk is made at sea level, the climate's own altitude being looked at besides.
#[test]
fn nothing_jumps_from_place_to_place() {
    let level = Overrides {
        altitude_m: Some(0.0),
        ..Overrides::default()
    };
    let mut worst: (f64, String) = (0.0, String::new());
    for time in [
        "2021-01-16T12:00Z",
        "2021-03-31T12:00Z",
        "2021-07-16T12:00Z",
    ] {
        let time: Instant = time.parse().unwrap();
        for longitude in [
            -180.0, -123.3, -70.0, -38.0, -0.88, 10.0, 46.4, 87.0, 116.4, 180.0,
        ] {
            let mut last: Option<Conditions> = None;
            for step in -900..=900 {
                let latitude = f64::from(step) * 0.1;
                let site = Site::new(latitude, longitude, 0.0).unwrap();
                let here = Conditions::at(&site, &time, &level).unwrap();
                if let Some(before) = &last {
                    let change = (zenith(&here) / zenith(before) - 1.0).abs();
                    if change > worst.0 {
                        worst = (change, format!("{latitude} {longitude} {time}"));
                    }
                    check_inputs(before, &here, &format!("{latitude} {longitude} {time}"));
                }
                last = Some(here);
            }
        }
    }
    println!(
        "largest step of zenith luminance: {:.2} % at {}",
        100.0 * worst.0,
        worst.1
    );
    assert!(worst.0 < 0.02, "{worst:?}");
}

fn check_inputs(a: &Conditions, b: &Conditions, place: &str) {
    let near = |name: &str, x: f64, y: f64, step: f64| {
        assert!((x - y).abs() <= step, "{name} {x} {y} at {place}");
    };
    near("aod", a.aod_550.value, b.aod_550.value, 0.02);
    near("ozone", a.ozone_du.value, b.ozone_du.value, 2.0);
    near(
        "humidity",
        a.humidity_percent.value,
        b.humidity_percent.value,
        2.0,
    );
    near("albedo", a.albedo.value, b.albedo.value, 0.025);
    let (x, y) = (a.mixture.as_ref().unwrap(), b.mixture.as_ref().unwrap());
    // Optical depth by matter: a share alone may well rise fast where the air is clean.
    for (x, y) in x.share.iter().zip(y.share) {
        near("part", x * a.aod_550.value, y * b.aod_550.value, 0.02);
    }
}

/// Zenith radiance of single scattering, by the program itself, at 450 and 650 nm; sampling leaves 0.1 % or less.
fn zenith_radiance(conditions: Conditions) -> [f32; 2] {
    let grid = WavelengthGrid::new(vec![450.0, 650.0]).unwrap();
    let sky = Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap();
    let options = RenderOptions {
        method: Method::Path,
        budget: Budget {
            spp: 2048,
            seed: 1,
            max_order: Some(1),
        },
        sun_disc: SunDisc::Off,
        altitude_m: None,
    };
    let up = Directions::new(&[0.0], &[90.0]).unwrap();
    let cancel = std::sync::atomic::AtomicBool::new(false);
    let film = sky.render(&up, &options, &cancel, &|_, _| ()).unwrap();
    [film.spectrum(0)[0], film.spectrum(0)[1]]
}

/// The real sky along four short walks, across what borders most: cells of the data set, a coast, the date line, a city.
#[test]
fn real_skies_do_not_jump() {
    let overrides = Overrides {
        altitude_m: Some(0.0),
        sun_elevation_deg: Some(40.0),
        sun_azimuth_deg: Some(180.0),
        ..Overrides::default()
    };
    let time: Instant = "2021-03-31T12:00Z".parse().unwrap();
    let mut worst = 0f32;
    for (lat, lon, dlat, dlon) in [
        (29.9, 2.4, 0.1, 0.0),
        (39.8, 116.4, 0.1, 0.0),
        (30.0, 31.1, 0.1, 0.0),
        (-40.0, 179.9, 0.0, 0.1),
        (15.0, -20.1, 0.0, 0.1),
    ] {
        let mut last: Option<[f32; 2]> = None;
        for step in 0..3 {
            let (lat, lon) = (lat + dlat * f64::from(step), lon + dlon * f64::from(step));
            let site = Site::new(lat, lon, 0.0).unwrap();
            let here = zenith_radiance(Conditions::at(&site, &time, &overrides).unwrap());
            for (a, b) in last.iter().flatten().zip(here) {
                worst = worst.max((b / a - 1.0).abs());
                assert!((b / a - 1.0).abs() < 0.02, "{lat} {lon}: {a} {b}");
            }
            last = Some(here);
        }
    }
    println!("largest step of zenith radiance: {:.2} %", 100.0 * worst);
}

/// From one minute to the next around the turns of months and years nothing jumps either, nor at the poles and the date line.
#[test]
fn nothing_jumps_in_time_or_at_the_seams() {
    let at = |lat: f64, lon: f64, time: &str| {
        let site = Site::new(lat, lon, 0.0).unwrap();
        Conditions::at(&site, &time.parse().unwrap(), &Overrides::default()).unwrap()
    };
    for (before, after) in [
        ("2021-03-31T23:59:59Z", "2021-04-01T00:00:01Z"),
        ("2020-12-31T23:59:59Z", "2021-01-01T00:00:01Z"),
        ("2021-07-16T11:59:59Z", "2021-07-16T12:00:01Z"),
        ("2020-02-29T23:59:59Z", "2020-03-01T00:00:01Z"),
    ] {
        for (lat, lon) in [(41.65, -0.88), (62.0, 100.0), (-70.0, 0.0), (28.0, 77.0)] {
            let (a, b) = (at(lat, lon, before), at(lat, lon, after));
            let step = (zenith(&b) / zenith(&a) - 1.0).abs();
            assert!(step < 1e-4, "{lat} {lon} {before}: {step:e}");
        }
    }
    let time = "2021-05-05T05:05Z";
    assert_eq!(
        zenith(&at(40.0, 180.0, time)),
        zenith(&at(40.0, -180.0, time))
    );
    for pole in [90.0, -90.0] {
        let step = zenith(&at(pole, 100.0, time)) / zenith(&at(pole, -80.0, time)) - 1.0;
        assert!(step.abs() < 0.01, "{pole}: {step}");
    }
}

/// The sun of 10 000 random places and times between 1900 and 2100, within 0.003° of pvlib's.
#[test]
fn the_sun_stands_where_pvlib_says() {
    let text = include_str!("../../../tests/reference/sun_random.csv");
    let table = Table::parse("sun_random", text).unwrap();
    let column = |name: &str| table.numbers(name).unwrap();
    let (unix, lat, lon) = (
        column("unix_s"),
        column("latitude_deg"),
        column("longitude_deg"),
    );
    let (azimuth, elevation) = (column("azimuth_deg"), column("elevation_deg"));
    let mut worst = 0f64;
    for i in 0..table.len() {
        let site = Site::new(lat[i], lon[i], 0.0).unwrap();
        let sun = SunPosition::at(&site, &Instant::from_unix_seconds(unix[i]).unwrap()).unwrap();
        let turn = (sun.azimuth_deg() - azimuth[i] + 180.0).rem_euclid(360.0) - 180.0;
        let turn = turn * elevation[i].to_radians().cos();
        worst = worst.max(turn.hypot(sun.elevation_deg() - elevation[i]));
    }
    println!("worst of {} sun positions: {worst:.5}°", table.len());
    assert_eq!(table.len(), 10_000);
    assert!(worst < 0.003, "{worst}");
}
