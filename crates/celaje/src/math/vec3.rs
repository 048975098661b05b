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
        self.turned(cos_theta, phi.sin_cos())
    }

    /// The same, turned by `turn` of a full circle, in [0, 1].
    #[inline(always)]
    pub fn deflected_by_turn(self, cos_theta: f64, turn: f64) -> Self {
        self.turned(cos_theta, sin_cos_of_turn(turn))
    }

    #[inline(always)]
    fn turned(self, cos_theta: f64, (sin_phi, cos_phi): (f64, f64)) -> Self {
        let (t, b) = self.tangents();
        let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
        let v = self * cos_theta + t * (sin_theta * cos_phi) + b * (sin_theta * sin_phi);
        // One step of Newton's towards length 1, from which rounding has moved it.
        v * (1.5 - 0.5 * v.dot(v))
    }
}

/// Sine and cosine of `turn` · 2π, `turn` in [0, 1], to 2e-10.
#[inline(always)]
fn sin_cos_of_turn(turn: f64) -> (f64, f64) {
    // Added, this leaves no bits for a fraction and the whole number in the lowest ones.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let shifted = 4.0 * turn + MAGIC;
    let (bits, quarter) = (shifted.to_bits(), shifted - MAGIC);
    let x = std::f64::consts::TAU * (turn - 0.25 * quarter);
    let x2 = x * x;
    // Taylor's series for |x| ≤ π/4; the first terms left out are 7e-12 and 1.2e-10.
    let sin = -1.0 / 39_916_800.0;
    let sin = 1.0 / 362_880.0 + x2 * sin;
    let sin = -1.0 / 5040.0 + x2 * sin;
    let sin = 1.0 / 120.0 + x2 * sin;
    let sin = x + x * x2 * (-1.0 / 6.0 + x2 * sin);
    let cos = -1.0 / 3_628_800.0;
    let cos = 1.0 / 40_320.0 + x2 * cos;
    let cos = -1.0 / 720.0 + x2 * cos;
    let cos = 1.0 / 24.0 + x2 * cos;
    let cos = 1.0 + x2 * (-0.5 + x2 * cos);
    // By the quarter: (sin, cos), (cos, −sin), (−sin, −cos), (−cos, sin); chosen without a branch, which nobody could foresee.
    let odd = bits & 1 == 1;
    let (s, c) = if odd { (cos, sin) } else { (sin, cos) };
    let negative = |v: f64, yes: u64| f64::from_bits(v.to_bits() ^ (yes << 63));
    (negative(s, bits >> 1 & 1), negative(c, (bits + 1) >> 1 & 1))
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
    fn turns_are_sines_and_cosines() {
        for i in 0..=10_000 {
            let turn = f64::from(i) / 10_000.0;
            let (sin, cos) = sin_cos_of_turn(turn);
            let (s, c) = (std::f64::consts::TAU * turn).sin_cos();
            assert!((sin - s).abs() < 2e-10 && (cos - c).abs() < 2e-10, "{turn}");
        }
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
