//! An instant of time, read from text.

use crate::error::{Error, Result};

/// An instant in UTC, from 1900 to 2100.
///
/// ```
/// # use celaje::place::Instant;
/// let evening: Instant = "2026-06-21T20:30+02:00".parse()?;
/// assert_eq!(evening.to_string(), "2026-06-21T18:30:00Z");
/// # Ok::<(), celaje::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Instant {
    /// Days since 1970-01-01.
    day: i64,
    /// Seconds since midnight UTC, in [0, 86400).
    second: f64,
}

/// What to write instead of a text that is not understood.
const FORM: &str = "write the time as 2026-06-21T18:30Z or with an offset, 2026-06-21T20:30+02:00";

impl Instant {
    /// First and last year.
    pub const YEARS: std::ops::RangeInclusive<i64> = 1900..=2100;

    /// An instant from its date and time in UTC.
    ///
    /// # Arguments
    /// * `year` — 1900 to 2100
    /// * `month`, `day` — from 1, of the Gregorian calendar
    /// * `hour`, `minute` — 0 to 23, 0 to 59
    /// * `second` — in [0, 60); leap seconds do not exist here
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the part that does not exist.
    pub fn from_utc(
        year: i64,
        month: i64,
        day: i64,
        hour: i64,
        minute: i64,
        second: f64,
    ) -> Result<Self> {
        check_part("year", year, Self::YEARS)?;
        check_part("month", month, 1..=12)?;
        check_part("day", day, 1..=days_in_month(year, month))?;
        check_part("hour", hour, 0..=23)?;
        check_part("minute", minute, 0..=59)?;
        if !(0.0..60.0).contains(&second) {
            return Err(Error::out_of_range("second", second, "s", "[0, 60)"));
        }
        Ok(Self {
            day: days_from_civil(year, month, day),
            second: (hour * 3600 + minute * 60) as f64 + second,
        })
    }

    /// Year, month and day in UTC.
    pub fn date(&self) -> (i64, i64, i64) {
        civil_from_days(self.day)
    }

    /// Day of the year, 1 on 1 January, with its fraction.
    pub fn day_of_year(&self) -> f64 {
        let (year, ..) = self.date();
        (self.day - days_from_civil(year, 1, 1) + 1) as f64 + self.second / 86_400.0
    }

    /// Months since the middle of January, in [−0.5, 11.5): 0 in the middle of January, 11 of December.
    pub fn month_position(&self) -> f64 {
        let (year, month, day) = self.date();
        let elapsed = (day - 1) as f64 + self.second / 86_400.0;
        (month - 1) as f64 + elapsed / days_in_month(year, month) as f64 - 0.5
    }

    /// Year with its fraction.
    pub fn decimal_year(&self) -> f64 {
        let (year, ..) = self.date();
        let days = days_from_civil(year + 1, 1, 1) - days_from_civil(year, 1, 1);
        year as f64 + (self.day_of_year() - 1.0) / days as f64
    }

    /// Julian date in UTC \[days\].
    pub fn julian_date(&self) -> f64 {
        // 1970-01-01T00:00 is JD 2440587.5.
        2_440_587.5 + self.day as f64 + self.second / 86_400.0
    }

    /// An instant from the seconds since 1970-01-01T00:00Z, leap seconds not counted.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 1900 to 2100, and for NaN.
    pub fn from_unix_seconds(seconds: f64) -> Result<Self> {
        // A little more than the years allowed, so that the sum below cannot overflow.
        crate::error::check_range("time", seconds, "s", -2.3e9..=4.2e9)?;
        Self {
            day: 0,
            second: 0.0,
        }
        .later_by(seconds)
    }

    /// Seconds since 1970-01-01T00:00Z, leap seconds not counted.
    pub fn unix_seconds(&self) -> f64 {
        self.day as f64 * 86_400.0 + self.second
    }

    /// The instant some seconds later, or earlier if negative.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 1900 to 2100, and for NaN.
    pub fn later_by(&self, seconds: f64) -> Result<Self> {
        crate::error::check_range("time step", seconds, "s", -1e10..=1e10)?;
        let second = self.second + seconds;
        let days = (second / 86_400.0).floor();
        let moved = Self {
            day: self.day + days as i64,
            second: second - days * 86_400.0,
        };
        check_part("year", moved.date().0, Self::YEARS)?;
        Ok(moved)
    }

    /// The instant of the machine's clock.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the clock is out of its mind.
    pub fn now() -> Result<Self> {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        let seconds = since.map_err(|_| {
            Error::invalid(
                "the machine's clock is before 1970",
                "set it, or give a time",
            )
        })?;
        Self::from_unix_seconds(seconds.as_secs_f64())
    }

    /// The same instant seen from a place whose clock is ahead by `offset_s`.
    fn earlier_by(self, offset_s: i64) -> Result<Self> {
        self.later_by(-(offset_s as f64))
    }
}

impl std::fmt::Display for Instant {
    /// ISO 8601 in UTC, to whole seconds or milliseconds.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (year, month, day) = self.date();
        // Cut, not rounded: 23:59:59.9999 must not become 24:00.
        let milliseconds = (self.second * 1e3 + 1e-3).floor().min(86_399_999.0) as i64;
        let (seconds, fraction) = (milliseconds / 1000, milliseconds % 1000);
        let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}"
        )?;
        if fraction > 0 {
            write!(f, ".{fraction:03}")?;
        }
        write!(f, "Z")
    }
}

impl std::str::FromStr for Instant {
    type Err = Error;

    /// Reads ISO 8601: `2026-06-21T18:30Z`, `2026-06-21T18:30:15.25Z`, `2026-06-21 20:30+02:00`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another form and for a time without `Z` or offset; [`Error::OutOfRange`] for a
    /// date or time that does not exist or lies outside 1900 to 2100.
    fn from_str(text: &str) -> Result<Self> {
        let unreadable = || Error::invalid(format!("time '{text}' is not understood"), FORM);
        let (date, clock) = text
            .trim()
            .split_once(['T', 't', ' '])
            .ok_or_else(unreadable)?;
        let (clock, offset_s) = split_offset(clock).ok_or_else(unreadable)?;
        let (year, month, day) = parse_date(date).ok_or_else(unreadable)?;
        let (hour, minute, second) = parse_clock(clock).ok_or_else(unreadable)?;
        let local = Self::from_utc(year, month, day, hour, minute, second)?;
        let offset_s = offset_s.ok_or_else(|| {
            Error::invalid(
                format!("time '{text}' does not say in which time zone it is"),
                format!("add Z for UTC or an offset: {text}Z, {text}+02:00"),
            )
        })?;
        local.earlier_by(offset_s)
    }
}

impl serde::Serialize for Instant {
    fn serialize<S: serde::Serializer>(&self, s: S) -> std::result::Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

/// Clock and offset from UTC in seconds; no offset if the text has none; `None` if the offset is not one.
fn split_offset(text: &str) -> Option<(&str, Option<i64>)> {
    if let Some(clock) = text.strip_suffix(['Z', 'z']) {
        return Some((clock, Some(0)));
    }
    // The Unicode minus sign is ISO 8601's own.
    let Some(at) = text.find(['+', '-', '−']) else {
        return Some((text, None));
    };
    let (clock, offset) = text.split_at(at);
    let sign = if offset.starts_with('+') { 1 } else { -1 };
    let digits = offset.trim_start_matches(['+', '-', '−']);
    let (hours, minutes) = match digits.split_once(':') {
        Some((h, m)) => (natural(h, 2)?, natural(m, 2)?),
        None if digits.len() == 4 && digits.is_ascii() => {
            (natural(&digits[..2], 2)?, natural(&digits[2..], 2)?)
        }
        None => (natural(digits, 2)?, 0),
    };
    (hours <= 23 && minutes <= 59).then_some((clock, Some(sign * (hours * 3600 + minutes * 60))))
}

fn parse_date(text: &str) -> Option<(i64, i64, i64)> {
    let (negative, unsigned) = match text.strip_prefix(['-', '−']) {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let mut parts = unsigned.split('-');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() || year.is_empty() || year.len() > 9 {
        return None;
    }
    let year = natural(year, year.len())?;
    let year = if negative { -year } else { year };
    Some((year, natural(month, 2)?, natural(day, 2)?))
}

fn parse_clock(text: &str) -> Option<(i64, i64, f64)> {
    let mut parts = text.split(':');
    let (hour, minute) = (natural(parts.next()?, 2)?, natural(parts.next()?, 2)?);
    let second = match parts.next() {
        None => 0.0,
        Some(s) => {
            let (whole, fraction) = s.split_once(['.', ',']).unwrap_or((s, "0"));
            natural(whole, 2)?;
            natural(fraction, fraction.len())?;
            format!("{whole}.{fraction}").parse().ok()?
        }
    };
    parts.next().is_none().then_some((hour, minute, second))
}

/// A number of exactly `digits` decimal digits.
fn natural(text: &str, digits: usize) -> Option<i64> {
    let plain = !text.is_empty() && text.len() == digits && digits <= 18;
    (plain && text.bytes().all(|b| b.is_ascii_digit()))
        .then(|| text.parse().ok())
        .flatten()
}

fn check_part(name: &str, value: i64, range: std::ops::RangeInclusive<i64>) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let range = format!("[{}, {}]", range.start(), range.end());
    Err(Error::out_of_range(name, value as f64, "", range))
}

fn days_in_month(year: i64, month: i64) -> i64 {
    match month {
        2 if year % 4 == 0 && (year % 100 != 0 || year % 400 == 0) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

/// Days since 1970-01-01 of a Gregorian date; years counted from March so that leap days come last.
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let (y, m) = if month <= 2 {
        (year - 1, month + 9)
    } else {
        (year, month - 3)
    };
    // 306 = days from 1 March to 1 January; 719162 = days from 0001-01-01 to 1970-01-01.
    365 * y + y / 4 - y / 100 + y / 400 + (m * 306 + 5) / 10 + (day - 1) - 306 - 719_162
}

/// Gregorian date of a number of days since 1970-01-01.
fn civil_from_days(days: i64) -> (i64, i64, i64) {
    // Never too small, for no year is shorter than 365 days.
    let mut year = 1971 + days / 365;
    while days_from_civil(year, 1, 1) > days {
        year -= 1;
    }
    let mut month = 12;
    while days_from_civil(year, month, 1) > days {
        month -= 1;
    }
    (year, month, days - days_from_civil(year, month, 1) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Instant> {
        text.parse()
    }

    #[test]
    fn forms_of_the_same_instant() {
        let expected = Instant::from_utc(2026, 6, 21, 18, 30, 0.0).unwrap();
        for text in [
            "2026-06-21T18:30Z",
            "2026-06-21T18:30:00Z",
            "2026-06-21t18:30:00.000z",
            "2026-06-21 18:30+00:00",
            "2026-06-21T20:30+02:00",
            "2026-06-21T20:30+0200",
            "2026-06-21T11:30-07",
            "2026-06-22T00:15+05:45",
        ] {
            assert_eq!(read(text).unwrap(), expected, "{text}");
        }
        let fraction = read("2026-06-21T18:30:01,25Z").unwrap();
        assert_eq!(fraction.to_string(), "2026-06-21T18:30:01.250Z");
    }

    #[test]
    fn dates_run_through_the_calendar() {
        // Julian dates: J2000 and the first day of the Unix epoch.
        assert_eq!(
            read("2000-01-01T12:00Z").unwrap().julian_date(),
            2_451_545.0
        );
        assert_eq!(
            read("1970-01-01T00:00Z").unwrap().julian_date(),
            2_440_587.5
        );
        // Meeus, Astronomical Algorithms, table 7.A: 1900 January 1.0 is JD 2415020.5.
        assert_eq!(
            read("1900-01-01T00:00Z").unwrap().julian_date(),
            2_415_020.5
        );
        let first = days_from_civil(1900, 1, 1);
        let mut last = (1899, 12, 31);
        for day in first..=days_from_civil(2100, 12, 31) {
            let (y, m, d) = civil_from_days(day);
            assert_eq!(days_from_civil(y, m, d), day);
            assert!((y, m, d) > last && d <= days_in_month(y, m));
            last = (y, m, d);
        }
        assert_eq!(last, (2100, 12, 31));
        let day = read("2024-12-31T12:00Z").unwrap().day_of_year();
        assert_eq!(day, 366.5);
        assert!((read("2023-07-02T12:00Z").unwrap().decimal_year() - 2023.5).abs() < 1e-12);
        assert_eq!(read("2023-01-16T12:00Z").unwrap().month_position(), 0.0);
    }

    #[test]
    fn a_naive_time_is_refused_with_a_hint() {
        let e = read("2026-06-21T18:30").unwrap_err();
        assert!(e.to_string().contains("time zone"));
        assert!(e.hint().contains("2026-06-21T18:30Z"));
    }

    #[test]
    fn what_does_not_exist_is_refused() {
        for (text, name) in [
            ("-0001-06-21T18:30Z", "year"),
            ("-1-06-21T18:30Z", "year"),
            ("3000-06-21T18:30Z", "year"),
            ("2026-13-21T18:30Z", "month"),
            ("2026-02-29T18:30Z", "day"),
            ("2100-02-29T18:30Z", "day"),
            ("2026-06-31T18:30Z", "day"),
            ("2026-06-00T18:30Z", "day"),
            ("2026-06-21T24:00Z", "hour"),
            ("2026-06-21T18:60Z", "minute"),
            ("2026-06-21T18:30:60Z", "second"),
            ("1900-01-01T00:30+01:00", "year"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.starts_with(name), "{text}: {message}");
        }
        for text in [
            "",
            "noon",
            "2026-06-21",
            "2026-06-21TZ",
            "2026-6-21T18:30Z",
            "2026-06-21T18Z",
            "2026-06-21T18:30:aaZ",
            "2026-06-21T18:30+",
            "2026-06-21T18:30+25:00",
            "2026-06-21T18:30+2:00:00",
            "2026-06-21T18:30:00.Z",
            "2026-06-21T18:30:15:00Z",
            "NaN-06-21T18:30Z",
            "2026-06-21T18:30+é€",
            "99999999999999999999-01-01T00:00Z",
        ] {
            let e = read(text).unwrap_err();
            assert!(matches!(e, Error::Invalid { .. }), "{text}: {e}");
        }
    }
}
