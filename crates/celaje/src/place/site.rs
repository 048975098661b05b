//! A place on Earth.

use super::gazetteer::{self, City};
use crate::error::{check_range, Error, Result};

/// A place on Earth whose ground lies at an altitude above sea level.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Site {
    latitude_deg: f64,
    longitude_deg: f64,
    altitude_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    city: Option<&'static City>,
}

/// Cities lend their time zone to places so far away \[km\]; farther out, at sea or in the ice, there is none to be told.
const ZONE_REACH_KM: f64 = 400.0;

impl Site {
    /// Altitudes at which ground exists on Earth, with some room \[m\].
    pub const ALTITUDE_RANGE_M: std::ops::RangeInclusive<f64> = -500.0..=9000.0;

    /// A place from its geodetic coordinates.
    ///
    /// # Arguments
    /// * `latitude_deg` — north positive, −90 to 90
    /// * `longitude_deg` — east positive, −360 to 360; kept in [−180, 180], where 190 is −170 and −190 is 170
    /// * `altitude_m` — of the ground above sea level, −500 to 9000; exactly 0 stands for unknown where conditions are
    ///   looked for, which then take the map's. An observer above the ground is not a
    ///   matter of the site but of the view.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`], also for NaN.
    pub fn new(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Result<Self> {
        check_range("latitude", latitude_deg, "deg", -90.0..=90.0)?;
        check_range("longitude", longitude_deg, "deg", -360.0..=360.0)?;
        check_range("altitude", altitude_m, "m", Self::ALTITUDE_RANGE_M)?;
        let turn = match longitude_deg {
            east if east > 180.0 => -360.0,
            west if west < -180.0 => 360.0,
            _ => 0.0,
        };
        Ok(Self {
            latitude_deg,
            longitude_deg: longitude_deg + turn,
            altitude_m,
            city: None,
        })
    }

    /// A city by its name, its altitude left to the map of elevations; see [`gazetteer::find`] for names.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a name that is unknown (with suggestions) or ambiguous (with the candidates).
    pub fn named(name: &str) -> Result<Self> {
        let city = gazetteer::find(name)?;
        let site = Self::new(city.latitude_deg, city.longitude_deg, 0.0)?;
        Ok(Self {
            city: Some(city),
            ..site
        })
    }

    /// A place as people write it: `41.65,-0.88`, or the name of a city such as `Zaragoza` or `Córdoba, Argentina`.
    ///
    /// The altitude is left to the map of elevations.
    ///
    /// ```
    /// # use celaje::place::Site;
    /// assert!((Site::parse("Zaragoza")?.latitude_deg() - 41.65).abs() < 0.05);
    /// assert_eq!(Site::parse("41.65,-0.88")?.longitude_deg(), -0.88);
    /// # Ok::<(), celaje::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for coordinates outside their ranges; as [`Self::named`] for names.
    pub fn parse(text: &str) -> Result<Self> {
        let numbers: Vec<Option<f64>> = text.split(',').map(|t| t.trim().parse().ok()).collect();
        match numbers[..] {
            [Some(latitude_deg), Some(longitude_deg)] => {
                Self::new(latitude_deg, longitude_deg, 0.0)
            }
            [None, ..] => Self::named(text),
            _ => Err(Error::invalid(
                format!("place '{text}' is not understood"),
                "write latitude and longitude as 41.65,-0.88, or the name of a city",
            )),
        }
    }

    /// The same place with its ground at another altitude \[m\], −500 to 9000.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], also for NaN.
    pub fn at_altitude(self, altitude_m: f64) -> Result<Self> {
        check_range("altitude", altitude_m, "m", Self::ALTITUDE_RANGE_M)?;
        Ok(Self { altitude_m, ..self })
    }

    /// The city by whose name the place was given.
    pub fn city(&self) -> Option<&'static City> {
        self.city
    }

    /// Time zone: of the city that the place was named by, else of the nearest city within 400 km; none otherwise.
    ///
    /// Near borders the nearest city may be abroad.
    pub fn time_zone(&self) -> Option<&'static str> {
        if let Some(city) = self.city {
            return Some(city.time_zone);
        }
        let near = gazetteer::nearest(self.latitude_deg, self.longitude_deg);
        let (city, km) = near.ok().flatten()?;
        (km <= ZONE_REACH_KM).then_some(city.time_zone)
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
        assert!(Site::new(0.0, -361.0, 0.0).is_err());
        assert!(Site::new(0.0, f64::INFINITY, 0.0).is_err());
        assert!(Site::new(0.0, 0.0, 20_000.0).is_err());
    }

    #[test]
    fn longitudes_go_around() {
        for (given, kept) in [
            (190.0, -170.0),
            (-190.0, 170.0),
            (360.0, 0.0),
            (180.0, 180.0),
            (-180.0, -180.0),
        ] {
            let site = Site::new(0.0, given, 0.0).unwrap();
            assert_eq!(site.longitude_deg(), kept);
        }
    }
}
