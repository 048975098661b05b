//! Spectral radiance per pixel and wavelength, with the variance of each value; with polarisation where it was solved for.

mod merge;

pub(crate) use merge::Weights;

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
    /// The other Stokes components, where they were solved for.
    pub polarisation: Option<Polarisation>,
}

/// One quantity per pixel and wavelength with its variance, both in the order of [`Film::radiance`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plane {
    /// Mean \[W m⁻² sr⁻¹ nm⁻¹\], shape (height · width · w,).
    pub mean: Vec<f32>,
    /// Variance of that mean, same shape; 0 for a deterministic method.
    pub variance: Vec<f32>,
}

/// Stokes components beside the radiance, which is the first of them, I.
///
/// The basis is (θ̂, φ̂, k): k is the direction in which light travels, θ̂ points along increasing zenith angle of k in its
/// vertical plane, φ̂ = k × θ̂. See `docs/conventions.md`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Polarisation {
    /// Q = |E_θ|² − |E_φ|².
    pub q: Plane,
    /// U = 2 Re(E_θ E_φ*).
    pub u: Plane,
    /// V = 2 Im(E_θ E_φ*), fields going as exp(−iωt).
    pub v: Plane,
}

impl Polarisation {
    /// Names of the components, in the order of [`Polarisation::planes`].
    pub const NAMES: [&'static str; 3] = ["Q", "U", "V"];

    /// The components Q, U, V.
    pub fn planes(&self) -> [&Plane; 3] {
        [&self.q, &self.u, &self.v]
    }

    /// The components Q, U, V, to be filled.
    pub fn planes_mut(&mut self) -> [&mut Plane; 3] {
        [&mut self.q, &mut self.u, &mut self.v]
    }
}

/// A pixel of a film, to be filled.
pub(crate) struct PixelMut<'a> {
    pub samples: &'a mut u32,
    /// Mean and variance of the radiance and, in a polarised film, of Q, U, V.
    pub stokes: Vec<(&'a mut [f32], &'a mut [f32])>,
}

impl Film {
    /// Memory that a film may take \[bytes\].
    pub const MEMORY_LIMIT_BYTES: u128 = 16 << 30;

    /// Makes sure that a film of a size and a number of wavelengths can be had, without making it.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an empty picture, [`Error::TooLarge`] beyond [`Film::MEMORY_LIMIT_BYTES`].
    pub fn check_size(width: usize, height: usize, wavelengths: usize) -> Result<()> {
        Self::check_size_of(width, height, wavelengths, 1)
    }

    /// [`Film::check_size`] for a number of Stokes components, 1 or 4.
    fn check_size_of(
        width: usize,
        height: usize,
        wavelengths: usize,
        components: usize,
    ) -> Result<()> {
        if width == 0 || height == 0 {
            return Err(Error::invalid(
                format!("size {width}x{height} has no pixels"),
                "give a size of at least 1x1",
            ));
        }
        // Two values of 4 bytes per wavelength and the count of samples; sizes beyond any number end as too large.
        let pixels = width as u128 * height as u128;
        let bytes = pixels.saturating_mul(8 * wavelengths as u128 * components as u128 + 4);
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
            polarisation: None,
        })
    }

    /// A black film of all four Stokes components, without samples.
    ///
    /// # Errors
    /// As [`Film::check_size`].
    pub fn new_polarised(width: usize, height: usize, wavelength_nm: &[f64]) -> Result<Self> {
        Self::check_size_of(width, height, wavelength_nm.len(), 4)?;
        let mut film = Self::new(width, height, wavelength_nm)?;
        let plane = Plane {
            mean: film.radiance.clone(),
            variance: film.variance.clone(),
        };
        film.polarisation = Some(Polarisation {
            q: plane.clone(),
            u: plane.clone(),
            v: plane,
        });
        Ok(film)
    }

    /// Every pixel, to be filled independently.
    pub(crate) fn pixels_mut(&mut self) -> Vec<PixelMut<'_>> {
        let w = self.wavelength_nm.len();
        let radiance = self.radiance.chunks_exact_mut(w);
        let radiance = radiance.zip(self.variance.chunks_exact_mut(w));
        let mut pixels: Vec<PixelMut<'_>> = self
            .samples
            .iter_mut()
            .zip(radiance)
            .map(|(samples, radiance)| PixelMut {
                samples,
                stokes: vec![radiance],
            })
            .collect();
        for plane in self.polarisation.iter_mut().flat_map(|p| p.planes_mut()) {
            let values = plane.mean.chunks_exact_mut(w);
            let values = values.zip(plane.variance.chunks_exact_mut(w));
            for (pixel, value) in pixels.iter_mut().zip(values) {
                pixel.stokes.push(value);
            }
        }
        pixels
    }

    /// Degree of linear polarisation `√(Q² + U²) / I` \[1\] at a pixel and wavelength, 0 where it is black; noise makes it too
    /// large where there is little. `None` in a film without polarisation.
    pub fn degree_of_polarisation(&self, pixel: usize, wavelength: usize) -> Option<f32> {
        let at = pixel * self.wavelength_nm.len() + wavelength;
        let p = self.polarisation.as_ref()?;
        let i = self.radiance[at];
        let linear = p.q.mean[at].hypot(p.u.mean[at]);
        Some(if i > 0.0 { linear / i } else { 0.0 })
    }

    /// Angle of polarisation `½ atan2(U, Q)` \[deg\] in (−90, 90]: from θ̂ (the vertical plane) towards φ̂, of the electric
    /// field. `None` in a film without polarisation.
    pub fn angle_of_polarisation_deg(&self, pixel: usize, wavelength: usize) -> Option<f32> {
        let at = pixel * self.wavelength_nm.len() + wavelength;
        let p = self.polarisation.as_ref()?;
        Some(0.5 * p.u.mean[at].atan2(p.q.mean[at]).to_degrees())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_share_out_every_plane() {
        let mut film = Film::new_polarised(3, 2, &[500.0, 600.0]).unwrap();
        for (i, pixel) in film.pixels_mut().into_iter().enumerate() {
            *pixel.samples = 1;
            assert_eq!(pixel.stokes.len(), 4);
            for (c, (mean, variance)) in pixel.stokes.into_iter().enumerate() {
                mean[1] = (10 * i + c) as f32;
                variance[0] = 0.5;
            }
        }
        assert_eq!(film.radiance[2 * 4 + 1], 40.0);
        let p = film.polarisation.as_ref().unwrap();
        for (c, plane) in p.planes().into_iter().enumerate() {
            assert_eq!(plane.mean[2 * 4 + 1], (41 + c) as f32);
            assert_eq!(plane.variance[..2], [0.5, 0.0]);
        }
        assert_eq!(
            Film::new(3, 2, &[500.0]).unwrap().pixels_mut()[0]
                .stokes
                .len(),
            1
        );
    }

    /// E along φ̂ alone: Q = −I; along the middle between θ̂ and φ̂: U = I.
    #[test]
    fn degree_and_angle_of_polarisation() {
        let mut film = Film::new_polarised(3, 1, &[500.0]).unwrap();
        film.radiance = vec![2.0, 2.0, 0.0];
        if let Some(p) = &mut film.polarisation {
            p.q.mean[0] = -1.0;
            p.u.mean[1] = 2.0;
        }
        assert_eq!(film.degree_of_polarisation(0, 0), Some(0.5));
        assert_eq!(film.angle_of_polarisation_deg(0, 0), Some(90.0));
        assert_eq!(film.degree_of_polarisation(1, 0), Some(1.0));
        assert_eq!(film.angle_of_polarisation_deg(1, 0), Some(45.0));
        assert_eq!(film.degree_of_polarisation(2, 0), Some(0.0));
        let scalar = Film::new(1, 1, &[500.0]).unwrap();
        assert_eq!(scalar.degree_of_polarisation(0, 0), None);
    }
}
