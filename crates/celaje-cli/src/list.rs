//! `celaje list`: the presets, each with a line of meaning.

use celaje::climate::{AtmosphereClass, OzoneClimate, ALBEDO_PRESETS};
use celaje::colour::{Observer, ToneCurve};
use celaje::composition::aerosol::{aerosol_names, AerosolType, ParticleSource};
use celaje::sensor::PROJECTIONS;
use celaje::sky::Method;
use celaje::spectrum::SolarSpectrum;
use clap::{Args, ValueEnum};

use crate::failure::Failure;
use crate::write_stdout;

/// List presets, each with a line of meaning
#[derive(Debug, Args)]
pub struct ListArgs {
    /// What to list
    what: What,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum What {
    /// Aerosol types, for --aerosol
    Aerosols,
    /// Albedos of grounds, for --albedo
    Albedos,
    /// Spectra of the sun above the air, for --sun-spectrum
    Suns,
    /// Reference atmospheres, for --atmosphere
    Atmospheres,
    /// Climatologies of ozone, for --ozone-climate
    OzoneClimates,
    /// Projections of pictures, for --projection
    Projections,
    /// Ways to solve the equation, for --method
    Methods,
    /// CIE observers, for --observer
    Observers,
    /// Tone curves, for --tone
    Tones,
}

/// Prints one list: name, meaning.
pub fn run(args: &ListArgs) -> Result<(), Failure> {
    let rows = match args.what {
        What::Aerosols => aerosols()?,
        What::Albedos => ALBEDO_PRESETS
            .iter()
            .map(|p| {
                let range = format!("{} to {}; {:.3} is taken", p.low, p.high, p.value());
                let one = p.low == p.high;
                row(p.name, if one { p.low.to_string() } else { range })
            })
            .collect(),
        What::Suns => SolarSpectrum::ALL
            .map(|s| row(s.name(), s.meaning()))
            .into(),
        What::Atmospheres => AtmosphereClass::ALL
            .map(|a| row(a.name(), a.meaning()))
            .into(),
        What::OzoneClimates => OzoneClimate::ALL
            .map(|c| row(c.name(), ozone_climate(c)))
            .into(),
        What::Projections => PROJECTIONS.map(|(name, meaning)| row(name, meaning)).into(),
        What::Methods => Method::ALL
            .map(|(_, name, meaning)| row(name, meaning))
            .into(),
        What::Observers => [Observer::Cie1964, Observer::Cie1931]
            .map(|o| row(o.name(), observer(o)))
            .into(),
        What::Tones => ToneCurve::ALL.map(|t| row(t.name(), tone(t))).into(),
    };
    write_stdout(&aligned(&rows))
}

type Row = (String, String);

fn row(name: &str, meaning: impl Into<String>) -> Row {
    (name.to_owned(), meaning.into())
}

fn aligned(rows: &[Row]) -> String {
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    rows.iter()
        .map(|(name, meaning)| format!("{name:width$}  {meaning}\n"))
        .collect()
}

/// Each type by what it is made of near the ground, the most numerous particles first.
fn aerosols() -> Result<Vec<Row>, Failure> {
    let mut rows = Vec::new();
    for name in aerosol_names() {
        // The latitude only moves the tropopause.
        let aerosol = AerosolType::named(&name, 45.0)?;
        let mut parts = aerosol
            .layers
            .first()
            .map_or(Vec::new(), |layer| layer.components.iter().collect());
        parts.sort_by(|a, b| b.number_density.total_cmp(&a.number_density));
        let parts: Vec<&str> = parts.iter().map(|c| matter(&c.source)).collect();
        let family = if name.starts_with("opac:") {
            "OPAC"
        } else {
            "AIAA"
        };
        rows.push(row(&name, format!("{family}: {}", parts.join(", "))));
    }
    Ok(rows)
}

/// A component in words.
fn matter(source: &ParticleSource) -> &str {
    let id = match source {
        // OPAC's sulphate without any water is sulphuric acid at 75 %.
        ParticleSource::Aiaa {
            matter,
            humidity_percent: Some(_),
            ..
        } if matter == "suso" => "sulphuric acid",
        ParticleSource::Opac(id)
        | ParticleSource::OpacAt(id, _)
        | ParticleSource::Aiaa { matter: id, .. } => id.as_str(),
        ParticleSource::Fixed(particle) => particle.id.as_str(),
        _ => "other particles",
    };
    match id {
        "inso" => "insoluble dust",
        "waso" => "water-soluble",
        "soot" => "soot",
        "ssam" => "sea salt",
        "sscm" => "coarse sea salt",
        "minm" => "fine mineral",
        "miam" => "mineral",
        "micm" => "coarse mineral",
        "mitr" => "transported mineral",
        "suso" => "sulphate",
        other => other,
    }
}

fn ozone_climate(climate: OzoneClimate) -> &'static str {
    match climate {
        OzoneClimate::Sbuv => "NOAA SBUV satellites, zonal monthly means 1998-2015",
        OzoneClimate::VanHeuklon => {
            "Van Heuklon 1979, a formula; up to 160 DU off, before the ozone hole"
        }
        OzoneClimate::Arosa => {
            "Arosa, 47° N, monthly means of 45 years (Dütsch 1974), used anywhere"
        }
    }
}

fn observer(observer: Observer) -> &'static str {
    match observer {
        Observer::Cie1964 => "CIE 1964, field of 10 degrees: for something as large as a sky",
        Observer::Cie1931 => "CIE 1931, field of 2 degrees: its Y is the usual luminance",
    }
}

fn tone(tone: ToneCurve) -> &'static str {
    match tone {
        ToneCurve::Gamma => "luminance to the power 1/2.5: dark parts of a sky beside bright ones",
        ToneCurve::Srgb => "what a plain camera would show, with the sRGB encoding",
        ToneCurve::Filmic => "Hable's filmic curve, detail up to two stops above white",
        ToneCurve::None => "linear, nothing encoded",
    }
}
