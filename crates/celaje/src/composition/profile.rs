//! How aerosols thin out with altitude.

use crate::error::{check_range, Error, Result};
use crate::math::interp::interval;

/// Depth over which AIAA types fade out below the tropopause \[m\].
const TAPER_M: f64 = 2000.0;

/// How number density falls off with altitude above sea level, relative to its value at a reference.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum VerticalProfile {
    /// Values at altitudes, made by [`VerticalProfile::sampled`].
    Sampled(Sampled),
    /// `exp(−(z − reference) / scale height)` from `bottom` to `top`, nothing outside; an infinite scale height is
    /// constant.
    Slab {
        /// Altitude where the profile is 1 \[m\].
        reference_m: f64,
        /// Lower edge \[m\].
        bottom_m: f64,
        /// Upper edge \[m\].
        top_m: f64,
        /// Scale height \[m\], may be infinite.
        scale_height_m: f64,
    },
    /// `exp(−z / scale height)`, brought smoothly to zero over the last 2 km below the tropopause.
    Tropospheric {
        /// Scale height \[m\], may be infinite.
        scale_height_m: f64,
        /// Altitude where the aerosol ends \[m\].
        tropopause_m: f64,
    },
}

impl VerticalProfile {
    /// A profile through given points: exponential between two positive values, linear where one is 0, nothing outside.
    ///
    /// # Arguments
    /// * `altitude_m` — above sea level \[m\], strictly increasing, −1000 to 1e6, at least two
    /// * `relative` — \[1\], ≥ 0, not all of them 0
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], [`Error::Invalid`], [`Error::OutOfRange`].
    pub fn sampled(altitude_m: Vec<f64>, relative: Vec<f64>) -> Result<Self> {
        Ok(Self::Sampled(Sampled::new(altitude_m, relative)?))
    }

    /// `exp(−z / scale height)`, brought smoothly to zero over the last 2 km below the tropopause.
    ///
    /// # Arguments
    /// * `scale_height_m` — 1 to 1e6, or infinite for a constant \[m\]
    /// * `tropopause_m` — where the aerosol ends, 2000 to 1e5 \[m\]
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn tropospheric(scale_height_m: f64, tropopause_m: f64) -> Result<Self> {
        if scale_height_m != f64::INFINITY {
            check_range("scale height", scale_height_m, "m", 1.0..=1e6)?;
        }
        check_range("tropopause", tropopause_m, "m", TAPER_M..=1e5)?;
        Ok(Self::Tropospheric {
            scale_height_m,
            tropopause_m,
        })
    }

    /// Value relative to the reference \[1\] at an altitude above sea level \[m\].
    pub fn relative(&self, altitude_m: f64) -> f64 {
        match *self {
            Self::Sampled(ref samples) => samples.at(altitude_m),
            Self::Slab {
                reference_m,
                bottom_m,
                top_m,
                scale_height_m,
            } => {
                if (bottom_m..=top_m).contains(&altitude_m) {
                    (-(altitude_m - reference_m) / scale_height_m).exp()
                } else {
                    0.0
                }
            }
            Self::Tropospheric {
                scale_height_m,
                tropopause_m,
            } => {
                let t = ((tropopause_m - altitude_m) / TAPER_M).clamp(0.0, 1.0);
                (-altitude_m / scale_height_m).exp() * t * t * (3.0 - 2.0 * t)
            }
        }
    }

    /// `∫ relative dz` \[m\] from an altitude upwards.
    pub fn column_above(&self, altitude_m: f64) -> f64 {
        match *self {
            Self::Sampled(ref samples) => samples.column_above(altitude_m),
            Self::Slab {
                reference_m,
                bottom_m,
                top_m,
                scale_height_m,
            } => {
                let from = altitude_m.max(bottom_m);
                if from >= top_m {
                    0.0
                } else if scale_height_m.is_infinite() {
                    top_m - from
                } else {
                    let at = |z: f64| (-(z - reference_m) / scale_height_m).exp();
                    scale_height_m * (at(from) - at(top_m))
                }
            }
            Self::Tropospheric { tropopause_m, .. } => {
                // Simpson's rule on either side of the taper's start, where the third derivative jumps.
                let taper_m = tropopause_m - TAPER_M;
                let from = altitude_m.min(tropopause_m);
                self.simpson(from, from.max(taper_m))
                    + self.simpson(from.max(taper_m), tropopause_m)
            }
        }
    }

    /// Altitudes at which the profile jumps or bends \[m\], increasing; a medium should have its nodes there.
    pub fn breaks_m(&self) -> Vec<f64> {
        match *self {
            Self::Sampled(ref samples) => samples.altitude_m.clone(),
            Self::Slab {
                bottom_m, top_m, ..
            } => vec![bottom_m, top_m],
            Self::Tropospheric { tropopause_m, .. } => vec![tropopause_m - TAPER_M, tropopause_m],
        }
    }

    fn simpson(&self, from_m: f64, to_m: f64) -> f64 {
        const PANELS: usize = 200;
        let step = (to_m - from_m) / (2 * PANELS) as f64;
        let value = |i: usize| {
            let weight = if i == 0 || i == 2 * PANELS {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
            weight * self.relative(from_m + step * i as f64)
        };
        (0..=2 * PANELS).map(value).sum::<f64>() * step / 3.0
    }
}

/// A profile through given points, see [`VerticalProfile::sampled`].
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    altitude_m: Vec<f64>,
    relative: Vec<f64>,
}

impl Sampled {
    fn new(altitude_m: Vec<f64>, relative: Vec<f64>) -> Result<Self> {
        if altitude_m.len() != relative.len() {
            return Err(Error::ShapeMismatch {
                name: "vertical profile".into(),
                got: format!("({},)", relative.len()),
                expected: format!("({},)", altitude_m.len()),
            });
        }
        for (&z, &value) in altitude_m.iter().zip(&relative) {
            check_range("altitude", z, "m", -1000.0..=1e6)?;
            check_range("vertical profile", value, "", 0.0..=1e12)?;
        }
        if altitude_m.len() < 2 || altitude_m.windows(2).any(|z| z[1] <= z[0]) {
            return Err(Error::invalid(
                "the altitudes of a vertical profile must increase and be two at least",
                "sort them from the ground up and drop repeated ones",
            ));
        }
        if relative.iter().all(|&v| v == 0.0) {
            return Err(Error::invalid(
                "a vertical profile without particles",
                "give a positive value at one altitude at least",
            ));
        }
        Ok(Self {
            altitude_m,
            relative,
        })
    }

    fn ends_m(&self) -> [f64; 2] {
        [
            self.altitude_m[0],
            self.altitude_m[self.altitude_m.len() - 1],
        ]
    }

    fn at(&self, altitude_m: f64) -> f64 {
        let [first, last] = self.ends_m();
        if !(first..=last).contains(&altitude_m) {
            return 0.0;
        }
        let i = interval(&self.altitude_m, altitude_m);
        let (z0, z1) = (self.altitude_m[i], self.altitude_m[i + 1]);
        let (a, b) = (self.relative[i], self.relative[i + 1]);
        let t = (altitude_m - z0) / (z1 - z0);
        if a > 0.0 && b > 0.0 {
            a * (b / a).powf(t)
        } else {
            a + t * (b - a)
        }
    }

    fn column_above(&self, altitude_m: f64) -> f64 {
        let piece = |i: usize| {
            let (from, to) = (self.altitude_m[i].max(altitude_m), self.altitude_m[i + 1]);
            if from >= to {
                return 0.0;
            }
            let (a, b) = (self.at(from), self.relative[i + 1]);
            let log = (b / a).ln();
            if self.relative[i] > 0.0 && b > 0.0 && log.abs() > 1e-9 {
                (b - a) / log * (to - from)
            } else {
                0.5 * (a + b) * (to - from)
            }
        };
        (0..self.altitude_m.len() - 1).map(piece).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampled_profiles_meet_their_points_and_columns() {
        let z = vec![0.0, 1000.0, 3000.0, 4000.0];
        let profile = VerticalProfile::sampled(z, vec![1.0, 0.5, 0.5, 0.0]).unwrap();
        assert_eq!(profile.relative(1000.0), 0.5);
        assert!((profile.relative(500.0) - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!(profile.relative(3500.0), 0.25);
        assert_eq!(
            (profile.relative(-1.0), profile.relative(4001.0)),
            (0.0, 0.0)
        );
        for from in [-100.0, 0.0, 700.0, 2000.0, 3600.0, 5000.0] {
            let sum: f64 = (0..60_000)
                .map(|i| from + 0.1 * (f64::from(i) + 0.5))
                .map(|z| 0.1 * profile.relative(z))
                .sum();
            assert!((profile.column_above(from) - sum).abs() < 1e-3, "{from}");
        }
    }

    #[test]
    fn nonsense_profiles_are_refused() {
        let sampled = |z: &[f64], v: &[f64]| VerticalProfile::sampled(z.to_vec(), v.to_vec());
        assert!(sampled(&[0.0, 1.0], &[1.0]).is_err());
        assert!(sampled(&[1.0, 0.0], &[1.0, 1.0]).is_err());
        assert!(sampled(&[0.0, 0.0], &[1.0, 1.0]).is_err());
        assert!(sampled(&[0.0], &[1.0]).is_err());
        assert!(sampled(&[0.0, 1.0], &[0.0, 0.0]).is_err());
        assert!(sampled(&[0.0, 1.0], &[-1.0, 1.0]).is_err());
        assert!(sampled(&[0.0, f64::NAN], &[1.0, 1.0]).is_err());
        for scale_height_m in [0.0, -900.0, f64::NAN, f64::NEG_INFINITY] {
            assert!(VerticalProfile::tropospheric(scale_height_m, 13e3).is_err());
        }
        assert!(VerticalProfile::tropospheric(f64::INFINITY, 13e3).is_ok());
        assert!(VerticalProfile::tropospheric(900.0, 0.0).is_err());
    }
}
