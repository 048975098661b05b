//! Helpers shared by the reference tests.

/// Rows of a CSV file without its comments (`#`) and header.
pub fn rows(csv: &str) -> Vec<Vec<&str>> {
    csv.lines()
        .filter(|line| !line.starts_with('#') && !line.is_empty())
        .skip(1)
        .map(|line| line.split(',').collect())
        .collect()
}
