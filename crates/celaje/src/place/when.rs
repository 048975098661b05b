//! Times as people give them: with an offset, by the clock of the place, by what the sun does, or now.

use jiff::civil::DateTime;
use jiff::tz::{AmbiguousOffset, TimeZone};
use jiff::Timestamp;

use super::sun_events::{SunEvent, SunTimes};
use super::{Instant, Site};
use crate::error::{Error, Result};

const FORMS: &str = "write 2026-06-21T18:30Z, 2026-06-21T20:30+02:00, 2026-06-21T20:30 as local time, now, sunset, \
                     sunset+10min, 'civil dusk' or '2026-06-21 sunset-1h'";

/// An instant from text.
///
/// * `2026-06-21T18:30Z`, `2026-06-21T20:30+02:00` — as [`Instant`] reads them;
/// * `2026-06-21T20:30` — by the clock of the place if `local` (its time zone, summer time included; an hour that the clock
///   skips is taken as if it had not, one that it shows twice as the first), an error otherwise;
/// * `now`;
/// * `sunset`, `civil dusk`, … (see [`SunEvent::ALL`]) of today, or of a date written before: `2026-06-21 sunset`;
/// * the last two with an offset: `sunset+10min`, `noon-1h30min`, `now+45s`.
///
/// Dates of events are those of the place's calendar, or by the mean sun where no time zone is known.
///
/// ```
/// # use celaje::place::{parse_time, Site};
/// let zaragoza = Site::named("Zaragoza")?;
/// assert_eq!(parse_time("2026-06-21T20:30", &zaragoza, true)?.to_string(), "2026-06-21T18:30:00Z");
/// # Ok::<(), celaje::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`] for text that is not understood, a place without a known time zone, and an event that does not happen
/// (polar day and night are told); [`Error::OutOfRange`] outside 1900 to 2100; [`Error::UnknownName`] for an unknown event.
pub fn parse_time(text: &str, site: &Site, local: bool) -> Result<Instant> {
    parse_time_at(text, site, local, &Instant::now()?)
}

/// [`parse_time`] at a given present.
///
/// # Errors
/// As [`parse_time`].
pub fn parse_time_at(text: &str, site: &Site, local: bool, now: &Instant) -> Result<Instant> {
    let text = text.trim();
    let not_understood = || Error::invalid(format!("time '{text}' is not understood"), FORMS);
    let (date, rest) = match split_date(text) {
        Some((date, rest)) => (Some(date), rest),
        None => (None, text),
    };
    let clock = rest.strip_prefix(['T', 't']).unwrap_or(rest).trim_start();
    if date.is_some() && clock.starts_with(|c: char| c.is_ascii_digit()) {
        let has_offset = clock.contains(['Z', 'z', '+', '-', '−']);
        return if local && !has_offset {
            by_clock(text, site)
        } else {
            text.parse()
        };
    }
    let words = if date.is_some() { clock } else { rest };
    let (word, offset_s) = split_offset(words.trim()).ok_or_else(not_understood)?;
    let base = match (word.to_lowercase().as_str(), date) {
        ("", _) => return Err(not_understood()),
        ("now", None) => *now,
        (word, date) => {
            if !word.starts_with(|c: char| c.is_alphabetic()) {
                return Err(not_understood());
            }
            event(SunEvent::named(word)?, site, date, now)?
        }
    };
    base.later_by(offset_s)
}

/// What is doubtful about a local time, if the clock of the place skips it or shows it twice; [`parse_time`] says how it is taken.
///
/// ```
/// # use celaje::place::{clock_doubt, Site};
/// let zaragoza = Site::named("Zaragoza")?;
/// assert!(clock_doubt("2026-10-25T02:30", &zaragoza).is_some_and(|doubt| doubt.contains("twice")));
/// assert_eq!(clock_doubt("2026-10-25T12:30", &zaragoza), None);
/// # Ok::<(), celaje::Error>(())
/// ```
pub fn clock_doubt(text: &str, site: &Site) -> Option<String> {
    let text = text.trim();
    let fields: Instant = format!("{text}Z").parse().ok()?;
    let zone = zone(site).ok()??;
    let ambiguous = zone.to_ambiguous_timestamp(civil(&fields)?);
    let name = site.time_zone().unwrap_or("its time zone");
    match ambiguous.offset() {
        AmbiguousOffset::Unambiguous { .. } => None,
        AmbiguousOffset::Gap { .. } => Some(format!(
            "the clocks of {name} skip {text}; it is taken as if they had not"
        )),
        AmbiguousOffset::Fold { before, .. } => Some(format!(
            "the clocks of {name} show {text} twice; it is taken as the first, at {before} from UTC"
        )),
    }
}

/// An instant by the clocks of a time zone of the IANA database: `2026-06-21T20:30:00+02:00`.
///
/// # Errors
/// [`Error::Invalid`] for a zone that does not exist.
pub fn local_time(instant: &Instant, zone: &str) -> Result<String> {
    let beyond = |e: jiff::Error| Error::invalid(format!("no time in {zone}: {e}"), "take UTC");
    let zone = time_zone(zone)?;
    let seconds = instant.unix_seconds();
    let stamp = Timestamp::from_second(seconds.floor() as i64).map_err(beyond)?;
    let offset_s = f64::from(zone.to_offset(stamp).seconds());
    let clock = instant.later_by(offset_s)?.to_string();
    let (sign, minutes) = (
        if offset_s < 0.0 { '-' } else { '+' },
        offset_s.abs() / 60.0,
    );
    let (hours, minutes) = ((minutes / 60.0).floor(), (minutes % 60.0).floor());
    let clock = clock.trim_end_matches('Z');
    Ok(format!("{clock}{sign}{hours:02}:{minutes:02}"))
}

/// A date in front (as year, month, day) and what follows it; years may be of any length and negative, to be refused by range.
fn split_date(text: &str) -> Option<((i64, i64, i64), &str)> {
    let unsigned = text.strip_prefix(['-', '−']);
    let sign = if unsigned.is_some() { -1 } else { 1 };
    let mut parts = unsigned.unwrap_or(text).splitn(3, '-');
    let number = |digits: &str| {
        let plain = !digits.is_empty() && digits.len() <= 9;
        (plain && digits.bytes().all(|b| b.is_ascii_digit())).then(|| digits.parse::<i64>().ok())?
    };
    let (year, month, rest) = (parts.next()?, parts.next()?, parts.next()?);
    let day = rest.get(..2)?;
    if month.len() != 2 {
        return None;
    }
    let date = (sign * number(year)?, number(month)?, number(day)?);
    Some((date, rest.get(2..)?))
}

/// `sunset+1h30min` as the word and the seconds.
fn split_offset(text: &str) -> Option<(&str, f64)> {
    // The hyphen of `civil-dusk` is no sign: a sign stands before a number.
    let sign = |&(at, c): &(usize, char)| {
        let next = text[at + c.len_utf8()..].trim_start().chars().next();
        c == '+' || (matches!(c, '-' | '−') && next.is_none_or(|n| n.is_ascii_digit()))
    };
    let Some((at, _)) = text.char_indices().find(sign) else {
        return Some((text, 0.0));
    };
    let (word, offset) = text.split_at(at);
    let sign = if offset.starts_with('+') { 1.0 } else { -1.0 };
    let mut rest = offset.trim_start_matches(['+', '-', '−']).trim();
    let mut seconds = 0.0;
    if rest.is_empty() {
        return None;
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.')?;
        let (number, tail) = rest.split_at(digits);
        let tail = tail.trim_start();
        let unit_end = tail
            .find(|c: char| !c.is_alphabetic())
            .unwrap_or(tail.len());
        let (unit, tail) = tail.split_at(unit_end);
        let each = match unit {
            "h" | "hour" | "hours" => 3600.0,
            "m" | "min" | "minute" | "minutes" => 60.0,
            "s" | "sec" | "second" | "seconds" => 1.0,
            _ => return None,
        };
        seconds += number.parse::<f64>().ok()? * each;
        rest = tail.trim_start();
    }
    Some((word.trim(), sign * seconds))
}

fn zone(site: &Site) -> Result<Option<TimeZone>> {
    let Some(name) = site.time_zone() else {
        return Ok(None);
    };
    time_zone(name).map(Some)
}

fn time_zone(name: &str) -> Result<TimeZone> {
    TimeZone::get(name).map_err(|e| {
        Error::invalid(
            format!("the time zone {name} is not known: {e}"),
            "give the time in UTC: 2026-06-21T18:30Z",
        )
    })
}

/// A time without an offset, by the clock of the place.
fn by_clock(text: &str, site: &Site) -> Result<Instant> {
    let fields: Instant = format!("{text}Z").parse()?;
    let zone = zone(site)?.ok_or_else(|| {
        Error::invalid(
            format!("no time zone is known for this place, so that '{text}' cannot be local time"),
            "give the time in UTC or with an offset: 2026-06-21T18:30Z",
        )
    })?;
    in_zone(&fields, &zone)
}

/// The instant at which a clock in a zone shows the fields that `fields` has in UTC.
fn in_zone(fields: &Instant, zone: &TimeZone) -> Result<Instant> {
    let beyond =
        |e: jiff::Error| Error::invalid(format!("no such local time: {e}"), "give the time in UTC");
    let seconds = fields.unix_seconds();
    let whole = seconds.floor();
    let civil = civil(fields)
        .ok_or_else(|| Error::invalid("no such local time", "give the time in UTC"))?;
    let stamp = zone.to_timestamp(civil).map_err(beyond)?;
    Instant::from_unix_seconds(stamp.as_second() as f64 + (seconds - whole))
}

/// The fields that an instant has in UTC, to whole seconds.
fn civil(instant: &Instant) -> Option<DateTime> {
    let utc = Timestamp::from_second(instant.unix_seconds().floor() as i64).ok()?;
    Some(TimeZone::UTC.to_datetime(utc))
}

/// An event of the sun on a date of the place's calendar, today's if none is given.
fn event(
    event: SunEvent,
    site: &Site,
    date: Option<(i64, i64, i64)>,
    now: &Instant,
) -> Result<Instant> {
    let zone = zone(site)?;
    let solar_s = site.longitude_deg() / 15.0 * 3600.0;
    let (year, month, day) = match (date, &zone) {
        (Some(date), _) => date,
        (None, Some(zone)) => {
            let stamp = Timestamp::from_second(now.unix_seconds() as i64).map_err(|e| {
                Error::invalid(format!("the present cannot be told: {e}"), "give a date")
            })?;
            let today = zone.to_datetime(stamp).date();
            let (month, day) = (i64::from(today.month()), i64::from(today.day()));
            (i64::from(today.year()), month, day)
        }
        (None, None) => now.later_by(solar_s)?.date(),
    };
    let midday = Instant::from_utc(year, month, day, 12, 0, 0.0)?;
    let around = match &zone {
        Some(zone) => in_zone(&midday, zone)?,
        None => midday.later_by(-solar_s)?,
    };
    let times = SunTimes::around(site, &around)?;
    times.get(event).ok_or_else(|| {
        let (lat, lon) = (site.latitude_deg(), site.longitude_deg());
        Error::invalid(
            format!(
                "there is no {} at {lat},{lon} on {year:04}-{month:02}-{day:02}: {}",
                event.name(),
                times.why_not(event)
            ),
            "give another date, or a time in UTC",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, site: &Site, local: bool) -> Result<String> {
        let now = "2026-06-21T10:00Z".parse().unwrap();
        parse_time_at(text, site, local, &now).map(|i| i.to_string())
    }

    #[test]
    fn clocks_of_places() {
        let zaragoza = Site::named("Zaragoza").unwrap();
        let near = Site::new(41.7, -0.9, 0.0).unwrap();
        for site in [&zaragoza, &near] {
            let summer = read("2026-06-21T20:30", site, true).unwrap();
            assert_eq!(summer, "2026-06-21T18:30:00Z");
            let winter = read("2026-12-21 20:30:15", site, true).unwrap();
            assert_eq!(winter, "2026-12-21T19:30:15Z");
        }
        // Given offsets win; the skipped hour of 29 March 2026 counts as if the clock had not been moved.
        assert_eq!(
            read("2026-06-21T20:30Z", &zaragoza, true).unwrap(),
            "2026-06-21T20:30:00Z"
        );
        assert_eq!(
            read("2026-03-29T02:30", &zaragoza, true).unwrap(),
            "2026-03-29T01:30:00Z"
        );
        assert_eq!(
            read("2026-10-25T02:30", &zaragoza, true).unwrap(),
            "2026-10-25T00:30:00Z"
        );
        let doubt = |text: &str| clock_doubt(text, &zaragoza).unwrap_or_default();
        assert!(doubt("2026-03-29T02:30").contains("skip"));
        assert!(doubt("2026-10-25T02:30").contains("at +02 from UTC"));
        for sure in [
            "2026-03-29T03:30",
            "2026-10-25T02:30Z",
            "sunset",
            "2026-10-25 noon",
        ] {
            assert_eq!(doubt(sure), "", "{sure}");
        }
        let kathmandu = Site::named("Kathmandu").unwrap();
        assert_eq!(
            read("2026-06-22T00:15", &kathmandu, true).unwrap(),
            "2026-06-21T18:30:00Z"
        );
        let pacific = Site::new(-30.0, -130.0, 0.0).unwrap();
        assert!(read("2026-06-21T20:30", &pacific, true)
            .unwrap_err()
            .to_string()
            .contains("time zone"));
        assert!(read("2026-06-21T20:30", &zaragoza, false)
            .unwrap_err()
            .to_string()
            .contains("time zone"));
    }

    #[test]
    fn events_and_offsets() {
        let zaragoza = Site::named("Zaragoza").unwrap();
        let at = |text: &str| {
            let now = "2026-06-21T10:00Z".parse().unwrap();
            parse_time_at(text, &zaragoza, false, &now).unwrap()
        };
        assert_eq!(at("now").to_string(), "2026-06-21T10:00:00Z");
        assert_eq!(at("now+1h30min").to_string(), "2026-06-21T11:30:00Z");
        let sunset = at("sunset");
        assert_eq!(sunset, at("2026-06-21 sunset"));
        assert_eq!(sunset, at("2026-06-21T sunset"));
        let later = at("sunset+10min").unix_seconds() - sunset.unix_seconds();
        assert!((later - 600.0).abs() < 1e-6);
        let earlier = at("Sunset - 90s").unix_seconds() - sunset.unix_seconds();
        assert!((earlier + 90.0).abs() < 1e-6);
        assert!(at("civil dusk") > sunset && at("civil-dusk") == at("dusk"));
        assert!(at("2026-12-21 sunset") > at("2026-12-21 noon"));
        // In the far east the local day starts the day before in UTC.
        let tokyo = Site::named("Tokyo").unwrap();
        let sunrise = read("2026-06-21 sunrise", &tokyo, false).unwrap();
        assert!(sunrise.starts_with("2026-06-20T19:2"), "{sunrise}");
    }

    /// Dates outside the years there are name them, in every form of a time.
    #[test]
    fn years_are_told() {
        let zaragoza = Site::named("Zaragoza").unwrap();
        for year in ["-1", "-0001", "0", "1850", "1899", "2101", "20260"] {
            for time in ["T12:00Z", "T12:00", " 12:00+02:00", " sunset", " noon+1h"] {
                let text = format!("{year}-06-21{time}");
                let e = read(&text, &zaragoza, true).unwrap_err().to_string();
                assert!(
                    e.starts_with("year = ") && e.contains("[1900, 2100]"),
                    "{text}: {e}"
                );
            }
        }
    }

    #[test]
    fn what_cannot_be_is_told() {
        let longyearbyen = Site::new(78.22, 15.65, 0.0).unwrap();
        let e = read("2026-06-21 sunset", &longyearbyen, false).unwrap_err();
        assert!(e.to_string().contains("polar day"), "{e}");
        let pole = Site::new(-90.0, 0.0, 0.0).unwrap();
        let e = read("2026-06-21 sunrise", &pole, false).unwrap_err();
        assert!(e.to_string().contains("polar night"), "{e}");
        for text in [
            "",
            "sunsets",
            "sunset+",
            "sunset+10",
            "sunset+10parsec",
            "+10min",
            "2026-06-21",
            "2026-6-21 noon",
            "2026-06-2 noon",
            "2026-02-30 noon",
            "é€",
            "2026-06-21T25:00",
        ] {
            assert!(read(text, &longyearbyen, true).is_err(), "{text}");
        }
    }
}
