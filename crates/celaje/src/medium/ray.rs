//! Straight rays and the concentric spheres they cross.

use crate::math::Vec3;

/// A ray: all points `origin + s · direction`, s ≥ 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts \[m from the planet's centre\].
    pub origin: Vec3,
    /// Unit vector along which it runs.
    pub direction: Vec3,
}

/// A stretch of a ray, from `start_m` to `end_m` along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Start \[m\].
    pub start_m: f64,
    /// End \[m\].
    pub end_m: f64,
}

impl Ray {
    /// The point at a distance \[m\].
    #[inline(always)]
    pub fn at(&self, distance_m: f64) -> Vec3 {
        self.origin + self.direction * distance_m
    }

    /// Distance to the point nearest the planet's centre \[m\]; negative when that lies behind.
    #[inline(always)]
    pub fn distance_to_tangent_m(&self) -> f64 {
        -self.origin.dot(self.direction)
    }

    /// Square of the smallest distance of the ray's line from the planet's centre \[m²\].
    #[inline(always)]
    pub fn impact_parameter_squared(&self) -> f64 {
        let b = self.origin.dot(self.direction);
        (self.origin.dot(self.origin) - b * b).max(0.0)
    }

    /// Where the ray's line enters and leaves a sphere about the planet's centre, or `None` if it misses it.
    ///
    /// Numerically safe: the constant term is a product of a difference and a sum of radii, and the root that would
    /// cancel comes from the product of both.
    #[inline(always)]
    pub fn sphere(&self, radius_m: f64) -> Option<Span> {
        let b = self.origin.dot(self.direction);
        let r = self.origin.length();
        let c = (r - radius_m) * (r + radius_m);
        let discriminant = b * b - c;
        if discriminant < 0.0 {
            return None;
        }
        let q = -b - discriminant.sqrt().copysign(b);
        let (s0, s1) = if q == 0.0 { (0.0, 0.0) } else { (q, c / q) };
        Some(Span {
            start_m: s0.min(s1),
            end_m: s0.max(s1),
        })
    }

    /// The part of the ray inside the air, and whether the ground ends it. `None` if it meets no air.
    #[inline(always)]
    pub fn through_air(&self, ground_radius_m: f64, top_radius_m: f64) -> Option<(Span, bool)> {
        let top = self.sphere(top_radius_m)?;
        if top.end_m <= 0.0 {
            return None;
        }
        let start_m = top.start_m.max(0.0);
        // A ray that starts on the ground and points up has a root at zero: only a falling ray meets the ground.
        let falling = self.distance_to_tangent_m() > 0.0;
        match self.sphere(ground_radius_m) {
            Some(ground) if falling => {
                let end_m = ground.start_m.max(start_m);
                Some((Span { start_m, end_m }, true))
            }
            _ => Some((
                Span {
                    start_m,
                    end_m: top.end_m,
                },
                false,
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUND: f64 = 6_360_000.0;
    const TOP: f64 = 6_460_000.0;

    fn observer(altitude_m: f64, elevation_deg: f64) -> Ray {
        Ray {
            origin: Vec3::new(0.0, 0.0, GROUND + altitude_m),
            direction: Vec3::from_azimuth_elevation_deg(30.0, elevation_deg),
        }
    }

    #[test]
    fn zenith_ray_crosses_the_whole_air() {
        let (span, ground) = observer(0.0, 90.0).through_air(GROUND, TOP).unwrap();
        assert!(!ground && span.start_m == 0.0 && (span.end_m - 100_000.0).abs() < 1e-6);
    }

    #[test]
    fn horizon_splits_ground_from_sky() {
        // The horizon dips by acos(R / (R + h)) below the horizontal.
        let dip_deg = (GROUND / (GROUND + 100.0)).acos().to_degrees();
        assert!(
            observer(100.0, -dip_deg - 1e-6)
                .through_air(GROUND, TOP)
                .unwrap()
                .1
        );
        assert!(
            !observer(100.0, -dip_deg + 1e-6)
                .through_air(GROUND, TOP)
                .unwrap()
                .1
        );
    }

    #[test]
    fn a_ray_from_space_enters_at_the_top() {
        let (span, ground) = observer(400_000.0, -90.0).through_air(GROUND, TOP).unwrap();
        assert!(ground && (span.start_m - 300_000.0).abs() < 1e-6);
        assert!((span.end_m - 400_000.0).abs() < 1e-6);
        assert!(observer(400_000.0, 10.0).through_air(GROUND, TOP).is_none());
    }

    #[test]
    fn a_point_on_the_ground_looking_down_meets_it_at_once() {
        let (span, ground) = observer(0.0, -5.0).through_air(GROUND, TOP).unwrap();
        assert!(ground && span.end_m < 1e-3);
    }
}
