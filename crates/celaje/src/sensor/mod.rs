//! Which direction each pixel looks in.

use crate::math::Vec3;

/// A sensor maps a point of the picture to the direction in which the observer looks.
pub trait Sensor: Sync {
    /// Pixels in a row and number of rows.
    fn size(&self) -> (usize, usize);

    /// Unit vector (x east, y north, z up) seen through a point of a pixel, or `None` where the sensor sees nothing.
    ///
    /// `(u, v)` in [0, 1)² runs right and down inside the pixel; (0.5, 0.5) is its centre.
    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3>;
}
