//! The altitudes between which densities are taken as linear.

use crate::error::{check_range, Error, Result};

/// Altitudes of the nodes, strictly increasing, from the ground to the top of the atmosphere.
///
/// A density is given at the nodes and is linear between them.
#[derive(Debug, Clone, PartialEq)]
pub struct VerticalGrid {
    altitude_m: Vec<f64>,
}

/// (up to this altitude above sea level \[m\], step \[m\]).
///
/// A linear piece of length h overestimates an exponential of scale height H by (h/H)²/12 of itself: aerosols of H = 730 m
/// ask for 25 m, 40 air masses deep as a low sun's path is; with H ≥ 5 km these steps keep the vertical column within 0.01 %, and the densities between nodes within 0.1 %
/// below 25 km, 0.6 % above; halving them changes no radiance by 0.1 % (`tests/reference_sky.rs`).
const STEPS_M: [(f64, f64); 4] = [
    (4_000.0, 25.0),
    (25_000.0, 125.0),
    (60_000.0, 500.0),
    (VerticalGrid::TOP_M, 1_000.0),
];

impl VerticalGrid {
    /// Top of the standard grid above sea level \[m\].
    pub const TOP_M: f64 = 100_000.0;

    /// The standard grid, ground to 100 km: 25 m steps below 4 km, 125 m below 25 km, 500 m below 60 km, 1 km above;
    /// 439 nodes from sea level. Nodes are at multiples of the step, except the ground's own.
    ///
    /// `ground_m` is the ground's altitude above sea level, −500 to 9000.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn standard(ground_m: f64) -> Result<Self> {
        check_range(
            "altitude",
            ground_m,
            "m",
            crate::place::Site::ALTITUDE_RANGE_M,
        )?;
        let mut altitude_m = vec![ground_m];
        let mut below = ground_m;
        for (until, step) in STEPS_M {
            // First multiple of the step that leaves at least half a step to the node below.
            let mut k = (below / step + 0.5).ceil();
            while k * step <= until {
                altitude_m.push(k * step);
                k += 1.0;
            }
            below = altitude_m[altitude_m.len() - 1];
        }
        Self::new(altitude_m)
    }

    /// A grid of one's own.
    ///
    /// `altitude_m` strictly increasing, −500 to 1 000 000, at least two values.
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Invalid`] if not increasing or too short.
    pub fn new(altitude_m: Vec<f64>) -> Result<Self> {
        for &z in &altitude_m {
            check_range("altitude", z, "m", -500.0..=1e6)?;
        }
        if altitude_m.len() < 2 || altitude_m.windows(2).any(|p| p[1] <= p[0]) {
            return Err(Error::invalid(
                "altitudes must increase and be two at least",
                "sort them from the ground up and drop repeated ones",
            ));
        }
        Ok(Self { altitude_m })
    }

    /// The nodes \[m\].
    pub fn altitude_m(&self) -> &[f64] {
        &self.altitude_m
    }
}

/// Vertical column of a density that is linear between nodes: ∫ n dz by trapezia, in the density's unit times m.
pub fn column(altitude_m: &[f64], density: &[f64]) -> f64 {
    altitude_m
        .windows(2)
        .zip(density.windows(2))
        .map(|(z, n)| 0.5 * (z[1] - z[0]) * (n[0] + n[1]))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_at_the_ground_and_ends_at_the_top() {
        for ground in [-430.0, 0.0, 12.3, 1999.0, 3397.0, 8848.86, 9000.0] {
            let grid = VerticalGrid::standard(ground).unwrap();
            let z = grid.altitude_m();
            assert_eq!(z[0], ground);
            assert_eq!(z[z.len() - 1], VerticalGrid::TOP_M);
            // Never a sliver, never a step wider than 1.5 times the region's.
            assert!(z.windows(2).all(|p| p[1] - p[0] >= 12.5), "{ground}");
            assert!(z
                .windows(2)
                .all(|p| p[1] > 25_000.0 || p[1] - p[0] <= 375.0));
        }
        assert_eq!(VerticalGrid::standard(0.0).unwrap().altitude_m().len(), 439);
        assert!(VerticalGrid::standard(f64::NAN).is_err());
        assert!(VerticalGrid::standard(9001.0).is_err());
        assert!(VerticalGrid::new(vec![0.0, 0.0]).is_err());
        assert!(VerticalGrid::new(vec![0.0]).is_err());
    }

    #[test]
    fn column_of_a_linear_density_is_exact() {
        assert_eq!(column(&[0.0, 1.0, 4.0], &[0.0, 1.0, 4.0]), 8.0);
    }
}
