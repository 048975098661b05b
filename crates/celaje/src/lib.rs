//! Spectral radiance of the whole sky, from a place and a time.
//!
//! Data flows one way, one folder per stage; a stage imports only those to its left:
//!
//! ```text
//! place + time → climate → composition → optics → medium → transport → film → colour → image
//! ```
//!
//! # Conventions
//! Degrees at every boundary; azimuth clockwise from true north, elevation up; directions are where the observer
//! *looks*; an observer's frame has x east, y north, z up. Wavelengths are in vacuum, in nm; lengths in m; spectral
//! radiance in W m⁻² sr⁻¹ nm⁻¹, spectral irradiance in W m⁻² nm⁻¹.

pub mod bake;
pub mod climate;
pub mod colour;
pub mod composition;
pub mod error;
pub mod film;
pub mod image;
pub mod inventory;
pub mod irradiance;
pub mod math;
pub mod medium;
pub mod optics;
pub mod place;
pub mod residual;
pub mod sensor;
pub mod sky;
pub mod spectrum;
pub mod transport;

pub use error::{Error, Result};
pub use film::{Film, Plane, Polarisation};
pub use sky::Sky;
pub use spectrum::WavelengthGrid;
