//! Aerosol types: which particles, how many, and how high.
//!
//! Two families. **OPAC** (Hess, Koepke & Schult 1998): every component has its own log-normal, hygroscopic ones
//! swell; a mixing layer by type, then the same free troposphere and stratosphere for all. **AIAA** (G-065-1999): one
//! distribution of three modes (Jaenicke 1993) shared by components that differ in matter; number falls off
//! exponentially and ends smoothly at the tropopause, above which OPAC's stratospheric sulphate takes over.
//!
//! Jaenicke's distributions are of the air as it is, so humidity changes only the index of AIAA components, not their
//! size.

use super::opac;
use super::particle::{LognormalMode, Particle, SizeDistribution};
use super::table::{number, rows};
use crate::error::{check_range, Error, Result};

const OPAC_TYPES: &str = include_str!("../../../../data/aerosol_opac/types.csv");
const OPAC_LAYERS: &str = include_str!("../../../../data/aerosol_opac/layers.csv");
const OPAC_UPPER: &str = include_str!("../../../../data/aerosol_opac/upper_layers.csv");
const AIAA_TYPES: &str = include_str!("../../../../data/aerosol_aiaa/types.csv");
const AIAA_SIZES: &str = include_str!("../../../../data/aerosol_aiaa/size_distributions.csv");

/// Bounds of the AIAA distributions \[µm\]: the desert's coarse mode needs the upper one.
const AIAA_RADII_UM: [f64; 2] = [0.001, 100.0];
/// A mixing layer goes on below sea level (Dead Sea shore: −430 m).
const BELOW_SEA_LEVEL_M: f64 = -1000.0;
/// Depth over which AIAA types fade out below the tropopause \[m\].
const TAPER_M: f64 = 2000.0;
/// Top of the stratospheric layer of OPAC \[m\], also given to the AIAA types.
const STRATOSPHERE_TOP_M: f64 = 35e3;

/// How number density falls off with altitude above sea level, relative to its value at a reference.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum VerticalProfile {
    /// `exp(−(z − reference) / scale height)` from `bottom` to `top`, nothing outside; an infinite scale height is
    /// constant.
    Slab {
        /// Altitude where the profile is 1 \[m\].
        reference_m: f64,
        /// Lower edge \[m\].
        bottom_m: f64,
        /// Upper edge \[m\].
        top_m: f64,
        /// Scale height \[m\], may be infinite.
        scale_height_m: f64,
    },
    /// `exp(−z / scale height)`, brought smoothly to zero over the last 2 km below the tropopause.
    Tropospheric {
        /// Scale height \[m\], may be infinite.
        scale_height_m: f64,
        /// Altitude where the aerosol ends \[m\].
        tropopause_m: f64,
    },
}

impl VerticalProfile {
    /// Value relative to the reference \[1\] at an altitude above sea level \[m\].
    pub fn relative(&self, altitude_m: f64) -> f64 {
        match *self {
            Self::Slab {
                reference_m,
                bottom_m,
                top_m,
                scale_height_m,
            } => {
                if (bottom_m..=top_m).contains(&altitude_m) {
                    (-(altitude_m - reference_m) / scale_height_m).exp()
                } else {
                    0.0
                }
            }
            Self::Tropospheric {
                scale_height_m,
                tropopause_m,
            } => {
                let t = ((tropopause_m - altitude_m) / TAPER_M).clamp(0.0, 1.0);
                (-altitude_m / scale_height_m).exp() * t * t * (3.0 - 2.0 * t)
            }
        }
    }

    /// `∫ relative dz` \[m\] from an altitude upwards.
    pub fn column_above(&self, altitude_m: f64) -> f64 {
        match *self {
            Self::Slab {
                reference_m,
                bottom_m,
                top_m,
                scale_height_m,
            } => {
                let from = altitude_m.max(bottom_m);
                if from >= top_m {
                    0.0
                } else if scale_height_m.is_infinite() {
                    top_m - from
                } else {
                    let at = |z: f64| (-(z - reference_m) / scale_height_m).exp();
                    scale_height_m * (at(from) - at(top_m))
                }
            }
            Self::Tropospheric { tropopause_m, .. } => {
                // Simpson's rule on either side of the taper's start, where the third derivative jumps.
                let taper_m = tropopause_m - TAPER_M;
                let from = altitude_m.min(tropopause_m);
                self.simpson(from, from.max(taper_m))
                    + self.simpson(from.max(taper_m), tropopause_m)
            }
        }
    }

    /// Altitudes at which the profile jumps or bends \[m\], increasing; a medium should have its nodes there.
    pub fn breaks_m(&self) -> [f64; 2] {
        match *self {
            Self::Slab {
                bottom_m, top_m, ..
            } => [bottom_m, top_m],
            Self::Tropospheric { tropopause_m, .. } => [tropopause_m - TAPER_M, tropopause_m],
        }
    }

    fn simpson(&self, from_m: f64, to_m: f64) -> f64 {
        const PANELS: usize = 200;
        let step = (to_m - from_m) / (2 * PANELS) as f64;
        let value = |i: usize| {
            let weight = if i == 0 || i == 2 * PANELS {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
            weight * self.relative(from_m + step * i as f64)
        };
        (0..=2 * PANELS).map(value).sum::<f64>() * step / 3.0
    }
}

/// Altitude of the tropopause \[m\]: 17 km at the equator, falling smoothly to 9 km at the poles.
///
/// `latitude_deg` \[deg\], -90 to 90.
///
/// # Errors
/// [`Error::OutOfRange`].
pub fn tropopause_m(latitude_deg: f64) -> Result<f64> {
    check_range("latitude", latitude_deg, "deg", -90.0..=90.0)?;
    Ok(9000.0 + 8000.0 * latitude_deg.to_radians().cos().powi(2))
}

/// Where a component's particles come from.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ParticleSource {
    /// A component of OPAC at the humidity of the air.
    Opac(String),
    /// A component of OPAC at a humidity of its own \[%\].
    OpacAt(String, f64),
    /// The matter of an OPAC component in particles of another size; the humidity \[%\] is the air's if `None`.
    OpacMatter(String, Option<f64>, SizeDistribution),
    /// Given particles, whatever the humidity.
    Fixed(Particle),
}

impl ParticleSource {
    /// The particles as they are at a relative humidity \[%\], 0 to 99.
    ///
    /// # Errors
    /// As [`opac::component`].
    pub fn particle(&self, humidity_percent: f64) -> Result<Particle> {
        match self {
            Self::Opac(id) => opac::component(id, humidity_percent),
            Self::OpacAt(id, own) => opac::component(id, *own),
            Self::OpacMatter(id, own, size) => Ok(Particle {
                id: id.clone(),
                size: size.clone(),
                index: opac::refractive_index(id, own.unwrap_or(humidity_percent))?,
            }),
            Self::Fixed(particle) => Ok(particle.clone()),
        }
    }
}

/// One component of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerComponent {
    /// Its particles.
    pub source: ParticleSource,
    /// Number density where the layer's profile is 1 \[m⁻³\].
    pub number_density: f64,
}

/// Components that share a vertical profile.
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolLayer {
    /// `troposphere`, `mixing layer`, `free troposphere`, `stratosphere`.
    pub name: String,
    /// What it is made of.
    pub components: Vec<LayerComponent>,
    /// How it thins out with altitude.
    pub profile: VerticalProfile,
    /// Whether a given optical depth sets the amount (troposphere), or it stays as tabulated (stratosphere).
    pub scales_with_aod: bool,
}

/// An aerosol from the ground to space.
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolType {
    /// Full name, such as `opac:continental-average` or `desert`.
    pub name: String,
    /// From the lowest upwards; layers may overlap.
    pub layers: Vec<AerosolLayer>,
    /// Optical depth at 550 nm to use when none is given; `None` means as tabulated (OPAC).
    pub default_aod_550: Option<f64>,
}

impl AerosolType {
    /// A type by its name, over a latitude \[deg\] that sets the tropopause.
    ///
    /// Bare names (or `aiaa:NAME`) are AIAA, `opac:NAME` is OPAC; case and `_` for `-` do not matter.
    ///
    /// # Errors
    /// [`Error::UnknownName`] with all known names; [`Error::OutOfRange`] for the latitude.
    pub fn named(name: &str, latitude_deg: f64) -> Result<Self> {
        let tropopause_m = tropopause_m(latitude_deg)?;
        let plain = name.trim().to_lowercase().replace('_', "-");
        let known = aerosol_names();
        let plain = plain.strip_prefix("aiaa:").unwrap_or(&plain);
        if !known.iter().any(|k| k == plain) {
            return Err(Error::UnknownName {
                kind: "aerosol",
                name: name.to_owned(),
                known,
            });
        }
        match plain.strip_prefix("opac:") {
            Some(opac) => opac_type(opac),
            None => aiaa_type(plain, tropopause_m),
        }
    }
}

/// Names of all aerosol types: AIAA bare, OPAC with its prefix.
pub fn aerosol_names() -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (csv, prefix) in [(AIAA_TYPES, ""), (OPAC_TYPES, "opac:")] {
        for row in rows(csv) {
            let name = format!("{prefix}{}", row[0].replace('_', "-"));
            if names.last() != Some(&name) {
                names.push(name);
            }
        }
    }
    names
}

fn opac_type(name: &str) -> Result<AerosolType> {
    let key = name.replace('-', "_");
    let mut components = Vec::new();
    for row in rows(OPAC_TYPES).filter(|row| row[0] == key) {
        components.push(LayerComponent {
            source: ParticleSource::Opac(row[1].to_owned()),
            number_density: number(row[2])? * 1e6,
        });
    }
    let mut layers = Vec::new();
    for row in rows(OPAC_LAYERS).filter(|row| row[0] == key) {
        let bottom_m = number(row[1])? * 1e3;
        layers.push(AerosolLayer {
            name: "mixing layer".to_owned(),
            components: components.clone(),
            profile: VerticalProfile::Slab {
                reference_m: bottom_m,
                bottom_m: bottom_m + BELOW_SEA_LEVEL_M,
                top_m: number(row[2])? * 1e3,
                scale_height_m: opac_scale_height_m(row[3])?,
            },
            scales_with_aod: true,
        });
    }
    let mixing_top_m = layers
        .iter()
        .map(|layer| layer.profile.breaks_m()[1])
        .fold(0.0, f64::max);
    layers.push(opac_upper_layer("free_troposphere", mixing_top_m, true)?);
    layers.push(opac_upper_layer("stratosphere", mixing_top_m, false)?);
    Ok(AerosolType {
        name: format!("opac:{name}"),
        layers,
        default_aod_550: None,
    })
}

/// A layer that OPAC gives to every type, cut off below `from_m`.
fn opac_upper_layer(name: &str, from_m: f64, scales_with_aod: bool) -> Result<AerosolLayer> {
    let mut components = Vec::new();
    let mut profile = VerticalProfile::Slab {
        reference_m: 0.0,
        bottom_m: 0.0,
        top_m: 0.0,
        scale_height_m: f64::INFINITY,
    };
    for row in rows(OPAC_UPPER).filter(|row| row[0] == name) {
        components.push(LayerComponent {
            source: ParticleSource::OpacAt(row[1].to_owned(), number(row[2])?),
            number_density: number(row[3])? * 1e6,
        });
        let base_m = number(row[4])? * 1e3;
        profile = VerticalProfile::Slab {
            reference_m: base_m,
            bottom_m: base_m.max(from_m),
            top_m: number(row[5])? * 1e3,
            scale_height_m: opac_scale_height_m(row[6])?,
        };
    }
    Ok(AerosolLayer {
        name: name.replace('_', " "),
        components,
        profile,
        scales_with_aod,
    })
}

/// OPAC writes 99 km for "constant".
fn opac_scale_height_m(field: &str) -> Result<f64> {
    let km = number(field)?;
    Ok(if km >= 99.0 { f64::INFINITY } else { km * 1e3 })
}

fn aiaa_type(name: &str, tropopause_m: f64) -> Result<AerosolType> {
    let key = name.replace('-', "_");
    let mut parts = Vec::new();
    let (mut family, mut scale_height_m) = ("", f64::INFINITY);
    for row in rows(AIAA_TYPES).filter(|row| row[0] == key) {
        parts.push((row[1], number(row[2])?));
        family = row[3];
        scale_height_m = number(row[4])?;
    }
    let (size, total_m3) = aiaa_sizes(family)?;
    let sum: f64 = parts.iter().map(|(_, fraction)| fraction).sum();
    let components = parts
        .iter()
        .map(|(matter, fraction)| {
            let (id, humidity) = opac_matter(matter)?;
            Ok(LayerComponent {
                source: ParticleSource::OpacMatter(id.to_owned(), humidity, size.clone()),
                number_density: total_m3 * fraction / sum,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let mut stratosphere = opac_upper_layer("stratosphere", 0.0, false)?;
    stratosphere.profile = VerticalProfile::Slab {
        reference_m: tropopause_m,
        bottom_m: tropopause_m,
        top_m: STRATOSPHERE_TOP_M,
        scale_height_m: f64::INFINITY,
    };
    let troposphere = AerosolLayer {
        name: "troposphere".to_owned(),
        components,
        profile: VerticalProfile::Tropospheric {
            scale_height_m,
            tropopause_m,
        },
        scales_with_aod: true,
    };
    Ok(AerosolType {
        name: name.to_owned(),
        layers: vec![troposphere, stratosphere],
        default_aod_550: Some(0.12),
    })
}

/// Jaenicke's distribution of a family, and its number density \[m⁻³\].
fn aiaa_sizes(family: &str) -> Result<(SizeDistribution, f64)> {
    let mut modes = Vec::new();
    for row in rows(AIAA_SIZES).filter(|row| row[0] == family) {
        modes.push(LognormalMode {
            number_fraction: number(row[2])?,
            r_mode_um: number(row[3])?,
            sigma: 10f64.powf(number(row[4])?),
        });
    }
    let total_cm3: f64 = modes.iter().map(|m| m.number_fraction).sum();
    let [r_min_um, r_max_um] = AIAA_RADII_UM;
    Ok((
        SizeDistribution::new(modes, r_min_um, r_max_um)?,
        total_cm3 * 1e6,
    ))
}

/// The OPAC component whose index an AIAA component has, and its humidity if not the air's.
fn opac_matter(name: &str) -> Result<(&'static str, Option<f64>)> {
    match name {
        "sulfuric_acid" => Ok(("suso", Some(0.0))),
        "sulfate" => Ok(("suso", None)),
        "sea_salt" => Ok(("ssam", None)),
        "mineral" => Ok(("miam", None)),
        "soot" => Ok(("soot", None)),
        "water_soluble" => Ok(("waso", None)),
        "dust_like" => Ok(("inso", None)),
        other => Err(Error::invalid(
            format!("no refractive index for aerosol component '{other}'"),
            "the program was built from damaged data; build it again",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_type_can_be_built() {
        let names = aerosol_names();
        assert_eq!(names.len(), 20);
        for name in names {
            let aerosol = AerosolType::named(&name, 45.0).unwrap();
            assert!(
                aerosol.layers.iter().all(|l| !l.components.is_empty()),
                "{name}"
            );
        }
    }

    #[test]
    fn names_are_forgiving_and_errors_helpful() {
        assert_eq!(
            AerosolType::named("AIAA:Maritime_Clean", 0.0).unwrap().name,
            "maritime-clean"
        );
        let e = AerosolType::named("dessert", 0.0).unwrap_err();
        assert!(e.hint().contains("did you mean 'desert'"));
        assert!(e.hint().contains("opac:urban"));
    }

    /// The column must be the integral of the profile, from the ground and from a mountain.
    #[test]
    fn columns_are_integrals_of_the_profile() {
        for name in ["desert", "background", "opac:desert"] {
            for layer in AerosolType::named(name, 30.0).unwrap().layers {
                for ground_m in [0.0, 1500.0, 4000.0] {
                    let step = 1.0;
                    let sum: f64 = (0..40_000)
                        .map(|i| {
                            layer
                                .profile
                                .relative(ground_m + (f64::from(i) + 0.5) * step)
                        })
                        .sum();
                    let column = layer.profile.column_above(ground_m);
                    let error = (sum * step / column.max(1.0) - column / column.max(1.0)).abs();
                    assert!(error < 1e-6, "{name} {} {error}", layer.name);
                }
            }
        }
    }

    #[test]
    fn tropospheric_types_end_at_the_tropopause() {
        assert_eq!(tropopause_m(0.0).unwrap(), 17e3);
        assert!((tropopause_m(-90.0).unwrap() - 9e3).abs() < 1e-9);
        let layer = &AerosolType::named("background", 0.0).unwrap().layers[0];
        assert_eq!(layer.profile.relative(17e3), 0.0);
        assert_eq!(layer.profile.relative(14e3), 1.0);
    }
}
