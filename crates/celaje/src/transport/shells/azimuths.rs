//! Smooth light all around from every other azimuth of a grid.
//!
//! What multiple scattering leaves is a short series over the azimuth from the sun, of `cos mφ` for light that is even about the sun's
//! plane (I, Q) and of `sin mφ` for light that is odd (U). A series is known from as many azimuths as it has terms, and
//! the solver's own ends at the degree of its harmonics, 10 by default, against 19 azimuths: what is left out is the change of the
//! sun's zenith angle along the view.

use std::f64::consts::PI;

use crate::math::lanes;

/// Fills the azimuths between those where light was found.
#[derive(Debug, Clone)]
pub struct EveryOther {
    /// Azimuths known, both ends included.
    known: usize,
    /// Weights of these at each azimuth between two of them, for even and for odd light, shape (known − 1, known).
    even: Vec<f32>,
    odd: Vec<f32>,
}

impl EveryOther {
    /// * `intervals` — of the grid, from the sun's azimuth to the opposite one, an even number of at least 2
    pub fn new(intervals: usize) -> Self {
        let half = intervals / 2;
        let (mut even, mut odd) = (Vec::new(), Vec::new());
        for between in 0..half {
            let phi = PI * (2 * between + 1) as f64 / intervals as f64;
            for k in 0..=half {
                let at = PI * k as f64 / half as f64;
                // The first and the last of the known azimuths, and of the terms, count half.
                let end = |i: usize| if i == 0 || i == half { 0.5 } else { 1.0 };
                let norm = 2.0 / half as f64;
                let cosines = (0..=half).map(|m| {
                    let m = m as f64;
                    end(m as usize) * (m * phi).cos() * (m * at).cos()
                });
                even.push((norm * end(k) * cosines.sum::<f64>()) as f32);
                let sines = (1..half).map(|m| (m as f64 * phi).sin() * (m as f64 * at).sin());
                odd.push((norm * sines.sum::<f64>()) as f32);
            }
        }
        Self {
            known: half + 1,
            even,
            odd,
        }
    }

    /// Adds light to every azimuth of a grid.
    ///
    /// * `found` — at every other azimuth, shape (known, components, lanes); of the components the third is odd
    /// * `out` — a row of each azimuth, shape (intervals + 1, stride)
    /// * `first` — where in a row the components begin
    #[inline(always)]
    pub fn add(&self, found: &[f32], out: &mut [f32], stride: usize, first: usize, n: usize) {
        let length = found.len() / self.known;
        for (j, row) in out.chunks_exact_mut(stride).enumerate() {
            let row = &mut row[first..first + length];
            if j % 2 == 0 {
                let here = &found[j / 2 * length..(j / 2 + 1) * length];
                lanes::add_scaled(here, 1.0, row);
                continue;
            }
            let weights = j / 2 * self.known..(j / 2 + 1) * self.known;
            for (c, row) in row.chunks_exact_mut(n).enumerate() {
                let weights = if c == 2 { &self.odd } else { &self.even }[weights.clone()].iter();
                for (&weight, found) in weights.zip(found.chunks_exact(length)) {
                    lanes::add_scaled(&found[c * n..(c + 1) * n], weight, row);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::lanes::BLOCK;

    /// Rationale: the light between must be that of the series. Expected: series of as many terms as there are known azimuths come back
    /// to the precision of f32, even and odd ones.
    #[test]
    fn series_come_back() {
        const INTERVALS: usize = 24;
        let phi = |j: usize| PI * j as f64 / INTERVALS as f64;
        let even = |phi: f64| {
            (0..=11)
                .map(|m| (m as f64 * phi).cos() / (1 + m) as f64)
                .sum()
        };
        let odd = |phi: f64| (1..=11).map(|m| (m as f64 * phi).sin() / m as f64).sum();
        let stokes = |phi: f64| -> [f64; 3] { [even(phi), -even(phi), odd(phi)] };
        let mut found = Vec::new();
        for j in (0..=INTERVALS).step_by(2) {
            for value in stokes(phi(j)) {
                found.extend([value as f32; BLOCK]);
            }
        }
        let stride = 4 * BLOCK;
        let mut out = vec![1.0; (INTERVALS + 1) * stride];
        EveryOther::new(INTERVALS).add(&found, &mut out, stride, BLOCK, BLOCK);
        for (j, row) in out.chunks_exact(stride).enumerate() {
            assert_eq!(row[..BLOCK], [1.0; BLOCK]);
            for (component, expected) in row[BLOCK..].chunks_exact(BLOCK).zip(stokes(phi(j))) {
                for value in component {
                    assert!((f64::from(*value) - 1.0 - expected).abs() < 2e-6, "{j}");
                }
            }
        }
    }
}
