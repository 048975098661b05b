//! A matrix as a short sum of columns times rows, found by adaptive cross approximation (Bebendorf 2000,
//! doi:10.1007/PL00005410).

use crate::math::lanes;

/// The cross approximation stops when no coefficient is off by more than this share of the largest at its altitude.
const TOLERANCE: f64 = 2e-6;

/// Factors a matrix of rows into `Σ_k c_k s_k`, each row to [`TOLERANCE`] of its own largest value.
///
/// Returns `c` with shape (row, count), `s` with shape (count, lanes), and the count, padded to whole blocks.
pub(super) fn cross_approximation(rows: &[f32], lanes: usize) -> (Vec<f32>, Vec<f32>, usize) {
    let n = rows.len() / lanes;
    let scale: Vec<f64> = rows
        .chunks_exact(lanes)
        .map(|row| f64::from(row.iter().copied().fold(0.0, f32::max)))
        .collect();
    let mut residual: Vec<f64> = rows
        .chunks_exact(lanes)
        .zip(&scale)
        .flat_map(|(row, &s)| {
            row.iter()
                .map(move |&v| if s > 0.0 { f64::from(v) / s } else { 0.0 })
        })
        .collect();
    let mut terms: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    while terms.len() < n.min(lanes) {
        let at = (0..residual.len())
            .max_by(|&a, &b| residual[a].abs().total_cmp(&residual[b].abs()))
            .unwrap_or(0);
        let pivot = residual[at];
        if pivot.abs() <= TOLERANCE {
            break;
        }
        let (row, lane) = (at / lanes, at % lanes);
        let c: Vec<f64> = (0..n).map(|i| residual[i * lanes + lane]).collect();
        let s: Vec<f64> = (0..lanes)
            .map(|j| residual[row * lanes + j] / pivot)
            .collect();
        for (i, &c) in c.iter().enumerate() {
            for (j, &s) in s.iter().enumerate() {
                residual[i * lanes + j] -= c * s;
            }
        }
        terms.push((c, s));
    }
    let count = lanes::padded(terms.len().max(1));
    let mut density = vec![0.0; n * count];
    let mut spectra = vec![0.0; count * lanes];
    for (k, (c, s)) in terms.iter().enumerate() {
        for i in 0..n {
            density[i * count + k] = (c[i] * scale[i]) as f32;
        }
        for j in 0..lanes {
            spectra[k * lanes + j] = s[j] as f32;
        }
    }
    (density, spectra, count)
}
