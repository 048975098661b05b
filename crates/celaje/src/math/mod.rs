//! Numbers that know no physics: vectors, interpolation, quadrature, random numbers, statistics.

pub mod interp;
mod table;
mod vec3;

pub use table::Table;
pub use vec3::Vec3;
