//! Moments of the diffuse radiance over altitude and sun angle: what the solver solves for.

use super::harmonics;
use crate::math::interp::interval;
use crate::math::lanes;

/// Moments on a grid of heights and sun zenith angles.
///
/// Between nodes they are interpolated linearly after dividing by a reference that itself is interpolated in its logarithm:
/// in twilight all moments fall tenfold within two degrees, and that common fall is then exact.
#[derive(Debug, Clone)]
pub struct Field {
    /// Distances from the planet's centre [m], shape (a,).
    pub radius_m: Vec<f64>,
    /// Sun zenith angles [rad], shape (s,).
    pub sun_zenith: Vec<f64>,
    pub degree: usize,
    pub lanes: usize,
    /// `M_lm`, shape (a, s, harmonic, lanes).
    pub moments: Vec<f32>,
    /// Diffuse irradiance of the ground, shape (s, lanes).
    pub flux: Vec<f32>,
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
    /// A dark field.
    pub fn new(radius_m: Vec<f64>, sun_zenith: Vec<f64>, degree: usize, lanes: usize) -> Self {
        let nodes = radius_m.len() * sun_zenith.len();
        Self {
            moments: vec![0.0; nodes * harmonics::count(degree) * lanes],
            flux: vec![0.0; sun_zenith.len() * lanes],
            reference: vec![0.0; nodes],
            flux_reference: vec![0.0; sun_zenith.len()],
            radius_m,
            sun_zenith,
            degree,
            lanes,
        }
    }

    /// Values per altitude.
    pub fn stride(&self) -> usize {
        self.sun_zenith.len() * harmonics::count(self.degree) * self.lanes
    }

    /// Takes the references anew after the moments have changed.
    pub fn set_references(&mut self) {
        let row = harmonics::count(self.degree) * self.lanes;
        for (r, m) in self
            .reference
            .iter_mut()
            .zip(self.moments.chunks_exact(row))
        {
            *r = lanes::sum(&m[..self.lanes]).max(0.0);
        }
        for (r, f) in self
            .flux_reference
            .iter_mut()
            .zip(self.flux.chunks_exact(self.lanes))
        {
            *r = lanes::sum(f).max(0.0);
        }
    }

    /// The nodes about a point.
    #[inline(always)]
    pub fn corners(&self, radius_m: f64, mu_sun: f64) -> Corners {
        let s_count = self.sun_zenith.len();
        let (a, fa) = place(&self.radius_m, radius_m);
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
        let row = harmonics::count(self.degree) * n;
        let used = harmonics::count(degree) * n;
        let node = |c: usize| &self.moments[corners.at[c] * row..corners.at[c] * row + used];
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
            &self.flux[s * n..(s + 1) * n],
            &self.flux[(s + 1) * n..(s + 2) * n],
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
