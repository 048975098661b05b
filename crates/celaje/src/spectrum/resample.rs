//! Averages of tabulated spectra over wavelength bins.

use crate::math::interp::interval;

/// Mean of a histogram over other bins, conserving its integral.
///
/// Bin `i` of the source holds `value[i]` from `source_edges_nm[i]` to `source_edges_nm[i + 1]`; the result holds
/// the mean over each bin of `edges_nm`. Where a bin reaches beyond the source, the mean is that of the part
/// covered; a bin wholly outside gets 0.
///
/// # Arguments
/// * `source_edges_nm` — strictly increasing \[nm\], shape (n + 1,)
/// * `value` — shape (n,), n ≥ 1
/// * `edges_nm` — strictly increasing \[nm\], shape (m + 1,)
///
/// Returns shape (m,), in the unit of `value`.
pub fn bin_average(source_edges_nm: &[f64], value: &[f64], edges_nm: &[f64]) -> Vec<f64> {
    debug_assert_eq!(source_edges_nm.len(), value.len() + 1);
    let mut integral = vec![0.0];
    for (edge, v) in source_edges_nm.windows(2).zip(value) {
        let below = integral[integral.len() - 1];
        integral.push(below + v * (edge[1] - edge[0]));
    }
    let (first, last) = (source_edges_nm[0], source_edges_nm[value.len()]);
    let integral_to = |nm: f64| {
        let i = interval(source_edges_nm, nm);
        integral[i] + value[i] * (nm - source_edges_nm[i])
    };
    edges_nm
        .windows(2)
        .map(|edge| {
            let (low, high) = (edge[0].clamp(first, last), edge[1].clamp(first, last));
            if high > low {
                (integral_to(high) - integral_to(low)) / (high - low)
            } else {
                0.0
            }
        })
        .collect()
}

/// Edges half-way between samples, the outer two mirrored: samples as a histogram, shape (n + 1,).
///
/// `centre` strictly increasing, at least two values.
pub fn edges_between(centre: &[f64]) -> Vec<f64> {
    let n = centre.len();
    let mut edges = vec![1.5 * centre[0] - 0.5 * centre[1]];
    edges.extend(centre.windows(2).map(|p| 0.5 * (p[0] + p[1])));
    edges.push(1.5 * centre[n - 1] - 0.5 * centre[n - 2]);
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_is_conserved() {
        let source = [0.0, 1.0, 3.0, 4.0];
        let value = [2.0, 5.0, -1.0];
        let edges = [0.0, 0.3, 1.7, 3.9, 4.0];
        let mean = bin_average(&source, &value, &edges);
        let sum: f64 = mean
            .iter()
            .zip(edges.windows(2))
            .map(|(m, e)| m * (e[1] - e[0]))
            .sum();
        assert!((sum - (2.0 + 10.0 - 1.0)).abs() < 1e-12);
        assert!((mean[1] - (0.7 * 2.0 + 0.7 * 5.0) / 1.4).abs() < 1e-12);
    }

    #[test]
    fn parts_outside_do_not_count() {
        let mean = bin_average(&[0.0, 1.0], &[3.0], &[-5.0, -2.0, 0.5, 9.0, 10.0]);
        assert_eq!(mean, [0.0, 3.0, 3.0, 0.0]);
    }

    #[test]
    fn edges_lie_between() {
        assert_eq!(edges_between(&[1.0, 2.0, 4.0]), [0.5, 1.5, 3.0, 5.0]);
    }
}
