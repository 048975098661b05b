//! Absorption bands of water vapour and oxygen in the red and near infrared, by effective cross sections.
//!
//! A band is thousands of lines: its transmittance is no exponential of the column, so no cross section describes it on
//! every path. SPECTRL2's transmittances of water vapour, over a path that holds `X` cm of precipitable water, and of the
//! uniformly mixed gases over `M` air masses,
//!
//! `T_w = exp(−0.2385 a_w X / (1 + 20.07 a_w X)^0.45)`, `T_u = exp(−1.41 a_u M / (1 + 118.93 a_u M)^0.45)`,
//!
//! are turned into the cross section that has the same transmittance on one path, [`REFERENCE_AIR_MASS`] times the vertical
//! column. On any other path of `m` air masses the optical depth of a strong band grows as `m` here, as `m^0.55` in truth:
//! at one air mass ours is 0.73 of SPECTRL2's, at ten 2.1 times. Weak bands are right everywhere. Nothing absorbs below
//! 560 nm.
//!
//! # Source
//! Bird & Riordan 1986, doi:10.1175/1520-0450(1986)025<0087:SSSMFD>2.0.CO;2.

use crate::composition::WATER_PER_MM_M2;
use crate::error::{check_range, Result};
use crate::math::interp::linear_clamped;
use crate::math::Table;
use crate::spectrum::resample::{bin_average, edges_between};
use crate::spectrum::WavelengthGrid;

/// Air masses of the path on which the effective cross sections are exact.
pub const REFERENCE_AIR_MASS: f64 = 2.0;

/// Molecules of air above 1 m² at 1013.25 hPa: pressure over weight of a molecule.
const AIR_COLUMN_M2: f64 = 101_325.0 / 9.806_65 * 6.022_140_76e23 / 0.028_964_4;

/// Absorption of water vapour and mixed gases on one wavelength grid.
#[derive(Debug, Clone, PartialEq)]
pub struct BandAbsorption {
    /// Per molecule of water \[m²\], shape (w,).
    pub xs_water: Vec<f64>,
    /// Of oxygen (and carbon dioxide), per molecule of *air* \[m²\], shape (w,).
    pub xs_mixed_per_air: Vec<f64>,
}

impl BandAbsorption {
    /// Effective cross sections for a vertical column of water.
    ///
    /// Coefficients are linear between the 80 wavelengths of the source, 6 to 100 nm apart; the cross sections of 1 nm
    /// steps are averaged over the grid's bins.
    ///
    /// # Arguments
    /// * `water_mm` — precipitable water above the ground \[mm\], 0 to 200: sets how saturated the bands are
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`]; [`crate::Error::Invalid`] if the table is damaged.
    pub fn new(grid: &WavelengthGrid, water_mm: f64) -> Result<Self> {
        check_range("water", water_mm, "mm", 0.0..=200.0)?;
        let table = Table::parse(
            "gas_bands",
            include_str!("../../../../data/gas_bands/spectrl2.csv"),
        )?;
        let nm = table.numbers("wavelength_nm")?;
        let (a_w, a_u) = (table.numbers("a_w")?, table.numbers("a_u")?);
        let water_cm = REFERENCE_AIR_MASS * 0.1 * water_mm;
        let xs_water = |a: f64| {
            // Optical depth per cm of precipitable water, that is 10 mm.
            let per_cm = 0.2385 * a / (1.0 + 20.07 * a * water_cm).powf(0.45);
            per_cm / (10.0 * WATER_PER_MM_M2)
        };
        let xs_mixed = |a: f64| {
            let per_air_mass = 1.41 * a / (1.0 + 118.93 * a * REFERENCE_AIR_MASS).powf(0.45);
            per_air_mass / AIR_COLUMN_M2
        };
        let first = WavelengthGrid::MIN_NM as usize;
        let last = WavelengthGrid::MAX_NM as usize;
        let centres: Vec<f64> = (first..=last).map(|nm| nm as f64).collect();
        let edges_nm: Vec<f64> = (first..=last + 1).map(|nm| nm as f64 - 0.5).collect();
        let on_grid = |coefficient: &[f64], xs: &dyn Fn(f64) -> f64| {
            let at = |&w: &f64| xs(linear_clamped(&nm, coefficient, w));
            let values: Vec<f64> = centres.iter().map(at).collect();
            bin_average(&edges_nm, &values, &grid.bin_edges_nm())
        };
        Ok(Self {
            xs_water: on_grid(&a_w, &xs_water),
            xs_mixed_per_air: on_grid(&a_u, &xs_mixed),
        })
    }
}

/// Absorption by colliding pairs of oxygen molecules, which grows with the square of density.
///
/// Cross sections over the product of both densities \[m⁵\], shape (w,), averaged over the grid's bins; 0 outside 336 to
/// 666 nm. Through the whole air the strongest band, at 577 nm, takes 1.3 %.
///
/// # Errors
/// [`crate::Error::Invalid`] if the table is damaged.
///
/// # Source
/// Fally et al. 2000, doi:10.1006/jmsp.2000.8204, at room temperature.
pub fn oxygen_pairs(grid: &WavelengthGrid) -> Result<Vec<f64>> {
    let table = Table::parse(
        "o2_collision",
        include_str!("../../../../data/o2_collision/fally_1nm.csv"),
    )?;
    let mut edges_nm = edges_between(&table.numbers("wavelength_nm")?);
    // A bin without absorption on either side, so that means over bins across the table's ends are right.
    edges_nm.insert(0, 0.0);
    edges_nm.push(2.0 * WavelengthGrid::MAX_NM);
    let mut values = table.numbers("xs")?;
    values.insert(0, 0.0);
    values.push(0.0);
    Ok(bin_average(&edges_nm, &values, &grid.bin_edges_nm()))
}

/// Share of oxygen in dry air by number (U.S. Standard Atmosphere 1976).
pub const OXYGEN_SHARE: f64 = 0.209_476;

#[cfg(test)]
mod tests {
    use super::*;

    /// On the reference path the transmittances are SPECTRL2's, computed here from the published formulas.
    #[test]
    fn transmittance_is_spectrl2_on_the_reference_path() {
        // 1 nm grids, so that bins are the table's own wavelengths: (nm, a_w, a_u).
        for (nm, a_w, a_u) in [(718.0, 1.8, 0.0), (937.0, 55.0, 0.0), (690.0, 0.016, 0.15)] {
            let grid = WavelengthGrid::new(vec![nm - 1.0, nm, nm + 1.0]).unwrap();
            let bands = BandAbsorption::new(&grid, 14.2).unwrap();
            let x: f64 = 2.0 * 1.42;
            let t_w = (-0.2385 * a_w * x / (1.0 + 20.07 * a_w * x).powf(0.45)).exp();
            let ours = (-bands.xs_water[1] * 28.4 * WATER_PER_MM_M2).exp();
            assert!((ours - t_w).abs() < 1e-9, "{nm}: {ours} {t_w}");
            let t_u = (-1.41 * a_u * 2.0 / (1.0_f64 + 118.93 * a_u * 2.0).powf(0.45)).exp();
            let ours = (-bands.xs_mixed_per_air[1] * 2.0 * AIR_COLUMN_M2).exp();
            assert!((ours - t_u).abs() < 1e-9, "{nm}: {ours} {t_u}");
        }
    }

    #[test]
    fn nothing_absorbs_below_560_nm() {
        let grid = WavelengthGrid::range(280.0, 2500.0, 5.0).unwrap();
        let bands = BandAbsorption::new(&grid, 50.0).unwrap();
        for (i, &nm) in grid.nm().iter().enumerate() {
            let sum = bands.xs_water[i] + bands.xs_mixed_per_air[i];
            assert!(sum >= 0.0 && (nm > 567.0 || sum == 0.0), "{nm}");
        }
        assert!(BandAbsorption::new(&grid, -1.0).is_err());
        assert!(BandAbsorption::new(&grid, f64::NAN).is_err());
    }

    /// Thalman & Volkamer 2013 (doi:10.1039/c3cp50968k, 293 K) measured other samples with another instrument: 8 % between them.
    #[test]
    fn oxygen_pairs_absorb_as_others_measure() {
        let grid = WavelengthGrid::range(340.0, 700.0, 1.0).unwrap();
        let xs = oxygen_pairs(&grid).unwrap();
        for (nm, theirs) in [(361, 4.1e-56), (477, 6.6e-56), (577, 11.1e-56)] {
            let ours = xs[nm - 340];
            assert!((ours / theirs - 1.0).abs() < 0.08, "{nm} nm {ours:e}");
        }
        assert!(xs.iter().all(|x| *x >= 0.0));
        assert_eq!(xs[680 - 340], 0.0);
    }

    /// What the approximation costs on other paths, as the module says.
    #[test]
    fn strong_bands_err_off_the_reference_path_as_stated() {
        let exact = |m: f64| m / (1.0 + 118.93 * 4.0 * m).powf(0.45);
        let ours = |m: f64| m * exact(2.0) / 2.0;
        assert!((ours(1.0) / exact(1.0) - 0.73).abs() < 0.01);
        assert!((ours(10.0) / exact(10.0) - 2.06).abs() < 0.02);
    }
}
