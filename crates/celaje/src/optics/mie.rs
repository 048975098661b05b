//! Lorenz–Mie theory: scattering by one homogeneous sphere.
//!
//! Conventions of Bohren & Huffman 1983, chapter 4: time factor `exp(−iωt)`, refractive index `n + ik` with
//! `k ≥ 0` for absorption, coefficients `a_n`, `b_n` (their eq. 4.88), amplitudes `S1`, `S2` (eq. 4.74). Codes that
//! write `n − ik` (Wiscombe's MIEV0) have the complex conjugates of our amplitudes.
//!
//! # Numerics
//! * Series length by Wiscombe 1980 (doi:10.1364/AO.19.001505).
//! * `D_n(mx) = ψ_n′/ψ_n` by downward recurrence (eq. 4.89) from `max(N, |m|x)` plus a margin that grows as the cube
//!   root: the contamination by the wrong solution shrinks by `exp(−(4√2/3) K^{3/2} / √(|m|x))` over `K` steps above
//!   the turning point, so `K = 8 (|m|x)^{1/3}` leaves 1e-18. (The customary margin of 15 is not enough at `x = 1e4`.)
//! * `ψ_n(x)` downward as well (Miller), normalised by the larger of `ψ_0 = sin x` and `ψ_1`: upward recurrence loses
//!   `x²` digits in the Rayleigh limit. `χ_n(x)` upward, which is stable.
//! * Several spheres of one index are computed at once, one per lane, so that the long chains of dependent divisions
//!   overlap.

use super::mie_kernel;
use crate::error::{check_range, Result};
use crate::math::Complex;

/// Largest size parameter accepted by [`mie`].
const MAX_SIZE_PARAMETER: f64 = 1e5;

/// What one sphere does to light; made by [`mie`].
#[derive(Debug, Clone, PartialEq)]
pub struct MieSphere {
    /// Size parameter `x = 2π r / λ`.
    pub size_parameter: f64,
    /// Extinction efficiency: cross section over `π r²`.
    pub q_ext: f64,
    /// Scattering efficiency.
    pub q_sca: f64,
    /// Mean cosine of the scattering angle.
    pub asymmetry: f64,
    /// Electric coefficients `a_1, a_2, …`.
    pub a: Vec<Complex>,
    /// Magnetic coefficients `b_1, b_2, …`.
    pub b: Vec<Complex>,
}

impl MieSphere {
    /// Absorption efficiency.
    pub fn q_abs(&self) -> f64 {
        self.q_ext - self.q_sca
    }

    /// Amplitudes `(S1, S2)` at each scattering angle, given by its cosine; same length as `cos_theta`.
    ///
    /// `S1` is the amplitude perpendicular to the scattering plane, `S2` the one parallel to it. Angles that come in
    /// mirrored pairs (`cos_theta` equal to its own reverse, negated) take half the time.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for a cosine outside \[-1, 1\].
    pub fn amplitudes(&self, cos_theta: &[f64]) -> Result<(Vec<Complex>, Vec<Complex>)> {
        for &c in cos_theta {
            check_range("cos_theta", c, "", -1.0..=1.0)?;
        }
        let terms = mie_kernel::Terms::new(&self.a, &self.b);
        Ok(mie_kernel::amplitudes(&terms, cos_theta))
    }
}

/// Scattering of a plane wave by a homogeneous sphere.
///
/// # Arguments
/// * `n`, `k` — refractive index `n + ik` relative to the medium around \[1\], `n` in (0, 100], `k` in \[0, 100\]
/// * `size_parameter` — `x = 2π r / λ` \[1\], 1e-8 to 1e5
///
/// # Errors
/// [`crate::Error::OutOfRange`]; a negative `k`, the other sign convention, is refused rather than conjugated.
///
/// # Source
/// Bohren & Huffman 1983, *Absorption and Scattering of Light by Small Particles*, chapter 4.
///
/// ```
/// let sphere = celaje::optics::mie(1.5, 0.0, 10.0)?;
/// assert!((sphere.q_ext - 2.8820).abs() < 1e-4);
/// # Ok::<(), celaje::Error>(())
/// ```
pub fn mie(n: f64, k: f64, size_parameter: f64) -> Result<MieSphere> {
    check_index(n, k)?;
    check_range(
        "size parameter",
        size_parameter,
        "",
        1e-8..=MAX_SIZE_PARAMETER,
    )?;
    let [sphere] = spheres(n, k, &[size_parameter]);
    Ok(sphere)
}

/// Refuses refractive indices outside what the solver was tested for.
pub(crate) fn check_index(n: f64, k: f64) -> Result<()> {
    check_range("refractive index n", n, "", 1e-3..=100.0)?;
    check_range("refractive index k", k, "", 0.0..=100.0)
}

/// [`mie`] for `L` spheres of one index and similar size at once; the input is trusted.
pub(crate) fn spheres<const L: usize>(n: f64, k: f64, x: &[f64; L]) -> [MieSphere; L] {
    let m = Complex::new(n, k);
    let count = x.map(series_length);
    let longest = count.iter().copied().max().unwrap_or(1);
    let d = log_derivatives(m, x, longest);
    let (psi, chi) = riccati_bessel(x, &count);

    let inv_m = Complex::new(1.0, 0.0) / m;
    std::array::from_fn(|l| {
        let coefficient = |i: usize, factor: Complex| {
            // Eq. 4.88: [(D/m + n/x) ψ_n − ψ_{n−1}] / [(D/m + n/x) ξ_n − ξ_{n−1}], with ξ = ψ − iχ; b_n has m D.
            let bracket = factor + Complex::new(i as f64 / x[l], 0.0);
            let top = bracket * psi[i][l] - Complex::new(psi[i - 1][l], 0.0);
            let bottom = bracket * Complex::new(psi[i][l], -chi[i][l])
                - Complex::new(psi[i - 1][l], -chi[i - 1][l]);
            top / bottom
        };
        let term = |i: usize| Complex::new(d[i].0[l], d[i].1[l]);
        let a: Vec<Complex> = (1..=count[l])
            .map(|i| coefficient(i, term(i) * inv_m))
            .collect();
        let b: Vec<Complex> = (1..=count[l])
            .map(|i| coefficient(i, term(i) * m))
            .collect();
        efficiencies(x[l], k == 0.0, a, b)
    })
}

/// Number of terms of the series (Wiscombe 1980, eq. 1), and at least the first two multipoles.
fn series_length(x: f64) -> usize {
    let cube_root = x.cbrt();
    let terms = if x <= 8.0 {
        x + 4.0 * cube_root + 1.0
    } else if x < 4200.0 {
        x + 4.05 * cube_root + 2.0
    } else {
        x + 4.0 * cube_root + 2.0
    };
    (terms as usize).max(2)
}

/// `D_0 … D_count` of `m x` for each lane, as (real parts, imaginary parts), by eq. 4.89 downward.
fn log_derivatives<const L: usize>(
    m: Complex,
    x: &[f64; L],
    count: usize,
) -> Vec<([f64; L], [f64; L])> {
    let largest = x.iter().fold(0.0_f64, |a, &b| a.max(b)) * m.norm_sqr().sqrt();
    let turning = largest.max(count as f64);
    let start = turning as usize + (8.0 * turning.cbrt()) as usize + 16;
    let inv_y = x.map(|x| Complex::new(1.0, 0.0) / (m * x));
    let mut d = vec![([0.0; L], [0.0; L]); count + 1];
    let (mut re, mut im) = ([0.0; L], [0.0; L]);
    for i in (1..=start).rev() {
        let order = i as f64;
        for l in 0..L {
            let (ratio_re, ratio_im) = (order * inv_y[l].re, order * inv_y[l].im);
            let (sum_re, sum_im) = (re[l] + ratio_re, im[l] + ratio_im);
            let inverse = 1.0 / (sum_re * sum_re + sum_im * sum_im);
            re[l] = ratio_re - sum_re * inverse;
            im[l] = ratio_im + sum_im * inverse;
        }
        if i <= count + 1 {
            d[i - 1] = (re, im);
        }
    }
    d
}

/// Riccati–Bessel functions `ψ_0, ψ_1, …` and `χ_0, χ_1, …` of each lane's `x`; a lane's values are good up to its own
/// `count`.
fn riccati_bessel<const L: usize>(
    x: &[f64; L],
    count: &[usize; L],
) -> (Vec<[f64; L]>, Vec<[f64; L]>) {
    let longest = count.iter().copied().max().unwrap_or(1);
    let inv_x = x.map(|x| 1.0 / x);
    let sin = x.map(f64::sin);
    let cos = x.map(f64::cos);

    // ψ by Miller's algorithm: any start above the turning point decays onto the regular solution. Each lane starts at
    // its own point, for ψ of a small x would overflow on the way down from that of a large one.
    let starts = count.map(|n| n + 16 + (2.0 * (n as f64).cbrt()) as usize);
    let first = starts.iter().copied().max().unwrap_or(1);
    let mut psi = vec![[0.0; L]; longest + 1];
    let (mut above, mut here) = ([0.0; L], [1e-150; L]);
    for i in (1..=first).rev() {
        let factor = (2 * i + 1) as f64;
        for l in 0..L {
            let started = i <= starts[l];
            let below = factor * inv_x[l] * here[l] - above[l];
            above[l] = if started { here[l] } else { 0.0 };
            here[l] = if started { below } else { 1e-150 };
        }
        if i <= longest + 1 {
            psi[i - 1] = here;
        }
    }
    let scale: [f64; L] = std::array::from_fn(|l| {
        let psi_1 = sin[l] * inv_x[l] - cos[l];
        if sin[l].abs() >= psi_1.abs() {
            sin[l] / psi[0][l]
        } else {
            psi_1 / psi[1][l]
        }
    });
    for row in &mut psi {
        for l in 0..L {
            row[l] *= scale[l];
        }
    }

    let mut chi = vec![[0.0; L]; longest + 1];
    chi[0] = cos;
    chi[1] = std::array::from_fn(|l| cos[l] * inv_x[l] + sin[l]);
    for i in 2..=longest {
        let factor = (2 * i - 1) as f64;
        chi[i] = std::array::from_fn(|l| factor * inv_x[l] * chi[i - 1][l] - chi[i - 2][l]);
    }
    (psi, chi)
}

/// Sums over the coefficients: eqs. 4.61, 4.62 and the asymmetry on p. 120.
fn efficiencies(x: f64, lossless: bool, a: Vec<Complex>, b: Vec<Complex>) -> MieSphere {
    let (mut ext, mut sca, mut asy) = (0.0, 0.0, 0.0);
    for (i, (&a_n, &b_n)) in a.iter().zip(&b).enumerate() {
        let n = (i + 1) as f64;
        ext += (2.0 * n + 1.0) * (a_n.re + b_n.re);
        sca += (2.0 * n + 1.0) * (a_n.norm_sqr() + b_n.norm_sqr());
        asy += (2.0 * n + 1.0) / (n * (n + 1.0)) * (a_n * b_n.conj()).re;
        if i + 1 < a.len() {
            let next = (a_n * a[i + 1].conj()).re + (b_n * b[i + 1].conj()).re;
            asy += n * (n + 2.0) / (n + 1.0) * next;
        }
    }
    let scale = 2.0 / (x * x);
    // Rounding may push scattering above extinction by 1 ulp where absorption is nil.
    let q_sca = scale * if lossless { sca } else { sca.min(ext) };
    MieSphere {
        size_parameter: x,
        q_ext: if lossless { q_sca } else { scale * ext },
        q_sca,
        // A sphere of the air's own index scatters nothing.
        asymmetry: if sca > 0.0 { 2.0 * asy / sca } else { 0.0 },
        a,
        b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spheres computed side by side must be those computed alone, however different their sizes.
    #[test]
    fn lanes_do_not_disturb_each_other() {
        let x = [1e-3, 0.1, 1.0, 10.0, 100.0, 500.0, 1000.0, 3000.0];
        for (n, k) in [(1.5, 0.0), (1.75, 0.44)] {
            for (lane, &x) in spheres(n, k, &x).iter().zip(&x) {
                let alone = mie(n, k, x).unwrap();
                assert_eq!(lane.a.len(), alone.a.len());
                assert!((lane.q_ext / alone.q_ext - 1.0).abs() < 1e-10, "{x}");
                assert!((lane.q_sca / alone.q_sca - 1.0).abs() < 1e-10, "{x}");
                assert!((lane.asymmetry - alone.asymmetry).abs() < 1e-10, "{x}");
            }
        }
    }
}
