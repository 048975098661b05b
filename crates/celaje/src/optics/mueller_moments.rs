//! Moments of scattering matrices over generalised spherical functions: what becomes of the moments of polarised light.

use std::f64::consts::PI;

use super::phase::{Kind, Phase, Table};
use crate::math::SpinTwo;

/// Four-point Gauss quadrature on [−1, 1].
const GAUSS: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
];

impl Phase {
    /// Moments \[1\] of the elements that polarise and keep polarised, `[b_l, e_l, h_l]` for l from 2 to `degree`, at each of
    /// some wavelengths.
    ///
    /// ```text
    /// F12 = Σ (2l + 1)/(4π) b_l d^l_0,2     F22 ± F33 = Σ (2l + 1)/(4π) (e_l ± h_l) d^l_2,±2
    /// ```
    ///
    /// They are what `g_l` is of F11: the identity has `e_l = h_l = 1`, `b_l = 0`. The functions are those of [`SpinTwo`].
    ///
    /// # Source
    /// Siewert 1982, A&A 109, 195, whose constants β, α, ζ, γ are `(2l + 1)` times `g`, `e`, `h`, `b`, up to the sign of the last.
    pub(crate) fn polarising_moments(&self, chosen: &[usize], degree: usize) -> Vec<Vec<[f64; 3]>> {
        let mut all = vec![vec![[0.0; 3]; degree.saturating_sub(1)]; chosen.len()];
        match &self.0 {
            Kind::Rayleigh { square, .. } => {
                // F12 = −s (1 − x²) = −s √(8/3) d_02 and F22 ± F33 = s (1 ± x)² = 4 s d_2,±2, all of degree 2.
                for (moments, &lane) in all.iter_mut().zip(chosen) {
                    if let Some(second) = moments.first_mut() {
                        let s = 4.0 * PI / 5.0 * f64::from(square[lane]);
                        *second = [-(8.0f64 / 3.0).sqrt() * s, 4.0 * s, 0.0];
                    }
                }
            }
            Kind::Table(t) if !t.polarisation.is_empty() => {
                t.polarising_moments(chosen, degree, &mut all);
            }
            Kind::HenyeyGreenstein { .. } | Kind::Table(_) => {}
        }
        all
    }
}

impl Table {
    /// By the quadrature of `Table::legendre_moments`.
    fn polarising_moments(&self, chosen: &[usize], degree: usize, all: &mut [Vec<[f64; 3]>]) {
        let (zero, two) = (SpinTwo::new(0, degree), SpinTwo::new(2, degree));
        let n = self.lanes;
        let node = |i: usize, lane: usize| {
            let element = |k: usize| f64::from(self.polarisation[(3 * i + k) * n + lane]);
            let (f11, f33) = (f64::from(self.p[i * n + lane]), element(1));
            [element(0), f11 + f33, f11 - f33]
        };
        let mut functions = vec![[0.0; 3]; degree + 1];
        for (i, x) in self.cos_theta.windows(2).enumerate() {
            let (half, middle) = (0.5 * (x[1] - x[0]), 0.5 * (x[0] + x[1]));
            for (t, w) in GAUSS {
                let (c, f) = (middle + half * t, 0.5 * (t + 1.0));
                zero.eval(c, |l, d, _| functions[l][0] = d);
                two.eval(c, |l, plus, minus| {
                    functions[l][1..].copy_from_slice(&[plus, minus])
                });
                let weight = 2.0 * PI * half * w;
                for (moments, &lane) in all.iter_mut().zip(chosen) {
                    let (a, b) = (node(i, lane), node(i + 1, lane));
                    let [f12, sum, difference] =
                        [0, 1, 2].map(|k| weight * (a[k] + f * (b[k] - a[k])));
                    for (moment, [d, plus, minus]) in moments.iter_mut().zip(&functions[2..]) {
                        moment[0] += f12 * d;
                        moment[1] += 0.5 * (sum * plus + difference * minus);
                        moment[2] += 0.5 * (sum * plus - difference * minus);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Complex;
    use crate::optics::{mie, AngleGrid, MuellerRows};

    /// Rationale: multiple scattering of polarised light sees matrices by their moments alone. Expected: the series of the moments
    /// gives the elements back, for air exactly, for a small sphere as far as 24 degrees go.
    #[test]
    fn the_series_is_the_matrix() {
        const DEGREE: usize = 24;
        let sphere = mie(1.45, 0.005, 2.0).unwrap();
        let grid = AngleGrid::default();
        let (s1, s2) = sphere.amplitudes(grid.cos_theta()).unwrap();
        let element = |f: &dyn Fn(Complex, Complex) -> f64| -> Vec<f64> {
            s1.iter().zip(&s2).map(|(a, b)| f(*a, *b)).collect()
        };
        let f11 = element(&|a, b| 0.5 * (a.norm_sqr() + b.norm_sqr()));
        let total = grid.sphere_integral(&f11);
        let scaled = |v: Vec<f64>| -> Vec<f64> { v.into_iter().map(|x| x / total).collect() };
        let spheres = Phase::spheres(
            grid.theta_deg(),
            &scaled(f11.clone()),
            &scaled(element(&|a, b| 0.5 * (b.norm_sqr() - a.norm_sqr()))),
            &scaled(element(&|a, b| b.re * a.re + b.im * a.im)),
            &scaled(element(&|a, b| b.im * a.re - b.re * a.im)),
        )
        .unwrap();
        for phase in [spheres, Phase::rayleigh(&[0.03]).unwrap()] {
            let moments = &phase.polarising_moments(&[0], DEGREE)[0];
            let one = vec![1.0; phase.lanes()];
            let (zero, two) = (SpinTwo::new(0, DEGREE), SpinTwo::new(2, DEGREE));
            for theta_deg in [1.0f64, 20.0, 75.0, 120.0, 179.0] {
                let c = theta_deg.to_radians().cos();
                let mut rows = MuellerRows::new(phase.lanes());
                phase.add_mueller(c, &one, &mut rows);
                let [f12, f22, f33, ..] = rows.elements().map(|row| f64::from(row[0]));
                let norm = |l: usize| (2.0 * l as f64 + 1.0) / (4.0 * PI);
                let mut sums = [0.0; 3];
                zero.eval(c, |l, d, _| sums[0] += norm(l) * moments[l - 2][0] * d);
                two.eval(c, |l, plus, minus| {
                    let [_, e, h] = moments[l - 2];
                    sums[1] += norm(l) * (e + h) * plus;
                    sums[2] += norm(l) * (e - h) * minus;
                });
                for (found, exact) in sums.into_iter().zip([f12, f22 + f33, f22 - f33]) {
                    assert!((found - exact).abs() < 1e-4, "{theta_deg}: {found} {exact}");
                }
            }
        }
        let unknown = Phase::henyey_greenstein(&[0.7]).unwrap();
        assert_eq!(unknown.polarising_moments(&[0], 3), [[[0.0; 3]; 2]]);
    }
}
