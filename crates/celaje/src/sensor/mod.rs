//! Which direction each pixel looks in.
//!
//! A *picture point* is measured in pixels from the left and upper edges of the picture: the centre of the pixel in
//! column `c`, row `r` is the point `(c + 0.5, r + 0.5)`. Orientations are drawn in `docs/conventions.md`.

mod directions;
mod fisheye;
mod latlong;
mod perspective;
mod selected;

pub use directions::Directions;
pub use fisheye::Fisheye;
pub use latlong::LatLong;
pub use perspective::Perspective;
pub(crate) use selected::Selected;

use crate::error::{Error, Result};
use crate::math::Vec3;

/// The projections of pictures, each with a one-line meaning.
pub const PROJECTIONS: [(&str, &str); 3] = [
    (
        "fisheye",
        "equidistant, zenith in the middle, north up, east left",
    ),
    (
        "latlong",
        "whole sphere, row 0 the zenith, north at the left edge, azimuth to the right",
    ),
    ("perspective", "a flat picture around one direction"),
];

/// A sensor maps a point of the picture to the direction in which the observer looks.
pub trait Sensor: Sync {
    /// Pixels in a row and number of rows.
    fn size(&self) -> (usize, usize);

    /// Unit vector (x east, y north, z up) seen through a point of a pixel, or `None` where the sensor sees nothing.
    ///
    /// `(u, v)` in [0, 1)² runs right and down inside the pixel; (0.5, 0.5) is its centre.
    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3>;

    /// The picture point `(x, y)` in pixels at which a unit vector appears; `None` if it is not in the picture.
    ///
    /// The inverse of [`Sensor::direction`]; a list of directions has none.
    fn pixel_of(&self, _direction: Vec3) -> Option<(f64, f64)> {
        None
    }

    /// Number of the stream of random numbers from which a pixel is rendered: those of one number repeat each other's noise.
    fn stream(&self, pixel: usize) -> u64 {
        pixel as u64
    }

    /// Projection, angles and where north is, as names and values to keep in a file beside the picture.
    fn description(&self) -> Vec<(String, String)> {
        Vec::new()
    }
}

/// Refuses a picture without pixels.
fn check_size(width: usize, height: usize) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::invalid(
            format!("size {width}x{height} has no pixels"),
            "give a size of at least 1x1",
        ));
    }
    Ok(())
}

/// Name and value as owned strings.
fn entry(name: &str, value: impl ToString) -> (String, String) {
    (name.to_owned(), value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `pixel_of` undoes `direction` at every pixel, at a point that is not its centre.
    #[test]
    fn pixel_of_is_the_inverse_of_direction() {
        let sensors: [Box<dyn Sensor>; 6] = [
            Box::new(Fisheye::new(17, 17, 180.0).unwrap()),
            Box::new(Fisheye::new(23, 16, 345.0).unwrap()),
            Box::new(LatLong::new(24, 12).unwrap()),
            Box::new(Perspective::new(20, 11, 75.0, 250.0, 12.0).unwrap()),
            Box::new(Perspective::new(7, 9, 150.0, 10.0, 90.0).unwrap()),
            Box::new(Perspective::new(8, 8, 40.0, -80.0, -35.0).unwrap()),
        ];
        for sensor in sensors {
            let (width, height) = sensor.size();
            let mut seen = 0;
            for (row, column) in (0..height).flat_map(|r| (0..width).map(move |c| (r, c))) {
                let Some(direction) = sensor.direction(column, row, 0.3, 0.6) else {
                    continue;
                };
                seen += 1;
                assert!((direction.length() - 1.0).abs() < 1e-14);
                let (x, y) = sensor.pixel_of(direction).unwrap();
                assert!((x - column as f64 - 0.3).abs() < 1e-10, "{x} {column}");
                assert!((y - row as f64 - 0.6).abs() < 1e-10, "{y} {row}");
            }
            assert!(seen > width * height / 2);
        }
    }

    #[test]
    fn no_picture_without_pixels() {
        assert!(Fisheye::new(0, 4, 180.0).is_err());
        assert!(LatLong::new(0, 0).is_err());
        assert!(Perspective::new(4, 0, 60.0, 0.0, 0.0).is_err());
    }
}
