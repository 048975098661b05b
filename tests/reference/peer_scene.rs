//! The peer scene: a Rayleigh sky that several codes have computed, sun zenith angle 60°.
//!
//! Rationale: everything at once (sphere, air, phase function, ground, all orders) against codes that share nothing with
//! ours. Expected behaviour: no bias over all directions and wavelengths, no trend with direction.

use celaje::math::Vec3;
use celaje::medium::LayeredMedium;
use celaje::optics::Phase;
use celaje::transport::{Accuracy, Integrator, Path, Scene, Shells, SunLight};
use celaje_harness::{estimate, seed_from_name};

use crate::support::{batches, csv_rows, value, Job};

const PLANET_RADIUS_M: f64 = 6_371_000.0;
const AIR: &str = include_str!("peer_scene_air_density.csv");
const SKY: &str = include_str!("peer_scene_rayleigh_sun60.csv");

/// Bodhaine et al. 1999, doi:10.1175/1520-0426(1999)016<1854:ORODC>2.0.CO;2, eq. 29 \[m²\].
fn cross_section_m2(wavelength_nm: f64) -> f64 {
    let l2 = (wavelength_nm * 1e-3).powi(2);
    1e-32 * (1.0455996 - 341.29061 / l2 - 0.90230850 * l2)
        / (1.0 + 0.0027059889 / l2 - 85.968563 * l2)
}

fn medium(wavelength_nm: &[f64]) -> LayeredMedium {
    let rows = csv_rows(AIR);
    let column = |k: usize| -> Vec<f64> { rows.iter().map(|r| r[k].parse().unwrap()).collect() };
    let altitude_m: Vec<f64> = column(0).iter().map(|z| 1000.0 * z).collect();
    let sigma_s: Vec<f64> = column(3)
        .iter()
        .flat_map(|n| wavelength_nm.iter().map(move |&w| n * cross_section_m2(w)))
        .collect();
    let mut medium = LayeredMedium::new(&altitude_m, wavelength_nm, PLANET_RADIUS_M).unwrap();
    let phase = Phase::rayleigh(&vec![0.0279; wavelength_nm.len()]).unwrap();
    medium
        .add(&sigma_s, &vec![0.0; sigma_s.len()], phase)
        .unwrap();
    medium
}

/// One published value.
struct Cell {
    wavelength_nm: f64,
    view_zenith_deg: f64,
    relative_azimuth_deg: f64,
    radiance: f64,
}

fn published(method: &str) -> Vec<Cell> {
    csv_rows(SKY)
        .into_iter()
        .filter(|r| r[0] == method)
        .map(|r| Cell {
            wavelength_nm: r[1].parse().unwrap(),
            view_zenith_deg: r[2].parse().unwrap(),
            relative_azimuth_deg: r[3].parse().unwrap(),
            radiance: r[4].parse().unwrap(),
        })
        .collect()
}

/// Ours over theirs − 1 for every published cell, with our relative standard error.
fn compare(
    integrator: &dyn Integrator<LayeredMedium>,
    method: &str,
    spp: u32,
    max_order: Option<u32>,
) -> Vec<(Cell, f64, f64)> {
    let cells = published(method);
    let mut wavelength_nm: Vec<f64> = cells.iter().map(|c| c.wavelength_nm).collect();
    wavelength_nm.sort_by(f64::total_cmp);
    wavelength_nm.dedup();
    let per_wavelength = cells.len() / wavelength_nm.len();
    // The sun stands in the south, zenith angle 60°.
    let look = |c: &Cell| {
        Vec3::from_azimuth_elevation_deg(180.0 + c.relative_azimuth_deg, 90.0 - c.view_zenith_deg)
    };
    let looks: Vec<Vec3> = cells[..per_wavelength].iter().map(look).collect();
    let medium = medium(&wavelength_nm);
    let n = wavelength_nm.len();
    let sun = SunLight::new(
        Vec3::from_azimuth_elevation_deg(180.0, 30.0),
        &wavelength_nm,
        &vec![1.0; n],
        0.0,
    )
    .unwrap();
    let scene = Scene::new(&medium, sun, &vec![0.1; n]).unwrap();
    let job = Job {
        seed: seed_from_name(&format!("peer scene {method}")),
        batches: if spp > 1 { 8 } else { 3 },
        spp,
        max_order,
    };
    let films = batches(integrator, &scene, PLANET_RADIUS_M, &looks, job);
    cells
        .into_iter()
        .map(|c| {
            let direction = looks.iter().position(|&l| l == look(&c)).unwrap();
            let lane = wavelength_nm
                .iter()
                .position(|&w| w == c.wavelength_nm)
                .unwrap();
            let ours = estimate(&value(&films, direction, lane));
            let (ratio, error) = (
                ours.mean / c.radiance - 1.0,
                ours.standard_error / c.radiance,
            );
            (c, ratio, error)
        })
        .collect()
}

struct Summary {
    mean: f64,
    rms: f64,
    noise: f64,
}

fn summarise<'a>(cells: impl Iterator<Item = &'a (Cell, f64, f64)>) -> Summary {
    let (mut n, mut sum, mut squares, mut noise) = (0.0, 0.0, 0.0, 0.0);
    for (_, ratio, error) in cells {
        n += 1.0;
        sum += ratio;
        squares += ratio * ratio;
        noise += error * error;
    }
    Summary {
        mean: sum / n,
        rms: f64::sqrt(squares / n),
        noise: f64::sqrt(noise / n),
    }
}

fn report(name: &str, cells: &[(Cell, f64, f64)]) -> Summary {
    for zenith in [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 82.0, 86.0, 89.0] {
        let s = summarise(cells.iter().filter(|c| c.0.view_zenith_deg == zenith));
        println!(
            "{name}: view zenith {zenith:2} deg: mean {:+.4} rms {:.4} noise {:.4}",
            s.mean, s.rms, s.noise
        );
    }
    for azimuth in [0.0, 45.0, 90.0, 135.0, 180.0] {
        let s = summarise(cells.iter().filter(|c| c.0.relative_azimuth_deg == azimuth));
        println!(
            "{name}: relative azimuth {azimuth:3} deg: mean {:+.4} rms {:.4} noise {:.4}",
            s.mean, s.rms, s.noise
        );
    }
    let all = summarise(cells.iter());
    println!(
        "{name}: all: mean {:+.5} rms {:.5} noise {:.5}",
        all.mean, all.rms, all.noise
    );
    all
}

#[test]
fn all_orders() {
    let cells = compare(&Path, "SO", 8192, None);
    let all = report("all orders", &cells);
    assert!(all.noise < 0.003, "noise {}", all.noise);
    assert!(
        all.mean.abs() < 0.0025 && all.rms < 0.005,
        "mean {} rms {}",
        all.mean,
        all.rms
    );
}

#[test]
fn single_scattering() {
    let cells = compare(&Path, "SS", 8192, Some(1));
    let all = report("single scattering", &cells);
    assert!(all.mean.abs() < 0.002, "mean {}", all.mean);
}

/// Rationale: the fast solver against a deterministic code of the same kind. Expected: within 0.3 % rms.
#[test]
fn shells_all_orders() {
    for (accuracy, limit) in [
        (Accuracy::Preview, 0.02),
        (Accuracy::Default, 0.003),
        (Accuracy::High, 0.002),
    ] {
        let cells = compare(&Shells { accuracy }, "SO", 1, None);
        let all = report(&format!("shells {accuracy:?}"), &cells);
        assert!(
            all.rms < limit,
            "{accuracy:?}: mean {} rms {}",
            all.mean,
            all.rms
        );
    }
    let cells = compare(&Shells::default(), "SS", 1, Some(1));
    let all = report("shells, single scattering", &cells);
    assert!(all.rms < 0.002, "mean {} rms {}", all.mean, all.rms);
}
