//! `shells` and `path` side by side, in directions spread over a picture.

use std::sync::atomic::AtomicBool;

use super::Residual;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::medium::Medium;
use crate::sensor::{Directions, Sensor};
use crate::sky::{Method, RenderOptions, Sky, SunDisc};
use crate::transport::Budget;

/// Directions compared.
pub const DIRECTIONS: usize = 50;
/// Nearer to the sun than this nothing is compared: the aureole is steep \[deg\].
const AUREOLE_DEG: f64 = 5.0;
/// The golden ratio of two dimensions (M. Roberts 2018): steps that fill a square evenly, however many there are.
const PLASTIC: f64 = 1.324_717_957_244_746;

/// Spectra of both methods, of the directions where both see light.
pub struct Comparison {
    pub wavelength_nm: Vec<f64>,
    /// Towards the sun.
    pub sun: Vec3,
    /// Sine of the horizon's elevation, 0 on the ground.
    pub horizon: f64,
    pub looks: Vec<Look>,
}

/// A direction, and the spectral radiance there, shape (w,).
pub struct Look {
    pub direction: Vec3,
    pub shells: Vec<f64>,
    pub path: Vec<f64>,
    /// Variance of `path`.
    pub variance: Vec<f64>,
}

impl Comparison {
    /// Looks by both methods; arguments and errors are those of [`Sky::residual`].
    pub fn new(
        sky: &Sky,
        sensor: &dyn Sensor,
        options: &RenderOptions,
        spp: u32,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Self> {
        let directions = spread(sensor, sky.sun.direction);
        if directions.is_empty() {
            return Err(Error::invalid(
                "the picture shows nothing beyond 5 deg from the sun to compare",
                "compare a wider picture",
            ));
        }
        let angles = directions.iter().map(|d| d.to_azimuth_elevation_deg());
        let (azimuth_deg, elevation_deg): (Vec<f64>, Vec<f64>) = angles.unzip();
        let sensor = Directions::new(&azimuth_deg, &elevation_deg)?;
        let with = |method: Method| RenderOptions {
            method,
            budget: Budget {
                spp,
                ..options.budget
            },
            sun_disc: SunDisc::Off,
            ..*options
        };
        let shells = sky.render(&sensor, &with(Method::Shells), cancel, &|_, _| ())?;
        let path = sky.render(&sensor, &with(Method::Path), cancel, progress)?;
        let w = sky.wavelength_nm().len();
        let row = |values: &[f32], k: usize| -> Vec<f64> {
            let row = &values[k * w..(k + 1) * w];
            row.iter().map(|&v| f64::from(v)).collect()
        };
        let looks: Vec<Look> = directions
            .into_iter()
            .enumerate()
            .map(|(k, direction)| Look {
                direction,
                shells: row(&shells.radiance, k),
                path: row(&path.radiance, k),
                variance: row(&path.variance, k),
            })
            .filter(|look| sum(&look.path) > 0.0)
            .collect();
        if looks.is_empty() {
            return Err(Error::invalid(
                "no light reaches the directions compared",
                "compare a picture with some light",
            ));
        }
        let down = sky.medium.ground_radius_m() / sky.observer_radius_m(options.altitude_m)?;
        Ok(Self {
            wavelength_nm: sky.wavelength_nm().to_vec(),
            sun: sky.sun.direction,
            horizon: -(1.0 - down * down).max(0.0).sqrt(),
            looks,
        })
    }

    /// The residual once `shells` is multiplied by `factor(direction, wavelength)`, both as indices.
    pub fn residual(&self, factor: impl Fn(usize, usize) -> f64) -> Residual {
        let of = |(k, look): (usize, &Look)| {
            let reference = sum(&look.path);
            let shells = look.shells.iter().enumerate();
            let shells: f64 = shells.map(|(i, l)| l * factor(k, i)).sum();
            // Wavelengths share their paths, so their errors add up.
            let error: f64 = look.variance.iter().map(|v| v.sqrt()).sum();
            let (azimuth, elevation) = look.direction.to_azimuth_elevation_deg();
            (
                azimuth,
                elevation,
                shells / reference - 1.0,
                error / reference,
            )
        };
        Residual {
            directions: self.looks.iter().enumerate().map(of).collect(),
        }
    }
}

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}

/// Directions spread evenly over a picture, away from the sun.
fn spread(sensor: &dyn Sensor, sun: Vec3) -> Vec<Vec3> {
    let (width, height) = sensor.size();
    let mut looks = Vec::new();
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
        looks.push(direction);
        if looks.len() == DIRECTIONS {
            break;
        }
    }
    looks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::{Fisheye, Perspective};

    #[test]
    fn directions_fill_the_picture_and_keep_away_from_the_sun() {
        let sun = Vec3::from_azimuth_elevation_deg(120.0, 40.0);
        let fisheye = Fisheye::new(64, 64, 180.0).unwrap();
        let looks = spread(&fisheye, sun);
        assert_eq!(looks.len(), DIRECTIONS);
        let angles: Vec<(f64, f64)> = looks.iter().map(|d| d.to_azimuth_elevation_deg()).collect();
        for quarter in 0..4 {
            let of = |a: f64| (a.rem_euclid(360.0) / 90.0) as usize == quarter;
            assert!(angles.iter().filter(|a| of(a.0)).count() >= 8);
        }
        assert!(angles.iter().filter(|a| a.1 < 15.0).count() >= 8);
        for look in looks {
            assert!(look.dot(sun) < 5f64.to_radians().cos());
        }
        let at_the_sun = Perspective::new(8, 8, 2.0, 120.0, 40.0).unwrap();
        assert!(spread(&at_the_sun, sun).is_empty());
    }
}
