//! Sunrise, sunset, noon and the three twilights of a day.

use solar_positioning::{delta_t, Horizon, Location, SolarEvents};

use super::{Instant, Site};
use crate::error::{Error, Result};

/// What the sun does once a day, in the order of the day.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SunEvent {
    /// The sun comes up to −18°.
    AstronomicalDawn,
    /// The sun comes up to −12°.
    NauticalDawn,
    /// The sun comes up to −6°.
    CivilDawn,
    /// The sun's upper edge shows, refraction included: its middle at −0.833°.
    Sunrise,
    /// The sun crosses the meridian.
    Noon,
    /// The sun's upper edge vanishes: its middle at −0.833°.
    Sunset,
    /// The sun sinks to −6°.
    CivilDusk,
    /// The sun sinks to −12°.
    NauticalDusk,
    /// The sun sinks to −18°.
    AstronomicalDusk,
}

impl SunEvent {
    /// All events with their names, in the order of the day.
    pub const ALL: [(Self, &'static str); 9] = [
        (Self::AstronomicalDawn, "astronomical dawn"),
        (Self::NauticalDawn, "nautical dawn"),
        (Self::CivilDawn, "civil dawn"),
        (Self::Sunrise, "sunrise"),
        (Self::Noon, "noon"),
        (Self::Sunset, "sunset"),
        (Self::CivilDusk, "civil dusk"),
        (Self::NauticalDusk, "nautical dusk"),
        (Self::AstronomicalDusk, "astronomical dusk"),
    ];

    /// The event of a name; `dawn` and `dusk` alone are the civil ones, `solar noon` is noon.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        let words: Vec<String> = name.split([' ', '-', '_']).map(str::to_lowercase).collect();
        let plain = match words.join(" ").trim() {
            "dawn" => "civil dawn".to_owned(),
            "dusk" => "civil dusk".to_owned(),
            "solar noon" => "noon".to_owned(),
            other => other.to_owned(),
        };
        let found = Self::ALL.iter().find(|(_, n)| *n == plain);
        found
            .map(|(event, _)| *event)
            .ok_or_else(|| Error::UnknownName {
                kind: "sun event",
                name: name.to_owned(),
                known: Self::ALL.map(|(_, n)| n.to_owned()).to_vec(),
            })
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(event, _)| *event == self);
        found.map_or("noon", |(_, name)| name)
    }
}

/// The sun's events of one day at a place; `None` is what does not happen on that day.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SunTimes {
    /// One per event of [`SunEvent::ALL`].
    pub events: Vec<(SunEvent, Option<Instant>)>,
    /// True elevation of the sun at noon \[deg\]: tells polar day from polar night.
    pub noon_elevation_deg: f64,
}

impl SunTimes {
    /// The day of which `around` is about the middle: the noon nearest to it, the dawns of the half day before that noon and
    /// the dusks of the half day after it (which may be past midnight).
    ///
    /// # Errors
    /// [`Error::Invalid`] if the search fails, which no valid place and time should cause.
    pub fn around(site: &Site, around: &Instant) -> Result<Self> {
        let failed = |e: solar_positioning::Error| {
            Error::invalid(
                format!("sunrise and sunset cannot be found: {e}"),
                "give a time between 1900 and 2100",
            )
        };
        let location = Location {
            latitude: site.latitude_deg(),
            longitude: site.longitude_deg(),
        };
        let delta_t_s = delta_t::estimate(around.decimal_year()).map_err(failed)?;
        let middle = around.julian_date();
        let search = |from: f64, to: f64, horizon: Horizon| {
            let events = SolarEvents::new();
            let found = events.for_interval_from_julian(from, to, location, delta_t_s, horizon);
            found.map_err(failed)
        };
        let at = |jd: f64| Instant::from_unix_seconds((jd - 2_440_587.5) * 86_400.0);
        let day = search(middle - 0.52, middle + 0.52, Horizon::SunriseSunset)?;
        let distance = |t: &f64| (t - middle).abs();
        let noon = day
            .transits
            .iter()
            .copied()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let noon = noon.unwrap_or(middle);
        let mut events = Vec::new();
        for (event, _) in SunEvent::ALL {
            let horizon = match event {
                SunEvent::Sunrise | SunEvent::Sunset => Horizon::SunriseSunset,
                SunEvent::CivilDawn | SunEvent::CivilDusk => Horizon::CivilTwilight,
                SunEvent::NauticalDawn | SunEvent::NauticalDusk => Horizon::NauticalTwilight,
                _ => Horizon::AstronomicalTwilight,
            };
            let found = match event {
                SunEvent::Noon => Some(noon),
                _ if event.is_morning() => search(noon - 0.5, noon, horizon)?.rises.last().copied(),
                _ => search(noon, noon + 0.5, horizon)?.sets.first().copied(),
            };
            events.push((event, found.map(at).transpose()?));
        }
        let noon_elevation_deg = super::SunPosition::at(site, &at(noon)?)?.elevation_deg();
        Ok(Self {
            events,
            noon_elevation_deg,
        })
    }

    /// When an event happens; `None` if it does not.
    pub fn get(&self, event: SunEvent) -> Option<Instant> {
        let found = self.events.iter().find(|(e, _)| *e == event);
        found.and_then(|(_, instant)| *instant)
    }

    /// Why an event does not happen, in words.
    pub fn why_not(&self, event: SunEvent) -> String {
        let level = match event {
            SunEvent::Sunrise | SunEvent::Sunset | SunEvent::Noon => -0.833,
            SunEvent::CivilDawn | SunEvent::CivilDusk => -6.0,
            SunEvent::NauticalDawn | SunEvent::NauticalDusk => -12.0,
            SunEvent::AstronomicalDawn | SunEvent::AstronomicalDusk => -18.0,
        };
        let kind = match event {
            SunEvent::Sunrise | SunEvent::Sunset => ("polar day", "polar night"),
            _ => (
                "the night does not get so dark",
                "the day does not get so bright",
            ),
        };
        if self.noon_elevation_deg > level {
            format!("the sun stays above {level}° all day: {}", kind.0)
        } else {
            format!("the sun stays below {level}° all day: {}", kind.1)
        }
    }
}

impl SunEvent {
    /// Its name as a key, with underscores.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::AstronomicalDawn => "astronomical_dawn",
            Self::NauticalDawn => "nautical_dawn",
            Self::CivilDawn => "civil_dawn",
            Self::CivilDusk => "civil_dusk",
            Self::NauticalDusk => "nautical_dusk",
            Self::AstronomicalDusk => "astronomical_dusk",
            Self::Sunrise | Self::Noon | Self::Sunset => self.name(),
        }
    }

    fn is_morning(self) -> bool {
        matches!(
            self,
            Self::AstronomicalDawn | Self::NauticalDawn | Self::CivilDawn | Self::Sunrise
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::SunPosition;

    /// Each event happens where the sun stands at the height that defines it.
    #[test]
    fn events_are_where_the_sun_says() {
        let site = Site::new(41.65, -0.88, 0.0).unwrap();
        let times = SunTimes::around(&site, &"2026-06-21T12:00Z".parse().unwrap()).unwrap();
        let mut last = None;
        for (event, instant) in &times.events {
            let instant = instant.unwrap();
            let height = SunPosition::at(&site, &instant).unwrap().elevation_deg();
            let expected = match event.name() {
                "sunrise" | "sunset" => -0.8333,
                name if name.starts_with("civil") => -6.0,
                name if name.starts_with("nautical") => -12.0,
                name if name.starts_with("astronomical") => -18.0,
                _ => times.noon_elevation_deg,
            };
            assert!(
                (height - expected).abs() < 0.01,
                "{}: {height}",
                event.name()
            );
            assert!(last.is_none_or(|l| l < instant));
            last = Some(instant);
        }
        // The longest day of Zaragoza ends a little after half past nine by its clock.
        let sunset = times.get(SunEvent::Sunset).unwrap().to_string();
        assert!(
            sunset.starts_with("2026-06-21T19:4") || sunset.starts_with("2026-06-21T19:39"),
            "{sunset}"
        );
    }

    #[test]
    fn polar_day_and_night_are_told() {
        let longyearbyen = Site::new(78.22, 15.65, 0.0).unwrap();
        let at = |text: &str| SunTimes::around(&longyearbyen, &text.parse().unwrap()).unwrap();
        let june = at("2026-06-21T11:00Z");
        assert_eq!(june.get(SunEvent::Sunset), None);
        assert!(june.why_not(SunEvent::Sunset).contains("polar day"));
        let december = at("2026-12-21T11:00Z");
        assert!(december.why_not(SunEvent::Sunrise).contains("polar night"));
        assert!(december.get(SunEvent::AstronomicalDusk).is_some());
        assert!(at("2026-03-20T11:00Z").get(SunEvent::Sunset).is_some());
    }
}
