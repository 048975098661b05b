//! Solving the radiative transfer equation: unbiased integrators behind one trait, on one scene, sensor and film.
//!
//! | integrator | medium | how |
//! |---|---|---|
//! | [`Path`] | concentric shells | the reference: every collision forced, transmittances from tables of columns |
//! | [`PolarisedPath`] | concentric shells | the same paths with all four Stokes components |
//! | [`Shells`] | concentric shells | orders of scattering on harmonic moments, without noise |
//! | [`PolarisedShells`] | concentric shells | the same with harmonics of Q and U |
//! | [`Tracker`] | any | plain delta and ratio tracking, all wavelengths on one path: the oracle of [`Path`] |
//! | [`Classic`] | any | textbook, one wavelength at a time: the oracle of both, and the yardstick of the benchmarks |

mod classic;
mod disc;
mod first_order;
mod goal;
mod guide;
mod guided;
mod horizon;
mod path;
mod present;
mod render;
mod scene;
mod shells;
mod stokes;
mod tracker;
mod tracking;
mod traveller;
mod vertex;
mod walker;
mod way;
mod weights;

pub use classic::Classic;
pub use goal::{render_until, Goal, Keep, Look, Outcome, Partial, Reins, MOST_PATHS};
pub use path::{Path, PolarisedPath, UnguidedPath};
pub use render::{Budget, Control, Observer};
pub use scene::{Scene, SunLight};
pub use shells::{Accuracy, PolarisedShells, Shells, Solution, Tables, TablesOptions};
pub use tracker::Tracker;
pub use tracking::{free_path, transmittance, transmittance_at};

use crate::error::Result;
use crate::film::Film;
use crate::medium::Medium;
use crate::sensor::Sensor;

/// A way to solve the radiative transfer equation for a picture.
pub trait Integrator<M: Medium> {
    /// Spectral radiance at every pixel of a sensor.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] when the control says so, [`crate::Error::TooLarge`] for a film beyond memory.
    fn render(
        &self,
        scene: &Scene<'_, M>,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film>;
}
