//! Conditions of many places and times at once.

use celaje::climate::{self, Condition, Overrides};
use celaje::place::{parse_time, Instant, MoonPosition, Site};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::conditions::{check_names, Place, Words};
use crate::error::Outcome;

/// Times as a user gives them.
#[derive(FromPyObject)]
pub enum Times {
    /// Words and instants, read at each place.
    Text(Vec<String>),
    /// Seconds since 1970-01-01T00:00Z.
    Unix(Vec<f64>),
}

impl Times {
    fn at(&self, site: &Site, local: bool) -> celaje::Result<Vec<Instant>> {
        match self {
            Self::Text(texts) => texts.iter().map(|t| parse_time(t, site, local)).collect(),
            Self::Unix(seconds) => seconds
                .iter()
                .map(|&s| Instant::from_unix_seconds(s))
                .collect(),
        }
    }
}

type Number = (&'static str, fn(&climate::Conditions) -> &Condition<f64>);
type OfMoon = (&'static str, fn(&MoonPosition) -> f64);
type Name = (&'static str, fn(&climate::Conditions) -> &str);

/// Conditions that are numbers, by the names of their fields.
const NUMBERS: [Number; 10] = [
    ("altitude_m", |c| &c.altitude_m),
    ("sun_elevation_deg", |c| &c.sun_elevation_deg),
    ("sun_azimuth_deg", |c| &c.sun_azimuth_deg),
    ("sun_distance_au", |c| &c.sun_distance_au),
    ("ozone_du", |c| &c.ozone_du),
    ("no2_du", |c| &c.no2_du),
    ("water_mm", |c| &c.water_mm),
    ("aod_550", |c| &c.aod_550),
    ("humidity_percent", |c| &c.humidity_percent),
    ("albedo", |c| &c.albedo),
];

/// The Moon's numbers.
const MOON: [OfMoon; 5] = [
    ("moon_elevation_deg", |m| m.elevation_deg),
    ("moon_azimuth_deg", |m| m.azimuth_deg),
    ("moon_distance_km", |m| m.distance_km),
    ("moon_phase_deg", |m| m.phase_angle_deg),
    ("moon_illuminated", |m| m.illuminated),
];

/// Conditions that are names.
const NAMES: [Name; 3] = [
    ("atmosphere", |c| &c.atmosphere.value),
    ("aerosol", |c| &c.aerosol.value),
    ("aerosol_type", |c| {
        c.mixture
            .as_ref()
            .map_or(c.aerosol.value.as_str(), |m| m.nearest_type)
    }),
];

/// What is kept of one place and time.
struct Sample {
    numbers: [f64; NUMBERS.len()],
    /// NaN where not known.
    uncertainties: [f64; NUMBERS.len()],
    moon: [f64; MOON.len()],
    names: [String; NAMES.len()],
}

impl Sample {
    fn new(site: &Site, instant: &Instant, overrides: &Overrides) -> celaje::Result<Self> {
        let c = climate::Conditions::at(site, instant, overrides)?;
        Ok(Self {
            numbers: NUMBERS.map(|(_, of)| of(&c).value),
            uncertainties: NUMBERS.map(|(_, of)| of(&c).uncertainty.unwrap_or(f64::NAN)),
            moon: MOON.map(|(_, of)| c.moon.as_ref().map_or(f64::NAN, of)),
            names: NAMES.map(|(_, of)| of(&c).to_owned()),
        })
    }
}

/// Conditions of every place at every time.
///
/// Returns a dict: `latitude_deg` and `longitude_deg`, shape (place,); `unix_s` and each of the numbers, shape (place, time);
/// `<name>_uncertainty` where known; names as lists; `unit` and `source` of each, as of the first place and time.
#[pyfunction]
pub fn climate_table<'py>(
    py: Python<'py>,
    at: Vec<Place>,
    times: Times,
    local: bool,
    words: Words,
) -> Outcome<Bound<'py, PyDict>> {
    let overrides = words.overrides()?;
    let sites: Vec<Site> = at.iter().map(Place::site).collect::<celaje::Result<_>>()?;
    let (instants, samples) = py.detach(|| -> celaje::Result<_> {
        let instants: Vec<Vec<Instant>> = sites
            .par_iter()
            .map(|site| times.at(site, local))
            .collect::<celaje::Result<_>>()?;
        let pairs: Vec<(&Site, &Instant)> = sites
            .iter()
            .zip(&instants)
            .flat_map(|(site, instants)| instants.iter().map(move |i| (site, i)))
            .collect();
        let samples: Vec<Sample> = pairs
            .into_par_iter()
            .map(|(site, instant)| Sample::new(site, instant, &overrides))
            .collect::<celaje::Result<_>>()?;
        Ok((instants, samples))
    })?;
    let table = PyDict::new(py);
    let (units, sources) = (PyDict::new(py), PyDict::new(py));
    if let (Some(site), Some(instant)) = (sites.first(), instants.first().and_then(|i| i.first())) {
        let first = climate::Conditions::at(site, instant, &overrides)?;
        check_names(&first)?;
        for row in first.rows() {
            units.set_item(row.key, row.condition.unit)?;
            sources.set_item(row.key, row.condition.source)?;
        }
    }
    table.set_item("unit", units)?;
    table.set_item("source", sources)?;
    let shape = [sites.len(), instants.first().map_or(0, Vec::len)];
    let grid = |values: Vec<f64>| values.into_pyarray(py).reshape(shape);
    let unix_s = instants.iter().flatten().map(Instant::unix_seconds);
    table.set_item("unix_s", grid(unix_s.collect())?)?;
    let latitudes: Vec<f64> = sites.iter().map(Site::latitude_deg).collect();
    let longitudes: Vec<f64> = sites.iter().map(Site::longitude_deg).collect();
    table.set_item("latitude_deg", latitudes.into_pyarray(py))?;
    table.set_item("longitude_deg", longitudes.into_pyarray(py))?;
    for (i, (name, _)) in NUMBERS.iter().enumerate() {
        table.set_item(name, grid(samples.iter().map(|s| s.numbers[i]).collect())?)?;
        let spread: Vec<f64> = samples.iter().map(|s| s.uncertainties[i]).collect();
        if spread.iter().any(|u| u.is_finite()) {
            table.set_item(format!("{name}_uncertainty"), grid(spread)?)?;
        }
    }
    for (i, (name, _)) in MOON.iter().enumerate() {
        table.set_item(name, grid(samples.iter().map(|s| s.moon[i]).collect())?)?;
    }
    for (i, (name, _)) in NAMES.iter().enumerate() {
        let names: Vec<&str> = samples.iter().map(|s| s.names[i].as_str()).collect();
        table.set_item(name, names)?;
    }
    Ok(table)
}
