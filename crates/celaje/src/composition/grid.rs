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
/// Densities at the nodes keep the column of every step ([`keep_columns`]), so a step costs accuracy only by the shape
/// within it: halving all of them changes no radiance by 0.1 % (`tests/reference_sky.rs`). Without that, a linear piece of
/// length h overestimates an exponential of scale height H by (h/H)²/12 of itself, and twice as many nodes would be needed.
const STEPS_M: [(f64, f64); 3] = [
    (4_000.0, 50.0),
    (25_000.0, 250.0),
    (VerticalGrid::TOP_M, 1_000.0),
];

/// Steps this short draw an edge, such as a layer's top \[m\]: what lies between their ends is not looked at.
const EDGE_STEP_M: f64 = 2.5;

impl VerticalGrid {
    /// Top of the standard grid above sea level \[m\].
    pub const TOP_M: f64 = 100_000.0;

    /// The standard grid, ground to 100 km: 50 m steps below 4 km, 250 m below 25 km, 1 km above; 240 nodes from sea
    /// level. Nodes are at multiples of the step, except the ground's own.
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

    /// The nodes and the middles between them \[m\].
    pub(crate) fn with_middles(&self) -> Vec<f64> {
        with_middles(&self.altitude_m)
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

/// Altitudes and the middles between them.
pub(crate) fn with_middles(altitude_m: &[f64]) -> Vec<f64> {
    let mut fine = vec![altitude_m[0]];
    for pair in altitude_m.windows(2) {
        fine.extend([0.5 * (pair[0] + pair[1]), pair[1]]);
    }
    fine
}

/// Densities at the nodes such that what is linear between them has the columns of the true ones.
///
/// `fine` are the true densities at [`with_middles`]. A node is moved by the ratio of the true column (Simpson's rule) to the
/// linear one of its two steps, which is exact for an exponential in even steps, and all of them together by what is left.
pub(crate) fn keep_columns(altitude_m: &[f64], fine: &[f64]) -> Vec<f64> {
    let step = |i: usize| {
        let h = altitude_m[i + 1] - altitude_m[i];
        let [low, middle, high] = [0, 1, 2].map(|k| fine[2 * i + k]);
        let linear = 0.5 * h * (low + high);
        if h <= EDGE_STEP_M {
            (linear, linear)
        } else {
            (h / 6.0 * (low + 4.0 * middle + high), linear)
        }
    };
    let last = altitude_m.len() - 1;
    let steps: Vec<(f64, f64)> = (0..last).map(step).collect();
    let ratio = |parts: &[(f64, f64)]| {
        let (exact, linear) = parts
            .iter()
            .fold((0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1));
        if linear > 0.0 {
            exact / linear
        } else {
            1.0
        }
    };
    let node = |i: usize| fine[2 * i] * ratio(&steps[i.saturating_sub(1)..(i + 1).min(last)]);
    let mut nodes: Vec<f64> = (0..=last).map(node).collect();
    let exact: f64 = steps.iter().map(|s| s.0).sum();
    let now = column(altitude_m, &nodes);
    if now > 0.0 {
        nodes.iter_mut().for_each(|n| *n *= exact / now);
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whatever is exponential keeps the column of every even step, though its steps are long; an edge stays an edge.
    #[test]
    fn columns_of_every_step_are_kept() {
        let scale_m = 800.0;
        let z: Vec<f64> = (0..=40).map(|i| f64::from(i) * 100.0).collect();
        let true_column = |a: f64, b: f64| scale_m * ((-a / scale_m).exp() - (-b / scale_m).exp());
        let fine: Vec<f64> = with_middles(&z)
            .iter()
            .map(|z| (-z / scale_m).exp())
            .collect();
        let kept = keep_columns(&z, &fine);
        for i in 0..40 {
            let ours = column(&z[i..=i + 1], &kept[i..=i + 1]);
            let error = ours / true_column(z[i], z[i + 1]) - 1.0;
            assert!(error.abs() < 1e-6, "{i}: {error:e}");
        }
        let z = [0.0, 1000.0, 1999.0, 2001.0, 3000.0];
        let slab = |z: &f64| if *z <= 2000.0 { 1.0 } else { 0.0 };
        let fine: Vec<f64> = with_middles(&z).iter().map(slab).collect();
        assert_eq!(keep_columns(&z, &fine), [1.0, 1.0, 1.0, 0.0, 0.0]);
        assert_eq!(keep_columns(&z, &[0.0; 9]), [0.0; 5]);
    }

    #[test]
    fn starts_at_the_ground_and_ends_at_the_top() {
        for ground in [-430.0, 0.0, 12.3, 1999.0, 3397.0, 8848.86, 9000.0] {
            let grid = VerticalGrid::standard(ground).unwrap();
            let z = grid.altitude_m();
            assert_eq!(z[0], ground);
            assert_eq!(z[z.len() - 1], VerticalGrid::TOP_M);
            // Never a sliver, never a step wider than 1.5 times the region's.
            assert!(z.windows(2).all(|p| p[1] - p[0] >= 25.0), "{ground}");
            assert!(z
                .windows(2)
                .all(|p| p[1] > 25_000.0 || p[1] - p[0] <= 375.0));
        }
        assert_eq!(VerticalGrid::standard(0.0).unwrap().altitude_m().len(), 240);
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
