//! The latitude–longitude (equirectangular) picture of the whole sphere.

use super::{check_size, entry, Sensor};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// The whole sphere in 2N × N pixels: azimuth to the right, elevation upwards.
///
/// A picture point `(x, y)` looks at the azimuth `360° · x / width`, so the *left edge* of column 0 is north and east is
/// a quarter of the width to the right; and at the elevation `90° − 180° · y / height`, so the upper edge is the
/// zenith, the middle the horizon and the lower edge the nadir.
#[derive(Debug, Clone, PartialEq)]
pub struct LatLong {
    width: usize,
    height: usize,
}

impl LatLong {
    /// A picture of `width` × `height` pixels, `width` twice `height`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another shape or a picture without pixels.
    pub fn new(width: usize, height: usize) -> Result<Self> {
        check_size(width, height)?;
        if !width.is_multiple_of(2) || width / 2 != height {
            return Err(Error::invalid(
                format!("a lat-long picture is twice as wide as high, not {width}x{height}"),
                "give a size such as 1024x512",
            ));
        }
        Ok(Self { width, height })
    }
}

impl Sensor for LatLong {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let azimuth_deg = 360.0 * (column as f64 + u) / self.width as f64;
        let elevation_deg = 90.0 - 180.0 * (row as f64 + v) / self.height as f64;
        Some(Vec3::from_azimuth_elevation_deg(azimuth_deg, elevation_deg))
    }

    fn pixel_of(&self, direction: Vec3) -> Option<(f64, f64)> {
        let (azimuth_deg, elevation_deg) = direction.to_azimuth_elevation_deg();
        Some((
            azimuth_deg / 360.0 * self.width as f64,
            (90.0 - elevation_deg) / 180.0 * self.height as f64,
        ))
    }

    fn description(&self) -> Vec<(String, String)> {
        vec![
            entry("projection", "lat-long, zenith at the upper edge"),
            entry(
                "north",
                "left edge of column 0; azimuth grows to the right, east at a quarter of the width",
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_grows_to_the_right_from_north_at_the_left_edge() {
        let s = LatLong::new(8, 4).unwrap();
        let cases = [
            ((0, 1, 0.5, 0.5), (22.5, 22.5)),
            ((2, 2, 0.0, 0.0), (90.0, 0.0)),
            ((6, 3, 0.0, 0.0), (270.0, -45.0)),
            ((7, 0, 0.5, 0.5), (337.5, 67.5)),
        ];
        for ((column, row, u, v), (azimuth, elevation)) in cases {
            let d = s.direction(column, row, u, v).unwrap();
            let (a, e) = d.to_azimuth_elevation_deg();
            assert!(
                (a - azimuth).abs() < 1e-12 && (e - elevation).abs() < 1e-12,
                "{a} {e}"
            );
        }
        assert!((s.direction(3, 0, 0.5, 0.0).unwrap().z - 1.0).abs() < 1e-15);
        let (x, y) = s.pixel_of(Vec3::new(0.0, 1.0, 0.0)).unwrap();
        assert_eq!((x, y), (0.0, 2.0));
    }

    #[test]
    fn another_shape_is_refused() {
        for (width, height) in [(8, 8), (9, 4), (4, 8), (1, 0)] {
            assert!(LatLong::new(width, height).is_err());
        }
    }
}
