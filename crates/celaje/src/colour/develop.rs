//! From a film to colours: absolute linear sRGB, and what a display shows.

use rayon::prelude::*;

use super::matrix::apply;
use super::observer::{Observer, SpectrumToXyz};
use super::srgb::srgb_from_xyz;
use super::tone::{Exposure, ToneCurve};
use crate::error::{Error, Result};
use crate::film::Film;

/// Everything a person chooses about the colours of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Look {
    /// Whose eyes.
    pub observer: Observer,
    /// From luminance to display value.
    pub tone: ToneCurve,
    /// Which luminance is white.
    pub exposure: Exposure,
}

/// A film seen by an observer.
#[derive(Debug, Clone, PartialEq)]
pub struct ColourImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear sRGB \[cd m⁻²\], (1, 1, 1) a D65 white of 1 cd m⁻², shape (height · width,). Channels are negative where a
    /// colour is out of gamut; black where the film has no sample or a value that is not a number.
    pub rgb: Vec<[f32; 3]>,
    /// Y of the observer \[cd m⁻²\], same shape. For the 1964 observer a luminance with ȳ₁₀ in place of V(λ).
    pub luminance: Vec<f32>,
    /// Whether the sensor sees anything there, same shape.
    pub lit: Vec<bool>,
}

impl ColourImage {
    /// The colours of every pixel of a film.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`] for a film whose arrays do not fit its size, and those of [`SpectrumToXyz::new`].
    pub fn from_film(film: &Film, observer: Observer) -> Result<Self> {
        let pixels = film.width * film.height;
        let wavelengths = film.wavelength_nm.len();
        check_length("film.samples", film.samples.len(), pixels)?;
        check_length("film.radiance", film.radiance.len(), pixels * wavelengths)?;
        let to_xyz = SpectrumToXyz::new(&film.wavelength_nm, observer)?;
        let to_rgb = srgb_from_xyz(observer);
        let (rgb, luminance) = (0..pixels)
            .into_par_iter()
            .map(|pixel| {
                let xyz = to_xyz.xyz(film.spectrum(pixel));
                if !(film.is_lit(pixel) && xyz.iter().all(|c| c.is_finite())) {
                    return ([0.0; 3], 0.0);
                }
                (apply(&to_rgb, xyz).map(|c| c as f32), xyz[1] as f32)
            })
            .unzip();
        Ok(Self {
            width: film.width,
            height: film.height,
            rgb,
            luminance,
            lit: (0..pixels).map(|pixel| film.is_lit(pixel)).collect(),
        })
    }

    /// Red, green, blue and alpha for a display, each in [0, 1], shape (height · width,); black with alpha 0 where the
    /// sensor sees nothing.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the exposure.
    pub fn display(&self, tone: ToneCurve, exposure: Exposure) -> Result<Vec<[f32; 4]>> {
        let white = exposure.white(&self.luminance)?;
        Ok((0..self.rgb.len())
            .into_par_iter()
            .map(|pixel| {
                if !self.lit[pixel] {
                    return [0.0; 4];
                }
                let rgb = self.rgb[pixel].map(f64::from);
                let [r, g, b] = tone
                    .display(rgb, f64::from(self.luminance[pixel]), white)
                    .map(|c| c as f32);
                [r, g, b, 1.0]
            })
            .collect())
    }
}

fn check_length(name: &str, got: usize, expected: usize) -> Result<()> {
    if got == expected {
        return Ok(());
    }
    Err(Error::ShapeMismatch {
        name: name.to_owned(),
        got: format!("({got},)"),
        expected: format!("({expected},)"),
    })
}

#[cfg(test)]
mod tests {
    use super::super::observer::tests::d65_spectrum;
    use super::super::srgb::luminance;
    use super::*;

    /// Three pixels: D65, nothing seen, NaN.
    fn film() -> Film {
        let grid: Vec<f64> = (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect();
        let mut film = Film::new(3, 1, &grid).unwrap();
        for (value, power) in film.radiance.iter_mut().zip(d65_spectrum(&grid)) {
            *value = 1e-4 * power as f32;
        }
        film.radiance[170] = f32::NAN;
        film.samples = vec![1, 0, 1];
        film
    }

    #[test]
    fn d65_is_grey_with_its_luminance() {
        for observer in [Observer::Cie1931, Observer::Cie1964] {
            let image = ColourImage::from_film(&film(), observer).unwrap();
            let y = image.luminance[0];
            for c in image.rgb[0] {
                assert!((c / y - 1.0).abs() < 1e-3, "{:?}", image.rgb[0]);
            }
            assert!((luminance(image.rgb[0].map(f64::from)) / f64::from(y) - 1.0).abs() < 1e-4);
            for tone in ToneCurve::ALL {
                // Far above white everything is white.
                let bright = image.display(tone, Exposure::Ev(20.0)).unwrap();
                assert!(bright[0].iter().all(|c| (c - 1.0).abs() < 1e-6));
                let shown = image.display(tone, Exposure::Auto).unwrap();
                let [r, g, b, alpha] = shown[0];
                assert!((r - g).abs() < 1e-3 && (b - g).abs() < 1e-3, "{shown:?}");
                assert!(g > 0.3 && g < 0.8 && alpha == 1.0, "{shown:?}");
                assert_eq!(shown[1], [0.0; 4]);
                assert_eq!(shown[2], [0.0, 0.0, 0.0, 1.0]);
            }
        }
    }

    #[test]
    fn a_film_that_does_not_fit_itself_is_refused() {
        let mut broken = film();
        broken.radiance.pop();
        assert!(ColourImage::from_film(&broken, Observer::Cie1931).is_err());
    }
}
