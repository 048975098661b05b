//! The fast integrator for layered media: successive orders of scattering, without noise.
//!
//! 1. Forward peaks are cut off (`scaled.rs`) and the sky's multiple scattering solved at as few wavelengths as will do.
//! 2. The unknown is the radiance's moments over real spherical harmonics, at nodes of height and sun zenith angle
//!    (`field.rs`, `harmonics.rs`). Each sweep integrates the scattered source along rays through every node (`solve.rs`,
//!    `march.rs`) and takes the moments of what arrives; sweeps are repeated until nothing changes.
//! 3. A pixel is a line integral: single scattering with the true phase functions at every wavelength, in the scaled
//!    medium (Nakajima & Tanaka 1988, doi:10.1016/0022-4073(88)90031-3), plus the solved source (`gather.rs`).
//!
//! Polarised light ([`PolarisedShells`]) has moments of Q and U beside those of the radiance (`spin.rs`).
//!
//! One set of tables (`tables.rs`) serves every view and altitude, and every sun in its range of zenith angles.

mod along;
mod azimuths;
mod field;
mod gather;
mod harmonics;
mod march;
mod scaled;
mod skygrid;
mod solve;
mod spin;
mod tables;
mod tail;
mod wavelengths;

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
    /// The same of what polarises, at most as much: Rayleigh scattering has degree 2.
    pub polarised_degree: usize,
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
    /// For pictures of many pixels: azimuths on one side of the sun's plane, the error of cubics at the last but one halving of
    /// elevations, and the number of elevations at which halving ends.
    pub view_azimuths: usize,
    pub view_tolerance: f32,
    pub view_rows: usize,
    /// Share of the mean radiance that may be left to the series that stands for the last orders.
    pub converged: f32,
    pub max_orders: u32,
}

impl Resolution {
    /// The resolution of the coarse solution at all wavelengths, which only has to know how wavelengths differ.
    fn rough(&self) -> Self {
        Self {
            degree: 2,
            polarised_degree: 2,
            wavelengths: usize::MAX,
            altitudes: 14,
            directions: (2, 5),
            azimuths: 4,
            level_m: 1500.0,
            level_growth: 0.4,
            ..self.clone()
        }
    }
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
    /// Every accuracy with its name and a line of meaning.
    pub const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Preview, "preview", "for looking around"),
        (Self::Default, "default", "for pictures and most numbers"),
        (Self::High, "high", "for comparisons with the reference"),
    ];

    /// The accuracy of a name.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.iter().find(|(_, n, _)| *n == name);
        found.map(|(a, ..)| *a).ok_or_else(|| Error::UnknownName {
            kind: "accuracy",
            name: name.into(),
            known: Self::ALL.iter().map(|(_, n, _)| (*n).into()).collect(),
        })
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(a, ..)| *a == self);
        found.map_or("", |(_, name, _)| name)
    }

    fn resolution(self) -> Resolution {
        match self {
            Self::Preview => Resolution {
                degree: 8,
                polarised_degree: 2,
                wavelengths: 16,
                altitudes: 18,
                sun_step_deg: 1.5,
                directions: (4, 9),
                azimuths: 7,
                level_m: 1500.0,
                level_growth: 0.35,
                view_level_m: 300.0,
                view_level_growth: 0.12,
                view_azimuths: 24,
                view_tolerance: 1e-2,
                view_rows: 60,
                converged: 3e-2,
                max_orders: 12,
            },
            Self::Default => Resolution {
                degree: 14,
                polarised_degree: 4,
                wavelengths: 16,
                altitudes: 34,
                sun_step_deg: 1.2,
                directions: (5, 16),
                azimuths: 13,
                level_m: 1200.0,
                level_growth: 0.3,
                view_level_m: 250.0,
                view_level_growth: 0.08,
                view_azimuths: 36,
                view_tolerance: 3e-3,
                view_rows: 100,
                converged: 2e-2,
                max_orders: 30,
            },
            Self::High => Resolution {
                degree: 20,
                polarised_degree: 8,
                wavelengths: 32,
                altitudes: 44,
                sun_step_deg: 1.0,
                directions: (7, 18),
                azimuths: 21,
                level_m: 600.0,
                level_growth: 0.2,
                view_level_m: 100.0,
                view_level_growth: 0.04,
                view_azimuths: 72,
                view_tolerance: 1e-3,
                view_rows: 400,
                converged: 3e-3,
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
        let tables = solve_for(scene, self.accuracy, false, observer, control)?;
        tables.render(&scene.sun, observer, sensor, control)
    }
}

/// [`Shells`] with polarisation.
///
/// Light scattered twice or more was polarised on the way: the radiance itself differs from that of scalar transport, by several
/// per cent in clear blue skies. Circular polarisation is left out.
#[derive(Debug, Clone, Copy, Default)]
pub struct PolarisedShells {
    /// How fine the grid is.
    pub accuracy: Accuracy,
    /// Whether Q and U are wanted beside the radiance.
    pub stokes: bool,
}

impl Integrator<LayeredMedium> for PolarisedShells {
    fn render(
        &self,
        scene: &Scene<'_, LayeredMedium>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let tables = solve_for(scene, self.accuracy, true, observer, control)?;
        if self.stokes {
            tables.render_stokes(&scene.sun, observer, sensor, control)
        } else {
            tables.render(&scene.sun, observer, sensor, control)
        }
    }
}

/// Tables of one sun and observer.
fn solve_for(
    scene: &Scene<'_, LayeredMedium>,
    accuracy: Accuracy,
    polarised: bool,
    observer: &Observer,
    control: &Control<'_>,
) -> Result<Tables> {
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
        accuracy,
        sun_zenith_deg: (zenith_deg, zenith_deg),
        highest_observer_m: observer.radius_m,
        sun_angular_radius_deg: scene.sun.angular_radius_rad().to_degrees(),
        max_order: control.budget.max_order,
        polarised,
    };
    Tables::solve(scene.medium, &albedo, &options, control.cancel)
}
