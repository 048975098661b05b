//! The equidistant fisheye: distance from the middle proportional to the angle from the zenith.

use super::{check_size, entry, Sensor};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// The sky as seen lying on one's back: zenith in the middle, north up, east *left*.
///
/// A picture point at `(x, y)` pixels right of and above the middle looks at the zenith angle
/// `θ = (fov / 2) · √(x² + y²) / R`, `R` half the shorter side, and at the azimuth `atan2(−x, y)`. Outside the disc
/// of radius `R` the sensor sees nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Fisheye {
    width: usize,
    height: usize,
    fov_deg: f64,
}

impl Fisheye {
    /// A fisheye of `width` × `height` pixels whose disc spans the full cone `fov_deg` \[deg\], in (0, 360]; 180 is
    /// the sky down to the horizon, 360 the whole sphere.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the cone, [`Error::Invalid`] for a picture without pixels.
    pub fn new(width: usize, height: usize, fov_deg: f64) -> Result<Self> {
        check_size(width, height)?;
        if !(fov_deg > 0.0 && fov_deg <= 360.0) {
            return Err(Error::out_of_range("fov", fov_deg, "deg", "(0, 360]"));
        }
        Ok(Self {
            width,
            height,
            fov_deg,
        })
    }

    fn radius_px(&self) -> f64 {
        0.5 * self.width.min(self.height) as f64
    }
}

impl Sensor for Fisheye {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let x = (column as f64 + u - 0.5 * self.width as f64) / self.radius_px();
        let y = (0.5 * self.height as f64 - (row as f64 + v)) / self.radius_px();
        let r = x.hypot(y);
        if r > 1.0 {
            return None;
        }
        if r == 0.0 {
            return Some(Vec3::new(0.0, 0.0, 1.0));
        }
        let (sin_theta, cos_theta) = (r * 0.5 * self.fov_deg.to_radians()).sin_cos();
        // East is to the left: a step right is a step west.
        Some(Vec3::new(-sin_theta * x / r, sin_theta * y / r, cos_theta))
    }

    fn pixel_of(&self, direction: Vec3) -> Option<(f64, f64)> {
        let horizontal = direction.x.hypot(direction.y);
        let r = horizontal.atan2(direction.z) / (0.5 * self.fov_deg.to_radians());
        if r > 1.0 + 1e-12 {
            return None;
        }
        // The nadir of a 360° picture is its whole rim; the upper end stands for it.
        let (x, y) = if horizontal > 0.0 {
            (-direction.x / horizontal, direction.y / horizontal)
        } else {
            (0.0, 1.0)
        };
        let r_px = r * self.radius_px();
        Some((
            0.5 * self.width as f64 + r_px * x,
            0.5 * self.height as f64 - r_px * y,
        ))
    }

    fn description(&self) -> Vec<(String, String)> {
        vec![
            entry("projection", "fisheye, equidistant, zenith in the middle"),
            entry("fov_deg", self.fov_deg),
            entry("north", "up; east is left"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn azimuth_elevation(s: &Fisheye, column: usize, row: usize, u: f64, v: f64) -> (f64, f64) {
        s.direction(column, row, u, v)
            .unwrap()
            .to_azimuth_elevation_deg()
    }

    #[test]
    fn zenith_in_the_middle_north_up_east_left() {
        let s = Fisheye::new(101, 101, 180.0).unwrap();
        assert_eq!(
            s.direction(50, 50, 0.5, 0.5).unwrap(),
            Vec3::new(0.0, 0.0, 1.0)
        );
        // 25.25 pixels from the middle is half of the radius: 45° from the zenith.
        let points = [
            (50, 25, 0.5, 0.25, 0.0),
            (25, 50, 0.25, 0.5, 90.0),
            (50, 75, 0.5, 0.75, 180.0),
            (75, 50, 0.75, 0.5, 270.0),
        ];
        for (column, row, u, v, azimuth) in points {
            let (a, e) = azimuth_elevation(&s, column, row, u, v);
            assert!(
                (a - azimuth).abs() < 1e-10 && (e - 45.0).abs() < 1e-10,
                "{a} {e}"
            );
        }
    }

    #[test]
    fn the_rim_is_half_the_cone_and_nothing_lies_beyond() {
        let s = Fisheye::new(64, 64, 200.0).unwrap();
        let (a, e) = azimuth_elevation(&s, 32, 0, 0.0, 0.0);
        assert!(a.abs() < 1e-10 && (e + 10.0).abs() < 1e-10);
        assert!(s.direction(0, 0, 0.5, 0.5).is_none());
        assert!(s
            .pixel_of(Vec3::from_azimuth_elevation_deg(0.0, -10.1))
            .is_none());
        // A wide picture keeps a round disc of the shorter side.
        let wide = Fisheye::new(100, 64, 180.0).unwrap();
        assert!(wide.direction(17, 32, 0.0, 0.0).is_none());
        assert!(wide.direction(18, 32, 0.5, 0.0).is_some());
    }

    #[test]
    fn the_cone_is_checked() {
        for fov in [0.0, -1.0, 360.1, f64::NAN, f64::INFINITY] {
            assert!(Fisheye::new(4, 4, fov).is_err());
        }
        assert!(Fisheye::new(4, 4, 360.0).is_ok());
    }
}
