//! A sky, and looking at it.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use celaje::bake::BakeOptions;
use celaje::composition::aerosol::AerosolType;
use celaje::error::check_range;
use celaje::irradiance::Tilt;
use celaje::math::Vec3;
use celaje::medium::{GridBox, GriddedMedium};
use celaje::place::SunPosition;
use celaje::residual::{Correction, Residual};
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Accuracy, Budget, Goal, Reins};
use celaje::{Error, Film, WavelengthGrid};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::conditions::Conditions;
use crate::error::Outcome;
use crate::film::{stokes_arrays, StokesArrays};
use crate::inventory::Inventory;
use crate::medium::{Medium, Phase};
use crate::own_aerosol::OwnAerosol;
use crate::run::interruptible;
use crate::sensor::Sensor;

/// Radiance and its variance, shape (height, width, wavelength); samples, shape (height, width); if asked for, the means and
/// variances of Q, U, V, each of the first shape.
type FilmArrays<'py> = (
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray2<u32>>,
    StokesArrays<'py>,
);

/// A sky.
#[pyclass(frozen, module = "celaje._core")]
pub struct Sky {
    inner: celaje::Sky,
}

#[pymethods]
impl Sky {
    #[staticmethod]
    fn from_conditions(
        py: Python<'_>,
        conditions: &Conditions,
        wavelength_nm: Option<PyReadonlyArray1<'_, f64>>,
        sun: &str,
        own_aerosol: Option<&OwnAerosol>,
    ) -> Outcome<Self> {
        let wavelength = match wavelength_nm {
            Some(nm) => WavelengthGrid::new(nm.as_slice()?.to_vec())?,
            None => WavelengthGrid::default(),
        };
        let solar = SolarSpectrum::named(sun)?;
        let conditions = conditions.inner.clone();
        let own = own_aerosol.map(|own| AerosolType::from(own.inner.clone()));
        let inner = interruptible(py, None, |_| match &own {
            Some(own) => celaje::Sky::with_aerosol(conditions, own, &wavelength, solar),
            None => celaje::Sky::new(conditions, &wavelength, solar),
        })?;
        Ok(Self { inner })
    }

    #[staticmethod]
    fn from_medium(
        medium: &Medium,
        sun_elevation_deg: f64,
        sun_azimuth_deg: f64,
        albedo: PyReadonlyArray1<'_, f64>,
        irradiance: PyReadonlyArray1<'_, f64>,
        sun_angular_radius_deg: f64,
    ) -> Outcome<Self> {
        let inner = celaje::Sky::from_medium(
            medium.inner.clone(),
            sun_elevation_deg,
            sun_azimuth_deg,
            albedo.as_slice()?,
            irradiance.as_slice()?,
            sun_angular_radius_deg,
        )?;
        Ok(Self { inner })
    }

    fn medium(&self) -> Medium {
        Medium {
            inner: self.inner.medium.clone(),
        }
    }

    #[getter]
    fn wavelength_nm<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.wavelength_nm().to_vec().into_pyarray(py)
    }

    #[getter]
    fn albedo<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.albedo.clone().into_pyarray(py)
    }

    /// Irradiance above the air on a plane that faces the sun \[W m⁻² nm⁻¹\], shape (w,).
    #[getter]
    fn sun_irradiance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let lanes = &self.inner.sun.irradiance[..self.inner.wavelength_nm().len()];
        let values: Vec<f64> = lanes.iter().map(|&e| f64::from(e)).collect();
        values.into_pyarray(py)
    }

    /// Ground above sea level \[m\].
    #[getter]
    fn ground_altitude_m(&self) -> f64 {
        self.inner.ground_altitude_m()
    }

    /// Azimuth and elevation of the sun \[deg\].
    #[getter]
    fn sun_position(&self) -> (f64, f64) {
        self.inner.sun.direction.to_azimuth_elevation_deg()
    }

    /// The conditions in force, with what the composition entered; nothing for a medium of one's own.
    fn conditions(&self) -> Option<Conditions> {
        let inner = self.inner.conditions.clone()?;
        Some(Conditions { inner })
    }

    /// What the air is made of; nothing for a medium of one's own.
    fn inventory(&self, py: Python<'_>) -> Outcome<Option<Inventory>> {
        let Some(composition) = &self.inner.composition else {
            return Ok(None);
        };
        let wavelength = WavelengthGrid::new(self.inner.wavelength_nm().to_vec())?;
        let inner = py.detach(|| celaje::inventory::Inventory::new(composition, &wavelength))?;
        Ok(Some(Inventory { inner }))
    }

    /// Exactly `spp` paths per pixel or, with a noise or a time limit, at most so many.
    #[pyo3(signature = (sensor, method, accuracy, spp, seed, max_order, sun_disc, altitude_m, threads, noise, time_limit_s, polarised=None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        sensor: &Sensor,
        method: Option<&str>,
        accuracy: &str,
        spp: u32,
        seed: u64,
        max_order: Option<u32>,
        sun_disc: &str,
        altitude_m: Option<f64>,
        threads: Option<usize>,
        noise: Option<f64>,
        time_limit_s: Option<f64>,
        polarised: Option<bool>,
    ) -> Outcome<FilmArrays<'py>> {
        let sun_disc = read_sun_disc(sun_disc)?;
        let mut options = render_options(
            method,
            accuracy,
            (spp, seed, max_order),
            sun_disc,
            altitude_m,
        )?;
        options.polarised = read_polarised(polarised);
        if let Some(seconds) = time_limit_s {
            check_range("time_limit", seconds, "s", 1e-3..=1e9)?;
        }
        let goal = Goal {
            noise,
            time_limit: time_limit_s.map(Duration::from_secs_f64),
        };
        let film = interruptible(py, threads, |cancel| {
            let sensor = sensor.inner.as_ref();
            if goal == Goal::default() {
                return self.inner.render(sensor, &options, cancel, &|_, _| ());
            }
            let reins = Reins {
                resume: None,
                keep: None,
                progress: &|_, _| (),
            };
            let outcome = self
                .inner
                .render_until(sensor, &options, &goal, cancel, reins)?;
            Ok(outcome.film)
        })?;
        film_arrays(py, film)
    }

    /// The picture by shells and what its file is to say of its difference from path; if wanted, without what of that is smooth.
    #[pyo3(signature = (sensor, accuracy, seed, max_order, sun_disc, altitude_m, threads, polarised, correct))]
    fn render_checked<'py>(
        &self,
        py: Python<'py>,
        sensor: &Sensor,
        accuracy: &str,
        seed: u64,
        max_order: Option<u32>,
        sun_disc: &str,
        altitude_m: Option<f64>,
        threads: Option<usize>,
        polarised: Option<bool>,
        correct: bool,
    ) -> Outcome<(FilmArrays<'py>, Vec<(String, String)>)> {
        let sun_disc = read_sun_disc(sun_disc)?;
        let budget = (1, seed, max_order);
        let mut options = render_options(Some("shells"), accuracy, budget, sun_disc, altitude_m)?;
        options.polarised = read_polarised(polarised);
        let (film, entries) = interruptible(py, threads, |cancel| {
            let (sky, sensor) = (&self.inner, sensor.inner.as_ref());
            if correct {
                let spp = Correction::SPP;
                let (film, correction) =
                    sky.render_corrected(sensor, &options, spp, cancel, &|_, _| ())?;
                return Ok((film, correction.entries()));
            }
            let film = sky.render(sensor, &options, cancel, &|_, _| ())?;
            let residual = sky.residual(sensor, &options, Residual::SPP, cancel, &|_, _| ())?;
            Ok((film, residual.entries()))
        })?;
        Ok((film_arrays(py, film)?, entries))
    }

    /// The same sky with a box of cells in it, whose edges and content are arrays (see `celaje::medium::GridBox`).
    fn with_cloud(
        &self,
        edges_m: [PyReadonlyArray1<'_, f64>; 3],
        density: PyReadonlyArray1<'_, f64>,
        sigma_s: PyReadonlyArray1<'_, f64>,
        sigma_a: PyReadonlyArray1<'_, f64>,
        phase: &Phase,
    ) -> Outcome<Self> {
        let [east, north, altitude] = &edges_m;
        let edges = [east.as_slice()?, north.as_slice()?, altitude.as_slice()?];
        let (density, sigma_s, sigma_a) = (
            density.as_slice()?,
            sigma_s.as_slice()?,
            sigma_a.as_slice()?,
        );
        let phase = phase.at_wavelengths(self.inner.wavelength_nm().len())?;
        let cloud = GridBox::new(edges, density, sigma_s, sigma_a, phase)?;
        GriddedMedium::new(&self.inner.medium, &cloud)?;
        let mut inner = self.inner.clone();
        inner.cloud = Some(cloud);
        Ok(Self { inner })
    }

    /// What falls on planes at the observer, with illuminance \[lx\] and colour temperature \[K\] of the global part.
    #[pyo3(signature = (tilt, method, accuracy, spp, seed, max_order, altitude_m, threads))]
    fn irradiance<'py>(
        &self,
        py: Python<'py>,
        tilt: (f64, f64),
        method: Option<&str>,
        accuracy: &str,
        spp: u32,
        seed: u64,
        max_order: Option<u32>,
        altitude_m: Option<f64>,
        threads: Option<usize>,
    ) -> Outcome<Bound<'py, PyDict>> {
        let (tilt_deg, azimuth_deg) = tilt;
        let plane = Tilt {
            tilt_deg,
            azimuth_deg,
        };
        let options = render_options(
            method,
            accuracy,
            (spp, seed, max_order),
            SunDisc::Off,
            altitude_m,
        )?;
        let e = interruptible(py, threads, |cancel| {
            self.inner.irradiance(&plane, &options, cancel, &|_, _| ())
        })?;
        let fields = PyDict::new(py);
        fields.set_item("lux", e.global.lux(&e.wavelength_nm)?.unwrap_or(f64::NAN))?;
        let cct = e.global.cct(&e.wavelength_nm)?;
        fields.set_item("cct_k", cct.map(|c| c.temperature_k))?;
        fields.set_item("wavelength_nm", e.wavelength_nm.into_pyarray(py))?;
        for (name, error_name, part) in [
            (
                "direct_normal",
                "direct_normal_standard_error",
                e.direct_normal,
            ),
            ("direct", "direct_standard_error", e.direct),
            ("diffuse", "diffuse_standard_error", e.diffuse),
            ("global_", "global_standard_error", e.global),
        ] {
            fields.set_item(name, part.irradiance.into_pyarray(py))?;
            fields.set_item(error_name, part.standard_error.into_pyarray(py))?;
        }
        Ok(fields)
    }

    /// The same sky with tables for suns of a range of elevations \[deg\].
    #[pyo3(signature = (sun_elevation_deg, highest_observer_m, accuracy, threads, polarised=true))]
    fn bake(
        &self,
        py: Python<'_>,
        sun_elevation_deg: (f64, f64),
        highest_observer_m: f64,
        accuracy: &str,
        threads: Option<usize>,
        polarised: bool,
    ) -> Outcome<Self> {
        let options = BakeOptions {
            accuracy: Accuracy::named(accuracy)?,
            sun_elevation_deg,
            highest_observer_m,
            polarised,
        };
        let inner = interruptible(py, threads, |cancel| self.inner.baked(&options, cancel))?;
        Ok(Self { inner })
    }

    /// The same air under another sun.
    fn under(&self, azimuth_deg: f64, elevation_deg: f64, distance_au: f64) -> Outcome<Self> {
        let sun = SunPosition::new(azimuth_deg, elevation_deg, distance_au)?;
        let inner = self.inner.under(&sun)?;
        Ok(Self { inner })
    }

    /// Distance of the sun \[au\].
    #[getter]
    fn sun_distance_au(&self) -> f64 {
        self.inner.sun_distance_au
    }

    /// Whether it has tables.
    #[getter]
    fn is_baked(&self) -> bool {
        self.inner.tables.is_some()
    }

    /// Radiance \[W m⁻² sr⁻¹ nm⁻¹\] for every sun and every direction, shape (sun, direction, wavelength).
    #[pyo3(signature = (sun_azimuth_deg, sun_elevation_deg, azimuth_deg, elevation_deg, altitude_m, threads))]
    fn radiance_under<'py>(
        &self,
        py: Python<'py>,
        sun_azimuth_deg: PyReadonlyArray1<'py, f64>,
        sun_elevation_deg: PyReadonlyArray1<'py, f64>,
        azimuth_deg: PyReadonlyArray1<'py, f64>,
        elevation_deg: PyReadonlyArray1<'py, f64>,
        altitude_m: Option<f64>,
        threads: Option<usize>,
    ) -> Outcome<Bound<'py, PyArray3<f32>>> {
        let distance_au = self.inner.sun_distance_au;
        let pairs = |a: &[f64], b: &[f64]| -> Vec<(f64, f64)> {
            a.iter().copied().zip(b.iter().copied()).collect()
        };
        let suns: Vec<SunPosition> =
            pairs(sun_azimuth_deg.as_slice()?, sun_elevation_deg.as_slice()?)
                .into_iter()
                .map(|(a, e)| SunPosition::new(a, e, distance_au))
                .collect::<celaje::Result<_>>()?;
        let looks: Vec<Vec3> = pairs(azimuth_deg.as_slice()?, elevation_deg.as_slice()?)
            .into_iter()
            .map(|(a, e)| Vec3::from_azimuth_elevation_deg(a, e))
            .collect();
        let shape = [suns.len(), looks.len(), self.inner.wavelength_nm().len()];
        let radiance = interruptible(py, threads, |cancel| {
            let mut all = Vec::new();
            for sun in &suns {
                if cancel.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                all.extend(self.inner.radiance_under(&[*sun], &looks, altitude_m)?);
            }
            Ok(all)
        })?;
        Ok(radiance.into_pyarray(py).reshape(shape)?)
    }

    fn save_tables(&self, path: &str, origin: Vec<(String, String)>) -> Outcome<()> {
        Ok(self.inner.save_tables(Path::new(path), &origin)?)
    }

    #[staticmethod]
    fn load_tables(path: &str) -> Outcome<(Self, Vec<(String, String)>)> {
        let (inner, origin) = celaje::Sky::load_tables(Path::new(path))?;
        Ok((Self { inner }, origin))
    }
}

fn film_arrays(py: Python<'_>, film: Film) -> Outcome<FilmArrays<'_>> {
    let shape = [film.height, film.width, film.wavelength_nm.len()];
    Ok((
        film.radiance.into_pyarray(py).reshape(shape)?,
        film.variance.into_pyarray(py).reshape(shape)?,
        film.samples
            .into_pyarray(py)
            .reshape([film.height, film.width])?,
        stokes_arrays(py, film.polarisation, shape)?,
    ))
}

fn read_polarised(polarised: Option<bool>) -> Polarised {
    match polarised {
        None => Polarised::Radiance,
        Some(true) => Polarised::Stokes,
        Some(false) => Polarised::Off,
    }
}

/// Options from the words of Python; `budget` is paths, seed and largest order.
fn render_options(
    method: Option<&str>,
    accuracy: &str,
    budget: (u32, u64, Option<u32>),
    sun_disc: SunDisc,
    altitude_m: Option<f64>,
) -> Outcome<RenderOptions> {
    let (spp, seed, max_order) = budget;
    Ok(RenderOptions {
        accuracy: Accuracy::named(accuracy)?,
        polarised: Polarised::default(),
        method: method.map(Method::named).transpose()?.unwrap_or_default(),
        budget: Budget {
            spp,
            seed,
            max_order,
        },
        sun_disc,
        altitude_m,
    })
}

/// Name of the method that is used where none is asked for.
pub fn default_method() -> &'static str {
    let methods = Method::ALL.iter();
    let mut named = methods.filter(|(method, ..)| *method == Method::default());
    named.next().map_or("", |(_, name, _)| name)
}

fn read_sun_disc(name: &str) -> celaje::Result<SunDisc> {
    match name {
        "on" => Ok(SunDisc::On),
        "off" => Ok(SunDisc::Off),
        "only" => Ok(SunDisc::Only),
        _ => Err(Error::UnknownName {
            kind: "sun disc",
            name: name.to_owned(),
            known: ["on", "off", "only"].map(str::to_owned).to_vec(),
        }),
    }
}
