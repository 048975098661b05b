//! Spectral radiance → XYZ → linear sRGB, and tone curves.
//!
//! ```text
//! spectrum ─ observer ─► XYZ ─ Bradford ─► XYZ under the sRGB white ─ matrix ─► linear sRGB ─ exposure, tone ─► display
//! ```
//!
//! XYZ are absolute: `Y` of the 1931 observer is a luminance in cd m⁻² (lux when an irradiance goes in), and linear
//! sRGB keeps that scale: (1, 1, 1) is a D65 white of 1 cd m⁻². Nothing here touches the film.

mod develop;
mod matrix;
mod observer;
mod photometry;
mod srgb;
mod tone;

pub use develop::{ColourImage, Look};
pub use observer::{Observer, SpectrumToXyz, LUMINOUS_EFFICACY};
pub use photometry::{correlated_colour_temperature, illuminance_lux, Cct};
pub use srgb::{
    desaturated_above_zero, desaturated_into_unit, luminance, srgb_decoded, srgb_encoded,
    srgb_from_xyz, xyy_from_xyz, xyz_from_xyy, PRIMARIES_XY,
};
pub use tone::{adapted_whites, auto_white, Exposure, ToneCurve, REFERENCE_WHITE};
