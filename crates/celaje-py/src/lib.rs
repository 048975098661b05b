//! The extension module `celaje._core`: the stages of the library for Python, without physics of its own.
//!
//! Everything here is private to the Python package, which gives it names, defaults and documentation
//! (`python/celaje`). Arrays come in as contiguous `float64` and go out without copies.

mod climate_table;
mod conditions;
mod error;
mod film;
mod inventory;
mod medium;
mod optics;
mod own_aerosol;
mod run;
mod sensor;
mod sky;

/// The stages of celaje, as the Python package sees them.
#[pyo3::pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::climate_table::climate_table;
    #[pymodule_export]
    use crate::conditions::{wavelength_range, Conditions};
    #[pymodule_export]
    use crate::film::{develop, linear_srgb, merged, read_exr, save};
    #[pymodule_export]
    use crate::inventory::Inventory;
    #[pymodule_export]
    use crate::medium::{Medium, Phase};
    #[pymodule_export]
    use crate::optics::{aerosol, component, mie, own_aerosol, rayleigh_cross_section, MieSphere};
    #[pymodule_export]
    use crate::own_aerosol::OwnAerosol;
    #[pymodule_export]
    use crate::sensor::Sensor;
    #[pymodule_export]
    use crate::sky::Sky;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("default_method", crate::sky::default_method())?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
