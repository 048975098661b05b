use super::*;
use crate::climate::{Conditions, Overrides};
use crate::composition::aerosol::AerosolType;
use crate::image::test_support::Folder;
use crate::sky::PLANET_RADIUS_M;

fn made(overrides: &Overrides, nm: &[f64]) -> (Composition, Inventory, WavelengthGrid) {
    let mut conditions = Conditions::from_sun(30.0, 180.0, overrides).unwrap();
    let aerosol = AerosolType::of_conditions(&conditions).unwrap();
    let grid = WavelengthGrid::new(nm.to_vec()).unwrap();
    let composition = Composition::new(&mut conditions, &aerosol, &grid).unwrap();
    let inventory = Inventory::new(&composition, &grid).unwrap();
    (composition, inventory, grid)
}

/// The parts must be the whole: the sum over species is the medium that light is followed through.
#[test]
fn parts_add_up_to_the_medium() {
    let overrides = Overrides {
        no2_du: Some(0.5),
        mesosphere: Some("dust-and-ice".into()),
        ..Overrides::default()
    };
    let (composition, inventory, grid) = made(&overrides, &[320.0, 440.0, 550.0, 577.0, 720.0]);
    let (air, aerosol) = (&composition.air, &composition.aerosol);
    let medium = crate::medium::from_atmosphere(air, aerosol, &grid, PLANET_RADIUS_M).unwrap();
    for (lane, tau) in inventory.tau().into_iter().enumerate() {
        let theirs = medium.vertical_optical_depth(lane);
        assert!((tau / theirs - 1.0).abs() < 1e-5, "{lane}: {tau} {theirs}");
    }
    let names: Vec<&str> = inventory.species.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "air",
            "ozone",
            "nitrogen dioxide",
            "water vapour",
            "oxygen",
            "oxygen pairs",
            "mixing layer",
            "free troposphere",
            "stratosphere",
            "mesospheric dust",
            "mesospheric ice"
        ]
    );
}

/// The column of a single layer is that layer; its exponent is that of the table of types; a phase function integrates to 1.
#[test]
fn the_aerosol_column_is_the_sum_of_its_layers() {
    let overrides = Overrides {
        aerosol: Some("rural".into()),
        stratosphere: Some("none".into()),
        mesosphere: Some("none".into()),
        aod_550: Some(0.3),
        ..Overrides::default()
    };
    let (composition, inventory, _) = made(&overrides, &[500.0, 550.0, 800.0]);
    let sum = &inventory.aerosol;
    assert!((sum.tau[1] - 0.3).abs() < 2e-4, "{}", sum.tau[1]);
    let layer = &composition.aerosol.layers[0];
    for i in 0..3 {
        assert!((sum.ssa[i] - layer.xs_sca[i] / layer.xs_ext[i]).abs() < 1e-12);
        assert!((sum.asymmetry[i] - layer.asymmetry[i]).abs() < 1e-12);
    }
    let alpha = -(layer.xs_ext[2] / layer.xs_ext[0]).ln() / (800.0f64 / 500.0).ln();
    assert!((sum.angstrom[1] - alpha).abs() < 1e-9);
    let t = inventory.theta_deg.len();
    for scatterer in [
        &sum.phase,
        &inventory.species[0].scattering.as_ref().unwrap().phase,
    ] {
        let whole = composition
            .aerosol
            .angles
            .sphere_integral(&scatterer[t..2 * t]);
        assert!((whole - 1.0).abs() < 1e-4, "{whole}");
    }
}

/// Without aerosol there is no albedo, which is not a number and not a failure; nor is a single wavelength.
#[test]
fn no_aerosol_has_no_albedo() {
    let overrides = Overrides {
        aod_550: Some(0.0),
        stratosphere: Some("none".into()),
        mesosphere: Some("none".into()),
        ..Overrides::default()
    };
    let (_, inventory, _) = made(&overrides, &[550.0]);
    let sum = &inventory.aerosol;
    assert!(sum.tau[0] == 0.0 && sum.ssa[0].is_nan() && sum.angstrom[0].is_nan());
    let folder = Folder::new("inventory");
    for name in ["a.csv", "a.nc", "a.svg"] {
        inventory.save(&folder.join(name), &[]).unwrap();
    }
    let svg = std::fs::read_to_string(folder.join("a.svg")).unwrap();
    assert!(svg.starts_with("<svg") && !svg.contains("NaN") && !svg.contains("inf"));
    let e = inventory.save(&folder.join("a.png"), &[]).unwrap_err();
    assert_eq!(e.hint(), "use .csv, .nc or .svg");
    assert_eq!(folder.listing(), ["a.csv", "a.nc", "a.svg"]);
}

/// CSV says with every number what it is.
#[test]
fn csv_is_one_number_a_line() {
    let (_, inventory, _) = made(&Overrides::default(), &[450.0, 550.0]);
    let csv = inventory.csv(&[("place".to_owned(), "two\nlines".to_owned())]);
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("# place: two lines"));
    let header = "quantity,species,wavelength_nm,altitude_m,angle_deg,value,unit";
    assert_eq!(lines.next(), Some(header));
    assert!(lines.all(|l| l.split(',').count() == 7));
    let depth = "scattering_optical_depth,air,550,,,";
    let found = csv.lines().find(|l| l.starts_with(depth)).unwrap();
    let value: f64 = found.split(',').nth(5).unwrap().parse().unwrap();
    assert!((value - 0.097).abs() < 1e-3, "{value}");
}
