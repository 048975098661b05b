//! How high the ground lies where nobody says.

use std::sync::OnceLock;

use super::blend::{cached, damaged, smoothstep, GlobeGrid};
use crate::error::Result;

const GRID: GlobeGrid = GlobeGrid {
    step_deg: 0.5,
    first_latitude_deg: 89.75,
    direction: -1.0,
    first_longitude_deg: -179.75,
    rows: 360,
    columns: 720,
};

/// Half-width of the pyramid that makes a region of its surroundings \[deg\].
const REGION_DEG: f64 = 1.5;

/// Elevation of a place above sea level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elevation {
    /// Of the place: mean over half a degree, bilinear between the cells' middles \[m\].
    pub here_m: f64,
    /// Spread of the four cells around it \[m\]: what a place between mountain and valley may be off.
    pub spread_m: f64,
    /// Mean of its surroundings to 1.5° in each direction \[m\]: the ground on which the aerosol's layers stand.
    pub region_m: f64,
}

/// Elevation of the ground; 0 at sea.
///
/// `latitude_deg` −90 to 90, any `longitude_deg`.
///
/// # Errors
/// [`crate::Error::Invalid`] if the embedded table is damaged.
///
/// # Source
/// Half-degree means of Mapzen's terrain tiles as carried by pvlib, see `data/climate_elevation/SOURCE.md`.
pub fn elevation(latitude_deg: f64, longitude_deg: f64) -> Result<Elevation> {
    static CELLS: OnceLock<Result<Vec<f32>>> = OnceLock::new();
    let cells = cached(&CELLS, load)?;
    let corners = GRID.corners(latitude_deg, longitude_deg);
    let here_m: f64 = corners.iter().map(|&(i, w)| w * f64::from(cells[i])).sum();
    let variance: f64 = corners
        .iter()
        .map(|&(i, _)| (f64::from(cells[i]) - here_m).powi(2) / 4.0)
        .sum();
    let nodes = GRID.pyramid(latitude_deg, longitude_deg, REGION_DEG);
    let around: f64 = nodes.iter().map(|&(i, w)| w * f64::from(cells[i])).sum();
    // Meridians meet at the pole, and so must their regions.
    let polar = smoothstep(85.0, 90.0, latitude_deg.abs());
    let region_m = if polar > 0.0 {
        around + polar * (polar_mean(cells, latitude_deg) - around)
    } else {
        around
    };
    Ok(Elevation {
        here_m,
        spread_m: variance.sqrt(),
        region_m,
    })
}

/// Mean of the cells within the region of a pole \[m\].
fn polar_mean(cells: &[f32], latitude_deg: f64) -> f64 {
    let count = (REGION_DEG / GRID.step_deg) as usize * GRID.columns;
    let from = if latitude_deg > 0.0 {
        0
    } else {
        cells.len() - count
    };
    let sum: f64 = cells[from..from + count]
        .iter()
        .map(|&z| f64::from(z))
        .sum();
    sum / count as f64
}

fn load() -> Result<Vec<f32>> {
    let bytes = include_bytes!("../../../../data/climate_elevation/elevation_0p5deg.bin");
    if bytes.len() != 2 * GRID.rows * GRID.columns {
        return Err(damaged("climate_elevation"));
    }
    let metres = |pair: &[u8]| f32::from(i16::from_le_bytes([pair[0], pair[1]]));
    let mut cells: Vec<f32> = bytes.chunks_exact(2).map(metres).collect();
    // A pole is one place: the cells around it count as their mean.
    for row in [0, GRID.rows - 1] {
        let pole = &mut cells[row * GRID.columns..(row + 1) * GRID.columns];
        let mean = pole.iter().sum::<f32>() / GRID.columns as f32;
        pole.fill(mean);
    }
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Well-known places, to what a half-degree mean can tell.
    #[test]
    fn known_elevations() {
        for (name, lat, lon, metres, within) in [
            ("mid-Pacific", 0.0, -150.0, 0.0, 1.0),
            ("South Pole", -90.0, 0.0, 2835.0, 300.0),
            ("Lhasa", 29.65, 91.1, 4500.0, 600.0),
            ("Madrid", 40.42, -3.7, 690.0, 150.0),
            ("Groningen", 53.2, 6.57, 2.0, 20.0),
            ("Bolivian Altiplano", -18.0, -68.0, 4000.0, 400.0),
            ("Summit, Greenland", 72.6, -38.5, 3216.0, 200.0),
        ] {
            let here = elevation(lat, lon).unwrap().here_m;
            assert!((here - metres).abs() < within, "{name}: {here}");
        }
        // Mauna Loa's observatory stands 3 km above its region.
        assert!(elevation(19.54, -155.58).unwrap().region_m < 600.0);
    }

    #[test]
    fn nothing_jumps_at_the_date_line() {
        let (west, east) = (
            elevation(67.0, 180.0).unwrap().here_m,
            elevation(67.0, -180.0).unwrap().here_m,
        );
        assert_eq!(west, east);
    }
}
