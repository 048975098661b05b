//! Where and when, and where the sun stands.

pub mod gazetteer;
mod instant;
mod site;
mod sun;

pub use gazetteer::City;
pub use instant::Instant;
pub use site::Site;
pub use sun::SunPosition;
