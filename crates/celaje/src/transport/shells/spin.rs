//! Harmonics of linear polarisation, symmetric about the sun's vertical plane.
//!
//! Q and U refer to (θ̂, φ̂) of the *view*, φ counted from the sun's azimuth; Q is even in φ, U is odd. Both together are a tensor
//! across the view, and have two kinds of harmonics: second derivatives of `Ŷ_lm` (E) and the same turned by 45° (B):
//!
//! ```text
//! E: (Q, U) = (W_lm cos mφ, −X_lm sin mφ)     B: (Q, U) = (−X_lm cos mφ, W_lm sin mφ)
//! W, X = √(2 − δ_m0) (d^l_m,2 ± d^l_m,−2)/2, l ≥ 2
//! ```
//!
//! normalised as `Ŷ_lm` is (`harmonics.rs`). Moments are the integrals `E_lm = ∫ (Q W cos mφ − U X sin mφ) dω` and `B_lm` likewise.
//! A scattering matrix of moments g, b, e, h (`optics/mueller_moments.rs`) mixes moments of the same l and m only, and B with none
//! other:
//!
//! ```text
//! I_lm ← g_l I_lm + b_l E_lm     E_lm ← b_l I_lm + e_l E_lm     B_lm ← h_l B_lm     (× (2l + 1)/(4π))
//! ```
//!
//! Air has b and e of degree 2 and no h: three moments more than those of the radiance are all that Rayleigh scattering sees of
//! polarisation. (F34 and circular polarisation are left out.)
//!
//! # Source
//! Kamionkowski et al. 1997, doi:10.1103/PhysRevD.55.7368, section II, for the harmonics; Siewert 1982, A&A 109, 195, for the
//! matrices.

use super::harmonics;
use crate::math::SpinTwo;

/// Number of harmonics of one kind up to a degree.
pub const fn count(degree: usize) -> usize {
    if degree < 2 {
        0
    } else {
        harmonics::count(degree) - 3
    }
}

/// Place of a harmonic in a row: degree by degree from 2, order from 0.
pub const fn index(l: usize, m: usize) -> usize {
    harmonics::index(l, m) - 3
}

/// Constants of the recurrences.
#[derive(Debug, Clone)]
pub struct Spin {
    orders: Vec<SpinTwo>,
}

impl Spin {
    /// Harmonics up to a degree; below 2 there are none.
    pub fn new(degree: usize) -> Self {
        let orders = if degree < 2 { 0 } else { degree + 1 };
        Self {
            orders: (0..orders).map(|m| SpinTwo::new(m, degree)).collect(),
        }
    }

    /// `W_lm` and `X_lm` at the cosine of a zenith angle, in the order of [`index`].
    #[inline(always)]
    pub fn polar(&self, mu: f64, w: &mut [f32], x: &mut [f32]) {
        for (m, order) in self.orders.iter().enumerate() {
            let norm = if m == 0 {
                0.5
            } else {
                std::f64::consts::FRAC_1_SQRT_2
            };
            order.eval(mu, |l, plus, minus| {
                w[index(l, m)] = (norm * (plus + minus)) as f32;
                x[index(l, m)] = (norm * (plus - minus)) as f32;
            });
        }
    }

    /// `d^l_0,2(x)` for l from 2: what F12 is a series of.
    #[inline(always)]
    pub fn legendre(&self, x: f64, out: &mut [f32]) {
        if let Some(order) = self.orders.first() {
            order.eval(x, |l, d, _| out[l - 2] = d as f32);
        }
    }
}

/// `sin mφ` for m below the length of `out`, φ in [0, π], by Chebyshev's recurrence.
#[inline(always)]
pub fn sines(cos_phi: f32, out: &mut [f32]) {
    let (mut before, mut now) = (-(1.0 - cos_phi * cos_phi).max(0.0).sqrt(), 0.0);
    for s in out {
        *s = now;
        (before, now) = (now, 2.0 * cos_phi * now - before);
    }
}

/// `cos 2η` and `sin 2η` by which light polarised along the plane of view and sun has Q and U: the turn of that plane from the
/// vertical one.
///
/// * `mu`, `mu_sun` — cosines of the zenith angles; `cos_phi` — of the azimuth between them, in [0, π]
#[inline(always)]
pub fn turn(mu: f64, mu_sun: f64, cos_phi: f64) -> [f32; 2] {
    let (sin, sin_sun) = (
        (1.0 - mu * mu).max(0.0).sqrt(),
        (1.0 - mu_sun * mu_sun).max(0.0).sqrt(),
    );
    // The sun's direction along θ̂ and φ̂.
    let along = sin_sun * mu * cos_phi - mu_sun * sin;
    let across = -sin_sun * (1.0 - cos_phi * cos_phi).max(0.0).sqrt();
    let squared = along * along + across * across;
    if squared < 1e-24 {
        return [1.0, 0.0];
    }
    [
        ((along * along - across * across) / squared) as f32,
        (2.0 * along * across / squared) as f32,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;
    use harmonics::Harmonics;

    const DEGREE: usize = 6;

    /// A matrix of made-up moments [g, b, e, h] by degree, from its series: F11, F12, F22, F33.
    fn matrix(moments: &[[f64; 4]], x: f64) -> [f64; 4] {
        let mut p = [0.0f32; DEGREE + 1];
        harmonics::legendre(DEGREE, x, &mut p);
        let norm = |l: usize| 2.0 * l as f64 + 1.0;
        let f11 = (0..=DEGREE)
            .map(|l| norm(l) * moments[l][0] * f64::from(p[l]))
            .sum();
        let (mut f12, mut sum, mut difference) = (0.0, 0.0, 0.0);
        SpinTwo::new(0, DEGREE).eval(x, |l, d, _| f12 += norm(l) * moments[l][1] * d);
        SpinTwo::new(2, DEGREE).eval(x, |l, plus, minus| {
            let [_, _, e, h] = moments[l];
            sum += norm(l) * (e + h) * plus;
            difference += norm(l) * (e - h) * minus;
        });
        [f11, f12, 0.5 * (sum + difference), 0.5 * (sum - difference)]
    }

    /// Unit vectors θ̂ and φ̂ of a direction.
    fn basis(k: Vec3) -> (Vec3, Vec3) {
        let across = (k.x * k.x + k.y * k.y).sqrt();
        let (c, s) = (k.x / across, k.y / across);
        (Vec3::new(k.z * c, k.z * s, -across), Vec3::new(-s, c, 0.0))
    }

    /// Scatters Stokes components from one view to another by rotations and the matrix.
    fn scatter(moments: &[[f64; 4]], from: Vec3, to: Vec3, [i, q, u]: [f64; 3]) -> [f64; 3] {
        let [f11, f12, f22, f33] = matrix(moments, from.dot(to));
        // In the basis (along the plane, its normal) of either direction.
        let normal = from.cross(to).normalized();
        let angle = |k: Vec3| {
            let (theta, phi) = basis(k);
            let along = normal.cross(k);
            2.0 * along.dot(phi).atan2(along.dot(theta))
        };
        let a = angle(from);
        let (q, u) = (q * a.cos() + u * a.sin(), u * a.cos() - q * a.sin());
        let [i, q, u] = [f11 * i + f12 * q, f12 * i + f22 * q, f33 * u];
        let a = angle(to);
        [i, q * a.cos() - u * a.sin(), q * a.sin() + u * a.cos()]
    }

    /// Rationale: the addition theorem of polarised light, with every sign. Expected: light of two directions that are mirror images
    /// of each other, of any I, Q, ±U, scattered by a matrix of any moments, is the same by rotations and by harmonics.
    #[test]
    fn scattering_is_diagonal() {
        let moments: Vec<[f64; 4]> = (0..=DEGREE)
            .map(|l| {
                let l = l as f64;
                let many = |k: f64| (1.3 * k * l + k).sin();
                [many(1.0), many(2.0), many(3.0), many(4.0)]
            })
            .collect();
        let direction = |mu: f64, phi: f64| {
            let sin = (1.0 - mu * mu).sqrt();
            Vec3::new(sin * phi.cos(), sin * phi.sin(), mu)
        };
        let (mu, phi) = (0.35, 0.8);
        let light = [1.0, 0.4, -0.3];
        let (harmonics, spin) = (Harmonics::new(DEGREE), Spin::new(DEGREE));
        let rows = |mu: f64| {
            let mut y = [0.0f32; harmonics::count(DEGREE)];
            harmonics.polar(DEGREE, mu, &mut y);
            let (mut w, mut x) = ([0.0f32; count(DEGREE)], [0.0f32; count(DEGREE)]);
            spin.polar(mu, &mut w, &mut x);
            (y, w, x)
        };
        let azimuth = |phi: f64, m: usize| (m as f64 * phi).sin_cos();
        for (mu_to, phi_to) in [(0.9, 0.3), (-0.6, 2.5), (0.1, -1.4), (0.36, 0.8)] {
            let to = direction(mu_to, phi_to);
            let one = scatter(&moments, direction(mu, phi), to, light);
            let mirrored = [light[0], light[1], -light[2]];
            let other = scatter(&moments, direction(mu, -phi), to, mirrored);
            let ((y, w, x), (y_to, w_to, x_to)) = (rows(mu), rows(mu_to));
            let mut found = [0.0; 3];
            for (l, &[g, b, e, h]) in moments.iter().enumerate() {
                let norm = 2.0 * l as f64 + 1.0;
                for m in 0..=l {
                    let ((s, c), (s_to, c_to)) = (azimuth(phi, m), azimuth(phi_to, m));
                    let at = |row: &[f32], k: usize| f64::from(row[k]);
                    let k = harmonics::index(l, m);
                    let i = 2.0 * light[0] * at(&y, k) * c;
                    found[0] += norm * g * i * at(&y_to, k) * c_to;
                    if l < 2 {
                        continue;
                    }
                    let j = index(l, m);
                    let (w, x, w_to, x_to) = (at(&w, j), at(&x, j), at(&w_to, j), at(&x_to, j));
                    let electric = 2.0 * (light[1] * w * c - light[2] * x * s);
                    let magnetic = 2.0 * (-light[1] * x * c + light[2] * w * s);
                    let (ee, bb) = (b * i + e * electric, h * magnetic);
                    found[0] += norm * b * electric * at(&y_to, k) * c_to;
                    found[1] += norm * (ee * w_to - bb * x_to) * c_to;
                    found[2] += norm * (-ee * x_to + bb * w_to) * s_to;
                }
            }
            for (k, f) in found.into_iter().enumerate() {
                let exact = one[k] + other[k];
                assert!(
                    (f - exact).abs() < 1e-4,
                    "{mu_to} {phi_to} {k}: {f} {exact}"
                );
            }
        }
    }

    /// Light polarised along the plane of view and sun: Q and U of the tensor itself.
    #[test]
    fn the_turn_is_that_of_the_plane() {
        for (mu, mu_sun, phi) in [(0.3f64, 0.5f64, 1.0f64), (-0.4, -0.1, 2.7), (0.8, 0.1, 0.0)] {
            let view = Vec3::new(
                (1.0 - mu * mu).sqrt() * phi.cos(),
                (1.0 - mu * mu).sqrt() * phi.sin(),
                mu,
            );
            let sun = Vec3::new((1.0 - mu_sun * mu_sun).sqrt(), 0.0, mu_sun);
            let along = (sun - view * sun.dot(view)).normalized();
            let (theta, across) = basis(view);
            let (a, b) = (along.dot(theta), along.dot(across));
            let [cos2, sin2] = turn(mu, mu_sun, phi.cos());
            assert!((f64::from(cos2) - (a * a - b * b)).abs() < 1e-6);
            assert!((f64::from(sin2) - 2.0 * a * b).abs() < 1e-6);
        }
        let mut s = [0.0; 5];
        sines(1.1f32.cos(), &mut s);
        for (m, s) in s.iter().enumerate() {
            assert!((s - (1.1 * m as f32).sin()).abs() < 1e-5);
        }
    }
}
