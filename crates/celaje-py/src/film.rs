//! Spectral radiance per pixel to colours and files.
//!
//! A film lives in Python as arrays, so that a user may change them; here it is put together again.

use std::path::PathBuf;

use celaje::colour::{ColourImage, Exposure, Look, Observer, ToneCurve};
use celaje::film::{Plane, Polarisation};
use celaje::{image, Film};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::error::Outcome;
use crate::sensor::Sensor;

/// Means and variances of Q, U, V, each of the radiance's shape; nothing of a film of scalar light.
pub type StokesArrays<'py> = Option<Vec<[Bound<'py, PyArray3<f32>>; 2]>>;

/// The same, coming in.
type ReadonlyStokes<'py> = Option<Vec<[PyReadonlyArray3<'py, f32>; 2]>>;

/// Polarisation as arrays.
pub fn stokes_arrays(
    py: Python<'_>,
    polarisation: Option<Polarisation>,
    shape: [usize; 3],
) -> Outcome<StokesArrays<'_>> {
    let Some(p) = polarisation else {
        return Ok(None);
    };
    let arrays = [p.q, p.u, p.v].into_iter().map(|plane| {
        let mean = plane.mean.into_pyarray(py).reshape(shape)?;
        Ok([mean, plane.variance.into_pyarray(py).reshape(shape)?])
    });
    Ok(Some(arrays.collect::<Outcome<Vec<_>>>()?))
}

fn polarisation(stokes: &ReadonlyStokes<'_>) -> Outcome<Option<Polarisation>> {
    let Some(planes) = stokes else {
        return Ok(None);
    };
    let planes = planes.iter().map(|[mean, variance]| {
        Ok(Plane {
            mean: mean.as_slice()?.to_vec(),
            variance: variance.as_slice()?.to_vec(),
        })
    });
    let planes: [Plane; 3] = planes
        .collect::<Outcome<Vec<_>>>()?
        .try_into()
        .map_err(|_| {
            celaje::Error::invalid("polarisation is not Q, U and V", "give all three, or none")
        })?;
    let [q, u, v] = planes;
    Ok(Some(Polarisation { q, u, v }))
}

/// The film of some arrays; their shapes are checked by whatever is then done with it.
fn film(
    radiance: &PyReadonlyArray3<'_, f32>,
    variance: Option<&PyReadonlyArray3<'_, f32>>,
    samples: &PyReadonlyArray2<'_, u32>,
    wavelength_nm: &PyReadonlyArray1<'_, f64>,
    stokes: &ReadonlyStokes<'_>,
) -> Outcome<Film> {
    let (height, width) = (radiance.shape()[0], radiance.shape()[1]);
    Ok(Film {
        width,
        height,
        wavelength_nm: wavelength_nm.as_slice()?.to_vec(),
        samples: samples.as_slice()?.to_vec(),
        radiance: radiance.as_slice()?.to_vec(),
        variance: match variance {
            Some(variance) => variance.as_slice()?.to_vec(),
            None => Vec::new(),
        },
        polarisation: polarisation(stokes)?,
    })
}

fn look(observer: &str, tone: &str, exposure: Option<f64>) -> celaje::Result<Look> {
    Ok(Look {
        observer: Observer::by_name(observer)?,
        tone: ToneCurve::by_name(tone)?,
        exposure: exposure.map_or(Exposure::Auto, Exposure::Ev),
    })
}

fn pixels<'py, const N: usize>(
    py: Python<'py>,
    film: &Film,
    values: Vec<[f32; N]>,
) -> Outcome<Bound<'py, PyArray3<f32>>> {
    let flat = values.into_flattened().into_pyarray(py);
    Ok(flat.reshape([film.height, film.width, N])?)
}

/// What a display shows, RGBA in [0, 1], shape (height, width, 4).
#[pyfunction]
pub fn develop<'py>(
    py: Python<'py>,
    radiance: PyReadonlyArray3<'py, f32>,
    samples: PyReadonlyArray2<'py, u32>,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
    observer: &str,
    tone: &str,
    exposure: Option<f64>,
) -> Outcome<Bound<'py, PyArray3<f32>>> {
    let film = film(&radiance, None, &samples, &wavelength_nm, &None)?;
    let look = look(observer, tone, exposure)?;
    let colours = ColourImage::from_film(&film, look.observer)?;
    pixels(py, &film, colours.display(look.tone, look.exposure)?)
}

/// Linear sRGB \[cd m⁻²\], shape (height, width, 3).
#[pyfunction]
pub fn linear_srgb<'py>(
    py: Python<'py>,
    radiance: PyReadonlyArray3<'py, f32>,
    samples: PyReadonlyArray2<'py, u32>,
    wavelength_nm: PyReadonlyArray1<'py, f64>,
    observer: &str,
) -> Outcome<Bound<'py, PyArray3<f32>>> {
    let film = film(&radiance, None, &samples, &wavelength_nm, &None)?;
    let colours = ColourImage::from_film(&film, Observer::by_name(observer)?)?;
    pixels(py, &film, colours.rgb)
}

/// Writes the film in the format that the extension names.
#[pyfunction]
pub fn save(
    py: Python<'_>,
    path: PathBuf,
    radiance: PyReadonlyArray3<'_, f32>,
    variance: PyReadonlyArray3<'_, f32>,
    samples: PyReadonlyArray2<'_, u32>,
    wavelength_nm: PyReadonlyArray1<'_, f64>,
    observer: &str,
    tone: &str,
    exposure: Option<f64>,
    view: Option<&Sensor>,
    metadata: Vec<(String, String)>,
    stokes: ReadonlyStokes<'_>,
) -> Outcome<()> {
    image::check_target(&path)?;
    let film = film(
        &radiance,
        Some(&variance),
        &samples,
        &wavelength_nm,
        &stokes,
    )?;
    let look = look(observer, tone, exposure)?;
    let view = view.map(|s| s.inner.as_ref() as &dyn celaje::sensor::Sensor);
    Ok(py.detach(|| image::save(&path, &film, &look, view, &metadata))?)
}

/// Radiance, variance, samples, wavelengths \[nm\], what is said of a film, and its polarisation.
type Parts<'py> = (
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray1<f64>>,
    Vec<(String, String)>,
    StokesArrays<'py>,
);

fn parts(py: Python<'_>, (film, said): image::Described) -> Outcome<Parts<'_>> {
    let shape = [film.height, film.width, film.wavelength_nm.len()];
    let samples = film.samples.into_pyarray(py);
    Ok((
        film.radiance.into_pyarray(py).reshape(shape)?,
        film.variance.into_pyarray(py).reshape(shape)?,
        samples.reshape([film.height, film.width])?,
        film.wavelength_nm.into_pyarray(py),
        said,
        stokes_arrays(py, film.polarisation, shape)?,
    ))
}

/// Reads an EXR that celaje has written.
#[pyfunction]
pub fn read_exr(py: Python<'_>, path: PathBuf) -> Outcome<Parts<'_>> {
    let (film, mut said) = py.detach(|| image::read_exr(&path))?;
    // A file is written for an observer; a film is for all.
    said.retain(|(name, _)| name != "observer");
    parts(py, (film, said))
}

/// One film of the parts of several.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn merged<'py>(
    py: Python<'py>,
    films: Vec<(
        PyReadonlyArray3<'py, f32>,
        PyReadonlyArray3<'py, f32>,
        PyReadonlyArray2<'py, u32>,
        PyReadonlyArray1<'py, f64>,
        Vec<(String, String)>,
        ReadonlyStokes<'py>,
    )>,
) -> Outcome<Parts<'py>> {
    let films = films
        .into_iter()
        .map(|(radiance, variance, samples, nm, said, stokes)| {
            let film = film(&radiance, Some(&variance), &samples, &nm, &stokes)?;
            Ok((film, said))
        });
    let films = films.collect::<Outcome<Vec<_>>>()?;
    let merged = py.detach(|| image::merged(films))?;
    parts(py, merged)
}
