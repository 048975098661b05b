//! How much ozone is overhead: climatologies of the total column.

use crate::error::{check_range, Error, Result};
use crate::math::interp::linear_clamped;
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

/// A column and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct OzoneColumn {
    /// Total column \[DU\].
    pub du: f64,
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

/// The two months between whose middles an instant lies (0 to 11), and the weight of the second.
fn months(instant: &Instant) -> (usize, usize, f64) {
    let position = instant.month_position().rem_euclid(12.0);
    let first = (position as usize).min(11);
    (first, (first + 1) % 12, position - first as f64)
}

/// Linear in latitude between zone centres (held beyond ±87.5°) and in time between mid-months.
fn sbuv(latitude_deg: f64, instant: &Instant) -> Result<OzoneColumn> {
    let table = Table::parse(
        "ozone_column_sbuv",
        include_str!("../../../../data/ozone_column_sbuv/zonal_sbuv.csv"),
    )?;
    let (first, second, weight) = months(instant);
    let mut measured = true;
    let mut zonal = |month: usize| -> Result<f64> {
        let zones = table.select("month", &(month + 1).to_string())?;
        let latitudes = zones.numbers("latitude_deg")?;
        let near = latitudes.iter().zip(zones.words("origin")?);
        measured &= near
            .filter(|(l, _)| (*l - latitude_deg).abs() <= 5.0)
            .all(|(_, origin)| origin == "sbuv");
        Ok(linear_clamped(
            &latitudes,
            &zones.numbers("ozone_du")?,
            latitude_deg,
        ))
    };
    let (before, after) = (zonal(first)?, zonal(second)?);
    let kind = if measured {
        "measured by satellite"
    } else {
        "partly filled from a model where the satellites saw no sunlight"
    };
    Ok(OzoneColumn {
        du: before + weight * (after - before),
        source: "NOAA SBUV/2 v8 zonal monthly means 1998-2015",
        reason: format!("usual for {latitude_deg:.1}° N at this time of year, {kind}"),
    })
}

fn arosa(instant: &Instant) -> Result<OzoneColumn> {
    let table = Table::parse(
        "ozone_column_arosa",
        include_str!("../../../../data/ozone_column_arosa/arosa.csv"),
    )?;
    let (first, second, weight) = months(instant);
    let du = table.numbers("ozone_du")?;
    Ok(OzoneColumn {
        du: du[first] + weight * (du[second] - du[first]),
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
