//! The fast integrator for layered media: successive orders of scattering, without noise.
//!
//! 1. Forward peaks are cut off (`scaled.rs`) and the sky's multiple scattering solved at as few wavelengths as will do.
//! 2. The unknown is the radiance's moments over real spherical harmonics, at nodes of height and sun zenith angle
//!    (`field.rs`, `harmonics.rs`). Each sweep integrates the scattered source along rays through every node (`solve.rs`,
//!    `march.rs`) and takes the moments of what arrives; sweeps are repeated until nothing changes.
//! 3. A pixel is a line integral: single scattering with the true phase functions at every wavelength, in the scaled
//!    medium (Nakajima & Tanaka 1988, doi:10.1016/0022-4073(88)90031-3), plus the solved source (`gather.rs`).
//!
//! One set of tables (`tables.rs`) serves every view and altitude, and every sun in its range of zenith angles.

mod field;
mod gather;
mod harmonics;
mod march;
mod scaled;
mod solve;
mod tables;

pub use self::field::Solution;
pub use self::tables::{Tables, TablesOptions};
use super::render::{Control, Observer};
use super::scene::Scene;
use super::Integrator;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::medium::{LayeredMedium, Medium};
use crate::sensor::Sensor;

/// How finely the grid is cut.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Resolution {
    /// Degree of the phase functions and of the moments.
    pub degree: usize,
    /// Most wavelengths at which multiple scattering is solved.
    pub wavelengths: usize,
    /// Nodes over height.
    pub altitudes: usize,
    /// Step of the sun's zenith angle near the terminator [deg].
    pub sun_step_deg: f64,
    /// Zenith angles below the horizon and above it.
    pub directions: (usize, usize),
    /// Azimuths on one side of the sun's plane.
    pub azimuths: usize,
    /// Least distance of the levels at which rays are cut [m], and its growth with height.
    pub level_m: f64,
    pub level_growth: f64,
    /// The same for the rays of the picture.
    pub view_level_m: f64,
    pub view_level_growth: f64,
    /// Relative change of the mean radiance below which the orders are converged.
    pub converged: f32,
    pub max_orders: u32,
}

/// How accurate the answer should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accuracy {
    /// For looking around.
    Preview,
    /// For pictures and most numbers.
    #[default]
    Default,
    /// For comparisons with the reference.
    High,
}

impl Accuracy {
    fn resolution(self) -> Resolution {
        match self {
            Self::Preview => Resolution {
                degree: 4,
                wavelengths: 16,
                altitudes: 18,
                sun_step_deg: 1.0,
                directions: (3, 7),
                azimuths: 6,
                level_m: 600.0,
                level_growth: 0.2,
                view_level_m: 300.0,
                view_level_growth: 0.12,
                converged: 5e-3,
                max_orders: 12,
            },
            Self::Default => Resolution {
                degree: 6,
                wavelengths: 32,
                altitudes: 26,
                sun_step_deg: 0.75,
                directions: (4, 9),
                azimuths: 8,
                level_m: 700.0,
                level_growth: 0.25,
                view_level_m: 250.0,
                view_level_growth: 0.12,
                converged: 1e-3,
                max_orders: 30,
            },
            Self::High => Resolution {
                degree: 12,
                wavelengths: 96,
                altitudes: 40,
                sun_step_deg: 0.5,
                directions: (8, 18),
                azimuths: 14,
                level_m: 200.0,
                level_growth: 0.08,
                view_level_m: 100.0,
                view_level_growth: 0.04,
                converged: 2e-4,
                max_orders: 60,
            },
        }
    }
}

/// Successive orders of scattering on concentric shells.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shells {
    /// How fine the grid is.
    pub accuracy: Accuracy,
}

impl Integrator<LayeredMedium> for Shells {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        if scene.background.iter().any(|&l| l > 0.0) {
            return Err(Error::invalid(
                "the method 'shells' does not scatter light that comes from outside the air, other than the sun's",
                "use the method 'path'",
            ));
        }
        let w = scene.medium.wavelength_nm().len();
        let albedo: Vec<f64> = scene.albedo[..w].iter().map(|&a| a.into()).collect();
        let zenith_deg = scene.sun.direction.z.clamp(-1.0, 1.0).acos().to_degrees();
        let options = TablesOptions {
            accuracy: self.accuracy,
            sun_zenith_deg: (zenith_deg, zenith_deg),
            highest_observer_m: observer.radius_m,
            sun_angular_radius_deg: scene.sun.angular_radius_rad().to_degrees(),
            max_order: control.budget.max_order,
        };
        let tables = Tables::solve(scene.medium, &albedo, &options, control.cancel)?;
        tables.render(&scene.sun, observer, sensor, control)
    }
}
