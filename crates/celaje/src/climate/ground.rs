//! What the ground is made of, with its snow and sea ice, and how it reflects.

use std::sync::OnceLock;

use super::blend::{cached, damaged, months, smoothstep, GlobeGrid};
use crate::error::Result;
use crate::math::interp::linear_clamped;
use crate::math::Table;
use crate::place::Instant;

const GRID: GlobeGrid = GlobeGrid {
    step_deg: 1.0,
    first_latitude_deg: 89.5,
    direction: -1.0,
    first_longitude_deg: -179.5,
    rows: 180,
    columns: 360,
};

/// Names of the ground types, in the order of [`Ground::share`].
pub const GROUND_TYPES: [&str; 9] = [
    "water", "forest", "shrub", "grass", "crop", "barren", "ice", "urban", "wetland",
];
const WATER: usize = 0;

/// Half-width of the pyramid over which types mix \[deg\]: what keeps a coast from being a step. Wider from 65° on, where the
/// bright edge of the ice sheets is.
const TYPE_DEG: f64 = 2.5;
/// The same for snow and sea ice, whose edges wander from year to year.
const WHITE_DEG: f64 = 5.0;

/// The ground around a place: shares of types, and how much of them is white.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Ground {
    /// Share of each of [`GROUND_TYPES`] \[1\]; they sum to 1.
    pub share: [f64; 9],
    /// Share of the land under snow \[1\].
    pub snow: f64,
    /// Share of the water under ice \[1\].
    pub sea_ice: f64,
}

struct Tables {
    cells: Vec<u32>,
    wavelength_nm: Vec<f64>,
    /// Per type: bare and white, shape (w,).
    spectra: Vec<[Vec<f64>; 2]>,
}

fn tables() -> Result<&'static Tables> {
    static TABLES: OnceLock<Result<Tables>> = OnceLock::new();
    cached(&TABLES, load)
}

/// Broadband albedo of each type, bare and under snow (water: sea ice); the spectra are scaled to them.
const BROADBAND: [[f64; 2]; 9] = [
    [0.065, 0.55],
    [0.13, 0.35],
    [0.20, 0.60],
    [0.19, 0.65],
    [0.18, 0.65],
    [0.32, 0.65],
    [0.80, 0.80],
    [0.15, 0.45],
    [0.14, 0.50],
];

impl Ground {
    /// The ground around a place at a time of the year.
    ///
    /// Types are means under a pyramid of ±2.5° (±5° from 65° on), snow and sea ice of ±5° and linear between mid-months, so
    /// that nothing jumps.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if an embedded table is damaged.
    ///
    /// # Source
    /// MODIS MCD12C1 v006 land cover of 2019; snow and ice from monthly surface temperatures, see
    /// `data/climate_ground/SOURCE.md`.
    pub fn at(latitude_deg: f64, longitude_deg: f64, instant: &Instant) -> Result<Self> {
        let cells = &tables()?.cells;
        let mut share = [0.0; 9];
        let polar = smoothstep(50.0, 65.0, latitude_deg.abs());
        let half_width_deg = TYPE_DEG + polar * (WHITE_DEG - TYPE_DEG);
        for (i, weight) in GRID.pyramid(latitude_deg, longitude_deg, half_width_deg) {
            share[(cells[i] & 15) as usize] += weight;
        }
        let (first, second, later) = months(instant);
        let (mut land, mut water, mut snow, mut sea_ice) = (0.0, 0.0, 0.0, 0.0);
        for (i, weight) in GRID.pyramid(latitude_deg, longitude_deg, WHITE_DEG) {
            let cell = cells[i];
            let marked = |bit: usize| f64::from(cell >> bit & 1);
            let white =
                |from: usize| marked(from + first) * (1.0 - later) + marked(from + second) * later;
            if (cell & 15) as usize == WATER {
                water += weight;
                sea_ice += weight * white(16);
            } else {
                land += weight;
                snow += weight * white(4);
            }
        }
        let ratio = |part: f64, whole: f64| if whole > 1e-12 { part / whole } else { 0.0 };
        Ok(Self {
            share,
            snow: ratio(snow, land),
            sea_ice: ratio(sea_ice, water),
        })
    }

    /// Broadband albedo \[1\].
    pub fn broadband(&self) -> f64 {
        self.mean(|t, white| BROADBAND[t][white])
    }

    /// Albedo \[1\] at vacuum wavelengths \[nm\]; constant below 280 and above 2500 nm.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if an embedded table is damaged.
    pub fn spectral(&self, wavelength_nm: &[f64]) -> Result<Vec<f64>> {
        let tables = tables()?;
        let at = |nm: f64| {
            self.mean(|t, white| {
                linear_clamped(&tables.wavelength_nm, &tables.spectra[t][white], nm)
            })
        };
        Ok(wavelength_nm.iter().map(|&nm| at(nm)).collect())
    }

    /// The ground in words: types of 5 % at least, the largest first, snow and sea ice.
    pub fn words(&self) -> String {
        let mut order: Vec<usize> = (0..9).filter(|&t| self.share[t] >= 0.05).collect();
        order.sort_by(|&a, &b| self.share[b].total_cmp(&self.share[a]));
        let percent = |value: f64| (100.0 * value).round();
        let mut parts: Vec<String> = order
            .iter()
            .map(|&t| format!("{} {} %", GROUND_TYPES[t], percent(self.share[t])))
            .collect();
        if self.snow > 0.005 {
            parts.push(format!("snow on {} % of the land", percent(self.snow)));
        }
        if self.sea_ice > 0.005 && self.share[WATER] >= 0.05 {
            parts.push(format!("ice on {} % of the water", percent(self.sea_ice)));
        }
        parts.join(", ")
    }

    fn mean(&self, value: impl Fn(usize, usize) -> f64) -> f64 {
        (0..9)
            .filter(|&t| self.share[t] > 0.0)
            .map(|t| {
                let cover = if t == WATER { self.sea_ice } else { self.snow };
                self.share[t] * ((1.0 - cover) * value(t, 0) + cover * value(t, 1))
            })
            .sum()
    }
}

fn load() -> Result<Tables> {
    let bytes = include_bytes!("../../../../data/climate_ground/ground_1deg.bin");
    let table = Table::parse(
        "climate_ground",
        include_str!("../../../../data/climate_ground/spectra.csv"),
    )?;
    let cells: Vec<u32> = bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    let known = |cell: &u32| ((cell & 15) as usize) < GROUND_TYPES.len();
    if cells.len() != GRID.rows * GRID.columns || !cells.iter().all(known) {
        return Err(damaged("climate_ground"));
    }
    let mut spectra = Vec::new();
    for name in GROUND_TYPES {
        spectra.push([
            table.numbers(name)?,
            table.numbers(&format!("{name}_snow"))?,
        ]);
    }
    Ok(Tables {
        cells,
        wavelength_nm: table.numbers("wavelength_nm")?,
        spectra,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(lat: f64, lon: f64, time: &str) -> Ground {
        Ground::at(lat, lon, &time.parse().unwrap()).unwrap()
    }

    #[test]
    fn known_grounds() {
        let july = "2021-07-16T12:00Z";
        let pacific = ground(0.0, -150.0, july);
        assert!((pacific.share[WATER] - 1.0).abs() < 1e-12);
        assert!((pacific.broadband() - 0.065).abs() < 1e-12);
        let sahara = ground(23.0, 10.0, july);
        assert!(sahara.broadband() > 0.3 && sahara.words().starts_with("barren 100 %"));
        assert!((ground(-85.0, 40.0, july).broadband() - 0.8).abs() < 0.01);
        assert!(ground(62.0, 100.0, "2021-01-16T12:00Z").snow > 0.95);
        assert!(ground(62.0, 100.0, july).snow < 0.05);
        assert!(ground(80.0, 170.0, "2021-02-16T12:00Z").sea_ice > 0.95);
    }

    /// At the poles the longitude does not matter.
    #[test]
    fn poles_are_one_place() {
        for (pole, month) in [(90.0, 7), (90.0, 1), (-90.0, 1), (-90.0, 7)] {
            let time = format!("2021-{month:02}-16T12:00Z");
            let first = ground(pole, -180.0, &time).broadband();
            for lon in (-170..180).step_by(10) {
                let here = ground(pole, f64::from(lon), &time).broadband();
                assert!((here - first).abs() < 1e-3, "{pole} {lon}: {here} {first}");
            }
        }
    }

    /// Weighted by TSIS-1 sunlight, the spectra have the broadband albedo of their type (280 to 2500 nm).
    #[test]
    fn spectra_have_their_broadband_albedo() {
        use crate::spectrum::{SolarSpectrum, WavelengthGrid};
        let nm: Vec<f64> = (28..=250).map(|i| f64::from(i) * 10.0).collect();
        let grid = WavelengthGrid::new(nm.clone()).unwrap();
        let sun = SolarSpectrum::Tsis1.irradiance(&grid).unwrap();
        for (t, name) in GROUND_TYPES.iter().enumerate() {
            let mut one = Ground {
                share: [0.0; 9],
                snow: 0.0,
                sea_ice: 0.0,
            };
            one.share[t] = 1.0;
            for white in [0.0, 1.0] {
                (one.snow, one.sea_ice) = (white, white);
                let albedo = one.spectral(&nm).unwrap();
                let mean = sun.iter().zip(&albedo).map(|(e, a)| e * a).sum::<f64>()
                    / sun.iter().sum::<f64>();
                let error = mean - one.broadband();
                assert!(error.abs() < 0.01, "{name} {white}: {mean}");
                assert!(albedo.iter().all(|a| (0.0..=1.0).contains(a)));
            }
        }
    }
}
