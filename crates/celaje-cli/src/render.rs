//! `celaje render`: sky to pictures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use celaje::image::{
    check_target, check_writable, read_checkpoint, remove_checkpoint, save, write_checkpoint,
    Format,
};
use celaje::residual::{Correction, Residual};
use celaje::sensor::Sensor;
use celaje::sky::{Method, Polarised, SunDisc};
use celaje::transport::{Goal, Outcome, Partial};
use celaje::{Film, Sky};
use clap::Args;

use crate::explain::night;
use crate::failure::Failure;
use crate::interrupt;
use crate::options::{Air, Colour, MethodOptions, Picture, View, WhereWhen};
use crate::plan::Plan;

/// Render the sky to .png, .exr, .hdr, .nc
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
.png shows (tone curve, exposure); .exr holds linear colours in cd/m2 and the spectral radiance at every wavelength in
W m-2 sr-1 nm-1 with its variance (with --polarised on, Q, U and V too); .hdr holds linear colours in cd/m2; .nc is NetCDF
with CF names: the same, where each pixel looks and, with --polarised on, degree and angle of polarisation. Q, U, V and the
angle refer to the vertical plane of the direction looked at: Q > 0 where the electric field lies in it.

Examples:
  celaje render --at -33.4,-70.6 --time 2026-06-21T09:30-04:00 -o dawn.png
  celaje render --sun-elevation -4 --projection latlong --size 512 -o twilight.exr
  celaje render scene.toml --aod 0.4 -o hazy.png
  celaje render --sun-elevation 3 --check -o sky.exr
  celaje render --sun-elevation 3 --accuracy preview --correct -o sky.exr"
)]
pub struct RenderArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// File to write: .png, .exr, .hdr or .nc; may be given several times
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    where_when: WhereWhen,
    #[command(flatten)]
    air: Air,
    #[command(flatten)]
    picture: Picture,
    #[command(flatten)]
    view: View,
    #[command(flatten)]
    method: MethodOptions,
    /// Keep what is finished in this file every few seconds, and go on from it if it exists; removed in the end
    #[arg(long, value_name = "FILE", help_heading = "Method")]
    checkpoint: Option<PathBuf>,
    /// Compare the method shells with path at 50 directions of the picture, on stderr and in the file
    #[arg(long, help_heading = "Method")]
    check: bool,
    /// Correct the method shells by what of its difference from path at these directions is smooth; says what is left of it
    #[arg(long, help_heading = "Method")]
    correct: bool,
    #[command(flatten)]
    colour: Colour,
}

/// Checks everything, renders, writes every file.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let disc = args.picture.sun_disc;
    let default = (Method::Shells, 64);
    let plan = Plan::new(
        &args.where_when,
        &args.air,
        &args.view,
        &args.method,
        disc,
        default,
    )?;
    if plan.options.method != Method::Shells {
        for (given, option, does) in [
            (args.check, "--check", "compares the method shells with"),
            (args.correct, "--correct", "corrects the method shells by"),
        ] {
            if given {
                return Err(Failure::usage(
                    format!("{option} {does} path; another method was asked for"),
                    format!("leave {option} out, or --method and --spp"),
                ));
            }
        }
    }
    if args.correct && plan.options.sun_disc == SunDisc::Only {
        return Err(Failure::usage(
            "--correct has no meaning for the sun's disc alone, which is exact",
            "leave --correct or --sun-disc out",
        ));
    }
    let sensor = args.picture.sensor(plan.wavelength.len())?;
    let look = args.colour.look()?;
    check_outputs(&args.output)?;
    if let Some(path) = &args.checkpoint {
        check_checkpoint(path, &plan, &args.output)?;
    }
    let written: Vec<PathBuf> = args
        .output
        .iter()
        .chain(&args.checkpoint)
        .cloned()
        .collect();
    interrupt::set_targets(&written);
    if let Some(note) = night(&plan.conditions) {
        eprintln!("{note}");
    }
    plan.note_false_colours();

    let start = Instant::now();
    plan.on_threads(|| {
        let sky = plan.sky()?;
        let metadata = metadata(&plan, &sky, sensor.as_ref());
        let sensor = sensor.as_ref();
        let mode = args.method.progress;
        let mut told = Vec::new();
        let film = if args.correct {
            let (film, correction) = plan.look_and_correct(&sky, sensor, Correction::SPP, mode)?;
            tell_correction(&correction);
            told = correction.entries();
            film
        } else if let Some(path) = &args.checkpoint {
            look_with_checkpoint(path, &plan, &sky, sensor, &metadata, args)?.film
        } else {
            plan.look(&sky, sensor, mode)?.film
        };
        let rendered_s = start.elapsed().as_secs_f64();
        if args.check && !args.correct {
            let residual = plan.check(&sky, sensor, Residual::SPP, mode)?;
            tell(&residual, Residual::SPP);
            told = residual.entries();
        }
        let mut metadata = with_paths(metadata, &film, &plan);
        metadata.extend(told);
        for path in &args.output {
            interrupt::check()?;
            save(path, &film, &look, Some(sensor), &metadata)?;
        }
        args.checkpoint.as_deref().map(remove_checkpoint);
        eprintln!("{}", summary(&film, &plan, rendered_s));
        Ok(())
    })
}

/// Makes sure that a checkpoint makes sense and can be written.
fn check_checkpoint(path: &Path, plan: &Plan, outputs: &[PathBuf]) -> Result<(), Failure> {
    if outputs.iter().any(|output| output == path) {
        return Err(Failure::usage(
            format!("{} is given as picture and as checkpoint", path.display()),
            "give the checkpoint a name of its own",
        ));
    }
    if plan.options.method == Method::Shells {
        return Err(Failure::usage(
            "--checkpoint has no meaning for shells, which is done in seconds",
            "leave it out, or add --spp N or --noise X%",
        ));
    }
    if plan.goal.time_limit.is_some() {
        return Err(Failure::usage(
            "--checkpoint and --time-limit exclude each other: what the clock ends cannot be repeated",
            "give --spp or --noise, or 'celaje merge' runs of different --seed",
        ));
    }
    Ok(check_writable(path)?)
}

/// Renders on from a checkpoint, if there is one, and keeps it up to date.
fn look_with_checkpoint(
    path: &Path,
    plan: &Plan,
    sky: &Sky,
    sensor: &dyn Sensor,
    identity: &[(String, String)],
    args: &RenderArgs,
) -> Result<Outcome, Failure> {
    let (width, height) = sensor.size();
    let resume = read_checkpoint(path, (width, height), sky.wavelength_nm(), identity)?;
    if let Some(partial) = &resume {
        let all = Film::blocks(width, height).len();
        let share = 100.0 * partial.blocks_finished as f64 / all as f64;
        eprintln!(
            "note: going on from {}, {share:.0} % finished",
            path.display()
        );
    }
    let keep = |partial: &Partial| write_checkpoint(path, partial, identity);
    plan.look_and_keep(sky, sensor, args.method.progress, resume, Some(&keep))
}

/// Tells the user how a picture compares with the reference.
fn tell(residual: &Residual, spp: u32) {
    let count = residual.directions.len();
    let [(_, mean), (_, rms), (_, worst)] = residual.words();
    eprintln!(
        "shells over path less one in {count} directions of {spp} paths: mean {mean}; rms {rms} without the noise; worst {worst}"
    );
}

/// Tells the user how a picture was corrected.
fn tell_correction(correction: &Correction) {
    tell(&correction.before, Correction::SPP);
    let words = correction.words().into_iter();
    let text: Vec<String> = words
        .map(|(name, value)| format!("{name} {value}"))
        .collect();
    let judged = if correction.is_nothing() {
        ""
    } else {
        " (each direction by the field of the others)"
    };
    eprintln!("corrected {}{judged}", text.join("; "));
}

/// The failure of a command that is to write nothing.
pub fn no_output(hint: &str) -> Failure {
    Failure::usage("no file to write is given", hint)
}

/// Makes sure that every file can be written, before hours are spent on it.
pub fn check_outputs(paths: &[PathBuf]) -> Result<(), Failure> {
    if paths.is_empty() {
        return Err(no_output(
            "add -o sky.png, -o sky.exr, -o sky.hdr or -o sky.nc",
        ));
    }
    for (i, path) in paths.iter().enumerate() {
        Format::of(path).map_err(|e| Failure::from(e).into_usage())?;
        if paths[..i].contains(path) {
            return Err(Failure::usage(
                format!("{} is given twice", path.display()),
                "give each file once",
            ));
        }
    }
    for path in paths {
        check_target(path)?;
    }
    Ok(())
}

/// What a file says of how it came about. Names stay below 25 characters: with `celaje.` before them they are then legal
/// in every version of EXR.
pub fn metadata(plan: &Plan, sky: &Sky, sensor: &dyn Sensor) -> Vec<(String, String)> {
    let mut entries = plan.origin();
    let accuracy_told = entries.iter().any(|(name, _)| name == "accuracy");
    let mut add = |name: &str, value: String| entries.push((name.to_owned(), value));
    let options = &plan.options;
    let altitude_m = options.altitude_m.unwrap_or(sky.ground_altitude_m());
    add("observer_altitude_m", altitude_m.to_string());
    add("sun_disc", format!("{:?}", options.sun_disc).to_lowercase());
    add("method", format!("{:?}", options.method).to_lowercase());
    if options.method == Method::Shells {
        // Tables have brought their own.
        if !accuracy_told {
            add("accuracy", options.accuracy.name().to_owned());
        }
    } else {
        add("spp", options.budget.spp.to_string());
        add("seed", options.budget.seed.to_string());
    }
    if let Some(noise) = plan.goal.noise {
        add("noise", noise.to_string());
    }
    if let Some(limit) = plan.goal.time_limit {
        add("time_limit", format!("{} s", limit.as_secs_f64()));
    }
    if matches!(options.method, Method::Path | Method::Shells) {
        let polarised = match options.polarised {
            Polarised::Off => "off",
            Polarised::Radiance if sky.tables.as_ref().is_some_and(|t| !t.polarised()) => "off",
            Polarised::Radiance => "radiance",
            Polarised::Stokes => "on",
        };
        add("polarised", polarised.to_owned());
    }
    let orders = options.budget.max_order;
    add(
        "max_order",
        orders.map_or("all".to_owned(), |n| n.to_string()),
    );
    add("version", env!("CARGO_PKG_VERSION").to_owned());
    entries.extend(sensor.description());
    entries
}

/// Where noise or time decided, the paths that a pixel was given on average stand in the place of the most allowed.
fn with_paths(
    mut metadata: Vec<(String, String)>,
    film: &Film,
    plan: &Plan,
) -> Vec<(String, String)> {
    if plan.goal != Goal::default() {
        for (name, value) in &mut metadata {
            if name == "spp" {
                *value = mean_paths(film).to_string();
            }
        }
    }
    metadata
}

/// Paths per pixel that sees something, on average.
fn mean_paths(film: &Film) -> u64 {
    let lit = film.samples.iter().filter(|&&n| n > 0).count() as u64;
    let total: u64 = film.samples.iter().map(|&n| u64::from(n)).sum();
    (total + lit / 2) / lit.max(1)
}

/// One line for the person who waited.
fn summary(film: &Film, plan: &Plan, rendered_s: f64) -> String {
    let (width, height, wavelengths) = (film.width, film.height, film.wavelength_nm.len());
    let how = match plan.options.method {
        Method::Shells => "without noise".to_owned(),
        _ if plan.goal == Goal::default() => {
            paths_and_noise(film, &plan.options.budget.spp.to_string())
        }
        _ => paths_and_noise(film, &format!("on average {}", mean_paths(film))),
    };
    format!(
        "rendered {width}x{height} pixels, {wavelengths} wavelengths in {rendered_s:.1} s; {how}"
    )
}

/// Paths and noise of a film, in words.
pub fn paths_and_noise(film: &Film, paths: &str) -> String {
    let noise = film.noise().map_or_else(
        || "no standard error (it takes 2 paths and some light)".to_owned(),
        |worst| {
            let edge = Film::block_edge(film.height);
            let mean = mean_relative_standard_error(film).unwrap_or(0.0);
            format!(
                "mean relative standard error {:.2} %, {:.2} % in the noisiest of all wavelengths and blocks of {edge}x{edge}",
                100.0 * mean,
                100.0 * worst
            )
        },
    );
    format!("{paths} paths per pixel, {noise}")
}

/// Mean over all pixels and wavelengths that are not black of standard error over radiance.
fn mean_relative_standard_error(film: &Film) -> Option<f64> {
    let values = film.radiance.iter().zip(&film.variance);
    let (sum, count) = values
        .filter(|(&l, _)| l > 0.0)
        .fold((0.0, 0u64), |(sum, count), (&l, &v)| {
            (sum + f64::from(v).sqrt() / f64::from(l), count + 1)
        });
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_is_a_mean_of_ratios_without_black() {
        let mut film = Film::new(2, 1, &[500.0, 600.0]).unwrap();
        assert_eq!(mean_relative_standard_error(&film), None);
        film.samples = vec![4, 4];
        film.radiance = vec![1.0, 2.0, 0.0, 4.0];
        film.variance = vec![0.01, 0.16, 0.0, 0.36];
        let noise = mean_relative_standard_error(&film).unwrap();
        assert!((noise - (0.1 + 0.2 + 0.15) / 3.0).abs() < 1e-6);
    }
}
