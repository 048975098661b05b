//! Real spherical harmonics of fields that are symmetric about the sun's vertical plane.
//!
//! `Ŷ_lm(ω) = √((2 − δ_m0) (l − m)! / (l + m)!) P_lm(μ) cos mφ`, normalised so that the addition theorem reads
//! `P_l(cos Θ) = Σ_m Ŷ_lm(ω) Ŷ_lm(ω')`. A phase function `p = Σ_l (2l + 1)/(4π) g_l P_l` then scatters the moments
//! `M_lm = ∫ L Ŷ_lm dω` of a radiance into `Σ_lm (2l + 1)/(4π) g_l M_lm Ŷ_lm(ω)`: no interpolation over angles, ever.

/// Number of harmonics up to a degree.
pub const fn count(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Place of a harmonic in a row: degree by degree, order from 0.
pub const fn index(l: usize, m: usize) -> usize {
    l * (l + 1) / 2 + m
}

/// The recurrence's constants, and the evaluation of all harmonics up to a degree.
#[derive(Debug, Clone)]
pub struct Harmonics {
    degree: usize,
    /// `√((2m − 1)/(2m))`, with √2 put into m = 1.
    diagonal: Vec<f64>,
    /// `(2l − 1)/√(l² − m²)` and `√((l−1)² − m²)/√(l² − m²)`, in the order of [`index`].
    up: Vec<f64>,
    back: Vec<f64>,
}

impl Harmonics {
    /// Harmonics up to a degree.
    pub fn new(degree: usize) -> Self {
        let mut diagonal = vec![1.0; degree + 1];
        let (mut up, mut back) = (vec![0.0; count(degree)], vec![0.0; count(degree)]);
        for m in 0..=degree {
            let mf = m as f64;
            if m > 0 {
                diagonal[m] = ((2.0 * mf - 1.0) / (2.0 * mf)).sqrt();
            }
            if m == 1 {
                diagonal[m] *= std::f64::consts::SQRT_2;
            }
            for l in m + 1..=degree {
                let lf = l as f64;
                let norm = (lf * lf - mf * mf).sqrt();
                up[index(l, m)] = (2.0 * lf - 1.0) / norm;
                back[index(l, m)] = ((lf - 1.0) * (lf - 1.0) - mf * mf).max(0.0).sqrt() / norm;
            }
        }
        Self {
            degree,
            diagonal,
            up,
            back,
        }
    }

    /// `Ŷ_lm` without its factor `cos mφ`, for all l ≤ `degree` (at most the one of `new`), in the order of [`index`].
    ///
    /// * `mu` — cosine of the zenith angle
    #[inline(always)]
    pub fn polar(&self, degree: usize, mu: f64, out: &mut [f32]) {
        let degree = degree.min(self.degree);
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        // The stable recurrence of the Legendre functions, in l at fixed m.
        let mut start = 1.0;
        for m in 0..=degree {
            if m > 0 {
                start *= sin * self.diagonal[m];
            }
            let (mut before, mut now) = (0.0, start);
            out[index(m, m)] = now as f32;
            for l in m + 1..=degree {
                let k = index(l, m);
                (before, now) = (now, self.up[k] * mu * now - self.back[k] * before);
                out[k] = now as f32;
            }
        }
    }
}

/// `cos mφ` for m below the length of `out`, at least 1, by Chebyshev's recurrence.
#[inline(always)]
pub fn cosines(cos_phi: f32, out: &mut [f32]) {
    let (mut before, mut now) = (cos_phi, 1.0);
    for c in out {
        *c = now;
        (before, now) = (now, 2.0 * cos_phi * now - before);
    }
}

/// `P_l(x)` for l ≤ `degree`.
#[inline(always)]
pub fn legendre(degree: usize, x: f64, out: &mut [f32]) {
    let (mut before, mut now) = (1.0, x);
    out[0] = 1.0;
    for (l, out) in out.iter_mut().enumerate().take(degree + 1).skip(1) {
        *out = now as f32;
        let lf = l as f64;
        (before, now) = (now, ((2.0 * lf + 1.0) * x * now - lf * before) / (lf + 1.0));
    }
}

/// Nodes and weights of Gauss–Legendre quadrature on [a, b].
pub fn gauss_legendre(n: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    let half = 0.5 * (b - a);
    (0..n)
        .map(|i| {
            // Newton's method from Tricomi's estimate of the root.
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                slope = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                let step = p1 / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            let weight = 2.0 / ((1.0 - x * x) * slope * slope);
            (0.5 * (a + b) - half * x, half * weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAX_DEGREE: usize = 12;

    /// The addition theorem holds, with φ' = 0.
    #[test]
    fn addition_theorem() {
        let (mu, phi, mu_sun): (f64, f64, f64) = (0.3, 1.1, -0.6);
        let (mut a, mut b) = ([0.0; count(MAX_DEGREE)], [0.0; count(MAX_DEGREE)]);
        let harmonics = Harmonics::new(MAX_DEGREE);
        harmonics.polar(MAX_DEGREE, mu, &mut a);
        harmonics.polar(MAX_DEGREE, mu_sun, &mut b);
        let mut turn = [0.0; MAX_DEGREE + 1];
        cosines(phi.cos() as f32, &mut turn);
        let x = mu * mu_sun + ((1.0 - mu * mu) * (1.0 - mu_sun * mu_sun)).sqrt() * phi.cos();
        let (mut p0, mut p1) = (1.0, x);
        for l in 1..=MAX_DEGREE {
            let sum: f32 = (0..=l)
                .map(|m| a[index(l, m)] * b[index(l, m)] * turn[m])
                .sum();
            assert!(
                (f64::from(sum) - p1).abs() < 1e-5,
                "degree {l}: {sum} against {p1}"
            );
            let l = l as f64;
            (p0, p1) = (p1, ((2.0 * l + 1.0) * x * p1 - l * p0) / (l + 1.0));
        }
    }

    #[test]
    fn gauss_is_exact_for_polynomials() {
        let sum: f64 = gauss_legendre(5, 0.0, 2.0)
            .iter()
            .map(|(x, w)| w * x.powi(9))
            .sum();
        assert!((sum - 1024.0 / 10.0).abs() < 1e-10);
        let sum: f64 = gauss_legendre(1, 0.0, 2.0).iter().map(|(x, w)| w * x).sum();
        assert!((sum - 2.0).abs() < 1e-14);
    }
}
