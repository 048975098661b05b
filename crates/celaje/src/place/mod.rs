//! Where and when, and where the sun stands.

mod instant;
mod site;
mod sun;

pub use instant::Instant;
pub use site::Site;
pub use sun::SunPosition;
