//! Place + time → conditions, each value with its reason.

mod atmosphere;
mod season;

pub use atmosphere::AtmosphereClass;
pub use season::Season;
