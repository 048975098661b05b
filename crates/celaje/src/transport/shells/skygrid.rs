//! The sky of one observer and sun on a grid of directions, for pictures of many pixels.
//!
//! What is tabulated is smooth: the line integrals of single scattering without their phase functions, and multiple
//! scattering. The phase functions, with all their peaks, are multiplied on at each pixel. Elevations are halved until the
//! cubics between them are as good as asked for; azimuths are counted from the sun's and mirrored at its vertical plane.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::along::Target;
use super::azimuths::EveryOther;
use super::gather::{combine, gather_row, Gatherer, RayWorker};
use crate::error::{Error, Result};
use crate::math::interp::Cubic;
use crate::math::Vec3;
use crate::medium::{Medium, Ray};

/// How far from an edge its rows stand \[rad\].
const EDGE_RAD: f64 = 1e-9;

/// Elevations are not cut finer than this \[rad\].
const NARROWEST_RAD: f64 = 2e-5;

/// Azimuths at which rows are compared: every so many.
const CHECKED: usize = 4;

/// Parts of the radiance over elevation and azimuth from the sun.
pub struct SkyGrid {
    /// Below the horizon and above it; none where nothing is looked at.
    segments: [Option<Segment>; 2],
    /// Elevation of the horizon \[rad\].
    horizon: f64,
    /// Intervals from the sun's azimuth to the opposite one.
    azimuths: usize,
    /// Horizontal unit vector towards the sun.
    towards: (f64, f64),
    /// Values of one direction: (species + components) × lanes.
    width: usize,
    /// Of these, how many at the end are odd about the sun's plane: U.
    odd: usize,
}

/// A range of elevations without an edge inside: the sky, the ground.
struct Segment {
    /// Lowest and highest elevation \[rad\].
    range: (f64, f64),
    elevations: Cubic,
    /// Shape (elevation, azimuth, width).
    parts: Vec<f32>,
}

/// An elevation and what is seen there in all azimuths.
type Row = (f64, Vec<f32>);

impl SkyGrid {
    /// Computes the sky around an observer, as far as it is looked at.
    ///
    /// # Errors
    /// [`Error::Interrupted`].
    pub fn new(
        gatherer: &Gatherer<'_>,
        observer_m: f64,
        looks: impl Iterator<Item = Vec3>,
        cancel: &AtomicBool,
    ) -> Result<Self> {
        let medium = &gatherer.tables.medium;
        let resolution = gatherer.tables.accuracy.resolution();
        let sun = gatherer.sun.direction;
        let across = sun.x.hypot(sun.y);
        let dip = |radius_m: f64| -(radius_m / observer_m).min(1.0).acos();
        let mut grid = Self {
            segments: [None, None],
            horizon: dip(medium.ground_radius_m()),
            azimuths: resolution.view_azimuths,
            towards: if across > 0.0 {
                (sun.x / across, sun.y / across)
            } else {
                (0.0, 1.0)
            },
            width: gatherer.parts(),
            odd: if gatherer.stokes { medium.lanes() } else { 0 },
        };
        // From above the air, the sky ends at its limb.
        let end = if observer_m > medium.top_radius_m() {
            dip(medium.top_radius_m())
        } else {
            FRAC_PI_2
        };
        let builder = Builder {
            gatherer,
            grid: &grid,
            observer_m,
            tolerance: resolution.view_tolerance,
            most_rows: resolution.view_rows,
            every_other: EveryOther::new(resolution.view_azimuths),
            cancel,
        };
        let mut seen = [false; 2];
        for look in looks {
            seen[grid.side(elevation(look))] = true;
            if seen == [true; 2] {
                break;
            }
        }
        let below = || builder.segment(grid.horizon - EDGE_RAD, -FRAC_PI_2, 8);
        let above = || builder.segment(grid.horizon + EDGE_RAD, end - EDGE_RAD, 16);
        let segments = [
            seen[0].then(below).transpose()?,
            seen[1].then(above).transpose()?,
        ];
        grid.segments = segments;
        Ok(grid)
    }

    /// Which of the segments holds an elevation.
    #[inline(always)]
    fn side(&self, elevation: f64) -> usize {
        usize::from(elevation > self.horizon)
    }

    /// The parts of the radiance in a direction.
    #[inline(always)]
    pub fn interpolate(&self, direction: Vec3, parts: &mut [f32]) {
        parts.fill(0.0);
        let elevation = elevation(direction);
        let Some(segment) = &self.segments[self.side(elevation)] else {
            return;
        };
        if elevation > segment.range.1 + 2.0 * EDGE_RAD {
            return;
        }
        let (first, weights) = segment.elevations.at(elevation);
        let across = direction.x.hypot(direction.y);
        let cos_phi = if across > 0.0 {
            (direction.x * self.towards.0 + direction.y * self.towards.1) / across
        } else {
            1.0
        };
        let turn = cos_phi.clamp(-1.0, 1.0).acos() / PI * self.azimuths as f64;
        let cell = (turn as usize).min(self.azimuths - 1);
        let x = (turn - cell as f64) as f32;
        let around = [
            -x * (x - 1.0) * (x - 2.0) / 6.0,
            (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
            -(x + 1.0) * x * (x - 2.0) / 2.0,
            (x + 1.0) * x * (x - 1.0) / 6.0,
        ];
        let last = self.azimuths;
        // Mirrored at both ends.
        let columns = [
            cell.abs_diff(1).min(if cell == 0 { 1 } else { last }),
            cell,
            cell + 1,
            if cell + 2 > last { last - 1 } else { cell + 2 },
        ];
        let stride = (last + 1) * self.width;
        for (k, w) in weights.into_iter().enumerate().filter(|(_, w)| *w != 0.0) {
            let row = &segment.parts[(first + k) * stride..(first + k + 1) * stride];
            let column = |i: usize| &row[columns[i] * self.width..(columns[i] + 1) * self.width];
            let w = around.map(|a| a * w);
            let (c0, c1, c2, c3) = (column(0), column(1), column(2), column(3));
            let mut add = |range: std::ops::Range<usize>, w: [f32; 4]| {
                for i in range {
                    parts[i] += w[0] * c0[i] + w[1] * c1[i] + w[2] * c2[i] + w[3] * c3[i];
                }
            };
            let even = self.width - self.odd;
            add(0..even, w);
            if self.odd > 0 {
                let low = if cell == 0 { -w[0] } else { w[0] };
                let high = if cell + 2 > last { -w[3] } else { w[3] };
                add(even..self.width, [low, w[1], w[2], high]);
            }
        }
    }
}

/// Elevation of a direction \[rad\].
#[inline(always)]
fn elevation(direction: Vec3) -> f64 {
    direction.z.atan2(direction.x.hypot(direction.y))
}

/// What rows are made with.
struct Builder<'a> {
    gatherer: &'a Gatherer<'a>,
    grid: &'a SkyGrid,
    observer_m: f64,
    tolerance: f32,
    most_rows: usize,
    every_other: EveryOther,
    cancel: &'a AtomicBool,
}

impl Builder<'_> {
    /// A segment from an edge, about which rows are dense, to an end.
    ///
    /// Halving stops at the next round once there are `most_rows`: at the edge of the Earth's shadow the line integrals have ripples of 4·10⁻⁴,
    /// which no number of rows gets rid of.
    fn segment(&self, edge: f64, end: f64, intervals: usize) -> Result<Segment> {
        let mut elevations: Vec<f64> = (0..=intervals)
            .map(|i| edge + (end - edge) * (i as f64 / intervals as f64).powi(2))
            .collect();
        elevations.sort_by(f64::total_cmp);
        let mut rows = self.rows(&elevations)?;
        // Lower ends of the intervals to be halved.
        let mut open: Vec<f64> = elevations[..intervals].to_vec();
        while !open.is_empty() && rows.len() < self.most_rows {
            let middles: Vec<f64> = open
                .iter()
                .filter_map(|&low| {
                    let next = rows.partition_point(|r| r.0 <= low);
                    let high = rows.get(next)?.0;
                    (high - low > NARROWEST_RAD).then_some(0.5 * (low + high))
                })
                .collect();
            let found = self.rows(&middles)?;
            let cubic = Cubic::new(&rows.iter().map(|r| r.0).collect::<Vec<_>>());
            let off: Vec<bool> = found
                .par_iter()
                .map(|row| self.error(&cubic, &rows, row) > self.tolerance)
                .collect();
            open.clear();
            for ((elevation, _), _) in found.iter().zip(&off).filter(|(_, &off)| off) {
                let next = rows.partition_point(|r| r.0 < *elevation);
                open.push(rows[next - 1].0);
                open.push(*elevation);
            }
            rows.extend(found);
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let elevations: Vec<f64> = rows.iter().map(|r| r.0).collect();
        Ok(Segment {
            range: (elevations[0], elevations[elevations.len() - 1]),
            elevations: Cubic::new(&elevations),
            parts: rows.into_iter().flat_map(|r| r.1).collect(),
        })
    }

    /// The line integrals at some elevations.
    fn rows(&self, elevations: &[f64]) -> Result<Vec<Row>> {
        elevations
            .par_iter()
            .map_init(
                || RayWorker::new(self.gatherer),
                |worker, &elevation| {
                    if self.cancel.load(Ordering::Relaxed) {
                        return Err(Error::Interrupted);
                    }
                    let direction = Vec3::new(elevation.cos(), 0.0, elevation.sin());
                    let ray = Ray {
                        origin: Vec3::new(0.0, 0.0, self.observer_m),
                        direction,
                    };
                    let targets: Vec<Target> = (0..=self.grid.azimuths)
                        .map(|j| Target {
                            cos_sun: self.gatherer.sun.direction.z,
                            cos_theta: self.cos_theta(elevation, j),
                        })
                        .collect();
                    let mut parts = vec![0.0; targets.len() * self.grid.width];
                    gather_row(worker, &ray, &targets, &self.every_other, &mut parts);
                    Ok((elevation, parts))
                },
            )
            .collect()
    }

    /// Cosine of the angle between the sun and a direction of the grid.
    fn cos_theta(&self, elevation: f64, azimuth: usize) -> f64 {
        let sun = self.gatherer.sun.direction;
        let phi = PI * azimuth as f64 / self.grid.azimuths as f64;
        elevation.sin() * sun.z + elevation.cos() * sun.x.hypot(sun.y) * phi.cos()
    }

    /// Largest relative error of the radiance that cubics between `rows` make at another row.
    fn error(&self, cubic: &Cubic, rows: &[Row], (elevation, exact): &Row) -> f32 {
        let medium = &self.gatherer.tables.medium;
        let (n, w) = (medium.lanes(), medium.wavelength_nm().len());
        let width = self.grid.width;
        let mut phases = vec![0.0; n * medium.phases().len()];
        let mut guess = vec![0.0; width];
        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
        let ones = vec![1.0; n];
        let (first, weights) = cubic.at(*elevation);
        let mut worst = 0.0f32;
        for j in (0..=self.grid.azimuths).step_by(CHECKED) {
            let at = j * width..(j + 1) * width;
            guess.fill(0.0);
            for (k, &weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
                for (g, &v) in guess.iter_mut().zip(&rows[first + k].1[at.clone()]) {
                    *g += weight * v;
                }
            }
            let cos_theta = self.cos_theta(*elevation, j);
            for (row, phase) in phases.chunks_exact_mut(n).zip(medium.phases()) {
                phase.eval(cos_theta, row);
            }
            combine(&phases, &guess, &ones, &mut a);
            combine(&phases, &exact[at.clone()], &ones, &mut b);
            let mean = b[..w].iter().sum::<f32>() / w as f32;
            for (a, b) in a[..w].iter().zip(&b[..w]) {
                if mean > 0.0 {
                    worst = worst.max((a - b).abs() / (b + 0.01 * mean));
                }
            }
            // Q and U against the radiance.
            let from = phases.len() + n;
            let components = guess[from..].chunks_exact(n);
            for (guess, exact) in components.zip(exact[at][from..].chunks_exact(n)) {
                for ((g, e), b) in guess[..w].iter().zip(exact).zip(&b) {
                    if mean > 0.0 {
                        worst = worst.max((g - e).abs() / (b + 0.01 * mean));
                    }
                }
            }
        }
        worst
    }
}
