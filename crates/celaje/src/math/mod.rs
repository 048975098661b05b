//! Numbers that know no physics: vectors, interpolation, quadrature, random numbers, statistics.

pub mod interp;
pub mod lanes;
mod rng;
pub mod statistics;
mod vec3;

pub use rng::Rng;
pub use vec3::Vec3;
