//! Running means and variances.

/// Mean and variance of a stream of numbers (Welford 1962).
#[derive(Debug, Clone, Copy, Default)]
pub struct Moments {
    count: f64,
    mean: f64,
    sum_of_squares: f64,
}

impl Moments {
    /// Takes one more number.
    pub fn push(&mut self, value: f64) {
        self.count += 1.0;
        let delta = value - self.mean;
        self.mean += delta / self.count;
        self.sum_of_squares += delta * (value - self.mean);
    }

    /// How many numbers were taken.
    pub fn count(&self) -> f64 {
        self.count
    }

    /// Their mean; 0 of none.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Unbiased variance of one number; 0 below two.
    pub fn variance(&self) -> f64 {
        if self.count < 2.0 {
            0.0
        } else {
            self.sum_of_squares / (self.count - 1.0)
        }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_known_list() {
        let mut m = Moments::default();
        for v in [1.0, 2.0, 4.0] {
            m.push(v);
        }
        assert!((m.mean() - 7.0 / 3.0).abs() < 1e-15);
        assert!((m.variance() - 7.0 / 3.0).abs() < 1e-14);
    }
}
