//! Where the sun stands.

use solar_positioning::time::JulianDate;
use solar_positioning::{delta_t, Location, SolarPositions};

use super::{Instant, Site};
use crate::error::{check_range, Error, Result};
use crate::spectrum::SUN_SOLID_ANGLE_SR;

/// The sun as seen from a place: true direction (no refraction) of the centre of its disc, and distance.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SunPosition {
    azimuth_deg: f64,
    elevation_deg: f64,
    distance_au: f64,
}

impl SunPosition {
    /// Distances that the Earth's orbit allows, with some room \[au\].
    pub const DISTANCE_RANGE_AU: std::ops::RangeInclusive<f64> = 0.9..=1.1;

    /// A sun put anywhere by hand.
    ///
    /// # Arguments
    /// * `azimuth_deg` — clockwise from north, −360 to 360; kept in [0, 360)
    /// * `elevation_deg` — true, −90 to 90
    /// * `distance_au` — 0.9 to 1.1
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn new(azimuth_deg: f64, elevation_deg: f64, distance_au: f64) -> Result<Self> {
        check_range("sun azimuth", azimuth_deg, "deg", -360.0..=360.0)?;
        check_range("sun elevation", elevation_deg, "deg", -90.0..=90.0)?;
        check_range("sun distance", distance_au, "au", Self::DISTANCE_RANGE_AU)?;
        Ok(Self {
            azimuth_deg: azimuth_deg.rem_euclid(360.0),
            elevation_deg,
            distance_au,
        })
    }

    /// The sun at a place and an instant.
    ///
    /// NREL's Solar Position Algorithm, parallax included, stated to be within 0.0003°. TT − UT1 is the
    /// estimate of the crate `solar-positioning`; UTC stands for UT1 (below 0.9 s or 0.004° apart since 1972;
    /// before 1972 an instant is read as UT1).
    ///
    /// # Errors
    /// [`Error::Invalid`] if the algorithm refuses its input, which no valid [`Site`] and [`Instant`] should cause.
    ///
    /// # Source
    /// Reda & Andreas 2004, doi:10.1016/j.solener.2003.12.003.
    pub fn at(site: &Site, instant: &Instant) -> Result<Self> {
        let (azimuth_deg, elevation_deg, distance_au) = spa(site, instant).map_err(|e| {
            Error::invalid(
                format!("the sun's position cannot be found: {e}"),
                "give a time between 1900 and 2100",
            )
        })?;
        Self::new(azimuth_deg, elevation_deg, distance_au)
    }

    /// Azimuth clockwise from true north, in [0, 360) \[deg\].
    pub fn azimuth_deg(&self) -> f64 {
        self.azimuth_deg
    }

    /// True elevation of the disc's centre above the astronomical horizon, −90 to 90 \[deg\].
    pub fn elevation_deg(&self) -> f64 {
        self.elevation_deg
    }

    /// Distance from the Earth's centre to the sun's \[au\].
    pub fn distance_au(&self) -> f64 {
        self.distance_au
    }

    /// Solid angle of the disc, 6.79e-5 sr at 1 au \[sr\].
    pub fn solid_angle_sr(&self) -> f64 {
        SUN_SOLID_ANGLE_SR / (self.distance_au * self.distance_au)
    }

    /// Angular radius of the disc, from Ω = 2π (1 − cos r) = 4π sin²(r/2) \[deg\].
    pub fn angular_radius_deg(&self) -> f64 {
        let quarter = self.solid_angle_sr() / (4.0 * std::f64::consts::PI);
        2.0 * quarter.sqrt().asin().to_degrees()
    }
}

/// Azimuth and elevation \[deg\] and distance \[au\] of the sun.
fn spa(site: &Site, instant: &Instant) -> solar_positioning::Result<(f64, f64, f64)> {
    let delta_t_s = delta_t::estimate(instant.decimal_year())?;
    let time = JulianDate::new(instant.julian_date(), delta_t_s)?;
    let sky = SolarPositions::new().for_time_from_julian(time)?;
    let location = Location {
        latitude: site.latitude_deg(),
        longitude: site.longitude_deg(),
    };
    let sun = sky.at(location, site.altitude_m(), None)?;
    // SPA always has a distance; 1 au would be wrong by 1.7 % at most.
    let distance_au = sky.earth_radius_vector().unwrap_or(1.0);
    Ok((sun.azimuth(), sun.elevation_angle(), distance_au))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Table;

    /// The example of NREL/TP-560-34302, appendix A.5: azimuth 194.340241°, elevation 39.872046° before refraction,
    /// R = 0.9965422974 au, with TT − UT1 = 67 s (ours estimates 64.5 s).
    #[test]
    fn nrel_example() {
        let site = Site::new(39.742476, -105.1786, 1830.14).unwrap();
        let sun = SunPosition::at(&site, &"2003-10-17T12:30:30-07:00".parse().unwrap()).unwrap();
        assert!((sun.azimuth_deg() - 194.340241).abs() < 5e-5);
        assert!((sun.elevation_deg() - 39.872046).abs() < 5e-5);
        assert!((sun.distance_au() - 0.996_542_297_4).abs() < 2e-8);
    }

    /// Another SPA to 0.0002° (its TT − UT1 differs), and ERFA's ephemeris with measured UT1 to 0.005°
    /// (UT1 − UTC below 0.9 s is 0.004°); azimuths weighted by the cosine of the elevation.
    #[test]
    fn positions_agree_with_pvlib_and_astropy() {
        let table = Table::parse(
            "sun_positions",
            include_str!("../../../../tests/reference/sun_positions.csv"),
        )
        .unwrap();
        let column = |name: &str| table.numbers(name).unwrap();
        let (lat, lon) = (column("latitude_deg"), column("longitude_deg"));
        let alt = column("altitude_m");
        for (i, time) in table.words("time").unwrap().into_iter().enumerate() {
            let site = Site::new(lat[i], lon[i], alt[i]).unwrap();
            let sun = SunPosition::at(&site, &time.parse().unwrap()).unwrap();
            for (code, angle, distance) in [("spa", 2e-4, 1e-6), ("erfa", 5e-3, 1e-5)] {
                let get = |what: &str| column(&format!("{code}_{what}"))[i];
                let turn = sun.azimuth_deg() - get("azimuth_deg");
                let turn = (turn + 180.0).rem_euclid(360.0) - 180.0;
                let turn = turn * sun.elevation_deg().to_radians().cos();
                let rise = sun.elevation_deg() - get("elevation_deg");
                let away = sun.distance_au() - get("distance_au");
                assert!(turn.abs() < angle, "{code} {time} {i}: azimuth {turn}");
                assert!(rise.abs() < angle, "{code} {time} {i}: elevation {rise}");
                assert!(away.abs() < distance, "{code} {time} {i}: distance {away}");
            }
        }
    }

    #[test]
    fn disc_has_the_stated_solid_angle() {
        let sun = SunPosition::new(180.0, 30.0, 1.0).unwrap();
        // sqrt(6.79e-5 / π) rad = 0.26637°; the Astronomical Almanac's radius at 1 au is 959.63″ = 0.26656°.
        assert!((sun.angular_radius_deg() - 0.26637).abs() < 1e-4);
        let far = SunPosition::new(-90.0, 30.0, 1.0167).unwrap();
        assert_eq!(far.azimuth_deg(), 270.0);
        assert!(
            (far.solid_angle_sr() / sun.solid_angle_sr() * 1.0167f64.powi(2) - 1.0).abs() < 1e-12
        );
        assert!(SunPosition::new(0.0, 90.1, 1.0).is_err());
        assert!(SunPosition::new(f64::NAN, 0.0, 1.0).is_err());
    }
}
