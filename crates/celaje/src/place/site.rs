//! A place on Earth.

use crate::error::{check_range, Result};

/// A place on Earth whose ground lies at an altitude above sea level.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Site {
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
}

impl Site {
    /// Altitudes at which ground exists on Earth, with some room \[m\].
    pub const ALTITUDE_RANGE_M: std::ops::RangeInclusive<f64> = -500.0..=9000.0;

    /// A place from its geodetic coordinates.
    ///
    /// # Arguments
    /// * `latitude_deg` — north positive, −90 to 90
    /// * `longitude_deg` — east positive, −180 to 360 (190 is the same as −170)
    /// * `altitude_m` — of the ground above sea level, −500 to 9000. An observer above the ground is not a
    ///   matter of the site but of the view.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`], also for NaN.
    pub fn new(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Result<Self> {
        check_range("latitude", latitude_deg, "deg", -90.0..=90.0)?;
        check_range("longitude", longitude_deg, "deg", -180.0..=360.0)?;
        check_range("altitude", altitude_m, "m", Self::ALTITUDE_RANGE_M)?;
        let turns_west = longitude_deg > 180.0;
        Ok(Self {
            latitude_deg,
            longitude_deg: if turns_west {
                longitude_deg - 360.0
            } else {
                longitude_deg
            },
            altitude_m,
        })
    }

    /// Latitude, north positive \[deg\].
    pub fn latitude_deg(&self) -> f64 {
        self.latitude_deg
    }

    /// Longitude, east positive, −180 to 180 \[deg\].
    pub fn longitude_deg(&self) -> f64 {
        self.longitude_deg
    }

    /// Altitude of the ground above sea level \[m\].
    pub fn altitude_m(&self) -> f64 {
        self.altitude_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_places_are_refused() {
        assert_eq!(
            Site::new(91.0, 0.0, 0.0).unwrap_err().to_string(),
            "latitude = 91 deg is outside [-90, 90]"
        );
        assert!(Site::new(f64::NAN, 0.0, 0.0).is_err());
        assert!(Site::new(0.0, -181.0, 0.0).is_err());
        assert!(Site::new(0.0, f64::INFINITY, 0.0).is_err());
        assert!(Site::new(0.0, 0.0, 20_000.0).is_err());
        assert_eq!(Site::new(0.0, 190.0, 0.0).unwrap().longitude_deg(), -170.0);
    }
}
