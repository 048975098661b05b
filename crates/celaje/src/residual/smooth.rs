//! A smooth field through noisy values in some directions: weighted least squares in low-degree polynomials, of which only those
//! are kept that stand out of the noise.

/// Largest degree of the polynomials, and how many terms that makes in two variables.
const DEGREE: usize = 3;
const TERMS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;

/// How often pure noise may bring about any term at all, in all fits of one picture \[1\].
pub const FALSE_ALARMS: f64 = 0.01;
/// Most degrees that are judged for one picture: those of every mode in wavelength on both sides of the horizon.
const JUDGED: f64 = ((DEGREE + 1) * super::spectral::MODES * 2) as f64;

/// Directions for each term of the polynomials, at least; and directions without which nothing is fitted.
const DIRECTIONS_PER_TERM: usize = 3;
const LEAST_DIRECTIONS: usize = 12;

/// A polynomial in two variables; its coefficients belong to `x^(d − k) y^k`, degree by degree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Polynomial([f64; TERMS]);

impl Polynomial {
    /// Its value at a place.
    pub fn at(&self, place: [f64; 2]) -> f64 {
        let terms = terms(place);
        self.0.iter().zip(terms).map(|(c, t)| c * t).sum()
    }

    /// Whether it is zero everywhere.
    pub fn is_zero(&self) -> bool {
        self.0.iter().all(|&c| c == 0.0)
    }

    /// Fits values at some places, as far as they are more than noise.
    ///
    /// The terms are made orthogonal, degree by degree; those of one degree p together are kept if noise alone would make them
    /// as large in less than [`FALSE_ALARMS`] of all pictures (Fisher's test of their sum of squares against what no term
    /// explains), and then shrunk by `1 − 1/F`, the share of the sum that is not noise. Values without noise that a polynomial
    /// explains come back exactly.
    ///
    /// * `weights` — of the values: the inverse of their variances, up to a common factor
    pub fn fit(places: &[[f64; 2]], values: &[f64], weights: &[f64]) -> Self {
        let n = values.len();
        if n < LEAST_DIRECTIONS {
            return Self::default();
        }
        let most = n / DIRECTIONS_PER_TERM;
        let degree = (0..=DEGREE).rev().find(|&d| count(d) <= most).unwrap_or(0);
        let basis = Orthogonal::new(places, weights, count(degree));
        let mut amplitudes = basis.project(values);
        // What no term explains is the noise.
        let mut left = 0.0;
        for ((&value, &weight), row) in values.iter().zip(weights).zip(&basis.rows) {
            let explained: f64 = row.iter().zip(&amplitudes).map(|(q, a)| q * a).sum();
            left += weight * (value - explained) * (value - explained);
        }
        let free = n - count(degree);
        let noise = left / free as f64;
        for d in 0..=degree {
            let of_degree = &mut amplitudes[count(d) - (d + 1)..count(d)];
            let mean = of_degree.iter().map(|a| a * a).sum::<f64>() / (d + 1) as f64;
            let kept = if mean > 0.0 && chance(mean / noise, d + 1, free) < FALSE_ALARMS / JUDGED {
                1.0 - noise / mean
            } else {
                0.0
            };
            of_degree.iter_mut().for_each(|a| *a *= kept);
        }
        Self(basis.coefficients(&amplitudes))
    }
}

/// Terms up to a degree.
const fn count(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// The terms at a place, degree by degree.
fn terms([x, y]: [f64; 2]) -> [f64; TERMS] {
    let mut out = [0.0; TERMS];
    let mut next = 0;
    for d in 0..=DEGREE {
        for k in 0..=d {
            out[next] = x.powi((d - k) as i32) * y.powi(k as i32);
            next += 1;
        }
    }
    out
}

/// The terms made orthogonal over the places of a fit (Gram and Schmidt).
struct Orthogonal {
    weights: Vec<f64>,
    /// Values at each place.
    rows: Vec<[f64; TERMS]>,
    /// `term_k = Σ_i mix[i][k] q_i`.
    mix: [[f64; TERMS]; TERMS],
}

impl Orthogonal {
    fn new(places: &[[f64; 2]], weights: &[f64], terms_used: usize) -> Self {
        /// What is left of a term, against itself, that other terms explain.
        const NOTHING: f64 = 1e-9;
        let mut basis = Self {
            weights: weights.to_vec(),
            rows: vec![[0.0; TERMS]; places.len()],
            mix: [[0.0; TERMS]; TERMS],
        };
        for k in 0..terms_used {
            let mut column: Vec<f64> = places.iter().map(|&p| terms(p)[k]).collect();
            let before = basis.norm(&column);
            // Twice, for rounding.
            for _ in 0..2 {
                for (i, along) in basis.project(&column).into_iter().enumerate().take(k) {
                    for (c, row) in column.iter_mut().zip(&basis.rows) {
                        *c -= along * row[i];
                    }
                    basis.mix[i][k] += along;
                }
            }
            let norm = basis.norm(&column);
            if norm > NOTHING * before {
                basis.mix[k][k] = norm;
                for (c, row) in column.iter().zip(&mut basis.rows) {
                    row[k] = c / norm;
                }
            }
        }
        basis
    }

    fn norm(&self, column: &[f64]) -> f64 {
        let squares = column.iter().zip(&self.weights).map(|(c, w)| w * c * c);
        squares.sum::<f64>().sqrt()
    }

    /// Amplitudes of the orthogonal terms in values at the places.
    fn project(&self, values: &[f64]) -> [f64; TERMS] {
        let mut out = [0.0; TERMS];
        for ((value, weight), row) in values.iter().zip(&self.weights).zip(&self.rows) {
            for (o, q) in out.iter_mut().zip(row) {
                *o += weight * value * q;
            }
        }
        out
    }

    /// The coefficients of the terms themselves, by substitution from the last; terms that others explain have none.
    fn coefficients(&self, amplitudes: &[f64; TERMS]) -> [f64; TERMS] {
        let mut out = [0.0; TERMS];
        for k in (0..TERMS).rev() {
            if self.mix[k][k] > 0.0 {
                let later: f64 = (k + 1..TERMS).map(|i| self.mix[k][i] * out[i]).sum();
                out[k] = (amplitudes[k] - later) / self.mix[k][k];
            }
        }
        out
    }
}

/// The chance of a ratio of variances at least as large as `f`, with `above` and `below` degrees of freedom, by noise alone.
///
/// `∫ (1 − s²)^(below/2 − 1) s^(above − 1) ds` from `s² = above f / (below + above f)` to 1, over that from 0.
fn chance(f: f64, above: usize, below: usize) -> f64 {
    const INTERVALS: usize = 400;
    if !f.is_finite() {
        return 0.0;
    }
    let (above, below) = (above as f64, below as f64);
    let density = |s: f64| (1.0 - s * s).max(0.0).powf(0.5 * below - 1.0) * s.powf(above - 1.0);
    // Simpson's rule.
    let integral = |from: f64| {
        let step = (1.0 - from) / INTERVALS as f64;
        let weight = |i: usize| match i {
            0 | INTERVALS => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let points = (0..=INTERVALS).map(|i| weight(i) * density(from + i as f64 * step));
        points.sum::<f64>() * step / 3.0
    };
    let from = (above * f / (below + above * f)).sqrt();
    integral(from) / integral(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    fn places(n: usize) -> Vec<[f64; 2]> {
        let step = |i: usize, by: f64| (0.5 + i as f64 * by).fract();
        (0..n)
            .map(|i| [2.0 * step(i, 0.7549) - 1.0, step(i, 0.5698)])
            .collect()
    }

    /// Normal deviates by the central limit of twelve.
    fn normal(rng: &mut Rng) -> f64 {
        (0..12).map(|_| rng.uniform()).sum::<f64>() - 6.0
    }

    /// Expected: quantiles of tables (Abramowitz & Stegun 1964, table 26.9).
    #[test]
    fn chances_are_those_of_tables() {
        for (f, above, below, expected) in [
            (4.0847, 1, 40, 0.05),
            (5.1785, 2, 40, 0.01),
            (6.5945, 3, 40, 0.001),
            (4.3512, 1, 20, 0.05),
        ] {
            let got = chance(f, above, below);
            assert!((got / expected - 1.0).abs() < 2e-3, "{f}: {got}");
        }
    }

    /// Rationale: what a field says must be believed where there is no noise. Expected: a cubic comes back to rounding.
    #[test]
    fn a_cubic_without_noise_comes_back() {
        let cubic = |[x, y]: [f64; 2]| 0.01 - 0.02 * x + 0.005 * y * y * x - 0.03 * y.powi(3);
        let places = places(50);
        let values: Vec<f64> = places.iter().map(|&p| cubic(p)).collect();
        let weights: Vec<f64> = (0..50).map(|i| 1.0 + f64::from(i % 7)).collect();
        let fit = Polynomial::fit(&places, &values, &weights);
        for p in [[0.3, 0.2], [-0.9, 0.95], [0.0, 0.5]] {
            assert!((fit.at(p) - cubic(p)).abs() < 1e-10, "{p:?}");
        }
        // On one azimuth x tells nothing beside 1; the rest is found.
        let line: Vec<[f64; 2]> = places.iter().map(|p| [0.5, p[1]]).collect();
        let values: Vec<f64> = line.iter().map(|&p| cubic(p)).collect();
        let fit = Polynomial::fit(&line, &values, &weights);
        assert!((fit.at([0.5, 0.4]) - cubic([0.5, 0.4])).abs() < 1e-9);
    }

    /// Rationale: noise must not become a correction. Expected: of 4000 fits of noise alone, each with the four degrees of one mode on
    /// one side, at most 20 keep any term: the rate stated is 0.01/6, that is 6.7, and more than 20 have a chance of 10⁻⁵. What
    /// they keep is below the noise of one direction.
    #[test]
    fn noise_is_left_alone() {
        let places = places(50);
        let mut rng = Rng::new(7, 0);
        let weights: Vec<f64> = (0..50).map(|i| 1.0 / (1.0 + f64::from(i % 3))).collect();
        let mut alarms = 0;
        for _ in 0..4000 {
            let values: Vec<f64> = weights
                .iter()
                .map(|w| normal(&mut rng) / w.sqrt())
                .collect();
            let fit = Polynomial::fit(&places, &values, &weights);
            if !fit.is_zero() {
                alarms += 1;
                let squares = places.iter().map(|&p| fit.at(p).powi(2)).sum::<f64>();
                assert!((squares / 50.0).sqrt() < 1.5);
            }
        }
        assert!(alarms <= 20, "{alarms}");
    }

    /// Expected: of fields three times as large as the noise, found twenty times, what is left is a third of the noise (0.25 of it was
    /// simulated, with noise that differs); few directions are left alone.
    #[test]
    fn a_field_is_found_under_noise() {
        let places = places(50);
        let mut rng = Rng::new(11, 0);
        let field = |[x, y]: [f64; 2]| 3.0 * x + 2.0 * y;
        let mut squares = 0.0;
        for _ in 0..20 {
            let noisy = |&p: &[f64; 2]| field(p) + normal(&mut rng);
            let values: Vec<f64> = places.iter().map(noisy).collect();
            let fit = Polynomial::fit(&places, &values, &[1.0; 50]);
            let left = places.iter().map(|&p| (fit.at(p) - field(p)).powi(2));
            squares += left.sum::<f64>() / 50.0;
            assert!(Polynomial::fit(&places[..11], &values[..11], &[1.0; 11]).is_zero());
        }
        let rms = (squares / 20.0).sqrt();
        assert!(rms < 0.33, "{rms}");
    }
}
