//! Numbers that know no physics: vectors, interpolation, quadrature, random numbers, statistics.

pub mod interp;
mod vec3;

pub use vec3::Vec3;
