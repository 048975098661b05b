//! A list of single directions.

use super::{entry, Sensor};
use crate::error::{check_range, Error, Result};
use crate::math::Vec3;

/// One pixel per direction, in one row; each pixel is infinitely narrow.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    directions: Vec<Vec3>,
}

impl Directions {
    /// From azimuths (clockwise from north, in [−360, 360]) and elevations (in [−90, 90]), in degrees and of the
    /// same length.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], [`Error::OutOfRange`], and [`Error::Invalid`] for an empty list.
    pub fn new(azimuth_deg: &[f64], elevation_deg: &[f64]) -> Result<Self> {
        if azimuth_deg.len() != elevation_deg.len() {
            return Err(Error::ShapeMismatch {
                name: "elevation_deg".to_owned(),
                got: format!("({},)", elevation_deg.len()),
                expected: format!("({},), that of azimuth_deg", azimuth_deg.len()),
            });
        }
        if azimuth_deg.is_empty() {
            return Err(Error::invalid(
                "no direction given",
                "give at least one azimuth and elevation",
            ));
        }
        let directions = azimuth_deg
            .iter()
            .zip(elevation_deg)
            .map(|(&azimuth, &elevation)| {
                check_range("azimuth", azimuth, "deg", -360.0..=360.0)?;
                check_range("elevation", elevation, "deg", -90.0..=90.0)?;
                Ok(Vec3::from_azimuth_elevation_deg(azimuth, elevation))
            })
            .collect::<Result<_>>()?;
        Ok(Self { directions })
    }
}

impl Sensor for Directions {
    fn size(&self) -> (usize, usize) {
        (self.directions.len(), 1)
    }

    fn direction(&self, column: usize, row: usize, _u: f64, _v: f64) -> Option<Vec3> {
        if row > 0 {
            return None;
        }
        self.directions.get(column).copied()
    }

    fn description(&self) -> Vec<(String, String)> {
        vec![
            entry("projection", "list of directions"),
            entry("north", "azimuth 0; azimuths grow clockwise"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_looks_where_it_was_told() {
        let s = Directions::new(&[0.0, 90.0, -90.0], &[0.0, 0.0, 90.0]).unwrap();
        assert_eq!(s.size(), (3, 1));
        let close = |column, v: Vec3| {
            assert!((s.direction(column, 0, 0.9, 0.1).unwrap() - v).length() < 1e-15)
        };
        close(0, Vec3::new(0.0, 1.0, 0.0));
        close(1, Vec3::new(1.0, 0.0, 0.0));
        close(2, Vec3::new(0.0, 0.0, 1.0));
        assert!(s.direction(3, 0, 0.5, 0.5).is_none());
    }

    #[test]
    fn lists_are_checked() {
        assert!(Directions::new(&[], &[]).is_err());
        assert!(Directions::new(&[0.0], &[]).is_err());
        assert!(Directions::new(&[f64::NAN], &[0.0]).is_err());
        assert!(Directions::new(&[0.0], &[90.5]).is_err());
    }
}
