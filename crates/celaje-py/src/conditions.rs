//! Place, time and what the user wants instead, to conditions.

use celaje::climate::{self, Albedo, ConditionRow, ConditionValue, Overrides, OzoneClimate};
use celaje::composition::aerosol::AerosolType;
use celaje::composition::upper::{Mesosphere, Stratosphere};
use celaje::place::{parse_time, Site};
use celaje::{Error, WavelengthGrid};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::PyAny;

use crate::error::Outcome;

/// All conditions of a sky.
#[pyclass(frozen, module = "celaje._core")]
pub struct Conditions {
    pub inner: climate::Conditions,
}

/// A place as a user gives it.
#[derive(FromPyObject)]
pub enum Place {
    /// The name of a city, or coordinates as text.
    Name(String),
    /// Latitude and longitude \[deg\].
    At(f64, f64),
}

impl Place {
    pub fn site(&self) -> celaje::Result<Site> {
        match self {
            Self::Name(name) => Site::parse(name),
            Self::At(latitude_deg, longitude_deg) => Site::new(*latitude_deg, *longitude_deg, 0.0),
        }
    }
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

/// What the user wants instead of what the climate says, by the words of `celaje.sky`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Words {
    altitude: Option<f64>,
    sun_elevation: Option<f64>,
    sun_azimuth: Option<f64>,
    sun_distance_au: Option<f64>,
    aerosol: Option<String>,
    aod_550: Option<f64>,
    turbidity: Option<f64>,
    visibility: Option<f64>,
    stratosphere: Option<String>,
    mesosphere: Option<String>,
    humidity: Option<f64>,
    ozone: Option<f64>,
    ozone_climate: Option<String>,
    no_ozone: Option<bool>,
    no2: Option<f64>,
    water: Option<f64>,
    co2: Option<f64>,
    albedo: Option<AlbedoArgument>,
    atmosphere: Option<String>,
}

impl Words {
    pub fn overrides(self) -> celaje::Result<Overrides> {
        let ozone_climate = self.ozone_climate.as_deref().map(OzoneClimate::named);
        Ok(Overrides {
            altitude_m: self.altitude,
            sun_elevation_deg: self.sun_elevation,
            sun_azimuth_deg: self.sun_azimuth,
            sun_distance_au: self.sun_distance_au,
            atmosphere: self.atmosphere,
            ozone_du: self.ozone,
            ozone_climate: ozone_climate.transpose()?,
            no_ozone: self.no_ozone.unwrap_or(false),
            no2_du: self.no2,
            water_mm: self.water,
            co2_ppm: self.co2,
            aerosol: self.aerosol,
            aod_550: self.aod_550,
            turbidity: self.turbidity,
            visibility_km: self.visibility,
            stratosphere: self.stratosphere,
            mesosphere: self.mesosphere,
            humidity_percent: self.humidity,
            albedo: self.albedo.map(AlbedoArgument::read).transpose()?,
            ..Overrides::default()
        })
    }
}

/// Looks names up that are composed later: an unknown one is refused at once.
pub fn check_names(conditions: &climate::Conditions) -> celaje::Result<()> {
    AerosolType::of_conditions(conditions)?;
    Stratosphere::named(&conditions.stratosphere.value)?;
    Mesosphere::named(&conditions.mesosphere.value)?;
    Ok(())
}

#[pymethods]
impl Conditions {
    #[new]
    fn new(at: Option<Place>, time: Option<&str>, local: bool, words: Words) -> Outcome<Self> {
        let overrides = words.overrides()?;
        let inner = match (at, time, overrides.sun_elevation_deg) {
            (Some(place), Some(time), _) => {
                let site = place.site()?;
                let instant = parse_time(time, &site, local)?;
                climate::Conditions::at(&site, &instant, &overrides)?
            }
            (None, None, Some(elevation_deg)) => {
                let azimuth = overrides.sun_azimuth_deg;
                let azimuth_deg = azimuth.unwrap_or(climate::due_south().value);
                let mut all =
                    climate::Conditions::from_sun(elevation_deg, azimuth_deg, &overrides)?;
                if azimuth.is_none() {
                    all.sun_azimuth_deg = climate::due_south();
                }
                all
            }
            (Some(_), None, _) => return Err(half_a_place("a place is given, but no time").into()),
            (None, Some(_), _) => return Err(half_a_place("a time is given, but no place").into()),
            (None, None, None) => return Err(half_a_place("neither place nor sun is given").into()),
        };
        check_names(&inner)?;
        Ok(Self { inner })
    }

    /// Every line of `celaje explain`.
    fn rows(&self, py: Python<'_>) -> Outcome<Vec<Row>> {
        let rows = self.inner.rows().into_iter();
        Ok(rows.map(|r| row(py, r)).collect::<PyResult<_>>()?)
    }
}

/// Key, text for people, value, whether that is an instant, unit, uncertainty, source, reason.
type Row = (
    &'static str,
    String,
    Py<PyAny>,
    bool,
    &'static str,
    Option<f64>,
    String,
    String,
);

fn row(py: Python<'_>, row: ConditionRow) -> PyResult<Row> {
    let ConditionRow {
        key,
        text,
        condition,
    } = row;
    let is_time = matches!(condition.value, ConditionValue::Time(_));
    let value = match condition.value {
        ConditionValue::Number(value) => value.into_pyobject(py)?.into_any().unbind(),
        ConditionValue::Text(text) => text.into_pyobject(py)?.into_any().unbind(),
        ConditionValue::Time(instant) => instant.to_string().into_pyobject(py)?.into_any().unbind(),
        ConditionValue::None => py.None(),
    };
    let (unit, uncertainty) = (condition.unit, condition.uncertainty);
    Ok((
        key,
        text,
        value,
        is_time,
        unit,
        uncertainty,
        condition.source,
        condition.reason,
    ))
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
