//! The peer scene: Rayleigh air over a grey ground, defined to the last digit so that several codes can compute it.

use celaje::math::Vec3;
use celaje::medium::LayeredMedium;
use celaje::optics::Phase;
use celaje::transport::{Scene, SunLight};

use super::csv_rows;

pub const PLANET_RADIUS_M: f64 = 6_371_000.0;
pub const ALBEDO: f64 = 0.1;
const DEPOLARISATION: f64 = 0.0279;
const AIR: &str = include_str!("../reference/peer_scene_air_density.csv");
const SKY: &str = include_str!("../reference/peer_scene_rayleigh_sun60.csv");
const OTHER_SKIES: &str = include_str!("../reference/peer_scene_sasktran2.csv");

/// Bodhaine et al. 1999, doi:10.1175/1520-0426(1999)016<1854:ORODC>2.0.CO;2, eq. 29 \[m²\].
fn cross_section_m2(wavelength_nm: f64) -> f64 {
    let l2 = (wavelength_nm * 1e-3).powi(2);
    1e-32 * (1.0455996 - 341.29061 / l2 - 0.90230850 * l2)
        / (1.0 + 0.0027059889 / l2 - 85.968563 * l2)
}

/// The air: density at 101 nodes, linear between them.
pub fn medium(wavelength_nm: &[f64]) -> LayeredMedium {
    let rows = csv_rows(AIR);
    let column = |k: usize| -> Vec<f64> { rows.iter().map(|r| r[k].parse().unwrap()).collect() };
    let altitude_m: Vec<f64> = column(0).iter().map(|z| 1000.0 * z).collect();
    let sigma_s: Vec<f64> = column(3)
        .iter()
        .flat_map(|n| wavelength_nm.iter().map(move |&w| n * cross_section_m2(w)))
        .collect();
    let mut medium = LayeredMedium::new(&altitude_m, wavelength_nm, PLANET_RADIUS_M).unwrap();
    let phase = Phase::rayleigh(&vec![DEPOLARISATION; wavelength_nm.len()]).unwrap();
    medium
        .add(&sigma_s, &vec![0.0; sigma_s.len()], phase)
        .unwrap();
    medium
}

/// The same with the scene's aerosol.
pub fn medium_with_aerosol(wavelength_nm: &[f64]) -> LayeredMedium {
    let mut medium = medium(wavelength_nm);
    let altitude_m: Vec<f64> = csv_rows(AIR)
        .iter()
        .map(|r| 1000.0 * r[0].parse::<f64>().unwrap())
        .collect();
    let shape: Vec<f64> = altitude_m
        .iter()
        .map(|&z| if z < 30e3 { (-z / 1500.0).exp() } else { 0.0 })
        .collect();
    let column: f64 = (1..shape.len())
        .map(|i| 0.5 * (shape[i] + shape[i - 1]) * (altitude_m[i] - altitude_m[i - 1]))
        .sum();
    let extinction = |nm: f64| 0.15 * (nm / 550.0_f64).powf(-1.3) / column;
    let rows = |factor: f64| -> Vec<f64> {
        shape
            .iter()
            .flat_map(|s| wavelength_nm.iter().map(move |&nm| (s, nm)))
            .map(|(s, nm)| factor * s * extinction(nm))
            .collect()
    };
    let phase = Phase::henyey_greenstein(&vec![0.70; wavelength_nm.len()]).unwrap();
    medium.add(&rows(0.95), &rows(0.05), phase).unwrap();
    medium
}

/// The scene under a collimated sun of unit irradiance in the south.
pub fn scene<'a>(
    medium: &'a LayeredMedium,
    wavelength_nm: &[f64],
    sun_zenith_deg: f64,
) -> Scene<'a, LayeredMedium> {
    let n = wavelength_nm.len();
    let towards = Vec3::from_azimuth_elevation_deg(180.0, 90.0 - sun_zenith_deg);
    let sun = SunLight::new(towards, wavelength_nm, &vec![1.0; n], 0.0).unwrap();
    Scene::new(medium, sun, &vec![ALBEDO; n]).unwrap()
}

/// One published value, sun zenith angle 60°.
#[derive(Clone, Copy)]
pub struct Cell {
    pub wavelength_nm: f64,
    pub view_zenith_deg: f64,
    pub relative_azimuth_deg: f64,
    /// Per unit of normal irradiance \[sr⁻¹\].
    pub radiance: f64,
}

impl Cell {
    /// Where it looks; azimuths are relative to the sun's.
    pub fn look(&self) -> Vec3 {
        let azimuth_deg = 180.0 + self.relative_azimuth_deg;
        Vec3::from_azimuth_elevation_deg(azimuth_deg, 90.0 - self.view_zenith_deg)
    }
}

/// The published sky, wavelength by wavelength, every wavelength in the same directions; `method` is `SO` for all orders
/// or `SS` for single scattering.
pub fn published(method: &str) -> Vec<Cell> {
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

/// A sky under another sun by sasktran2; `scene` is `air` or `aerosol`.
pub fn other_sky(scene: &str, sun_zenith_deg: f64) -> Vec<Cell> {
    csv_rows(OTHER_SKIES)
        .into_iter()
        .filter(|r| r[0] == scene && r[1].parse() == Ok(sun_zenith_deg))
        .map(|r| Cell {
            wavelength_nm: r[2].parse().unwrap(),
            view_zenith_deg: r[3].parse().unwrap(),
            relative_azimuth_deg: r[4].parse().unwrap(),
            radiance: r[5].parse().unwrap(),
        })
        .collect()
}

/// The published wavelengths \[nm\], rising, and directions.
pub fn axes(cells: &[Cell]) -> (Vec<f64>, Vec<Vec3>) {
    let mut wavelength_nm: Vec<f64> = cells.iter().map(|c| c.wavelength_nm).collect();
    wavelength_nm.sort_by(f64::total_cmp);
    wavelength_nm.dedup();
    let per_wavelength = cells.len() / wavelength_nm.len();
    let looks = cells[..per_wavelength].iter().map(Cell::look).collect();
    (wavelength_nm, looks)
}
