//! The orders of scattering that are not computed.

use super::field::Solution;
use crate::math::lanes;

/// The orders not computed: each node and wavelength goes on falling in the ratio of its last two orders, so the rest is a
/// geometric series.
pub struct Tail {
    /// The rest over the last order, shape (a, s, lanes).
    moments: Vec<f32>,
    /// The same for the flux, shape (s, lanes).
    flux: Vec<f32>,
}

impl Tail {
    /// Ratios at or above this are those of dark nodes that light has only begun to reach.
    const LARGEST_RATIO: f32 = 0.98;

    pub fn new(before: &Solution, last: &Solution) -> Self {
        let n = last.lanes();
        let row = last.moments_per_node() * n;
        let sum = |before: f32, last: f32| {
            let ratio = if before > 0.0 { last / before } else { 0.0 };
            let ratio = ratio.clamp(0.0, Self::LARGEST_RATIO);
            ratio / (1.0 - ratio)
        };
        let means = before
            .moments
            .chunks_exact(row)
            .zip(last.moments.chunks_exact(row));
        Self {
            moments: means
                .flat_map(|(b, l)| b[..n].iter().zip(&l[..n]).map(|(&b, &l)| sum(b, l)))
                .collect(),
            flux: before
                .flux
                .iter()
                .zip(&last.flux)
                .map(|(&b, &l)| sum(b, l))
                .collect(),
        }
    }

    /// Largest share of the rest in the mean radiance at any node that is not dark.
    pub fn largest(&self, last: &Solution, total: &Solution) -> f32 {
        /// Share of the brightest node below which one is dark.
        const DARK: f32 = 1e-9;
        let n = last.lanes();
        let row = last.moments_per_node() * n;
        let bright = total.moments.chunks_exact(row).map(|t| lanes::sum(&t[..n]));
        let least = DARK * bright.fold(0.0, f32::max);
        let nodes = last
            .moments
            .chunks_exact(row)
            .zip(total.moments.chunks_exact(row));
        nodes
            .zip(self.moments.chunks_exact(n))
            .map(|((l, t), tail)| {
                let all = lanes::sum(&t[..n]);
                if all > least {
                    lanes::dot(&l[..n], tail) / all
                } else {
                    0.0
                }
            })
            .fold(0.0, f32::max)
    }

    pub fn add(&self, last: &Solution, total: &mut Solution) {
        let n = last.lanes();
        let row = last.moments_per_node() * n;
        let nodes = total
            .moments
            .chunks_exact_mut(row)
            .zip(last.moments.chunks_exact(row));
        for ((total, last), tail) in nodes.zip(self.moments.chunks_exact(n)) {
            for (total, last) in total.chunks_exact_mut(n).zip(last.chunks_exact(n)) {
                for ((t, &l), &f) in total.iter_mut().zip(last).zip(tail) {
                    *t += l * f;
                }
            }
        }
        for ((t, &l), &f) in total.flux.iter_mut().zip(&last.flux).zip(&self.flux) {
            *t += l * f;
        }
    }
}
