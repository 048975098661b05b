//! Some pixels of another sensor, in any order, each with a stream of random numbers of its own.

use super::Sensor;
use crate::math::Vec3;

/// Streams of different numbers lie this far apart: more pixels than any film has.
const STREAM_STRIDE: u64 = 1 << 40;

/// A list of pixels of a sensor, in one row.
pub(crate) struct Selected<'a> {
    sensor: &'a dyn Sensor,
    /// Which pixel, and by which of its streams; stream 0 is the one that the sensor itself would give it.
    pixels: Vec<(usize, u32)>,
}

impl<'a> Selected<'a> {
    pub fn new(sensor: &'a dyn Sensor, pixels: Vec<(usize, u32)>) -> Self {
        Self { sensor, pixels }
    }
}

impl Sensor for Selected<'_> {
    fn size(&self) -> (usize, usize) {
        (self.pixels.len(), 1)
    }

    fn direction(&self, column: usize, _row: usize, u: f64, v: f64) -> Option<Vec3> {
        let (width, _) = self.sensor.size();
        let (pixel, _) = *self.pixels.get(column)?;
        self.sensor.direction(pixel % width, pixel / width, u, v)
    }

    fn stream(&self, pixel: usize) -> u64 {
        self.pixels.get(pixel).map_or(0, |&(pixel, stream)| {
            self.sensor.stream(pixel) + u64::from(stream) * STREAM_STRIDE
        })
    }
}
