//! Vectors in three dimensions, f64.

use std::ops::{Add, Mul, Neg, Sub};

/// A vector or a point; x east, y north, z up in an observer's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Vec3 {
    /// East.
    pub x: f64,
    /// North.
    pub y: f64,
    /// Up.
    pub z: f64,
}

impl Vec3 {
    /// A vector from its components.
    #[inline(always)]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { x, y, z }
    }

    /// The unit vector towards an azimuth (clockwise from north) and an elevation, both in degrees.
    pub fn from_azimuth_elevation_deg(azimuth_deg: f64, elevation_deg: f64) -> Self {
        let (sin_a, cos_a) = azimuth_deg.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation_deg.to_radians().sin_cos();
        Self::new(sin_a * cos_e, cos_a * cos_e, sin_e)
    }

    /// Azimuth clockwise from north in [0, 360) and elevation, in degrees.
    pub fn to_azimuth_elevation_deg(self) -> (f64, f64) {
        let azimuth = self.x.atan2(self.y).to_degrees().rem_euclid(360.0);
        let elevation = self.z.atan2(self.x.hypot(self.y)).to_degrees();
        (azimuth, elevation)
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> f64 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }

    /// Length.
    #[inline(always)]
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// The vector of length 1 in the same direction.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        self * (1.0 / self.length())
    }

    /// Two unit vectors that complete this unit vector to a right-handed frame (Duff et al. 2017, JCGT 6).
    #[inline(always)]
    pub fn tangents(self) -> (Self, Self) {
        let sign = 1f64.copysign(self.z);
        let a = -1.0 / (sign + self.z);
        let b = self.x * self.y * a;
        (
            Self::new(1.0 + sign * self.x * self.x * a, sign * b, -sign * self.x),
            Self::new(b, sign + self.y * self.y * a, -self.y),
        )
    }

    /// The unit vector at an angle to this unit vector whose cosine is `cos_theta`, turned by `phi` radians.
    #[inline(always)]
    pub fn deflected(self, cos_theta: f64, phi: f64) -> Self {
        let (t, b) = self.tangents();
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let (sin_phi, cos_phi) = phi.sin_cos();
        (self * cos_theta + t * (sin_theta * cos_phi) + b * (sin_theta * sin_phi)).normalized()
    }
}

impl Add for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl Sub for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f64) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl Neg for Vec3 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_runs_clockwise_from_north() {
        let east = Vec3::from_azimuth_elevation_deg(90.0, 0.0);
        assert!((east.x - 1.0).abs() < 1e-15 && east.y.abs() < 1e-15);
        let (azimuth, elevation) =
            Vec3::from_azimuth_elevation_deg(237.0, -12.5).to_azimuth_elevation_deg();
        assert!((azimuth - 237.0).abs() < 1e-12 && (elevation + 12.5).abs() < 1e-12);
    }

    #[test]
    fn deflected_keeps_the_angle() {
        for axis in [
            Vec3::new(0.0, 0.0, -1.0),
            Vec3::new(0.6, -0.8, 0.0),
            Vec3::new(0.1, 0.2, 0.3).normalized(),
        ] {
            let d = axis.deflected(-0.3, 1.2);
            assert!((d.dot(axis) + 0.3).abs() < 1e-14 && (d.length() - 1.0).abs() < 1e-14);
        }
    }
}
