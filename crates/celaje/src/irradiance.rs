//! Irradiance: the light of the whole sky, and of the sun, on a plane.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;

use crate::colour::{correlated_colour_temperature, Cct, Observer, SpectrumToXyz};
use crate::error::Result;
use crate::film::Film;
use crate::math::Vec3;
use crate::sensor::Sensor;
use crate::sky::{RenderOptions, Sky, SunDisc};
use crate::spectrum::WavelengthGrid;
use crate::transport::SunLight;

/// Cells along each side of both meters' square; each cell is sampled by itself, which lowers the noise.
const CELLS: usize = 16;

/// A spectral irradiance with its standard error.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralIrradiance {
    /// At each wavelength \[W m⁻² nm⁻¹\], shape (w,).
    pub irradiance: Vec<f64>,
    /// Its standard error, same unit and shape; 0 for a deterministic method.
    pub standard_error: Vec<f64>,
}

/// What falls on a plane at the observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Irradiance {
    /// Vacuum wavelengths \[nm\], shape (w,).
    pub wavelength_nm: Vec<f64>,
    /// From the sun's disc on a plane facing it.
    pub direct_normal: SpectralIrradiance,
    /// From the sun's disc on a level plane.
    pub direct: SpectralIrradiance,
    /// From the sky without the disc on a level plane, which looks up.
    pub diffuse: SpectralIrradiance,
    /// Sum of direct and diffuse on a level plane.
    pub global: SpectralIrradiance,
}

impl SpectralIrradiance {
    /// Sum over the bins of the wavelengths \[W m⁻²\]: what falls in within the range of the grid.
    ///
    /// # Errors
    /// As [`WavelengthGrid::new`].
    pub fn total(&self, wavelength_nm: &[f64]) -> Result<f64> {
        let edges_nm = WavelengthGrid::new(wavelength_nm.to_vec())?.bin_edges_nm();
        let widths = edges_nm.windows(2).map(|e| e[1] - e[0]);
        Ok(self.irradiance.iter().zip(widths).map(|(e, w)| e * w).sum())
    }

    /// Illuminance \[lx\], of the light within the range of the grid.
    ///
    /// # Errors
    /// As [`SpectrumToXyz::new`].
    pub fn lux(&self, wavelength_nm: &[f64]) -> Result<f64> {
        Ok(self.xyz(wavelength_nm)?[1])
    }

    /// Correlated colour temperature, if the light has one.
    ///
    /// # Errors
    /// As [`SpectrumToXyz::new`].
    pub fn cct(&self, wavelength_nm: &[f64]) -> Result<Option<Cct>> {
        Ok(correlated_colour_temperature(self.xyz(wavelength_nm)?))
    }

    fn xyz(&self, wavelength_nm: &[f64]) -> Result<[f64; 3]> {
        Ok(SpectrumToXyz::new(wavelength_nm, Observer::Cie1931)?.xyz(&self.irradiance))
    }

    /// `scale · mean over pixels of weight(pixel) · radiance`, and the standard error of that.
    fn of_film(film: &Film, scale: f64, weight: impl Fn(usize) -> f64) -> Self {
        let w = film.wavelength_nm.len();
        let pixels = film.width * film.height;
        let (mut sum, mut variance) = (vec![0.0; w], vec![0.0; w]);
        for pixel in 0..pixels {
            let share = weight(pixel) * scale / pixels as f64;
            for k in 0..w {
                sum[k] += share * f64::from(film.radiance[pixel * w + k]);
                variance[k] += share * share * f64::from(film.variance[pixel * w + k]);
            }
        }
        Self {
            irradiance: sum,
            standard_error: variance.into_iter().map(f64::sqrt).collect(),
        }
    }

    /// The sum of two that are independent of each other.
    fn plus(&self, other: &Self) -> Self {
        let add = |a: &[f64], b: &[f64], f: fn(f64, f64) -> f64| {
            a.iter().zip(b).map(|(&a, &b)| f(a, b)).collect()
        };
        Self {
            irradiance: add(&self.irradiance, &other.irradiance, |a, b| a + b),
            standard_error: add(&self.standard_error, &other.standard_error, f64::hypot),
        }
    }
}

impl Sky {
    /// Irradiance at the observer, direct and diffuse, on planes that look up and at the sun.
    ///
    /// Both are integrals of radiance by Monte Carlo: the diffuse one over the upper hemisphere, directions drawn in
    /// proportion to the cosine, `E = π ⟨L⟩`; the direct one over the disc, `E = Ω ⟨L⟩` and `Ω ⟨L cos θ⟩`. Each is stratified
    /// into 256 cells, which get `options.budget.spp` paths each. `options.sun_disc` is not looked at. `progress` runs
    /// through twice, first for the disc.
    ///
    /// # Errors
    /// As [`Sky::render`].
    pub fn irradiance(
        &self,
        options: &RenderOptions,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Irradiance> {
        let disc_alone = RenderOptions {
            sun_disc: SunDisc::Only,
            ..*options
        };
        let disc_sky = self.with_a_disc()?;
        let disc = Disc::new(&disc_sky.sun);
        let solid_angle_sr = disc_sky.sun.solid_angle_sr();
        let film = disc_sky.render(&disc, &disc_alone, cancel, progress)?;
        let direct_normal = SpectralIrradiance::of_film(&film, solid_angle_sr, |_| 1.0);
        // Within a cell the cosine is that of its middle: the cells are finer than 0.03°.
        let direct = SpectralIrradiance::of_film(&film, solid_angle_sr, |pixel| {
            let middle = disc.direction(pixel % CELLS, pixel / CELLS, 0.5, 0.5);
            middle.map_or(0.0, |d| d.z.max(0.0))
        });

        let sky_alone = RenderOptions {
            sun_disc: SunDisc::Off,
            ..*options
        };
        let film = self.render(&Hemisphere, &sky_alone, cancel, progress)?;
        let diffuse = SpectralIrradiance::of_film(&film, PI, |_| 1.0);
        Ok(Irradiance {
            wavelength_nm: self.wavelength_nm().to_vec(),
            global: direct.plus(&diffuse),
            direct_normal,
            direct,
            diffuse,
        })
    }

    /// The same sky; a collimated sun, which no finite direction meets, is given a disc of 0.01°.
    fn with_a_disc(&self) -> Result<Self> {
        let mut sky = self.clone();
        if sky.sun.solid_angle_sr() == 0.0 {
            let n = sky.wavelength_nm().len();
            let irradiance: Vec<f64> = sky.sun.irradiance[..n].iter().map(|&e| e.into()).collect();
            sky.sun = SunLight::new(sky.sun.direction, sky.wavelength_nm(), &irradiance, 0.01)?;
        }
        Ok(sky)
    }
}

/// Directions of the upper hemisphere in proportion to their cosine: columns in zenith angle, rows in azimuth.
struct Hemisphere;

impl Sensor for Hemisphere {
    fn size(&self) -> (usize, usize) {
        (CELLS, CELLS)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let sin_squared = (column as f64 + u) / CELLS as f64;
        let (sin_phi, cos_phi) = (TAU * (row as f64 + v) / CELLS as f64).sin_cos();
        let sin = sin_squared.sqrt();
        Some(Vec3::new(
            sin * sin_phi,
            sin * cos_phi,
            (1.0 - sin_squared).sqrt(),
        ))
    }
}

/// Directions of the sun's disc, uniform in solid angle.
struct Disc {
    middle: Vec3,
    one_minus_cos_radius: f64,
}

impl Disc {
    fn new(sun: &SunLight) -> Self {
        Self {
            middle: sun.direction,
            one_minus_cos_radius: sun.solid_angle_sr() / TAU,
        }
    }
}

impl Sensor for Disc {
    fn size(&self) -> (usize, usize) {
        (CELLS, CELLS)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let share = (column as f64 + u) / CELLS as f64;
        let phi = TAU * (row as f64 + v) / CELLS as f64;
        let cos_theta = 1.0 - share * self.one_minus_cos_radius;
        Some(self.middle.deflected(cos_theta, phi))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::climate::{Conditions, Overrides};
    use crate::medium::LayeredMedium;
    use crate::optics::Phase;
    use crate::sky::Method;
    use crate::spectrum::SolarSpectrum;
    use crate::transport::{Accuracy, Budget};

    fn options(spp: u32, altitude_m: Option<f64>) -> RenderOptions {
        RenderOptions {
            method: Method::default(),
            accuracy: Accuracy::default(),
            budget: Budget {
                spp,
                seed: 3,
                max_order: None,
            },
            sun_disc: SunDisc::On,
            altitude_m,
        }
    }

    fn measured(sky: &Sky, options: &RenderOptions) -> Irradiance {
        sky.irradiance(options, &AtomicBool::new(false), &|_, _| {})
            .unwrap()
    }

    /// `π ⟨f⟩` over the hemisphere's cells is ∫ f cos θ dω: π, 2π/3, π/2 for f = 1, cos θ, cos² θ; 0 for what is odd.
    #[test]
    fn the_hemisphere_integrates_with_the_cosine() {
        let integral = |f: fn(Vec3) -> f64| {
            let cells = (0..CELLS * CELLS).flat_map(|i| (0..100).map(move |k| (i, k)));
            let sum: f64 = cells
                .map(|(i, k)| {
                    let (u, v) = ((f64::from(k) + 0.5) / 100.0, 0.5);
                    f(Hemisphere.direction(i % CELLS, i / CELLS, u, v).unwrap())
                })
                .sum();
            PI * sum / (CELLS * CELLS * 100) as f64
        };
        assert!((integral(|_| 1.0) - PI).abs() < 1e-12);
        assert!((integral(|d| d.z) - 2.0 * PI / 3.0).abs() < 1e-4);
        assert!((integral(|d| d.z * d.z) - 0.5 * PI).abs() < 1e-4);
        assert!(integral(|d| d.x).abs() < 1e-12 && integral(|d| d.y).abs() < 1e-12);
    }

    /// Above the air all sunlight is direct, whatever the limb darkening, and its cosine is that of the sun.
    #[test]
    fn above_the_air_there_is_sunlight_only() {
        let grid = WavelengthGrid::new(vec![450.0, 550.0, 650.0]).unwrap();
        let conditions = Conditions::from_sun(30.0, 120.0, &Overrides::default()).unwrap();
        let sky = Sky::new(conditions, &grid, SolarSpectrum::Tsis1).unwrap();
        let e = measured(&sky, &options(4, Some(1e6)));
        let sun = SolarSpectrum::Tsis1.irradiance(&grid).unwrap();
        for (k, expected) in sun.iter().enumerate() {
            // Four points in each of 16 rings of a disc that darkens to its limb.
            assert!((e.direct_normal.irradiance[k] / expected - 1.0).abs() < 2e-3);
            assert!((e.direct.irradiance[k] / expected - 0.5).abs() < 1e-3);
            assert_eq!(e.diffuse.irradiance[k], 0.0);
            assert_eq!(e.global.irradiance[k], e.direct.irradiance[k]);
        }
    }

    /// An absorbing air under a collimated sun: `E = E₀ exp(−τ)`, within 4.99 standard errors, nothing diffuse.
    #[test]
    fn an_absorbing_air_follows_beer_and_lambert() {
        let tau = [0.1, 0.7];
        let mut medium = LayeredMedium::new(&[0.0, 1e4], &[450.0, 550.0], 6.36e6).unwrap();
        let sigma_a: Vec<f64> = [tau, tau].concat().iter().map(|t| t / 1e4).collect();
        let phase = Phase::rayleigh(&[0.0, 0.0]).unwrap();
        medium.add(&[0.0; 4], &sigma_a, phase).unwrap();
        let sky = Sky::from_medium(medium, 90.0, 0.0, &[0.0; 2], &[2.0; 2], 0.0).unwrap();
        let e = measured(&sky, &options(64, None));
        for (k, tau) in tau.iter().enumerate() {
            let expected = 2.0 * (-tau).exp();
            let allowed = 4.99 * e.direct.standard_error[k] + 1e-5 * expected;
            assert!(e.direct.standard_error[k] < 0.01 * expected);
            assert!((e.direct.irradiance[k] - expected).abs() < allowed);
            assert!((e.direct_normal.irradiance[k] - expected).abs() < allowed);
            assert_eq!(e.diffuse.irradiance[k], 0.0);
        }
    }

    /// A non-absorbing air over black ground sends away what does not arrive: global at the ground stays below the
    /// sunlight on a level plane, and more than half of what scattering takes arrives.
    #[test]
    fn what_scattering_takes_arrives_from_the_sky_in_part() {
        let mut medium = LayeredMedium::new(&[0.0, 1e4], &[450.0], 6.36e6).unwrap();
        let tau = 0.2;
        let phase = Phase::henyey_greenstein(&[0.5]).unwrap();
        medium.add(&[tau / 1e4; 2], &[0.0; 2], phase).unwrap();
        let sky = Sky::from_medium(medium, 90.0, 0.0, &[0.0], &[1.0], 0.0).unwrap();
        let e = measured(&sky, &options(64, None));
        let lost = 1.0 - (-tau).exp();
        let diffuse = e.diffuse.irradiance[0];
        assert!(diffuse > 0.5 * lost && diffuse < lost, "{diffuse} {lost}");
        assert!(e.global.standard_error[0] < 0.02);
    }

    #[test]
    fn units_of_sums() {
        let flat = SpectralIrradiance {
            irradiance: vec![2.0; 81],
            standard_error: vec![0.0; 81],
        };
        let grid = WavelengthGrid::default();
        // 405 nm wide: 81 bins of 5 nm. An equal-energy spectrum has 683 · 106.9 nm lux per W m⁻² nm⁻¹, and 5455 K.
        assert!((flat.total(grid.nm()).unwrap() - 810.0).abs() < 1e-9);
        assert!((flat.lux(grid.nm()).unwrap() / (2.0 * 683.0 * 106.86) - 1.0).abs() < 2e-3);
        let cct = flat.cct(grid.nm()).unwrap().unwrap();
        assert!((cct.temperature_k - 5455.0).abs() < 10.0);
    }
}
