//! What each wavelength carries along a path, and the decisions drawn from it.
//!
//! No wavelength is the hero of a path. Every decision (which species scatters, where to) is drawn from the mean of the
//! wavelengths' own probabilities, each weighted by what it carries, and every weight is divided by that mean: the one-sample
//! balance heuristic over hero wavelengths (Wilkie et al. 2014, doi:10.1111/cgf.12419), with the hero redrawn at every event
//! and summed over analytically. Weights stay bounded and their sum changes only by absorption.

use crate::math::{lanes, Vec3};
use crate::medium::Medium;

/// Weights of one path, and the rows it works on.
pub(super) struct Weights {
    /// What each wavelength carries.
    pub weight: Vec<f32>,
    /// Sum of the weights.
    pub total: f32,
    /// Weights at a scattering vertex split by species, shape (species, lanes), and their sums.
    pub split: Vec<f32>,
    pub split_sum: Vec<f32>,
    /// A row for light on its way to the result.
    pub light: Vec<f32>,
    pub scratch: Vec<f32>,
}

impl Weights {
    pub fn new<M: Medium>(medium: &M) -> Self {
        let (lanes, species) = (medium.lanes(), medium.phases().len());
        Self {
            weight: vec![0.0; lanes],
            total: 0.0,
            split: vec![0.0; lanes * species],
            split_sum: vec![0.0; species],
            light: vec![0.0; lanes],
            scratch: vec![0.0; lanes],
        }
    }

    /// Splits the weights, times σ_s, over the species present at a scattering vertex.
    #[inline(always)]
    pub fn split_by_species<M: Medium>(&mut self, medium: &M, at: Vec3) {
        let n = self.weight.len();
        self.total = 0.0;
        for (k, row) in self.split.chunks_exact_mut(n).enumerate() {
            medium.species_scattering(k, at, row);
            for (v, &w) in row.iter_mut().zip(&self.weight) {
                *v *= w;
            }
            self.split_sum[k] = lanes::sum(row);
            self.total += self.split_sum[k];
        }
    }

    /// `light = Σ_k split_k p_k(cos θ)` over the species present.
    #[inline(always)]
    pub fn mix_phases<M: Medium>(&mut self, medium: &M, cos_theta: f64) {
        let n = self.weight.len();
        self.light.fill(0.0);
        for (k, phase) in medium.phases().iter().enumerate() {
            if self.split_sum[k] > 0.0 {
                phase.eval(cos_theta, &mut self.scratch);
                let split = &self.split[k * n..(k + 1) * n];
                for ((l, &p), &s) in self.light.iter_mut().zip(&self.scratch).zip(split) {
                    *l += p * s;
                }
            }
        }
    }

    /// Draws a direction from the mean of all wavelengths' phase functions and divides the weights by that mean.
    ///
    /// `u` — three numbers uniform in [0, 1): who decides, the angle, the turn about the old direction.
    #[inline(always)]
    pub fn scatter<M: Medium>(&mut self, medium: &M, direction: Vec3, u: [f64; 3]) -> Vec3 {
        let new = self.draw_about(medium, direction, u);
        self.mix_phases(medium, direction.dot(new));
        let density = lanes::sum(&self.light) / self.total;
        self.leave(density);
        new
    }

    /// As [`Weights::scatter`], but a share of the directions is drawn about the sun instead of the old direction.
    ///
    /// The next vertex sees the sun through its phase function, whose peak a path would rarely meet by itself: drawing
    /// the direction from that peak first makes both vertices' peaks common. The density is that of the mixture, so the
    /// estimate stays unbiased whatever the share.
    #[inline(always)]
    pub fn scatter_with_sun<M: Medium>(
        &mut self,
        medium: &M,
        direction: Vec3,
        towards_sun: Vec3,
        share: f64,
        u: [f64; 3],
    ) -> Vec3 {
        let about_sun = u[0] < share;
        let (axis, u0) = if about_sun {
            (towards_sun, u[0] / share)
        } else {
            (direction, (u[0] - share) / (1.0 - share))
        };
        let new = self.draw_about(medium, axis, [u0, u[1], u[2]]);
        self.mix_phases(medium, towards_sun.dot(new));
        let about_sun = lanes::sum(&self.light) / self.total;
        self.mix_phases(medium, direction.dot(new));
        let about_old = lanes::sum(&self.light) / self.total;
        self.leave(share as f32 * about_sun + (1.0 - share as f32) * about_old);
        new
    }

    /// A direction about an axis from the mean of all wavelengths' phase functions.
    #[inline(always)]
    fn draw_about<M: Medium>(&self, medium: &M, axis: Vec3, u: [f64; 3]) -> Vec3 {
        let n = self.weight.len();
        // One species and one wavelength, by what they carry; which ones is then forgotten.
        let chosen = lanes::pick(&self.split, u[0] as f32 * self.total);
        let cos_theta = medium.phases()[chosen / n].sample(chosen % n, u[1]);
        axis.deflected(cos_theta, std::f64::consts::TAU * u[2])
    }

    /// Goes on with what `light` holds, divided by the density of the direction.
    #[inline(always)]
    fn leave(&mut self, density: f32) {
        // A density of zero (a hole in a table, met by rounding) ends the path.
        let scale = if density > 0.0 { 1.0 / density } else { 0.0 };
        for (w, &l) in self.weight.iter_mut().zip(&self.light) {
            *w = l * scale;
        }
        self.total = lanes::sum(&self.weight);
    }
}
