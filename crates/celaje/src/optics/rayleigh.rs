//! Scattering of light by molecules of air.

use crate::error::{check_range, Result};
use crate::math::interp::linear_clamped;
use crate::math::Table;
use crate::spectrum::WavelengthGrid;

/// Number density of standard air, 15 °C and 1013.25 hPa \[m⁻³\] (Bucholtz 1995).
const STANDARD_AIR_M3: f64 = 2.54743e25;

/// CO₂ of the air whose refractive index Peck & Reeder measured \[ppm\].
const PECK_REEDER_CO2_PPM: f64 = 330.0;

/// Wavelengths where cross section and index hold \[nm\]: those of Bucholtz's Table 2.
const RANGE_NM: std::ops::RangeInclusive<f64> = 200.0..=4000.0;

/// Refractive index of dry standard air (15 °C, 1013.25 hPa, 330 ppm CO₂) \[1\].
///
/// `wavelength_nm` in vacuum \[nm\], 200 to 4000: two terms from 230 nm on, four below.
///
/// # Errors
/// [`crate::Error::OutOfRange`].
///
/// # Source
/// Peck & Reeder 1972, doi:10.1364/JOSA.62.000958, eqs. 2 and 3; measured from 185 to 1690 nm, extrapolated
/// beyond as Bucholtz 1995 does.
pub fn refractive_index(wavelength_nm: f64) -> Result<f64> {
    check_range("wavelength", wavelength_nm, "nm", RANGE_NM)?;
    let s2 = (1e3 / wavelength_nm).powi(2);
    let excess = if wavelength_nm >= 230.0 {
        5_791_817.0 / (238.0185 - s2) + 167_909.0 / (57.362 - s2)
    } else {
        8060.51 + 2_480_990.0 / (132.274 - s2) + 17_455.7 / (39.32957 - s2)
    };
    Ok(1.0 + excess * 1e-8)
}

/// Refractive index of dry standard air with another amount of CO₂ \[1\].
///
/// `(n − 1) = (n − 1)₃₃₀ (1 + 0.54·10⁻⁶ (co2_ppm − 330))`; `co2_ppm` from 0 to 10 000.
///
/// # Errors
/// [`crate::Error::OutOfRange`].
///
/// # Source
/// Edlén 1966, doi:10.1088/0026-1394/2/2/002; Bodhaine et al. 1999, eq. 19.
pub fn refractive_index_with_co2(wavelength_nm: f64, co2_ppm: f64) -> Result<f64> {
    check_range("co2", co2_ppm, "ppm", 0.0..=10_000.0)?;
    let excess = refractive_index(wavelength_nm)? - 1.0;
    Ok(1.0 + excess * (1.0 + 0.54e-6 * (co2_ppm - PECK_REEDER_CO2_PPM)))
}

/// Rayleigh scattering with the depolarisation of Bucholtz's Table 1.
///
/// # Source
/// Bucholtz 1995, doi:10.1364/AO.34.002765; the depolarisation is Bates 1984, doi:10.1016/0032-0633(84)90102-8.
#[derive(Debug, Clone, PartialEq)]
pub struct Rayleigh {
    wavelength_nm: Vec<f64>,
    depolarisation: Vec<f64>,
}

impl Rayleigh {
    /// Reads the embedded table.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if it is damaged.
    pub fn new() -> Result<Self> {
        let table = Table::parse(
            "rayleigh_bucholtz",
            include_str!("../../../../data/rayleigh_bucholtz/table1.csv"),
        )?;
        Ok(Self {
            wavelength_nm: table.numbers("wavelength_nm")?,
            depolarisation: table.numbers("depolarisation")?,
        })
    }

    /// Depolarisation ratio ρₙ of unpolarised light \[1\], linear between the rows of the table and constant
    /// outside it (200 to 1000 nm; it changes by 0.1 % of the cross section from 600 to 1000 nm).
    pub fn depolarisation(&self, wavelength_nm: f64) -> f64 {
        linear_clamped(&self.wavelength_nm, &self.depolarisation, wavelength_nm)
    }

    /// King's correction factor F_k = (6 + 3 ρₙ) / (6 − 7 ρₙ) \[1\].
    pub fn king_factor(&self, wavelength_nm: f64) -> f64 {
        let rho = self.depolarisation(wavelength_nm);
        (6.0 + 3.0 * rho) / (6.0 - 7.0 * rho)
    }

    /// γ = ρₙ / (2 − ρₙ) of Chandrasekhar's phase function \[1\].
    pub fn gamma(&self, wavelength_nm: f64) -> f64 {
        let rho = self.depolarisation(wavelength_nm);
        rho / (2.0 - rho)
    }

    /// Scattering cross section per molecule of air \[m²\].
    ///
    /// `κ = 24 π³ (n² − 1)² / (λ⁴ N_s² (n² + 2)²) · F_k`; `wavelength_nm` in vacuum \[nm\], 200 to 4000.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`].
    pub fn xs_sca(&self, wavelength_nm: f64) -> Result<f64> {
        self.xs_sca_with_co2(wavelength_nm, PECK_REEDER_CO2_PPM)
    }

    /// [`Rayleigh::xs_sca`] in air with another amount of CO₂ \[ppm\], 0 to 10 000: its index changes the cross section by
    /// 1e-6 per ppm; the depolarisation stays.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`].
    pub fn xs_sca_with_co2(&self, wavelength_nm: f64, co2_ppm: f64) -> Result<f64> {
        let n2 = refractive_index_with_co2(wavelength_nm, co2_ppm)?.powi(2);
        let lorentz = (n2 - 1.0) / (n2 + 2.0);
        let wavelength_m = wavelength_nm * 1e-9;
        Ok(24.0 * std::f64::consts::PI.powi(3) * lorentz * lorentz
            / (wavelength_m.powi(4) * STANDARD_AIR_M3.powi(2))
            * self.king_factor(wavelength_nm))
    }

    /// Cross sections at the wavelengths of a grid \[m²\], shape (w,), in air with some amount of CO₂ \[ppm\].
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for the CO₂; every grid lies inside the range of [`Rayleigh::xs_sca`].
    pub fn xs_sca_on(&self, grid: &WavelengthGrid, co2_ppm: f64) -> Result<Vec<f64>> {
        let xs = |&nm: &f64| self.xs_sca_with_co2(nm, co2_ppm);
        grid.nm().iter().map(xs).collect()
    }
}

/// Chandrasekhar's phase function of anisotropic molecules \[sr⁻¹\]; its integral over the sphere is 1.
///
/// `p = 1/(4π) · 3 / (4 (1 + 2γ)) · [(1 + 3γ) + (1 − γ) cos²θ]`, with γ from [`Rayleigh::gamma`].
///
/// # Source
/// Bucholtz 1995, eq. 12, with its 1/(4π).
#[inline]
pub fn phase(gamma: f64, cos_theta: f64) -> f64 {
    3.0 / (16.0 * std::f64::consts::PI * (1.0 + 2.0 * gamma))
        * (1.0 + 3.0 * gamma + (1.0 - gamma) * cos_theta * cos_theta)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bucholtz's Table 2: 0.1 % from 350 to 800 nm, 0.4 % elsewhere.
    #[test]
    fn cross_sections_are_bucholtz_table_2() {
        let rayleigh = Rayleigh::new().unwrap();
        let table = Table::parse(
            "table2",
            include_str!("../../../../tests/reference/rayleigh_bucholtz1995_table2.csv"),
        )
        .unwrap();
        let rows = table.numbers("wavelength_nm").unwrap();
        assert_eq!(rows.len(), 80);
        for (nm, cm2) in rows.into_iter().zip(table.numbers("sigma_cm2").unwrap()) {
            let error = rayleigh.xs_sca(nm).unwrap() / (cm2 * 1e-4) - 1.0;
            let allowed = if (350.0..=800.0).contains(&nm) {
                1e-3
            } else {
                4e-3
            };
            assert!(error.abs() < allowed, "{nm} nm: {error:.5}");
        }
    }

    /// Bodhaine et al. 1999 have another King factor and N_s: the two agree to 0.3 % from 280 to 1000 nm.
    #[test]
    fn cross_sections_are_near_bodhaine() {
        let rayleigh = Rayleigh::new().unwrap();
        let table = Table::parse(
            "bodhaine",
            include_str!("../../../../tests/reference/rayleigh_bodhaine1999_colour_impl.csv"),
        )
        .unwrap();
        let rows = table.numbers("wavelength_nm").unwrap();
        for (nm, cm2) in rows.into_iter().zip(table.numbers("sigma_cm2").unwrap()) {
            let error = rayleigh.xs_sca(nm).unwrap() / (cm2 * 1e-4) - 1.0;
            assert!(error.abs() < 3e-3, "{nm} nm: {error:.5}");
        }
    }

    /// The three columns of Table 1 obey the identities between them to their printed digits.
    #[test]
    fn king_factor_and_gamma_are_those_of_table_1() {
        let rayleigh = Rayleigh::new().unwrap();
        let table = Table::parse(
            "table1",
            include_str!("../../../../data/rayleigh_bucholtz/table1.csv"),
        )
        .unwrap();
        let king = table.numbers("king_factor").unwrap();
        let gamma = table.numbers("gamma").unwrap();
        for (i, nm) in table
            .numbers("wavelength_nm")
            .unwrap()
            .into_iter()
            .enumerate()
        {
            assert!((rayleigh.king_factor(nm) - king[i]).abs() < 1e-4, "{nm} nm");
            assert!((rayleigh.gamma(nm) - gamma[i]).abs() < 1.1e-5, "{nm} nm");
        }
    }

    /// Ciddor 1996 (doi:10.1364/AO.35.001566, eq. 1, 450 ppm CO₂) is another evaluation of the measurements:
    /// the two agree to 3e-5 of n − 1. Peck & Reeder's own two forms meet where one takes over from the other.
    #[test]
    fn index_agrees_with_ciddor_and_with_itself() {
        for nm in [300.0, 400.0, 550.0, 633.0, 1000.0, 1690.0] {
            let s2 = (1e3f64 / nm).powi(2);
            let ciddor = 5_792_105e-8 / (238.0185 - s2) + 167_917e-8 / (57.362 - s2);
            let ours = refractive_index_with_co2(nm, 450.0).unwrap() - 1.0;
            assert!((ours / ciddor - 1.0).abs() < 3e-5, "{nm} nm");
        }
        let below = refractive_index(230.0 - 1e-9).unwrap() - 1.0;
        let above = refractive_index(230.0).unwrap() - 1.0;
        assert!((below / above - 1.0).abs() < 1e-4);
        let more = refractive_index_with_co2(550.0, 430.0).unwrap() - 1.0;
        let ratio = more / (refractive_index(550.0).unwrap() - 1.0);
        assert!((ratio - 1.000_054).abs() < 1e-9);
        assert!(refractive_index(199.0).is_err());
        assert!(refractive_index_with_co2(550.0, f64::NAN).is_err());
    }

    /// 90 ppm more CO₂ scatter 0.0097 % more light: twice the change of the index.
    #[test]
    fn co2_changes_the_cross_section_a_little() {
        let rayleigh = Rayleigh::new().unwrap();
        let grid = WavelengthGrid::new(vec![400.0, 550.0]).unwrap();
        let [a, b] = [330.0, 420.0].map(|ppm| rayleigh.xs_sca_on(&grid, ppm).unwrap());
        for i in 0..2 {
            assert!((b[i] / a[i] - 1.0 - 2.0 * 0.54e-6 * 90.0).abs() < 1e-7);
            assert_eq!(a[i], rayleigh.xs_sca(grid.nm()[i]).unwrap());
        }
        assert!(rayleigh.xs_sca_on(&grid, -1.0).is_err());
    }

    #[test]
    fn phase_integrates_to_one() {
        for gamma in [0.0, 0.0145, 0.3] {
            let n = 2000;
            let sum: f64 = (0..n)
                .map(|i| phase(gamma, -1.0 + (f64::from(i) + 0.5) * 2.0 / f64::from(n)))
                .sum();
            let integral = sum * 2.0 / f64::from(n) * 2.0 * std::f64::consts::PI;
            assert!((integral - 1.0).abs() < 1e-6);
        }
    }
}
