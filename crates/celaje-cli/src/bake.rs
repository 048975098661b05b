//! `celaje bake`: tables for any sun, and what other commands do with `--tables`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use celaje::bake::{BakeOptions, Origin};
use celaje::error::check_range;
use celaje::image::check_writable;
use celaje::place::SunPosition;
use celaje::transport::Accuracy;
use celaje::Sky;
use clap::Args;

use crate::failure::Failure;
use crate::interrupt;
use crate::options::{Air, Switch, WhereWhen};
use crate::plan::Plan;
use crate::render::no_output;

/// Solve an atmosphere for every sun and keep the tables in a file
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
render, radiance, irradiance and film take the file by --tables FILE, then only need a sun (--sun-elevation, or --at and --time)
and a view; the air and the ground are those of the file.

Examples:
  celaje bake --aerosol desert --aod 0.3 -o dust.celaje
  celaje render --tables dust.celaje --sun-elevation -3 -o dusk.png
  celaje bake --at Zaragoza --time 2026-06-21T12:00Z -o zaragoza-june.celaje"
)]
pub struct BakeArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// File to write
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Option<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    /// Vacuum wavelengths, nm, 280 to 2500: START:STOP:STEP or a list [default: 380:780:5]
    #[arg(long, value_name = "NM", help_heading = "View")]
    wavelengths: Option<String>,
    /// Elevations of the sun to solve for, degrees, LOWEST:HIGHEST
    #[arg(
        long,
        value_name = "DEG:DEG",
        default_value = "-18:90",
        allow_hyphen_values = true,
        help_heading = "View"
    )]
    suns: String,
    /// The highest observer that the tables must serve, above sea level, m
    #[arg(
        long,
        value_name = "M",
        default_value_t = 20_000.0,
        help_heading = "View"
    )]
    highest_observer: f64,
    /// How fine the grids are: preview, default, high
    #[arg(
        long,
        value_name = "NAME",
        default_value = "default",
        help_heading = "Method"
    )]
    accuracy: String,
    /// Polarisation: on solves for light that is polarised on its way; off for scalar light, in half the time
    #[arg(
        long,
        value_name = "WHETHER",
        default_value = "on",
        hide_possible_values = true,
        help_heading = "Method"
    )]
    polarised: Switch,
}

/// Checks everything, solves, writes the file.
pub fn run(args: &BakeArgs) -> Result<(), Failure> {
    let Some(path) = &args.output else {
        return Err(no_output("add -o air.celaje"));
    };
    let plan = Plan::to_bake(&args.where_when, &args.air, args.wavelengths.as_deref())?;
    let (lowest, highest) = range(&args.suns)?;
    check_range("lowest sun elevation", lowest, "deg", -90.0..=90.0)?;
    check_range("highest sun elevation", highest, "deg", -90.0..=90.0)?;
    if highest < lowest {
        return Err(Failure::usage(
            format!("suns run backwards, from {lowest} to {highest} deg"),
            "give LOWEST:HIGHEST, such as --suns -18:90",
        ));
    }
    let ground_m = plan.conditions.altitude_m.value;
    check_range(
        "highest observer",
        args.highest_observer,
        "m",
        ground_m..=1e9,
    )?;
    let options = BakeOptions {
        accuracy: Accuracy::named(&args.accuracy)?,
        sun_elevation_deg: (lowest, highest),
        highest_observer_m: args.highest_observer,
        polarised: args.polarised == Switch::On,
    };
    check_writable(path)?;
    interrupt::set_targets(std::slice::from_ref(path));

    let start = Instant::now();
    let sky = plan.sky()?;
    let baked = interrupt::stoppable(|flag| sky.baked(&options, flag))?;
    let mut origin = plan.origin();
    origin.push(("accuracy".to_owned(), options.accuracy.name().to_owned()));
    origin.push(("sun_range_deg".to_owned(), format!("{lowest}:{highest}")));
    origin.push((
        "highest_observer_m".to_owned(),
        options.highest_observer_m.to_string(),
    ));
    let polarised = if options.polarised { "on" } else { "off" };
    origin.push(("tables_polarised".to_owned(), polarised.to_owned()));
    interrupt::check()?;
    baked.save_tables(path, &origin)?;
    let size = std::fs::metadata(path).map_or(0, |m| m.len());
    eprintln!(
        "baked {} wavelengths for suns from {lowest} to {highest} degrees in {:.1} s; {:.1} MB",
        plan.wavelength.len(),
        start.elapsed().as_secs_f64(),
        size as f64 / 1e6
    );
    Ok(())
}

/// `LOWEST:HIGHEST`.
fn range(text: &str) -> Result<(f64, f64), Failure> {
    let number = |part: &str| part.trim().parse::<f64>().ok();
    text.split_once(':')
        .and_then(|(a, b)| number(a).zip(number(b)))
        .ok_or_else(|| {
            Failure::usage(
                format!("suns '{text}' are not understood"),
                "give two elevations in degrees, such as --suns -18:90",
            )
        })
}

/// Conditions that belong to a view, not to the tables that it is taken of.
const OF_THE_SUN: [&str; 4] = [
    "time",
    "sun_elevation_deg",
    "sun_azimuth_deg",
    "sun_distance_au",
];

/// Whether an entry of a file, or its reason, is one of these.
pub fn of_the_sun(name: &str) -> bool {
    let key = name.strip_suffix(".reason").unwrap_or(name);
    OF_THE_SUN.contains(&key)
}

/// Tables that a command was given.
pub struct Baked {
    sky: Sky,
    /// What the file says of the air and the ground.
    pub origin: Origin,
}

impl Baked {
    /// Reads a file, unless options ask for something that it already holds.
    pub fn load(path: &Path, air: &Air) -> Result<Self, Failure> {
        if let Some(option) = air.given() {
            return Err(Failure::usage(
                format!("{option} is given beside --tables, which hold air and ground already"),
                format!("leave {option} out, or bake other tables with it"),
            ));
        }
        let (sky, origin) = Sky::load_tables(path)?;
        // The sun of the day it was baked is not that of the view.
        let origin = origin.into_iter().filter(|(name, _)| !of_the_sun(name));
        Ok(Self {
            sky,
            origin: origin.collect(),
        })
    }

    /// The wavelengths of the tables.
    pub fn wavelength_nm(&self) -> &[f64] {
        self.sky.wavelength_nm()
    }

    /// The sun that the tables were saved with.
    pub fn sun(&self) -> Result<SunPosition, Failure> {
        let (azimuth, elevation) = self.sky.sun.direction.to_azimuth_elevation_deg();
        Ok(SunPosition::new(
            azimuth,
            elevation,
            self.sky.sun_distance_au,
        )?)
    }

    /// The sky under a sun.
    pub fn under(&self, sun: &SunPosition) -> Result<Sky, Failure> {
        Ok(self.sky.under(sun)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suns_are_two_numbers() {
        assert_eq!(range("-18:90").unwrap(), (-18.0, 90.0));
        for bad in ["", "-18", "a:b", "1:2:3"] {
            assert!(range(bad).is_err(), "{bad}");
        }
    }
}
