//! Where and when, and where the sun stands.

pub mod gazetteer;
mod instant;
mod moon;
mod site;
mod sun;
mod sun_events;
mod when;

pub use gazetteer::City;
pub use instant::Instant;
pub use moon::MoonPosition;
pub use site::Site;
pub use sun::SunPosition;
pub use sun_events::{SunEvent, SunTimes};
pub use when::{clock_doubt, local_time, parse_time, parse_time_at};
