//! Rows of f32, one value per wavelength, padded with zeros to whole blocks.
//!
//! A row's length is a multiple of [`BLOCK`], so every loop below runs over whole blocks and vectorises. Sums keep
//! [`BLOCK`] partial sums and add them in a fixed tree: the result has the same bits on every vector width.

/// Values in a block: one 512-bit register, two of 256 bits, or four of 128.
pub const BLOCK: usize = 16;

/// Length of a row that holds `n` values.
pub const fn padded(n: usize) -> usize {
    n.div_ceil(BLOCK) * BLOCK
}

/// A row of `n` values from `f(i)`, padded with zeros.
pub fn row_from(n: usize, mut f: impl FnMut(usize) -> f64) -> Vec<f32> {
    let mut row = vec![0.0; padded(n)];
    for (i, v) in row[..n].iter_mut().enumerate() {
        *v = f(i) as f32;
    }
    row
}

#[inline(always)]
fn tree_sum(mut a: [f32; BLOCK]) -> f32 {
    let mut width = BLOCK / 2;
    while width > 0 {
        for k in 0..width {
            a[k] += a[k + width];
        }
        width /= 2;
    }
    a[0]
}

/// `Σ a`.
#[inline(always)]
pub fn sum(a: &[f32]) -> f32 {
    let mut acc = [0.0; BLOCK];
    for a in a.chunks_exact(BLOCK) {
        for k in 0..BLOCK {
            acc[k] += a[k];
        }
    }
    tree_sum(acc)
}

/// `Σ a·b`.
#[inline(always)]
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut acc = [0.0; BLOCK];
    for (a, b) in a.chunks_exact(BLOCK).zip(b.chunks_exact(BLOCK)) {
        for k in 0..BLOCK {
            acc[k] += a[k] * b[k];
        }
    }
    tree_sum(acc)
}

/// `a·s`, in place.
#[inline(always)]
pub fn scale(a: &mut [f32], s: f32) {
    for a in a {
        *a *= s;
    }
}

/// `out += a·s`.
#[inline(always)]
pub fn add_scaled(a: &[f32], s: f32, out: &mut [f32]) {
    let n = out.len();
    let a = &a[..n];
    for i in 0..n {
        out[i] += a[i] * s;
    }
}

/// `out = a + t (b − a)`.
#[inline(always)]
pub fn lerp(a: &[f32], b: &[f32], t: f32, out: &mut [f32]) {
    let n = out.len();
    let (a, b) = (&a[..n], &b[..n]);
    for i in 0..n {
        out[i] = a[i] + t * (b[i] - a[i]);
    }
}

/// `out = exp(−tau)` with a relative error below `2.4e-7 + 1e-7 tau`: tau itself is known no better in f32. Below 1e-38 it
/// stays there. `tau` ≥ 0, same length as `out`.
///
/// `2^x = 2^n · 2^f` with n the nearest integer, put straight into the exponent, and a polynomial for |f| ≤ ½.
#[inline(always)]
pub fn exp_neg(tau: &[f32], out: &mut [f32]) {
    // Adding 1.5 · 2²³ leaves the nearest integer in the low bits of the sum.
    const MAGIC: f32 = 12_582_912.0;
    let n = out.len();
    let tau = &tau[..n];
    for i in 0..n {
        let x = (tau[i] * -std::f32::consts::LOG2_E).max(-126.0);
        let shifted = x + MAGIC;
        let f = x - (shifted - MAGIC);
        // Taylor's series of 2^f, ln2^k / k!; the first term left out is 1e-9.
        let p = 1.540_353e-4 + f * 1.525_273_4e-5;
        let p = 1.333_355_8e-3 + f * p;
        let p = 9.618_129e-3 + f * p;
        let p = 5.550_411e-2 + f * p;
        let p = 2.402_265e-1 + f * p;
        let p = 6.931_472e-1 + f * p;
        let p = 1.0 + f * p;
        let exponent = shifted
            .to_bits()
            .wrapping_sub(MAGIC.to_bits())
            .wrapping_add(127)
            << 23;
        out[i] = p * f32::from_bits(exponent);
    }
}

/// Index of the value that a walk along the partial sums of `a` first carries past `target`.
///
/// With `target = u · Σa`, u in [0, 1), index `i` comes out with probability `a[i] / Σa`. Zero entries are never
/// chosen; rounding at the far end falls back to the last entry above zero.
#[inline(always)]
pub fn pick(a: &[f32], mut target: f32) -> usize {
    let mut last = 0;
    for (i, &v) in a.iter().enumerate() {
        if v > 0.0 {
            last = i;
            target -= v;
            if target < 0.0 {
                return i;
            }
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_and_dots_agree_with_f64() {
        let a = row_from(81, |i| (i as f64 * 0.37).sin());
        let b = row_from(81, |i| (i as f64 * 0.11).cos());
        let exact_sum: f64 = a.iter().map(|&v| f64::from(v)).sum();
        let exact_dot: f64 = a
            .iter()
            .zip(&b)
            .map(|(&x, &y)| f64::from(x) * f64::from(y))
            .sum();
        assert!((f64::from(sum(&a)) - exact_sum).abs() < 1e-5);
        assert!((f64::from(dot(&a, &b)) - exact_dot).abs() < 1e-5);
    }

    #[test]
    fn exp_keeps_its_stated_error() {
        let tau: Vec<f32> = (0..160_000).map(|i| i as f32 * 5e-4).collect();
        let mut out = vec![0.0; tau.len()];
        exp_neg(&tau, &mut out);
        for (&t, &e) in tau.iter().zip(&out) {
            let exact = (-f64::from(t)).exp();
            // The rounding of tau · log₂e, half an ulp of up to tau · 1.2e-7, adds to the polynomial's own error.
            let allowed = 2.4e-7 + 1e-7 * f64::from(t);
            assert!((f64::from(e) / exact - 1.0).abs() < allowed, "{t}");
        }
        exp_neg(&[0.0, 1e4, 50.0, 0.0], &mut out[..4]);
        assert_eq!(out[0], 1.0);
        assert!(out[1] < 2e-38);
    }

    #[test]
    fn pick_never_returns_padding_or_zeros() {
        let a = row_from(5, |i| if i == 2 { 0.0 } else { 1.0 });
        assert_eq!(pick(&a, 0.0), 0);
        assert_eq!(pick(&a, 2.5), 3);
        assert_eq!(pick(&a, 4.0), 4);
    }
}
