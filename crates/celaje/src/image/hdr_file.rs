//! HDR: Radiance's RGBE pictures, 8 bits of mantissa per channel and a shared exponent.
//!
//! Written here rather than by a library because those at hand cannot put the conditions into the header, and a flat
//! (uncompressed) picture is a few lines.
//!
//! Format: G. Ward, *Real pixels*, Graphics Gems II (1991), 80–83; Radiance's reference manual, "Picture file format".

use std::io::Write;
use std::path::Path;

use super::target::write_whole;
use super::Metadata;
use crate::colour::{desaturated_above_zero, ColourImage, Observer};
use crate::error::Result;
use crate::film::Film;

/// Radiance's luminous efficacy of white light \[lm W⁻¹\].
const RADIANCE_EFFICACY: f64 = 179.0;

/// Writes a film as a Radiance picture: linear sRGB in cd m⁻², black where the sensor sees nothing.
///
/// The header says `EXPOSURE=179`, so that Radiance's own programs, which count in watts of white light (179 lm/W) and
/// divide by it, find the right luminance. Colours out of gamut are desaturated, for the format knows no negative
/// numbers. The metadata are header lines `celaje.NAME=VALUE`.
///
/// # Errors
/// As [`super::save`].
pub fn write_hdr(path: &Path, film: &Film, observer: Observer, metadata: &Metadata) -> Result<()> {
    let image = ColourImage::from_film(film, observer)?;
    write_whole(path, |w| {
        writeln!(w, "#?RADIANCE")?;
        writeln!(w, "SOFTWARE=celaje {}", env!("CARGO_PKG_VERSION"))?;
        for (name, value) in metadata {
            writeln!(w, "celaje.{}={}", one_line(name), one_line(value))?;
        }
        writeln!(w, "EXPOSURE={RADIANCE_EFFICACY}")?;
        writeln!(
            w,
            "PRIMARIES=0.6400 0.3300 0.3000 0.6000 0.1500 0.0600 0.3127 0.3290"
        )?;
        writeln!(w, "FORMAT=32-bit_rle_rgbe\n")?;
        writeln!(w, "-Y {} +X {}", image.height, image.width)?;
        for rgb in &image.rgb {
            w.write_all(&rgbe(desaturated_above_zero(rgb.map(f64::from))))?;
        }
        Ok(())
    })
}

/// A blank line would end the header.
fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// Three mantissas and the exponent they share, `value = (mantissa + ½) / 256 · 2^(exponent − 128)`.
fn rgbe(rgb: [f64; 3]) -> [u8; 4] {
    let largest = rgb.iter().fold(0f64, |a, &b| a.max(b));
    // Ward's own limit for black; the upper end is the largest exponent.
    if largest < 1e-32 {
        return [0; 4];
    }
    let largest = largest.min(255.0 / 256.0 * 127f64.exp2());
    // 2^(e−1) ≤ largest < 2^e, exactly, from the bits of the number.
    let exponent = ((largest.to_bits() >> 52) & 0x7ff) as i32 - 1022;
    let scale = 256.0 * f64::from(-exponent).exp2();
    let mantissa = |c: f64| (c * scale) as u8;
    [
        mantissa(rgb[0]),
        mantissa(rgb[1]),
        mantissa(rgb[2]),
        (exponent + 128) as u8,
    ]
}

#[cfg(test)]
mod tests {
    use super::super::test_support::{film, metadata, Folder};
    use super::*;

    fn decoded(rgbe: [u8; 4]) -> [f64; 3] {
        if rgbe[3] == 0 {
            return [0.0; 3];
        }
        let scale = f64::from(i32::from(rgbe[3]) - 128 - 8).exp2();
        [0, 1, 2].map(|k| (f64::from(rgbe[k]) + 0.5) * scale)
    }

    /// Ward's example: mantissas are truncated, the largest is at least 128.
    #[test]
    fn rgbe_keeps_one_percent_of_the_largest() {
        assert_eq!(rgbe([1.0, 0.5, 0.25]), [128, 64, 32, 129]);
        assert_eq!(rgbe([0.0; 3]), [0; 4]);
        for scale in [1e-30, 1e-7, 0.9999, 1.0, 3.7, 1.6e9, 1e37] {
            let rgb = [0.1, 0.77, 0.3].map(|c| c * scale);
            let code = rgbe(rgb);
            assert!(code.iter().take(3).any(|&m| m >= 128));
            for (c, d) in rgb.iter().zip(decoded(code)) {
                assert!((c - d).abs() <= 0.77 * scale / 255.0);
            }
        }
        assert_eq!(rgbe([1e60, 0.0, 0.0])[3], 255);
    }

    #[test]
    fn header_and_pixels_come_back() {
        let folder = Folder::new("hdr");
        let film = film(9, 3, &[450.0, 550.0, 650.0]);
        let path = folder.join("a.hdr");
        write_hdr(&path, &film, Observer::Cie1964, &metadata()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let pixels = &bytes[bytes.len() - 9 * 3 * 4..];
        let header = String::from_utf8(bytes[..bytes.len() - 9 * 3 * 4].to_vec()).unwrap();
        assert!(header.starts_with("#?RADIANCE\n"));
        assert!(header.ends_with("FORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 9\n"));
        assert!(header.contains("\ncelaje.north=up; east is left\n"));
        assert_eq!(header.matches("\n\n").count(), 1);
        let image = ColourImage::from_film(&film, Observer::Cie1964).unwrap();
        assert_eq!(pixels[..4], [0; 4]);
        for (code, rgb) in pixels.chunks(4).zip(&image.rgb) {
            let d = decoded([code[0], code[1], code[2], code[3]]);
            let expected = desaturated_above_zero(rgb.map(f64::from));
            let largest = expected.iter().fold(0f64, |a, &b| a.max(b));
            for k in 0..3 {
                assert!((d[k] - expected[k]).abs() <= largest / 128.0);
            }
        }
    }
}
