//! Reading the embedded CSV tables of aerosols.

use crate::error::{Error, Result};

/// Rows of a table without its comments (`#`) and its header, split at commas.
pub(super) fn rows(csv: &str) -> impl Iterator<Item = Vec<&str>> {
    csv.lines()
        .filter(|line| !line.starts_with('#') && !line.is_empty())
        .skip(1)
        .map(|line| line.split(',').collect())
}

/// A field as a number.
pub(super) fn number(field: &str) -> Result<f64> {
    field.parse().map_err(|_| {
        Error::invalid(
            format!("'{field}' in an embedded table is not a number"),
            "the program was built from damaged data; build it again",
        )
    })
}
