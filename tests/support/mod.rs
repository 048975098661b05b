//! What several test suites need: reading tables, a list of directions as a sensor, batches of renders.

#![allow(dead_code)]

pub mod peer;

use std::sync::atomic::AtomicBool;

use celaje::math::Vec3;
use celaje::medium::Medium;
use celaje::sensor::Sensor;
use celaje::transport::{Budget, Control, Integrator, Observer, Scene};
use celaje::Film;

/// Rows of a CSV text whose lines starting with `#` are comments and whose first other line is a header.
pub fn csv_rows(text: &str) -> Vec<Vec<&str>> {
    let lines = text
        .lines()
        .filter(|l| !l.starts_with('#') && !l.trim().is_empty());
    lines.skip(1).map(|l| l.split(',').collect()).collect()
}

/// Looks in each of a list of directions, one pixel each.
pub struct Looks(pub Vec<Vec3>);

impl Sensor for Looks {
    fn size(&self) -> (usize, usize) {
        (self.0.len(), 1)
    }

    fn direction(&self, column: usize, _row: usize, _u: f64, _v: f64) -> Option<Vec3> {
        Some(self.0[column])
    }
}

/// How a test renders: paths per direction and batch, and the orders counted.
#[derive(Clone, Copy)]
pub struct Job {
    pub seed: u64,
    pub batches: usize,
    pub spp: u32,
    pub max_order: Option<u32>,
}

/// Batch means of spectral radiance, one film per batch, each with a seed of its own.
pub fn batches<M: Medium>(
    integrator: &dyn Integrator<M>,
    scene: &Scene<'_, M>,
    observer_radius_m: f64,
    looks: &[Vec3],
    job: Job,
) -> Vec<Film> {
    let sensor = Looks(looks.to_vec());
    let observer = Observer {
        radius_m: observer_radius_m,
        sun_disc: false,
    };
    let cancel = AtomicBool::new(false);
    (0..job.batches)
        .map(|b| {
            let budget = Budget {
                spp: job.spp,
                seed: job.seed.wrapping_add(b as u64),
                max_order: job.max_order,
            };
            let control = Control {
                budget,
                cancel: &cancel,
                progress: &|_, _| {},
            };
            integrator
                .render(scene, &observer, &sensor, &control)
                .unwrap()
        })
        .collect()
}

/// One value of every film: the batch means of a direction and a wavelength.
pub fn value(films: &[Film], direction: usize, lane: usize) -> Vec<f64> {
    films
        .iter()
        .map(|f| f64::from(f.spectrum(direction)[lane]))
        .collect()
}
