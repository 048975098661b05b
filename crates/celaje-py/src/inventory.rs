//! What the air of a sky is made of.

use std::path::PathBuf;

use celaje::inventory::{self, InventoryFormat};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::Outcome;

/// The air of a sky, in parts.
#[pyclass(frozen, module = "celaje._core")]
pub struct Inventory {
    pub inner: inventory::Inventory,
}

type Array<'py> = Bound<'py, PyArray1<f64>>;

#[pymethods]
impl Inventory {
    #[getter]
    fn altitude_m<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner.altitude_m.clone().into_pyarray(py)
    }

    #[getter]
    fn temperature_k<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner.temperature_k.clone().into_pyarray(py)
    }

    #[getter]
    fn pressure_pa<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner.pressure_pa.clone().into_pyarray(py)
    }

    #[getter]
    fn wavelength_nm<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner.wavelength_nm.clone().into_pyarray(py)
    }

    #[getter]
    fn theta_deg<'py>(&self, py: Python<'py>) -> Array<'py> {
        self.inner.theta_deg.clone().into_pyarray(py)
    }

    /// Whether a refractive index was extrapolated.
    #[getter]
    fn extrapolated(&self) -> bool {
        self.inner.extrapolated
    }

    /// Gases, then layers of aerosol, each as a dictionary with the fields of `celaje.Species`.
    fn species<'py>(&self, py: Python<'py>) -> Outcome<Vec<Bound<'py, PyDict>>> {
        let inner = &self.inner;
        let profile = [inner.altitude_m.len(), inner.wavelength_nm.len()];
        let table = [inner.wavelength_nm.len(), inner.theta_deg.len()];
        let mut all = Vec::new();
        for species in &inner.species {
            let fields = PyDict::new(py);
            let array = |values: &Vec<f64>| values.clone().into_pyarray(py);
            fields.set_item("name", &species.name)?;
            fields.set_item("is_aerosol", species.is_aerosol)?;
            fields.set_item("number_density", array(&species.number_density))?;
            fields.set_item("sigma_s", array(&species.sigma_s).reshape(profile)?)?;
            fields.set_item("sigma_a", array(&species.sigma_a).reshape(profile)?)?;
            fields.set_item("tau_s", array(&species.tau_s))?;
            fields.set_item("tau_a", array(&species.tau_a))?;
            match &species.scattering {
                Some(s) => {
                    fields.set_item("asymmetry", array(&s.asymmetry))?;
                    fields.set_item("phase", array(&s.phase).reshape(table)?)?;
                }
                None => {
                    fields.set_item("asymmetry", py.None())?;
                    fields.set_item("phase", py.None())?;
                }
            }
            all.push(fields);
        }
        Ok(all)
    }

    /// All aerosol together, as a dictionary with the fields of `celaje.AerosolColumn`.
    fn aerosol<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyDict>> {
        let sum = &self.inner.aerosol;
        let table = [self.inner.wavelength_nm.len(), self.inner.theta_deg.len()];
        let fields = PyDict::new(py);
        for (name, values) in [
            ("tau", &sum.tau),
            ("ssa", &sum.ssa),
            ("asymmetry", &sum.asymmetry),
            ("angstrom", &sum.angstrom),
        ] {
            fields.set_item(name, values.clone().into_pyarray(py))?;
        }
        let phase = sum.phase.clone().into_pyarray(py).reshape(table)?;
        fields.set_item("phase", phase)?;
        Ok(fields)
    }

    /// Writes the file that the extension names.
    fn save(&self, py: Python<'_>, path: PathBuf, metadata: Vec<(String, String)>) -> Outcome<()> {
        InventoryFormat::check(&path)?;
        Ok(py.detach(|| self.inner.save(&path, &metadata))?)
    }

    /// The figure, as SVG.
    fn svg(&self, metadata: Vec<(String, String)>) -> String {
        self.inner.svg(&metadata)
    }
}
