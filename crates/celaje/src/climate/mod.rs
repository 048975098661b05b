//! Place + time → conditions, each value with its reason.
//!
//! Ozone by latitude and month; the reference atmospheres blended by latitude and season; aerosol from GADS with an amount by
//! year; elevation, ground type, snow and sea ice from maps. Nothing is downloaded; everything can be overridden.

mod aerosol;
mod albedo;
mod atmosphere;
mod blend;
mod condition;
mod conditions;
mod elevation;
mod ground;
mod mixture;
mod overrides;
mod ozone;
mod ozone_profile;
mod plumes;
mod rows;
mod words;

pub use aerosol::{aerosol_climate, AerosolClimate};
pub use albedo::{Albedo, AlbedoPreset, ALBEDO_PRESETS};
pub use atmosphere::{blended_atmosphere, AtmosphereBlend, AtmosphereClass};
pub use condition::Condition;
pub use conditions::{due_south, Conditions, CLIMATE};
pub use elevation::{elevation, Elevation};
pub use ground::{Ground, GROUND_TYPES};
pub use mixture::{AerosolMixture, MixtureComponent, MixtureLayer};
pub use overrides::Overrides;
pub use ozone::{OzoneClimate, OzoneColumn, OZONE_RANGE_DU};
pub use ozone_profile::{ozone_shape, OzoneShape};
pub use rows::{ConditionRow, ConditionValue};
