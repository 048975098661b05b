//! Absorption of light by ozone.

use crate::error::{check_range, Result};
use crate::math::interp::interval;
use crate::math::Table;
use crate::spectrum::resample::{bin_average, edges_between};
use crate::spectrum::WavelengthGrid;

/// Ozone cross sections on one wavelength grid, for every temperature.
///
/// Each value is the mean over the grid's bin. Between the table's 11 temperatures, 193 to 293 K, it is linear;
/// outside them it is held at the nearest (air near the ground reaches 310 K, where little ozone is: the change
/// left out is 0.3 % of its cross section at 600 nm and 6 % at 305 nm). Beyond 1100 nm it is 0. Negative noise of
/// the measurement is clipped at 0.
///
/// # Source
/// Gorshelev et al. 2014, doi:10.5194/amt-7-609-2014; Serdyuchenko et al. 2014, doi:10.5194/amt-7-625-2014.
#[derive(Debug, Clone, PartialEq)]
pub struct OzoneAbsorption {
    temperature_k: Vec<f64>,
    /// One spectrum per temperature.
    xs_abs: Vec<Vec<f64>>,
}

impl OzoneAbsorption {
    /// Reads the embedded table and averages it over the bins of a grid.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the table is damaged.
    pub fn new(grid: &WavelengthGrid) -> Result<Self> {
        let table = Table::parse(
            "ozone_cross_section",
            include_str!("../../../../data/ozone_cross_section/serdyuchenko_1nm.csv"),
        )?;
        let mut source_edges_nm = edges_between(&table.numbers("wavelength_nm")?);
        // One more bin without absorption, so that the mean over a bin across the table's end is right.
        source_edges_nm.push(2.0 * WavelengthGrid::MAX_NM);
        let (mut temperature_k, mut xs_abs) = (Vec::new(), Vec::new());
        for k in (193..=293).step_by(10) {
            let mut values = table.numbers(&format!("xs_{k}K"))?;
            values.iter_mut().for_each(|v| *v = v.max(0.0));
            values.push(0.0);
            temperature_k.push(f64::from(k));
            xs_abs.push(bin_average(&source_edges_nm, &values, &grid.bin_edges_nm()));
        }
        Ok(Self {
            temperature_k,
            xs_abs,
        })
    }

    /// Absorption cross section per molecule at a temperature \[m²\], shape (w,).
    ///
    /// `temperature_k` from 100 to 400 K; held at 193 and 293 K outside these.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`].
    pub fn xs_abs(&self, temperature_k: f64) -> Result<Vec<f64>> {
        check_range("temperature", temperature_k, "K", 100.0..=400.0)?;
        let t = &self.temperature_k;
        let i = interval(t, temperature_k);
        let weight = ((temperature_k - t[i]) / (t[i + 1] - t[i])).clamp(0.0, 1.0);
        let (cold, warm) = (&self.xs_abs[i], &self.xs_abs[i + 1]);
        Ok(cold
            .iter()
            .zip(warm)
            .map(|(c, w)| c + weight * (w - c))
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nm: f64, kelvin: f64) -> f64 {
        let grid = WavelengthGrid::new(vec![nm]).unwrap();
        OzoneAbsorption::new(&grid).unwrap().xs_abs(kelvin).unwrap()[0]
    }

    /// The Chappuis maximum of the authors' own 0.01 nm data: 5.14e-21 cm² at 602 nm and 243 K.
    #[test]
    fn chappuis_maximum_is_met() {
        assert!((at(602.0, 243.0) / 5.14e-25 - 1.0).abs() < 2e-3);
        let maximum = at(602.0, 243.0);
        assert!(maximum > at(560.0, 243.0) && maximum > at(650.0, 243.0));
    }

    #[test]
    fn temperature_is_linear_between_columns_and_held_outside() {
        let (low, middle, high) = (at(320.0, 223.0), at(320.0, 228.0), at(320.0, 233.0));
        assert!((middle / (0.5 * (low + high)) - 1.0).abs() < 1e-12);
        assert_eq!(at(320.0, 180.0), at(320.0, 193.0));
        assert_eq!(at(320.0, 305.0), at(320.0, 293.0));
        let grid = WavelengthGrid::default();
        assert!(OzoneAbsorption::new(&grid)
            .unwrap()
            .xs_abs(f64::NAN)
            .is_err());
    }

    #[test]
    fn never_negative_and_zero_beyond_the_table() {
        let grid = WavelengthGrid::range(280.0, 2500.0, 1.0).unwrap();
        let ozone = OzoneAbsorption::new(&grid).unwrap();
        let xs = ozone.xs_abs(228.0).unwrap();
        assert!(xs.iter().all(|v| *v >= 0.0));
        for (nm, v) in grid.nm().iter().zip(&xs) {
            assert!(*nm < 1101.0 || *v == 0.0, "{nm} nm");
        }
    }
}
