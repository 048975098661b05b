//! The shipped tables of particle optics against the Mie theory that they come from.

use celaje::composition::aerosol::{all_sources, AerosolType, ParticleSource};
use celaje::optics::tables::{humidity_nodes, lookup, wavelength_nodes_nm};
use celaje::optics::{
    aerosol_optics, aerosol_optics_on, particle_optics, AngleGrid, ParticleOptics,
};
use celaje::WavelengthGrid;

/// The largest differences between a table and direct computation.
#[derive(Debug, Default)]
struct Worst {
    ext: f64,
    ssa: f64,
    asymmetry: f64,
    f11: f64,
    /// Of F12, F33 and F34 over F11.
    ratio: f64,
}

impl Worst {
    fn meet(&mut self, table: &ParticleOptics, direct: &ParticleOptics) {
        let larger = |a: &mut f64, b: f64| *a = a.max(b.abs());
        larger(&mut self.ext, table.xs_ext / direct.xs_ext - 1.0);
        let ssa = |o: &ParticleOptics| o.xs_sca / o.xs_ext;
        larger(&mut self.ssa, ssa(table) - ssa(direct));
        larger(&mut self.asymmetry, table.asymmetry - direct.asymmetry);
        let (t, d) = (&table.matrix, &direct.matrix);
        for i in 0..d.f11.len() {
            larger(&mut self.f11, t.f11[i] / d.f11[i] - 1.0);
            for (a, b) in [(&t.f12, &d.f12), (&t.f33, &d.f33), (&t.f34, &d.f34)] {
                larger(&mut self.ratio, a[i] / t.f11[i] - b[i] / d.f11[i]);
            }
        }
    }
}

fn direct(source: &ParticleSource, humidity: f64, nm: f64) -> ParticleOptics {
    let particle = source.particle(humidity).unwrap();
    let at = particle.index.at(nm).unwrap();
    particle_optics(&particle.size, at.n, at.k, nm, &AngleGrid::default()).unwrap()
}

fn compare(source: &ParticleSource, humidity: f64, nm: f64) -> Worst {
    let table = lookup(source, humidity, &[nm]).unwrap().unwrap();
    let mut worst = Worst::default();
    worst.meet(&table[0], &direct(source, humidity, nm));
    worst
}

fn opac(id: &str) -> ParticleSource {
    ParticleSource::Opac(id.to_owned())
}

fn aiaa(family: &str, matter: &str) -> ParticleSource {
    ParticleSource::Aiaa {
        matter: matter.to_owned(),
        humidity_percent: None,
        family: family.to_owned(),
    }
}

fn sample() -> Vec<ParticleSource> {
    vec![
        opac("waso"),
        opac("inso"),
        opac("soot"),
        opac("ssam"),
        opac("suso"),
        opac("micm"),
        aiaa("maritime", "ssam"),
        aiaa("rural", "waso"),
        aiaa("desert_dust_storm", "miam"),
        aiaa("polar", "suso"),
    ]
}

/// A fresh computation of a sample is what is shipped, but for rounding. `make_tables --check` does it for all.
#[test]
fn shipped_tables_are_what_mie_theory_says() {
    let nodes = wavelength_nodes_nm();
    for (i, source) in sample().iter().enumerate() {
        let humidities = humidity_nodes(source);
        let humidity = humidities[(3 * i) % humidities.len()];
        for nm in [nodes[(11 * i) % nodes.len()], 550.0] {
            let worst = compare(source, humidity, nm);
            let what = format!("{source:?} {humidity} % {nm} nm {worst:?}");
            assert!(worst.ext < 1e-6 && worst.ssa < 2e-6, "{what}");
            assert!(worst.asymmetry < 1e-6, "{what}");
            // Half a step of 2⁻¹¹, and what normalisation makes of it; half a step of 0.002.
            assert!(worst.f11 < 3e-4 && worst.ratio < 0.001 + 1e-9, "{what}");
        }
    }
}

/// Between wavelength nodes, at nodes of humidity: extinction within 0.07 %, F11 within 1 % and mostly within 0.3 %, the
/// ratios within 0.011; three times as much for the insoluble component below 300 and beyond 2000 nm.
#[test]
fn interpolation_over_wavelength_errs_as_stated() {
    for (i, source) in sample().iter().enumerate() {
        for nm in [284.7, 312.0, 362.5, 537.0, 869.0, 1181.5, 2360.0] {
            let humidity = humidity_nodes(source)[(5 * i) % humidity_nodes(source).len()];
            let worst = compare(source, humidity, nm);
            let name = source.table_name().unwrap();
            let what = format!("{name} {humidity} % {nm} nm {worst:?}");
            // The insoluble component's index leaps from row to row below 300 and beyond 2000 nm.
            let steep = name == "inso" && !(300.0..2000.0).contains(&nm);
            let times = if steep { 3.5 } else { 1.0 };
            assert!(worst.ext < 7e-4 * times, "{what}");
            assert!(worst.ssa < 3e-4 * times, "{what}");
            assert!(worst.asymmetry < 1e-4 * times, "{what}");
            assert!(worst.f11 < 0.01 * times, "{what}");
            assert!(worst.ratio < 0.011 * times, "{what}");
        }
    }
}

/// Between humidity nodes, against the particle that κ-Köhler theory puts there (`opac::component`). The cross sections are
/// never off by more than 0.12 %; phase functions of drying salt are, in its rainbow, which moves and fades.
#[test]
fn interpolation_over_humidity_errs_as_stated() {
    for source in [
        opac("waso"),
        opac("ssam"),
        opac("sscm"),
        opac("suso"),
        aiaa("maritime", "ssam"),
        aiaa("rural", "waso"),
    ] {
        let name = source.table_name().unwrap();
        for (humidity, nm) in [
            (5.0, 400.0),
            (27.0, 400.0),
            (43.0, 550.0),
            (61.0, 1000.0),
            (75.0, 400.0),
            (86.0, 550.0),
            (97.0, 400.0),
            (98.6, 400.0),
        ] {
            let worst = compare(&source, humidity, nm);
            let what = format!("{name} {humidity} % {nm} nm {worst:?}");
            assert!(worst.ext < 1.2e-3 && worst.ssa < 1e-4, "{what}");
            assert!(worst.asymmetry < 2e-4, "{what}");
            let (f11, ratio) = match (name.as_str(), humidity < 50.0) {
                // Coarse salt scatters 1 % of the light of the air that it is in.
                ("sscm", true) => (0.2, 0.065),
                ("sscm", false) => (0.035, 0.016),
                ("ssam" | "maritime/ssam", true) => (0.02, 0.02),
                _ => (0.005, 0.006),
            };
            assert!(worst.f11 < f11 && worst.ratio < ratio, "{what}");
        }
    }
}

/// Every kind of particle at every humidity node has its own rows and blocks: the block read is the one asked for.
#[test]
fn every_particle_is_in_the_tables() {
    let mut kinds = 0;
    for source in all_sources().unwrap() {
        for &humidity in humidity_nodes(&source) {
            let optics = lookup(&source, humidity, &[550.0]).unwrap().unwrap();
            let angles = AngleGrid::default();
            let mean_cosine: f64 = {
                let (mu, f) = (angles.cos_theta(), &optics[0].matrix.f11);
                (0..mu.len() - 1)
                    .map(|i| {
                        let (a, b, fa, fb) = (mu[i], mu[i + 1], f[i], f[i + 1]);
                        (a - b) / 6.0 * (2.0 * a * fa + 2.0 * b * fb + a * fb + b * fa)
                    })
                    .sum()
            };
            let g = 2.0 * std::f64::consts::PI * mean_cosine;
            let name = source.table_name().unwrap();
            assert!(
                (g - optics[0].asymmetry).abs() < 3e-4,
                "{name} {humidity} {g} {}",
                optics[0].asymmetry
            );
            kinds += 1;
        }
    }
    assert_eq!(kinds, 157);
}

/// Whole types from tables are types from Mie theory, per layer and far from the nodes: extinction within 0.02 %, albedo and
/// asymmetry within 1e-4, the phase function within 0.5 %.
#[test]
fn types_from_tables_are_types_from_mie_theory() {
    let grid = WavelengthGrid::new(vec![412.0, 672.0]).unwrap();
    for name in [
        "opac:maritime-clean",
        "opac:urban",
        "maritime-mineral",
        "continental",
    ] {
        let aerosol = AerosolType::named(name, 45.0).unwrap();
        let table = aerosol_optics(&aerosol, 83.0, &grid).unwrap();
        let mie = aerosol_optics_on(&aerosol, 83.0, &grid, &AngleGrid::default()).unwrap();
        for (a, b) in table.layers.iter().zip(&mie.layers) {
            for w in 0..2 {
                let what = format!("{name} {} {} nm", a.name, grid.nm()[w]);
                let ssa = a.xs_sca[w] / a.xs_ext[w] - b.xs_sca[w] / b.xs_ext[w];
                assert!((a.xs_ext[w] / b.xs_ext[w] - 1.0).abs() < 2e-4, "{what}");
                assert!(ssa.abs() < 1e-4, "{what} {ssa}");
                assert!((a.asymmetry[w] - b.asymmetry[w]).abs() < 1e-4, "{what}");
                for (x, y) in a.matrix[w].f11.iter().zip(&b.matrix[w].f11) {
                    assert!((x / y - 1.0).abs() < 0.005, "{what} {}", x / y);
                }
            }
        }
    }
}
