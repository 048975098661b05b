//! Illuminance and correlated colour temperature.

use super::observer::{Observer, SpectrumToXyz};
use super::srgb::xyy_from_xyz;
use crate::error::Result;

/// Second radiation constant h c / k \[m K\] (CODATA 2018, exact).
const C2: f64 = 1.438_776_877e-2;

/// Illuminance \[lx\] of a spectral irradiance \[W m⁻² nm⁻¹\]: `683 lm/W · ∫ E(λ) V(λ) dλ`, with V(λ) the ȳ of the 1931
/// observer.
///
/// With a spectral radiance instead, the result is the luminance \[cd m⁻²\]. The spectrum is linear between the
/// wavelengths \[nm\] and dark beyond them.
///
/// # Errors
/// As [`SpectrumToXyz::new`].
pub fn illuminance_lux(wavelength_nm: &[f64], irradiance: &[f64]) -> Result<f64> {
    Ok(SpectrumToXyz::new(wavelength_nm, Observer::Cie1931)?.xyz(irradiance)[1])
}

/// A correlated colour temperature and how far the colour is from a black body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cct {
    /// Temperature of the black body of the nearest colour \[K\]; infinite for skies bluer than the hottest one.
    pub temperature_k: f64,
    /// Distance from it in the CIE 1960 (u, v) diagram; positive above the locus (greenish).
    pub duv: f64,
}

/// The correlated colour temperature of 1931 tristimulus values, from 1000 K to infinity.
///
/// `None` where the notion has no meaning: black, not finite, or more than 0.05 away from the locus in (u, v).
///
/// # Source
/// CIE 15:2004 §9.5 (definition and the limit of 0.05), solved as it stands: the distance to the Planckian locus, itself
/// integrated from the 1 nm table, is minimised over reciprocal temperature by golden-section search.
pub fn correlated_colour_temperature(xyz: [f64; 3]) -> Option<Cct> {
    let [x, y, luminance] = xyy_from_xyz(xyz);
    if !(luminance > 0.0 && x.is_finite() && y.is_finite()) {
        return None;
    }
    let (u, v) = uv_from_xy(x, y);
    let distance = |mired: f64| {
        let (up, vp) = planckian_uv(mired);
        (u - up).hypot(v - vp)
    };
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let (mut lo, mut hi) = (0.0, 1000.0);
    let (mut a, mut b) = (hi - golden * (hi - lo), lo + golden * (hi - lo));
    let (mut at_a, mut at_b) = (distance(a), distance(b));
    while hi - lo > 1e-4 {
        if at_a < at_b {
            (hi, b, at_b) = (b, a, at_a);
            a = hi - golden * (hi - lo);
            at_a = distance(a);
        } else {
            (lo, a, at_a) = (a, b, at_b);
            b = lo + golden * (hi - lo);
            at_b = distance(b);
        }
    }
    // Within 10⁻³ mired of an end the nearest colour is the end itself.
    let mired = 0.5 * (lo + hi);
    let duv = distance(mired);
    if duv > 0.05 || mired > 1000.0 - 1e-3 {
        return None;
    }
    let (_, v_locus) = planckian_uv(mired);
    Some(Cct {
        temperature_k: if mired < 1e-3 {
            f64::INFINITY
        } else {
            1e6 / mired
        },
        duv: duv.copysign(v - v_locus),
    })
}

/// CIE 1960 (u, v) from (x, y).
fn uv_from_xy(x: f64, y: f64) -> (f64, f64) {
    let d = -2.0 * x + 12.0 * y + 3.0;
    (4.0 * x / d, 6.0 * y / d)
}

/// (u, v) of a black body of temperature 10⁶ K / `mired`.
fn planckian_uv(mired: f64) -> (f64, f64) {
    let mut xyz = [0.0; 3];
    for nm in 360..=830 {
        let wavelength_nm = f64::from(nm);
        let radiance = planck_shape(wavelength_nm, mired);
        let functions = Observer::Cie1931.matching_functions(wavelength_nm);
        for k in 0..3 {
            xyz[k] += radiance * functions[k];
        }
    }
    let [x, y, _] = xyy_from_xyz(xyz);
    uv_from_xy(x, y)
}

/// Planck's law up to a factor that does not depend on wavelength; the Rayleigh–Jeans law λ⁻⁴ at 0 mired.
fn planck_shape(wavelength_nm: f64, mired: f64) -> f64 {
    let relative = wavelength_nm / 560.0;
    // h c / (λ k T), with 1/T = 10⁻⁶ mired and λ in units of 10⁻⁹ m.
    let exponent = C2 * 1e3 * mired / wavelength_nm;
    if exponent < 1e-9 {
        return relative.powi(-4);
    }
    exponent / exponent.exp_m1() * relative.powi(-4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::xyz_from_xyy;

    fn cct(x: f64, y: f64) -> f64 {
        correlated_colour_temperature(xyz_from_xyy([x, y, 1.0]))
            .unwrap()
            .temperature_k
    }

    /// Chromaticities and correlated colour temperatures of CIE 15:2004, tables T.3 and T.8 (there with
    /// c₂ = 1.4388e-2 m K, which moves them by less than 0.2 K).
    #[test]
    fn cie_illuminants_have_their_published_temperatures() {
        let cases = [
            ("A", 0.44758, 0.40745, 2856.0, 1.0),
            ("C", 0.31006, 0.31616, 6774.0, 3.0),
            ("D50", 0.34567, 0.35851, 5003.0, 3.0),
            ("D55", 0.33243, 0.34744, 5503.0, 3.0),
            ("D65", 0.31272, 0.32903, 6504.0, 3.0),
            ("D75", 0.29903, 0.31488, 7504.0, 3.0),
        ];
        for (name, x, y, expected, tolerance) in cases {
            let t = cct(x, y);
            assert!((t - expected).abs() < tolerance, "{name}: {t}");
        }
    }

    #[test]
    fn a_black_body_has_its_own_temperature() {
        let grid: Vec<f64> = (360..=830).map(f64::from).collect();
        let map = SpectrumToXyz::new(&grid, Observer::Cie1931).unwrap();
        for t in [1200.0, 2000.0, 5772.0, 10_000.0, 30_000.0] {
            let spectrum: Vec<f64> = grid.iter().map(|&w| planck_w(w, t)).collect();
            let found = correlated_colour_temperature(map.xyz(&spectrum)).unwrap();
            assert!(
                (found.temperature_k / t - 1.0).abs() < 1e-4,
                "{t} {found:?}"
            );
            assert!(found.duv.abs() < 1e-5);
        }
    }

    /// Spectral radiance of a black body \[W m⁻² sr⁻¹ nm⁻¹\].
    fn planck_w(wavelength_nm: f64, temperature_k: f64) -> f64 {
        let m = wavelength_nm * 1e-9;
        1.191_042_972e-16 / m.powi(5) / (C2 / (m * temperature_k)).exp_m1() * 1e-9
    }

    /// The candela of 1948: a black body at the freezing point of platinum, then 2042 K, has 60 cd cm⁻² (CGPM 9,
    /// resolution 7); the later 683 lm/W was rounded to keep it.
    #[test]
    fn freezing_platinum_has_sixty_candelas_per_square_centimetre() {
        let grid: Vec<f64> = (360..=830).map(f64::from).collect();
        let spectrum: Vec<f64> = grid.iter().map(|&w| planck_w(w, 2042.0)).collect();
        let luminance = illuminance_lux(&grid, &spectrum).unwrap();
        assert!((luminance / 600_000.0 - 1.0).abs() < 0.005, "{luminance}");
    }

    #[test]
    fn colours_without_a_temperature_have_none() {
        assert!(correlated_colour_temperature([0.0; 3]).is_none());
        assert!(correlated_colour_temperature([f64::NAN, 1.0, 1.0]).is_none());
        assert!(correlated_colour_temperature(xyz_from_xyy([0.17, 0.7, 1.0])).is_none());
        // Bluer than the hottest black body (0.2399, 0.2342): infinite.
        let blue = correlated_colour_temperature(xyz_from_xyy([0.235, 0.225, 1.0])).unwrap();
        assert!(blue.temperature_k.is_infinite());
    }
}
