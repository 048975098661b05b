//! Wavelength grids, the solar spectrum, and averages over wavelength bins.

mod grid;

pub use grid::WavelengthGrid;
