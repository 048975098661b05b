//! At which wavelengths multiple scattering is solved well, and how it is carried over to the others.
//!
//! A rough solution (few harmonics, few heights and directions) exists at all wavelengths and knows every band and edge. The
//! good one exists at a few only. Their ratio is close to 1 and smooth: not in wavelength alone, for in an absorption band
//! light scatters less often, but in wavelength, absorption and albedo together. In the space of these three it is interpolated
//! by kriging (Gaussian-process regression) with a squared-exponential covariance, and the wavelengths solved are those
//! that know least of each other.

use crate::medium::{LayeredMedium, Medium};

/// Distance in wavelength over which the ratio of the two solutions varies \[nm\].
const REACH_NM: f64 = 100.0;

/// The same in the square root of the absorption optical depth, and in albedo.
const REACH_ROOT_DEPTH: f64 = 0.4;
const REACH_ALBEDO: f64 = 0.5;

/// Variance of each value itself, against that of the ratio: keeps the weights small.
const NUGGET: f64 = 1e-7;

/// Carries rows over from a choice of wavelengths to all of them.
#[derive(Debug, Clone)]
pub struct Spread {
    chosen: Vec<usize>,
    /// Weights of the chosen ones, shape (c, w).
    weights: Vec<f32>,
}

impl Spread {
    /// * `albedo` — of the ground, shape (w,); `chosen` — indices of the wavelengths solved, increasing
    pub fn new(medium: &LayeredMedium, albedo: &[f64], chosen: &[usize]) -> Self {
        let at = places(medium, albedo);
        let factor = factorise(&at, chosen);
        let solve = |rhs: &[f64]| back_substitute(&factor, rhs);
        let ones = solve(&vec![1.0; chosen.len()]);
        let sum_of_ones: f64 = ones.iter().sum();
        let w = at.len();
        let mut weights = vec![0.0; chosen.len() * w];
        for i in 0..w {
            let near: Vec<f64> = chosen.iter().map(|&j| covariance(at[i], at[j])).collect();
            let plain = solve(&near);
            // Ordinary kriging: the weights add up to 1, so that a constant comes back exactly.
            let missing = (1.0 - plain.iter().sum::<f64>()) / sum_of_ones;
            for (j, (p, o)) in plain.iter().zip(&ones).enumerate() {
                weights[j * w + i] = (p + missing * o) as f32;
            }
        }
        Self {
            chosen: chosen.to_vec(),
            weights,
        }
    }

    /// `out += rough · (few / rough)`, the ratio interpolated.
    ///
    /// * `few` — values at the chosen wavelengths; `rough` — values at all
    #[inline(always)]
    pub fn add(&self, few: &[f32], rough: &[f32], ratio: &mut [f32], out: &mut [f32]) {
        let w = self.weights.len() / self.chosen.len();
        ratio.fill(0.0);
        for ((&f, &i), weights) in few
            .iter()
            .zip(&self.chosen)
            .zip(self.weights.chunks_exact(w))
        {
            let here = if rough[i] > 0.0 { f / rough[i] } else { 0.0 };
            for (r, &weight) in ratio.iter_mut().zip(weights) {
                *r += weight * here;
            }
        }
        for ((o, &c), &r) in out.iter_mut().zip(rough).zip(ratio.iter()) {
            *o += c * r;
        }
    }

    /// What [`Spread::add`] is for the radiance, for a component of its polarisation, which changes sign: its share of the radiance
    /// is that of the rough solution and the difference of both, interpolated.
    ///
    /// * `few`, `rough` — radiance and component
    /// * `ratio` — as [`Spread::add`] left it for the radiance; `share` — a row to work on
    #[inline(always)]
    pub fn add_component(
        &self,
        few: [&[f32]; 2],
        rough: [&[f32]; 2],
        ratio: &[f32],
        share: &mut [f32],
        out: &mut [f32],
    ) {
        let w = self.weights.len() / self.chosen.len();
        let of = |part: f32, all: f32| if all > 0.0 { part / all } else { 0.0 };
        share.fill(0.0);
        for ((k, &i), weights) in self
            .chosen
            .iter()
            .enumerate()
            .zip(self.weights.chunks_exact(w))
        {
            let here = of(few[1][k], few[0][k]) - of(rough[1][i], rough[0][i]);
            for (s, &weight) in share.iter_mut().zip(weights) {
                *s += weight * here;
            }
        }
        let rough = rough[0].iter().zip(rough[1]);
        for ((o, (&all, &part)), (&r, &s)) in
            out.iter_mut().zip(rough).zip(ratio.iter().zip(&*share))
        {
            *o += r * (part + all * s);
        }
    }
}

/// Which wavelengths to solve well, at most `most`: each next one is the one least known from those before.
pub fn choose(medium: &LayeredMedium, albedo: &[f64], most: usize) -> Vec<usize> {
    let at = places(medium, albedo);
    let w = at.len();
    if w <= most {
        return (0..w).collect();
    }
    // A Cholesky factorisation that takes the largest pivot left; pivots are the variances still unknown.
    let mut unknown = vec![1.0f64; w];
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let next = (0..w).max_by(|&a, &b| unknown[a].total_cmp(&unknown[b]));
        let Some(next) = next.filter(|&i| unknown[i] > 0.0) else {
            break;
        };
        let root = (unknown[next] + NUGGET).sqrt();
        let row: Vec<f64> = (0..w)
            .map(|i| {
                let known: f64 = rows.iter().map(|r| r[i] * r[next]).sum();
                (covariance(at[i], at[next]) - known) / root
            })
            .collect();
        for (u, r) in unknown.iter_mut().zip(&row) {
            *u -= r * r;
        }
        unknown[next] = f64::NEG_INFINITY;
        rows.push(row);
        chosen.push(next);
    }
    chosen.sort_unstable();
    chosen
}

/// Where each wavelength stands among the things on which the ratio depends, in units of their reach.
fn places(medium: &LayeredMedium, albedo: &[f64]) -> Vec<[f64; 3]> {
    let nm = medium.wavelength_nm().iter().zip(albedo).enumerate();
    nm.map(|(lane, (nm, albedo))| {
        let scattering = medium.vertical_scattering_depth(lane);
        let absorption = (medium.vertical_optical_depth(lane) - scattering).max(0.0);
        [
            nm / REACH_NM,
            absorption.sqrt() / REACH_ROOT_DEPTH,
            albedo / REACH_ALBEDO,
        ]
    })
    .collect()
}

fn covariance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (-0.5 * apart).exp()
}

/// Cholesky's lower triangle of the covariances, row by row.
fn factorise(at: &[[f64; 3]], chosen: &[usize]) -> Vec<Vec<f64>> {
    let mut lower: Vec<Vec<f64>> = Vec::with_capacity(chosen.len());
    for (i, &a) in chosen.iter().enumerate() {
        let mut row = Vec::with_capacity(i + 1);
        for (j, &b) in chosen[..=i].iter().enumerate() {
            let other: &[f64] = if j < i { &lower[j] } else { &row };
            let known: f64 = row.iter().zip(other).take(j).map(|(x, y)| x * y).sum();
            let left = covariance(at[a], at[b]) - known;
            row.push(if j < i {
                left / lower[j][j]
            } else {
                (left + NUGGET).max(NUGGET).sqrt()
            });
        }
        lower.push(row);
    }
    lower
}

/// Solves `L Lᵀ x = rhs`.
fn back_substitute(lower: &[Vec<f64>], rhs: &[f64]) -> Vec<f64> {
    let mut x = rhs.to_vec();
    for i in 0..x.len() {
        let known: f64 = (0..i).map(|j| lower[i][j] * x[j]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    for i in (0..x.len()).rev() {
        let known: f64 = (i + 1..x.len()).map(|j| lower[j][i] * x[j]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Phase;

    /// Rationale: absorption bands and edges of the ground must not leak into the wavelengths beside them. Expected: a ratio
    /// that depends smoothly on wavelength, and steeply but smoothly on absorption, comes back within 0.2 % everywhere from
    /// 16 of 81 wavelengths; without a place in absorption it would be off by the dip itself, 5 %.
    #[test]
    fn bands_stay_where_they_are() {
        let nm: Vec<f64> = (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect();
        let mut medium = LayeredMedium::new(&[0.0, 1e4], &nm, 6.36e6).unwrap();
        let sigma_s: Vec<f64> = nm.iter().map(|l| 1e-5 * (550.0 / l).powi(4)).collect();
        let depth = |l: f64| {
            let band = |at: f64, depth: f64| if (l - at).abs() < 4.0 { depth } else { 0.0 };
            band(760.0, 0.3) + band(720.0, 0.1) + band(725.0, 0.06) + band(690.0, 0.05)
        };
        let sigma_a: Vec<f64> = nm.iter().map(|&l| depth(l) / 1e4).collect();
        let phase = Phase::rayleigh(&[0.03; 81]).unwrap();
        medium
            .add(&sigma_s.repeat(2), &sigma_a.repeat(2), phase)
            .unwrap();
        let albedo = [0.2; 81];
        let chosen = choose(&medium, &albedo, 16);
        assert_eq!(chosen.len(), 16);
        assert!(chosen.windows(2).all(|p| p[0] < p[1]));

        let spread = Spread::new(&medium, &albedo, &chosen);
        let ratio =
            |l: f64| (1.0 + 0.1 * ((l - 500.0) / 200.0).powi(3)) * (1.0 - 0.1 * depth(l).sqrt());
        let rough: Vec<f32> = nm.iter().map(|&l| (1.0 - 2.0 * depth(l)) as f32).collect();
        let few: Vec<f32> = chosen
            .iter()
            .map(|&i| rough[i] * ratio(nm[i]) as f32)
            .collect();
        let (mut out, mut scratch) = (vec![0.0; 81], vec![0.0; 81]);
        spread.add(&few, &rough, &mut scratch, &mut out);
        for (i, &o) in out.iter().enumerate() {
            let off = f64::from(o) / f64::from(rough[i]) / ratio(nm[i]) - 1.0;
            assert!(off.abs() < 2e-3, "{} nm: {off:+.5}", nm[i]);
        }
    }
}
