//! What floats above the tropopause: the stratosphere's sulphuric acid or volcanic veil, the mesosphere's dust and ice.

use super::aerosol::{
    opac_stratosphere, AerosolLayer, LayerComponent, ParticleSource, VerticalProfile,
};
use super::particle::{LognormalMode, Particle, RefractiveIndex, SizeDistribution};
use crate::error::{Error, Result};
use crate::math::interp::linear_clamped;
use crate::math::Table;

const SPECTRAL: &str = include_str!("../../../../data/aerosol_lowtran/spectral.csv");
const PROFILES: &str = include_str!("../../../../data/aerosol_lowtran/profiles.csv");
const ICE: &str = include_str!("../../../../data/refractive_index_ice/ice.csv");

/// Published optics of an aerosol whose particles are not: extinction over that at 550 nm, single-scattering albedo and
/// asymmetry over wavelength. Its phase function is Henyey & Greenstein's.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    name: String,
    ln_wavelength: Vec<f64>,
    ln_ext: Vec<f64>,
    ssa: Vec<f64>,
    asymmetry: Vec<f64>,
}

impl Spectrum {
    /// A model of LOWTRAN 7: `fresh_volcanic`, `aged_volcanic`, `background_stratospheric`, `meteoric_dust`.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    ///
    /// # Source
    /// Kneizys et al. 1988, AFGL-TR-88-0177; Shettle & Fenn 1979, AFGL-TR-79-0214.
    pub fn lowtran(name: &str) -> Result<Self> {
        let table = Table::parse("LOWTRAN models", SPECTRAL)?;
        let mut known = table.words("model")?;
        known.dedup();
        if !known.contains(&name) {
            return Err(Error::UnknownName {
                kind: "LOWTRAN aerosol",
                name: name.to_owned(),
                known: known.into_iter().map(str::to_owned).collect(),
            });
        }
        let table = table.select("model", name)?;
        let (ext, abs) = (table.numbers("ext_rel")?, table.numbers("abs_rel")?);
        let ln = |column: &[f64]| column.iter().map(|v| v.ln()).collect::<Vec<_>>();
        Ok(Self {
            name: name.to_owned(),
            ln_wavelength: ln(&table.numbers("wavelength_nm")?),
            ssa: ext.iter().zip(&abs).map(|(e, a)| 1.0 - a / e).collect(),
            ln_ext: ln(&ext),
            asymmetry: table.numbers("asymmetry")?,
        })
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Extinction over that at 550 nm, single-scattering albedo and asymmetry at a vacuum wavelength \[nm\], 200 to 4000;
    /// logarithm of extinction, and the others, linear in `ln λ`.
    pub fn at(&self, wavelength_nm: f64) -> [f64; 3] {
        let value =
            |column: &[f64]| linear_clamped(&self.ln_wavelength, column, wavelength_nm.ln());
        [
            value(&self.ln_ext).exp(),
            value(&self.ssa),
            value(&self.asymmetry),
        ]
    }
}

/// The aerosol of the stratosphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Stratosphere {
    /// The sulphuric acid of quiet years: the particles and the column of the aerosol type's own layer (OPAC), LOWTRAN's profile.
    #[default]
    Background,
    /// Some months after an eruption: LOWTRAN's fresh volcanic aerosol, high volcanic profile.
    VolcanicFresh,
    /// A year or two after an eruption: LOWTRAN's aged volcanic aerosol, moderate volcanic profile.
    VolcanicAged,
    /// Nothing.
    None,
}

impl Stratosphere {
    /// Every choice with its name and a line of meaning.
    pub const ALL: [(Self, &'static str, &'static str); 4] = [
        (
            Self::Background,
            "background",
            "sulphuric acid of quiet years (OPAC's particles and column, LOWTRAN's profile)",
        ),
        (
            Self::VolcanicFresh,
            "volcanic-fresh",
            "months after an eruption (LOWTRAN fresh volcanic, high load)",
        ),
        (
            Self::VolcanicAged,
            "volcanic-aged",
            "a year or two after an eruption (LOWTRAN aged volcanic, moderate load)",
        ),
        (Self::None, "none", "no aerosol"),
    ];

    /// The choice of a name; `volcanic` alone is the fresh one.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        let name = if name == "volcanic" {
            "volcanic-fresh"
        } else {
            name
        };
        find(&Self::ALL, "stratosphere", name)
    }

    /// Its layers, given those that the aerosol type brings with it (OPAC's if it has none).
    ///
    /// # Errors
    /// [`Error::Invalid`] for damaged data.
    pub fn layers(self, of_type: Vec<AerosolLayer>) -> Result<Vec<AerosolLayer>> {
        match self {
            Self::Background if of_type.is_empty() => Ok(vec![quiet(opac_stratosphere()?)?]),
            Self::Background => of_type.into_iter().map(quiet).collect(),
            Self::VolcanicFresh => Ok(vec![lowtran_layer(
                "stratosphere",
                "fresh_volcanic",
                "high_volcanic",
            )?]),
            Self::VolcanicAged => Ok(vec![lowtran_layer(
                "stratosphere",
                "aged_volcanic",
                "moderate_volcanic",
            )?]),
            Self::None => Ok(Vec::new()),
        }
    }
}

/// The aerosol of the mesosphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Mesosphere {
    /// Meteoric dust from 30 to 100 km (LOWTRAN, normal years): far more of it than satellites find, and enough to make deep twilight
    /// up to twice as bright as it is measured (`docs/decisions/0014`).
    Dust,
    /// A layer of ice at 83 km, a noctilucent cloud that covers the whole sky.
    Ice,
    /// Both.
    DustAndIce,
    /// Nothing.
    #[default]
    None,
}

impl Mesosphere {
    /// Every choice with its name and a line of meaning.
    pub const ALL: [(Self, &'static str, &'static str); 4] = [
        (Self::Dust, "dust", "meteoric dust, 30 to 100 km (LOWTRAN)"),
        (Self::Ice, "ice", "a noctilucent layer of ice at 83 km"),
        (Self::DustAndIce, "dust-and-ice", "both"),
        (Self::None, "none", "no aerosol"),
    ];

    /// The choice of a name.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        find(&Self::ALL, "mesosphere", name)
    }

    /// Its layers.
    ///
    /// # Errors
    /// [`Error::Invalid`] for damaged data.
    pub fn layers(self) -> Result<Vec<AerosolLayer>> {
        let dust = || lowtran_layer("mesospheric dust", "meteoric_dust", "meteoric_dust");
        match self {
            Self::Dust => Ok(vec![dust()?]),
            Self::Ice => Ok(vec![ice_layer()?]),
            Self::DustAndIce => Ok(vec![dust()?, ice_layer()?]),
            Self::None => Ok(Vec::new()),
        }
    }
}

fn find<T: Copy>(
    all: &[(T, &'static str, &'static str)],
    kind: &'static str,
    name: &str,
) -> Result<T> {
    let found = all.iter().find(|(_, n, _)| *n == name);
    found
        .map(|(value, ..)| *value)
        .ok_or_else(|| Error::UnknownName {
            kind,
            name: name.to_owned(),
            known: all.iter().map(|(_, n, _)| (*n).to_owned()).collect(),
        })
}

/// Altitudes \[m\] and extinction at 550 nm \[m⁻¹\] of a profile of LOWTRAN, where it is defined.
fn lowtran_profile(profile: &str) -> Result<(Vec<f64>, Vec<f64>)> {
    let table = Table::parse("LOWTRAN profiles", PROFILES)?;
    let (z, ext) = (table.numbers("altitude_m")?, table.numbers(profile)?);
    Ok(z.into_iter().zip(ext).filter(|(_, ext)| *ext > 0.0).unzip())
}

/// A layer of LOWTRAN: a model, and a profile of extinction at 550 nm.
fn lowtran_layer(name: &str, model: &str, profile: &str) -> Result<AerosolLayer> {
    let (z, ext) = lowtran_profile(profile)?;
    let highest = ext.iter().copied().fold(0.0, f64::max);
    let relative = ext.iter().map(|e| e / highest).collect();
    Ok(AerosolLayer {
        name: name.to_owned(),
        components: vec![LayerComponent {
            source: ParticleSource::Spectrum(Spectrum::lowtran(model)?),
            number_density: highest,
        }],
        profile: VerticalProfile::sampled(z, relative)?,
        scales_with_aod: false,
    })
}

/// A stratospheric layer as it is in quiet years: the same particles, column and lower edge, thinning out above 20 km by LOWTRAN's profile.
///
/// OPAC's constant number from 12 to 35 km is some forty times that at 35 km, which doubles the light of deep twilight. LOWTRAN's
/// profile ends at 30 km; from there to 40 km the fall-off from 25 to 30 km (a factor of 4 in 5 km) goes on, as satellites see it to do.
fn quiet(mut layer: AerosolLayer) -> Result<AerosolLayer> {
    let (mut z, mut ext) = lowtran_profile("background")?;
    let last = z.len() - 1;
    let (step_m, fall_off) = (z[last] - z[last - 1], ext[last] / ext[last - 1]);
    for steps in 1..=QUIET_STEPS {
        z.push(z[last] + f64::from(steps) * step_m);
        ext.push(ext[last] * fall_off.powi(steps));
    }
    let shape = VerticalProfile::sampled(z, ext)?;
    let bottom_m = layer.profile.breaks_m()[0];
    let lowest_m = bottom_m.max(shape.breaks_m()[0]);
    let above = shape.breaks_m().into_iter().filter(|&z| z > lowest_m);
    let z: Vec<f64> = std::iter::once(lowest_m).chain(above).collect();
    let relative = z.iter().map(|&z| shape.relative(z)).collect();
    let profile = VerticalProfile::sampled(z, relative)?;
    let factor = layer.profile.column_above(bottom_m) / profile.column_above(bottom_m);
    for component in &mut layer.components {
        component.number_density *= factor;
    }
    layer.profile = profile;
    Ok(layer)
}

/// Steps of LOWTRAN's last 5 km by which the layer of quiet years goes on above its 30 km.
const QUIET_STEPS: i32 = 2;

/// Ice of noctilucent clouds: median radius 51 nm, σ 1.42, 82 cm⁻³, the means of lidar measurements in three colours (von Cossart,
/// Fiedler & von Zahn 1999, doi:10.1029/1999GL900226); index of Warren & Brandt 2008. The kilometre of thickness, centred
/// at 83 km, is a round figure of ours.
fn ice_layer() -> Result<AerosolLayer> {
    let table = Table::parse("ice", ICE)?;
    let index = RefractiveIndex::new(
        table.numbers("wavelength_nm")?,
        table.numbers("n")?,
        table.numbers("k")?,
    )?;
    let mode = LognormalMode {
        number_fraction: 1.0,
        r_mode_um: 0.051,
        sigma: 1.42,
    };
    let particle = Particle {
        id: "ice".to_owned(),
        size: SizeDistribution::new(vec![mode], 0.005, 0.5)?,
        index,
    };
    Ok(AerosolLayer {
        name: "mesospheric ice".to_owned(),
        components: vec![LayerComponent {
            source: ParticleSource::Fixed(particle),
            number_density: 82e6,
        }],
        profile: VerticalProfile::Slab {
            reference_m: 83e3,
            bottom_m: 82.5e3,
            top_m: 83.5e3,
            scale_height_m: f64::INFINITY,
        },
        scales_with_aod: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(layer: &AerosolLayer) -> f64 {
        layer.components[0].number_density * layer.profile.column_above(0.0)
    }

    /// LOWTRAN's columns: moderate volcanic 0.028, high 0.076 and 0.096 in the two seasons, whose mean is ours.
    #[test]
    fn volcanic_columns_are_lowtrans() {
        let layer = |s: Stratosphere| s.layers(Vec::new()).unwrap().remove(0);
        let fresh = column(&layer(Stratosphere::VolcanicFresh));
        assert!((fresh - 0.086).abs() < 0.003, "{fresh}");
        let aged = column(&layer(Stratosphere::VolcanicAged));
        assert!((aged - 0.028).abs() < 0.002, "{aged}");
        let dust = column(&Mesosphere::Dust.layers().unwrap()[0]);
        assert!((1e-4..5e-4).contains(&dust), "{dust}");
    }

    /// OPAC's column stays, above the same edge; above 20 km it thins out, and at 35 km little is left.
    #[test]
    fn quiet_years_keep_the_column_and_thin_out() {
        let opac = opac_stratosphere().unwrap();
        let layer = Stratosphere::Background
            .layers(Vec::new())
            .unwrap()
            .remove(0);
        assert!((column(&layer) / column(&opac) - 1.0).abs() < 1e-12);
        assert_eq!(layer.profile.relative(11.9e3), 0.0);
        assert_eq!(layer.profile.relative(40.1e3), 0.0);
        // In parts of OPAC's constant number.
        let constant = opac.components[0].number_density;
        let at = |z: f64| layer.components[0].number_density * layer.profile.relative(z) / constant;
        assert!((20..40).all(|km| at(1e3 * f64::from(km)) > at(1e3 * f64::from(km + 1))));
        assert!((1.5..2.0).contains(&at(19e3)), "{}", at(19e3));
        assert!((0.02..0.03).contains(&at(35e3)), "{}", at(35e3));
    }

    #[test]
    fn spectra_are_one_at_550_nm_and_smooth() {
        for name in [
            "fresh_volcanic",
            "aged_volcanic",
            "background_stratospheric",
            "meteoric_dust",
        ] {
            let spectrum = Spectrum::lowtran(name).unwrap();
            assert!((spectrum.at(550.0)[0] - 1.0).abs() < 1e-12);
            for nm in 280..=2500 {
                let [ext, ssa, g] = spectrum.at(f64::from(nm));
                assert!(ext > 0.0 && (0.0..=1.0).contains(&ssa) && (0.0..1.0).contains(&g));
            }
        }
        assert!(Spectrum::lowtran("smoke").is_err());
    }

    #[test]
    fn names_are_found_or_listed() {
        assert_eq!(
            Stratosphere::named("volcanic").unwrap(),
            Stratosphere::VolcanicFresh
        );
        for (value, name, _) in Stratosphere::ALL {
            assert_eq!(Stratosphere::named(name).unwrap(), value);
        }
        for (value, name, _) in Mesosphere::ALL {
            assert_eq!(Mesosphere::named(name).unwrap(), value);
            value.layers().unwrap();
        }
        assert!(Stratosphere::named("volcano").is_err());
        assert!(Mesosphere::named("Dust").is_err());
    }
}
