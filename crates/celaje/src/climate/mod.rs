//! Place + time → conditions, each value with its reason.
//!
//! The climate is simple as yet: ozone by latitude and month, the reference atmosphere by latitude and season,
//! one aerosol and one ground for the whole Earth. Each value says so in its reason.

mod albedo;
mod atmosphere;
mod conditions;
mod overrides;
mod ozone;
mod season;

pub use albedo::{Albedo, AlbedoPreset, ALBEDO_PRESETS};
pub use atmosphere::AtmosphereClass;
pub use conditions::{Condition, ConditionRow, Conditions};
pub use overrides::Overrides;
pub use ozone::{OzoneClimate, OzoneColumn, OZONE_RANGE_DU};
pub use season::Season;
