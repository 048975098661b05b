//! The composed atmosphere: against ASTM G173, against itself on finer grids, and with everything that may be chosen.

use std::sync::atomic::AtomicBool;

use celaje::climate::{Conditions, Overrides};
use celaje::composition::aerosol::{Aerosol, AerosolType, VerticalProfile};
use celaje::composition::particle::{RefractiveIndex, SizeDistribution};
use celaje::composition::{Atmosphere, GasColumns, VerticalGrid};
use celaje::medium::{from_atmosphere, grid_with_edges, LayeredMedium, Medium, Ray};
use celaje::optics::{aerosol_optics, AerosolOptics};
use celaje::sensor::Directions;
use celaje::sky::{Method, RenderOptions, SunDisc, PLANET_RADIUS_M};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::Budget;
use celaje::{Sky, WavelengthGrid};

#[allow(dead_code)]
#[path = "../examples/aerosol_table.rs"]
mod aerosol_table;

const G173: &str = include_str!("../../../tests/reference/astm_g173_direct_normal.csv");

fn optics(name: &str, grid: &WavelengthGrid) -> AerosolOptics {
    aerosol_optics(&AerosolType::named(name, 45.0).unwrap(), 80.0, grid).unwrap()
}

fn no_aerosol(grid: &WavelengthGrid) -> AerosolOptics {
    let aerosol = AerosolType::named("rural", 45.0).unwrap();
    let mut optics = aerosol_optics(&aerosol.with_upper_layers(Vec::new()), 50.0, grid).unwrap();
    optics.scale_to_aod_550(0.0, 0.0).unwrap();
    optics
}

/// Optical depth at every wavelength from the ground towards an elevation, by midpoints crowding at the ground.
fn slant_optical_depth(medium: &LayeredMedium, elevation_deg: f64) -> Vec<f64> {
    const STEPS: usize = 20_000;
    let ray = Ray {
        origin: celaje::math::Vec3::new(0.0, 0.0, medium.ground_radius_m()),
        direction: celaje::math::Vec3::from_azimuth_elevation_deg(0.0, elevation_deg),
    };
    let (span, _) = ray
        .through_air(medium.ground_radius_m(), medium.top_radius_m())
        .unwrap();
    let mut row = vec![0.0; medium.lanes()];
    let mut tau = vec![0.0; medium.wavelength_nm().len()];
    for i in 0..STEPS {
        let x = (i as f64 + 0.5) / STEPS as f64;
        let length = span.end_m - span.start_m;
        medium.extinction(ray.at(span.start_m + length * x * x), &mut row);
        let ds = length * 2.0 * x / STEPS as f64;
        tau.iter_mut()
            .zip(&row)
            .for_each(|(t, s)| *t += f64::from(*s) * ds);
    }
    tau
}

/// Direct normal irradiance of ASTM G173 from the conditions in its header, in 10 nm bands from 400 to 680 nm, with the file's
/// own sun.
///
/// Rationale: Rayleigh scattering, ozone and gas bands on a slant path through the sphere, against SMARTS. Expected behaviour:
/// 3 % in every band; a tenth of that is the light of the aureole in theirs, which ours leaves out.
#[test]
fn direct_sun_is_that_of_astm_g173() {
    let rows: Vec<[f64; 3]> = G173
        .lines()
        .filter(|l| !l.starts_with('#'))
        .skip(1)
        .map(|l| {
            let mut cells = l.split(',').map(|c| c.parse().unwrap());
            std::array::from_fn(|_| cells.next().unwrap())
        })
        .collect();
    let grid = WavelengthGrid::range(400.0, 680.0, 1.0).unwrap();
    let aerosol = no_aerosol(&grid);
    let columns = GasColumns {
        ozone_du: 343.8,
        no2_du: 0.2,
        water_mm: 14.16,
        co2_ppm: 370.0,
    };
    let levels = grid_with_edges(0.0, &aerosol).unwrap();
    let us76 = Atmosphere::named("us76").unwrap();
    let air = us76.profile_with(&levels, &columns).unwrap();
    let medium = from_atmosphere(&air, &aerosol, &grid, PLANET_RADIUS_M).unwrap();
    // Air mass 1.5.
    let tau = slant_optical_depth(&medium, 90.0 - 48.19);
    // Extinction of Shettle & Fenn's dry rural aerosol over that at 550 nm (LOWTRAN 7), logarithms linear. It makes 0.084 at
    // 500 nm from the header's 0.0764 at 550 nm; the header's exponent of 1.4314 above 500 nm would not.
    let rural: [(f64, f64); 3] = [(337.1, 1.605), (550.0, 1.0), (694.3, 0.75203)];
    let aerosol_depth = |nm: f64| {
        let (a, b) = if nm < 550.0 {
            (rural[0], rural[1])
        } else {
            (rural[1], rural[2])
        };
        let t = (nm / a.0).ln() / (b.0 / a.0).ln();
        1.5 * 0.0764 * a.1 * (b.1 / a.1).powf(t)
    };
    let mut worst: f64 = 0.0;
    for band in 0..28 {
        let (low, high) = (
            400.0 + 10.0 * f64::from(band),
            410.0 + 10.0 * f64::from(band),
        );
        let (mut ours, mut theirs) = (0.0, 0.0);
        for [nm, etr, direct] in rows.iter().filter(|r| r[0] >= low && r[0] <= high) {
            // 400 nm is the middle of half a bin of 0.5 nm there; all others are 1 nm apart.
            let weight = if *nm == low || *nm == high { 0.5 } else { 1.0 };
            let transmittance = (-tau[(nm - 400.0) as usize] - aerosol_depth(*nm)).exp();
            ours += weight * etr * transmittance;
            theirs += weight * direct;
        }
        let error = ours / theirs - 1.0;
        println!("{low}: {error:+.4}");
        worst = worst.max(error.abs());
    }
    assert!(worst < 0.03, "{worst}");
}

/// A grid with a node in the middle of every step, but those of 2 m in which the edges of layers are drawn.
fn halved(grid: &VerticalGrid) -> VerticalGrid {
    let z = grid.altitude_m();
    let mut nodes = vec![z[0]];
    for pair in z.windows(2) {
        if pair[1] - pair[0] > 2.5 {
            nodes.push(0.5 * (pair[0] + pair[1]));
        }
        nodes.push(pair[1]);
    }
    VerticalGrid::new(nodes).unwrap()
}

/// Halving every vertical step changes no radiance by 0.1 %.
///
/// Rationale: layers 1 km thick are 1.7 % wrong near the horizon. Expected behaviour: single scattering, which holds the
/// steepest dependence on the layers, is the same to 0.1 % in every direction down to the horizon, sun high, low and set.
#[test]
fn halving_the_vertical_step_changes_no_radiance() {
    let grid = WavelengthGrid::new(vec![400.0, 550.0, 700.0]).unwrap();
    let elevation_deg = [0.05, 0.5, 1.0, 2.0, 5.0, 15.0, 40.0, 90.0];
    let azimuth_deg = [10.0, 90.0, 180.0];
    let looks: Vec<(f64, f64)> = azimuth_deg
        .iter()
        .flat_map(|a| elevation_deg.iter().map(move |e| (*a, *e)))
        .collect();
    let (azimuth, elevation): (Vec<f64>, Vec<f64>) = looks.iter().copied().unzip();
    let sensor = Directions::new(&azimuth, &elevation).unwrap();
    let options = RenderOptions {
        method: Method::Path,
        accuracy: celaje::transport::Accuracy::default(),
        budget: Budget {
            spp: 16384,
            seed: 7,
            max_order: Some(1),
        },
        sun_disc: SunDisc::Off,
        altitude_m: None,
    };
    let us76 = Atmosphere::named("us76").unwrap();
    let columns = GasColumns {
        ozone_du: 300.0,
        ..GasColumns::default()
    };
    for name in ["opac:continental-average", "maritime-clean"] {
        let mut aerosol = optics(name, &grid);
        aerosol.scale_to_aod_550(0.12, 0.0).unwrap();
        let coarse = grid_with_edges(0.0, &aerosol).unwrap();
        let fine = halved(&coarse);
        for sun_elevation_deg in [-6.0, -3.0, 1.0, 30.0] {
            let films = [&coarse, &fine].map(|levels| {
                let air = us76.profile_with(levels, &columns).unwrap();
                let medium = from_atmosphere(&air, &aerosol, &grid, PLANET_RADIUS_M).unwrap();
                let sky =
                    Sky::from_medium(medium, sun_elevation_deg, 0.0, &[0.0; 3], &[1.0; 3], 0.0)
                        .unwrap();
                let cancel = AtomicBool::new(false);
                sky.render(&sensor, &options, &cancel, &|_, _| {}).unwrap()
            });
            for (i, look) in looks.iter().enumerate() {
                for lane in 0..3 {
                    let [a, b] = [0, 1].map(|f: usize| f64::from(films[f].spectrum(i)[lane]));
                    let change = if b > 0.0 { a / b - 1.0 } else { a };
                    let what = format!("{name} sun {sun_elevation_deg} {look:?} {lane}");
                    // Antisolar, the Earth's shadow cuts the ray: there sampling leaves 0.1 % of noise.
                    let allowed = if sun_elevation_deg < 0.0 && *look == (180.0, 5.0) {
                        2e-3
                    } else {
                        1e-3
                    };
                    assert!(change.abs() < allowed, "{what}: {change:+.5}");
                }
            }
        }
    }
}

fn sky(overrides: &Overrides) -> celaje::Result<Sky> {
    let conditions = Conditions::from_sun(30.0, 180.0, overrides)?;
    let grid = WavelengthGrid::range(545.0, 555.0, 5.0)?;
    Sky::new(conditions, &grid, SolarSpectrum::default())
}

/// Koschmieder: extinction at the ground is 3.912 over the visibility. LOWTRAN's own check: 23 km is 0.158 km⁻¹ of
/// aerosol and 0.012 of air.
#[test]
fn visibility_sets_extinction_at_the_ground() {
    for (visibility_km, aerosol) in [
        (23.0, "rural"),
        (5.0, "opac:urban"),
        (100.0, "maritime-clean"),
    ] {
        let sky = sky(&Overrides {
            visibility_km: Some(visibility_km),
            aerosol: Some(aerosol.into()),
            no_ozone: true,
            ..Overrides::default()
        })
        .unwrap();
        let ground = celaje::math::Vec3::new(0.0, 0.0, sky.medium.ground_radius_m());
        let lane = 1; // 550 nm
        let (sigma_t, _) = sky.medium.coefficients_at(lane, ground);
        assert!(
            (sigma_t * visibility_km * 1e3 / 3.912 - 1.0).abs() < 1e-3,
            "{sigma_t}"
        );
        let aod = &sky.conditions.as_ref().unwrap().aod_550;
        assert!(aod.value > 0.0 && aod.reason.contains("visibility"));
    }
    let too_clear = Overrides {
        visibility_km: Some(390.0),
        ..Overrides::default()
    };
    assert!(sky(&too_clear)
        .unwrap_err()
        .to_string()
        .starts_with("visibility"));
}

/// As tabulated: OPAC's own optical depths (Hess et al. 1998), times turbidity.
#[test]
fn tabulated_amounts_are_the_types_own() {
    let load = |turbidity| {
        let overrides = Overrides {
            aerosol_as_tabulated: true,
            turbidity,
            ..Overrides::default()
        };
        sky(&overrides).unwrap().conditions.unwrap().aod_550.value
    };
    // The column of 0.151 holds 0.005 of stratosphere.
    assert!((load(None) - 0.146).abs() < 0.002, "{}", load(None));
    assert!((load(Some(2.0)) / load(None) - 2.0).abs() < 1e-9);
    let twice = Overrides {
        aerosol_as_tabulated: true,
        visibility_km: Some(20.0),
        ..Overrides::default()
    };
    assert!(sky(&twice).is_err());
}

/// Upper layers add their published optical depths to the column; nothing else changes.
#[test]
fn stratosphere_and_mesosphere_are_chosen_by_name() {
    let tau = |stratosphere: &str, mesosphere: &str| {
        let overrides = Overrides {
            stratosphere: Some(stratosphere.into()),
            mesosphere: Some(mesosphere.into()),
            ..Overrides::default()
        };
        sky(&overrides).map(|sky| sky.medium.vertical_optical_depth(1))
    };
    let none = tau("none", "none").unwrap();
    for (stratosphere, mesosphere, published, tolerance) in [
        ("volcanic-fresh", "none", 0.086, 0.003),
        ("volcanic-aged", "none", 0.028, 0.002),
        ("background", "none", 0.005, 0.001),
        ("none", "dust", 2.5e-4, 1e-4),
        ("none", "dust-and-ice", 3e-4, 1e-4),
    ] {
        let more = tau(stratosphere, mesosphere).unwrap() - none;
        assert!(
            (more - published).abs() < tolerance,
            "{stratosphere} {mesosphere} {more}"
        );
    }
    assert!(tau("volcano", "none")
        .unwrap_err()
        .hint()
        .contains("volcanic-fresh"));
    assert!(tau("none", "snow").is_err());
}

/// Nitrogen dioxide and water absorb where they should and by how much they should: 1 DU of NO₂ has an optical depth of
/// 2.687e20 m⁻² times 5.7e-23 m² at 425 nm (within 10 %: the cross section depends on temperature and bin).
#[test]
fn gases_absorb_in_their_bands() {
    let tau = |overrides: &Overrides| {
        let conditions = Conditions::from_sun(30.0, 180.0, overrides).unwrap();
        let grid = WavelengthGrid::range(400.0, 800.0, 5.0).unwrap();
        let sky = Sky::new(conditions, &grid, SolarSpectrum::default()).unwrap();
        // 425, 550, 720 and 760 nm.
        [5, 30, 64, 72].map(|lane| sky.medium.vertical_optical_depth(lane))
    };
    let dry = tau(&Overrides {
        water_mm: Some(0.0),
        ..Overrides::default()
    });
    let no2 = tau(&Overrides {
        water_mm: Some(0.0),
        no2_du: Some(1.0),
        ..Overrides::default()
    });
    assert!(
        ((no2[0] - dry[0]) / (2.687e20 * 5.7e-23) - 1.0).abs() < 0.1,
        "{no2:?} {dry:?}"
    );
    let wet = tau(&Overrides {
        water_mm: Some(40.0),
        ..Overrides::default()
    });
    assert!((wet[1] - dry[1]).abs() < 1e-9);
    assert!(wet[2] - dry[2] > 0.05);
    assert!(dry[3] > dry[2] + 0.1);
}

/// An aerosol of one's own stands where it was put, with the optical depth that was asked for.
#[test]
fn an_aerosol_of_ones_own() {
    let own = Aerosol {
        name: "smoke".into(),
        refractive_index: RefractiveIndex::constant(1.52, 0.02).unwrap(),
        size: SizeDistribution::lognormal(0.08, 1.6).unwrap(),
        profile: VerticalProfile::sampled(vec![2e3, 2.1e3, 3.3e3], vec![0.0, 1.0, 0.5]).unwrap(),
    };
    let overrides = Overrides {
        aod_550: Some(0.3),
        stratosphere: Some("none".into()),
        mesosphere: Some("none".into()),
        ..Overrides::default()
    };
    let conditions = Conditions::from_sun(30.0, 180.0, &overrides).unwrap();
    let grid = WavelengthGrid::new(vec![550.0]).unwrap();
    let with = |aod| {
        let mut conditions = conditions.clone();
        conditions.aod_550.value = aod;
        let own = AerosolType::from(own.clone());
        Sky::with_aerosol(conditions, &own, &grid, SolarSpectrum::default()).unwrap()
    };
    let (smoky, clean) = (with(0.3), with(0.0));
    let tau = |sky: &Sky| sky.medium.vertical_optical_depth(0);
    assert!(
        (tau(&smoky) - tau(&clean) - 0.3).abs() < 3e-4,
        "{}",
        tau(&smoky) - tau(&clean)
    );
    let at = |sky: &Sky, z: f64| {
        let place = celaje::math::Vec3::new(0.0, 0.0, PLANET_RADIUS_M + z);
        sky.medium.coefficients_at(0, place).0
    };
    assert_eq!(at(&smoky, 1500.0), at(&clean, 1500.0));
    assert!(at(&smoky, 2500.0) > 2.0 * at(&clean, 2500.0));
    assert_eq!(at(&smoky, 3500.0), at(&clean, 3500.0));
    // Beyond its index it is refused.
    let short = RefractiveIndex::new(vec![500.0, 600.0], vec![1.5, 1.5], vec![0.0, 0.0]).unwrap();
    let own = Aerosol {
        refractive_index: short,
        ..own.clone()
    };
    let grid = WavelengthGrid::new(vec![700.0]).unwrap();
    let refused = Sky::with_aerosol(conditions, &own.into(), &grid, SolarSpectrum::default());
    assert!(refused.is_err());
}

/// Layers without particles, or with fewer than none, and wavelengths beyond the data are refused; what is extrapolated below a
/// table of indices is flagged.
#[test]
fn nonsense_compositions_are_refused() {
    let grid = WavelengthGrid::new(vec![550.0]).unwrap();
    for number_density in [-1.0, 0.0, f64::NAN] {
        let mut aerosol = AerosolType::named("rural", 45.0).unwrap();
        for component in &mut aerosol.layers[0].components {
            component.number_density = number_density;
        }
        assert!(
            aerosol_optics(&aerosol, 50.0, &grid).is_err(),
            "{number_density}"
        );
    }
    let rural = AerosolType::named("rural", 45.0).unwrap();
    for humidity in [-1.0, 99.5, f64::NAN] {
        assert!(
            aerosol_optics(&rural, humidity, &grid).is_err(),
            "{humidity}"
        );
    }
    assert!(WavelengthGrid::new(vec![270.0]).is_err());
    assert!(WavelengthGrid::new(vec![2600.0]).is_err());
    let index = RefractiveIndex::new(
        vec![400.0, 500.0, 600.0, 700.0],
        vec![1.5, 1.5, 1.5, 1.5],
        vec![0.03, 0.02, 0.01, 0.01],
    );
    let own = Aerosol {
        name: "own".into(),
        refractive_index: index.unwrap(),
        size: SizeDistribution::lognormal(0.1, 1.5).unwrap(),
        profile: VerticalProfile::sampled(vec![0.0, 1e3], vec![1.0, 1.0]).unwrap(),
    };
    let flagged = |nm: f64| {
        let grid = WavelengthGrid::new(vec![nm]).unwrap();
        let aerosol = AerosolType::from(own.clone());
        aerosol_optics(&aerosol, 50.0, &grid).map(|optics| optics.extrapolated)
    };
    assert!(flagged(350.0).unwrap());
    assert!(!flagged(450.0).unwrap());
    assert!(flagged(750.0).is_err());
}

/// OPAC's published column optical depths, albedos, asymmetries and Ångström exponents of all ten types.
#[test]
fn opac_types_have_the_published_optics() {
    for (name, [tau, ssa, g, a1, a2]) in aerosol_table::OPAC_PUBLISHED {
        let aerosol = AerosolType::named(name, 45.0).unwrap();
        let optics = aerosol_table::optics(&aerosol).unwrap();
        let depth: f64 = optics.layers.iter().map(|l| l.aod_550_above(0.0)).sum();
        let ours = aerosol_table::values(&optics.layers[0]);
        let what = format!("{name} {depth} {ours:?}");
        assert!((depth - tau).abs() < 0.0015, "{what}");
        assert!((ours[0] - ssa).abs() < 0.001, "{what}");
        assert!((ours[1] - g).abs() < 0.0015, "{what}");
        assert!(
            (ours[2] - a1).abs() < 0.015 && (ours[3] - a2).abs() < 0.015,
            "{what}"
        );
    }
}

/// The manual's table is what the program computes.
#[test]
fn the_page_of_types_is_up_to_date() {
    let page = include_str!("../../../docs/aerosols.md");
    assert_eq!(
        page,
        aerosol_table::page().unwrap(),
        "run the example aerosol_table"
    );
}
