//! The wavelengths at which everything is computed.

use crate::error::{check_range, Error, Result};

/// Strictly increasing vacuum wavelengths, 280 to 2500 nm.
#[derive(Debug, Clone, PartialEq)]
pub struct WavelengthGrid {
    nm: Vec<f64>,
}

impl WavelengthGrid {
    /// Shortest wavelength that the data reach \[nm\].
    pub const MIN_NM: f64 = 280.0;
    /// Longest wavelength that the data reach \[nm\].
    pub const MAX_NM: f64 = 2500.0;

    /// A grid from vacuum wavelengths in nm, strictly increasing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 280–2500 nm or not finite; [`Error::Invalid`] if empty or not increasing.
    pub fn new(nm: Vec<f64>) -> Result<Self> {
        if nm.is_empty() {
            return Err(Error::invalid(
                "no wavelength given",
                "give at least one wavelength in nm",
            ));
        }
        for &w in &nm {
            check_range("wavelength", w, "nm", Self::MIN_NM..=Self::MAX_NM)?;
        }
        if let Some(p) = nm.windows(2).find(|p| p[1] <= p[0]) {
            return Err(Error::invalid(
                format!(
                    "wavelengths must increase: {} nm is followed by {} nm",
                    p[0], p[1]
                ),
                "sort them and drop repeated ones",
            ));
        }
        Ok(Self { nm })
    }

    /// `start, start + step, …` up to and including `stop` (if it falls on a step), all in nm.
    ///
    /// # Errors
    /// As [`WavelengthGrid::new`]; also if `step` is not positive or the grid has over 10 000 wavelengths.
    pub fn range(start_nm: f64, stop_nm: f64, step_nm: f64) -> Result<Self> {
        check_range("wavelength", start_nm, "nm", Self::MIN_NM..=Self::MAX_NM)?;
        check_range("wavelength", stop_nm, "nm", Self::MIN_NM..=Self::MAX_NM)?;
        check_range("wavelength step", step_nm, "nm", 0.25..=Self::MAX_NM)?;
        let steps = ((stop_nm - start_nm) / step_nm + 1e-9).floor();
        if steps < 0.0 {
            return Err(Error::invalid(
                format!("wavelengths run backwards: {start_nm} to {stop_nm} nm"),
                "give START:STOP:STEP with START below STOP, such as 380:780:5",
            ));
        }
        Self::new(
            (0..=steps as usize)
                .map(|i| start_nm + i as f64 * step_nm)
                .collect(),
        )
    }

    /// The wavelengths \[nm\].
    pub fn nm(&self) -> &[f64] {
        &self.nm
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.nm.len()
    }

    /// Never true: a grid holds at least one wavelength.
    pub fn is_empty(&self) -> bool {
        self.nm.is_empty()
    }

    /// Edges of the bins around each wavelength \[nm\], `len() + 1` values: half-way between neighbours, the
    /// outer two mirrored. A single wavelength gets a bin of 1 nm.
    pub fn bin_edges_nm(&self) -> Vec<f64> {
        let w = &self.nm;
        let n = w.len();
        if n == 1 {
            return vec![w[0] - 0.5, w[0] + 0.5];
        }
        let mut edges = Vec::with_capacity(n + 1);
        edges.push(w[0] - 0.5 * (w[1] - w[0]));
        edges.extend(w.windows(2).map(|p| 0.5 * (p[0] + p[1])));
        edges.push(w[n - 1] + 0.5 * (w[n - 1] - w[n - 2]));
        edges
    }
}

impl Default for WavelengthGrid {
    /// 81 wavelengths, 380 to 780 nm every 5 nm.
    fn default() -> Self {
        Self {
            nm: (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_includes_its_stop() {
        assert_eq!(
            WavelengthGrid::range(380.0, 780.0, 5.0).unwrap(),
            WavelengthGrid::default()
        );
    }

    #[test]
    fn unsorted_or_outside_is_refused() {
        assert!(WavelengthGrid::new(vec![500.0, 400.0]).is_err());
        assert!(WavelengthGrid::new(vec![500.0, 500.0]).is_err());
        assert!(WavelengthGrid::new(vec![100.0]).is_err());
        assert!(WavelengthGrid::new(vec![f64::NAN]).is_err());
        assert!(WavelengthGrid::new(vec![]).is_err());
    }
}
