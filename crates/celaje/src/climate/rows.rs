//! Conditions as lines: what `celaje explain` prints, what files and other languages are told.

use super::{Condition, Conditions};
use crate::error::Result;
use crate::place::{local_time, Instant, MoonPosition, Site};

/// A value of any kind.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum ConditionValue {
    /// A number, in the condition's unit.
    Number(f64),
    /// A name.
    Text(String),
    /// An instant.
    Time(Instant),
    /// Nothing: an event that does not happen.
    None,
}

/// One line of [`Conditions::rows`].
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionRow {
    /// Name of the condition, the same as its field where it is one.
    pub key: &'static str,
    /// The value for people to read: rounded, without its unit.
    pub text: String,
    /// The value itself, with unit, uncertainty, source and reason.
    pub condition: Condition<ConditionValue>,
}

/// Uncertainty of the Moon's direction and phase \[deg\] and distance \[km\]: rms deviation from astropy's ephemeris, rounded up.
const MOON_DEG: f64 = 0.01;
const MOON_KM: f64 = 30.0;

impl Conditions {
    /// Every condition as a line, for `celaje explain` and the headers of files: where and when, the air, the ground, the
    /// Moon, the day's sun; the last one says what is neglected.
    pub fn rows(&self) -> Vec<ConditionRow> {
        let mut rows = self.place_rows();
        rows.extend(self.air_rows());
        if let Some(moon) = &self.moon {
            rows.extend(moon_rows(moon));
        }
        // A search that fails has been told of where it matters; here it only leaves its lines out.
        rows.extend(self.day_rows().unwrap_or_default());
        let straight = "rays are straight as yet: at the horizon a real sun is seen 0.5° higher, and sets some minutes later";
        let neglected = Condition::new("none".to_owned(), "", "method", straight);
        rows.push(name("refraction", &neglected));
        rows
    }

    fn place_rows(&self) -> Vec<ConditionRow> {
        let coordinates = [
            ("latitude_deg", &self.latitude_deg),
            ("longitude_deg", &self.longitude_deg),
        ];
        let mut rows: Vec<_> = coordinates
            .into_iter()
            .filter_map(|(key, c)| c.as_ref().map(|c| number(key, c, 6)))
            .collect();
        if let Some(c) = &self.time {
            rows.push(row("time", c, c.value.to_string(), ConditionValue::Time));
        }
        if let Some((zone, clock)) = self.zone_and_clock() {
            let reason = format!("by the clock of {zone}, the zone of the nearest city");
            let source = "IANA time zone database";
            rows.push(name(
                "local_time",
                &Condition::new(clock, "", source, reason),
            ));
        }
        rows.extend([
            number("altitude_m", &self.altitude_m, 1),
            number("sun_elevation_deg", &self.sun_elevation_deg, 4),
            number("sun_azimuth_deg", &self.sun_azimuth_deg, 4),
            number("sun_distance_au", &self.sun_distance_au, 6),
        ]);
        rows
    }

    fn air_rows(&self) -> Vec<ConditionRow> {
        let mut rows = vec![
            name("atmosphere", &self.atmosphere),
            number("ozone_du", &self.ozone_du, 1),
            number("no2_du", &self.no2_du, 3),
            number("water_mm", &self.water_mm, 1),
            number("co2_ppm", &self.co2_ppm, 0),
            name("aerosol", &self.aerosol),
        ];
        if let Some(mixture) = &self.mixture {
            let (nearest, source) = (mixture.nearest_type.to_owned(), "AIAA G-065");
            let reason = "the named type that is most like this mixture; not in use";
            rows.push(name(
                "aerosol_type",
                &Condition::new(nearest, "", source, reason),
            ));
        }
        if let Some(c) = &self.visibility_km {
            rows.push(number("visibility_km", c, 3));
        }
        if let Some(c) = &self.tabulated_factor {
            rows.push(number("tabulated_factor", c, 4));
        }
        // Visibility and tabulated amounts set the optical depth when the sky is composed.
        if self.visibility_km.is_none() && self.tabulated_factor.is_none() {
            rows.push(number("aod_550", &self.aod_550, 4));
        }
        rows.extend([
            name("stratosphere", &self.stratosphere),
            name("mesosphere", &self.mesosphere),
            number("humidity_percent", &self.humidity_percent, 1),
            number("albedo", &self.albedo, 4),
        ]);
        rows
    }

    /// The place's time zone, and what its clocks show.
    fn zone_and_clock(&self) -> Option<(&'static str, String)> {
        let zone = self.site()?.time_zone()?;
        let clock = local_time(&whole_second(self.time.as_ref()?.value), zone).ok()?;
        Some((zone, clock))
    }

    /// The place, its ground at sea level.
    fn site(&self) -> Option<Site> {
        let (lat, lon) = (self.latitude_deg.as_ref()?, self.longitude_deg.as_ref()?);
        Site::new(lat.value, lon.value, 0.0).ok()
    }

    /// What the sun does on the day around the instant.
    fn day_rows(&self) -> Result<Vec<ConditionRow>> {
        let Some(times) = self.sun_times()? else {
            return Ok(Vec::new());
        };
        let zone = self.site().and_then(|site| site.time_zone());
        let source = "NREL SPA; sunrise and sunset at -0.833°, twilights at -6°, -12°, -18°";
        let events = times.events.iter().map(|(event, instant)| {
            let (text, value, reason) = match instant {
                Some(instant) => {
                    let instant = whole_second(*instant);
                    let clock = zone.and_then(|zone| local_time(&instant, zone).ok());
                    let clock = clock.map_or(String::new(), |c| format!(": {c} by the clock"));
                    let reason = format!("of the day around the instant, in UTC{clock}");
                    (instant.to_string(), ConditionValue::Time(instant), reason)
                }
                None => (
                    "none".to_owned(),
                    ConditionValue::None,
                    times.why_not(*event),
                ),
            };
            ConditionRow {
                key: event.key(),
                text,
                condition: Condition::new(value, "", source, reason),
            }
        });
        Ok(events.collect())
    }
}

fn moon_rows(moon: &MoonPosition) -> Vec<ConditionRow> {
    let found = |value: f64, unit: &'static str, uncertainty: f64, reason: &str| {
        let source = "Meeus 1998, Astronomical Algorithms, chapter 47";
        Condition::new(value, unit, source, reason).with_uncertainty(uncertainty)
    };
    let seen = "from place and time; true, not refracted";
    let phase = "angle sun-Moon-Earth: 0 at full Moon, 180 at new Moon";
    let lit = format!("{}; its light is not computed as yet", moon.phase_name());
    let lit_by_angle = 0.5 * moon.phase_angle_deg.to_radians().sin() * MOON_DEG.to_radians();
    [
        (
            "moon_elevation_deg",
            moon.elevation_deg,
            "deg",
            MOON_DEG,
            seen,
            2,
        ),
        (
            "moon_azimuth_deg",
            moon.azimuth_deg,
            "deg",
            MOON_DEG,
            seen,
            2,
        ),
        (
            "moon_distance_km",
            moon.distance_km,
            "km",
            MOON_KM,
            "from the place",
            0,
        ),
        (
            "moon_phase_deg",
            moon.phase_angle_deg,
            "deg",
            MOON_DEG,
            phase,
            2,
        ),
        (
            "moon_illuminated",
            moon.illuminated,
            "",
            lit_by_angle,
            &lit,
            3,
        ),
    ]
    .into_iter()
    .map(|(key, value, unit, uncertainty, reason, digits)| {
        number(key, &found(value, unit, uncertainty, reason), digits)
    })
    .collect()
}

/// The nearest whole second: events of the sun are not known any better.
fn whole_second(instant: Instant) -> Instant {
    Instant::from_unix_seconds(instant.unix_seconds().round()).unwrap_or(instant)
}

fn number(key: &'static str, c: &Condition<f64>, digits: usize) -> ConditionRow {
    row(key, c, trimmed(c.value, digits), ConditionValue::Number)
}

fn name(key: &'static str, c: &Condition<String>) -> ConditionRow {
    row(key, c, c.value.clone(), ConditionValue::Text)
}

fn row<T: Clone>(
    key: &'static str,
    c: &Condition<T>,
    text: String,
    kind: fn(T) -> ConditionValue,
) -> ConditionRow {
    let condition = c.clone().map(kind);
    ConditionRow {
        key,
        text,
        condition,
    }
}

/// A number to so many decimals, without trailing zeros.
fn trimmed(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = if digits == 0 {
        &text
    } else {
        text.trim_end_matches('0').trim_end_matches('.')
    };
    if text == "-0" { "0" } else { text }.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::climate::Overrides;

    fn rows(at: &str, time: &str) -> Vec<ConditionRow> {
        let (site, time) = (Site::parse(at).unwrap(), time.parse().unwrap());
        Conditions::at(&site, &time, &Overrides::default())
            .unwrap()
            .rows()
    }

    #[test]
    fn every_row_is_whole() {
        let rows = rows("41.65,-0.88", "2026-06-21T18:30Z");
        for row in &rows {
            let (text, c) = (&row.text, &row.condition);
            assert!(!text.is_empty() && !c.reason.is_empty() && !c.source.is_empty());
            // In files `celaje.` comes before and `.reason` behind; EXR allows 31 characters in its first version.
            assert!(row.key.len() + 14 <= 32, "{}", row.key);
        }
        let keys: Vec<_> = rows.iter().map(|r| r.key).collect();
        assert_eq!(
            keys[..4],
            ["latitude_deg", "longitude_deg", "time", "local_time"]
        );
        assert_eq!(keys.last(), Some(&"refraction"));
        let json = serde_json::to_value(&rows[2].condition).unwrap();
        assert_eq!(json["value"], "2026-06-21T18:30:00Z");
        assert_eq!(rows[3].text, "2026-06-21T20:30:00+02:00");
        let found = |key: &str| rows.iter().find(|r| r.key == key).unwrap();
        assert_eq!(found("aerosol_type").text, "rural");
        assert!(found("sunset").condition.reason.contains("T21:41:2"));
        for key in [
            "altitude_m",
            "sun_elevation_deg",
            "ozone_du",
            "water_mm",
            "aod_550",
            "humidity_percent",
            "albedo",
            "moon_elevation_deg",
            "moon_distance_km",
            "moon_phase_deg",
        ] {
            assert!(found(key).condition.uncertainty.is_some(), "{key}");
        }
    }

    #[test]
    fn a_city_is_named_and_a_missing_sunset_explained() {
        let rows = rows("Murmansk", "2026-06-21T12:00Z");
        assert_eq!(rows[0].condition.reason, "of Murmansk, Russia");
        let south = self::rows("-33.4,-70.66", "2026-06-21T12:00Z");
        let ozone = south.iter().find(|r| r.key == "ozone_du").unwrap();
        assert!(ozone.condition.reason.contains("33.4° S"));
        let sunset = rows.iter().find(|r| r.key == "sunset").unwrap();
        assert_eq!(sunset.condition.value, ConditionValue::None);
        assert!(sunset.condition.reason.contains("polar day"));
        assert!(serde_json::to_value(&sunset.condition).unwrap()["value"].is_null());
    }

    #[test]
    fn numbers_are_trimmed() {
        assert_eq!(trimmed(0.0, 1), "0");
        assert_eq!(trimmed(-0.04, 1), "0");
        assert_eq!(trimmed(1500.0, 1), "1500");
        assert_eq!(trimmed(0.125, 4), "0.125");
    }
}
