//! Interpolation in sorted tables.

/// Index `i` of the interval `[x[i], x[i+1]]` that holds `at`, clamped to the first and last interval.
///
/// `x` strictly increasing, at least two values.
#[inline]
pub fn interval(x: &[f64], at: f64) -> usize {
    x.partition_point(|&v| v <= at).clamp(1, x.len() - 1) - 1
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
    fn linear_meets_nodes_and_clamps() {
        let (x, y) = ([0.0, 1.0, 3.0], [1.0, 2.0, 6.0]);
        assert_eq!(linear_clamped(&x, &y, -1.0), 1.0);
        assert_eq!(linear_clamped(&x, &y, 1.0), 2.0);
        assert_eq!(linear_clamped(&x, &y, 2.0), 4.0);
        assert_eq!(linear_clamped(&x, &y, 9.0), 6.0);
    }
}
