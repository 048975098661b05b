//! Irradiance: the light of the whole sky, and of the sun, on a plane.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;

use crate::colour::{correlated_colour_temperature, Cct, Observer, SpectrumToXyz};
use crate::error::{check_range, Result};
use crate::film::Film;
use crate::math::Vec3;
use crate::sensor::Sensor;
use crate::sky::{Method, Polarised, RenderOptions, Sky, SunDisc};
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

/// How a plane stands that light falls on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tilt {
    /// From level, which is 0, over upright, 90, to facing down, 180 \[deg\].
    pub tilt_deg: f64,
    /// Where it faces if it is tilted, clockwise from north \[deg\].
    pub azimuth_deg: f64,
}

impl Tilt {
    /// Unit vector that the plane faces.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for a tilt outside 0 to 180 or an azimuth outside −360 to 360.
    fn normal(&self) -> Result<Vec3> {
        check_range("tilt", self.tilt_deg, "deg", 0.0..=180.0)?;
        check_range("tilt azimuth", self.azimuth_deg, "deg", -360.0..=360.0)?;
        if self.tilt_deg == 0.0 {
            return Ok(Vec3::new(0.0, 0.0, 1.0));
        }
        Ok(Vec3::from_azimuth_elevation_deg(
            self.azimuth_deg,
            90.0 - self.tilt_deg,
        ))
    }
}

/// What falls on a plane at the observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Irradiance {
    /// Vacuum wavelengths \[nm\], shape (w,).
    pub wavelength_nm: Vec<f64>,
    /// From the sun's disc on a plane facing it.
    pub direct_normal: SpectralIrradiance,
    /// From the sun's disc on the plane.
    pub direct: SpectralIrradiance,
    /// From all else on the plane: the sky without the disc and, where the plane is tilted, the ground.
    pub diffuse: SpectralIrradiance,
    /// Sum of direct and diffuse.
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

    /// Illuminance \[lx\], of the light within the range of the grid; `None` for a single wavelength and for a grid outside 360–830 nm,
    /// which say nothing of it.
    ///
    /// # Errors
    /// As [`SpectrumToXyz::new`].
    pub fn lux(&self, wavelength_nm: &[f64]) -> Result<Option<f64>> {
        Ok(self.xyz(wavelength_nm)?.map(|xyz| xyz[1]))
    }

    /// Correlated colour temperature, if the light has one.
    ///
    /// # Errors
    /// As [`SpectrumToXyz::new`].
    pub fn cct(&self, wavelength_nm: &[f64]) -> Result<Option<Cct>> {
        let xyz = self.xyz(wavelength_nm)?;
        Ok(xyz.and_then(correlated_colour_temperature))
    }

    fn xyz(&self, wavelength_nm: &[f64]) -> Result<Option<[f64; 3]>> {
        let map = SpectrumToXyz::new(wavelength_nm, Observer::Cie1931)?;
        Ok((!map.is_grey()).then(|| map.xyz(&self.irradiance)))
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
    /// Irradiance at the observer, direct and diffuse, on a plane and, of the direct light, on one that faces the sun.
    ///
    /// By Monte Carlo, the diffuse part is the integral over the hemisphere that the plane faces, directions drawn in
    /// proportion to the cosine, `E = π ⟨L⟩`; the direct one that over the disc, `E = Ω ⟨L⟩` and `Ω ⟨L cos θ⟩`. Each is stratified
    /// into 256 cells, which get `options.budget.spp` paths each. The method `shells` takes the diffuse part at 9216 fixed
    /// directions, dense about the sun. `options.sun_disc` is not looked at. `progress` runs through twice, first for the
    /// disc.
    ///
    /// # Errors
    /// As [`Sky::render`]; [`crate::Error::OutOfRange`] for the plane.
    pub fn irradiance(
        &self,
        plane: &Tilt,
        options: &RenderOptions,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Irradiance> {
        // Planes collect radiance: Q, U and V of the sky would be thrown away.
        let polarised = match options.polarised {
            Polarised::Stokes => Polarised::Radiance,
            other => other,
        };
        let normal = plane.normal()?;
        let disc_alone = RenderOptions {
            sun_disc: SunDisc::Only,
            polarised,
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
            middle.map_or(0.0, |d| d.dot(normal).max(0.0))
        });

        let sky_alone = RenderOptions {
            sun_disc: SunDisc::Off,
            polarised,
            ..*options
        };
        let diffuse = if options.method == Method::Shells {
            let around = AroundSun::new(&self.sun, normal);
            let film = self.render(&around, &sky_alone, cancel, progress)?;
            SpectralIrradiance::of_film(&film, around.cells() as f64, |cell| around.weight_sr(cell))
        } else {
            let film = self.render(&Hemisphere { normal }, &sky_alone, cancel, progress)?;
            SpectralIrradiance::of_film(&film, PI, |_| 1.0)
        };
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

/// Directions of the hemisphere that a plane faces, in proportion to their cosine: columns in the angle from its normal,
/// rows in the angle about it.
struct Hemisphere {
    normal: Vec3,
}

impl Sensor for Hemisphere {
    fn size(&self) -> (usize, usize) {
        (CELLS, CELLS)
    }

    fn direction(&self, column: usize, row: usize, u: f64, v: f64) -> Option<Vec3> {
        let sin_squared = (column as f64 + u) / CELLS as f64;
        let phi = TAU * (row as f64 + v) / CELLS as f64;
        Some(self.normal.deflected((1.0 - sin_squared).sqrt(), phi))
    }
}

/// Fixed directions over the whole sphere, in rings about the sun: `θ = π t²` at the middles of equal steps of `t`, so
/// that the aureole is resolved however narrow; those behind the plane are not looked at.
struct AroundSun {
    sun: Vec3,
    normal: Vec3,
}

impl AroundSun {
    const RINGS: usize = 96;
    const SPOKES: usize = 96;

    fn new(sun: &SunLight, normal: Vec3) -> Self {
        let sun = sun.direction;
        Self { sun, normal }
    }

    fn cells(&self) -> usize {
        Self::RINGS * Self::SPOKES
    }

    fn look(&self, column: usize, row: usize) -> (Vec3, f64) {
        let t = (column as f64 + 0.5) / Self::RINGS as f64;
        let phi = TAU * (row as f64 + 0.5) / Self::SPOKES as f64;
        let theta = PI * t * t;
        (self.sun.deflected(theta.cos(), phi), t)
    }

    /// Solid angle of a cell times the cosine from the plane's normal: `sin θ dθ dφ`, `dθ = 2 π t dt`.
    fn weight_sr(&self, cell: usize) -> f64 {
        let (direction, t) = self.look(cell % Self::RINGS, cell / Self::RINGS);
        let solid = (PI * t * t).sin() * 2.0 * PI * t * TAU / self.cells() as f64;
        solid * direction.dot(self.normal).max(0.0)
    }
}

impl Sensor for AroundSun {
    fn size(&self) -> (usize, usize) {
        (Self::RINGS, Self::SPOKES)
    }

    fn direction(&self, column: usize, row: usize, _: f64, _: f64) -> Option<Vec3> {
        let (direction, _) = self.look(column, row);
        (direction.dot(self.normal) > 0.0).then_some(direction)
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
    use crate::spectrum::SolarSpectrum;
    use crate::transport::{Accuracy, Budget};

    fn options(spp: u32, altitude_m: Option<f64>) -> RenderOptions {
        RenderOptions {
            polarised: Polarised::default(),
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
        sky.irradiance(
            &Tilt::default(),
            options,
            &AtomicBool::new(false),
            &|_, _| {},
        )
        .unwrap()
    }

    /// `π ⟨f⟩` over the hemisphere's cells is ∫ f cos θ dω: π, 2π/3, π/2 for f = 1, cos θ, cos² θ; 0 for what is odd.
    #[test]
    fn the_hemisphere_integrates_with_the_cosine() {
        let up = Hemisphere {
            normal: Vec3::new(0.0, 0.0, 1.0),
        };
        let integral = |f: fn(Vec3) -> f64| {
            let cells = (0..CELLS * CELLS).flat_map(|i| (0..100).map(move |k| (i, k)));
            let sum: f64 = cells
                .map(|(i, k)| {
                    let (u, v) = ((f64::from(k) + 0.5) / 100.0, 0.5);
                    f(up.direction(i % CELLS, i / CELLS, u, v).unwrap())
                })
                .sum();
            PI * sum / (CELLS * CELLS * 100) as f64
        };
        assert!((integral(|_| 1.0) - PI).abs() < 1e-12);
        assert!((integral(|d| d.z) - 2.0 * PI / 3.0).abs() < 1e-4);
        assert!((integral(|d| d.z * d.z) - 0.5 * PI).abs() < 1e-4);
        assert!(integral(|d| d.x).abs() < 1e-12 && integral(|d| d.y).abs() < 1e-12);
    }

    /// An even sky of radiance 1 over black ground gives `π (1 + cos β)/2` on a plane tilted by β, and the sphere of
    /// directions about the sun sees all of it, wherever sun and plane stand.
    #[test]
    fn a_tilted_plane_sees_its_part_of_an_even_sky() {
        for (tilt_deg, sun_deg) in [(0.0, 10.0), (30.0, 60.0), (90.0, -3.0), (140.0, 5.0)] {
            let plane = Tilt {
                tilt_deg,
                azimuth_deg: 70.0,
            };
            let normal = plane.normal().unwrap();
            let towards = Vec3::from_azimuth_elevation_deg(200.0, sun_deg);
            let sun = SunLight::new(towards, &[550.0], &[1.0], 0.27).unwrap();
            let around = AroundSun::new(&sun, normal);
            let (mut whole, mut sky) = (0.0, 0.0);
            for cell in 0..around.cells() {
                let (column, row) = (cell % AroundSun::RINGS, cell / AroundSun::RINGS);
                let Some(direction) = around.direction(column, row, 0.5, 0.5) else {
                    assert_eq!(around.weight_sr(cell), 0.0);
                    continue;
                };
                whole += around.weight_sr(cell);
                if direction.z > 0.0 {
                    sky += around.weight_sr(cell);
                }
            }
            assert!((whole / PI - 1.0).abs() < 1e-3, "{tilt_deg} {whole}");
            let expected = PI * (1.0 + tilt_deg.to_radians().cos()) / 2.0;
            assert!(
                (sky - expected).abs() < 0.01 * PI,
                "{tilt_deg} {sky} {expected}"
            );
        }
        let up = Tilt::default().normal().unwrap();
        assert_eq!(up, Vec3::new(0.0, 0.0, 1.0));
        for (tilt_deg, azimuth_deg) in [(-1.0, 0.0), (181.0, 0.0), (f64::NAN, 0.0), (10.0, 400.0)] {
            let plane = Tilt {
                tilt_deg,
                azimuth_deg,
            };
            assert!(plane.normal().is_err());
        }
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
        assert!(
            (flat.lux(grid.nm()).unwrap().unwrap() / (2.0 * 683.0 * 106.86) - 1.0).abs() < 2e-3
        );
        let cct = flat.cct(grid.nm()).unwrap().unwrap();
        // What is no spectrum of visible light has neither, not those of the grey that a picture shows.
        for nm in [&[550.0][..], &[900.0, 1000.0]] {
            assert_eq!(flat.lux(nm).unwrap(), None);
            assert!(flat.cct(nm).unwrap().is_none());
        }
        assert!((cct.temperature_k - 5455.0).abs() < 10.0);
    }
}
