//! Interpolation in sorted tables.

/// Index `i` of the interval `[x[i], x[i+1]]` that holds `at`, clamped to the first and last interval.
///
/// `x` strictly increasing, at least two values.
#[inline]
pub fn interval(x: &[f64], at: f64) -> usize {
    x.partition_point(|&v| v <= at).clamp(1, x.len() - 1) - 1
}

/// Finds intervals of a fixed table in constant time: a guide of equal cells says where to begin (Chen & Asau 1974).
#[derive(Debug, Clone)]
pub struct Guide {
    x: Vec<f64>,
    cells_per_unit: f64,
    first: Vec<u32>,
}

impl Guide {
    /// Cells per node of the table; more make the walk after the first guess shorter.
    const CELLS_PER_NODE: usize = 16;

    /// A guide to `x`, strictly increasing, at least two values.
    pub fn new(x: &[f64]) -> Self {
        let cells = x.len() * Self::CELLS_PER_NODE;
        let range = x[x.len() - 1] - x[0];
        let first = (0..cells)
            .map(|c| interval(x, x[0] + range * c as f64 / cells as f64) as u32)
            .collect();
        Self {
            x: x.to_vec(),
            cells_per_unit: cells as f64 / range,
            first,
        }
    }

    /// The same as [`interval`].
    #[inline(always)]
    pub fn interval(&self, at: f64) -> usize {
        let cell = ((at - self.x[0]) * self.cells_per_unit) as usize;
        let mut i = self.first[cell.min(self.first.len() - 1)] as usize;
        // Rounding may put the guess one too far.
        if i > 0 && at < self.x[i] {
            i -= 1;
        }
        while i + 2 < self.x.len() && self.x[i + 1] <= at {
            i += 1;
        }
        i
    }
}

/// Linear interpolation of `y(x)`; constant beyond both ends.
///
/// `x` strictly increasing, same length as `y`, at least one value.
pub fn linear_clamped(x: &[f64], y: &[f64], at: f64) -> f64 {
    if x.len() == 1 || at <= x[0] {
        return y[0];
    }
    if at >= x[x.len() - 1] {
        return y[y.len() - 1];
    }
    let i = interval(x, at);
    let t = (at - x[i]) / (x[i + 1] - x[i]);
    y[i] + t * (y[i + 1] - y[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guide_agrees_with_bisection() {
        let x: Vec<f64> = (0..90)
            .map(|i| f64::from(i).powf(1.7) + 0.01 * f64::from(i % 7))
            .collect();
        let guide = Guide::new(&x);
        let last = x[x.len() - 1];
        for k in -10..3010 {
            let at = last * f64::from(k) / 3000.0;
            assert_eq!(guide.interval(at), interval(&x, at), "{at}");
        }
        for &at in &x {
            assert_eq!(guide.interval(at), interval(&x, at), "{at}");
        }
    }

    #[test]
    fn linear_meets_nodes_and_clamps() {
        let (x, y) = ([0.0, 1.0, 3.0], [1.0, 2.0, 6.0]);
        assert_eq!(linear_clamped(&x, &y, -1.0), 1.0);
        assert_eq!(linear_clamped(&x, &y, 1.0), 2.0);
        assert_eq!(linear_clamped(&x, &y, 2.0), 4.0);
        assert_eq!(linear_clamped(&x, &y, 9.0), 6.0);
    }
}
