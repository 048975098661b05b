//! Moments of the diffuse radiance over altitude and sun angle: what the solver solves for.

use super::{harmonics, spin};
use crate::error::{Error, Result};
use crate::math::interp::{interval, Cubic};
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
    /// The same of the harmonics of polarisation, 2 to `degree`; 0 where light was taken as a scalar.
    pub polarised_degree: usize,
    /// Which of the medium's wavelengths were solved, as indices, increasing, shape (c,).
    pub chosen: Vec<usize>,
    /// Moments `M_lm = ∫ L Ŷ_lm dω` of the diffuse radiance \[1\], the harmonics degree by degree, order from 0; after them, at each
    /// node, the moments E and then B of its polarisation, degree by degree from 2, order from 0. With P the degree of
    /// polarisation, shape (a, s, (degree + 1)(degree + 2)/2 \[+ (P + 1)(P + 2) − 6\], lanes).
    pub moments: Vec<f32>,
    /// Diffuse irradiance of the ground \[1\], shape (s, lanes).
    pub flux: Vec<f32>,
}

impl Solution {
    /// Length of a row.
    pub fn lanes(&self) -> usize {
        lanes::padded(self.chosen.len())
    }

    /// Moments of a node.
    pub(super) fn moments_per_node(&self) -> usize {
        harmonics::count(self.degree) + 2 * spin::count(self.polarised_degree)
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
        if self.polarised_degree == 1 || self.polarised_degree > self.degree {
            return Err(Error::invalid(
                format!(
                    "a solution of degree {} and degree {} of polarisation",
                    self.degree, self.polarised_degree
                ),
                "polarisation has degree 0, or 2 up to that of the radiance",
            ));
        }
        let expected = a * s * self.moments_per_node() * n;
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
/// Between nodes moments are interpolated after dividing by a reference that itself is interpolated in its logarithm: in
/// twilight all moments fall tenfold within two degrees, and that common fall is then nearly exact. Linearly in height, by
/// cubics in the sun's zenith angle.
#[derive(Debug, Clone)]
pub struct Field {
    solution: Solution,
    lanes: usize,
    suns: Cubic,
    /// Logarithm of the mean of `M_00` over wavelengths, shape (a, s).
    log_reference: Vec<f32>,
    /// Logarithm of the mean of the flux, shape (s,).
    log_flux: Vec<f32>,
}

/// How a point scatters, and the harmonics of a ray there.
pub struct Scattering<'a> {
    /// Largest degree that matters.
    pub degree: usize,
    /// The same of polarisation, at most `degree`; 0 where light is a scalar.
    pub polarised_degree: usize,
    /// `c_l`, shape (degree + 1, lanes).
    pub coefficients: &'a [f32],
    /// `Ŷ_lm` without `cos mφ`.
    pub polar: &'a [f32],
    /// b, e, h of `Scaled::polarising_at`, shape (l from 2, 3, lanes).
    pub polarising: &'a [f32],
    /// `W_lm` and `X_lm` (see `spin.rs`).
    pub w: &'a [f32],
    pub x: &'a [f32],
}

/// Four nodes over the sun's zenith angle, and their weights.
#[derive(Debug, Clone, Copy, Default)]
pub struct SunPlace {
    pub first: usize,
    pub weight: [f32; 4],
}

impl Field {
    /// Share of the brightest reference below which a node counts as dark.
    const DARK: f32 = 1e-14;

    /// Makes a solution ready to be looked up.
    pub fn new(solution: Solution) -> Self {
        let n = solution.lanes();
        let logs = |rows: &[f32], stride: usize| -> Vec<f32> {
            let means: Vec<f32> = rows
                .chunks_exact(stride)
                .map(|row| lanes::sum(&row[..n]))
                .collect();
            let least = means.iter().copied().fold(1e-20, f32::max) * Self::DARK;
            means.iter().map(|m| m.max(least).ln()).collect()
        };
        let zenith: Vec<f64> = solution
            .sun_zenith_deg
            .iter()
            .map(|d| d.to_radians())
            .collect();
        Self {
            lanes: n,
            suns: Cubic::new(&zenith),
            log_reference: logs(&solution.moments, solution.moments_per_node() * n),
            log_flux: logs(&solution.flux, n),
            solution,
        }
    }

    /// What it holds.
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// Nodes about a sun's zenith angle, given by its cosine.
    #[inline(always)]
    pub fn sun_place(&self, mu_sun: f64) -> SunPlace {
        let (first, weight) = self.suns.at(arc_cosine(mu_sun));
        SunPlace { first, weight }
    }

    /// Interval of a radius among the nodes' heights, and the fraction in it.
    #[inline(always)]
    pub fn height(&self, radius_m: f64) -> (usize, f32) {
        let x = &self.solution.radius_m;
        let a = interval(x, radius_m);
        let f = (radius_m - x[a]) / (x[a + 1] - x[a]);
        (a, f.clamp(0.0, 1.0) as f32)
    }

    /// The source at a height under one node's sun, by order m of its azimuth: `out[m] = Σ_l c_l Ŷ_lm M_lm`, divided by the
    /// reference whose logarithm is returned. Of polarised light, the light that polarisation adds to the radiance too, and Q and U
    /// if there is room for them.
    ///
    /// * `out` — shape (degree + 1, lanes); for Q and U (polarised_degree + 1, lanes) more, each
    #[inline(always)]
    pub fn source_by_order(
        &self,
        (a, f): (usize, f32),
        sun: usize,
        scattering: &Scattering<'_>,
        out: &mut [f32],
    ) -> f32 {
        let &Scattering {
            degree,
            coefficients,
            polar,
            ..
        } = scattering;
        let n = self.lanes;
        let suns = self.solution.sun_zenith_deg.len();
        let stride = self.solution.moments_per_node() * n;
        let used = harmonics::count(degree) * n;
        let (low, high) = (a * suns + sun, (a + 1) * suns + sun);
        let (log_low, log_high) = (self.log_reference[low], self.log_reference[high]);
        let (u, v) = ((1.0 - f) * (-log_low).exp(), f * (-log_high).exp());
        let below = &self.solution.moments[low * stride..low * stride + used];
        let above = &self.solution.moments[high * stride..high * stride + used];
        for block in (0..n).step_by(lanes::BLOCK) {
            for m in 0..=degree {
                let mut sum = [0.0f32; lanes::BLOCK];
                for l in m..=degree {
                    let k = harmonics::index(l, m);
                    let y = polar[k];
                    let (u, v) = (u * y, v * y);
                    let at = k * n + block;
                    let (b, t) = (*lanes::block(below, at), *lanes::block(above, at));
                    let c = *lanes::block(coefficients, l * n + block);
                    sum = lanes::each(|i| sum[i] + c[i] * (u * b[i] + v * t[i]));
                }
                out[m * n + block..m * n + block + lanes::BLOCK].copy_from_slice(&sum);
            }
        }
        if scattering.polarised_degree > 0 {
            let below = &self.solution.moments[low * stride..(low + 1) * stride];
            let above = &self.solution.moments[high * stride..(high + 1) * stride];
            let stokes = out.len() > (degree + 1) * n;
            self.polarise(scattering, [(below, u), (above, v)], stokes, out);
        }
        log_low + f * (log_high - log_low)
    }

    /// What polarisation adds to [`Field::source_by_order`], from the moments of two nodes and their weights; see `spin.rs`.
    #[inline(always)]
    fn polarise(
        &self,
        scattering: &Scattering<'_>,
        [(below, u), (above, v)]: [(&[f32], f32); 2],
        stokes: bool,
        out: &mut [f32],
    ) {
        let &Scattering {
            degree,
            polarised_degree: most,
            polar,
            polarising,
            ..
        } = scattering;
        let n = self.lanes;
        let electric = harmonics::count(self.solution.degree);
        let magnetic = electric + spin::count(self.solution.polarised_degree);
        let (out_i, out_q_u) = out.split_at_mut((degree + 1) * n);
        let nodes = [(below, u), (above, v)];
        for block in (0..n).step_by(lanes::BLOCK) {
            for m in 0..=most {
                let (mut in_i, mut in_q, mut in_u) = (
                    [0.0; lanes::BLOCK],
                    [0.0; lanes::BLOCK],
                    [0.0; lanes::BLOCK],
                );
                for l in m.max(2)..=most {
                    let (k, s) = (harmonics::index(l, m), spin::index(l, m));
                    let row = (3 * (l - 2)) * n + block;
                    let b = *lanes::block(polarising, row);
                    let in_e = blend(nodes, (electric + s) * n + block);
                    let y = polar[k];
                    in_i = lanes::each(|i| in_i[i] + y * b[i] * in_e[i]);
                    if !stokes {
                        continue;
                    }
                    let (w, x) = (scattering.w[s], scattering.x[s]);
                    let of_i = blend(nodes, k * n + block);
                    let e = *lanes::block(polarising, row + n);
                    let h = *lanes::block(polarising, row + 2 * n);
                    let of_b = blend(nodes, (magnetic + s) * n + block);
                    let to_e = lanes::each(|i| b[i] * of_i[i] + e[i] * in_e[i]);
                    let to_b = lanes::each(|i| h[i] * of_b[i]);
                    in_q = lanes::each(|i| in_q[i] + (w * to_e[i] - x * to_b[i]));
                    in_u = lanes::each(|i| in_u[i] + (w * to_b[i] - x * to_e[i]));
                }
                let at = m * n + block;
                for (o, i) in out_i[at..at + lanes::BLOCK].iter_mut().zip(in_i) {
                    *o += i;
                }
                if stokes {
                    out_q_u[at..at + lanes::BLOCK].copy_from_slice(&in_q);
                    let at = at + (most + 1) * n;
                    out_q_u[at..at + lanes::BLOCK].copy_from_slice(&in_u);
                }
            }
        }
    }

    /// `out += factor · diffuse irradiance` of the ground under a sun.
    #[inline(always)]
    pub fn add_flux(&self, place: &SunPlace, factor: &[f32], out: &mut [f32]) {
        let n = self.lanes;
        let points = self.log_flux.len().min(4);
        let logs = &self.log_flux[place.first..place.first + points];
        let log: f32 = logs.iter().zip(&place.weight).map(|(l, w)| l * w).sum();
        for (i, &node) in logs.iter().enumerate() {
            let w = place.weight[i] * (log - node).exp();
            let at = (place.first + i) * n;
            for ((o, &x), &f) in out
                .iter_mut()
                .zip(&self.solution.flux[at..at + n])
                .zip(factor)
            {
                *o += w * x * f;
            }
        }
    }
}

/// A block of the weighted sum of two nodes' rows.
#[inline(always)]
fn blend([(low, u), (high, v)]: [(&[f32], f32); 2], at: usize) -> lanes::Block {
    let (low, high) = (lanes::block(low, at), lanes::block(high, at));
    lanes::each(|i| u * low[i] + v * high[i])
}

/// arccos to 2·10⁻⁸ rad, many times as fast as the library's.
///
/// # Source
/// Abramowitz & Stegun 1964, 4.4.46.
#[inline(always)]
fn arc_cosine(x: f64) -> f64 {
    let a = x.abs().min(1.0);
    let p = -0.001_262_491_1;
    let p = 0.006_670_090_1 + a * p;
    let p = -0.017_088_125_6 + a * p;
    let p = 0.030_891_881_0 + a * p;
    let p = -0.050_174_304_6 + a * p;
    let p = 0.088_978_987_4 + a * p;
    let p = -0.214_598_801_6 + a * p;
    let p = 1.570_796_305_0 + a * p;
    let angle = (1.0 - a).sqrt() * p;
    if x < 0.0 {
        std::f64::consts::PI - angle
    } else {
        angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arc_cosine_keeps_its_error() {
        for i in -1000..=1000 {
            let x = f64::from(i) / 1000.0;
            assert!((arc_cosine(x) - x.acos()).abs() < 3e-8, "{x}");
        }
    }
}
