//! The statistical tests that random code must pass: one harness for unit, system and reference tests.
//!
//! Rules (the reasons are in `docs/testing.md`): a test's seed is a hash of its name, never chosen; an estimator runs in
//! [`BATCHES`] independent batches and its mean is held against the truth by Student's t with `BATCHES − 1` degrees of
//! freedom, two-sided at [`ALPHA`]; several wavelengths of one run share their paths, so α is divided by their number
//! (Bonferroni); the standard error must meet the test's own bias budget, or a noisy test would pass anything; and the
//! skewness of single estimates must be small enough for the t distribution to hold.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// Two-sided false-positive rate of a single statistical test.
pub const ALPHA: f64 = 5e-6;

/// Independent batches behind each t test.
pub const BATCHES: usize = 64;

/// Largest skewness of a mean: with it a nominal false-positive rate of 10⁻⁵ is 1.3·10⁻⁵ in truth (simulated, for gamma-distributed
/// contributions).
pub const SKEWNESS: f64 = 0.02;

/// A seed from a test's name (FNV-1a).
pub fn seed_from_name(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// Two-sided p-value of Student's t.
pub fn student_p_value(t: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(d) => 2.0 * d.sf(t.abs()),
        Err(_) => f64::NAN,
    }
}

/// p-value of Pearson's χ² test; neighbouring cells are pooled until each expects at least 5.
///
/// `counts` and `expected` of equal length; the expectations add up to the number of samples.
pub fn chi_squared_p_value(counts: &[u64], expected: &[f64]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0u32);
    let (mut count, mut expect) = (0.0, 0.0);
    let mut rest: f64 = expected.iter().sum();
    for (&c, &e) in counts.iter().zip(expected) {
        count += c as f64;
        expect += e;
        rest -= e;
        if expect >= 5.0 && (rest >= 5.0 || rest.abs() < 1e-6) {
            statistic += (count - expect).powi(2) / expect;
            cells += 1;
            (count, expect) = (0.0, 0.0);
        }
    }
    if expect > 0.0 {
        statistic += (count - expect).powi(2) / expect;
        cells += 1;
    }
    match ChiSquared::new(f64::from(cells.max(2) - 1)) {
        Ok(d) => d.sf(statistic),
        Err(_) => f64::NAN,
    }
}

/// Mean of batch means, its standard error, and how skewed single estimates are.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    /// Mean over all batches.
    pub mean: f64,
    /// Standard error of that mean, from the scatter of the batches.
    pub standard_error: f64,
    /// Skewness of the batch means, a check that Student's t holds for them.
    pub skewness: f64,
}

/// Statistics of [`BATCHES`] (or any number ≥ 3 of) independent batch means.
pub fn estimate(batch_means: &[f64]) -> Estimate {
    let n = batch_means.len() as f64;
    let mean = batch_means.iter().sum::<f64>() / n;
    let moment = |k: i32| batch_means.iter().map(|v| (v - mean).powi(k)).sum::<f64>() / n;
    let variance = moment(2) * n / (n - 1.0);
    Estimate {
        mean,
        standard_error: (variance / n).sqrt(),
        skewness: if variance > 0.0 {
            moment(3) / moment(2).powf(1.5)
        } else {
            0.0
        },
    }
}

/// Makes sure that the t distribution holds: the skewness of the mean is that of the batch means over the root of their number,
/// and must be at most [`SKEWNESS`], as far as so many batches can tell.
///
/// The skewness of `n` normal numbers itself scatters by √(6/n): 0.31 for 64 batches, which therefore find crude skewness only
/// (1.7 in a batch mean), 0.08 for 1024.
///
/// # Panics
/// When it is larger by more than 4.99 such standard errors.
pub fn assert_not_skewed(name: &str, batch_means: &[f64]) {
    let n = batch_means.len() as f64;
    let skewness = estimate(batch_means).skewness;
    let limit = SKEWNESS * n.sqrt() + 4.99 * (6.0 / n).sqrt();
    assert!(
        skewness.abs() <= limit,
        "{name}: skewness {skewness:.2} of the batch means is over {limit:.2}: more paths are needed for t to hold"
    );
}

/// Holds an estimator against a known value.
///
/// # Arguments
/// * `batch_means` — means of independent batches of equal size, shape (b,)
/// * `truth` — the value that the estimator must have on average
/// * `budget` — largest standard error, relative to `truth`, with which the test has power. A bias of 7.3 standard
///   errors is then caught 99 times in 100.
/// * `comparisons` — how many results of the same run are tested (α is divided by it)
///
/// # Panics
/// When the standard error exceeds its budget, the batch means are skewed, or the t test fails, with the numbers.
pub fn assert_unbiased(
    name: &str,
    batch_means: &[f64],
    truth: f64,
    budget: f64,
    comparisons: usize,
) {
    let e = estimate(batch_means);
    let freedom = batch_means.len() as f64 - 1.0;
    assert!(
        e.standard_error <= budget * truth.abs(),
        "{name}: standard error {:.2e} is over the budget {budget:.1e} of {truth}: the test has no power",
        e.standard_error
    );
    assert_not_skewed(name, batch_means);
    // A standard error at the level of rounding cannot tell bias from rounding.
    let error = e.standard_error.max(4.0 * f64::EPSILON * truth.abs());
    let t = (e.mean - truth) / error;
    let p = student_p_value(t, freedom);
    assert!(
        p * comparisons as f64 > ALPHA,
        "{name}: {} against {truth} (ratio {:.5}), t = {t:.2}, p = {p:.1e} in {comparisons} comparisons",
        e.mean,
        e.mean / truth
    );
}

/// Holds two independent estimators against each other (Welch's t).
///
/// # Panics
/// As [`assert_unbiased`]; the budget is for the standard error of the difference, relative to the mean of both.
pub fn assert_equal(name: &str, a: &[f64], b: &[f64], budget: f64, comparisons: usize) {
    assert_not_skewed(name, a);
    assert_not_skewed(name, b);
    assert_equal_with_tails(name, a, b, budget, comparisons);
}

/// As [`assert_equal`], for estimators whose heavy tails no affordable number of paths outgrows: batch means may be skewed. The
/// rate of false alarms is then higher than α by what `docs/testing.md` tells: some hundredfold at a skewness of 2.
///
/// # Panics
/// When the standard error exceeds its budget, or the t test fails.
pub fn assert_equal_with_tails(name: &str, a: &[f64], b: &[f64], budget: f64, comparisons: usize) {
    let (ea, eb) = (estimate(a), estimate(b));
    let (va, vb) = (ea.standard_error.powi(2), eb.standard_error.powi(2));
    let error = (va + vb).sqrt();
    let middle = 0.5 * (ea.mean + eb.mean);
    assert!(
        error <= budget * middle.abs(),
        "{name}: standard error {error:.2e} is over the budget {budget:.1e} of {middle}: the test has no power"
    );
    let (na, nb) = (a.len() as f64 - 1.0, b.len() as f64 - 1.0);
    let freedom = (va + vb).powi(2) / (va * va / na + vb * vb / nb);
    let t = (ea.mean - eb.mean) / error;
    let p = student_p_value(t, freedom);
    assert!(
        p * comparisons as f64 > ALPHA,
        "{name}: {} against {} (ratio {:.5}), t = {t:.2}, p = {p:.1e} in {comparisons} comparisons",
        ea.mean,
        eb.mean,
        ea.mean / eb.mean
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator of its own, so that the harness depends on nothing it tests (SplitMix64).
    struct Stream(u64);

    impl Stream {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut x = self.0;
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }

        /// Batches of exponentially distributed numbers with mean 1.
        fn batches(&mut self, per_batch: usize, scale: f64) -> Vec<f64> {
            (0..BATCHES)
                .map(|_| {
                    let total: f64 = (0..per_batch).map(|_| -(1.0 - self.uniform()).ln()).sum();
                    scale * total / per_batch as f64
                })
                .collect()
        }
    }

    /// Under the truth, p-values are uniform: their own χ² test over 20 cells passes.
    #[test]
    fn p_values_are_uniform_under_truth() {
        let mut stream = Stream(seed_from_name("p values are uniform"));
        let mut counts = [0u64; 20];
        const TRIALS: usize = 4000;
        for _ in 0..TRIALS {
            let e = estimate(&stream.batches(256, 1.0));
            let p = student_p_value((e.mean - 1.0) / e.standard_error, BATCHES as f64 - 1.0);
            counts[((p * 20.0) as usize).min(19)] += 1;
        }
        let p = chi_squared_p_value(&counts, &[TRIALS as f64 / 20.0; 20]);
        assert!(p > ALPHA, "p = {p:e}");
    }

    /// Rationale: what skewed means do to the rate of false alarms is told in `docs/testing.md`, and must be true. Expected: for 64
    /// exponential batch means (skewness 2) 77 α with one comparison, 750 α/64 with 64, and 3.4 α with a skewness of 0.63 (sums of
    /// ten). Means are tilted to smaller values, where the alarms are, and each counts by the ratio of the densities.
    #[test]
    fn skewed_means_raise_false_alarms() {
        let mut stream = Stream(seed_from_name("skewed means raise false alarms"));
        let mut rate = |sum_of: usize, comparisons: f64, scale: f64| {
            const TRIALS: usize = 20_000;
            let mut alarms = 0.0;
            for _ in 0..TRIALS {
                let batches: Vec<f64> = stream.batches(sum_of, scale);
                let e = estimate(&batches);
                let t = (e.mean - 1.0) / e.standard_error;
                if student_p_value(t, BATCHES as f64 - 1.0) * comparisons < ALPHA {
                    let n = (BATCHES * sum_of) as f64;
                    alarms += (n * (scale.ln() + e.mean * (1.0 / scale - 1.0))).exp();
                }
            }
            alarms / TRIALS as f64 / (ALPHA / comparisons)
        };
        for (sum_of, comparisons, scale, expected) in [
            (1, 1.0, 0.65, 77.0),
            (1, 64.0, 0.6, 755.0),
            (10, 1.0, 0.9, 3.4),
        ] {
            let found = rate(sum_of, comparisons, scale);
            println!("{sum_of} {comparisons}: {found:.1} times the nominal rate");
            assert!((found / expected - 1.0).abs() < 0.2, "{found} {expected}");
        }
    }

    /// An estimator 1 % off, at a standard error of 0.1 %, fails.
    #[test]
    #[should_panic(expected = "ratio 1.0")]
    fn a_bias_of_one_per_cent_is_caught() {
        let mut stream = Stream(seed_from_name("a bias is caught"));
        assert_unbiased("biased", &stream.batches(16_384, 1.01), 1.0, 0.002, 1);
    }

    /// One contribution in three thousand makes up the mean, a tenth of one in a batch: a skewness of 3.4, where 64 batches find
    /// what is over 1.7.
    #[test]
    #[should_panic(expected = "skewness")]
    fn a_skewed_estimator_is_refused() {
        let mut stream = Stream(seed_from_name("skewed"));
        let batches: Vec<f64> = (0..BATCHES)
            .map(|_| (0..256).filter(|_| stream.uniform() < 1.0 / 3000.0).count() as f64)
            .collect();
        assert_unbiased("skewed", &batches, 256.0 / 3000.0, 1.0, 1);
    }

    #[test]
    #[should_panic(expected = "no power")]
    fn a_noisy_test_is_refused() {
        let mut stream = Stream(seed_from_name("noisy"));
        assert_unbiased("noisy", &stream.batches(4, 1.0), 1.0, 0.001, 1);
    }
}
