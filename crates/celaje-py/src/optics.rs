//! What particles and molecules do to light, for its own sake.

use celaje::composition::aerosol::AerosolType;
use celaje::error::check_range;
use celaje::optics::rayleigh::Rayleigh;
use celaje::optics::{self, AngleGrid, ScatteringMatrix};
use celaje::WavelengthGrid;
use numpy::{Complex64, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::own_aerosol::OwnAerosol;

/// Latitude whose tropopause ends the AIAA types; without effect at the ground \[deg\].
pub const LATITUDE_DEG: f64 = 45.0;

/// Extinction \[m⁻¹\], single-scattering albedo, asymmetry, shape (w,); angles \[deg\], shape (t,); phase function
/// \[sr⁻¹\], shape (w, t).
type Optics<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Sums over the species of a mixture, at each wavelength.
struct Mixture {
    sigma_t: Vec<f64>,
    sigma_s: Vec<f64>,
    /// Weighted by σ_s.
    asymmetry: Vec<f64>,
    /// Weighted by σ_s, row by wavelength.
    phase: Vec<f64>,
    theta_deg: Vec<f64>,
}

impl Mixture {
    fn new(wavelengths: usize, theta_deg: &[f64]) -> Self {
        Self {
            sigma_t: vec![0.0; wavelengths],
            sigma_s: vec![0.0; wavelengths],
            asymmetry: vec![0.0; wavelengths],
            phase: vec![0.0; wavelengths * theta_deg.len()],
            theta_deg: theta_deg.to_vec(),
        }
    }

    /// Adds a species at one wavelength: number density \[m⁻³\], cross sections \[m²\].
    fn add(
        &mut self,
        i: usize,
        number_density: f64,
        xs: [f64; 2],
        asymmetry: f64,
        matrix: &ScatteringMatrix,
    ) {
        let sigma_s = number_density * xs[1];
        self.sigma_t[i] += number_density * xs[0];
        self.sigma_s[i] += sigma_s;
        self.asymmetry[i] += sigma_s * asymmetry;
        let t = self.theta_deg.len();
        for (sum, f) in self.phase[i * t..].iter_mut().zip(&matrix.f11) {
            *sum += sigma_s * f;
        }
    }

    fn finish(mut self, py: Python<'_>) -> Outcome<Optics<'_>> {
        let (w, t) = (self.sigma_t.len(), self.theta_deg.len());
        let mut ssa = Vec::with_capacity(w);
        for i in 0..w {
            ssa.push(self.sigma_s[i] / self.sigma_t[i]);
            self.asymmetry[i] /= self.sigma_s[i];
            for p in &mut self.phase[i * t..(i + 1) * t] {
                *p /= self.sigma_s[i];
            }
        }
        Ok((
            self.sigma_t.into_pyarray(py),
            ssa.into_pyarray(py),
            self.asymmetry.into_pyarray(py),
            self.theta_deg.into_pyarray(py),
            self.phase.into_pyarray(py).reshape([w, t])?,
        ))
    }
}

/// Optics of an aerosol type at sea level, in the amount of its definition.
#[pyfunction]
pub fn aerosol<'py>(
    py: Python<'py>,
    name: &str,
    humidity_percent: f64,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
) -> Outcome<Optics<'py>> {
    let wavelength = WavelengthGrid::new(wavelength_nm.as_slice()?.to_vec())?;
    let kind = AerosolType::named(name, LATITUDE_DEG)?;
    let all = py.detach(|| optics::aerosol_optics(&kind, humidity_percent, &wavelength))?;
    let mut mixture = Mixture::new(wavelength.len(), all.angles.theta_deg());
    for layer in &all.layers {
        let density = layer.number_density(0.0);
        for i in 0..wavelength.len() {
            let xs = [layer.xs_ext[i], layer.xs_sca[i]];
            mixture.add(i, density, xs, layer.asymmetry[i], &layer.matrix[i]);
        }
    }
    mixture.finish(py)
}

/// Optics of one OPAC component at 1 cm⁻³.
#[pyfunction]
pub fn component<'py>(
    py: Python<'py>,
    name: &str,
    humidity_percent: f64,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
) -> Outcome<Optics<'py>> {
    let wavelength = WavelengthGrid::new(wavelength_nm.as_slice()?.to_vec())?;
    let all = py.detach(|| optics::component(name, humidity_percent, &wavelength))?;
    let mut mixture = Mixture::new(wavelength.len(), all.angles.theta_deg());
    for (i, one) in all.optics.iter().enumerate() {
        let xs = [one.xs_ext, one.xs_sca];
        mixture.add(i, 1e6, xs, one.asymmetry, &one.matrix);
    }
    mixture.finish(py)
}

/// Optics of an aerosol of one's own at 1 cm⁻³.
#[pyfunction]
pub fn own_aerosol<'py>(
    py: Python<'py>,
    own: &OwnAerosol,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
) -> Outcome<Optics<'py>> {
    let wavelength = WavelengthGrid::new(wavelength_nm.as_slice()?.to_vec())?;
    let particle = own.inner.particle();
    let angles = AngleGrid::default();
    let all = py.detach(|| optics::component_optics(&particle, &wavelength, &angles))?;
    let mut mixture = Mixture::new(wavelength.len(), all.angles.theta_deg());
    for (i, one) in all.optics.iter().enumerate() {
        let xs = [one.xs_ext, one.xs_sca];
        mixture.add(i, 1e6, xs, one.asymmetry, &one.matrix);
    }
    mixture.finish(py)
}

/// What one sphere does to light.
#[pyclass(frozen, module = "celaje._core")]
pub struct MieSphere {
    inner: optics::MieSphere,
}

/// Scattering by one homogeneous sphere.
#[pyfunction]
pub fn mie(n: f64, k: f64, size_parameter: f64) -> Outcome<MieSphere> {
    let inner = optics::mie(n, k, size_parameter)?;
    Ok(MieSphere { inner })
}

#[pymethods]
impl MieSphere {
    #[getter]
    fn q_ext(&self) -> f64 {
        self.inner.q_ext
    }

    #[getter]
    fn q_sca(&self) -> f64 {
        self.inner.q_sca
    }

    #[getter]
    fn asymmetry(&self) -> f64 {
        self.inner.asymmetry
    }

    /// `S1` and `S2` at some scattering angles.
    #[allow(clippy::type_complexity)]
    fn amplitudes<'py>(
        &self,
        py: Python<'py>,
        theta_deg: PyReadonlyArray1<'py, f64>,
    ) -> Outcome<(
        Bound<'py, PyArray1<Complex64>>,
        Bound<'py, PyArray1<Complex64>>,
    )> {
        let cos_theta = cosines(theta_deg.as_slice()?)?;
        let (s1, s2) = self.inner.amplitudes(&cos_theta)?;
        let array = |s: Vec<celaje::math::Complex>| {
            let values: Vec<Complex64> = s.iter().map(|z| Complex64::new(z.re, z.im)).collect();
            values.into_pyarray(py)
        };
        Ok((array(s1), array(s2)))
    }
}

/// Rayleigh scattering cross section of air per molecule \[m²\].
#[pyfunction]
pub fn rayleigh_cross_section<'py>(
    py: Python<'py>,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
) -> Outcome<Bound<'py, PyArray1<f64>>> {
    let rayleigh = Rayleigh::new()?;
    let wavelengths = wavelength_nm.as_slice()?.iter();
    let xs: Vec<f64> = wavelengths
        .map(|&nm| rayleigh.xs_sca(nm))
        .collect::<celaje::Result<_>>()?;
    Ok(xs.into_pyarray(py))
}

/// Cosines of scattering angles from 0 to 180 \[deg\], exactly 0 at 90.
pub fn cosines(theta_deg: &[f64]) -> celaje::Result<Vec<f64>> {
    let cosine = |&theta: &f64| {
        check_range("scattering angle", theta, "deg", 0.0..=180.0)?;
        Ok(if theta == 90.0 {
            0.0
        } else {
            theta.to_radians().cos()
        })
    };
    theta_deg.iter().map(cosine).collect()
}
