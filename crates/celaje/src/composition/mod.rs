//! What is in the air: number densities along altitude.

pub mod aerosol;
pub mod opac;
pub mod particle;
mod table;
