//! What each wavelength carries along a path, and the decisions drawn from it.
//!
//! No wavelength is the hero of a path. Every decision (which species scatters, where to) is drawn from the mean of the
//! wavelengths' own probabilities, each weighted by what it carries, and every weight is divided by that mean: the one-sample
//! balance heuristic over hero wavelengths (Wilkie et al. 2014, doi:10.1111/cgf.12419), with the hero redrawn at every event
//! and summed over analytically. Weights stay bounded and their sum changes only by absorption.

use crate::math::lanes::{self, Block, BLOCK};
use crate::math::Vec3;
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
    /// Their sums over blocks.
    pub split_sums: Vec<Block>,
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
            split_sums: vec![[0.0; BLOCK]; species],
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
            self.split_sums[k] = lanes::sum_of_blocks(row);
            self.split_sum[k] = lanes::tree_sum(self.split_sums[k]);
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
        let new = self.draw(medium, direction, u);
        self.mix_phases(medium, direction.dot(new));
        let density = lanes::sum(&self.light) / self.total;
        self.leave(density);
        new
    }

    /// A direction from the mean of all wavelengths' phase functions.
    #[inline(always)]
    pub fn draw<M: Medium>(&self, medium: &M, direction: Vec3, u: [f64; 3]) -> Vec3 {
        let n = self.weight.len();
        // One species and one wavelength, by what they carry; which ones is then forgotten.
        let mut target = u[0] as f32 * self.total;
        let mut species = 0;
        for (k, &sum) in self.split_sum.iter().enumerate() {
            if sum > 0.0 {
                species = k;
                if target < sum {
                    break;
                }
                target -= sum;
            }
        }
        let split = &self.split[species * n..(species + 1) * n];
        let lane = lanes::pick_by(split, &self.split_sums[species], target);
        let cos_theta = medium.phases()[species].sample(lane, u[1]);
        direction.deflected_by_turn(cos_theta, u[2])
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
