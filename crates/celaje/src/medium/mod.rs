//! Scattering and absorption coefficients along altitude and wavelength.
//!
//! A [`Medium`] answers three questions at a point (how much is extinguished, how much scattered, by which species) and
//! one along a ray (an upper bound of the extinction, piece by piece). That is all that unbiased tracking needs, so any
//! medium that varies in three dimensions can be put in the place of [`LayeredMedium`]: [`GriddedMedium`] is one.

mod abreast;
mod atmosphere;
mod columns;
mod cross;
mod gridded;
mod layered;
mod ray;
mod ray_columns;
mod shell;

pub(crate) use abreast::{all, Abreast, Lookups, Search, RAYS};
pub use atmosphere::{
    air_scattering, from_atmosphere, gas_absorption, grid_with_edges, GasAbsorption,
};
pub(crate) use columns::Columns;
pub use gridded::{GridBox, GriddedMedium};
pub use layered::LayeredMedium;
pub use ray::{Ray, Span};
pub(crate) use ray_columns::{RayColumns, RayGeometry};

use crate::math::Vec3;
use crate::optics::Phase;

/// A piece of a ray in which one majorant holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Where the piece ends \[m\] along the ray; it begins where the one before ends.
    pub end_m: f64,
    /// Upper bound of the extinction coefficient of every wavelength in the piece \[m⁻¹\].
    pub sigma_maj: f64,
}

/// Air around a spherical planet, as unbiased tracking sees it.
///
/// Points are in metres from the planet's centre. Rows hold one value per wavelength, padded with zeros to
/// [`Medium::lanes`] values (see [`crate::math::lanes`]).
pub trait Medium: Sync {
    /// Pieces of a ray, in order.
    type Segments<'a>: Iterator<Item = Segment>
    where
        Self: 'a;

    /// Vacuum wavelengths \[nm\].
    fn wavelength_nm(&self) -> &[f64];

    /// Length of a row.
    fn lanes(&self) -> usize;

    /// Radius of the ground's sphere \[m\].
    fn ground_radius_m(&self) -> f64;

    /// Radius beyond which there is nothing \[m\].
    fn top_radius_m(&self) -> f64;

    /// The pieces of a ray over a span that lies inside the air.
    fn segments(&self, ray: &Ray, span: Span) -> Self::Segments<'_>;

    /// Extinction coefficient σ_t \[m⁻¹\] of every wavelength at a point.
    fn extinction(&self, at: Vec3, sigma_t: &mut [f32]);

    /// Extinction and scattering coefficients σ_t and σ_s \[m⁻¹\] of every wavelength at a point.
    fn extinction_and_scattering(&self, at: Vec3, sigma_t: &mut [f32], sigma_s: &mut [f32]);

    /// The species' phase functions.
    fn phases(&self) -> &[Phase];

    /// One species' share of the scattering coefficient \[m⁻¹\] of every wavelength at a point.
    fn species_scattering(&self, species: usize, at: Vec3, sigma_s: &mut [f32]);

    /// σ_t and σ_s \[m⁻¹\] at one wavelength and point.
    fn coefficients_at(&self, lane: usize, at: Vec3) -> (f64, f64);

    /// One species' σ_s \[m⁻¹\] at one wavelength and point.
    fn species_scattering_at(&self, species: usize, lane: usize, at: Vec3) -> f64;

    /// Upper bound of σ_t \[m⁻¹\] at one wavelength, everywhere.
    fn global_majorant(&self, lane: usize) -> f64;
}
