//! Skies by `shells`, corrected by what of their residual against `path` is smooth.

use std::sync::atomic::AtomicBool;

use celaje::bake::BakeOptions;
use celaje::climate::{Conditions, Overrides};
use celaje::sensor::{Fisheye, Sensor};
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Accuracy, Budget};
use celaje::{Film, Sky, WavelengthGrid};

const SPP: u32 = 8192;

fn sky(sun_elevation_deg: f64) -> Sky {
    let grid = WavelengthGrid::new(vec![450.0, 550.0, 650.0]).unwrap();
    let conditions = Conditions::from_sun(sun_elevation_deg, 120.0, &Overrides::default()).unwrap();
    Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap()
}

fn options(accuracy: Accuracy) -> RenderOptions {
    RenderOptions {
        method: Method::Shells,
        polarised: Polarised::default(),
        accuracy,
        budget: Budget {
            spp: 1,
            seed: 3,
            max_order: None,
        },
        sun_disc: SunDisc::On,
        altitude_m: None,
    }
}

/// Root mean square of the ratio of two films less one, more than 5° from the sun.
fn rms(film: &Film, to: &Film, sky: &Sky, sensor: &dyn Sensor) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for pixel in 0..film.samples.len() {
        let look = sensor.direction(pixel % film.width, pixel / film.width, 0.5, 0.5);
        if look.is_none_or(|look| look.dot(sky.sun.direction) > 5f64.to_radians().cos()) {
            continue;
        }
        for (a, b) in film.spectrum(pixel).iter().zip(to.spectrum(pixel)) {
            sum += f64::from(a / b - 1.0).powi(2);
            count += 1;
        }
    }
    (sum / f64::from(count)).sqrt()
}

/// Rationale: a correction must bring a sky nearer to the truth, whatever was wrong with it, and say how near without having seen
/// it. Expected: of what tables of a ground too dark by 0.1 are off, less than a fifth is left; cross-validation says how much to
/// 0.5 %; the sun's disc keeps its radiance.
#[test]
fn a_wrong_ground_is_found_and_corrected() {
    let stop = AtomicBool::new(false);
    let sky = sky(40.0);
    let sensor = Fisheye::new(24, 24, 178.0).unwrap();
    let bake = BakeOptions {
        accuracy: Accuracy::Preview,
        sun_elevation_deg: (39.0, 41.0),
        highest_observer_m: 0.0,
        polarised: true,
    };
    let mut wrong = sky.baked(&bake, &stop).unwrap();
    wrong.albedo.iter_mut().for_each(|a| *a += 0.1);
    let mut right = sky.clone();
    right.albedo.clone_from(&wrong.albedo);
    let options = options(Accuracy::Default);
    let truth = right.render(&sensor, &options, &stop, &|_, _| ()).unwrap();
    let before = wrong.render(&sensor, &options, &stop, &|_, _| ()).unwrap();
    let (after, correction) = wrong
        .render_corrected(&sensor, &options, SPP, &stop, &|_, _| ())
        .unwrap();
    let off = |film: &Film| rms(film, &truth, &sky, &sensor);
    println!(
        "{} {}; said {:?}",
        off(&before),
        off(&after),
        correction.words()
    );
    assert!(off(&before) > 0.02 && off(&after) < 0.2 * off(&before));
    assert!((correction.after.rms() - off(&after)).abs() < 0.005);
    let brightest = |film: &Film| film.radiance.iter().copied().fold(0.0, f32::max);
    assert!((brightest(&after) / brightest(&before) - 1.0).abs() < 1e-3);
}

/// Rationale: coarse grids err smoothly. Expected: a sky by `preview` under a low sun, corrected with paths enough, is nearer to
/// `default` by a quarter at least; one by `default` is not made worse by a tenth of a per cent.
#[test]
fn a_coarse_sky_comes_nearer() {
    let stop = AtomicBool::new(false);
    let sky = sky(10.0);
    let sensor = Fisheye::new(24, 24, 178.0).unwrap();
    let [coarse, fine] = [Accuracy::Preview, Accuracy::Default].map(options);
    let render = |options| sky.render(&sensor, options, &stop, &|_, _| ()).unwrap();
    let corrected = |options, spp| {
        sky.render_corrected(&sensor, options, spp, &stop, &|_, _| ())
            .unwrap()
            .0
    };
    let truth = render(&fine);
    let off = |film: &Film| rms(film, &truth, &sky, &sensor);
    let (before, after) = (off(&render(&coarse)), off(&corrected(&coarse, 4 * SPP)));
    let left = off(&corrected(&fine, SPP));
    println!("preview {before}, corrected {after}; default moved by {left}");
    assert!(after < 0.75 * before, "{before} {after}");
    assert!(left < 1e-3, "{left}");
}

/// Only the sky by `shells` can be corrected.
#[test]
fn what_cannot_be_corrected_is_refused() {
    let stop = AtomicBool::new(false);
    let (sky, sensor) = (sky(10.0), Fisheye::new(8, 8, 180.0).unwrap());
    for change in [
        |o: &mut RenderOptions| o.method = Method::Path,
        |o: &mut RenderOptions| o.sun_disc = SunDisc::Only,
    ] {
        let mut options = options(Accuracy::Preview);
        change(&mut options);
        let refused = sky.render_corrected(&sensor, &options, 4, &stop, &|_, _| ());
        assert!(refused.unwrap_err().to_string().contains("only the sky"));
    }
}
