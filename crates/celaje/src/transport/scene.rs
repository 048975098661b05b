//! What light meets: a medium, the sun, the ground.

use crate::error::{check_range, Error, Result};
use crate::math::{lanes, Vec3};
use crate::medium::Medium;

/// Everything that an integrator needs to know of the world.
#[derive(Debug, Clone)]
pub struct Scene<'a, M: Medium> {
    /// The air and its planet.
    pub medium: &'a M,
    /// The sun.
    pub sun: SunLight,
    /// Lambertian reflectance of the ground, one row.
    pub albedo: Vec<f32>,
    /// Radiance that reaches the air from outside in every direction \[W m⁻² sr⁻¹ nm⁻¹\], one row; all 0 for a black
    /// universe.
    pub background: Vec<f32>,
}

impl<'a, M: Medium> Scene<'a, M> {
    /// A scene under a black universe.
    ///
    /// `albedo` — in [0, 1], shape (w,), one per wavelength of the medium.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`].
    pub fn new(medium: &'a M, sun: SunLight, albedo: &[f64]) -> Result<Self> {
        let w = medium.wavelength_nm().len();
        check_length("albedo", albedo, w)?;
        for &a in albedo {
            check_range("albedo", a, "", 0.0..=1.0)?;
        }
        if sun.irradiance.len() != medium.lanes() {
            return Err(Error::ShapeMismatch {
                name: "sun irradiance".into(),
                got: "another number of wavelengths".into(),
                expected: format!("{w} wavelengths, those of the medium"),
            });
        }
        Ok(Self {
            medium,
            sun,
            albedo: lanes::row_from(w, |i| albedo[i]),
            background: vec![0.0; medium.lanes()],
        })
    }

    /// The same scene with light from outside: `radiance` \[W m⁻² sr⁻¹ nm⁻¹\], ≥ 0, shape (w,).
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`].
    pub fn with_background(mut self, radiance: &[f64]) -> Result<Self> {
        let w = self.medium.wavelength_nm().len();
        check_length("background", radiance, w)?;
        for &l in radiance {
            check_range("background", l, "W m^-2 sr^-1 nm^-1", 0.0..=1e30)?;
        }
        self.background = lanes::row_from(w, |i| radiance[i]);
        Ok(self)
    }
}

/// The sun: far away, a disc or a point.
#[derive(Debug, Clone)]
pub struct SunLight {
    /// Unit vector towards the middle of its disc, in the observer's frame.
    pub direction: Vec3,
    /// Spectral irradiance on a plane facing it, above the air \[W m⁻² nm⁻¹\], one row.
    pub irradiance: Vec<f32>,
    /// `1 − cos` of its angular radius; 0 for a collimated beam.
    one_minus_cos_radius: f64,
    /// Exponent of limb darkening at each wavelength, one row.
    limb_exponent: Vec<f32>,
}

impl SunLight {
    /// A sun from its direction, irradiance and angular radius.
    ///
    /// # Arguments
    /// * `direction` — towards the sun; made a unit vector
    /// * `wavelength_nm` — vacuum, shape (w,)
    /// * `irradiance` — at the top of the atmosphere, on a plane normal to the beam \[W m⁻² nm⁻¹\], ≥ 0, shape (w,)
    /// * `angular_radius_deg` — 0 to 45; 0 is a collimated beam, which no finite direction ever sees
    ///
    /// The disc darkens towards its limb: `I/I₀ = μ^α`, `α = −0.023 + 0.292 / λ[µm]`, valid from 416 to 1100 nm and held
    /// at those ends beyond.
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`].
    ///
    /// # Source
    /// Hestroffer & Magnan 1998, Astron. Astrophys. 333, 338–342.
    pub fn new(
        direction: Vec3,
        wavelength_nm: &[f64],
        irradiance: &[f64],
        angular_radius_deg: f64,
    ) -> Result<Self> {
        check_range("sun angular radius", angular_radius_deg, "deg", 0.0..=45.0)?;
        check_length("sun irradiance", irradiance, wavelength_nm.len())?;
        for &e in irradiance {
            check_range("sun irradiance", e, "W m^-2 nm^-1", 0.0..=1e30)?;
        }
        let n = wavelength_nm.len();
        let half = (0.5 * angular_radius_deg.to_radians()).sin();
        Ok(Self {
            direction: direction.normalized(),
            irradiance: lanes::row_from(n, |i| irradiance[i]),
            one_minus_cos_radius: 2.0 * half * half,
            limb_exponent: lanes::row_from(n, |i| {
                -0.023 + 292.0 / wavelength_nm[i].clamp(416.0, 1100.0)
            }),
        })
    }

    /// Solid angle of the disc \[sr\].
    pub fn solid_angle_sr(&self) -> f64 {
        2.0 * std::f64::consts::PI * self.one_minus_cos_radius
    }

    /// Angular radius of the disc \[rad\].
    pub fn angular_radius_rad(&self) -> f64 {
        2.0 * (0.5 * self.one_minus_cos_radius).sqrt().asin()
    }

    /// A direction towards the sun, uniform over its disc, and `μ²` there: the squared cosine between the line of sight
    /// and the sun's surface, 1 in the middle and 0 at the limb. `u`, `v` uniform in [0, 1).
    #[inline(always)]
    pub fn sample(&self, u: f64, v: f64) -> (Vec3, f64) {
        if self.one_minus_cos_radius == 0.0 {
            return (self.direction, 1.0);
        }
        // Uniform in solid angle; 1 − μ² = (sin θ / sin radius)² = u to second order in the radius (2e-5).
        let direction = self
            .direction
            .deflected_by_turn(1.0 - u * self.one_minus_cos_radius, v);
        (direction, 1.0 - u)
    }

    /// `μ²` where a direction meets the disc, or `None` beside it. A collimated beam is never met.
    #[inline(always)]
    pub fn disc(&self, direction: Vec3) -> Option<f64> {
        let off = direction - self.direction;
        // |a − b|²/2 = 1 − cos, without its cancellation.
        let one_minus_cos = 0.5 * off.dot(off);
        (one_minus_cos < self.one_minus_cos_radius)
            .then(|| 1.0 - one_minus_cos / self.one_minus_cos_radius)
    }

    /// Multiplies a row by the limb darkening at `μ²`, whose mean over the disc is 1.
    #[inline(always)]
    pub fn limb(&self, mu_squared: f64, row: &mut [f32]) {
        if self.one_minus_cos_radius == 0.0 {
            return;
        }
        // ∫ μ^α d(μ²) = 1 / (1 + α/2); α ≥ 0.24.
        let minus_ln_mu = (-0.5 * mu_squared.clamp(1e-12, 1.0).ln()) as f32;
        for (v, &alpha) in row.iter_mut().zip(&self.limb_exponent) {
            *v *= (1.0 + 0.5 * alpha) * lanes::exp_and_loss(alpha * minus_ln_mu).0;
        }
    }

    /// [`SunLight::limb`] at one wavelength.
    #[inline(always)]
    pub fn limb_at(&self, mu_squared: f64, lane: usize) -> f64 {
        if self.one_minus_cos_radius == 0.0 {
            return 1.0;
        }
        let alpha = f64::from(self.limb_exponent[lane]);
        (1.0 + 0.5 * alpha) * (0.5 * alpha * mu_squared.max(1e-12).ln()).exp()
    }
}

fn check_length(name: &str, values: &[f64], w: usize) -> Result<()> {
    if values.len() == w {
        return Ok(());
    }
    Err(Error::ShapeMismatch {
        name: name.into(),
        got: format!("({},)", values.len()),
        expected: format!("({w},), one value per wavelength"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// The limb darkening has a mean of 1 over the disc, and its samples lie on the disc.
    #[test]
    fn limb_darkening_conserves_irradiance() {
        let sun = SunLight::new(
            Vec3::new(0.3, 0.1, 0.5),
            &[450.0, 700.0],
            &[1.0, 1.0],
            0.2664,
        )
        .unwrap();
        assert!((sun.solid_angle_sr() / 6.79e-5 - 1.0).abs() < 1e-3);
        let n = 100_000;
        let mean: f64 = (0..n)
            .map(|i| sun.limb_at((f64::from(i) + 0.5) / f64::from(n), 0))
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 1.0).abs() < 1e-5, "{mean}");
        let mut rng = Rng::new(1, 2);
        for _ in 0..1000 {
            let (direction, mu_squared) = sun.sample(rng.uniform(), rng.uniform());
            let seen = sun.disc(direction).unwrap();
            assert!((seen - mu_squared).abs() < 1e-6);
        }
    }
}
