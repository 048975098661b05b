//! Wavelength grids, the solar spectrum, and averages over wavelength bins.

mod grid;
pub mod resample;
mod solar;

pub use grid::WavelengthGrid;
pub use solar::{SolarSpectrum, SUN_SOLID_ANGLE_SR};
