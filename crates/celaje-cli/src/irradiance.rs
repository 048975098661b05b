//! `celaje irradiance`: what falls on a plane.

use std::fmt::Write as _;
use std::path::PathBuf;

use celaje::irradiance::{Irradiance, SpectralIrradiance};
use celaje::sky::Method;
use celaje::transport::Goal;
use celaje::Result;
use clap::Args;

use crate::failure::Failure;
use crate::options::{Air, Disc, MethodOptions, Plan, View, WhereWhen};
use crate::write_stdout;

/// Irradiance on planes facing the sun and level, as CSV
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Writes one line per wavelength: direct_normal (the sun's disc on a plane facing it), direct (on a level plane), diffuse (the
sky without the disc, level), global (the sum) [W m-2 nm-1] and their standard errors. Lines beginning with # come first: the
sums over the wavelengths [W m-2], illuminance [lx] and correlated colour temperature [K]. 256 cells of the sky and
as many of the disc are sampled by --spp paths each.

Example:
  celaje irradiance --at 41.65,-0.88 --time 2026-06-21T12:00Z"
)]
pub struct IrradianceArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    #[command(flatten)]
    view: View,
    #[command(flatten)]
    method: MethodOptions,
}

/// Checks everything, computes, prints.
pub fn run(args: &IrradianceArgs) -> std::result::Result<(), Failure> {
    let plan = Plan::new(
        &args.where_when,
        &args.air,
        &args.view,
        &args.method,
        Disc::On,
        (Method::Path, 64),
    )?;
    if plan.goal != Goal::default() {
        return Err(Failure::usage(
            "--noise and --time-limit are for render and radiance",
            "give --spp N, and look at the columns se_",
        ));
    }
    let irradiance = plan.on_threads(|| plan.measure(&plan.sky()?, args.method.progress))?;
    write_stdout(&output(&irradiance)?)
}

fn output(e: &Irradiance) -> Result<String> {
    let parts: [(&str, &SpectralIrradiance); 4] = [
        ("direct_normal", &e.direct_normal),
        ("direct", &e.direct),
        ("diffuse", &e.diffuse),
        ("global", &e.global),
    ];
    let nm = &e.wavelength_nm;
    let mut text = String::from("# quantity,direct_normal,direct,diffuse,global\n");
    let mut line = |name: &str, value: &dyn Fn(&SpectralIrradiance) -> Result<String>| {
        text.push_str(name);
        for (_, part) in parts {
            text.push(',');
            text.push_str(&value(part)?);
        }
        text.push('\n');
        Ok::<(), celaje::Error>(())
    };
    line("# W m-2", &|part| Ok(format!("{:.4e}", part.total(nm)?)))?;
    line("# lx", &|part| Ok(format!("{:.4e}", part.lux(nm)?)))?;
    line("# cct K", &|part| {
        let cct = part.cct(nm)?;
        Ok(cct.map_or("none".to_owned(), |c| format!("{:.0}", c.temperature_k)))
    })?;
    text.push_str("wavelength_nm");
    for prefix in ["", "se_"] {
        for (name, _) in parts {
            text.push_str(&format!(",{prefix}{name}"));
        }
    }
    text.push('\n');
    for (k, nm) in nm.iter().enumerate() {
        let values = parts.iter().map(|(_, part)| part.irradiance[k]);
        let errors = parts.iter().map(|(_, part)| part.standard_error[k]);
        text.push_str(&nm.to_string());
        for value in values.chain(errors) {
            // Writing to a string cannot fail.
            let _ = write!(text, ",{value:.6e}");
        }
        text.push('\n');
    }
    Ok(text)
}
