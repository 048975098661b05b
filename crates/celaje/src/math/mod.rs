//! Numbers that know no physics: vectors, interpolation, quadrature, random numbers, statistics.

mod complex;
pub mod interp;
mod vec3;

pub use complex::Complex;
pub use vec3::Vec3;
