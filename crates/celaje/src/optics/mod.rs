//! How matter and light interact: cross sections and phase functions.

pub mod ozone;
pub mod rayleigh;
