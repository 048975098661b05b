//! An aerosol that the user describes.

use celaje::composition::aerosol::{tropopause_m, Aerosol, VerticalProfile};
use celaje::composition::particle::{LognormalMode, RefractiveIndex, SizeDistribution};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::optics::LATITUDE_DEG;

/// Particles of one kind of matter, and how they thin out with altitude.
#[pyclass(frozen, module = "celaje._core")]
pub struct OwnAerosol {
    pub inner: Aerosol,
}

#[pymethods]
impl OwnAerosol {
    /// `index` is (wavelength \[nm\], n, k), one row for the same index everywhere; `modes` are (number fraction, mode radius
    /// \[µm\], geometric standard deviation); `bounds_um` the smallest and largest radius; `profile` (altitude \[m\], relative
    /// density), or none for a scale height \[m\].
    #[new]
    #[pyo3(signature = (name, index, modes, bounds_um, profile, scale_height_m))]
    fn new(
        name: String,
        index: (Vec<f64>, Vec<f64>, Vec<f64>),
        modes: Vec<(f64, f64, f64)>,
        bounds_um: (f64, f64),
        profile: Option<(Vec<f64>, Vec<f64>)>,
        scale_height_m: f64,
    ) -> Outcome<Self> {
        let (wavelength_nm, n, k) = index;
        let refractive_index = match (&n[..], &k[..]) {
            ([n], [k]) if wavelength_nm.is_empty() => RefractiveIndex::constant(*n, *k)?,
            _ => RefractiveIndex::new(wavelength_nm, n, k)?,
        };
        let mode = |(number_fraction, r_mode_um, sigma)| LognormalMode {
            number_fraction,
            r_mode_um,
            sigma,
        };
        let modes = modes.into_iter().map(mode).collect();
        let profile = match profile {
            Some((altitude_m, relative)) => VerticalProfile::sampled(altitude_m, relative)?,
            None => VerticalProfile::tropospheric(scale_height_m, tropopause_m(LATITUDE_DEG)?)?,
        };
        let inner = Aerosol {
            name,
            refractive_index,
            size: SizeDistribution::new(modes, bounds_um.0, bounds_um.1)?,
            profile,
        };
        Ok(Self { inner })
    }
}
