//! How matter and light interact: cross sections and phase functions.

mod phase;

pub use phase::Phase;
