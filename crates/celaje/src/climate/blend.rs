//! Small pieces of smooth interpolation in place and season.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::place::Instant;

/// Weight of July against January, a cosine through the year: 0 in mid-January, 1 in mid-July \[1\].
pub(super) fn july_weight(instant: &Instant) -> f64 {
    let phase = instant.month_position() / 12.0 * std::f64::consts::TAU;
    0.5 * (1.0 - phase.cos())
}

/// The two months between whose middles an instant lies (0 to 11), and the weight of the second.
pub(super) fn months(instant: &Instant) -> (usize, usize, f64) {
    let position = instant.month_position().rem_euclid(12.0);
    let first = (position as usize).min(11);
    (first, (first + 1) % 12, position - first as f64)
}

/// `3t² − 2t³` between `from` and `to`, 0 before and 1 behind.
pub(super) fn smoothstep(from: f64, to: f64, at: f64) -> f64 {
    let t = ((at - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A global latitude-longitude grid of equal steps.
#[derive(Debug, Clone, Copy)]
pub(super) struct GlobeGrid {
    /// Step in both directions \[deg\].
    pub step_deg: f64,
    /// Latitude of the first row \[deg\].
    pub first_latitude_deg: f64,
    /// 1 if latitudes increase with the row, −1 if they decrease.
    pub direction: f64,
    /// Longitude of the first column \[deg\].
    pub first_longitude_deg: f64,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns, once around the globe.
    pub columns: usize,
}

impl GlobeGrid {
    /// Row and column, with fractions, of a place.
    fn position(&self, latitude_deg: f64, longitude_deg: f64) -> (f64, f64) {
        let row = (latitude_deg - self.first_latitude_deg) * self.direction / self.step_deg;
        let column = (longitude_deg - self.first_longitude_deg) / self.step_deg;
        (row, column.rem_euclid(self.columns as f64))
    }

    /// The four nodes around a place with their bilinear weights, as indices into rows times columns.
    ///
    /// Rows are held beyond the first and the last one; columns go around the globe.
    pub fn corners(&self, latitude_deg: f64, longitude_deg: f64) -> [(usize, f64); 4] {
        let (row, column) = self.position(latitude_deg, longitude_deg);
        let row = row.clamp(0.0, (self.rows - 1) as f64);
        let r = (row as usize).min(self.rows - 2);
        let c = (column as usize).min(self.columns - 1);
        let (v, u) = (row - r as f64, column - c as f64);
        let next = (c + 1) % self.columns;
        let at = |r: usize, c: usize| r * self.columns + c;
        [
            (at(r, c), (1.0 - v) * (1.0 - u)),
            (at(r, next), (1.0 - v) * u),
            (at(r + 1, c), v * (1.0 - u)),
            (at(r + 1, next), v * u),
        ]
    }

    /// Nodes within `half_width_deg` of a place in latitude and in longitude, under a pyramid of weights that sum to 1.
    ///
    /// Its means of a map of classes are continuous: a border is spread over twice the half-width. The half-width must
    /// be larger than a step.
    pub fn pyramid(
        &self,
        latitude_deg: f64,
        longitude_deg: f64,
        half_width_deg: f64,
    ) -> Vec<(usize, f64)> {
        let (row, column) = self.position(latitude_deg, longitude_deg);
        let half = half_width_deg / self.step_deg;
        let (r_from, r_to) = ((row - half).ceil() as i64, (row + half).floor() as i64);
        let (c_from, c_to) = (
            (column - half).ceil() as i64,
            (column + half).floor() as i64,
        );
        let mut nodes = Vec::with_capacity(((r_to - r_from + 1) * (c_to - c_from + 1)) as usize);
        let mut sum = 0.0;
        for r in r_from..=r_to {
            // Rows beyond a pole count as the last one, so that the weights stay smooth.
            let held = r.clamp(0, self.rows as i64 - 1) as usize;
            let v = 1.0 - (r as f64 - row).abs() / half;
            for c in c_from..=c_to {
                let weight = v * (1.0 - (c as f64 - column).abs() / half);
                let around = c.rem_euclid(self.columns as i64) as usize;
                sum += weight;
                nodes.push((held * self.columns + around, weight));
            }
        }
        nodes.iter_mut().for_each(|(_, weight)| *weight /= sum);
        nodes
    }
}

/// A table that is read once and kept.
pub(super) fn cached<T>(
    cell: &'static OnceLock<Result<T>>,
    load: fn() -> Result<T>,
) -> Result<&'static T> {
    cell.get_or_init(load).as_ref().map_err(Clone::clone)
}

/// What is said of an embedded table that cannot be right.
pub(super) fn damaged(name: &str) -> Error {
    Error::invalid(
        format!("the embedded table {name} is damaged"),
        "restore the table as it was shipped and build again",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: GlobeGrid = GlobeGrid {
        step_deg: 1.0,
        first_latitude_deg: 89.5,
        direction: -1.0,
        first_longitude_deg: -179.5,
        rows: 180,
        columns: 360,
    };

    #[test]
    fn weights_sum_to_one_and_meet_the_nodes() {
        for (lat, lon) in [(0.0, 0.0), (90.0, 180.0), (-90.0, -180.0), (12.3, 179.9)] {
            let sum: f64 = GRID.corners(lat, lon).iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            let sum: f64 = GRID.pyramid(lat, lon, 2.5).iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
        let (node, weight) = GRID.corners(89.5, -179.5)[0];
        assert_eq!((node, weight), (0, 1.0));
        // The last column and the first one meet at the date line.
        let across = GRID.corners(0.5, 180.0);
        assert_eq!(across[0].0 % 360, 359);
        assert_eq!(across[1].0 % 360, 0);
        assert_eq!(across[1].1, 0.5);
    }

    #[test]
    fn seasons_turn_smoothly() {
        let at = |text: &str| july_weight(&text.parse().unwrap());
        assert!(at("2021-01-16T12:00Z").abs() < 1e-12);
        assert!((at("2021-07-16T12:00Z") - 1.0).abs() < 1e-12);
        let year_end = at("2020-12-31T23:59:59Z") - at("2021-01-01T00:00:01Z");
        assert!(year_end.abs() < 1e-6);
    }
}
