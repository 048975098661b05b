//! What is in the air: number densities along altitude.

mod air;
mod climatology;
mod grid;
mod ozone;
mod us76;

pub use air::{AirProfile, AirState, Atmosphere, GasColumns, DOBSON_UNIT_M2, WATER_PER_MM_M2};
pub use grid::{column, VerticalGrid};
pub(crate) use grid::{keep_columns, with_middles};
pub mod aerosol;
pub mod opac;
pub mod particle;
mod profile;
pub mod upper;
