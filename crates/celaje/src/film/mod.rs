//! Spectral radiance per pixel and wavelength, with the variance of each value.

use crate::error::{Error, Result};

/// A picture of spectral radiance, or a list of directions (`height == 1`).
///
/// Row 0 is the top of the picture; the index of a value is `(row * width + column) * wavelengths + wavelength`.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Vacuum wavelengths \[nm\], shape (w,).
    pub wavelength_nm: Vec<f64>,
    /// Samples behind each pixel, shape (height · width,); 0 where the sensor sees nothing (outside the fisheye's disc).
    pub samples: Vec<u32>,
    /// Mean spectral radiance \[W m⁻² sr⁻¹ nm⁻¹\], shape (height · width · w,).
    pub radiance: Vec<f32>,
    /// Variance of that mean, same shape; 0 for a deterministic method.
    pub variance: Vec<f32>,
}

impl Film {
    /// Memory that a film may take \[bytes\].
    pub const MEMORY_LIMIT_BYTES: u128 = 16 << 30;

    /// Makes sure that a film of a size and a number of wavelengths can be had, without making it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an empty picture, [`Error::TooLarge`] beyond [`Film::MEMORY_LIMIT_BYTES`].
    pub fn check_size(width: usize, height: usize, wavelengths: usize) -> Result<()> {
        if width == 0 || height == 0 {
            return Err(Error::invalid(
                format!("size {width}x{height} has no pixels"),
                "give a size of at least 1x1",
            ));
        }
        // Two values of 4 bytes per wavelength and the count of samples; sizes beyond any number end as too large.
        let pixels = width as u128 * height as u128;
        let bytes = pixels.saturating_mul(8 * wavelengths as u128 + 4);
        if bytes > Self::MEMORY_LIMIT_BYTES {
            return Err(Error::TooLarge {
                what: format!("a film of {width}x{height} pixels and {wavelengths} wavelengths"),
                bytes,
                limit_bytes: Self::MEMORY_LIMIT_BYTES,
            });
        }
        Ok(())
    }

    /// A black film without samples.
    ///
    /// # Errors
    /// As [`Film::check_size`].
    pub fn new(width: usize, height: usize, wavelength_nm: &[f64]) -> Result<Self> {
        Self::check_size(width, height, wavelength_nm.len())?;
        let pixels = width * height;
        let values = pixels * wavelength_nm.len();
        Ok(Self {
            width,
            height,
            wavelength_nm: wavelength_nm.to_vec(),
            samples: vec![0; pixels],
            radiance: vec![0.0; values],
            variance: vec![0.0; values],
        })
    }

    /// Spectral radiance of one pixel, shape (w,).
    pub fn spectrum(&self, pixel: usize) -> &[f32] {
        let w = self.wavelength_nm.len();
        &self.radiance[pixel * w..(pixel + 1) * w]
    }

    /// Whether the sensor sees anything at this pixel.
    pub fn is_lit(&self, pixel: usize) -> bool {
        self.samples[pixel] > 0
    }
}
