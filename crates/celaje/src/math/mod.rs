//! Numbers that know no physics: vectors, interpolation, quadrature, random numbers, statistics.

pub mod bytes;
pub mod interp;
pub mod lanes;
mod rng;
mod spin_two;
pub mod statistics;
mod table;
mod vec3;

pub use num_complex::Complex64 as Complex;
pub use rng::{Rng, Sampler};
pub use spin_two::SpinTwo;
pub use table::Table;
pub use vec3::Vec3;
