//! The error bar of a picture without noise: what is left between it and the reference, at some of its pixels.

use std::sync::atomic::AtomicBool;

use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::sensor::{Directions, Sensor};
use crate::sky::{Method, RenderOptions, Sky, SunDisc};
use crate::transport::Budget;

/// Directions compared.
const DIRECTIONS: usize = 50;
/// Nearer to the sun than this nothing is compared: the aureole is steep \[deg\].
const AUREOLE_DEG: f64 = 5.0;
/// The golden ratio of two dimensions (M. Roberts 2018): steps that fill a square evenly, however many there are.
const PLASTIC: f64 = 1.324_717_957_244_746;

/// How the method `shells` compares with the method `path`.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Each direction: azimuth and elevation \[deg\]; radiance of `shells` over that of `path`, summed over wavelengths, less
    /// one; the standard error of that.
    pub directions: Vec<(f64, f64, f64, f64)>,
}

impl Residual {
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
}

impl Sky {
    /// Compares `shells` with `path` at 50 directions spread evenly over a picture, outside 5° of the sun.
    ///
    /// # Arguments
    /// * `options` — observer, seed and number of orders; method, disc and number of paths are not looked at
    /// * `spp` — paths in each direction
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
        let (azimuth_deg, elevation_deg) = spread(sensor, self.sun.direction);
        if azimuth_deg.is_empty() {
            return Err(Error::invalid(
                "the picture shows nothing beyond 5 deg from the sun to compare",
                "compare a wider picture",
            ));
        }
        let looks = Directions::new(&azimuth_deg, &elevation_deg)?;
        let with = |method: Method| RenderOptions {
            method,
            budget: Budget {
                spp,
                ..options.budget
            },
            sun_disc: SunDisc::Off,
            ..*options
        };
        let shells = self.render(&looks, &with(Method::Shells), cancel, &|_, _| ())?;
        let path = self.render(&looks, &with(Method::Path), cancel, progress)?;
        let w = self.wavelength_nm().len();
        let sum = |values: &[f32], k: usize| -> f64 {
            let row = &values[k * w..(k + 1) * w];
            row.iter().map(|&v| f64::from(v)).sum()
        };
        let mut directions = Vec::new();
        for (k, (&azimuth, &elevation)) in azimuth_deg.iter().zip(&elevation_deg).enumerate() {
            let reference = sum(&path.radiance, k);
            if reference <= 0.0 {
                continue;
            }
            // Wavelengths share their paths, so their errors add up.
            let row = &path.variance[k * w..(k + 1) * w];
            let error: f64 = row.iter().map(|&v| f64::from(v).sqrt()).sum();
            let residual = sum(&shells.radiance, k) / reference - 1.0;
            directions.push((azimuth, elevation, residual, error / reference));
        }
        if directions.is_empty() {
            return Err(Error::invalid(
                "no light reaches the directions compared",
                "compare a picture with some light",
            ));
        }
        Ok(Residual { directions })
    }
}

/// Directions spread evenly over a picture, away from the sun \[deg\].
fn spread(sensor: &dyn Sensor, sun: Vec3) -> (Vec<f64>, Vec<f64>) {
    let (width, height) = sensor.size();
    let mut looks = (Vec::new(), Vec::new());
    // At most this many trials: a picture that shows hardly anything must not be searched for ever.
    for k in 1..=100 * DIRECTIONS {
        let place = |step: f64, pixels: usize| {
            let x = (0.5 + k as f64 * step).fract() * pixels as f64;
            let pixel = (x as usize).min(pixels - 1);
            (pixel, x - pixel as f64)
        };
        let (column, u) = place(1.0 / PLASTIC, width);
        let (row, v) = place(1.0 / (PLASTIC * PLASTIC), height);
        let Some(direction) = sensor.direction(column, row, u, v) else {
            continue;
        };
        if direction.dot(sun) > AUREOLE_DEG.to_radians().cos() {
            continue;
        }
        let (azimuth, elevation) = direction.to_azimuth_elevation_deg();
        looks.0.push(azimuth);
        looks.1.push(elevation);
        if looks.0.len() == DIRECTIONS {
            break;
        }
    }
    looks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::BakeOptions;
    use crate::climate::{Conditions, Overrides};
    use crate::sensor::{Fisheye, Perspective};
    use crate::spectrum::{SolarSpectrum, WavelengthGrid};
    use crate::transport::Accuracy;

    #[test]
    fn directions_fill_the_picture_and_keep_away_from_the_sun() {
        let sun = Vec3::from_azimuth_elevation_deg(120.0, 40.0);
        let fisheye = Fisheye::new(64, 64, 180.0).unwrap();
        let (azimuth, elevation) = spread(&fisheye, sun);
        assert_eq!(azimuth.len(), DIRECTIONS);
        for quarter in 0..4 {
            let of = |a: &f64| (a.rem_euclid(360.0) / 90.0) as usize == quarter;
            assert!(azimuth.iter().filter(|a| of(a)).count() >= 8);
        }
        assert!(elevation.iter().filter(|&&e| e < 15.0).count() >= 8);
        for (a, e) in azimuth.iter().zip(&elevation) {
            let look = Vec3::from_azimuth_elevation_deg(*a, *e);
            assert!(look.dot(sun) < 5f64.to_radians().cos());
        }
        let at_the_sun = Perspective::new(8, 8, 2.0, 120.0, 40.0).unwrap();
        assert!(spread(&at_the_sun, sun).0.is_empty());
    }

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
