//! The CIE standard observers, and the integral of a spectrum against them.

use std::sync::OnceLock;

use crate::error::{Error, Result};

/// Luminous efficacy that the photometric units rest on \[lm W⁻¹\].
///
/// # Source
/// CIPM 1979, definition of the candela. (At 540 THz, 555.017 nm in air, where V(λ) is 1 to 2·10⁻⁶.)
pub const LUMINOUS_EFFICACY: f64 = 683.0;

/// First wavelength of the tables \[nm\].
const FIRST_NM: f64 = 360.0;
/// Rows in the tables: 360 to 830 nm every 1 nm.
const ROWS: usize = 471;

/// Whose eyes: one of the two CIE standard colorimetric observers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Observer {
    /// CIE 1931, field of 2°; its ȳ is the photopic V(λ) of luminance and illuminance.
    Cie1931,
    /// CIE 1964, field of 10°: the one for something as large as a sky.
    #[default]
    Cie1964,
}

impl Observer {
    /// By its name on the command line, `1931` or `1964`.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn by_name(name: &str) -> Result<Self> {
        match name {
            "1931" => Ok(Self::Cie1931),
            "1964" => Ok(Self::Cie1964),
            _ => Err(Error::UnknownName {
                kind: "observer",
                name: name.to_owned(),
                known: vec!["1931".to_owned(), "1964".to_owned()],
            }),
        }
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cie1931 => "1931",
            Self::Cie1964 => "1964",
        }
    }

    /// Tristimulus values of D65 for this observer, Y = 1.
    ///
    /// # Source
    /// 2°: the chromaticity (0.3127, 0.3290) of IEC 61966-2-1, so that sRGB's white is exactly neutral;
    /// 10°: CIE 15:2004, table T.3.
    pub fn d65(self) -> [f64; 3] {
        match self {
            Self::Cie1931 => [0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290],
            Self::Cie1964 => [0.948_11, 1.0, 1.073_04],
        }
    }

    /// Colour-matching functions x̄, ȳ, z̄ at a wavelength \[nm\], linear between the rows; 0 beyond 360–830 nm.
    pub fn matching_functions(self, wavelength_nm: f64) -> [f64; 3] {
        let table = match self {
            Self::Cie1931 => &tables()[0],
            Self::Cie1964 => &tables()[1],
        };
        let at = wavelength_nm - FIRST_NM;
        if !(0.0..=(ROWS - 1) as f64).contains(&at) {
            return [0.0; 3];
        }
        let row = (at as usize).min(ROWS - 2);
        let t = at - row as f64;
        [0, 1, 2].map(|k| table[row][k] + t * (table[row + 1][k] - table[row][k]))
    }
}

/// The two tables, 1931 first, read once from the shipped file.
fn tables() -> &'static [Vec<[f64; 3]>; 2] {
    static TABLES: OnceLock<[Vec<[f64; 3]>; 2]> = OnceLock::new();
    TABLES.get_or_init(|| {
        let text = include_str!("../../../../data/colour/observers_1nm.csv");
        let mut tables = [Vec::with_capacity(ROWS), Vec::with_capacity(ROWS)];
        for line in text.lines().skip(1) {
            // The file is part of the program; a test checks that every figure in it is a number.
            let mut row = [0.0; 7];
            for (value, field) in row.iter_mut().zip(line.split(',')) {
                *value = field.parse().unwrap_or(f64::NAN);
            }
            tables[0].push([row[1], row[2], row[3]]);
            tables[1].push([row[4], row[5], row[6]]);
        }
        tables
    })
}

/// The linear map from a spectrum on a fixed wavelength grid to XYZ.
///
/// Between the wavelengths of the grid the spectrum is taken to be linear, and its product with the 1 nm
/// colour-matching functions (linear between their rows) is integrated exactly:
///
/// `X = 683 lm/W · ∫ L(λ) x̄(λ) dλ`, and so for Y and Z.
///
/// What the grid does not cover counts as dark: 380–780 nm misses 4·10⁻⁵ of Y. A grid of a single wavelength, or
/// one entirely outside 360–830 nm, has no colour; it is shown as a grey, D65 of the luminance that an equal-energy
/// spectrum of its mean radiance would have.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumToXyz {
    weights: Vec<[f64; 3]>,
    grey: bool,
}

impl SpectrumToXyz {
    /// The map for increasing vacuum wavelengths \[nm\].
    ///
    /// # Errors
    /// [`Error::Invalid`] if the list is empty, not finite or not increasing.
    pub fn new(wavelength_nm: &[f64], observer: Observer) -> Result<Self> {
        if wavelength_nm.is_empty()
            || !wavelength_nm.iter().all(|w| w.is_finite())
            || wavelength_nm.windows(2).any(|p| p[1] <= p[0])
        {
            return Err(Error::invalid(
                "wavelengths must be numbers that increase",
                "sort them and drop repeated ones",
            ));
        }
        let mut weights = vec![[0.0; 3]; wavelength_nm.len()];
        for i in 1..wavelength_nm.len() {
            let (left, right) = interval_weights(wavelength_nm[i - 1], wavelength_nm[i], observer);
            for k in 0..3 {
                weights[i - 1][k] += LUMINOUS_EFFICACY * left[k];
                weights[i][k] += LUMINOUS_EFFICACY * right[k];
            }
        }
        let grey = weights.iter().all(|w| w[1] == 0.0);
        if grey {
            let y = grey_weight(observer) / wavelength_nm.len() as f64;
            weights.fill(observer.d65().map(|c| c * y));
        }
        Ok(Self { weights, grey })
    }

    /// Whether the grid is one that has no colour, so that XYZ is the stand-in of a grey.
    pub fn is_grey(&self) -> bool {
        self.grey
    }

    /// XYZ of a spectrum on the grid; cd m⁻² for radiance in W m⁻² sr⁻¹ nm⁻¹, lux for irradiance in W m⁻² nm⁻¹.
    ///
    /// Values beyond the shorter of spectrum and grid are ignored.
    pub fn xyz<T: Copy + Into<f64>>(&self, spectrum: &[T]) -> [f64; 3] {
        let mut xyz = [0.0; 3];
        for (w, &value) in self.weights.iter().zip(spectrum) {
            let value: f64 = value.into();
            for k in 0..3 {
                xyz[k] += w[k] * value;
            }
        }
        xyz
    }
}

/// Y of an equal-energy spectrum of unit radiance: 683 ∫ ȳ dλ.
fn grey_weight(observer: Observer) -> f64 {
    let (left, right) = interval_weights(FIRST_NM, FIRST_NM + (ROWS - 1) as f64, observer);
    LUMINOUS_EFFICACY * (left[1] + right[1])
}

/// Integrals of the matching functions times the falling and the rising straight line over `[a, b]`.
fn interval_weights(a: f64, b: f64, observer: Observer) -> ([f64; 3], [f64; 3]) {
    let mut falling = [0.0; 3];
    let mut rising = [0.0; 3];
    let lo_end = a.max(FIRST_NM);
    let hi_end = b.min(FIRST_NM + (ROWS - 1) as f64);
    let mut lo = lo_end;
    while lo < hi_end {
        let hi = (lo.floor() + 1.0).min(hi_end);
        // Both factors are linear on [lo, hi], so Simpson's rule is exact.
        let h = hi - lo;
        for (at, weight) in [(lo, h / 6.0), (0.5 * (lo + hi), h / 1.5), (hi, h / 6.0)] {
            let t = (at - a) / (b - a);
            let functions = observer.matching_functions(at);
            for k in 0..3 {
                falling[k] += weight * functions[k] * (1.0 - t);
                rising[k] += weight * functions[k] * t;
            }
        }
        lo = hi;
    }
    (falling, rising)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::math::interp::linear_clamped;

    /// D65 on a grid, from CIE's 5 nm table.
    pub fn d65_spectrum(wavelength_nm: &[f64]) -> Vec<f64> {
        let text = include_str!("../../../../data/colour/illuminant_d65_5nm.csv");
        let (x, y): (Vec<f64>, Vec<f64>) = text
            .lines()
            .skip(1)
            .map(|l| l.split_once(',').unwrap())
            .map(|(w, p)| (w.parse::<f64>().unwrap(), p.parse::<f64>().unwrap()))
            .unzip();
        wavelength_nm
            .iter()
            .map(|&w| linear_clamped(&x, &y, w))
            .collect()
    }

    fn steps(first: f64, last: f64, step: f64) -> Vec<f64> {
        (0..=((last - first) / step) as usize)
            .map(|i| first + step * i as f64)
            .collect()
    }

    #[test]
    fn tables_are_whole_and_peak_where_cie_says() {
        for table in tables() {
            assert_eq!(table.len(), ROWS);
            assert!(table
                .iter()
                .flatten()
                .all(|v| v.is_finite() && (0.0..3.0).contains(v)));
        }
        // CIE 018:2019: V(555 nm) = 1; CIE 15:2004, 1964 observer at 557 nm: 1.0.
        assert_eq!(Observer::Cie1931.matching_functions(555.0)[1], 1.0);
        assert_eq!(Observer::Cie1964.matching_functions(557.0)[1], 1.0);
        assert_eq!(Observer::Cie1931.matching_functions(359.9), [0.0; 3]);
    }

    /// CIE 15:2004 table T.3: D65, 2°: 95.04, 100, 108.88; 10°: 94.81, 100, 107.32, and ASTM E308 (1 nm sums):
    /// 95.047, 100, 108.883 and 94.811, 100, 107.304.
    #[test]
    fn d65_has_its_published_tristimulus_values() {
        let grid = steps(360.0, 830.0, 1.0);
        let cases = [
            (Observer::Cie1931, [0.95047, 1.08883]),
            (Observer::Cie1964, [0.94811, 1.07304]),
        ];
        for (observer, [x, z]) in cases {
            let xyz = SpectrumToXyz::new(&grid, observer)
                .unwrap()
                .xyz(&d65_spectrum(&grid));
            assert!(
                (xyz[0] / xyz[1] - x).abs() < 2e-5,
                "{observer:?} {}",
                xyz[0] / xyz[1]
            );
            assert!(
                (xyz[2] / xyz[1] - z).abs() < 2e-5,
                "{observer:?} {}",
                xyz[2] / xyz[1]
            );
        }
    }

    /// CIE illuminant A is a formula (ISO/CIE 11664-2): its chromaticities are printed in CIE 15:2004, table T.3.
    #[test]
    fn illuminant_a_has_its_published_chromaticity() {
        let grid = steps(360.0, 830.0, 1.0);
        let power = |w: f64| (560.0 / w).powi(5) / (1.435e7 / (2848.0 * w)).exp_m1();
        let spectrum: Vec<f64> = grid.iter().map(|&w| power(w)).collect();
        let cases = [
            (Observer::Cie1931, 0.44758, 0.40745),
            (Observer::Cie1964, 0.45117, 0.40594),
        ];
        for (observer, x, y) in cases {
            let xyz = SpectrumToXyz::new(&grid, observer).unwrap().xyz(&spectrum);
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[0] / sum - x).abs() < 2e-5, "{observer:?} {xyz:?}");
            assert!((xyz[1] / sum - y).abs() < 2e-5, "{observer:?} {xyz:?}");
        }
    }

    /// The equal-energy spectrum lies at (1/3, 1/3) for both observers by their definition.
    #[test]
    fn equal_energy_is_neutral() {
        for observer in [Observer::Cie1931, Observer::Cie1964] {
            let xyz = SpectrumToXyz::new(&[360.0, 830.0], observer)
                .unwrap()
                .xyz(&[1.0, 1.0]);
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[0] / sum - 1.0 / 3.0).abs() < 5e-5);
            assert!((xyz[1] / sum - 1.0 / 3.0).abs() < 5e-5);
        }
    }

    #[test]
    fn the_grid_does_not_matter_for_a_line() {
        // A straight spectrum has the same XYZ on any grid with the same ends, aligned with the table or not.
        let value = |w: f64| 0.2 + 0.003 * (w - 400.0);
        let reference = SpectrumToXyz::new(&[400.0, 700.0], Observer::Cie1931)
            .unwrap()
            .xyz(&[value(400.0), value(700.0)]);
        for grid in [
            steps(400.0, 700.0, 5.0),
            steps(400.0, 700.0, 0.3),
            vec![400.0, 433.37, 555.5, 700.0],
        ] {
            let spectrum: Vec<f64> = grid.iter().map(|&w| value(w)).collect();
            let xyz = SpectrumToXyz::new(&grid, Observer::Cie1931)
                .unwrap()
                .xyz(&spectrum);
            // The 0.3 nm steps reach 700 only to rounding.
            for k in 0..3 {
                assert!((xyz[k] / reference[k] - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn without_colour_the_picture_is_grey() {
        for grid in [vec![550.0], vec![900.0], vec![900.0, 950.0, 1000.0]] {
            for observer in [Observer::Cie1931, Observer::Cie1964] {
                let map = SpectrumToXyz::new(&grid, observer).unwrap();
                assert!(map.is_grey());
                let xyz = map.xyz(&vec![2.0; grid.len()]);
                let white = observer.d65();
                // ∫ȳ dλ is 106.857 nm (1931), 116.662 nm (1964).
                assert!(xyz[1] > 2.0 * 683.0 * 106.0 && xyz[1] < 2.0 * 683.0 * 117.0);
                assert!((xyz[0] / xyz[1] - white[0]).abs() < 1e-12);
                assert!((xyz[2] / xyz[1] - white[2]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_bad_grid_is_refused() {
        for grid in [
            vec![],
            vec![500.0, 400.0],
            vec![f64::NAN],
            vec![500.0, 500.0],
        ] {
            assert!(SpectrumToXyz::new(&grid, Observer::Cie1931).is_err());
        }
        assert!(Observer::by_name("1965").is_err());
        assert_eq!(Observer::by_name("1931").unwrap().name(), "1931");
    }
}
