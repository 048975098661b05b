//! Summer and winter halves of the year.

use crate::place::Instant;

/// Half of the year, as the sun knows it at a latitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Season {
    /// April to September in the north, October to March in the south.
    Summer,
    /// October to March in the north, April to September in the south.
    Winter,
}

impl Season {
    /// The season at a latitude; the equator counts as north.
    pub fn at(latitude_deg: f64, instant: &Instant) -> Self {
        let (_, month, _) = instant.date();
        if (4..=9).contains(&month) == (latitude_deg >= 0.0) {
            Self::Summer
        } else {
            Self::Winter
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seasons_are_opposite_across_the_equator() {
        let july: Instant = "2026-07-01T00:00Z".parse().unwrap();
        let december: Instant = "2026-12-21T00:00Z".parse().unwrap();
        assert_eq!(Season::at(45.0, &july), Season::Summer);
        assert_eq!(Season::at(-45.0, &july), Season::Winter);
        assert_eq!(Season::at(45.0, &december), Season::Winter);
        assert_eq!(Season::at(-45.0, &december), Season::Summer);
    }
}
