//! A medium of one's own, and phase functions.

use celaje::math::Vec3;
use celaje::medium::{LayeredMedium, Medium as _};
use celaje::optics;
use numpy::PyUntypedArrayMethods;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::error::Outcome;

/// How one species scatters, at one wavelength for all, or at each.
#[pyclass(frozen, module = "celaje._core")]
pub struct Phase {
    form: Form,
}

/// Parameters, kept until the number of wavelengths is known.
enum Form {
    Rayleigh(Vec<f64>),
    HenyeyGreenstein(Vec<f64>),
    /// `p` has one row per wavelength.
    Table {
        theta_deg: Vec<f64>,
        p: Vec<f64>,
    },
    /// A table and the other elements of spheres: p, p12, p33, p34.
    Spheres {
        theta_deg: Vec<f64>,
        elements: [Vec<f64>; 4],
    },
    Legendre(Vec<f64>),
    /// A species of a finished medium, with its number of wavelengths.
    Ready(Box<optics::Phase>, usize),
}

impl Phase {
    /// Checks the parameters at once, so that an error points to where they were given.
    fn new(form: Form) -> Outcome<Self> {
        let phase = Self { form };
        phase.at_wavelengths(phase.own_wavelengths().max(1))?;
        Ok(phase)
    }

    /// Wavelengths that its parameters are given at; 1 stands for any number.
    fn own_wavelengths(&self) -> usize {
        match &self.form {
            Form::Rayleigh(v) | Form::HenyeyGreenstein(v) => v.len(),
            Form::Table { theta_deg, p } => p.len() / theta_deg.len().max(1),
            Form::Spheres {
                theta_deg,
                elements,
            } => elements[0].len() / theta_deg.len().max(1),
            Form::Legendre(_) => 1,
            Form::Ready(_, n) => *n,
        }
    }

    /// The phase function of a medium with `n` wavelengths.
    pub(crate) fn at_wavelengths(&self, n: usize) -> celaje::Result<optics::Phase> {
        let own = self.own_wavelengths();
        if own != 1 && own != n {
            return Err(celaje::Error::ShapeMismatch {
                name: "phase function".into(),
                got: format!("{own} wavelengths"),
                expected: format!("{n} wavelengths, those of the medium, or 1"),
            });
        }
        let repeat = |v: &Vec<f64>| v.repeat(n / own.max(1));
        match &self.form {
            Form::Rayleigh(rho) => optics::Phase::rayleigh(&repeat(rho)),
            Form::HenyeyGreenstein(g) => optics::Phase::henyey_greenstein(&repeat(g)),
            Form::Table { theta_deg, p } => optics::Phase::table(theta_deg, &repeat(p)),
            Form::Spheres {
                theta_deg,
                elements,
            } => {
                let [p, p12, p33, p34] = elements.each_ref().map(repeat);
                optics::Phase::spheres(theta_deg, &p, &p12, &p33, &p34)
            }
            Form::Legendre(c) => optics::Phase::legendre(c, n),
            Form::Ready(phase, _) => Ok(phase.as_ref().clone()),
        }
    }
}

#[pymethods]
impl Phase {
    #[staticmethod]
    fn rayleigh(depolarisation: PyReadonlyArray1<'_, f64>) -> Outcome<Self> {
        Self::new(Form::Rayleigh(depolarisation.as_slice()?.to_vec()))
    }

    #[staticmethod]
    fn henyey_greenstein(g: PyReadonlyArray1<'_, f64>) -> Outcome<Self> {
        Self::new(Form::HenyeyGreenstein(g.as_slice()?.to_vec()))
    }

    #[staticmethod]
    fn table(theta_deg: PyReadonlyArray1<'_, f64>, p: PyReadonlyArray2<'_, f64>) -> Outcome<Self> {
        let theta_deg = theta_deg.as_slice()?.to_vec();
        let (rows, columns) = (p.shape()[0], p.shape()[1]);
        if columns != theta_deg.len() {
            return Err(celaje::Error::ShapeMismatch {
                name: "phase table p".into(),
                got: format!("({rows}, {columns})"),
                expected: format!("(wavelength, {})", theta_deg.len()),
            }
            .into());
        }
        let p = p.as_slice()?.to_vec();
        Self::new(Form::Table { theta_deg, p })
    }

    #[staticmethod]
    fn spheres(
        theta_deg: PyReadonlyArray1<'_, f64>,
        p: PyReadonlyArray2<'_, f64>,
        p12: PyReadonlyArray2<'_, f64>,
        p33: PyReadonlyArray2<'_, f64>,
        p34: PyReadonlyArray2<'_, f64>,
    ) -> Outcome<Self> {
        let theta_deg = theta_deg.as_slice()?.to_vec();
        for (name, element) in [("p", &p), ("p12", &p12), ("p33", &p33), ("p34", &p34)] {
            let (rows, columns) = (element.shape()[0], element.shape()[1]);
            if columns != theta_deg.len() || rows != p.shape()[0] {
                return Err(celaje::Error::ShapeMismatch {
                    name: format!("phase table {name}"),
                    got: format!("({rows}, {columns})"),
                    expected: format!(
                        "(wavelength, angle) = ({}, {})",
                        p.shape()[0],
                        theta_deg.len()
                    ),
                }
                .into());
            }
        }
        let elements = [
            p.as_slice()?.to_vec(),
            p12.as_slice()?.to_vec(),
            p33.as_slice()?.to_vec(),
            p34.as_slice()?.to_vec(),
        ];
        Self::new(Form::Spheres {
            theta_deg,
            elements,
        })
    }

    #[staticmethod]
    fn legendre(c: PyReadonlyArray1<'_, f64>) -> Outcome<Self> {
        Self::new(Form::Legendre(c.as_slice()?.to_vec()))
    }

    /// Values \[sr⁻¹\] at some scattering angles, shape (wavelength, angle).
    fn values<'py>(
        &self,
        py: Python<'py>,
        theta_deg: PyReadonlyArray1<'py, f64>,
    ) -> Outcome<Bound<'py, PyArray2<f64>>> {
        let n = self.own_wavelengths();
        let phase = self.at_wavelengths(n)?;
        let cos_theta = crate::optics::cosines(theta_deg.as_slice()?)?;
        let values: Vec<f64> = (0..n)
            .flat_map(|lane| cos_theta.iter().map(move |&c| (lane, c)))
            .map(|(lane, c)| phase.eval_at(lane, c))
            .collect();
        Ok(values.into_pyarray(py).reshape([n, cos_theta.len()])?)
    }

    fn __repr__(&self) -> String {
        match &self.form {
            Form::Rayleigh(rho) => format!("Phase.rayleigh(depolarisation={rho:?})"),
            Form::HenyeyGreenstein(g) => format!("Phase.henyey_greenstein({g:?})"),
            Form::Table { theta_deg, .. } => format!("Phase.table({} angles)", theta_deg.len()),
            Form::Spheres { theta_deg, .. } => {
                format!("Phase.table({} angles, polarising)", theta_deg.len())
            }
            Form::Legendre(c) => format!("Phase.legendre({} terms)", c.len()),
            Form::Ready(..) => "Phase of a finished medium".to_owned(),
        }
    }
}

/// Coefficients along altitude and wavelength.
#[pyclass(module = "celaje._core")]
#[derive(Clone)]
pub struct Medium {
    pub inner: LayeredMedium,
}

/// σ_t and σ_s, or the σ_s of one species.
enum Wanted {
    Extinction,
    Scattering,
    Species(usize),
}

impl Medium {
    /// A coefficient at the nodes \[m⁻¹\], shape (altitude, wavelength).
    fn nodes<'py>(&self, py: Python<'py>, wanted: &Wanted) -> Outcome<Bound<'py, PyArray2<f64>>> {
        let m = &self.inner;
        let (z, w) = (m.altitude_m(), m.wavelength_nm().len());
        let (mut sigma_t, mut sigma_s) = (vec![0.0; m.lanes()], vec![0.0; m.lanes()]);
        let mut values = Vec::with_capacity(z.len() * w);
        for altitude_m in z {
            let at = Vec3::new(0.0, 0.0, m.ground_radius_m() + (altitude_m - z[0]));
            m.extinction_and_scattering(at, &mut sigma_t, &mut sigma_s);
            if let Wanted::Species(species) = wanted {
                m.species_scattering(*species, at, &mut sigma_s);
            }
            let row = match wanted {
                Wanted::Extinction => &sigma_t,
                _ => &sigma_s,
            };
            values.extend(row[..w].iter().map(|&v| f64::from(v)));
        }
        Ok(values.into_pyarray(py).reshape([z.len(), w])?)
    }
}

#[pymethods]
impl Medium {
    #[new]
    fn new(
        altitude_m: PyReadonlyArray1<'_, f64>,
        wavelength_nm: PyReadonlyArray1<'_, f64>,
        planet_radius_m: f64,
    ) -> Outcome<Self> {
        let (z, w) = (altitude_m.as_slice()?, wavelength_nm.as_slice()?);
        let inner = LayeredMedium::new(z, w, planet_radius_m)?;
        Ok(Self { inner })
    }

    fn add(
        &mut self,
        sigma_s: PyReadonlyArray2<'_, f64>,
        sigma_a: PyReadonlyArray2<'_, f64>,
        phase: &Phase,
    ) -> Outcome<()> {
        let phase = phase.at_wavelengths(self.inner.wavelength_nm().len())?;
        let (sigma_s, sigma_a) = (sigma_s.as_slice()?, sigma_a.as_slice()?);
        Ok(self.inner.add(sigma_s, sigma_a, phase)?)
    }

    #[getter]
    fn altitude_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.altitude_m().to_vec().into_pyarray(py)
    }

    #[getter]
    fn wavelength_nm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.wavelength_nm().to_vec().into_pyarray(py)
    }

    #[getter]
    fn planet_radius_m(&self) -> f64 {
        self.inner.ground_radius_m() - self.inner.altitude_m()[0]
    }

    fn sigma_t<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyArray2<f64>>> {
        self.nodes(py, &Wanted::Extinction)
    }

    fn sigma_s<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyArray2<f64>>> {
        self.nodes(py, &Wanted::Scattering)
    }

    /// (σ_s, phase function) of each species, in the order in which they were added.
    #[allow(clippy::type_complexity)]
    fn species<'py>(&self, py: Python<'py>) -> Outcome<Vec<(Bound<'py, PyArray2<f64>>, Phase)>> {
        let n = self.inner.wavelength_nm().len();
        let phases = self.inner.phases().iter().enumerate();
        phases
            .map(|(i, phase)| {
                let form = Form::Ready(Box::new(phase.clone()), n);
                Ok((self.nodes(py, &Wanted::Species(i))?, Phase { form }))
            })
            .collect()
    }

    fn vertical_optical_depth<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let lanes = 0..self.inner.wavelength_nm().len();
        let depths: Vec<f64> = lanes
            .map(|lane| self.inner.vertical_optical_depth(lane))
            .collect();
        depths.into_pyarray(py)
    }
}
