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
use super::particle::{LognormalMode, Particle, RefractiveIndex, SizeDistribution};
use super::upper::Spectrum;

pub use super::profile::VerticalProfile;
use crate::error::{check_range, Error, Result};
use crate::math::Table;

const OPAC_TYPES: &str = include_str!("../../../../data/aerosol_opac/types.csv");
const OPAC_LAYERS: &str = include_str!("../../../../data/aerosol_opac/layers.csv");
const OPAC_UPPER: &str = include_str!("../../../../data/aerosol_opac/upper_layers.csv");
const AIAA_TYPES: &str = include_str!("../../../../data/aerosol_aiaa/types.csv");
const AIAA_SIZES: &str = include_str!("../../../../data/aerosol_aiaa/size_distributions.csv");

/// Bounds of the AIAA distributions \[µm\]: the desert's coarse mode needs the upper one.
const AIAA_RADII_UM: [f64; 2] = [0.001, 100.0];
/// A mixing layer goes on below sea level (Dead Sea shore: −430 m).
const BELOW_SEA_LEVEL_M: f64 = -1000.0;
/// Top of the stratospheric layer of OPAC \[m\], also given to the AIAA types.
const STRATOSPHERE_TOP_M: f64 = 35e3;

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
    /// The matter of an OPAC component in one of Jaenicke's size distributions.
    Aiaa {
        /// The OPAC component that has this matter.
        matter: String,
        /// Its relative humidity \[%\]; that of the air if `None`.
        humidity_percent: Option<f64>,
        /// Name of the size distribution, such as `maritime`.
        family: String,
    },
    /// Given particles, whatever the humidity.
    Fixed(Particle),
    /// No particles at all but their published optics: the "number density" is then the extinction coefficient at 550 nm
    /// \[m⁻¹\], and cross sections are relative to it.
    Spectrum(Spectrum),
}

impl ParticleSource {
    /// The particles as they are at a relative humidity \[%\], 0 to 99.
    ///
    /// # Errors
    /// As [`opac::component`]; [`Error::Invalid`] for a spectrum.
    pub fn particle(&self, humidity_percent: f64) -> Result<Particle> {
        match self {
            Self::Opac(id) => opac::component(id, humidity_percent),
            Self::OpacAt(id, own) => opac::component(id, *own),
            Self::Aiaa {
                matter,
                humidity_percent: own,
                family,
            } => Ok(Particle {
                id: matter.clone(),
                size: aiaa_sizes(family)?.0,
                index: opac::refractive_index(matter, own.unwrap_or(humidity_percent))?,
            }),
            Self::Fixed(particle) => Ok(particle.clone()),
            Self::Spectrum(spectrum) => Err(Error::invalid(
                format!(
                    "aerosol '{}' has no particles, only a spectrum",
                    spectrum.name()
                ),
                "take a component with a size distribution",
            )),
        }
    }

    /// Name of the shipped table of its optics: `waso`, `maritime/waso`; none for particles of one's own.
    pub fn table_name(&self) -> Option<String> {
        match self {
            Self::Opac(id) | Self::OpacAt(id, _) => Some(id.clone()),
            Self::Aiaa { matter, family, .. } => Some(format!("{family}/{matter}")),
            Self::Fixed(_) | Self::Spectrum(_) => None,
        }
    }

    /// The relative humidity that the particles are in \[%\], given that of the air; 0 if it does not matter to them.
    pub fn humidity_percent(&self, air_percent: f64) -> f64 {
        match self {
            Self::Opac(id) if opac::is_hygroscopic(id) => air_percent,
            Self::OpacAt(id, own) if opac::is_hygroscopic(id) => *own,
            Self::Aiaa {
                matter,
                humidity_percent,
                ..
            } if opac::is_hygroscopic(matter) => humidity_percent.unwrap_or(air_percent),
            _ => 0.0,
        }
    }

    /// The same particles at the humidity of the air, whatever their own.
    fn in_the_air(self) -> Self {
        match self {
            Self::OpacAt(id, _) => Self::Opac(id),
            Self::Aiaa { matter, family, .. } => Self::Aiaa {
                matter,
                humidity_percent: None,
                family,
            },
            other => other,
        }
    }

    /// Whether humidity changes its particles.
    pub fn is_hygroscopic(&self) -> bool {
        match self {
            Self::Opac(id) | Self::OpacAt(id, _) => opac::is_hygroscopic(id),
            Self::Aiaa { matter, .. } => opac::is_hygroscopic(matter),
            Self::Fixed(_) | Self::Spectrum(_) => false,
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

    /// The same aerosol with another vertical profile of its troposphere.
    ///
    /// The lowest layer takes the profile; further tropospheric layers, such as OPAC's free troposphere, are left out.
    pub fn with_profile(mut self, profile: VerticalProfile) -> Self {
        let mut lowest = true;
        self.layers.retain_mut(|layer| {
            let kept = lowest || !layer.scales_with_aod;
            if lowest {
                layer.profile = profile.clone();
                lowest = false;
            }
            kept
        });
        self
    }

    /// The same aerosol with layers of one's choice in place of its stratosphere (all that optical depth does not scale).
    pub fn with_upper_layers(mut self, upper: impl IntoIterator<Item = AerosolLayer>) -> Self {
        self.layers.retain(|layer| layer.scales_with_aod);
        self.layers.extend(upper);
        self
    }

    /// The layers that optical depth does not scale.
    pub fn upper_layers(&self) -> Vec<AerosolLayer> {
        let upper = self.layers.iter().filter(|layer| !layer.scales_with_aod);
        upper.cloned().collect()
    }
}

/// An aerosol of one's own: homogeneous spheres of one kind of matter.
///
/// ```
/// use celaje::composition::aerosol::{AerosolType, VerticalProfile};
/// use celaje::composition::particle::{RefractiveIndex, SizeDistribution};
/// # use celaje::composition::aerosol::Aerosol;
/// let smoke = Aerosol {
///     name: "smoke".into(),
///     refractive_index: RefractiveIndex::constant(1.52, 0.02)?,
///     size: SizeDistribution::lognormal(0.08, 1.6)?,
///     profile: VerticalProfile::sampled(vec![0.0, 2e3, 3e3, 5e3], vec![0.1, 0.2, 1.0, 0.0])?,
/// };
/// let smoke: AerosolType = smoke.into();
/// # Ok::<(), celaje::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Aerosol {
    /// What to call it.
    pub name: String,
    /// Index of its matter over wavelength.
    pub refractive_index: RefractiveIndex,
    /// How large its particles are.
    pub size: SizeDistribution,
    /// How it thins out with altitude; the amount is set by optical depth or visibility.
    pub profile: VerticalProfile,
}

impl Aerosol {
    /// Its particles.
    pub fn particle(&self) -> Particle {
        Particle {
            id: self.name.clone(),
            size: self.size.clone(),
            index: self.refractive_index.clone(),
        }
    }
}

impl From<Aerosol> for AerosolType {
    /// Tropospheric, at 1e9 particles per m³ where the profile is 1 until it is scaled, with nothing above it.
    fn from(own: Aerosol) -> Self {
        let component = LayerComponent {
            source: ParticleSource::Fixed(own.particle()),
            number_density: 1e9,
        };
        Self {
            name: own.name.clone(),
            layers: vec![AerosolLayer {
                name: own.name,
                components: vec![component],
                profile: own.profile,
                scales_with_aod: true,
            }],
            default_aod_550: Some(0.12),
        }
    }
}

/// Names of all aerosol types: AIAA bare, OPAC with its prefix.
pub fn aerosol_names() -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (csv, prefix) in [(AIAA_TYPES, ""), (OPAC_TYPES, "opac:")] {
        // The tables are embedded and tested; a damaged one has no types.
        let rows = Table::parse("aerosol types", csv).and_then(|table| table.words("type"));
        for row in rows.unwrap_or_default() {
            let name = format!("{prefix}{}", row.replace('_', "-"));
            if names.last() != Some(&name) {
                names.push(name);
            }
        }
    }
    names
}

/// Every kind of particle of the types there are, each once: what the shipped tables of optics must hold.
///
/// # Errors
/// [`Error::Invalid`] for damaged data.
pub fn all_sources() -> Result<Vec<ParticleSource>> {
    let mut sources: Vec<ParticleSource> = opac::COMPONENT_NAMES
        .iter()
        .map(|id| ParticleSource::Opac((*id).to_owned()))
        .collect();
    for name in aerosol_names() {
        for layer in AerosolType::named(&name, 45.0)?.layers {
            for component in layer.components {
                let named = |s: &ParticleSource| s.table_name() == component.source.table_name();
                if !sources.iter().any(named) {
                    sources.push(component.source.in_the_air());
                }
            }
        }
    }
    Ok(sources)
}

fn opac_type(name: &str) -> Result<AerosolType> {
    let key = name.replace('-', "_");
    let table = Table::parse("OPAC types", OPAC_TYPES)?.select("type", &key)?;
    let ids = table.words("component")?.into_iter();
    let components: Vec<LayerComponent> = ids
        .zip(table.numbers("number_cm3")?)
        .map(|(id, number_cm3)| LayerComponent {
            source: ParticleSource::Opac(id.to_owned()),
            number_density: number_cm3 * 1e6,
        })
        .collect();
    let table = Table::parse("OPAC layers", OPAC_LAYERS)?.select("type", &key)?;
    let (bottom_km, top_km) = (table.numbers("z_min_km")?, table.numbers("z_max_km")?);
    let scale_km = table.numbers("scale_height_km")?;
    let mut layers = Vec::new();
    for i in 0..table.len() {
        let bottom_m = bottom_km[i] * 1e3;
        layers.push(AerosolLayer {
            name: "mixing layer".to_owned(),
            components: components.clone(),
            profile: VerticalProfile::Slab {
                reference_m: bottom_m,
                bottom_m: bottom_m + BELOW_SEA_LEVEL_M,
                top_m: top_km[i] * 1e3,
                scale_height_m: opac_scale_height_m(scale_km[i]),
            },
            scales_with_aod: true,
        });
    }
    let mixing_top_m = top_km.iter().map(|km| km * 1e3).fold(0.0, f64::max);
    layers.push(opac_upper_layer("free_troposphere", mixing_top_m, true)?);
    layers.push(opac_upper_layer("stratosphere", mixing_top_m, false)?);
    Ok(AerosolType {
        name: format!("opac:{name}"),
        layers,
        default_aod_550: None,
    })
}

/// OPAC's stratosphere: sulphuric acid from 12 to 35 km.
pub(super) fn opac_stratosphere() -> Result<AerosolLayer> {
    opac_upper_layer("stratosphere", 0.0, false)
}

/// A layer that OPAC gives to every type, cut off below `from_m`.
fn opac_upper_layer(name: &str, from_m: f64, scales_with_aod: bool) -> Result<AerosolLayer> {
    let table = Table::parse("OPAC upper layers", OPAC_UPPER)?.select("layer", name)?;
    let (ids, humidity) = (table.words("component")?, table.numbers("rh_percent")?);
    let number_cm3 = table.numbers("number_cm3_at_base")?;
    let (bottom_km, top_km) = (table.numbers("z_min_km")?, table.numbers("z_max_km")?);
    let scale_km = table.numbers("scale_height_km")?;
    let components = (0..table.len())
        .map(|i| LayerComponent {
            source: ParticleSource::OpacAt(ids[i].to_owned(), humidity[i]),
            number_density: number_cm3[i] * 1e6,
        })
        .collect();
    // All components of a layer share its bounds.
    let base_m = bottom_km[0] * 1e3;
    Ok(AerosolLayer {
        name: name.replace('_', " "),
        components,
        profile: VerticalProfile::Slab {
            reference_m: base_m,
            bottom_m: base_m.max(from_m),
            top_m: top_km[0] * 1e3,
            scale_height_m: opac_scale_height_m(scale_km[0]),
        },
        scales_with_aod,
    })
}

/// OPAC writes 99 km for "constant".
fn opac_scale_height_m(km: f64) -> f64 {
    if km >= 99.0 {
        f64::INFINITY
    } else {
        km * 1e3
    }
}

fn aiaa_type(name: &str, tropopause_m: f64) -> Result<AerosolType> {
    let key = name.replace('-', "_");
    let table = Table::parse("AIAA types", AIAA_TYPES)?.select("type", &key)?;
    let (matter, fraction) = (table.words("component")?, table.numbers("fraction")?);
    let family = table.words("size_distribution")?[0];
    // "inf" is a height too, which `numbers` would refuse.
    let scale_height_m = match table.words("scale_height_m")?[0] {
        "inf" => f64::INFINITY,
        _ => table.numbers("scale_height_m")?[0],
    };
    let total_m3 = aiaa_sizes(family)?.1;
    let sum: f64 = fraction.iter().sum();
    let components = matter
        .iter()
        .zip(&fraction)
        .map(|(matter, fraction)| {
            let (matter, humidity_percent) = opac_matter(matter)?;
            Ok(LayerComponent {
                source: ParticleSource::Aiaa {
                    matter: matter.to_owned(),
                    humidity_percent,
                    family: family.to_owned(),
                },
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
    let table = Table::parse("AIAA sizes", AIAA_SIZES)?.select("type", family)?;
    let (number_cm3, r_mode_um) = (table.numbers("number_cm3")?, table.numbers("r_mode_um")?);
    let log10_sigma = table.numbers("log10_sigma")?;
    let modes = (0..table.len())
        .map(|i| LognormalMode {
            number_fraction: number_cm3[i],
            r_mode_um: r_mode_um[i],
            sigma: 10f64.powf(log10_sigma[i]),
        })
        .collect();
    let [r_min_um, r_max_um] = AIAA_RADII_UM;
    Ok((
        SizeDistribution::new(modes, r_min_um, r_max_um)?,
        number_cm3.iter().sum::<f64>() * 1e6,
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
