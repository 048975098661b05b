//! Rows of f32, one value per wavelength, padded with zeros to whole blocks.
//!
//! A row's length is a multiple of [`BLOCK`], so every loop below runs over whole blocks and vectorises. Sums keep
//! [`BLOCK`] partial sums and add them in a fixed tree: the result has the same bits on every vector width.

/// Values in a block: one 512-bit register, two of 256 bits, or four of 128.
pub const BLOCK: usize = 16;

/// The values of one block.
pub type Block = [f32; BLOCK];

/// A block from a function of the place in it. Loops over blocks work on copies like this one: the compiler then knows that
/// what is written does not overlap what is read.
#[inline(always)]
pub fn each(f: impl Fn(usize) -> f32) -> Block {
    let mut out = [0.0; BLOCK];
    for (i, v) in out.iter_mut().enumerate() {
        *v = f(i);
    }
    out
}

/// The block of a row that begins at an index; zeros if none does.
#[inline(always)]
pub fn block(row: &[f32], at: usize) -> &Block {
    row[at..].first_chunk().unwrap_or(&[0.0; BLOCK])
}

/// The blocks of a row. Several rows go through a loop together by `zip`, which then counts one number only.
#[inline(always)]
pub fn blocks(row: &[f32]) -> std::slice::Iter<'_, Block> {
    row.as_chunks().0.iter()
}

/// The blocks of a row, to be written.
#[inline(always)]
pub fn blocks_mut(row: &mut [f32]) -> std::slice::IterMut<'_, Block> {
    row.as_chunks_mut().0.iter_mut()
}

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

/// `Σ a` of one block.
#[inline(always)]
pub fn tree_sum(a: Block) -> f32 {
    // Without these stops the compiler spreads the tree backwards over the loop that filled the block, and shuffles more than it
    // adds there.
    let a = std::hint::black_box(a);
    let mut eight = [0.0; 8];
    for k in 0..8 {
        eight[k] = a[k] + a[k + 8];
    }
    let a = std::hint::black_box(eight);
    let four = [a[0] + a[4], a[1] + a[5], a[2] + a[6], a[3] + a[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}

/// The sum of all blocks.
#[inline(always)]
pub fn sum_of_blocks(a: &[f32]) -> Block {
    let mut acc = [0.0; BLOCK];
    for &a in blocks(a) {
        acc = each(|i| acc[i] + a[i]);
    }
    acc
}

/// `Σ a`.
#[inline(always)]
pub fn sum(a: &[f32]) -> f32 {
    tree_sum(sum_of_blocks(a))
}

/// `Σ a·b`.
#[inline(always)]
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut acc = [0.0; BLOCK];
    for (&a, &b) in blocks(a).zip(blocks(b)) {
        acc = each(|i| acc[i] + a[i] * b[i]);
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
    for (out, (a, b)) in blocks_mut(out).zip(blocks(a).zip(blocks(b))) {
        *out = lerp_block(a, b, t);
    }
    for i in out.len() / BLOCK * BLOCK..out.len() {
        out[i] = a[i] + t * (b[i] - a[i]);
    }
}

/// `a + t (b − a)` of one block.
#[inline(always)]
pub fn lerp_block(a: &Block, b: &Block, t: f32) -> Block {
    let (a, b) = (*a, *b);
    each(|i| a[i] + t * (b[i] - a[i]))
}

/// `out = exp(−tau)` with a relative error below `2.4e-7 + 1e-7 tau`: tau itself is known no better in f32. Below 1e-38 it
/// stays there. `tau` ≥ 0, same length as `out`.
#[inline(always)]
pub fn exp_neg(tau: &[f32], out: &mut [f32]) {
    for (out, tau) in blocks_mut(out).zip(blocks(tau)) {
        *out = exp_neg_block(tau);
    }
    for i in out.len() / BLOCK * BLOCK..out.len() {
        out[i] = exp_and_loss(tau[i]).0;
    }
}

/// [`exp_neg`] of one block.
#[inline(always)]
pub fn exp_neg_block(tau: &Block) -> Block {
    let tau = *tau;
    each(|i| exp_and_loss(tau[i]).0)
}

/// `exp(−tau)` and `1 − exp(−tau)`, both to the relative error of [`exp_neg`]; `tau` ≥ 0.
///
/// `2^x = 2^n + 2^n (2^f − 1)` with n the nearest integer, put straight into the exponent, and a polynomial for |f| ≤ ½ that
/// vanishes at 0, so that a small loss keeps its digits.
#[inline(always)]
pub fn exp_and_loss(tau: f32) -> (f32, f32) {
    // Adding 1.5 · 2²³ leaves the nearest integer in the low bits of the sum.
    const MAGIC: f32 = 12_582_912.0;
    let x = (tau * -std::f32::consts::LOG2_E).max(-126.0);
    let shifted = x + MAGIC;
    let f = x - (shifted - MAGIC);
    // (2^f − 1) / f, by the polynomial of least error: 9e-8 of 2^f.
    let p = 9.671_512e-3 + f * 1.326_472_6e-3;
    let p = 5.550_733_7e-2 + f * p;
    let p = 2.402_224_2e-1 + f * p;
    let p = 6.931_469_4e-1 + f * p;
    let exponent = shifted
        .to_bits()
        .wrapping_sub(MAGIC.to_bits())
        .wrapping_add(127)
        << 23;
    let scale = f32::from_bits(exponent);
    let rest = scale * (f * p);
    (scale + rest, (1.0 - scale) - rest)
}

/// `1 / √x` with a relative error below 3e-7; x > 0. Several times as quick as a root and a division.
///
/// Halving the exponent in the bits gives a guess good to 3.5 %, and Newton's step squares the error.
#[inline(always)]
pub fn inverse_sqrt(x: f32) -> f32 {
    let guess = f32::from_bits(0x5f37_59df_u32.wrapping_sub(x.to_bits() >> 1));
    let newton = |y: f32| y * (1.5 - (0.5 * x * y) * y);
    newton(newton(newton(guess)))
}

/// Index of the value that a walk along the partial sums of `a` first carries past `target`.
///
/// With `target = u · Σa`, u in [0, 1), index `i` comes out with probability `a[i] / Σa`. Zero entries are never
/// chosen; rounding at the far end falls back to the last entry above zero.
#[inline(always)]
pub fn pick(a: &[f32], mut target: f32) -> usize {
    // Whole blocks first: their sums do not wait for each other.
    let mut at = 0;
    for block in blocks(a) {
        let sum = tree_sum(*block);
        if target < sum {
            break;
        }
        target -= sum;
        at += BLOCK;
    }
    for (i, &v) in a.iter().enumerate().skip(at) {
        target -= v;
        if target < 0.0 && v > 0.0 {
            return i;
        }
    }
    a.iter().rposition(|&v| v > 0.0).unwrap_or(0)
}

/// As [`pick`] with the values in another order, by the sum of all blocks of `a`: down the tree of [`tree_sum`] to a place in the
/// blocks, then along the blocks.
#[inline(always)]
pub fn pick_by(a: &[f32], sums: &Block, mut target: f32) -> usize {
    let sums = std::hint::black_box(*sums);
    let (mut eight, mut four) = ([0.0; 8], [0.0; 4]);
    for k in 0..8 {
        eight[k] = sums[k] + sums[k + 8];
    }
    for k in 0..4 {
        four[k] = eight[k] + eight[k + 4];
    }
    let (mut at, mut go) = (0, |at: &mut usize, left: f32, step: usize| {
        let right = target >= left;
        target -= if right { left } else { 0.0 };
        *at += if right { step } else { 0 };
    });
    go(&mut at, four[0] + four[2], 1);
    let left = four[at];
    go(&mut at, left, 2);
    let left = eight[at];
    go(&mut at, left, 4);
    let left = sums[at];
    go(&mut at, left, 8);
    for i in (at..a.len()).step_by(BLOCK) {
        target -= a[i];
        if target < 0.0 && a[i] > 0.0 {
            return i;
        }
    }
    a.iter().rposition(|&v| v > 0.0).unwrap_or(0)
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
        for tau in [1e-7f32, 1e-5, 1e-3, 0.1, 0.4, 2.0] {
            let exact = -(-f64::from(tau)).exp_m1();
            assert!(
                (f64::from(exp_and_loss(tau).1) / exact - 1.0).abs() < 5e-7,
                "{tau}"
            );
        }
        exp_neg(&[0.0, 1e4, 50.0, 0.0], &mut out[..4]);
        assert_eq!(out[0], 1.0);
        assert!(out[1] < 2e-38);
    }

    #[test]
    fn inverse_sqrt_keeps_its_stated_error() {
        for i in 0..200_000 {
            let x = 1e-6f32 * (1.0 + 1.5e-4 * i as f32).powi(6);
            let exact = 1.0 / f64::from(x).sqrt();
            let error = f64::from(inverse_sqrt(x)) / exact - 1.0;
            assert!(error.abs() < 3e-7, "{x}: {error:e}");
        }
    }

    #[test]
    fn pick_never_returns_padding_or_zeros() {
        let a = row_from(5, |i| if i == 2 { 0.0 } else { 1.0 });
        assert_eq!(pick(&a, 0.0), 0);
        assert_eq!(pick(&a, 2.5), 3);
        assert_eq!(pick(&a, 4.0), 4);
    }

    /// Rationale: the tree draws the values in another order than the walk. Expected: over an even grid of targets every index
    /// still comes out as often as its value says, zeros and padding never.
    #[test]
    fn the_tree_picks_in_proportion() {
        let a = row_from(37, |i| if i % 5 == 2 { 0.0 } else { 1.0 + i as f64 });
        let sums = sum_of_blocks(&a);
        let (total, n) = (tree_sum(sums), 200_000);
        let mut seen = vec![0; a.len()];
        for i in 0..n {
            seen[pick_by(&a, &sums, (i as f32 + 0.5) / n as f32 * total)] += 1;
        }
        for (&seen, &a) in seen.iter().zip(&a) {
            let expected = a / total * n as f32;
            assert!((seen as f32 - expected).abs() <= 3.0, "{seen} {expected}");
        }
        assert!(a[pick_by(&a, &sums, total)] > 0.0);
    }
}
