//! The inner loop of Mie tables: amplitudes over many angles.
//!
//! Angles are handled in blocks that stay in vector registers while the series runs. One pass over a block gives
//! the amplitudes at `μ` *and* at `−μ`: since `π_n(−μ) = (−1)^{n+1} π_n(μ)` and `τ_n(−μ) = (−1)^n τ_n(μ)`, it is enough
//! to keep the parts of each series that are even and odd in `μ` apart,
//! `S(±μ) = even(μ) ± odd(μ)`.

use crate::math::Complex;
use multiversion::multiversion;
use multiversion::target::selected_target;

/// One term of the series, ready for use: `(2n+1)/(n(n+1))` is multiplied into `a_n` and `b_n`.
#[derive(Debug, Clone, Copy, Default)]
struct Term {
    a: Complex,
    b: Complex,
    n: f64,
    /// `1 + 1/n`
    step: f64,
}

/// The coefficients of one sphere in the order and form in which the kernel reads them: odd and even `n` in pairs.
pub(crate) struct Terms(Vec<[Term; 2]>);

impl Terms {
    /// From `a_1, a_2, …` and `b_1, b_2, …`, same length.
    pub fn new(a: &[Complex], b: &[Complex]) -> Self {
        let mut pairs = vec![[Term::default(); 2]; a.len().div_ceil(2)];
        for (i, (&a_n, &b_n)) in a.iter().zip(b).enumerate() {
            let n = (i + 1) as f64;
            let factor = (2.0 * n + 1.0) / (n * (n + 1.0));
            pairs[i / 2][i % 2] = Term {
                a: a_n * factor,
                b: b_n * factor,
                n,
                step: 1.0 + 1.0 / n,
            };
        }
        Self(pairs)
    }
}

/// Sums of `weight · (S11, S12, S33, S34)` over spheres, at angles in `[0°, 90°]` and at their mirror images.
///
/// Matrix elements as in Bohren & Huffman 1983, eq. 4.77.
#[derive(Debug, Clone)]
pub(crate) struct MatrixSum {
    /// At `+μ`: S11, S12, S33, S34, each per angle.
    pub forward: [Vec<f64>; 4],
    /// At `−μ`.
    pub backward: [Vec<f64>; 4],
}

impl MatrixSum {
    /// All zero, for `n` angles.
    pub fn zero(n: usize) -> Self {
        let zeros = || std::array::from_fn(|_| vec![0.0; n]);
        Self {
            forward: zeros(),
            backward: zeros(),
        }
    }

    /// Adds another sum over the same angles.
    pub fn add(&mut self, other: &Self) {
        let mine = self.forward.iter_mut().chain(&mut self.backward);
        for (a, b) in mine.zip(other.forward.iter().chain(&other.backward)) {
            for (a, b) in a.iter_mut().zip(b) {
                *a += b;
            }
        }
    }
}

/// Adds one sphere, `weight` times, to a sum at angles `cos_theta` in \[0, 1\].
pub(crate) fn accumulate(terms: &Terms, cos_theta: &[f64], weight: f64, sum: &mut MatrixSum) {
    run(&terms.0, cos_theta, &mut Output::Matrix { weight, sum });
}

/// Amplitudes `(S1, S2)` at each `cos_theta` in \[-1, 1\].
pub(crate) fn amplitudes(terms: &Terms, cos_theta: &[f64]) -> (Vec<Complex>, Vec<Complex>) {
    let n = cos_theta.len();
    let mirrored = (0..n).all(|i| (cos_theta[i] + cos_theta[n - 1 - i]).abs() < 1e-15);
    let computed = if mirrored { n.div_ceil(2) } else { n };
    let mut parts: [Vec<f64>; 8] = std::array::from_fn(|_| vec![0.0; computed]);
    run(
        &terms.0,
        &cos_theta[..computed],
        &mut Output::Parts(&mut parts),
    );
    let [s1, s2] = [0, 4].map(|first| {
        let [even_re, even_im, odd_re, odd_im] =
            [0, 1, 2, 3].map(|p| &parts[first + p][..computed]);
        let mut s: Vec<Complex> = (0..computed)
            .map(|i| Complex::new(even_re[i] + odd_re[i], even_im[i] + odd_im[i]))
            .collect();
        s.extend(
            (0..n - computed)
                .rev()
                .map(|i| Complex::new(even_re[i] - odd_re[i], even_im[i] - odd_im[i])),
        );
        s
    });
    (s1, s2)
}

/// Where the amplitudes of a block of angles go.
enum Output<'a> {
    /// Kept: even and odd parts of `S1`, then of `S2`, real and imaginary.
    Parts(&'a mut [Vec<f64>; 8]),
    /// Turned into matrix elements and added up.
    Matrix { weight: f64, sum: &'a mut MatrixSum },
}

/// Angles in a block. Measured: with AVX-512 they just fit the registers together with all sums; with AVX2 they spill, and
/// 16 still beat 4 and 8 by a factor of 2, which LLVM vectorises worse.
const WIDTH: usize = 16;

/// Runs the kernel in the widest instructions that the machine has.
#[multiversion(targets("x86_64+avx512f+avx512dq+fma", "x86_64+avx2+fma"))]
fn run(terms: &[[Term; 2]], cos_theta: &[f64], output: &mut Output) {
    const FUSED: bool =
        selected_target!().supports_feature_str("fma") || cfg!(target_arch = "aarch64");
    blocks::<WIDTH, FUSED>(terms, cos_theta, output);
}

#[inline(always)]
fn blocks<const W: usize, const FUSED: bool>(
    terms: &[[Term; 2]],
    cos_theta: &[f64],
    output: &mut Output,
) {
    for (block, chunk) in cos_theta.chunks(W).enumerate() {
        let mut mu = [0.0; W];
        mu[..chunk.len()].copy_from_slice(chunk);
        let parts = series::<W, FUSED>(terms, &mu);
        let range = block * W..block * W + chunk.len();
        match output {
            Output::Parts(out) => {
                for (out, part) in out.iter_mut().zip(&parts) {
                    out[range.clone()].copy_from_slice(&part[..chunk.len()]);
                }
            }
            Output::Matrix { weight, sum } => {
                add_matrix(&mut sum.forward, &parts, 1.0, *weight, range.clone());
                add_matrix(&mut sum.backward, &parts, -1.0, *weight, range);
            }
        }
    }
}

/// Adds the matrix elements of a block at `sign · μ` to the sums over spheres.
#[inline(always)]
fn add_matrix<const W: usize>(
    sum: &mut [Vec<f64>; 4],
    parts: &[[f64; W]; 8],
    sign: f64,
    weight: f64,
    range: std::ops::Range<usize>,
) {
    let elements = matrix(parts, sign);
    for (sum, element) in sum.iter_mut().zip(&elements) {
        for (sum, &e) in sum[range.clone()].iter_mut().zip(element) {
            *sum += weight * e;
        }
    }
}

/// S11, S12, S33, S34 from the parts of the amplitudes, at `sign · μ`.
#[inline(always)]
fn matrix<const W: usize>(parts: &[[f64; W]; 8], sign: f64) -> [[f64; W]; 4] {
    let mut out = [[0.0; W]; 4];
    for l in 0..W {
        let [r1, i1] = [0, 1].map(|p| parts[p][l] + sign * parts[p + 2][l]);
        let [r2, i2] = [4, 5].map(|p| parts[p][l] + sign * parts[p + 2][l]);
        let (s1, s2) = (r1 * r1 + i1 * i1, r2 * r2 + i2 * i2);
        out[0][l] = 0.5 * (s2 + s1);
        out[1][l] = 0.5 * (s2 - s1);
        // Re and Im of S2 S1*
        out[2][l] = r2 * r1 + i2 * i1;
        out[3][l] = i2 * r1 - r2 * i1;
    }
    out
}

/// Even and odd parts of `S1` and `S2` at a block of cosines: `[S1 even re, im, odd re, im, S2 even …]`.
#[inline(always)]
fn series<const W: usize, const FUSED: bool>(terms: &[[Term; 2]], mu: &[f64; W]) -> [[f64; W]; 8] {
    let mut s1_even = [[0.0; W]; 2];
    let mut s1_odd = [[0.0; W]; 2];
    let mut s2_even = [[0.0; W]; 2];
    let mut s2_odd = [[0.0; W]; 2];
    let mut pi = [1.0; W];
    let mut pi_before = [0.0; W];
    for [odd, even] in terms {
        // π_1, π_3, … are even in μ, τ_1, τ_3, … odd; the other way round for even n.
        let tau = advance::<W, FUSED>(odd, mu, &mut pi, &mut pi_before);
        add::<W, FUSED>(&mut s1_even, odd.a, &pi_before);
        add::<W, FUSED>(&mut s1_odd, odd.b, &tau);
        add::<W, FUSED>(&mut s2_odd, odd.a, &tau);
        add::<W, FUSED>(&mut s2_even, odd.b, &pi_before);
        let tau = advance::<W, FUSED>(even, mu, &mut pi, &mut pi_before);
        add::<W, FUSED>(&mut s1_odd, even.a, &pi_before);
        add::<W, FUSED>(&mut s1_even, even.b, &tau);
        add::<W, FUSED>(&mut s2_even, even.a, &tau);
        add::<W, FUSED>(&mut s2_odd, even.b, &pi_before);
    }
    [
        s1_even[0], s1_even[1], s1_odd[0], s1_odd[1], s2_even[0], s2_even[1], s2_odd[0], s2_odd[1],
    ]
}

/// One step of the angular recurrence (Wiscombe 1980): returns `τ_n`; `π_n` moves to `before`, `π_{n+1}` to `pi`.
#[inline(always)]
fn advance<const W: usize, const FUSED: bool>(
    term: &Term,
    mu: &[f64; W],
    pi: &mut [f64; W],
    before: &mut [f64; W],
) -> [f64; W] {
    let mut tau = [0.0; W];
    for l in 0..W {
        let s = mu[l] * pi[l];
        let t = s - before[l];
        tau[l] = mul_add::<FUSED>(term.n, t, -before[l]);
        before[l] = pi[l];
        pi[l] = mul_add::<FUSED>(term.step, t, s);
    }
    tau
}

#[inline(always)]
fn add<const W: usize, const FUSED: bool>(
    sum: &mut [[f64; W]; 2],
    coefficient: Complex,
    function: &[f64; W],
) {
    for l in 0..W {
        sum[0][l] = mul_add::<FUSED>(coefficient.re, function[l], sum[0][l]);
        sum[1][l] = mul_add::<FUSED>(coefficient.im, function[l], sum[1][l]);
    }
}

/// `a b + c`, fused where the machine has the instruction (the library's emulation is 50 times slower).
#[inline(always)]
fn mul_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED {
        a.mul_add(b, c)
    } else {
        a * b + c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitudes by Bohren & Huffman's eqs. 4.47 and 4.74 as they stand, one angle and one term at a time.
    fn plain(a: &[Complex], b: &[Complex], mu: f64) -> [Complex; 2] {
        let (mut s1, mut s2) = (Complex::default(), Complex::default());
        let (mut pi_before, mut pi) = (0.0, 1.0);
        for (i, (&a_n, &b_n)) in a.iter().zip(b).enumerate() {
            let n = (i + 1) as f64;
            let tau = n * mu * pi - (n + 1.0) * pi_before;
            let factor = (2.0 * n + 1.0) / (n * (n + 1.0));
            s1 += (a_n * pi + b_n * tau) * factor;
            s2 += (a_n * tau + b_n * pi) * factor;
            let next = ((2.0 * n + 1.0) * mu * pi - (n + 1.0) * pi_before) / n;
            (pi_before, pi) = (pi, next);
        }
        [s1, s2]
    }

    /// The block, fused or not, must agree with the plain sum; an odd number of terms included.
    #[test]
    fn blocks_agree_with_the_plain_sum() {
        let x = 30.0;
        let sphere = crate::optics::mie(1.5, 0.01, x).unwrap();
        let mu: [f64; WIDTH] = std::array::from_fn(|i| 1.0 - i as f64 / 15.0);
        for drop in [0, 1] {
            let (a, b) = (&sphere.a[drop..], &sphere.b[drop..]);
            let terms = Terms::new(a, b);
            let check = |parts: &dyn Fn(usize) -> f64, mu: f64| {
                for sign in [1.0, -1.0] {
                    for (element, s) in plain(a, b, sign * mu).iter().enumerate() {
                        let re = parts(4 * element) + sign * parts(4 * element + 2);
                        let im = parts(4 * element + 1) + sign * parts(4 * element + 3);
                        let error = (Complex::new(re, im) - *s).norm_sqr().sqrt();
                        assert!(error < 1e-11 * x * x, "{mu} {error}");
                    }
                }
            };
            let fused = series::<WIDTH, true>(&terms.0, &mu);
            let separate = series::<WIDTH, false>(&terms.0, &mu);
            for l in 0..WIDTH {
                check(&|part| fused[part][l], mu[l]);
                check(&|part| separate[part][l], mu[l]);
            }
        }
    }
}
