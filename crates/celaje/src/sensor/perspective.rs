//! The pinhole camera.

use super::{check_size, entry, Sensor};
use crate::error::{check_range, Error, Result};
use crate::math::Vec3;

/// A flat picture around one direction; the horizon is level and azimuth grows to the right.
///
/// With the forward direction `f`, the level direction to its right `r = (cos a, −sin a, 0)` (`a` the azimuth looked
/// at) and `t = r × f` upwards, a picture point at `(x, y)` pixels right of and above the middle looks along
/// `F f + x r + y t`, `F = (width / 2) / tan(fov / 2)`. Looking straight up with azimuth 0, right is east and up is
/// south: the view of someone who faces north and leans back.
#[derive(Debug, Clone, PartialEq)]
pub struct Perspective {
    width: usize,
    height: usize,
    fov_deg: f64,
    azimuth_deg: f64,
    elevation_deg: f64,
    forward: Vec3,
    right: Vec3,
    up: Vec3,
    focal_px: f64,
}

impl Perspective {
    /// A camera of `width` × `height` square pixels.
    ///
    /// # Arguments
    /// * `fov_deg` — angle between the left and the right edge, in (0, 180) \[deg\]
    /// * `azimuth_deg`, `elevation_deg` — where the middle of the picture looks, in [−360, 360] and [−90, 90] \[deg\]
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an angle, [`Error::Invalid`] for a picture without pixels.
    pub fn new(
        width: usize,
        height: usize,
        fov_deg: f64,
        azimuth_deg: f64,
        elevation_deg: f64,
    ) -> Result<Self> {
        check_size(width, height)?;
        if !(fov_deg > 0.0 && fov_deg < 180.0) {
            return Err(Error::out_of_range("fov", fov_deg, "deg", "(0, 180)"));
        }
        check_range("look azimuth", azimuth_deg, "deg", -360.0..=360.0)?;
        check_range("look elevation", elevation_deg, "deg", -90.0..=90.0)?;
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let forward = Vec3::from_azimuth_elevation_deg(azimuth_deg, elevation_deg);
        let right = Vec3::new(cos_a, -sin_a, 0.0);
        Ok(Self {
            width,
            height,
            fov_deg,
            azimuth_deg,
            elevation_deg,
            forward,
            right,
            up: right.cross(forward),
            focal_px: 0.5 * width as f64 / (0.5 * fov_deg).to_radians().tan(),
        })
    }
}

impl Sensor for Perspective {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let x = column as f64 + u - 0.5 * self.width as f64;
        let y = 0.5 * self.height as f64 - (row as f64 + v);
        Some((self.forward * self.focal_px + self.right * x + self.up * y).normalized())
    }

    fn pixel_of(&self, direction: Vec3) -> Option<(f64, f64)> {
        let depth = direction.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let scale = self.focal_px / depth;
        let x = 0.5 * self.width as f64 + scale * direction.dot(self.right);
        let y = 0.5 * self.height as f64 - scale * direction.dot(self.up);
        let inside = |p: f64, size: usize| (-1e-9..=size as f64 + 1e-9).contains(&p);
        (inside(x, self.width) && inside(y, self.height)).then_some((x, y))
    }

    fn description(&self) -> Vec<(String, String)> {
        vec![
            entry("projection", "perspective"),
            entry("fov_deg", self.fov_deg),
            entry("look_azimuth_deg", self.azimuth_deg),
            entry("look_elevation_deg", self.elevation_deg),
            entry(
                "north",
                format!(
                    "the middle looks {} deg clockwise from north; azimuth grows to the right",
                    self.azimuth_deg
                ),
            ),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_lie_half_the_angle_from_the_middle() {
        let s = Perspective::new(200, 100, 90.0, 180.0, 0.0).unwrap();
        let look = |column, row| {
            s.direction(column, row, 0.0, 0.0)
                .unwrap()
                .to_azimuth_elevation_deg()
        };
        let (a, e) = look(100, 50);
        assert!((a - 180.0).abs() < 1e-12 && e.abs() < 1e-12);
        // Facing south, west is on the right.
        let (a, e) = look(200, 50);
        assert!((a - 225.0).abs() < 1e-12 && e.abs() < 1e-12);
        let (a, e) = look(100, 0);
        assert!((a - 180.0).abs() < 1e-12 && (e - 0.5f64.atan().to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn straight_up_keeps_the_facing() {
        let s = Perspective::new(10, 10, 90.0, 0.0, 90.0).unwrap();
        let middle = s.direction(5, 5, 0.0, 0.0).unwrap();
        assert!((middle.z - 1.0).abs() < 1e-15);
        let right = s.direction(10, 5, 0.0, 0.0).unwrap();
        let top = s.direction(5, 0, 0.0, 0.0).unwrap();
        let half = 0.5f64.sqrt();
        assert!((right - Vec3::new(half, 0.0, half)).length() < 1e-15);
        assert!((top - Vec3::new(0.0, -half, half)).length() < 1e-15);
    }

    #[test]
    fn what_is_behind_or_outside_has_no_pixel() {
        let s = Perspective::new(10, 10, 60.0, 90.0, 0.0).unwrap();
        assert!(s.pixel_of(Vec3::new(-1.0, 0.0, 0.0)).is_none());
        assert!(s.pixel_of(Vec3::new(0.0, 1.0, 0.0)).is_none());
        assert!(s
            .pixel_of(Vec3::from_azimuth_elevation_deg(115.0, 0.0))
            .is_some());
    }

    #[test]
    fn angles_are_checked() {
        for fov in [0.0, 180.0, -3.0, f64::NAN] {
            assert!(Perspective::new(4, 4, fov, 0.0, 0.0).is_err());
        }
        assert!(Perspective::new(4, 4, 60.0, f64::NAN, 0.0).is_err());
        assert!(Perspective::new(4, 4, 60.0, 0.0, 91.0).is_err());
    }
}
