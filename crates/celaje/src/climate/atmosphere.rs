//! Which reference atmosphere a place and a season call for.

use super::blend::july_weight;
use crate::error::{Error, Result};
use crate::place::Instant;

/// The reference atmospheres: US Standard 1976 and the AFGL 1986 set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AtmosphereClass {
    /// U.S. Standard Atmosphere 1976.
    Us76,
    /// AFGL tropical, 15° N annual mean.
    Tropical,
    /// AFGL mid-latitude summer, 45° N July.
    MidlatitudeSummer,
    /// AFGL mid-latitude winter, 45° N January.
    MidlatitudeWinter,
    /// AFGL sub-arctic summer, 60° N July.
    SubarcticSummer,
    /// AFGL sub-arctic winter, 60° N January.
    SubarcticWinter,
    /// AFGL's own table of the U.S. standard, with its ozone.
    AfglStandard,
}

impl AtmosphereClass {
    /// All of them, the standard first.
    pub const ALL: [Self; 7] = [
        Self::Us76,
        Self::Tropical,
        Self::MidlatitudeSummer,
        Self::MidlatitudeWinter,
        Self::SubarcticSummer,
        Self::SubarcticWinter,
        Self::AfglStandard,
    ];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Us76 => "us76",
            Self::Tropical => "tropical",
            Self::MidlatitudeSummer => "midlatitude-summer",
            Self::MidlatitudeWinter => "midlatitude-winter",
            Self::SubarcticSummer => "subarctic-summer",
            Self::SubarcticWinter => "subarctic-winter",
            Self::AfglStandard => "afgl-standard",
        }
    }

    /// One line that says what it is.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Us76 => "U.S. Standard Atmosphere 1976, 45° N annual mean",
            Self::Tropical => "AFGL 1986 tropical, 15° N annual mean",
            Self::MidlatitudeSummer => "AFGL 1986 mid-latitude summer, 45° N July",
            Self::MidlatitudeWinter => "AFGL 1986 mid-latitude winter, 45° N January",
            Self::SubarcticSummer => "AFGL 1986 sub-arctic summer, 60° N July",
            Self::SubarcticWinter => "AFGL 1986 sub-arctic winter, 60° N January",
            Self::AfglStandard => "AFGL 1986 U.S. standard, its own table of it",
        }
    }

    /// Precipitable water of the reference atmosphere above sea level \[mm\] (Anderson et al. 1986, integrated log-linearly);
    /// US76 is dry by definition and is given that of AFGL's standard.
    pub fn water_mm(self) -> f64 {
        match self {
            Self::Tropical => 41.2,
            Self::MidlatitudeSummer => 29.2,
            Self::MidlatitudeWinter => 8.5,
            Self::SubarcticSummer => 20.8,
            Self::SubarcticWinter => 4.2,
            Self::Us76 | Self::AfglStandard => 14.2,
        }
    }

    /// The atmosphere of that name.
    ///
    /// # Errors
    /// [`Error::UnknownName`] with the names there are.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|a| a.name() == name);
        found.ok_or_else(|| Error::UnknownName {
            kind: "atmosphere",
            name: name.to_owned(),
            known: Self::ALL.map(|a| a.name().to_owned()).to_vec(),
        })
    }
}

/// Reference atmospheres with their weights, which sum to 1.
pub type AtmosphereBlend = Vec<(AtmosphereClass, f64)>;

/// The AFGL atmospheres of a place and an instant, blended so that nothing jumps.
///
/// Linear in latitude between 15°, 45° and 60°, where the atmospheres are from, and a cosine between their months,
/// mid-January and mid-July; the south is half a year behind.
pub fn blended_atmosphere(latitude_deg: f64, instant: &Instant) -> AtmosphereBlend {
    use AtmosphereClass as A;
    let july = july_weight(instant);
    let summer = if latitude_deg < 0.0 { 1.0 - july } else { july };
    let latitude = latitude_deg.abs();
    let middle_from_tropics = ((latitude - 15.0) / 30.0).clamp(0.0, 1.0);
    let subarctic = ((latitude - 45.0) / 15.0).clamp(0.0, 1.0);
    let middle = middle_from_tropics * (1.0 - subarctic);
    let mut blend = vec![
        (A::Tropical, 1.0 - middle_from_tropics),
        (A::MidlatitudeSummer, middle * summer),
        (A::MidlatitudeWinter, middle * (1.0 - summer)),
        (A::SubarcticSummer, subarctic * summer),
        (A::SubarcticWinter, subarctic * (1.0 - summer)),
    ];
    blend.retain(|(_, weight)| *weight > 0.0);
    blend
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read() {
        for class in AtmosphereClass::ALL {
            assert_eq!(AtmosphereClass::named(class.name()).unwrap(), class);
        }
        let unknown = AtmosphereClass::named("us67").unwrap_err();
        assert!(unknown.hint().contains("did you mean 'us76'"));
    }

    #[test]
    fn blends_are_whole_and_meet_the_classes() {
        use AtmosphereClass as A;
        let july: Instant = "2021-07-16T12:00Z".parse().unwrap();
        let weight = |lat: f64, class: A| {
            let blend = blended_atmosphere(lat, &july);
            let sum: f64 = blend.iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-12);
            blend
                .iter()
                .find(|(c, _)| *c == class)
                .map_or(0.0, |(_, w)| *w)
        };
        assert!((weight(15.0, A::Tropical) - 1.0).abs() < 1e-12);
        assert!((weight(45.0, A::MidlatitudeSummer) - 1.0).abs() < 1e-12);
        assert!((weight(-45.0, A::MidlatitudeWinter) - 1.0).abs() < 1e-12);
        assert!((weight(70.0, A::SubarcticSummer) - 1.0).abs() < 1e-12);
        assert!((weight(30.0, A::Tropical) - 0.5).abs() < 1e-12);
        assert!((weight(-52.5, A::SubarcticWinter) - 0.5).abs() < 1e-12);
    }
}
