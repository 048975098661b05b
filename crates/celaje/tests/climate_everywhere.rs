//! The climate as a whole: amounts of aerosol against measured ones, continuity, and speed.

use cpu_time::ProcessTime as Clock;

use celaje::climate::{aerosol_climate, elevation, Conditions, Overrides, OzoneClimate};
use celaje::colour::{Observer, SpectrumToXyz};
use celaje::math::Table;
use celaje::place::{Instant, Site, SunPosition};
use celaje::sensor::Directions;
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
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

/// Ozone where it is known for itself: 250 to 280 DU over the tropics in every month, and the hole over Antarctica in October, below
/// 220 DU by its definition, while the same air holds more than 250 DU in January.
#[test]
fn ozone_is_low_where_it_should_be() {
    let at = |latitude: f64, month: i32| {
        let time: Instant = format!("2021-{month:02}-16T00:00Z").parse().unwrap();
        OzoneClimate::Sbuv.column(latitude, 0.0, &time).unwrap().du
    };
    for latitude in [-10.0, -5.0, 0.0, 5.0, 10.0] {
        let year: Vec<f64> = (1..=12).map(|month| at(latitude, month)).collect();
        let mean = year.iter().sum::<f64>() / 12.0;
        println!("{latitude}° N: {year:.0?} DU");
        assert!((250.0..280.0).contains(&mean), "{latitude}: {mean}");
        assert!(
            year.iter().all(|du| (240.0..290.0).contains(du)),
            "{latitude}"
        );
    }
    for latitude in [-90.0, -80.0, -75.0] {
        assert!(at(latitude, 10) < 220.0, "{latitude}: {}", at(latitude, 10));
        assert!(at(latitude, 1) > 250.0, "{latitude}: {}", at(latitude, 1));
    }
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

/// Meridians that are walked: the date line on both sides, the Andes (-70°), Greenland (-38°), the Alps and the Sahara (10°),
/// Arabia, the Himalaya (87°), Beijing (116.4°).
const MERIDIANS: [f64; 10] = [
    -180.0, -123.3, -70.0, -38.0, -0.88, 10.0, 46.4, 87.0, 116.4, 180.0,
];

/// Walks along meridians and the date line in steps of 0.1°, over both poles: the sky of one place is the next one's.
///
/// At sea level everywhere, so that what changes is the climate; real ground is the next test's. The luminance is the
/// stand-in's, which `accuracy_luminance_changes_as_the_stand_in_says` holds against the program's own.
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
        for longitude in MERIDIANS {
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

/// Height over which air thins out by 1/e at the fastest: the aerosol's \[m\].
const LEAST_HEIGHT_M: f64 = 2.0e3;

/// How far the ground climbs from one place to the next, of the places or of the regions on whose ground the aerosol stands \[m\].
fn climb_m(a: &Conditions, b: &Conditions) -> f64 {
    let region_m = |c: &Conditions| {
        let (lat, lon) = (
            c.latitude_deg.as_ref().unwrap(),
            c.longitude_deg.as_ref().unwrap(),
        );
        elevation(lat.value, lon.value).unwrap().region_m
    };
    let of_places = (a.altitude_m.value - b.altitude_m.value).abs();
    of_places.max((region_m(a) - region_m(b)).abs())
}

/// The same walks on the real ground of the map: over the Andes, the Himalaya and the edge of Greenland's ice the air thins
/// out by up to a tenth within 0.1°, since the ground climbs by hundreds of metres. That is no jump: the step is no more than 2 %
/// beyond what the climb itself takes away, and walked in hundredths of a degree no step is larger than 2 %. Where the stand-in
/// says more, the program's own luminance decides: over clean air and snow the stand-in takes a change of aerosol for twice as much.
#[test]
fn steep_ground_is_climbed_without_a_jump() {
    let at = |latitude: f64, longitude: f64, time: &Instant| {
        let site = Site::new(latitude, longitude, 0.0).unwrap();
        Conditions::at(&site, time, &Overrides::default()).unwrap()
    };
    let lit = |latitude: f64, longitude: f64, time: &Instant| {
        let overrides = Overrides {
            sun_elevation_deg: Some(50.0),
            sun_azimuth_deg: Some(180.0),
            ..Overrides::default()
        };
        let site = Site::new(latitude, longitude, 0.0).unwrap();
        Conditions::at(&site, time, &overrides).unwrap()
    };
    let (mut climbs, mut decided, mut largest, mut finest) = (0, 0, 0f64, 0f64);
    for time in ["2021-01-16T12:00Z", "2021-07-16T12:00Z"] {
        let time: Instant = time.parse().unwrap();
        for longitude in MERIDIANS {
            let mut last = at(-90.0, longitude, &time);
            for step in -899..=900 {
                let latitude = f64::from(step) * 0.1;
                let here = at(latitude, longitude, &time);
                let change = (zenith(&here) / zenith(&last) - 1.0).abs();
                let climb = climb_m(&last, &here);
                let place = format!("{latitude} {longitude} {time}: {change} over {climb} m");
                let limit = 0.02 + climb / LEAST_HEIGHT_M;
                if change >= limit {
                    let own = |latitude| zenith_luminance(lit(latitude, longitude, &time));
                    let change = (own(latitude) / own(latitude - 0.1) - 1.0).abs();
                    println!("{place}; the program's own luminance: {change}");
                    assert!(change < limit, "{place}, {change}");
                    decided += 1;
                }
                largest = largest.max(change);
                if change > 0.02 {
                    climbs += 1;
                    let fine = |i: i32| {
                        let latitude = latitude - 0.1 + 0.01 * f64::from(i);
                        zenith(&at(latitude, longitude, &time))
                    };
                    for i in 1..=10 {
                        let step = (fine(i) / fine(i - 1) - 1.0).abs();
                        finest = finest.max(step);
                        assert!(step < 0.02, "{place}, {step} in a hundredth of a degree");
                    }
                }
                last = here;
            }
        }
    }
    println!(
        "{climbs} steps above 2 %, the largest {:.1} %; in hundredths of a degree {:.2} %",
        100.0 * largest,
        100.0 * finest
    );
    // The mountains were there.
    assert!(climbs > 20 && largest > 0.04);
    assert!(decided < 20, "{decided} steps are beyond the stand-in");
}

/// From day to day around the turn of March and April, in steps of 0.1° across 30° N: where a map of classes would step.
#[test]
fn classes_of_air_have_no_edge() {
    let level = Overrides {
        altitude_m: Some(0.0),
        ..Overrides::default()
    };
    let at = |latitude: f64, hours: i32| {
        let site = Site::new(latitude, 2.4, 0.0).unwrap();
        let start: Instant = "2021-03-29T00:00Z".parse().unwrap();
        let time = start.later_by(f64::from(hours) * 3600.0).unwrap();
        Conditions::at(&site, &time, &level).unwrap()
    };
    for hours in (0..144).step_by(6) {
        for step in -5..5 {
            let latitude = 30.0 + 0.1 * f64::from(step);
            let here = at(latitude, hours);
            for (name, next) in [
                ("north", at(latitude + 0.1, hours)),
                ("later", at(latitude, hours + 6)),
            ] {
                let change = (zenith(&next) / zenith(&here) - 1.0).abs();
                assert!(change < 5e-3, "{name} of {latitude}, {hours} h: {change}");
                check_inputs(&here, &next, name);
            }
        }
    }
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
    near("water", a.water_mm.value, b.water_mm.value, 0.2);
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
    let spectrum = look_up(&sky, Method::Path, Some(1));
    [spectrum[0], spectrum[1]]
}

/// Radiance of the zenith, without the sun.
fn look_up(sky: &Sky, method: Method, max_order: Option<u32>) -> Vec<f32> {
    let options = RenderOptions {
        polarised: Polarised::default(),
        method,
        accuracy: celaje::transport::Accuracy::default(),
        budget: Budget {
            spp: 2048,
            seed: 1,
            max_order,
        },
        sun_disc: SunDisc::Off,
        altitude_m: None,
    };
    let up = Directions::new(&[0.0], &[90.0]).unwrap();
    let cancel = std::sync::atomic::AtomicBool::new(false);
    let film = sky.render(&up, &options, &cancel, &|_, _| ()).unwrap();
    film.spectrum(0).to_vec()
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

/// Luminance of the zenith \[cd/m²\] by the program itself, all orders, without noise.
fn zenith_luminance(conditions: Conditions) -> f64 {
    let grid = WavelengthGrid::range(430.0, 670.0, 30.0).unwrap();
    let eye = SpectrumToXyz::new(grid.nm(), Observer::Cie1931).unwrap();
    let sky = Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap();
    eye.xyz(&look_up(&sky, Method::Shells, None))[1]
}

/// The steps of the walks where the stand-in changes most, and a sample of all others, by the program's own luminance: at sea level
/// no step is larger than 2 %, and none 0.5 % larger than the stand-in said; on real ground none is more than 2 % beyond its climb.
#[test]
#[ignore = "minutes of work: run by `make accuracy`"]
fn accuracy_luminance_changes_as_the_stand_in_says() {
    for (ground, altitude_m) in [("sea level", Some(0.0)), ("real ground", None)] {
        let overrides = Overrides {
            altitude_m,
            sun_elevation_deg: Some(50.0),
            sun_azimuth_deg: Some(180.0),
            ..Overrides::default()
        };
        let at = |(latitude, longitude, time): (f64, f64, &str)| {
            let site = Site::new(latitude, longitude, 0.0).unwrap();
            Conditions::at(&site, &time.parse().unwrap(), &overrides).unwrap()
        };
        let mut steps = Vec::new();
        for time in [
            "2021-01-16T12:00Z",
            "2021-03-31T12:00Z",
            "2021-07-16T12:00Z",
        ] {
            for longitude in MERIDIANS {
                let mut last = zenith(&at((-90.0, longitude, time)));
                for step in -899..=900 {
                    let here = (f64::from(step) * 0.1, longitude, time);
                    let value = zenith(&at(here));
                    steps.push(((value / last - 1.0).abs(), here));
                    last = value;
                }
            }
        }
        steps.sort_by(|a, b| b.0.total_cmp(&a.0));
        let worst = steps.iter().take(12);
        let sample = steps.iter().skip(12).step_by(steps.len() / 8);
        let (mut largest, mut beyond) = (0f64, 0f64);
        for &(stand_in, here) in worst.chain(sample) {
            let before = (here.0 - 0.1, here.1, here.2);
            let change = zenith_luminance(at(here)) / zenith_luminance(at(before)) - 1.0;
            largest = largest.max(change.abs());
            beyond = beyond.max(change.abs() - stand_in);
            let limit = match altitude_m {
                Some(_) => 0.02f64.min(stand_in + 0.005),
                None => 0.02 + climb_m(&at(before), &at(here)) / LEAST_HEIGHT_M,
            };
            assert!(
                change.abs() < limit,
                "{ground}, {here:?}: {change}, {limit}"
            );
        }
        println!(
            "{ground}: largest step of the zenith's luminance {:.2} %, beyond the stand-in {:.2} %",
            100.0 * largest,
            100.0 * beyond
        );
    }
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
