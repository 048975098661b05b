//! How matter and light interact: cross sections and phase functions.

pub mod bands;
pub mod no2;
pub mod ozone;
mod phase;
mod phase_bytes;
pub mod rayleigh;

pub use phase::Phase;
mod aerosol;
mod angles;
mod lognormal;
mod mie;
mod mie_kernel;
mod mueller;
mod mueller_moments;
pub mod tables;

pub use aerosol::{
    aerosol_optics, aerosol_optics_on, component, component_optics, AerosolOptics, ComponentOptics,
    LayerOptics,
};
pub use angles::AngleGrid;
pub use lognormal::{
    particle_optics, particle_optics_with, ParticleOptics, Quadrature, ScatteringMatrix,
};
pub use mie::{mie, MieSphere};
pub(crate) use mueller::MuellerRows;
