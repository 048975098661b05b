//! `celaje irradiance`: what falls on a plane.

use std::fmt::Write as _;
use std::path::PathBuf;

use celaje::error::check_range;
use celaje::irradiance::{Irradiance, SpectralIrradiance, Tilt};
use celaje::sky::Method;
use celaje::transport::Goal;
use celaje::Result;
use clap::Args;

use crate::failure::Failure;
use crate::options::{Air, Disc, MethodOptions, View, WhereWhen};
use crate::plan::Plan;
use crate::write_stdout;

/// Irradiance on planes facing the sun and level, as CSV
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Writes one line per wavelength: direct_normal (the sun's disc on a plane facing it), direct (on a level plane, or
on that of --tilt), diffuse (all else there: the sky and, on a tilted plane, the ground), global (the sum) [W m-2 nm-1] and their standard errors. Lines beginning with # come first: the
sums over the wavelengths [W m-2], illuminance [lx] and correlated colour temperature [K], none for a single
wavelength and for wavelengths outside 360 to 830 nm. 256 cells of the sky and
as many of the disc are sampled by --spp paths each.

Example:
  celaje irradiance --at 41.65,-0.88 --time 2026-06-21T12:00Z
  celaje irradiance --sun-elevation 20 --tilt 35 --tilt-azimuth 180 --method shells"
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
    /// Tilt of the plane from level, degrees, 0 to 180
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        help_heading = "Plane"
    )]
    tilt: f64,
    /// Azimuth that a tilted plane faces, degrees clockwise from north [default: 180]
    #[arg(long, value_name = "DEG", help_heading = "Plane")]
    tilt_azimuth: Option<f64>,
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
    check_range("tilt", args.tilt, "deg", 0.0..=180.0)?;
    let azimuth_deg = args.tilt_azimuth.unwrap_or(180.0);
    check_range("tilt azimuth", azimuth_deg, "deg", -360.0..=360.0)?;
    if args.tilt_azimuth.is_some() && args.tilt == 0.0 {
        return Err(Failure::usage(
            "--tilt-azimuth is given, but the plane is level",
            "add --tilt, such as --tilt 35, or leave --tilt-azimuth out",
        ));
    }
    let plane = Tilt {
        tilt_deg: args.tilt,
        azimuth_deg,
    };
    plan.note_single_paths();
    let irradiance =
        plan.on_threads(|| plan.measure(&plan.sky()?, &plane, args.method.progress))?;
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
    let none = || "none".to_owned();
    line("# lx", &|part| {
        Ok(part.lux(nm)?.map_or_else(none, |lux| format!("{lux:.4e}")))
    })?;
    line("# cct K", &|part| {
        let cct = part.cct(nm)?;
        Ok(cct.map_or_else(none, |c| format!("{:.0}", c.temperature_k)))
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
