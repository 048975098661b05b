//! From gases and particles to a layered medium.

use super::LayeredMedium;
use crate::composition::{AirProfile, VerticalGrid};
use crate::error::Result;
use crate::optics::bands::{oxygen_pairs, BandAbsorption, OXYGEN_SHARE};
use crate::optics::no2::No2Absorption;
use crate::optics::ozone::OzoneAbsorption;
use crate::optics::rayleigh::Rayleigh;
use crate::optics::{AerosolOptics, LayerOptics, Phase, ScatteringMatrix};
use crate::spectrum::WavelengthGrid;

/// Half the height over which an aerosol layer's edge is drawn \[m\].
const EDGE_M: f64 = 1.0;

/// The standard grid above the ground, with a pair of nodes about each edge of an aerosol layer and one where it bends.
///
/// An edge between two nodes far apart would be drawn as a ramp; a pair 2 m apart keeps the layer's column.
///
/// # Errors
/// As [`VerticalGrid::standard`].
pub fn grid_with_edges(ground_m: f64, aerosol: &AerosolOptics) -> Result<VerticalGrid> {
    let standard = VerticalGrid::standard(ground_m)?;
    let inside = |z: &f64| *z > ground_m + 2.0 * EDGE_M && *z < VerticalGrid::TOP_M - 2.0 * EDGE_M;
    let (mut edges, mut bends) = (Vec::new(), Vec::new());
    for profile in aerosol.layers.iter().map(|layer| &layer.profile) {
        for z in profile.breaks_m().into_iter().filter(inside) {
            let (below, above) = (profile.relative(z - EDGE_M), profile.relative(z + EDGE_M));
            let jumps = (above - below).abs() > 0.01 * above.max(below);
            (if jumps { &mut edges } else { &mut bends }).push(z);
        }
    }
    let clear_of_edges = |z: &f64| edges.iter().all(|e: &f64| (z - e).abs() > 2.0 * EDGE_M);
    let mut nodes: Vec<f64> = standard
        .altitude_m()
        .iter()
        .copied()
        .chain(bends.iter().copied())
        .filter(clear_of_edges)
        .chain(edges.iter().flat_map(|e| [e - EDGE_M, e + EDGE_M]))
        .collect();
    nodes.sort_by(f64::total_cmp);
    nodes.dedup();
    VerticalGrid::new(nodes)
}

/// The medium of an atmosphere: air with its absorbing gases, and the layers of an aerosol.
///
/// # Arguments
/// * `air` — densities and temperatures on a grid, best from [`grid_with_edges`]
/// * `aerosol` — cross sections, phase functions and profiles at the wavelengths of `wavelength`
/// * `planet_radius_m` — radius of sea level
///
/// # Errors
/// Those of the optics for wavelengths beyond their tables, and of [`LayeredMedium::add`].
pub fn from_atmosphere(
    air: &AirProfile,
    aerosol: &AerosolOptics,
    wavelength: &WavelengthGrid,
    planet_radius_m: f64,
) -> Result<LayeredMedium> {
    let altitude_m = &air.altitude_m;
    let mut medium = LayeredMedium::new(altitude_m, wavelength.nm(), planet_radius_m)?;
    // Air scatters; its gases absorb, some at the temperature of their own layer; together they are one species.
    let rayleigh = Rayleigh::new()?;
    let xs_sca = air_scattering(air, wavelength)?;
    let depolarisation: Vec<f64> = wavelength
        .nm()
        .iter()
        .map(|&w| rayleigh.depolarisation(w))
        .collect();
    let sigma_s = outer(&air.air_number_density, &xs_sca);
    let mut sigma_a = vec![0.0; sigma_s.len()];
    for gas in gas_absorption(air, wavelength)? {
        let pairs = sigma_a.iter_mut().zip(&gas.sigma_a);
        pairs.for_each(|(sum, one)| *sum += one);
    }
    medium.add(&sigma_s, &sigma_a, Phase::rayleigh(&depolarisation)?)?;

    for layer in aerosol.layers.iter().filter(|l| l.number_density_ref > 0.0) {
        add_aerosol_layer(&mut medium, aerosol, layer)?;
    }
    Ok(medium)
}

/// Scattering cross section of air \[m²\], shape (w,).
///
/// # Errors
/// [`crate::Error::OutOfRange`] for wavelengths or carbon dioxide beyond the tables.
pub fn air_scattering(air: &AirProfile, wavelength: &WavelengthGrid) -> Result<Vec<f64>> {
    Rayleigh::new()?.xs_sca_on(wavelength, air.co2_ppm)
}

/// What one gas absorbs.
#[derive(Debug, Clone, PartialEq)]
pub struct GasAbsorption {
    /// What it is called.
    pub name: &'static str,
    /// Molecules \[m⁻³\], shape (z,).
    pub number_density: Vec<f64>,
    /// Absorption coefficient \[m⁻¹\], shape (z, w).
    pub sigma_a: Vec<f64>,
}

/// What each gas absorbs, along altitude and wavelength: ozone, nitrogen dioxide, water vapour, the bands of oxygen (and
/// carbon dioxide), colliding pairs of oxygen.
///
/// # Errors
/// [`crate::Error::OutOfRange`] for temperatures or amounts beyond the tables.
pub fn gas_absorption(air: &AirProfile, wavelength: &WavelengthGrid) -> Result<Vec<GasAbsorption>> {
    let ozone = OzoneAbsorption::new(wavelength)?;
    let no2 = No2Absorption::new(wavelength)?;
    let bands = BandAbsorption::new(wavelength, air.water_column_mm())?;
    let xs_pairs = oxygen_pairs(wavelength)?;
    let at_temperature = |density: &[f64], xs: &dyn Fn(f64) -> Result<Vec<f64>>| {
        let mut sigma_a = Vec::with_capacity(density.len() * wavelength.len());
        for (n, &temperature_k) in density.iter().zip(&air.temperature_k) {
            sigma_a.extend(xs(temperature_k)?.iter().map(|x| n * x));
        }
        Ok::<_, crate::Error>(sigma_a)
    };
    let gas = |name, density: &[f64], sigma_a| GasAbsorption {
        name,
        number_density: density.to_vec(),
        sigma_a,
    };
    let densities = &air.air_number_density;
    let oxygen: Vec<f64> = densities.iter().map(|n| OXYGEN_SHARE * n).collect();
    let squared: Vec<f64> = oxygen.iter().map(|n| n * n).collect();
    let (o3, nitrogen, water) = (
        &air.ozone_number_density,
        &air.no2_number_density,
        &air.water_number_density,
    );
    Ok(vec![
        gas("ozone", o3, at_temperature(o3, &|t| ozone.xs_abs(t))?),
        gas(
            "nitrogen dioxide",
            nitrogen,
            at_temperature(nitrogen, &|t| no2.xs_abs(t))?,
        ),
        gas("water vapour", water, outer(water, &bands.xs_water)),
        gas("oxygen", &oxygen, outer(densities, &bands.xs_mixed_per_air)),
        gas("oxygen pairs", &oxygen, outer(&squared, &xs_pairs)),
    ])
}

fn add_aerosol_layer(
    medium: &mut LayeredMedium,
    aerosol: &AerosolOptics,
    layer: &LayerOptics,
) -> Result<()> {
    let density = layer.number_densities(medium.altitude_m());
    if density.iter().all(|&d| d == 0.0) {
        return Ok(());
    }
    let xs_abs: Vec<f64> = layer
        .xs_ext
        .iter()
        .zip(&layer.xs_sca)
        .map(|(e, s)| (e - s).max(0.0))
        .collect();
    let element = |of: fn(&ScatteringMatrix) -> &Vec<f64>| -> Vec<f64> {
        layer.matrix.iter().flat_map(of).copied().collect()
    };
    medium.add(
        &outer(&density, &layer.xs_sca),
        &outer(&density, &xs_abs),
        Phase::spheres(
            aerosol.angles.theta_deg(),
            &element(|m| &m.f11),
            &element(|m| &m.f12),
            &element(|m| &m.f33),
            &element(|m| &m.f34),
        )?,
    )
}

/// `density[i] · xs[j]`, shape (altitude, wavelength).
fn outer(density: &[f64], xs: &[f64]) -> Vec<f64> {
    density
        .iter()
        .flat_map(|d| xs.iter().map(move |x| d * x))
        .collect()
}
