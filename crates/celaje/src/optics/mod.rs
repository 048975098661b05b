//! How matter and light interact: cross sections and phase functions.

mod mie;
mod mie_kernel;

pub use mie::{mie, MieSphere};
