//! Polarised transport against what must hold in every sky.

use celaje::climate::{Conditions, Overrides};
use celaje::medium::LayeredMedium;
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Integrator, Path, PolarisedPath, Scene, SunLight};
use celaje::{Film, Sky, WavelengthGrid};
use celaje_harness::{assert_equal, assert_unbiased, estimate, seed_from_name, BATCHES};

use crate::scenes::{
    altitude_m, hazy_air, look, peaked_phase, separable, under_sun, PLANET_RADIUS_M, WAVELENGTH_NM,
};
use crate::support::{batches, Job};

const STOKES: PolarisedPath = PolarisedPath { stokes: true };
const RADIANCE: PolarisedPath = PolarisedPath { stokes: false };

/// One Stokes component of a direction and a wavelength in every film: 0 is I.
fn component(films: &[Film], direction: usize, lane: usize, component: usize) -> Vec<f64> {
    films
        .iter()
        .map(|f| {
            let at = direction * f.wavelength_nm.len() + lane;
            let planes = f.polarisation.as_ref().unwrap().planes();
            f64::from(match component {
                0 => f.radiance[at],
                c => planes[c - 1].mean[at],
            })
        })
        .collect()
}

/// Air with a real aerosol: the Mie matrices of continental average.
fn real_air() -> Sky {
    let overrides = Overrides {
        aerosol: Some("opac:continental-average".into()),
        aod_550: Some(0.3),
        ..Overrides::default()
    };
    let grid = WavelengthGrid::new(vec![400.0, 550.0, 700.0]).unwrap();
    let conditions = Conditions::from_sun(25.0, 180.0, &overrides).unwrap();
    Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap()
}

fn job(name: &str, spp: u32) -> Job {
    Job {
        seed: seed_from_name(name),
        batches: BATCHES,
        spp,
        max_order: None,
    }
}

/// Rationale: polarised paths are the scalar ones, with a matrix beside the weight. Expected: in a haze whose polarisation is
/// not known, the same radiances to the last bit, and no polarisation at all, in all orders and over a bright ground.
#[test]
fn without_polarising_matter_it_is_the_scalar_path() {
    let mut medium = LayeredMedium::new(&altitude_m(), &WAVELENGTH_NM, PLANET_RADIUS_M).unwrap();
    let sigma_s = separable(&[2e-4, 1.7e-4, 1.5e-4, 1.2e-4], |z| (-z / 1500.0).exp());
    let sigma_a = separable(&[2e-5; 4], |z| (-z / 1500.0).exp());
    medium.add(&sigma_s, &sigma_a, peaked_phase()).unwrap();
    let scene = under_sun(&medium, 20.0, 0.6, 0.27);
    let scene = scene.with_background(&[0.01; 4]).unwrap();
    let looks = [look(170.0, 40.0), look(60.0, 5.0), look(0.0, 90.0)];
    let few = Job {
        batches: 2,
        ..job("depolarising haze", 256)
    };
    let scalar = batches(&Path, &scene, PLANET_RADIUS_M, &looks, few);
    let polarised = batches(&STOKES, &scene, PLANET_RADIUS_M, &looks, few);
    let radiance = batches(&RADIANCE, &scene, PLANET_RADIUS_M, &looks, few);
    assert_eq!(scalar, radiance);
    for (s, p) in scalar.iter().zip(&polarised) {
        assert_eq!(s.radiance, p.radiance);
        assert_eq!(s.variance, p.variance);
        for plane in p.polarisation.as_ref().unwrap().planes() {
            assert!(plane.mean.iter().all(|&v| v == 0.0));
        }
    }
}

/// Rationale: polarisation moves energy between directions but makes none. Expected: with unpolarised light of radiance 1 from
/// everywhere, white ground and no absorption, I = 1 and Q = U = V = 0 in every direction. Power: standard errors are held below
/// 0.4 %; the matrices alone change single values by ten times as much.
#[test]
fn white_furnace() {
    let medium = hazy_air(0.3, false);
    let scene = under_sun(&medium, 30.0, 1.0, 0.0);
    let dark = SunLight::new(scene.sun.direction, &WAVELENGTH_NM, &[0.0; 4], 0.0).unwrap();
    let scene = Scene::new(&medium, dark, &[1.0; 4]).unwrap();
    let scene = scene.with_background(&[1.0; 4]).unwrap();
    let looks = [look(120.0, 50.0), look(20.0, 8.0)];
    let films = batches(
        &STOKES,
        &scene,
        PLANET_RADIUS_M,
        &looks,
        job("polarised furnace", 1024),
    );
    for direction in 0..looks.len() {
        for lane in 0..4 {
            for (c, truth) in [1.0, 0.0, 0.0].into_iter().enumerate() {
                let values = component(&films, direction, lane, c);
                // Shifted, so that what should vanish has a scale.
                let shifted: Vec<f64> = values.iter().map(|v| v + 1.0 - truth).collect();
                let label = format!("furnace, direction {direction}, lane {lane}, component {c}");
                assert_unbiased(&label, &shifted, 1.0, 0.004, 24);
            }
        }
    }
}

/// Rationale: the whole scene is its own mirror image in the sun's plane. Expected: I and Q alike on both sides, U and V of opposite
/// sign; and U is not small. Power: standard errors are held below 0.4 % of I; U is 5 % of it.
#[test]
fn mirror_symmetric_about_the_suns_plane() {
    let sky = real_air();
    let scene = Scene::new(&sky.medium, sky.sun.clone(), &sky.albedo).unwrap();
    let (left, right) = (look(240.0, 35.0), look(120.0, 35.0));
    let radius_m = PLANET_RADIUS_M + sky.ground_altitude_m();
    let films = batches(
        &STOKES,
        &scene,
        radius_m,
        &[left, right],
        job("mirror", 1024),
    );
    for lane in 0..3 {
        let scale = estimate(&component(&films, 0, lane, 0)).mean;
        for (c, sign) in [1.0, 1.0, -1.0, -1.0].into_iter().enumerate() {
            let of = |direction: usize, sign: f64| -> Vec<f64> {
                let values = component(&films, direction, lane, c);
                // Shifted by I: what may be small has a scale.
                values.iter().map(|v| sign * v / scale + 1.0).collect()
            };
            let label = format!("mirror, lane {lane}, component {c}");
            assert_equal(&label, &of(0, 1.0), &of(1, sign), 0.004, 12);
        }
        let u = estimate(&component(&films, 0, lane, 2)).mean / scale;
        assert!(u.abs() > 0.03, "U/I = {u}");
    }
}

/// Rationale: V comes from light that was polarised before and meets matter that shifts its phase: second-hand, and held by no
/// published value. Expected: none at all in air alone, whose matrix has no F34; with aerosol none in the sun's plane, which is
/// a mirror; beside it, opposite signs left and right, and a size that is not noise but below a thousandth of I. Power: standard
/// errors are held below 0.01 % of I in the plane; half the difference of left and right, 0.02 to 0.06 % of I, has to be over five of
/// its own in each lane.
#[test]
fn circular_light_is_small_and_odd_about_the_suns_plane() {
    let air = hazy_air(0.0, true);
    let scene = under_sun(&air, 25.0, 0.3, 0.27);
    let few = Job {
        batches: 2,
        ..job("circular air", 256)
    };
    let looks = [look(240.0, 35.0), look(120.0, 10.0)];
    for film in batches(&STOKES, &scene, PLANET_RADIUS_M, &looks, few) {
        let p = film.polarisation.unwrap();
        assert!(p.v.mean.iter().all(|&v| v == 0.0));
        assert!(p.u.mean.iter().all(|&u| u != 0.0));
    }

    let sky = real_air();
    let scene = Scene::new(&sky.medium, sky.sun.clone(), &sky.albedo).unwrap();
    let looks = [
        look(180.0, 60.0),
        look(0.0, 40.0),
        look(240.0, 35.0),
        look(120.0, 35.0),
    ];
    let radius_m = PLANET_RADIUS_M + sky.ground_altitude_m();
    let films = batches(&STOKES, &scene, radius_m, &looks, job("circular", 4096));
    for lane in 0..3 {
        let relative = |direction: usize| -> Vec<f64> {
            let scale = estimate(&component(&films, direction, lane, 0)).mean;
            let values = component(&films, direction, lane, 3);
            values.iter().map(|v| v / scale).collect()
        };
        for direction in 0..2 {
            // Shifted by I: what should vanish has a scale.
            let shifted: Vec<f64> = relative(direction).iter().map(|v| v + 1.0).collect();
            let label = format!("in the plane, direction {direction}, lane {lane}");
            println!("{label}: {:?}", estimate(&relative(direction)));
            assert_unbiased(&label, &shifted, 1.0, 0.0001, 9);
        }
        let [left, right] = [relative(2), relative(3)].map(|v| estimate(&v));
        println!("beside it, lane {lane}: {left:?} {right:?}");
        let odd = 0.5 * (left.mean - right.mean);
        let error = 0.5 * left.standard_error.hypot(right.standard_error);
        println!("odd part, lane {lane}: {odd:.2e} ± {error:.1e} of I");
        assert!(odd.abs() > 5.0 * error && odd.abs() < 1e-3);
        let (a, b): (Vec<f64>, Vec<f64>) = relative(2)
            .into_iter()
            .zip(relative(3))
            .map(|(l, r)| (1.0 + l, 1.0 - r))
            .unzip();
        assert_equal(&format!("odd, lane {lane}"), &a, &b, 0.0002, 9);
    }
}

/// Rationale: who wants the radiance alone is spared the rest of the matrices. Expected: the same radiances to the last bit, and
/// not those of scalar light.
#[test]
fn the_radiance_alone_is_the_same() {
    let medium = hazy_air(0.1, true);
    let scene = under_sun(&medium, 30.0, 0.3, 0.27);
    let looks = [look(0.0, 60.0), look(100.0, 20.0)];
    let few = Job {
        batches: 2,
        ..job("radiance alone", 256)
    };
    let [all, alone, scalar] = [&STOKES as &dyn Integrator<_>, &RADIANCE, &Path]
        .map(|integrator| batches(integrator, &scene, PLANET_RADIUS_M, &looks, few));
    for ((all, alone), scalar) in all.iter().zip(&alone).zip(&scalar) {
        assert_eq!(all.radiance, alone.radiance);
        assert_eq!(all.variance, alone.variance);
        assert!(alone.polarisation.is_none());
        assert_ne!(alone.radiance, scalar.radiance);
    }
}

/// Expected: no more light is polarised than there is, anywhere; single Rayleigh scattering without depolarisation by 90° is fully
/// polarised, across the sun's meridian.
#[test]
fn degree_of_polarisation() {
    let sky = real_air();
    let scene = Scene::new(&sky.medium, sky.sun.clone(), &sky.albedo).unwrap();
    let looks: Vec<_> = (0..24)
        .map(|i| look(f64::from(i) * 47.0, 2.0 + f64::from(i) * 3.6))
        .collect();
    let radius_m = PLANET_RADIUS_M + sky.ground_altitude_m();
    let films = batches(
        &STOKES,
        &scene,
        radius_m,
        &looks,
        Job {
            batches: 8,
            ..job("degree", 64)
        },
    );
    let mut largest: f64 = 0.0;
    for direction in 0..looks.len() {
        for lane in 0..3 {
            let [i, q, u, v] =
                [0, 1, 2, 3].map(|c| estimate(&component(&films, direction, lane, c)));
            let polarised = (q.mean * q.mean + u.mean * u.mean + v.mean * v.mean).sqrt();
            let allowed = i.mean + 5.0 * (i.standard_error + q.standard_error + u.standard_error);
            assert!(
                polarised <= allowed,
                "{direction}: {polarised} of {}",
                i.mean
            );
            assert!(v.mean.abs() < 0.02 * i.mean);
            largest = largest.max(polarised / i.mean);
        }
    }
    assert!(largest > 0.4, "{largest}");

    let mut medium = LayeredMedium::new(&altitude_m(), &WAVELENGTH_NM, PLANET_RADIUS_M).unwrap();
    let sigma = separable(&[1e-5; 4], |z| (-z / 8000.0).exp());
    let phase = celaje::optics::Phase::rayleigh(&[0.0; 4]).unwrap();
    medium.add(&sigma, &vec![0.0; sigma.len()], phase).unwrap();
    let scene = under_sun(&medium, 30.0, 0.0, 0.0);
    let once = Job {
        batches: 1,
        max_order: Some(1),
        ..job("once", 16)
    };
    // 90° from a sun 30° high in the south.
    let film = &batches(&STOKES, &scene, PLANET_RADIUS_M, &[look(0.0, 60.0)], once)[0];
    assert!((film.degree_of_polarisation(0, 1).unwrap() - 1.0).abs() < 1e-5);
    assert!((film.angle_of_polarisation_deg(0, 1).unwrap().abs() - 90.0).abs() < 1e-3);
}
