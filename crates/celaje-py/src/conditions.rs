//! Place, time and what the user wants instead, to conditions.

use celaje::climate::{self, Albedo, Condition, Overrides, OzoneClimate};
use celaje::place::{Instant, Site};
use celaje::{Error, WavelengthGrid};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::Outcome;

/// All conditions of a sky.
#[pyclass(frozen, module = "celaje._core")]
pub struct Conditions {
    pub inner: climate::Conditions,
}

/// An albedo as a user gives it.
#[derive(FromPyObject)]
pub enum AlbedoArgument {
    /// A number.
    Number(f64),
    /// The name of a preset.
    Name(String),
}

impl AlbedoArgument {
    fn read(self) -> celaje::Result<Albedo> {
        match self {
            Self::Number(value) => Albedo::new(value),
            Self::Name(name) => name.parse(),
        }
    }
}

#[pymethods]
impl Conditions {
    #[new]
    #[pyo3(signature = (
        at, time, sun_elevation, sun_azimuth, sun_distance_au, altitude_m, atmosphere, ozone_du,
        ozone_climate, no_ozone, aerosol, aod_550, turbidity, humidity_percent, albedo,
    ))]
    fn new(
        at: Option<(f64, f64)>,
        time: Option<&str>,
        sun_elevation: Option<f64>,
        sun_azimuth: Option<f64>,
        sun_distance_au: Option<f64>,
        altitude_m: Option<f64>,
        atmosphere: Option<String>,
        ozone_du: Option<f64>,
        ozone_climate: Option<&str>,
        no_ozone: bool,
        aerosol: Option<String>,
        aod_550: Option<f64>,
        turbidity: Option<f64>,
        humidity_percent: Option<f64>,
        albedo: Option<AlbedoArgument>,
    ) -> Outcome<Self> {
        let overrides = Overrides {
            altitude_m,
            sun_elevation_deg: sun_elevation,
            sun_azimuth_deg: sun_azimuth,
            sun_distance_au,
            atmosphere,
            ozone_du,
            ozone_climate: ozone_climate.map(OzoneClimate::named).transpose()?,
            no_ozone,
            aerosol,
            aod_550,
            turbidity,
            humidity_percent,
            albedo: albedo.map(AlbedoArgument::read).transpose()?,
            ..Overrides::default()
        };
        let inner = match (at, time, sun_elevation) {
            (Some((latitude_deg, longitude_deg)), Some(time), _) => {
                let site = Site::new(latitude_deg, longitude_deg, 0.0)?;
                let instant: Instant = time.parse()?;
                climate::Conditions::at(&site, &instant, &overrides)?
            }
            (None, None, Some(elevation)) => {
                climate::Conditions::from_sun(elevation, sun_azimuth.unwrap_or(180.0), &overrides)?
            }
            (Some(_), None, _) => return Err(half_a_place("a place is given, but no time").into()),
            (None, Some(_), _) => return Err(half_a_place("a time is given, but no place").into()),
            (None, None, None) => return Err(half_a_place("neither place nor sun is given").into()),
        };
        Ok(Self { inner })
    }

    /// Field → (value, unit, source, reason); a field that has no value is left out.
    fn fields<'py>(&self, py: Python<'py>) -> Outcome<Bound<'py, PyDict>> {
        let c = &self.inner;
        let fields = PyDict::new(py);
        let optional = [
            ("latitude_deg", &c.latitude_deg),
            ("longitude_deg", &c.longitude_deg),
        ];
        for (name, condition) in optional {
            if let Some(condition) = condition {
                fields.set_item(name, parts(condition))?;
            }
        }
        if let Some(time) = &c.time {
            let text = (
                time.value.to_string(),
                time.unit,
                &time.source,
                &time.reason,
            );
            fields.set_item("time", text)?;
        }
        for (name, condition) in [
            ("altitude_m", &c.altitude_m),
            ("sun_elevation_deg", &c.sun_elevation_deg),
            ("sun_azimuth_deg", &c.sun_azimuth_deg),
            ("sun_distance_au", &c.sun_distance_au),
            ("ozone_du", &c.ozone_du),
            ("aod_550", &c.aod_550),
            ("humidity_percent", &c.humidity_percent),
            ("albedo", &c.albedo),
        ] {
            fields.set_item(name, parts(condition))?;
        }
        fields.set_item("atmosphere", parts(&c.atmosphere))?;
        fields.set_item("aerosol", parts(&c.aerosol))?;
        Ok(fields)
    }

    /// (key, value as text, unit, source, reason) of every line of `celaje explain`.
    fn rows(&self) -> Vec<(&'static str, String, &'static str, String, String)> {
        let rows = self.inner.rows().into_iter();
        rows.map(|r| (r.key, r.value, r.unit, r.source, r.reason))
            .collect()
    }
}

fn parts<T: Clone>(c: &Condition<T>) -> (T, &'static str, &str, &str) {
    (c.value.clone(), c.unit, &c.source, &c.reason)
}

fn half_a_place(message: &str) -> Error {
    Error::invalid(
        message,
        "give at=(latitude, longitude) and time=\"2026-06-21T18:30Z\", or sun_elevation alone",
    )
}

/// Wavelengths `start, start + step, …, stop` \[nm\].
#[pyfunction]
pub fn wavelength_range(
    py: Python<'_>,
    start_nm: f64,
    stop_nm: f64,
    step_nm: f64,
) -> Outcome<Bound<'_, PyArray1<f64>>> {
    let grid = WavelengthGrid::range(start_nm, stop_nm, step_nm)?;
    Ok(grid.nm().to_vec().into_pyarray(py))
}
