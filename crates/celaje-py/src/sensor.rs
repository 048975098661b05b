//! Which direction each pixel looks in.

use celaje::sensor::{self, Directions, Fisheye, LatLong, Perspective};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::error::Outcome;

/// A projection of the sky onto pixels, or a list of directions.
#[pyclass(frozen, module = "celaje._core")]
pub struct Sensor {
    pub inner: Box<dyn sensor::Sensor + Send>,
}

impl Sensor {
    fn of(sensor: impl sensor::Sensor + Send + 'static) -> Self {
        Self {
            inner: Box::new(sensor),
        }
    }
}

#[pymethods]
impl Sensor {
    #[staticmethod]
    fn fisheye(width: usize, height: usize, fov_deg: f64) -> Outcome<Self> {
        Ok(Self::of(Fisheye::new(width, height, fov_deg)?))
    }

    #[staticmethod]
    fn latlong(width: usize, height: usize) -> Outcome<Self> {
        Ok(Self::of(LatLong::new(width, height)?))
    }

    #[staticmethod]
    fn perspective(
        width: usize,
        height: usize,
        fov_deg: f64,
        azimuth_deg: f64,
        elevation_deg: f64,
    ) -> Outcome<Self> {
        let camera = Perspective::new(width, height, fov_deg, azimuth_deg, elevation_deg)?;
        Ok(Self::of(camera))
    }

    #[staticmethod]
    fn directions(
        azimuth_deg: PyReadonlyArray1<'_, f64>,
        elevation_deg: PyReadonlyArray1<'_, f64>,
    ) -> Outcome<Self> {
        let list = Directions::new(azimuth_deg.as_slice()?, elevation_deg.as_slice()?)?;
        Ok(Self::of(list))
    }

    /// Names and values to keep beside the picture.
    fn description(&self) -> Vec<(String, String)> {
        self.inner.description()
    }

    /// Azimuth and elevation \[deg\] of the middle of each pixel, shape (height, width); NaN where nothing is seen.
    #[allow(clippy::type_complexity)]
    fn pixel_centres<'py>(
        &self,
        py: Python<'py>,
    ) -> Outcome<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let (width, height) = self.inner.size();
        let angles = (0..width * height).map(|pixel| {
            let seen = self.inner.direction(pixel % width, pixel / width, 0.5, 0.5);
            seen.map_or((f64::NAN, f64::NAN), |d| d.to_azimuth_elevation_deg())
        });
        let (azimuth_deg, elevation_deg): (Vec<f64>, Vec<f64>) = angles.unzip();
        Ok((
            azimuth_deg.into_pyarray(py).reshape([height, width])?,
            elevation_deg.into_pyarray(py).reshape([height, width])?,
        ))
    }
}
