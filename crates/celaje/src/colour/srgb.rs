//! Linear sRGB from XYZ: adaptation, primaries, encoding, and gentle handling of colours out of gamut.

use super::matrix::{apply, diagonal, inverse, product, Mat3};
use super::observer::Observer;

/// Chromaticities (x, y) of the red, green and blue primaries of IEC 61966-2-1 (those of ITU-R BT.709).
pub const PRIMARIES_XY: [[f64; 2]; 3] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];

/// Cone responses of the Bradford adaptation (Lam 1985; as in ICC.1:2022 annex E).
const BRADFORD: Mat3 = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

/// Luminance of the linear primaries: the Y row of the matrix from linear sRGB to XYZ.
const LUMINANCE: [f64; 3] = [
    0.212_639_005_871_51,
    0.715_168_678_767_76,
    0.072_192_315_360_73,
];

/// The matrix from an observer's XYZ to linear sRGB.
///
/// The 1931 observer needs the inverse of the primaries' matrix only. Values of the 1964 observer are first adapted
/// (Bradford) from the 10° to the 2° D65 white, so that D65 is neutral for both.
pub fn srgb_from_xyz(observer: Observer) -> [[f64; 3]; 3] {
    let rgb_from_2deg = inverse(&xyz_from_srgb());
    match observer {
        Observer::Cie1931 => rgb_from_2deg,
        Observer::Cie1964 => product(
            &rgb_from_2deg,
            &adaptation(Observer::Cie1964.d65(), Observer::Cie1931.d65()),
        ),
    }
}

/// XYZ (1931) from linear sRGB: columns are the primaries, scaled to add up to the white.
fn xyz_from_srgb() -> Mat3 {
    let mut columns = [[0.0; 3]; 3];
    for (j, [x, y]) in PRIMARIES_XY.into_iter().enumerate() {
        columns[0][j] = x / y;
        columns[1][j] = 1.0;
        columns[2][j] = (1.0 - x - y) / y;
    }
    let scale = apply(&inverse(&columns), Observer::Cie1931.d65());
    product(&columns, &diagonal(scale))
}

/// Chromatic adaptation between two whites by von Kries's rule on Bradford's cone responses.
fn adaptation(from_white: [f64; 3], to_white: [f64; 3]) -> Mat3 {
    let from = apply(&BRADFORD, from_white);
    let to = apply(&BRADFORD, to_white);
    let gain = diagonal([0, 1, 2].map(|k| to[k] / from[k]));
    product(&inverse(&BRADFORD), &product(&gain, &BRADFORD))
}

/// Chromaticity and luminance (x, y, Y) from XYZ; black gets the chromaticity of D65.
pub fn xyy_from_xyz(xyz: [f64; 3]) -> [f64; 3] {
    let sum: f64 = xyz.iter().sum();
    if sum == 0.0 {
        return [0.3127, 0.3290, 0.0];
    }
    [xyz[0] / sum, xyz[1] / sum, xyz[1]]
}

/// XYZ from (x, y, Y); `y` must not be 0.
pub fn xyz_from_xyy([x, y, luminance]: [f64; 3]) -> [f64; 3] {
    let scale = luminance / y;
    [x * scale, luminance, (1.0 - x - y) * scale]
}

/// Luminance of linear sRGB, on its own scale.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    LUMINANCE.iter().zip(rgb).map(|(w, c)| w * c).sum()
}

/// The sRGB encoding of a linear value in [0, 1] (IEC 61966-2-1).
pub fn srgb_encoded(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of [`srgb_encoded`].
pub fn srgb_decoded(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear sRGB without negative channels: what is out of gamut moves towards the grey of its own luminance, just far
/// enough, so that hue and luminance stay. Black where the luminance is not positive or not a number.
pub fn desaturated_above_zero(rgb: [f64; 3]) -> [f64; 3] {
    desaturated(rgb, f64::INFINITY)
}

/// As [`desaturated_above_zero`], and no channel above 1: too bright a colour pales into the grey of its luminance,
/// white from a luminance of 1.
pub fn desaturated_into_unit(rgb: [f64; 3]) -> [f64; 3] {
    desaturated(rgb, 1.0)
}

fn desaturated(rgb: [f64; 3], ceiling: f64) -> [f64; 3] {
    let y = luminance(rgb);
    if !(y > 0.0 && rgb.iter().all(|c| c.is_finite())) {
        return [0.0; 3];
    }
    if y >= ceiling {
        return [ceiling; 3];
    }
    let mut keep: f64 = 1.0;
    for c in rgb {
        if c < 0.0 {
            keep = keep.min(y / (y - c));
        } else if c > ceiling {
            keep = keep.min((ceiling - y) / (c - y));
        }
    }
    rgb.map(|c| (y + keep * (c - y)).clamp(0.0, ceiling))
}

#[cfg(test)]
mod tests {
    use super::super::observer::tests::d65_spectrum;
    use super::super::observer::SpectrumToXyz;
    use super::*;

    /// IEC 61966-2-1:1999/Amd 1:2003, 7 digits from the same primaries and white.
    #[test]
    fn matrix_is_that_of_the_standard() {
        let published = [
            [3.2406255, -1.5372080, -0.4986286],
            [-0.9689307, 1.8757561, 0.0415175],
            [0.0557101, -0.2040211, 1.0569959],
        ];
        let m = srgb_from_xyz(Observer::Cie1931);
        for i in 0..3 {
            for j in 0..3 {
                // The standard inverted a matrix rounded to 4 digits; that is worth up to 4·10⁻⁴ here.
                assert!((m[i][j] - published[i][j]).abs() < 4e-4, "{i}{j} {m:?}");
            }
        }
        let to_xyz = [
            [0.4124, 0.3576, 0.1805],
            [0.2126, 0.7152, 0.0722],
            [0.0193, 0.1192, 0.9505],
        ];
        let m = xyz_from_srgb();
        for i in 0..3 {
            for j in 0..3 {
                assert!((m[i][j] - to_xyz[i][j]).abs() < 5.1e-5, "{i}{j} {m:?}");
            }
            assert!((m[1][i] - LUMINANCE[i]).abs() < 1e-12);
        }
    }

    /// Lindbloom's table of Bradford matrices, D65 to D50 (1931): first row 1.0478112, 0.0228866, −0.0501270.
    #[test]
    fn bradford_is_that_of_the_tables() {
        let m = adaptation([0.95047, 1.0, 1.08883], [0.96422, 1.0, 0.82521]);
        let published = [
            [1.0478112, 0.0228866, -0.0501270],
            [0.0295424, 0.9904844, -0.0170491],
            [-0.0092345, 0.0150436, 0.7521316],
        ];
        for i in 0..3 {
            for j in 0..3 {
                assert!((m[i][j] - published[i][j]).abs() < 1e-6, "{m:?}");
            }
        }
    }

    #[test]
    fn d65_is_grey_for_both_observers() {
        let grid: Vec<f64> = (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect();
        for observer in [Observer::Cie1931, Observer::Cie1964] {
            let map = SpectrumToXyz::new(&grid, observer).unwrap();
            let xyz = map.xyz(&d65_spectrum(&grid));
            let rgb = apply(&srgb_from_xyz(observer), xyz.map(|c| c / xyz[1]));
            for c in rgb {
                assert!((c - 1.0).abs() < 1e-3, "{observer:?} {rgb:?}");
            }
        }
    }

    #[test]
    fn encoding_meets_itself() {
        assert!((srgb_encoded(0.5) - 0.735_356_98).abs() < 1e-7);
        assert!((srgb_encoded(1.0) - 1.0).abs() < 1e-15);
        for i in 0..=100 {
            let v = f64::from(i) / 100.0;
            assert!((srgb_decoded(srgb_encoded(v)) - v).abs() < 1e-6);
        }
    }

    #[test]
    fn out_of_gamut_keeps_luminance_and_order() {
        for rgb in [
            [-0.1, 0.3, 0.9],
            [0.2, 0.5, 1.8],
            [-0.3, 0.6, -0.2],
            [1.7, 0.3, -0.1],
        ] {
            let mapped = desaturated_into_unit(rgb);
            assert!(
                (luminance(mapped) - luminance(rgb)).abs() < 1e-12,
                "{mapped:?}"
            );
            assert!(mapped.iter().all(|c| (0.0..=1.0).contains(c)));
            // The direction from grey is the same: hue stays.
            let y = luminance(rgb);
            assert!(
                ((mapped[0] - y) * (rgb[2] - y) - (mapped[2] - y) * (rgb[0] - y)).abs() < 1e-12
            );
        }
        assert_eq!(desaturated_into_unit([0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
        assert_eq!(desaturated_into_unit([3.0, 2.0, 1.0]), [1.0; 3]);
        assert_eq!(desaturated_into_unit([f64::NAN, 0.1, 0.1]), [0.0; 3]);
        assert_eq!(desaturated_above_zero([5.0, 2.0, 9.0]), [5.0, 2.0, 9.0]);
        assert_eq!(desaturated_above_zero([-1.0, -2.0, 0.0]), [0.0; 3]);
    }
}
