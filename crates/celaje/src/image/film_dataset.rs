//! A film as arrays with CF metadata, for NetCDF.

use super::netcdf::{Dataset, Values, Variable};
use super::Metadata;
use crate::error::{Error, Result};
use crate::film::{Film, Polarisation};
use crate::place::Instant;
use crate::sensor::Sensor;

/// Version of the metadata conventions, <https://cfconventions.org>.
pub const CONVENTIONS: &str = "CF-1.11";

/// Unit of spectral radiance, in the words of UDUNITS.
const RADIANCE: &str = "W m-2 sr-1 nm-1";

/// What Q, U and V are measured against.
const STOKES_BASIS: &str =
    "basis (theta, phi, k): k is the direction in which light travels, theta points along \
    increasing zenith angle of k in its vertical plane, phi = k x theta";

/// A film and all that is known about it as a dataset.
///
/// | variable | dimensions | holds |
/// |---|---|---|
/// | `radiance`, `radiance_variance` | y, x, wavelength | as the film; NaN where the sensor sees nothing |
/// | `stokes_q`, `stokes_u`, `stokes_v` and their variances | the same | where they were solved for |
/// | `degree_of_linear_polarisation`, `angle_of_polarisation_deg` | the same | the same |
/// | `samples` | y, x | paths behind each pixel |
/// | `vza_deg`, `vaa_deg` | y, x | where the middle of a pixel looks, if the sensor is known |
/// | `sza_deg`, `saa_deg`, `latitude`, `longitude`, `time`, … | | what the metadata tell of sun, place and time |
///
/// All of the metadata are global attributes, `.` in their names replaced by `_`.
///
/// # Errors
/// [`Error::ShapeMismatch`] if the film's arrays do not agree.
pub(super) fn film_dataset<'a>(
    film: &'a Film,
    view: Option<&dyn Sensor>,
    metadata: &Metadata,
) -> Result<Dataset<'a>> {
    let (pixels, w) = (film.width * film.height, film.wavelength_nm.len());
    for (name, got, expected) in [
        ("film.radiance", film.radiance.len(), pixels * w),
        ("film.variance", film.variance.len(), pixels * w),
        ("film.samples", film.samples.len(), pixels),
    ] {
        check_length(name, got, expected)?;
    }
    if let Some(polarisation) = &film.polarisation {
        for plane in polarisation.planes() {
            for got in [plane.mean.len(), plane.variance.len()] {
                check_length("film.polarisation", got, pixels * w)?;
            }
        }
    }
    let cube = ["y", "x", "wavelength"];
    let seen = move |values: &'a [f32]| -> Values<'a> {
        Values::Singles(Box::new(move |i| match film.samples[i / w] {
            0 => f32::NAN,
            _ => values[i],
        }))
    };
    let mut radiance = Variable::new(
        "radiance",
        &cube,
        (RADIANCE, "spectral radiance"),
        seen(&film.radiance),
    );
    let variance = Variable::new(
        "radiance_variance",
        &cube,
        (
            &format!("({RADIANCE})2"),
            "variance of the mean spectral radiance, 0 for a method without noise",
        ),
        seen(&film.variance),
    );
    let samples: Vec<i32> = film
        .samples
        .iter()
        .map(|&n| n.try_into().unwrap_or(i32::MAX))
        .collect();
    let mut coordinates = circumstances(metadata);
    if let Some(sensor) = view.filter(|s| s.size() == (film.width, film.height)) {
        let (zenith_deg, azimuth_deg) = directions(sensor);
        // CF has a name for light that comes down and one for light that goes up, none for a picture of both.
        if zenith_deg.iter().all(|z| z.is_nan() || *z <= 90.0) {
            let name = "downwelling_radiance_per_unit_wavelength_in_air";
            radiance = radiance.with("standard_name", name);
        }
        let plane = ["y", "x"];
        coordinates.extend([
            Variable::doubles(
                "vza_deg",
                &plane,
                ("degree", "zenith angle looked at"),
                zenith_deg,
            ),
            Variable::doubles(
                "vaa_deg",
                &plane,
                ("degree", "azimuth looked at, clockwise from north"),
                azimuth_deg,
            ),
        ]);
    }
    let names: Vec<&str> = coordinates.iter().map(|v| v.name.as_str()).collect();
    let radiance = radiance
        .with("ancillary_variables", "radiance_variance samples")
        .with("coordinates", names.join(" "));
    let wavelength = Variable::doubles(
        "wavelength",
        &["wavelength"],
        ("nm", "vacuum wavelength"),
        film.wavelength_nm.as_slice(),
    )
    .with("standard_name", "radiation_wavelength");
    let samples = Variable::new(
        "samples",
        &["y", "x"],
        ("1", "paths per pixel"),
        Values::Integers(samples),
    );
    let mut variables = vec![wavelength];
    variables.append(&mut coordinates);
    variables.extend([samples, radiance, variance]);
    if let Some(polarisation) = &film.polarisation {
        for (name, plane) in Polarisation::NAMES.into_iter().zip(polarisation.planes()) {
            let meaning = format!("Stokes component {name} beside the radiance I");
            let lower = name.to_lowercase();
            variables.extend([
                Variable::new(
                    &format!("stokes_{lower}"),
                    &cube,
                    (RADIANCE, &meaning),
                    seen(&plane.mean),
                )
                .with("comment", STOKES_BASIS),
                Variable::new(
                    &format!("stokes_{lower}_variance"),
                    &cube,
                    (&format!("({RADIANCE})2"), "variance of its mean"),
                    seen(&plane.variance),
                ),
            ]);
        }
        let derived = move |of: fn(&Film, usize, usize) -> Option<f32>| -> Values<'a> {
            Values::Singles(Box::new(move |i| match film.samples[i / w] {
                0 => f32::NAN,
                _ => of(film, i / w, i % w).unwrap_or(f32::NAN),
            }))
        };
        variables.extend([
            Variable::new(
                "degree_of_linear_polarisation",
                &cube,
                (
                    "1",
                    "sqrt(Q2 + U2) / I, too large by noise where there is little",
                ),
                derived(Film::degree_of_polarisation),
            ),
            Variable::new(
                "angle_of_polarisation_deg",
                &cube,
                (
                    "degree",
                    "angle of the electric field from theta towards phi",
                ),
                derived(Film::angle_of_polarisation_deg),
            )
            .with("comment", STOKES_BASIS),
        ]);
    }
    Ok(Dataset {
        dimensions: vec![("y", film.height), ("x", film.width), ("wavelength", w)],
        attributes: global_attributes("Spectral radiance of the sky", metadata),
        variables,
    })
}

fn check_length(name: &str, got: usize, expected: usize) -> Result<()> {
    if got == expected {
        return Ok(());
    }
    Err(Error::ShapeMismatch {
        name: name.to_owned(),
        got: format!("({got},)"),
        expected: format!("({expected},)"),
    })
}

/// What every file of ours says of itself, and the metadata.
pub fn global_attributes(title: &str, metadata: &Metadata) -> super::netcdf::Attributes {
    let source = format!("celaje {}", env!("CARGO_PKG_VERSION"));
    let mut attributes = vec![
        ("Conventions".to_owned(), CONVENTIONS.into()),
        ("title".to_owned(), title.into()),
        ("source".to_owned(), source.into()),
    ];
    for (name, value) in metadata {
        if attributes.iter().all(|(n, _)| n != name) {
            attributes.push((name.clone(), value.as_str().into()));
        }
    }
    attributes
}

/// Place, time and sun as single values, as far as the metadata name them.
pub fn circumstances<'a>(metadata: &Metadata) -> Vec<Variable<'a>> {
    let text = |key: &str| metadata.iter().find(|(n, _)| n == key).map(|(_, v)| v);
    let number = |key: &str| text(key).and_then(|v| v.parse::<f64>().ok());
    let single = |name: &str, units: &str, long_name: &str, standard_name: &str, value: f64| {
        Variable::doubles(name, &[], (units, long_name), vec![value])
            .with("standard_name", standard_name)
    };
    let mut found = Vec::new();
    if let Some(elevation_deg) = number("sun_elevation_deg") {
        let name = "true zenith angle of the sun";
        let zenith_deg = 90.0 - elevation_deg;
        found.push(single(
            "sza_deg",
            "degree",
            name,
            "solar_zenith_angle",
            zenith_deg,
        ));
    }
    for (key, name, units, long_name, standard_name) in [
        (
            "sun_azimuth_deg",
            "saa_deg",
            "degree",
            "azimuth of the sun, clockwise from north",
            "solar_azimuth_angle",
        ),
        (
            "latitude_deg",
            "latitude",
            "degrees_north",
            "latitude",
            "latitude",
        ),
        (
            "longitude_deg",
            "longitude",
            "degrees_east",
            "longitude",
            "longitude",
        ),
        (
            "altitude_m",
            "ground_altitude_m",
            "m",
            "altitude of the ground",
            "surface_altitude",
        ),
        (
            "observer_altitude_m",
            "observer_altitude_m",
            "m",
            "altitude of the observer",
            "altitude",
        ),
    ] {
        if let Some(value) = number(key) {
            found.push(single(name, units, long_name, standard_name, value));
        }
    }
    let time = text("time").and_then(|t| t.parse::<Instant>().ok());
    if let Some(time) = time {
        let since = "seconds since 1970-01-01T00:00:00Z";
        let seconds = time.unix_seconds();
        found.push(single("time", since, "instant", "time", seconds).with("calendar", "standard"));
    }
    found
}

/// Zenith angle and azimuth of the middle of each pixel \[deg\]; NaN where the sensor sees nothing.
fn directions(sensor: &dyn Sensor) -> (Vec<f64>, Vec<f64>) {
    let (width, height) = sensor.size();
    let pixels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    pixels
        .map(
            |(column, row)| match sensor.direction(column, row, 0.5, 0.5) {
                Some(direction) => {
                    let (azimuth_deg, elevation_deg) = direction.to_azimuth_elevation_deg();
                    (90.0 - elevation_deg, azimuth_deg)
                }
                None => (f64::NAN, f64::NAN),
            },
        )
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::super::test_support::film;
    use super::*;
    use crate::sensor::{Fisheye, LatLong};

    fn metadata() -> Vec<(String, String)> {
        [
            ("sun_elevation_deg", "-4"),
            ("latitude_deg", "41.65"),
            ("time", "1970-01-02T00:00:00Z"),
            ("title", "mine"),
        ]
        .map(|(n, v)| (n.to_owned(), v.to_owned()))
        .to_vec()
    }

    fn attribute<'a>(
        variable: &'a Variable,
        name: &str,
    ) -> Option<&'a super::super::netcdf::Attribute> {
        let found = variable.attributes.iter().find(|(n, _)| n == name);
        found.map(|(_, value)| value)
    }

    #[test]
    fn a_film_has_values_angles_and_circumstances() {
        let film = film(4, 4, &[450.0, 550.0]);
        let sensor = Fisheye::new(4, 4, 180.0).unwrap();
        let dataset = film_dataset(&film, Some(&sensor), &metadata()).unwrap();
        let find = |name: &str| dataset.variables.iter().find(|v| v.name == name).unwrap();
        let Values::Singles(radiance) = &find("radiance").values else {
            panic!("radiance is single");
        };
        // The first pixel is not seen.
        assert!(radiance(1).is_nan());
        assert_eq!(radiance(5), film.radiance[5]);
        let Values::Doubles(sza) = &find("sza_deg").values else {
            panic!("sza is double");
        };
        assert_eq!(sza[0], 94.0);
        let Values::Doubles(time) = &find("time").values else {
            panic!("time is double");
        };
        assert_eq!(time[0], 86_400.0);
        let coordinates = attribute(find("radiance"), "coordinates").unwrap();
        assert_eq!(*coordinates, "sza_deg latitude time vza_deg vaa_deg".into());
        assert!(attribute(find("radiance"), "standard_name").is_some());
        // A name that is taken stays ours.
        let titles = dataset.attributes.iter().filter(|(n, _)| n == "title");
        assert_eq!(titles.count(), 1);
    }

    #[test]
    fn a_picture_that_looks_down_as_well_has_no_standard_name() {
        let film = film(4, 2, &[550.0]);
        let sensor = LatLong::new(4, 2).unwrap();
        let dataset = film_dataset(&film, Some(&sensor), &[]).unwrap();
        let radiance = dataset
            .variables
            .iter()
            .find(|v| v.name == "radiance")
            .unwrap();
        assert!(attribute(radiance, "standard_name").is_none());
    }
}
