//! How matter and light interact: cross sections and phase functions.

pub mod ozone;
mod phase;
pub mod rayleigh;

pub use phase::Phase;
