//! How much ozone is overhead: climatologies of the total column.

use std::sync::OnceLock;

use super::blend::{cached, damaged, months};
use super::words::degrees_north;
use crate::error::{check_range, Error, Result};
use crate::math::interp::interval;
use crate::math::Table;
use crate::place::Instant;

/// Range of ozone columns taken as sane \[DU\]: the lowest ever measured is near 73, the highest near 760.
pub const OZONE_RANGE_DU: std::ops::RangeInclusive<f64> = 0.0..=1000.0;

/// Which climatology the ozone column is taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OzoneClimate {
    /// NOAA SBUV satellites, zonal monthly means of 1998–2015.
    #[default]
    Sbuv,
    /// Van Heuklon 1979, a formula in latitude, longitude and day; up to 160 DU off, before the ozone hole.
    VanHeuklon,
    /// Arosa, 47° N, monthly means of 45 years (Dütsch 1974); used at any latitude as it stands.
    Arosa,
}

/// Rms deviation of Van Heuklon's formula from the SBUV table over all zones and months \[DU\].
const VAN_HEUKLON_RMS_DU: f64 = 25.0;

/// A column and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct OzoneColumn {
    /// Total column \[DU\].
    pub du: f64,
    /// Standard deviation of a month's mean between years \[DU\]; of the formula: its rms deviation from the satellites.
    pub deviation_du: Option<f64>,
    /// Citation.
    pub source: &'static str,
    /// What was done to get it, in words.
    pub reason: String,
}

impl OzoneClimate {
    /// All climatologies, the default first.
    pub const ALL: [Self; 3] = [Self::Sbuv, Self::VanHeuklon, Self::Arosa];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sbuv => "sbuv",
            Self::VanHeuklon => "van-heuklon",
            Self::Arosa => "arosa",
        }
    }

    /// The climatology of that name.
    ///
    /// # Errors
    /// [`Error::UnknownName`] with the names there are.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|c| c.name() == name);
        found.ok_or_else(|| Error::UnknownName {
            kind: "ozone climatology",
            name: name.to_owned(),
            known: Self::ALL.map(|c| c.name().to_owned()).to_vec(),
        })
    }

    /// Total ozone over a place at an instant.
    ///
    /// `latitude_deg` −90 to 90, `longitude_deg` −180 to 180 (only Van Heuklon's formula asks for it).
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Invalid`] if an embedded table is damaged.
    pub fn column(
        self,
        latitude_deg: f64,
        longitude_deg: f64,
        instant: &Instant,
    ) -> Result<OzoneColumn> {
        check_range("latitude", latitude_deg, "deg", -90.0..=90.0)?;
        check_range("longitude", longitude_deg, "deg", -180.0..=180.0)?;
        match self {
            Self::Sbuv => sbuv(latitude_deg, instant),
            Self::VanHeuklon => Ok(OzoneColumn {
                du: van_heuklon_du(latitude_deg, longitude_deg, instant.day_of_year()),
                deviation_du: Some(VAN_HEUKLON_RMS_DU),
                source: "Van Heuklon 1979, doi:10.1016/0038-092X(79)90060-4",
                reason: format!(
                    "formula at {latitude_deg:.2}° N, {longitude_deg:.2}° E, day {:.0}",
                    instant.day_of_year().floor()
                ),
            }),
            Self::Arosa => arosa(instant),
        }
    }
}

/// Zonal means: 12 months of each of 36 zones, from south to north.
struct Zones {
    latitude_deg: Vec<f64>,
    ozone_du: Vec<[f64; 12]>,
    deviation_du: Vec<[f64; 12]>,
    measured: Vec<[bool; 12]>,
}

/// Cubic through zone centres (held beyond ±87.5°) and through mid-months (Catmull & Rom), so that neither value nor
/// slope jumps.
fn sbuv(latitude_deg: f64, instant: &Instant) -> Result<OzoneColumn> {
    static ZONES: OnceLock<Result<Zones>> = OnceLock::new();
    let zones = cached(&ZONES, load_zones)?;
    let last = zones.latitude_deg.len() - 1;
    let i = interval(&zones.latitude_deg, latitude_deg);
    let (south, north) = (zones.latitude_deg[i], zones.latitude_deg[i + 1]);
    let t = ((latitude_deg - south) / (north - south)).clamp(0.0, 1.0);
    let (first, second, u) = months(instant);
    let four = [(first + 11) % 12, first, second, (second + 1) % 12];
    let zonal = |zone: usize| cubic(four.map(|m| zones.ozone_du[zone][m]), u);
    let du = cubic(
        [
            zonal(i.saturating_sub(1)),
            zonal(i),
            zonal(i + 1),
            zonal((i + 2).min(last)),
        ],
        t,
    );
    let deviation = |zone: usize| {
        let of = zones.deviation_du[zone];
        of[first] + u * (of[second] - of[first])
    };
    let measured = [i, i + 1]
        .iter()
        .all(|&z| zones.measured[z][first] && zones.measured[z][second]);
    let kind = if measured {
        "measured by satellite"
    } else {
        "partly filled from a model where the satellites saw no sunlight"
    };
    Ok(OzoneColumn {
        du,
        deviation_du: Some(deviation(i) + t * (deviation(i + 1) - deviation(i))),
        source: "NOAA SBUV/2 v8 zonal monthly means 1998-2015",
        reason: format!(
            "usual for {} at this time of year, {kind}",
            degrees_north(latitude_deg)
        ),
    })
}

/// Catmull & Rom's cubic between the second and the third of four equidistant values.
fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    let (before, after) = (0.5 * (c - a), 0.5 * (d - b));
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * b
        + (t3 - 2.0 * t2 + t) * before
        + (3.0 * t2 - 2.0 * t3) * c
        + (t3 - t2) * after
}

fn load_zones() -> Result<Zones> {
    let table = Table::parse(
        "ozone_column_sbuv",
        include_str!("../../../../data/ozone_column_sbuv/zonal_sbuv.csv"),
    )?;
    let (latitude, month) = (table.numbers("latitude_deg")?, table.numbers("month")?);
    let (ozone, deviation) = (table.numbers("ozone_du")?, table.numbers("deviation_du")?);
    let origin = table.words("origin")?;
    if table.len() % 12 != 0 || table.len() < 24 {
        return Err(damaged("ozone_column_sbuv"));
    }
    let zones = table.len() / 12;
    let mut out = Zones {
        latitude_deg: latitude.chunks(12).map(|zone| zone[0]).collect(),
        ozone_du: vec![[0.0; 12]; zones],
        deviation_du: vec![[0.0; 12]; zones],
        measured: vec![[false; 12]; zones],
    };
    for i in 0..table.len() {
        let (zone, m) = (i / 12, i % 12);
        if month[i] != (m + 1) as f64 {
            return Err(damaged("ozone_column_sbuv"));
        }
        out.ozone_du[zone][m] = ozone[i];
        out.deviation_du[zone][m] = deviation[i];
        out.measured[zone][m] = origin[i] == "sbuv";
    }
    Ok(out)
}

fn arosa(instant: &Instant) -> Result<OzoneColumn> {
    let table = Table::parse(
        "ozone_column_arosa",
        include_str!("../../../../data/ozone_column_arosa/arosa.csv"),
    )?;
    let (first, second, weight) = months(instant);
    let du = table.numbers("ozone_du")?;
    let deviation = table.numbers("deviation_du")?;
    let between = |of: &[f64]| of[first] + weight * (of[second] - of[first]);
    Ok(OzoneColumn {
        du: between(&du),
        deviation_du: Some(between(&deviation)),
        source: "Dütsch 1974, Can. J. Chem. 52, 1491-1504",
        reason: "usual for Arosa (47° N) at this time of year, used as it stands".to_owned(),
    })
}

/// Van Heuklon's formula (eq. 4 and table 1); the sine's argument in degrees, day of the year from 1.
fn van_heuklon_du(latitude_deg: f64, longitude_deg: f64, day: f64) -> f64 {
    let north = latitude_deg >= 0.0;
    let (a, beta, c, f, h) = if north {
        (150.0, 1.28, 40.0, -30.0, 3.0)
    } else {
        (100.0, 1.5, 30.0, 152.625, 2.0)
    };
    let i = match (north, longitude_deg > 0.0) {
        (true, true) => 20.0,
        (true, false) => 0.0,
        (false, _) => -75.0,
    };
    let sin = |deg: f64| deg.to_radians().sin();
    let waves = a + c * sin(0.9865 * (day + f)) + 20.0 * sin(h * (longitude_deg + i));
    235.0 + waves * sin(beta * latitude_deg).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mid_month(month: usize) -> Instant {
        let middle = match month {
            2 => "15T00:00Z",
            4 | 6 | 9 | 11 => "16T00:00Z",
            _ => "16T12:00Z",
        };
        format!("2021-{month:02}-{middle}").parse().unwrap()
    }

    /// The satellites' zonal means at Arosa, within one published standard deviation of Arosa's own record.
    #[test]
    fn table_agrees_with_arosa() {
        let table = Table::parse(
            "arosa",
            include_str!("../../../../data/ozone_column_arosa/arosa.csv"),
        )
        .unwrap();
        let (mean, deviation) = (
            table.numbers("ozone_du").unwrap(),
            table.numbers("deviation_du").unwrap(),
        );
        for month in 1..=12 {
            let ozone = OzoneClimate::Sbuv
                .column(46.78, 9.68, &mid_month(month))
                .unwrap();
            let off = ozone.du - mean[month - 1];
            assert!(off.abs() < deviation[month - 1], "month {month}: {off}");
            let arosa = OzoneClimate::Arosa
                .column(46.78, 9.68, &mid_month(month))
                .unwrap();
            assert!((arosa.du - mean[month - 1]).abs() < 1e-9);
        }
    }

    /// Cells of the table come back at zone centres and mid-months; the poles take the last zone.
    #[test]
    fn table_is_met_and_smooth() {
        let at = |lat: f64, text: &str| {
            let instant: Instant = text.parse().unwrap();
            OzoneClimate::Sbuv.column(lat, 0.0, &instant).unwrap()
        };
        assert!((at(47.5, "2021-01-16T12:00Z").du - 363.9).abs() < 1e-9);
        assert!((at(-90.0, "2021-10-16T12:00Z").du - 169.6).abs() < 1e-9);
        assert!(at(-90.0, "2021-07-16T12:00Z").reason.contains("filled"));
        assert!(at(2.5, "2021-07-16T12:00Z").reason.contains("measured"));
        let before = at(40.0, "2020-12-31T23:59:59Z").du;
        let after = at(40.0, "2021-01-01T00:00:01Z").du;
        assert!((before - after).abs() < 1e-3);
    }

    /// Independent test vectors: 235 DU at the equator, 328.3 DU at 45° N 0° E on 1 January; 392 and 334 DU at
    /// 47° N 9° E on 15 April and 15 October.
    #[test]
    fn van_heuklon_vectors() {
        assert_eq!(van_heuklon_du(0.0, 77.0, 200.0), 235.0);
        assert!((van_heuklon_du(45.0, 0.0, 1.0) - 328.3).abs() < 0.05);
        assert!((van_heuklon_du(47.0, 9.0, 105.0) - 392.0).abs() < 1.0);
        assert!((van_heuklon_du(47.0, 9.0, 288.0) - 334.0).abs() < 1.0);
    }
}
