//! Wigner's functions `d^l_m,±2`: what Legendre's are for the radiance, they are for Q ± iU, which turn twice as fast as the
//! basis they refer to.

/// The functions of one order m ≥ 0, at all degrees up to some largest one, by the recurrence in l.
///
/// Signs are those of the derivatives of `P_l^m` taken without the Condon–Shortley phase, so that
/// `d^l_0,±2 = √((l − 2)!/(l + 2)!) P_l^2 ≥ 0` about the pole, and `d^l_2,2(1) = 1`. Norm: `∫ d² dx = 2/(2l + 1)`.
///
/// # Source
/// Varshalovich et al. 1988, Quantum Theory of Angular Momentum, section 4.8.
#[derive(Debug, Clone)]
pub struct SpinTwo {
    m: usize,
    /// Normalises the first function, of degree max(m, 2).
    start: f64,
    /// Of each degree l + 1 from those of l and l − 1: factors of `x d`, `d` (with the sign of the spin) and `d` before.
    steps: Vec<[f64; 3]>,
}

impl SpinTwo {
    /// The functions of order `m`, up to a degree.
    pub fn new(m: usize, degree: usize) -> Self {
        let first = m.max(2);
        let root = |l: f64| ((l * l - (m * m) as f64) * (l * l - 4.0)).max(0.0).sqrt();
        let steps = (first..degree.max(first)).map(|l| {
            let l = l as f64;
            let norm = l * root(l + 1.0);
            [
                (2.0 * l + 1.0) * l * (l + 1.0) / norm,
                (2.0 * l + 1.0) * 2.0 * m as f64 / norm,
                (l + 1.0) * root(l) / norm,
            ]
        });
        // √((2m)! / ((m + 2)! (m − 2)!)), the last ratio of which is 1 for m = 2.
        let start = (3..=m).map(|k| {
            let k = k as f64;
            (2.0 * k * (2.0 * k - 1.0) / ((k + 2.0) * (k - 2.0))).sqrt()
        });
        Self {
            m,
            start: start.product(),
            steps: steps.collect(),
        }
    }

    /// Degree of the first function that is not zero everywhere.
    pub fn first_degree(&self) -> usize {
        self.m.max(2)
    }

    /// `d^l_m,2(x)` and `d^l_m,−2(x)`, given to `put` degree by degree, beginning with [`SpinTwo::first_degree`].
    #[inline(always)]
    pub fn eval(&self, x: f64, mut put: impl FnMut(usize, f64, f64)) {
        let sin = (1.0 - x * x).max(0.0).sqrt();
        let (up, down) = (0.5 * (1.0 + x), 0.5 * (1.0 - x));
        let (mut plus, mut minus) = match self.m {
            0 => (0.375f64.sqrt() * sin * sin, 0.375f64.sqrt() * sin * sin),
            1 => (-sin * up, sin * down),
            m => {
                let scale = self.start * (0.5 * sin).powi(m as i32 - 2);
                (scale * up * up, scale * down * down)
            }
        };
        let (mut plus_before, mut minus_before) = (0.0, 0.0);
        let first = self.first_degree();
        put(first, plus, minus);
        for (k, [a, b, c]) in self.steps.iter().enumerate() {
            (plus_before, plus) = (plus, (a * x - b) * plus - c * plus_before);
            (minus_before, minus) = (minus, (a * x + b) * minus - c * minus_before);
            put(first + k + 1, plus, minus);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEGREE: usize = 9;

    fn values(m: usize, x: f64) -> Vec<[f64; 2]> {
        let mut all = vec![[0.0; 2]; DEGREE + 1];
        SpinTwo::new(m, DEGREE).eval(x, |l, plus, minus| all[l] = [plus, minus]);
        all
    }

    /// Orthonormal in l, for both spins and every m.
    #[test]
    fn they_are_orthogonal() {
        const N: usize = 20_000;
        for m in 0..=4 {
            let mut products = vec![[0.0; 2]; (DEGREE + 1) * (DEGREE + 1)];
            for i in 0..N {
                let d = values(m, -1.0 + (i as f64 + 0.5) * 2.0 / N as f64);
                for (a, left) in d.iter().enumerate() {
                    for (b, right) in d.iter().enumerate() {
                        for spin in 0..2 {
                            products[a * (DEGREE + 1) + b][spin] +=
                                left[spin] * right[spin] * 2.0 / N as f64;
                        }
                    }
                }
            }
            for (k, product) in products.iter().enumerate() {
                let (a, b) = (k / (DEGREE + 1), k % (DEGREE + 1));
                let norm = if a == b && a >= m.max(2) {
                    2.0 / (2.0 * a as f64 + 1.0)
                } else {
                    0.0
                };
                assert!(
                    product.iter().all(|p| (p - norm).abs() < 1e-6),
                    "{m} {a} {b}"
                );
            }
        }
    }

    /// Closed forms: `P_3^2 = 15 x (1 − x²)`, `d^2_22 = ((1 + x)/2)²`, `d^3_22 = d^2_22 (3x − 2)`.
    #[test]
    fn they_are_those_of_the_books() {
        for x in [-0.9f64, -0.2, 0.0, 0.4, 0.99] {
            let third = 15.0 * x * (1.0 - x * x) / 120.0f64.sqrt();
            let zero = values(0, x)[3];
            assert!((zero[0] - third).abs() < 1e-12 && zero[1] == zero[0]);
            let second = (0.5 * (1.0 + x)).powi(2);
            let two = values(2, x);
            assert!((two[2][0] - second).abs() < 1e-12);
            assert!((two[3][0] - second * (3.0 * x - 2.0)).abs() < 1e-12);
        }
    }
}
