//! The scattering angles at which phase functions are tabulated.

use std::f64::consts::PI;

/// Scattering angles from 0° to 180°, symmetric about 90°, at which phase functions are tabulated.
///
/// Between nodes a phase function is **linear in `cos θ`**: evaluation, sampling and normalisation all use that.
/// The symmetry halves the work of the Mie series.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleGrid {
    theta_deg: Vec<f64>,
    cos_theta: Vec<f64>,
}

impl AngleGrid {
    /// Steps of `first_deg + growth · θ`, but at most `largest_deg`, from 0° to 90°, and their mirror image.
    ///
    /// Steps that grow in proportion to `θ` follow the power law of a diffraction peak with constant relative error; the
    /// first one resolves its rounded top.
    fn graded(first_deg: f64, growth: f64, largest_deg: f64) -> Self {
        let mut forward = vec![0.0];
        let mut theta = 0.0;
        while theta < 90.0 {
            theta += (first_deg + growth * theta).min(largest_deg);
            forward.push(theta);
        }
        // Stretch a little, so that the last node falls on 90°.
        let stretch = 90.0 / theta;
        forward.iter_mut().for_each(|t| *t *= stretch);
        Self::mirrored(&forward)
    }

    /// Steps of 15°, for when only cross sections are wanted: far too coarse for a phase function.
    pub fn coarse() -> Self {
        Self::graded(15.0, 0.0, 15.0)
    }

    /// The grid with an extra node in the middle of each interval: to measure what interpolation costs.
    pub fn refined(&self) -> Self {
        let half = &self.theta_deg[..self.theta_deg.len() / 2 + 1];
        let mut forward = vec![0.0];
        for pair in half.windows(2) {
            forward.push(0.5 * (pair[0] + pair[1]));
            forward.push(pair[1]);
        }
        Self::mirrored(&forward)
    }

    /// From angles from 0° to 90°, both included.
    fn mirrored(forward_deg: &[f64]) -> Self {
        let last = forward_deg.len() - 1;
        let mut theta_deg = forward_deg.to_vec();
        theta_deg[last] = 90.0;
        let mut cos_theta: Vec<f64> = theta_deg.iter().map(|t| t.to_radians().cos()).collect();
        cos_theta[last] = 0.0;
        for i in (0..last).rev() {
            theta_deg.push(180.0 - theta_deg[i]);
            cos_theta.push(-cos_theta[i]);
        }
        Self {
            theta_deg,
            cos_theta,
        }
    }

    /// Scattering angles \[deg\], from 0 to 180.
    pub fn theta_deg(&self) -> &[f64] {
        &self.theta_deg
    }

    /// Their cosines, from 1 to -1.
    pub fn cos_theta(&self) -> &[f64] {
        &self.cos_theta
    }

    /// Cosines of the angles up to and including 90°.
    pub(super) fn forward_cos_theta(&self) -> &[f64] {
        &self.cos_theta[..self.cos_theta.len() / 2 + 1]
    }

    /// Integral over the sphere of a function of `θ` given at the nodes, linear in `cos θ` between them.
    pub fn sphere_integral(&self, value: &[f64]) -> f64 {
        let panels = self.cos_theta.windows(2).zip(value.windows(2));
        2.0 * PI
            * panels
                .map(|(mu, v)| (mu[0] - mu[1]) * 0.5 * (v[0] + v[1]))
                .sum::<f64>()
    }
}

impl Default for AngleGrid {
    /// 463 angles, 0.003° apart at the forward peak and 0.8° at the side.
    ///
    /// Between them interpolation errs by at most 0.42 % (the desert's forward peak, at 0.14°) in the lowest layer of
    /// all twenty aerosol types, at 380 and 600 nm and, for OPAC, 0, 80 and 99 % humidity. A rainbow of nothing but coarse
    /// sea salt is the worst seen: 7 % at 138°, 99 % humidity and 380 nm.
    fn default() -> Self {
        Self::graded(0.003, 0.04, 0.8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_is_symmetric_and_spans_the_sphere() {
        let grid = AngleGrid::default();
        let (theta, mu) = (grid.theta_deg(), grid.cos_theta());
        let n = theta.len();
        assert_eq!((theta[0], theta[n / 2], theta[n - 1]), (0.0, 90.0, 180.0));
        assert!(mu.windows(2).all(|w| w[0] > w[1]));
        assert!((0..n).all(|i| mu[i] == -mu[n - 1 - i]));
        assert!((grid.sphere_integral(&vec![1.0; n]) - 4.0 * PI).abs() < 1e-12);
        assert!(grid.sphere_integral(mu).abs() < 1e-12);
    }
}
