//! Scattering matrices as polarised transport uses them: the elements beside the phase function, at every wavelength.
//!
//! All matter here is isotropic and mirror symmetric, so in the scattering plane the matrix is
//!
//! ```text
//! F11  F12   0     0
//! F12  F22   0     0
//!  0    0   F33  −F34
//!  0    0   F34   F44
//! ```
//!
//! acting on (I, Q, U, V) with Q > 0 along the plane, in a right-handed basis (along the plane, across it, direction of travel).
//! F34 has the sign of Bohren & Huffman 1983, whose basis is left-handed: hence the minus in the third row.

use super::phase::{Kind, Phase};

/// Rows of the elements beside F11: F12, F22, F33, F34, F44, one after the other.
#[derive(Debug, Clone)]
pub(crate) struct MuellerRows {
    values: Vec<f32>,
    lanes: usize,
}

impl MuellerRows {
    pub(crate) fn new(lanes: usize) -> Self {
        Self {
            values: vec![0.0; 5 * lanes],
            lanes,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// F12, F22, F33, F34, F44.
    #[inline(always)]
    pub(crate) fn elements(&self) -> [&[f32]; 5] {
        let n = self.lanes;
        let v = &self.values;
        [
            &v[..n],
            &v[n..2 * n],
            &v[2 * n..3 * n],
            &v[3 * n..4 * n],
            &v[4 * n..5 * n],
        ]
    }

    #[inline(always)]
    fn elements_mut(&mut self) -> [&mut [f32]; 5] {
        let n = self.lanes;
        let (f12, rest) = self.values.split_at_mut(n);
        let (f22, rest) = rest.split_at_mut(n);
        let (f33, rest) = rest.split_at_mut(n);
        let (f34, f44) = rest.split_at_mut(n);
        [f12, f22, f33, f34, f44]
    }
}

impl Phase {
    /// Whether linear polarisation can become circular.
    pub(crate) fn makes_circular(&self) -> bool {
        matches!(&self.0, Kind::Table(t) if !t.polarisation.is_empty())
    }

    /// `out += share · F12(cos θ)` \[sr⁻¹\] at every wavelength; rows of equal length.
    #[inline(always)]
    pub(crate) fn add_f12(&self, cos_theta: f64, share: &[f32], out: &mut [f32]) {
        let n = out.len();
        let share = &share[..n];
        match &self.0 {
            Kind::Rayleigh { square, .. } => {
                let s2 = (1.0 - cos_theta * cos_theta) as f32;
                let b = &square[..n];
                for i in 0..n {
                    out[i] -= share[i] * b[i] * s2;
                }
            }
            Kind::Table(t) if !t.polarisation.is_empty() => {
                let (i, f) = t.locate(cos_theta);
                let f = f as f32;
                let (a, b) = (
                    &t.polarisation[3 * i * n..],
                    &t.polarisation[3 * (i + 1) * n..],
                );
                let (a, b) = (&a[..n], &b[..n]);
                for i in 0..n {
                    out[i] += share[i] * (a[i] + f * (b[i] - a[i]));
                }
            }
            // Unpolarised light comes out of what is not known to polarise.
            Kind::HenyeyGreenstein { .. } | Kind::Table(_) => {}
        }
    }

    /// `out += share · F(cos θ)` \[sr⁻¹\] for the elements beside F11, at every wavelength; rows of equal length.
    #[inline(always)]
    pub(crate) fn add_mueller(&self, cos_theta: f64, share: &[f32], out: &mut MuellerRows) {
        let n = out.lanes;
        let share = &share[..n];
        let [f12, f22, f33, f34, f44] = out.elements_mut();
        match &self.0 {
            Kind::Rayleigh {
                square, circular, ..
            } => {
                let (c, c2) = (cos_theta as f32, (cos_theta * cos_theta) as f32);
                let s2 = (1.0 - cos_theta * cos_theta) as f32;
                let (b, d) = (&square[..n], &circular[..n]);
                for i in 0..n {
                    let v = share[i] * b[i];
                    f12[i] -= v * s2;
                    f22[i] += v * (1.0 + c2);
                    f33[i] += v * 2.0 * c;
                    f44[i] += share[i] * d[i] * 2.0 * c;
                }
            }
            Kind::Table(t) if !t.polarisation.is_empty() => {
                let (i, f) = t.locate(cos_theta);
                let f = f as f32;
                let row = |k: usize, i: usize| &t.polarisation[(3 * i + k) * n..][..n];
                let rows = [0, 1, 2].map(|k| (row(k, i), row(k, i + 1)));
                let p = (&t.p[i * n..][..n], &t.p[(i + 1) * n..][..n]);
                for i in 0..n {
                    let at = |(a, b): (&[f32], &[f32])| share[i] * (a[i] + f * (b[i] - a[i]));
                    let v = at(rows[1]);
                    f12[i] += at(rows[0]);
                    f22[i] += at(p);
                    f33[i] += v;
                    f34[i] += at(rows[2]);
                    f44[i] += v;
                }
            }
            Kind::HenyeyGreenstein { .. } | Kind::Table(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::{mie, AngleGrid};

    /// All elements at one angle and wavelength, as f64.
    fn matrix(phase: &Phase, cos_theta: f64) -> [f64; 5] {
        let mut rows = MuellerRows::new(phase.lanes());
        let one = vec![1.0; phase.lanes()];
        phase.add_mueller(cos_theta, &one, &mut rows);
        let mut f12 = vec![0.0; phase.lanes()];
        phase.add_f12(cos_theta, &one, &mut f12);
        assert_eq!(f12, rows.elements()[0]);
        rows.elements().map(|row| f64::from(row[0]))
    }

    /// Without depolarisation F = 3/(16π) × (1 + c², −s²; 2c): fully polarised across the plane at 90°. With it, light
    /// scattered by 90° keeps `ρ = I_∥ / I_⊥`.
    #[test]
    fn rayleigh_has_its_textbook_matrix() {
        let phase = Phase::rayleigh(&[0.0]).unwrap();
        let norm = 3.0 / (16.0 * std::f64::consts::PI);
        for c in [-1.0f64, -0.4, 0.0, 0.7, 1.0] {
            let expected = [c * c - 1.0, c * c + 1.0, 2.0 * c, 0.0, 2.0 * c];
            for (f, e) in matrix(&phase, c).into_iter().zip(expected) {
                assert!((f - norm * e).abs() < 1e-7, "{c}: {f} {e}");
            }
        }
        let rho = 0.06;
        let phase = Phase::rayleigh(&[rho]).unwrap();
        let (f11, f12) = (phase.eval_at(0, 0.0), matrix(&phase, 0.0)[0]);
        assert!(((f11 + f12) / (f11 - f12) - rho).abs() < 1e-6);
        let [_, f22, f33, _, f44] = matrix(&phase, 1.0);
        assert!((f22 - f33).abs() < 1e-8 && f44 < f33);
        assert!((f44 / f33 - (1.0 - 2.0 * rho) / (1.0 - rho)).abs() < 1e-6);
    }

    /// Rationale: every table of the library's particles goes through here. Expected: the elements of one sphere, from its own
    /// amplitudes, at nodes and half-way; forward scattering changes no polarisation, backward scattering mirrors it.
    #[test]
    fn spheres_have_the_matrix_of_their_amplitudes() {
        let sphere = mie(1.5, 0.01, 3.0).unwrap();
        let grid = AngleGrid::default();
        let elements = |cos_theta: &[f64]| -> [Vec<f64>; 4] {
            let (s1, s2) = sphere.amplitudes(cos_theta).unwrap();
            let pairs = || s1.iter().zip(&s2);
            [
                pairs()
                    .map(|(a, b)| 0.5 * (a.norm_sqr() + b.norm_sqr()))
                    .collect(),
                pairs()
                    .map(|(a, b)| 0.5 * (b.norm_sqr() - a.norm_sqr()))
                    .collect(),
                pairs().map(|(a, b)| b.re * a.re + b.im * a.im).collect(),
                pairs().map(|(a, b)| b.im * a.re - b.re * a.im).collect(),
            ]
        };
        let mut nodes = elements(grid.cos_theta());
        let total = grid.sphere_integral(&nodes[0]);
        for element in &mut nodes {
            element.iter_mut().for_each(|v| *v /= total);
        }
        let [f11, f12, f33, f34] = &nodes;
        let phase = Phase::spheres(grid.theta_deg(), f11, f12, f33, f34).unwrap();
        assert!(phase.makes_circular());
        for theta_deg in [0.0f64, 0.004, 17.3, 90.0, 133.3, 180.0] {
            let c = theta_deg.to_radians().cos();
            let exact = elements(&[c]).map(|e| e[0] / total);
            let found = matrix(&phase, c);
            let expected = [exact[1], exact[0], exact[2], exact[3], exact[2]];
            for (f, e) in found.into_iter().zip(expected) {
                assert!((f - e).abs() < 3e-4 * exact[0], "{theta_deg}: {f} {e}");
            }
        }
        let ([_, f22, f33, ..], [_, b22, b33, ..]) = (matrix(&phase, 1.0), matrix(&phase, -1.0));
        assert!((f33 / f22 - 1.0).abs() < 1e-6 && (b33 / b22 + 1.0).abs() < 1e-6);
    }

    /// What is not known to polarise contributes nothing; impossible matrices are refused.
    #[test]
    fn unknown_polarisation_is_none() {
        for phase in [
            Phase::henyey_greenstein(&[0.6]).unwrap(),
            Phase::legendre(&[1.0, 0.5], 1).unwrap(),
        ] {
            assert!(!phase.makes_circular());
            assert_eq!(matrix(&phase, 0.3), [0.0; 5]);
        }
        let (theta, p) = ([0.0, 180.0], [0.25 / std::f64::consts::PI; 2]);
        let refused =
            |p12: &[f64], p33: &[f64]| Phase::spheres(&theta, &p, p12, p33, &[0.0; 2]).is_err();
        assert!(!refused(&[0.0; 2], &p));
        assert!(
            refused(&[0.01, 0.03], &p) && refused(&[0.0; 3], &p) && refused(&[f64::NAN, 0.0], &p)
        );
    }
}
