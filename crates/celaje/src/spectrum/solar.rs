//! The sun's spectrum above the atmosphere.

use super::resample::{bin_average, edges_between};
use super::WavelengthGrid;
use crate::error::{Error, Result};
use crate::math::interp::linear_clamped;
use crate::math::Table;

/// Solid angle of the sun's disc at 1 au \[sr\].
pub const SUN_SOLID_ANGLE_SR: f64 = 6.79e-5;

/// Which table the sunlight is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolarSpectrum {
    /// TSIS-1 Hybrid Solar Reference Spectrum, version 2: the standard since 2022, within 0.3 to 1.3 %
    /// (Coddington et al. 2021, doi:10.1029/2020GL091709; 2023, doi:10.1029/2022EA002637).
    #[default]
    Tsis1,
    /// Gueymard 2004, on a solar constant of 1366.1 W/m² (doi:10.1016/j.solener.2003.08.039).
    Gueymard2004,
    /// The table of radiance, 380 to 750 nm every 10 nm, that earlier sky renderers used; TSIS-1 scaled to
    /// meet it beyond both ends.
    Classic,
}

impl SolarSpectrum {
    /// All spectra, the default first.
    pub const ALL: [Self; 3] = [Self::Tsis1, Self::Gueymard2004, Self::Classic];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tsis1 => "tsis1",
            Self::Gueymard2004 => "gueymard2004",
            Self::Classic => "classic",
        }
    }

    /// One line that says what it is.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Tsis1 => "TSIS-1 Hybrid Solar Reference Spectrum v2 (Coddington et al. 2023)",
            Self::Gueymard2004 => "Gueymard 2004, solar constant 1366.1 W/m²",
            Self::Classic => "classic radiance table, 380-750 nm every 10 nm",
        }
    }

    /// The spectrum of that name.
    ///
    /// # Errors
    /// [`Error::UnknownName`] with the names there are.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|s| s.name() == name);
        found.ok_or_else(|| Error::UnknownName {
            kind: "solar spectrum",
            name: name.to_owned(),
            known: Self::ALL.map(|s| s.name().to_owned()).to_vec(),
        })
    }

    /// Spectral irradiance at 1 au on a surface facing the sun \[W m⁻² nm⁻¹\], the mean over each bin of the
    /// grid ([`WavelengthGrid::bin_edges_nm`]); shape (w,).
    ///
    /// # Errors
    /// [`Error::Invalid`] if an embedded table is damaged.
    pub fn irradiance(self, grid: &WavelengthGrid) -> Result<Vec<f64>> {
        let (wavelength_nm, irradiance) = match self {
            Self::Tsis1 => tsis1()?,
            Self::Gueymard2004 => read(
                "gueymard2004",
                include_str!("../../../../data/solar_gueymard2004/gueymard2004.csv"),
                "irradiance",
            )?,
            Self::Classic => classic()?,
        };
        let edges_nm = edges_between(&wavelength_nm);
        Ok(bin_average(&edges_nm, &irradiance, &grid.bin_edges_nm()))
    }
}

fn read(name: &str, text: &str, column: &str) -> Result<(Vec<f64>, Vec<f64>)> {
    let table = Table::parse(name, text)?;
    Ok((table.numbers("wavelength_nm")?, table.numbers(column)?))
}

fn tsis1() -> Result<(Vec<f64>, Vec<f64>)> {
    read(
        "tsis1_hsrs_1nm",
        include_str!("../../../../data/solar_tsis1/tsis1_hsrs_1nm.csv"),
        "irradiance",
    )
}

/// The classic table on TSIS-1's 1 nm samples, as an irradiance: radiance times the disc's solid angle.
fn classic() -> Result<(Vec<f64>, Vec<f64>)> {
    let (nm, radiance) = read(
        "classic",
        include_str!("../../../../data/solar_classic/classic.csv"),
        "radiance",
    )?;
    let (wavelength_nm, mut irradiance) = tsis1()?;
    let edges_nm = edges_between(&wavelength_nm);
    let scale_at = |i: usize| {
        // The mean over 10 nm, the spacing of the table, so that no single line sets the scale.
        let around = [nm[i] - 5.0, nm[i] + 5.0];
        radiance[i] * SUN_SOLID_ANGLE_SR / bin_average(&edges_nm, &irradiance, &around)[0]
    };
    let last = nm.len() - 1;
    let (scale_below, scale_above) = (scale_at(0), scale_at(last));
    for (w, e) in wavelength_nm.iter().zip(&mut irradiance) {
        *e = if *w < nm[0] {
            *e * scale_below
        } else if *w > nm[last] {
            *e * scale_above
        } else {
            linear_clamped(&nm, &radiance, *w) * SUN_SOLID_ANGLE_SR
        };
    }
    Ok((wavelength_nm, irradiance))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integral over a grid from 280 to 2500 nm in steps of 1 nm.
    fn integral(sun: SolarSpectrum, from: f64, to: f64) -> f64 {
        let grid = WavelengthGrid::range(from, to, 1.0).unwrap();
        sun.irradiance(&grid).unwrap().iter().sum()
    }

    #[test]
    fn integrals_meet_the_published_ones() {
        // Trapezia of the source tables (1309.41 and 661.25; 1314.74 and 660.64) have their end points halved,
        // ours covers half a bin more at each end.
        let tsis = integral(SolarSpectrum::Tsis1, 280.0, 2500.0);
        assert!((tsis / 1309.41 - 1.0).abs() < 1e-4, "{tsis}");
        let tsis = integral(SolarSpectrum::Tsis1, 380.0, 780.0);
        assert!((tsis / 661.25 - 1.0).abs() < 2e-3, "{tsis}");
        let gueymard = integral(SolarSpectrum::Gueymard2004, 280.0, 2500.0);
        assert!((gueymard / 1314.74 - 1.0).abs() < 1e-3, "{gueymard}");
    }

    #[test]
    fn coarse_bins_hold_the_energy_of_fine_ones() {
        for sun in SolarSpectrum::ALL {
            let coarse = WavelengthGrid::range(400.0, 700.0, 10.0).unwrap();
            let fine = WavelengthGrid::range(395.5, 704.5, 1.0).unwrap();
            let sum_coarse: f64 = sun.irradiance(&coarse).unwrap().iter().sum::<f64>() * 10.0;
            let sum_fine: f64 = sun.irradiance(&fine).unwrap().iter().sum();
            assert!((sum_coarse / sum_fine - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn classic_is_the_printed_radiance_and_joins_tsis() {
        let grid = WavelengthGrid::new(vec![750.0]).unwrap();
        let e = SolarSpectrum::Classic.irradiance(&grid).unwrap()[0];
        assert!((e / (18259.0 * SUN_SOLID_ANGLE_SR) - 1.0).abs() < 0.01);
        let beyond = WavelengthGrid::new(vec![900.0, 905.0]).unwrap();
        let classic = SolarSpectrum::Classic.irradiance(&beyond).unwrap();
        let tsis = SolarSpectrum::Tsis1.irradiance(&beyond).unwrap();
        assert!((classic[0] / tsis[0] - classic[1] / tsis[1]).abs() < 1e-12);
    }

    #[test]
    fn names_are_found_again() {
        for sun in SolarSpectrum::ALL {
            assert_eq!(SolarSpectrum::named(sun.name()).unwrap(), sun);
        }
        assert!(SolarSpectrum::named("tsis")
            .unwrap_err()
            .hint()
            .contains("tsis1"));
    }
}
