//! Anthropogenic aerosol: nine plumes that come and go with season and year (MACv2-SP).

use std::sync::OnceLock;

use super::blend::{cached, damaged};
use crate::error::Result;
use crate::math::interp::linear_clamped;
use crate::math::Table;
use crate::place::Instant;

/// One of two Gaussian features of a plume.
#[derive(Debug)]
struct Feature {
    latitude_deg: f64,
    longitude_deg: f64,
    /// Largest optical depth times the feature's weight \[1\].
    amplitude: f64,
    /// Standard deviation along the feature to its west and east \[deg\].
    along_deg: [f64; 2],
    /// The same across.
    across_deg: [f64; 2],
    /// Sine and cosine of the turn of the feature's axes.
    turn: (f64, f64),
    /// Factor through the year.
    season: Vec<f64>,
    /// Factor by year.
    by_year: Vec<f64>,
}

#[derive(Debug)]
struct Plumes {
    features: Vec<Feature>,
    /// Fractions of the year of `season`.
    fraction: Vec<f64>,
    /// Years of `by_year`, at their middles.
    year: Vec<f64>,
}

/// Optical depth at 550 nm of anthropogenic aerosol; the years before 1900 and after 2016 are as those.
///
/// # Errors
/// [`crate::Error::Invalid`] if an embedded table is damaged.
///
/// # Source
/// Stevens et al. 2017, MACv2-SP, doi:10.5194/gmd-10-433-2017, eqs. 3–8 for the optical depth.
pub(super) fn anthropogenic_aod_550(
    latitude_deg: f64,
    longitude_deg: f64,
    instant: &Instant,
) -> Result<f64> {
    static PLUMES: OnceLock<Result<Plumes>> = OnceLock::new();
    let plumes = cached(&PLUMES, load)?;
    let year = instant.decimal_year();
    let fraction = year.rem_euclid(1.0);
    let one = |f: &Feature| {
        let east = (longitude_deg - f.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
        let north = latitude_deg - f.latitude_deg;
        let (sin, cos) = f.turn;
        let (along, across) = (cos * east + sin * north, cos * north - sin * east);
        let side = usize::from(east > 0.0);
        let exponent = (along / f.along_deg[side]).powi(2) + (across / f.across_deg[side]).powi(2);
        f.amplitude
            * linear_clamped(&plumes.fraction, &f.season, fraction)
            * linear_clamped(&plumes.year, &f.by_year, year)
            * (-0.5 * exponent).exp()
    };
    Ok(plumes.features.iter().map(one).sum())
}

fn load() -> Result<Plumes> {
    let plumes = Table::parse(
        "macv2sp plumes",
        include_str!("../../../../data/climate_aerosol_macv2sp/plumes.csv"),
    )?;
    let season = Table::parse(
        "macv2sp season",
        include_str!("../../../../data/climate_aerosol_macv2sp/season.csv"),
    )?;
    let years = Table::parse(
        "macv2sp years",
        include_str!("../../../../data/climate_aerosol_macv2sp/years.csv"),
    )?;
    let column = |name: &str| plumes.numbers(name);
    let (lat, lon) = (column("latitude_deg")?, column("longitude_deg")?);
    let (weight, aod) = (column("weight")?, column("aod_max")?);
    let (west, east) = (column("west_deg")?, column("east_deg")?);
    let (west_across, east_across) = (column("west_across_deg")?, column("east_across_deg")?);
    let turn = column("turn_deg")?;
    let (plume, feature) = (plumes.words("plume")?, plumes.words("feature")?);
    let mut features = Vec::new();
    for i in 0..plumes.len() {
        let mut cycle = season.numbers(&format!("p{}f{}", plume[i], feature[i]))?;
        // The year closes on itself.
        cycle.push(*cycle.first().ok_or_else(|| damaged("macv2sp season"))?);
        features.push(Feature {
            latitude_deg: lat[i],
            longitude_deg: lon[i],
            amplitude: aod[i] * weight[i],
            along_deg: [west[i], east[i]],
            across_deg: [west_across[i], east_across[i]],
            turn: turn[i].to_radians().sin_cos(),
            season: cycle,
            by_year: years.numbers(&format!("p{}", plume[i]))?,
        });
    }
    let steps = season.len();
    Ok(Plumes {
        features,
        fraction: (0..=steps).map(|i| i as f64 / steps as f64).collect(),
        year: years.numbers("year")?.iter().map(|y| y + 0.5).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Global means stated with the parameter file: 0.027 in 2005, 0.028 in 2015, 0.029 in 1985.
    #[test]
    fn global_means_are_the_stated_ones() {
        for (year, expected) in [(2005, 0.027), (2015, 0.028), (1985, 0.029)] {
            let (mut sum, mut area) = (0.0, 0.0);
            for month in 1..=12 {
                let t: Instant = format!("{year}-{month:02}-15T00:00Z").parse().unwrap();
                for lat in (-88..90).step_by(4) {
                    let weight = f64::from(lat).to_radians().cos();
                    for lon in (-178..180).step_by(4) {
                        let aod = anthropogenic_aod_550(f64::from(lat), f64::from(lon), &t);
                        sum += weight * aod.unwrap();
                        area += weight;
                    }
                }
            }
            assert!(
                (sum / area - expected).abs() < 0.001,
                "{year}: {}",
                sum / area
            );
        }
    }
}
