//! The error bar of a picture without noise: what is left between it and the reference, at some of its pixels; and the picture
//! without what of that is smooth.

mod comparison;
mod correction;
mod smooth;
mod spectral;

pub use correction::Correction;

use std::sync::atomic::AtomicBool;

use crate::error::{Error, Result};
use crate::film::Film;
use crate::sensor::Sensor;
use crate::sky::{Method, RenderOptions, Sky, SunDisc};
use comparison::Comparison;

/// How the method `shells` compares with the method `path`.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Each direction: azimuth and elevation \[deg\]; radiance of `shells` over that of `path`, summed over wavelengths, less
    /// one; the standard error of that.
    pub directions: Vec<(f64, f64, f64, f64)>,
}

impl Residual {
    /// Paths in each direction that tell an error of a per cent.
    pub const SPP: u32 = 2048;

    /// Mean residual and its standard error \[1\].
    pub fn mean(&self) -> (f64, f64) {
        let n = self.directions.len() as f64;
        let sum: f64 = self.directions.iter().map(|d| d.2).sum();
        let squares: f64 = self.directions.iter().map(|d| d.3 * d.3).sum();
        (sum / n, squares.sqrt() / n)
    }

    /// Root mean square of the residuals \[1\], the part that the noise of `path` explains taken off.
    pub fn rms(&self) -> f64 {
        let n = self.directions.len() as f64;
        let squares: f64 = self.directions.iter().map(|d| d.2 * d.2 - d.3 * d.3).sum();
        (squares / n).max(0.0).sqrt()
    }

    /// The direction of the largest residual: azimuth, elevation \[deg\], residual, its standard error \[1\].
    pub fn worst(&self) -> (f64, f64, f64, f64) {
        let largest = |a: &(f64, f64, f64, f64), b: &(f64, f64, f64, f64)| {
            if b.2.abs() > a.2.abs() {
                *b
            } else {
                *a
            }
        };
        let all = self.directions.iter().copied();
        all.reduce(|a, b| largest(&a, &b))
            .unwrap_or((f64::NAN, f64::NAN, 0.0, 0.0))
    }

    /// Mean, root mean square and worst direction in words, as they are told and as files keep them.
    pub fn words(&self) -> [(&'static str, String); 3] {
        let percent = |x: f64, error: f64| format!("{:+.2} ± {:.2} %", 100.0 * x, 100.0 * error);
        let (mean, error) = self.mean();
        let (azimuth, elevation, worst, worst_error) = self.worst();
        let worst = percent(worst, worst_error);
        [
            ("mean", percent(mean, error)),
            ("rms", format!("{:.2} %", 100.0 * self.rms())),
            (
                "worst",
                format!("{worst} at azimuth {azimuth:.0}, elevation {elevation:.1} deg"),
            ),
        ]
    }

    /// What a file says of the comparison: names and values.
    pub fn entries(&self) -> Vec<(String, String)> {
        let count = self.directions.len().to_string();
        let mut entries = vec![("check_directions".to_owned(), count)];
        let words = self.words().into_iter();
        entries.extend(words.map(|(name, value)| (format!("check_{name}"), value)));
        entries
    }
}

impl Sky {
    /// Compares `shells` with `path` at 50 directions spread evenly over a picture, outside 5° of the sun.
    ///
    /// # Arguments
    /// * `options` — observer, seed and number of orders; method, disc and number of paths are not looked at
    /// * `spp` — paths in each direction, such as [`Residual::SPP`]
    ///
    /// # Errors
    /// As [`Sky::render`]; [`Error::Invalid`] where the picture has no direction to compare, or no light.
    pub fn residual(
        &self,
        sensor: &dyn Sensor,
        options: &RenderOptions,
        spp: u32,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Residual> {
        let comparison = Comparison::new(self, sensor, options, spp, cancel, progress)?;
        Ok(comparison.residual(|_, _| 1.0))
    }

    /// [`Sky::render`] by `shells`, corrected by what of its residual against `path` is smooth: [`Correction`].
    ///
    /// The sun's disc, which is exact, is left as it is.
    ///
    /// # Arguments
    /// * `spp` — paths in each of 50 directions, such as [`Correction::SPP`]
    ///
    /// # Errors
    /// As [`Sky::residual`]; [`Error::Invalid`] for another method, and for the disc alone.
    pub fn render_corrected(
        &self,
        sensor: &dyn Sensor,
        options: &RenderOptions,
        spp: u32,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<(Film, Correction)> {
        if options.method != Method::Shells || options.sun_disc == SunDisc::Only {
            return Err(Error::invalid(
                "only the sky by the method shells is corrected by path",
                "ask for the method shells, with sun disc on or off",
            ));
        }
        let comparison = Comparison::new(self, sensor, options, spp, cancel, progress)?;
        let correction = Correction::new(&comparison);
        let with = |sun_disc: SunDisc| RenderOptions {
            sun_disc,
            ..*options
        };
        let mut film = self.render(sensor, &with(SunDisc::Off), cancel, &|_, _| ())?;
        correction.apply(&mut film, sensor);
        if options.sun_disc == SunDisc::On {
            let disc = self.render(sensor, &with(SunDisc::Only), cancel, &|_, _| ())?;
            for (sky, disc) in film.radiance.iter_mut().zip(&disc.radiance) {
                *sky += disc;
            }
        }
        Ok((film, correction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::BakeOptions;
    use crate::climate::{Conditions, Overrides};
    use crate::sensor::Fisheye;
    use crate::spectrum::{SolarSpectrum, WavelengthGrid};
    use crate::transport::{Accuracy, Budget};

    #[test]
    fn sums_of_residuals() {
        let of = |r: [f64; 4]| Residual {
            directions: r.map(|r| (10.0 * r, 5.0, r, 0.01)).to_vec(),
        };
        let residual = of([0.02, -0.04, 0.01, 0.01]);
        let (mean, error) = residual.mean();
        assert!(mean.abs() < 1e-12 && (error - 0.005).abs() < 1e-12);
        let expected = ((4.0 + 16.0 + 1.0 + 1.0 - 4.0) * 1e-4 / 4.0f64).sqrt();
        assert!((residual.rms() - expected).abs() < 1e-12);
        assert_eq!(residual.worst(), (-0.4, 5.0, -0.04, 0.01));
        assert_eq!(of([0.001; 4]).rms(), 0.0);
    }

    /// Rationale: the error bar must be that of the solver. Expected: by day, mean below 1 %, rms below 2 %, and the noise of
    /// `path` far below; tables that belong to another ground are found to be wrong.
    #[test]
    fn a_sky_by_day_agrees() {
        let grid = WavelengthGrid::new(vec![450.0, 550.0, 650.0]).unwrap();
        let conditions = Conditions::from_sun(40.0, 120.0, &Overrides::default()).unwrap();
        let sky = Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap();
        let options = RenderOptions {
            method: Method::Shells,
            polarised: crate::sky::Polarised::default(),
            accuracy: Accuracy::Default,
            budget: Budget {
                spp: 1,
                seed: 5,
                max_order: None,
            },
            sun_disc: SunDisc::Off,
            altitude_m: None,
        };
        let sensor = Fisheye::new(64, 64, 170.0).unwrap();
        let stop = AtomicBool::new(false);
        let residual = sky
            .residual(&sensor, &options, 512, &stop, &|_, _| ())
            .unwrap();
        let (mean, error) = residual.mean();
        assert!(error < 0.003, "{error}");
        assert!(mean.abs() < 0.01, "{mean}");
        assert!(residual.rms() < 0.02, "{}", residual.rms());
        // Tables of another ground are found out: the bar is that of what is looked at.
        let bake = BakeOptions {
            accuracy: Accuracy::Preview,
            sun_elevation_deg: (39.0, 41.0),
            highest_observer_m: 0.0,
            polarised: true,
        };
        let mut wrong = sky.baked(&bake, &stop).unwrap();
        wrong.albedo = vec![0.9; 3];
        let residual = wrong
            .residual(&sensor, &options, 64, &stop, &|_, _| ())
            .unwrap();
        assert!(residual.mean().0 < -0.03, "{:?}", residual.mean());
    }
}
