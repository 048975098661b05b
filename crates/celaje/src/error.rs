//! The one error type of the library.
//!
//! Every message names the argument, its value, its unit and the range allowed; [`Error::hint`] adds what to
//! do about it. The command line prints the two as `error: …` and `hint: …`.

/// Shorthand used by every fallible function of the crate.
pub type Result<T> = std::result::Result<T, Error>;

/// What can go wrong, worded for the person who gave the input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its range, or not a number at all.
    #[error("{name} = {value}{} is outside {range}", unit_suffix(.unit))]
    OutOfRange {
        /// Argument, as the user writes it.
        name: String,
        /// The value given.
        value: f64,
        /// Unit, empty for a pure number.
        unit: &'static str,
        /// Allowed range in words, such as `[-90, 90]`.
        range: String,
        /// What to do.
        hint: String,
    },
    /// An array whose shape does not fit the others.
    #[error("{name} has shape {got}, expected {expected}")]
    ShapeMismatch {
        /// Argument, as the user writes it.
        name: String,
        /// Shape given.
        got: String,
        /// Shape wanted.
        expected: String,
    },
    /// A name that is in none of our lists.
    #[error("unknown {kind} '{name}'")]
    UnknownName {
        /// What was looked up: `aerosol`, `albedo`, …
        kind: &'static str,
        /// The name given.
        name: String,
        /// All names known.
        known: Vec<String>,
    },
    /// Any other input that makes no sense.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do.
        hint: String,
    },
    /// A job too large for the machine.
    #[error("{what} would take {} of memory; the limit is {}", human_bytes(*.bytes), human_bytes(*.limit_bytes))]
    TooLarge {
        /// What was asked for.
        what: String,
        /// Memory it would take.
        bytes: u128,
        /// Memory allowed.
        limit_bytes: u128,
    },
    /// A file that cannot be read or written.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: String,
        /// What the system said.
        message: String,
        /// What to do.
        hint: String,
    },
    /// The user stopped the work.
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// An [`Error::OutOfRange`] without a hint of its own.
    pub fn out_of_range(
        name: impl Into<String>,
        value: f64,
        unit: &'static str,
        range: impl Into<String>,
    ) -> Self {
        Self::OutOfRange {
            name: name.into(),
            value,
            unit,
            range: range.into(),
            hint: String::new(),
        }
    }

    /// An [`Error::Invalid`].
    pub fn invalid(message: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Invalid {
            message: message.into(),
            hint: hint.into(),
        }
    }

    /// One sentence that says how to mend the input; empty when there is nothing to add.
    pub fn hint(&self) -> String {
        match self {
            Self::OutOfRange { hint, range, .. } if hint.is_empty() => {
                format!("give a value in {range}")
            }
            Self::OutOfRange { hint, .. }
            | Self::Invalid { hint, .. }
            | Self::File { hint, .. } => hint.clone(),
            Self::UnknownName { name, known, .. } => {
                let list = known.join(", ");
                match nearest(name, known) {
                    Some(best) => format!("did you mean '{best}'? known: {list}"),
                    None => format!("known: {list}"),
                }
            }
            Self::ShapeMismatch { .. } => "make the arrays agree".to_owned(),
            Self::TooLarge { .. } => "ask for fewer pixels or wavelengths".to_owned(),
            Self::Interrupted => String::new(),
        }
    }
}

/// Checks that a number is finite and inside a closed range.
///
/// # Errors
/// [`Error::OutOfRange`] with the range in its message and as its hint.
pub fn check_range(
    name: &str,
    value: f64,
    unit: &'static str,
    range: std::ops::RangeInclusive<f64>,
) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(Error::out_of_range(
        name,
        value,
        unit,
        format!("[{}, {}]", range.start(), range.end()),
    ))
}

fn unit_suffix(unit: &str) -> String {
    if unit.is_empty() {
        String::new()
    } else {
        format!(" {unit}")
    }
}

fn human_bytes(bytes: u128) -> String {
    let gib = bytes as f64 / f64::from(1u32 << 30);
    if gib >= 1.0 {
        format!("{gib:.1} GiB")
    } else {
        format!("{:.1} MiB", gib * 1024.0)
    }
}

/// The known name with the smallest edit distance, if it is close enough to be meant.
fn nearest<'a>(name: &str, known: &'a [String]) -> Option<&'a str> {
    known
        .iter()
        .map(|k| (edit_distance(&name.to_lowercase(), &k.to_lowercase()), k))
        .min_by_key(|(d, _)| *d)
        .filter(|(d, k)| *d <= 2 + k.len() / 4)
        .map(|(_, k)| k.as_str())
}

/// Levenshtein distance between two short strings.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn out_of_range_names_value_unit_and_range() {
        let e = check_range("latitude", 91.0, "deg", -90.0..=90.0).unwrap_err();
        assert_eq!(e.to_string(), "latitude = 91 deg is outside [-90, 90]");
        assert_eq!(e.hint(), "give a value in [-90, 90]");
        assert!(check_range("latitude", f64::NAN, "deg", -90.0..=90.0).is_err());
    }

    #[test]
    fn unknown_name_suggests_the_nearest_spelling() {
        let e = Error::UnknownName {
            kind: "aerosol",
            name: "dessert".into(),
            known: vec!["desert".into(), "rural".into()],
        };
        assert!(e.hint().starts_with("did you mean 'desert'?"));
    }
}
