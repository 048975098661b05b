//! Moments of the diffuse radiance over altitude and sun angle: what the solver solves for.

use super::harmonics;
use crate::error::{Error, Result};
use crate::math::interp::interval;
use crate::math::lanes;

/// What the solver found, as plain arrays: enough, with the medium and the albedo, to build [`super::Tables`] again.
///
/// Everything is under a sun of unit irradiance above the air \[1 W m⁻² nm⁻¹\]. Rows hold one value per chosen wavelength and
/// are padded with zeros to `lanes` values, a multiple of 16.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Distances of the nodes from the planet's centre \[m\], increasing, the ground first, shape (a,).
    pub radius_m: Vec<f64>,
    /// Sun zenith angles of the nodes \[deg\], increasing, shape (s,).
    pub sun_zenith_deg: Vec<f64>,
    /// Largest degree of the harmonics.
    pub degree: usize,
    /// Which of the medium's wavelengths were solved, as indices, increasing, shape (c,).
    pub chosen: Vec<usize>,
    /// Moments `M_lm = ∫ L Ŷ_lm dω` of the diffuse radiance \[1\], shape (a, s, (degree + 1)(degree + 2)/2, lanes), the
    /// harmonics degree by degree, order from 0.
    pub moments: Vec<f32>,
    /// Diffuse irradiance of the ground \[1\], shape (s, lanes).
    pub flux: Vec<f32>,
}

impl Solution {
    /// Length of a row.
    pub fn lanes(&self) -> usize {
        lanes::padded(self.chosen.len())
    }

    /// Checks shapes, order and values against a medium of `wavelengths` wavelengths.
    ///
    /// # Errors
    /// [`Error::Invalid`], [`Error::ShapeMismatch`].
    pub(super) fn check(&self, wavelengths: usize) -> Result<()> {
        let (a, s, n) = (self.radius_m.len(), self.sun_zenith_deg.len(), self.lanes());
        let rising = |x: &[f64]| x.len() >= 2 && x.windows(2).all(|p| p[0] < p[1]);
        let nodes = rising(&self.radius_m) && rising(&self.sun_zenith_deg);
        let chosen = !self.chosen.is_empty() && self.chosen.windows(2).all(|p| p[0] < p[1]);
        if !nodes || !chosen || self.chosen.iter().any(|&i| i >= wavelengths) {
            return Err(Error::invalid(
                "the nodes of a solution are not in order, or not those of the medium",
                "solve again for this medium",
            ));
        }
        if self.degree > Self::MAX_DEGREE {
            return Err(Error::invalid(
                format!("a solution of degree {}", self.degree),
                format!("at most {} is known", Self::MAX_DEGREE),
            ));
        }
        let expected = a * s * harmonics::count(self.degree) * n;
        if self.moments.len() != expected || self.flux.len() != s * n {
            return Err(Error::ShapeMismatch {
                name: "moments and flux of a solution".into(),
                got: format!("{} and {} values", self.moments.len(), self.flux.len()),
                expected: format!("{expected} and {} values", s * n),
            });
        }
        if !self.moments.iter().chain(&self.flux).all(|v| v.is_finite()) {
            return Err(Error::invalid(
                "a solution holds values that are not finite",
                "solve again for this medium",
            ));
        }
        Ok(())
    }

    const MAX_DEGREE: usize = 64;
}

/// A solution that can be looked up.
///
/// Between nodes moments are interpolated linearly after dividing by a reference that itself is interpolated in its
/// logarithm: in twilight all moments fall tenfold within two degrees, and that common fall is then exact.
#[derive(Debug, Clone)]
pub struct Field {
    solution: Solution,
    lanes: usize,
    /// Sun zenith angles [rad], shape (s,).
    sun_zenith: Vec<f64>,
    /// Mean of `M_00` over wavelengths, shape (a, s).
    reference: Vec<f32>,
    /// Mean of the flux, shape (s,).
    flux_reference: Vec<f32>,
}

/// Four nodes and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Corners {
    at: [usize; 4],
    weight: [f32; 4],
}

impl Field {
    /// Makes a solution ready to be looked up.
    pub fn new(solution: Solution) -> Self {
        let n = solution.lanes();
        let means = |rows: &[f32], stride: usize| -> Vec<f32> {
            rows.chunks_exact(stride)
                .map(|row| lanes::sum(&row[..n]).max(0.0))
                .collect()
        };
        Self {
            lanes: n,
            sun_zenith: solution
                .sun_zenith_deg
                .iter()
                .map(|d| d.to_radians())
                .collect(),
            reference: means(&solution.moments, harmonics::count(solution.degree) * n),
            flux_reference: means(&solution.flux, n),
            solution,
        }
    }

    /// What it holds.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    pub fn into_solution(self) -> Solution {
        self.solution
    }

    /// The nodes about a point.
    #[inline(always)]
    pub fn corners(&self, radius_m: f64, mu_sun: f64) -> Corners {
        let s_count = self.sun_zenith.len();
        let (a, fa) = place(&self.solution.radius_m, radius_m);
        let (s, fs) = place(&self.sun_zenith, mu_sun.clamp(-1.0, 1.0).acos());
        let at = [
            a * s_count + s,
            a * s_count + s + 1,
            (a + 1) * s_count + s,
            (a + 1) * s_count + s + 1,
        ];
        let weight = [
            (1.0 - fa) * (1.0 - fs),
            (1.0 - fa) * fs,
            fa * (1.0 - fs),
            fa * fs,
        ];
        Corners {
            at,
            weight: even_out(weight, at.map(|k| self.reference[k])),
        }
    }

    /// `out += factor · Σ_lm coefficient_l Ŷ_lm M_lm` at a point, the scattered source.
    ///
    /// * `coefficients` — shape (degree + 1, lanes); `harmonics` — `Ŷ_lm` of the direction
    #[inline(always)]
    pub fn add_source(
        &self,
        corners: &Corners,
        degree: usize,
        coefficients: &[f32],
        harmonic: &[f32],
        out: &mut [f32],
    ) {
        let n = self.lanes;
        let row = harmonics::count(self.solution.degree) * n;
        let used = harmonics::count(degree) * n;
        let node =
            |c: usize| &self.solution.moments[corners.at[c] * row..corners.at[c] * row + used];
        let (m0, m1, m2, m3) = (node(0), node(1), node(2), node(3));
        let w = corners.weight;
        for block in (0..n).step_by(lanes::BLOCK) {
            let mut total = [0.0f32; lanes::BLOCK];
            for l in 0..=degree {
                let mut sum = [0.0f32; lanes::BLOCK];
                for m in 0..=l {
                    let k = harmonics::index(l, m);
                    let y = harmonic[k];
                    let at = k * n + block;
                    let (a, b) = (&m0[at..at + lanes::BLOCK], &m1[at..at + lanes::BLOCK]);
                    let (c, d) = (&m2[at..at + lanes::BLOCK], &m3[at..at + lanes::BLOCK]);
                    let (w0, w1, w2, w3) = (w[0] * y, w[1] * y, w[2] * y, w[3] * y);
                    for i in 0..lanes::BLOCK {
                        sum[i] += w0 * a[i] + w1 * b[i] + w2 * c[i] + w3 * d[i];
                    }
                }
                let c = &coefficients[l * n + block..l * n + block + lanes::BLOCK];
                for i in 0..lanes::BLOCK {
                    total[i] += c[i] * sum[i];
                }
            }
            for (o, t) in out[block..block + lanes::BLOCK].iter_mut().zip(total) {
                *o += t;
            }
        }
    }

    /// `out += diffuse irradiance` of the ground under a sun.
    #[inline(always)]
    pub fn add_flux(&self, mu_sun: f64, out: &mut [f32]) {
        let (s, fs) = place(&self.sun_zenith, mu_sun.clamp(-1.0, 1.0).acos());
        let reference = [self.flux_reference[s], self.flux_reference[s + 1], 1.0, 1.0];
        let w = even_out([1.0 - fs, fs, 0.0, 0.0], reference);
        let n = self.lanes;
        let (a, b) = (
            &self.solution.flux[s * n..(s + 1) * n],
            &self.solution.flux[(s + 1) * n..(s + 2) * n],
        );
        for ((o, &a), &b) in out.iter_mut().zip(a).zip(b) {
            *o += w[0] * a + w[1] * b;
        }
    }
}

/// Interval of a value and the fraction in it, held at the ends.
#[inline(always)]
fn place(x: &[f64], at: f64) -> (usize, f32) {
    let i = interval(x, at);
    (i, ((at - x[i]) / (x[i + 1] - x[i])).clamp(0.0, 1.0) as f32)
}

/// Weights for values divided by their reference, times the reference interpolated in its logarithm.
#[inline(always)]
fn even_out(weight: [f32; 4], reference: [f32; 4]) -> [f32; 4] {
    let mut log = 0.0;
    for (&w, &r) in weight.iter().zip(&reference) {
        if w > 0.0 {
            if r <= 0.0 {
                return weight;
            }
            log += w * r.ln();
        }
    }
    let middle = log.exp();
    let mut out = [0.0; 4];
    for k in 0..4 {
        if weight[k] > 0.0 {
            out[k] = weight[k] * middle / reference[k];
        }
    }
    out
}
