//! Absorption of light by nitrogen dioxide.

use crate::error::{check_range, Result};
use crate::math::Table;
use crate::spectrum::resample::{bin_average, edges_between};
use crate::spectrum::WavelengthGrid;

/// Temperatures of the table \[K\].
const TEMPERATURE_K: [f64; 2] = [220.0, 294.0];

/// Nitrogen dioxide cross sections on one wavelength grid, for every temperature.
///
/// Each value is the mean over the grid's bin, linear in temperature between 220 and 294 K and held outside. Beyond 667 nm
/// it is 0: there absorption is 1 % of its maximum near 400 nm.
///
/// # Source
/// Vandaele et al. 1998, doi:10.1016/S0022-4073(97)00168-4.
#[derive(Debug, Clone, PartialEq)]
pub struct No2Absorption {
    cold: Vec<f64>,
    warm: Vec<f64>,
}

impl No2Absorption {
    /// Reads the embedded table and averages it over the bins of a grid.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the table is damaged.
    pub fn new(grid: &WavelengthGrid) -> Result<Self> {
        let table = Table::parse(
            "no2_cross_section",
            include_str!("../../../../data/no2_cross_section/vandaele_1nm.csv"),
        )?;
        let mut source_edges_nm = edges_between(&table.numbers("wavelength_nm")?);
        // One more bin without absorption, so that the mean over a bin across the table's end is right.
        source_edges_nm.push(2.0 * WavelengthGrid::MAX_NM);
        let averaged = |column: &str| -> Result<Vec<f64>> {
            let mut values = table.numbers(column)?;
            values.push(0.0);
            Ok(bin_average(&source_edges_nm, &values, &grid.bin_edges_nm()))
        };
        Ok(Self {
            cold: averaged("xs_220K")?,
            warm: averaged("xs_294K")?,
        })
    }

    /// Absorption cross section per molecule at a temperature \[m²\], shape (w,).
    ///
    /// `temperature_k` from 100 to 400 K; held at 220 and 294 K outside these.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`].
    pub fn xs_abs(&self, temperature_k: f64) -> Result<Vec<f64>> {
        check_range("temperature", temperature_k, "K", 100.0..=400.0)?;
        let [cold_k, warm_k] = TEMPERATURE_K;
        let weight = ((temperature_k - cold_k) / (warm_k - cold_k)).clamp(0.0, 1.0);
        let pairs = self.cold.iter().zip(&self.warm);
        Ok(pairs.map(|(c, w)| c + weight * (w - c)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over 50 nm against Bogumil et al. 2003 (doi:10.1016/S1010-6030(03)00062-5, 294 K), another instrument: 3.5 %.
    #[test]
    fn cross_sections_are_those_that_others_measured() {
        let grid = WavelengthGrid::range(300.0, 800.0, 1.0).unwrap();
        let xs = No2Absorption::new(&grid).unwrap().xs_abs(294.0).unwrap();
        let mean = |from: usize| xs[from - 300..=from - 250].iter().sum::<f64>() / 51.0;
        for (from, bogumil) in [
            (300, 2.947e-23),
            (400, 5.662e-23),
            (450, 3.501e-23),
            (550, 6.335e-24),
        ] {
            assert!((mean(from) / bogumil - 1.0).abs() < 0.035, "{from}");
        }
        assert_eq!(xs[700 - 300], 0.0);
    }

    #[test]
    fn temperature_is_linear_and_held() {
        let grid = WavelengthGrid::new(vec![440.0]).unwrap();
        let no2 = No2Absorption::new(&grid).unwrap();
        let at = |k: f64| no2.xs_abs(k).unwrap()[0];
        assert!((at(257.0) / (0.5 * (at(220.0) + at(294.0))) - 1.0).abs() < 1e-12);
        assert_eq!((at(200.0), at(310.0)), (at(220.0), at(294.0)));
        assert!(no2.xs_abs(f64::NAN).is_err());
    }
}
