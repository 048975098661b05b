//! OPAC's components at any relative humidity (Hess, Koepke & Schult 1998, doi:10.1175/1520-0477(1998)079<0831:OPOAAC>2.0.CO;2).

use super::particle::{LognormalMode, Particle, RefractiveIndex, SizeDistribution};
use crate::error::{check_range, Error, Result};
use crate::math::Table;

const COMPONENTS: &str = include_str!("../../../../data/aerosol_opac/components.csv");
const INDEX: &str = include_str!("../../../../data/aerosol_opac/refractive_index.csv");

/// Names of OPAC's components.
pub const COMPONENT_NAMES: [&str; 10] = [
    "inso", "waso", "soot", "ssam", "sscm", "minm", "miam", "micm", "mitr", "suso",
];

/// A component of OPAC as it is at a relative humidity \[%\], 0 to 99.
///
/// Hygroscopic components (`waso`, `ssam`, `sscm`, `suso`) are tabulated in eight classes. Between two of them the
/// *particle* is interpolated, not its optics, so that one Mie integral suffices and resonances do not mix: volume grows
/// linearly in `h/(1 − h)`, as κ-Köhler theory has it without the Kelvin term (Petters & Kreidenweis 2007,
/// doi:10.5194/acp-7-1961-2007), and the index is linear in the volume fraction of dry matter, which is OPAC's own
/// mixing rule. The others do not depend on humidity.
///
/// # Errors
/// [`Error::UnknownName`], [`Error::OutOfRange`].
pub fn component(id: &str, humidity_percent: f64) -> Result<Particle> {
    check_range("humidity", humidity_percent, "%", 0.0..=99.0)?;
    if !COMPONENT_NAMES.contains(&id) {
        return Err(Error::UnknownName {
            kind: "aerosol component",
            name: id.to_owned(),
            known: COMPONENT_NAMES.map(str::to_owned).to_vec(),
        });
    }
    let classes = classes(id)?;
    let above = classes
        .iter()
        .position(|c| c.humidity >= humidity_percent)
        .unwrap_or(classes.len() - 1);
    let upper = &classes[above];
    let lower = &classes[above.saturating_sub(1)];
    let upper_index = index(id, upper)?;
    if above == 0 || classes.len() == 1 || upper.humidity == humidity_percent {
        return particle(id, upper.clone(), upper_index);
    }

    let growth = |percent: f64| percent / (100.0 - percent);
    let t = (growth(humidity_percent) - growth(lower.humidity))
        / (growth(upper.humidity) - growth(lower.humidity));
    let between = |a: f64, b: f64| (a.powi(3) + t * (b.powi(3) - a.powi(3))).cbrt();
    let here = SizeClass {
        humidity: humidity_percent,
        r_mode_um: between(lower.r_mode_um, upper.r_mode_um),
        sigma: upper.sigma,
        r_min_um: between(lower.r_min_um, upper.r_min_um),
        r_max_um: between(lower.r_max_um, upper.r_max_um),
    };
    let dry_fraction = |r: f64| r.powi(-3);
    let weight = (dry_fraction(here.r_mode_um) - dry_fraction(lower.r_mode_um))
        / (dry_fraction(upper.r_mode_um) - dry_fraction(lower.r_mode_um));
    let mixed = index(id, lower)?.mixed_with(&upper_index, weight);
    particle(id, here, mixed)
}

/// The refractive index of a component's matter at a relative humidity \[%\], 0 to 99.
///
/// # Errors
/// As [`component`].
pub fn refractive_index(id: &str, humidity_percent: f64) -> Result<RefractiveIndex> {
    Ok(component(id, humidity_percent)?.index)
}

/// A row of the table of components.
#[derive(Debug, Clone)]
struct SizeClass {
    humidity: f64,
    r_mode_um: f64,
    sigma: f64,
    r_min_um: f64,
    r_max_um: f64,
}

/// The humidity classes of a component, driest first.
fn classes(id: &str) -> Result<Vec<SizeClass>> {
    let table = Table::parse("OPAC components", COMPONENTS)?.select("component", id)?;
    let column = |name| table.numbers(name);
    let humidity = column("rh_percent")?;
    let (r_mode_um, sigma) = (column("r_mod_um")?, column("sigma")?);
    let (r_min_um, r_max_um) = (column("r_min_um")?, column("r_max_um")?);
    let class = |i: usize| SizeClass {
        humidity: humidity[i],
        r_mode_um: r_mode_um[i],
        sigma: sigma[i],
        r_min_um: r_min_um[i],
        r_max_um: r_max_um[i],
    };
    Ok((0..humidity.len()).map(class).collect())
}

/// Whether a component of OPAC swells in moist air.
pub fn is_hygroscopic(id: &str) -> bool {
    ["waso", "ssam", "sscm", "suso"].contains(&id)
}

fn index(id: &str, class: &SizeClass) -> Result<RefractiveIndex> {
    let table = Table::parse("OPAC indices", INDEX)?.select("component", id)?;
    let (mut wavelength_nm, mut n, mut k) = (Vec::new(), Vec::new(), Vec::new());
    let (um, real) = (table.numbers("wavelength_um")?, table.numbers("n")?);
    let (humidity, imaginary) = (table.numbers("rh_percent")?, table.numbers("k")?);
    for i in 0..um.len() {
        if humidity[i] == class.humidity {
            wavelength_nm.push(um[i] * 1e3);
            n.push(real[i]);
            k.push(imaginary[i]);
        }
    }
    RefractiveIndex::new(wavelength_nm, n, k)
}

fn particle(id: &str, class: SizeClass, index: RefractiveIndex) -> Result<Particle> {
    let mode = LognormalMode {
        number_fraction: 1.0,
        r_mode_um: class.r_mode_um,
        sigma: class.sigma,
    };
    Ok(Particle {
        id: id.to_owned(),
        size: SizeDistribution::new(vec![mode], class.r_min_um, class.r_max_um)?,
        index,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At OPAC's classes the particle is OPAC's own; between them it lies between.
    #[test]
    fn classes_are_met_and_bracketed() {
        let at = |h: f64| component("waso", h).unwrap();
        assert_eq!(at(80.0).size.r_max_um(), 29.8);
        assert_eq!(at(80.0).index.at(550.0).unwrap().n, 1.399);
        let (a, b, c) = (at(80.0), at(85.0), at(90.0));
        assert!(a.size.r_max_um() < b.size.r_max_um() && b.size.r_max_um() < c.size.r_max_um());
        let n = |p: &Particle| p.index.at(550.0).unwrap().n;
        assert!(n(&a) > n(&b) && n(&b) > n(&c));
    }

    #[test]
    fn humidity_beyond_the_classes_is_refused() {
        assert!(component("waso", 99.5).is_err());
        assert!(component("waso", -1.0).is_err());
        assert!(component("waso", f64::NAN).is_err());
    }

    #[test]
    fn unknown_components_list_the_known() {
        let e = component("wasp", 50.0).unwrap_err();
        assert!(e.hint().contains("did you mean 'waso'"), "{}", e.hint());
    }

    #[test]
    fn dry_components_ignore_humidity() {
        assert_eq!(
            component("soot", 0.0).unwrap(),
            component("soot", 99.0).unwrap()
        );
    }
}
