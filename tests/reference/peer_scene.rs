//! The peer scene: a Rayleigh sky that several codes have computed, sun zenith angle 60°.
//!
//! Rationale: everything at once (sphere, air, phase function, ground, all orders) against codes that share nothing with
//! ours. Expected behaviour: no bias over all directions and wavelengths, no trend with direction.

use celaje::medium::LayeredMedium;
use celaje::transport::{Accuracy, Integrator, Path, Shells};
use celaje_harness::{estimate, seed_from_name};

use crate::support::peer::{
    axes, medium, medium_with_aerosol, other_sky, published, scene, Cell, PLANET_RADIUS_M,
};
use crate::support::{batches, value, Job};

const BATCHES: usize = 8;

/// A published value, and ours over it − 1 in every batch.
struct Compared {
    cell: Cell,
    excess: Vec<f64>,
}

fn compare(
    integrator: &dyn Integrator<LayeredMedium>,
    method: &str,
    spp: u32,
    max_order: Option<u32>,
) -> Vec<Compared> {
    let job = Job {
        seed: seed_from_name(&format!("peer scene {method}")),
        batches: BATCHES,
        spp,
        max_order,
    };
    compare_with(integrator, published(method), medium, 60.0, job)
}

fn compare_with(
    integrator: &dyn Integrator<LayeredMedium>,
    cells: Vec<Cell>,
    medium: fn(&[f64]) -> LayeredMedium,
    sun_zenith_deg: f64,
    job: Job,
) -> Vec<Compared> {
    let (wavelength_nm, looks) = axes(&cells);
    let medium = medium(&wavelength_nm);
    let scene = scene(&medium, &wavelength_nm, sun_zenith_deg);
    let films = batches(integrator, &scene, PLANET_RADIUS_M, &looks, job);
    cells
        .into_iter()
        .enumerate()
        .map(|(i, cell)| {
            let (lane, direction) = (i / looks.len(), i % looks.len());
            assert!(
                wavelength_nm[lane] == cell.wavelength_nm && looks[direction] == cell.look(),
                "the published table is not in the order of its axes"
            );
            let ours = value(&films, direction, lane);
            let excess = ours.iter().map(|l| l / cell.radiance - 1.0).collect();
            Compared { cell, excess }
        })
        .collect()
}

/// A group of cells.
struct Summary {
    /// Mean of ours over theirs − 1.
    mean: f64,
    /// Standard error of that mean, from the scatter of its batches: cells share paths, so theirs do not simply add up.
    standard_error: f64,
    /// Root mean square of ours over theirs − 1.
    rms: f64,
    /// Root mean square of the single cells' standard errors.
    noise: f64,
}

fn summarise<'a>(cells: impl Iterator<Item = &'a Compared>) -> Summary {
    let (mut n, mut squares, mut noise) = (0.0, 0.0, 0.0);
    let mut batch_sums = [0.0; BATCHES];
    for cell in cells {
        let e = estimate(&cell.excess);
        n += 1.0;
        squares += e.mean * e.mean;
        noise += e.standard_error * e.standard_error;
        for (sum, excess) in batch_sums.iter_mut().zip(&cell.excess) {
            *sum += excess;
        }
    }
    let batch_means = batch_sums.map(|s| s / n);
    let e = estimate(&batch_means);
    Summary {
        mean: e.mean,
        standard_error: e.standard_error,
        rms: f64::sqrt(squares / n),
        noise: f64::sqrt(noise / n),
    }
}

/// Prints and returns the summary of every view zenith angle and every azimuth.
fn trends(cells: &[Compared]) -> Vec<(String, Summary)> {
    let zenith = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 82.0, 86.0, 89.0].map(|angle| {
        let group = cells.iter().filter(|c| c.cell.view_zenith_deg == angle);
        (format!("view zenith {angle} deg"), summarise(group))
    });
    let azimuth = [0.0, 45.0, 90.0, 135.0, 180.0].map(|angle| {
        let group = cells
            .iter()
            .filter(|c| c.cell.relative_azimuth_deg == angle);
        (format!("relative azimuth {angle} deg"), summarise(group))
    });
    let groups: Vec<_> = zenith.into_iter().chain(azimuth).collect();
    for (name, s) in &groups {
        println!(
            "{name}: mean {:+.5} ± {:.5} rms {:.5} noise {:.5}",
            s.mean, s.standard_error, s.rms, s.noise
        );
    }
    groups
}

/// Power: single cells are known to 0.3 % (root mean square), means of a group of directions better still, so the bound of
/// 0.25 % on the mean of all and of 0.2 % (and three standard errors) on every view zenith angle and azimuth bind at a
/// bias of that size, not at noise. Theirs is deterministic, 0.1 to 0.25 % from two Monte Carlo codes.
#[test]
fn all_orders() {
    let cells = compare(&Path, "SO", 8192, None);
    let all = summarise(cells.iter());
    println!(
        "all orders: mean {:+.5} ± {:.5} rms {:.5} noise {:.5}",
        all.mean, all.standard_error, all.rms, all.noise
    );
    let groups = trends(&cells);
    assert!(all.noise < 0.003, "noise {}", all.noise);
    assert!(
        all.mean.abs() < 0.0025 && all.rms < 0.005,
        "mean {} rms {}",
        all.mean,
        all.rms
    );
    for (name, s) in groups {
        assert!(
            s.mean.abs() < 3.0 * s.standard_error + 0.002,
            "{name}: mean {} ± {}",
            s.mean,
            s.standard_error
        );
    }
}

/// Power: our first order is a line integral with hardly any noise, held below 0.05 % in single cells; what differs is the
/// quadrature, ours or theirs.
#[test]
fn single_scattering() {
    let cells = compare(&Path, "SS", 1024, Some(1));
    let all = summarise(cells.iter());
    println!(
        "single scattering: mean {:+.5} ± {:.5} rms {:.5} noise {:.5}",
        all.mean, all.standard_error, all.rms, all.noise
    );
    trends(&cells);
    assert!(all.noise < 0.0005, "noise {}", all.noise);
    assert!(all.mean.abs() < 0.002, "mean {}", all.mean);
}

/// Rationale: the fast solver against a deterministic code of the same kind. Expected: within 0.3 % rms, and no cell off by
/// 1 %. Neither has noise, so any difference is discretisation, theirs or ours.
#[test]
fn shells_agree() {
    let shells = Shells {
        accuracy: Accuracy::Default,
    };
    for (method, max_order) in [("SO", None), ("SS", Some(1))] {
        let cells = compare(&shells, method, 1, max_order);
        let all = summarise(cells.iter());
        println!("shells {method}: mean {:+.5} rms {:.5}", all.mean, all.rms);
        trends(&cells);
        assert!(all.rms < 0.003, "{method}: rms {}", all.rms);
        for c in &cells {
            let off = c.excess[0];
            assert!(off.abs() < 0.01, "{method}: {off} at {:?}", c.cell.look());
        }
    }
}

/// Rationale: the same under a high and a setting sun, and with aerosol, which the published sky does not have. Expected, up to view
/// zenith angles of 82°: 0.3 % rms in air. With aerosol they differ by 1 to 1.6 %, and by up to 58 % farther down; `path`, which shares neither
/// grid nor quadrature with `shells`, then stands with `shells` to its noise (docs/validation.md). Levels of 1 km are coarse for an aerosol that falls
/// off with 1.5 km, and theirs interpolate albedo and phase function between them, ours the coefficients.
#[test]
fn shells_agree_under_other_suns_and_with_aerosol() {
    let shells = Shells {
        accuracy: Accuracy::Default,
    };
    for sun_zenith_deg in [30.0, 60.0, 75.0, 83.0, 87.0] {
        for (name, medium, most) in [
            ("air", medium as fn(&[f64]) -> LayeredMedium, 0.003),
            ("aerosol", medium_with_aerosol, 0.017),
        ] {
            let cells = other_sky(name, sun_zenith_deg);
            assert_eq!(cells.len(), 2 * 41);
            let job = Job {
                seed: 0,
                batches: 1,
                spp: 1,
                max_order: None,
            };
            let compared = compare_with(&shells, cells, medium, sun_zenith_deg, job);
            let off: Vec<f64> = compared
                .iter()
                .filter(|c| c.cell.view_zenith_deg <= 82.0)
                .map(|c| c.excess[0])
                .collect();
            assert_eq!(off.len(), 2 * 31);
            let mean_of =
                |f: fn(f64) -> f64| off.iter().map(|&x| f(x)).sum::<f64>() / off.len() as f64;
            let (mean, rms) = (mean_of(|x| x), mean_of(|x| x * x).sqrt());
            println!("{name}, sun zenith {sun_zenith_deg}: mean {mean:+.5} rms {rms:.5}");
            assert!(rms < most, "{name}, sun zenith {sun_zenith_deg}: rms {rms}");
        }
    }
}
