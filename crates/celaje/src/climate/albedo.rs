//! Presets of the ground's albedo.

use crate::error::{check_range, Error, Result};

/// A kind of ground and its broadband albedo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlbedoPreset {
    /// Name on the command line.
    pub name: &'static str,
    /// Lowest usual albedo \[1\].
    pub low: f64,
    /// Highest usual albedo \[1\].
    pub high: f64,
}

impl AlbedoPreset {
    /// The preset's value: the middle of its range \[1\].
    pub fn value(&self) -> f64 {
        0.5 * (self.low + self.high)
    }
}

const fn preset(name: &'static str, low: f64, high: f64) -> AlbedoPreset {
    AlbedoPreset { name, low, high }
}

/// All presets; `grass` spans long and short grass.
///
/// # Source
/// Budikova 2013, Albedo, The Encyclopedia of Earth.
pub const ALBEDO_PRESETS: [AlbedoPreset; 18] = [
    preset("dark-wet-soil", 0.05, 0.05),
    preset("light-dry-soil", 0.40, 0.40),
    preset("sand", 0.15, 0.45),
    preset("grass", 0.16, 0.26),
    preset("long-grass", 0.16, 0.16),
    preset("short-grass", 0.26, 0.26),
    preset("crops", 0.18, 0.25),
    preset("tundra", 0.18, 0.25),
    preset("deciduous-forest", 0.15, 0.20),
    preset("coniferous-forest", 0.05, 0.15),
    preset("water-sun-high", 0.03, 0.10),
    preset("water-sun-low", 0.10, 1.00),
    preset("old-snow", 0.40, 0.40),
    preset("fresh-snow", 0.95, 0.95),
    preset("sea-ice", 0.30, 0.45),
    preset("glacier-ice", 0.20, 0.40),
    preset("thick-cloud", 0.60, 0.90),
    preset("thin-cloud", 0.30, 0.50),
];

/// The ground's albedo as a user gives it: a number or the name of a preset.
#[derive(Debug, Clone, PartialEq)]
pub enum Albedo {
    /// A number in \[0, 1\].
    Value(f64),
    /// One of [`ALBEDO_PRESETS`].
    Preset(AlbedoPreset),
}

impl Albedo {
    /// A number, checked.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside \[0, 1\].
    pub fn new(value: f64) -> Result<Self> {
        check_range("albedo", value, "", 0.0..=1.0)?;
        Ok(Self::Value(value))
    }

    /// The albedo \[1\].
    pub fn value(&self) -> f64 {
        match self {
            Self::Value(value) => *value,
            Self::Preset(preset) => preset.value(),
        }
    }
}

impl std::str::FromStr for Albedo {
    type Err = Error;

    /// Reads `0.2` or the name of a preset.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a number outside \[0, 1\]; [`Error::UnknownName`] for another word.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        if let Ok(value) = text.parse::<f64>() {
            return Self::new(value);
        }
        let found = ALBEDO_PRESETS.into_iter().find(|p| p.name == text);
        found.map(Self::Preset).ok_or_else(|| Error::UnknownName {
            kind: "albedo",
            name: text.to_owned(),
            known: ALBEDO_PRESETS.map(|p| p.name.to_owned()).to_vec(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names() {
        let read = |text: &str| text.parse::<Albedo>();
        assert_eq!(read("0.35").unwrap().value(), 0.35);
        assert!((read("sand").unwrap().value() - 0.30).abs() < 1e-15);
        assert!((read("crops").unwrap().value() - 0.215).abs() < 1e-15);
        assert_eq!(
            read("1.2").unwrap_err().to_string(),
            "albedo = 1.2 is outside [0, 1]"
        );
        assert!(matches!(read("NaN"), Err(Error::OutOfRange { .. })));
        assert!(read("sanb")
            .unwrap_err()
            .hint()
            .contains("did you mean 'sand'"));
        for p in ALBEDO_PRESETS {
            assert!((0.0..=1.0).contains(&p.low) && p.low <= p.high && p.high <= 1.0);
        }
    }
}
