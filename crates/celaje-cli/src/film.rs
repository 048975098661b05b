//! `celaje film`: a sky while the sun moves, as an animation or as numbered pictures.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use celaje::colour::{adapted_whites, ColourImage, Exposure, Look};
use celaje::error::check_range;
use celaje::image::{check_target, save, Animation, Format};
use celaje::place::SunPosition;
use celaje::sensor::Sensor;
use celaje::sky::Method;
use celaje::{Film, Sky};
use clap::Args;

use crate::failure::Failure;
use crate::interrupt;
use crate::options::{Air, Colour, MethodOptions, Picture, View, WhereWhen};
use crate::plan::Plan;
use crate::progress::Progress;
use crate::render::{metadata, no_output};

/// Frames looked at in small before the film is made, to find its exposure.
const PILOT_FRAMES: usize = 40;
/// Pixels of the longer side of these.
const PILOT_SIZE: usize = 32;
/// Frames over which the exposure is smoothed, as a share of the film.
const SMOOTHED_OVER: f64 = 0.04;
/// How long a film may take to be written after Ctrl-C.
const GRACE: Duration = Duration::from_secs(10);

/// Film the sky while the sun moves: an animation, or numbered pictures
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
A .png without a number in its name is an animation (APNG), which browsers play; a name with %04d is a picture for each frame,
.png, .exr or .hdr, numbered from 1. Without --exposure the exposure follows the light smoothly, as eyes do, but not wholly: a
million times less light is shown four times darker. With --exposure EV it stays the same.
Ctrl-C keeps the frames that are done.

Examples:
  celaje film --at Zaragoza --time \"2026-06-21 sunset-60min\" --until sunset+100min -o dusk.png
  celaje film --sun-elevation 10 --until -18 --frames 300 --projection perspective --look 180,20 -o frame%04d.exr"
)]
pub struct FilmArgs {
    /// Scene file (TOML) with the words of these options; options given here win
    #[arg(value_name = "SCENE.toml")]
    scene: Option<PathBuf>,
    /// File to write: .png for an animation, or a name with %04d; may be given several times
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Vec<PathBuf>,
    /// When the film ends, in the words of --time; or the elevation of the sun there, degrees
    #[arg(
        long,
        value_name = "TIME|DEG",
        allow_hyphen_values = true,
        help_heading = "Where and when"
    )]
    until: Option<String>,
    /// Frames, the first at --time and the last at --until, 2 to 100000
    #[arg(
        long,
        value_name = "N",
        default_value_t = 300,
        help_heading = "Where and when"
    )]
    frames: usize,
    /// Frames per second of an animation, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 30, help_heading = "Output")]
    fps: u16,
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
    #[command(flatten)]
    colour: Colour,
}

/// Checks everything, renders frame after frame, writes every file.
pub fn run(args: &FilmArgs) -> Result<(), Failure> {
    let Some(until) = &args.until else {
        return Err(Failure::usage(
            "no end of the film is given",
            "add --until, such as --until sunset+90min, or --until -18 with --sun-elevation",
        ));
    };
    check_range("frames", args.frames as f64, "", 2.0..=100_000.0)?;
    check_range("fps", f64::from(args.fps), "s^-1", 1.0..=1000.0)?;
    let plan = Plan::new(
        &args.where_when,
        &args.air,
        &args.view,
        &args.method,
        args.picture.sun_disc,
        (Method::Shells, 64),
    )?;
    if plan.options.method != Method::Shells {
        return Err(Failure::usage(
            "a film is made by the method shells alone",
            "leave --method and --spp out; celaje render follows paths, one picture at a time",
        ));
    }
    let suns = plan.suns(&args.where_when, until, args.frames)?;
    let sensor = args.picture.sensor(plan.wavelength.len())?;
    let look = args.colour.look()?;
    let outputs = Output::all(&args.output, sensor.as_ref())?;
    let names: Vec<PathBuf> = outputs.iter().map(|o| o.path(1)).collect();
    interrupt::set_targets(&names);
    plan.note_false_colours();
    plan.on_threads(|| shoot(args, &plan, &suns, sensor.as_ref(), look, outputs))
}

/// Where frames go.
enum Output {
    Animation(PathBuf, Animation),
    /// The text before and after the number, and its least digits.
    Numbered(String, String, usize),
}

impl Output {
    /// Makes sure that every file can be written.
    fn all(paths: &[PathBuf], sensor: &dyn Sensor) -> Result<Vec<Self>, Failure> {
        if paths.is_empty() {
            return Err(no_output("add -o film.png, or -o frame%04d.exr"));
        }
        let (width, height) = sensor.size();
        paths
            .iter()
            .map(|path| {
                let output = match pattern(path) {
                    Some((before, after, digits)) => Self::Numbered(before, after, digits),
                    None => Self::Animation(path.clone(), Animation::new(width, height)?),
                };
                let format = check_target(&output.path(1))?;
                if matches!(output, Self::Animation(..)) && format != Format::Png {
                    return Err(Failure::usage(
                        format!("{} cannot hold many frames", path.display()),
                        "give .png for an animation, or a name with a number such as frame%04d.exr",
                    ));
                }
                Ok(output)
            })
            .collect()
    }

    /// The file of a frame, counted from 1.
    fn path(&self, frame: usize) -> PathBuf {
        match self {
            Self::Animation(path, _) => path.clone(),
            Self::Numbered(before, after, digits) => {
                PathBuf::from(format!("{before}{frame:0digits$}{after}"))
            }
        }
    }
}

/// The parts of a name with `%d` or `%04d`.
fn pattern(path: &Path) -> Option<(String, String, usize)> {
    let text = path.to_str()?;
    let (before, rest) = text.split_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let width = match digits {
        "" => 1,
        digits => digits.strip_prefix('0')?.parse().ok()?,
    };
    (width <= 9).then(|| (before.to_owned(), after.to_owned(), width))
}

/// Makes the film; whatever ends it early, frames that are done are kept.
fn shoot(
    args: &FilmArgs,
    plan: &Plan,
    suns: &[SunPosition],
    sensor: &dyn Sensor,
    look: Look,
    mut outputs: Vec<Output>,
) -> Result<(), Failure> {
    let start = Instant::now();
    let baked = plan.baked_for(suns)?;
    let looks = looks(args, plan, &baked, suns, look)?;
    let ready_s = start.elapsed().as_secs_f64();
    let progress = Progress::start(args.method.progress);
    interrupt::allow(GRACE);
    let mut done = 0;
    // Stoppable as a whole: a signal between two frames must not end the process before the film is written.
    let ended = interrupt::stoppable(|flag| {
        let mut shot = Ok(());
        for (sun, look) in suns.iter().zip(&looks) {
            shot = baked
                .under(sun)
                .and_then(|sky| Ok((sky.render(sensor, &plan.options, flag, &|_, _| ())?, sky)))
                .map_err(Failure::from)
                .and_then(|(film, sky)| {
                    keep(plan, &sky, sensor, &film, look, done + 1, &mut outputs)
                });
            if shot.is_err() {
                break;
            }
            done += 1;
            progress.report(done as u64, suns.len() as u64);
        }
        finish(plan, &outputs, args.fps).and(shot)
    });
    progress.finish();
    let seconds = start.elapsed().as_secs_f64();
    eprintln!(
        "filmed {done} of {} frames in {seconds:.1} s, {ready_s:.1} s of them to solve and expose",
        suns.len()
    );
    ended
}

fn frame(plan: &Plan, sky: &Sky, sensor: &dyn Sensor) -> Result<Film, Failure> {
    Ok(interrupt::stoppable(|flag| {
        sky.render(sensor, &plan.options, flag, &|_, _| ())
    })?)
}

/// Puts a frame where it belongs: numbered pictures into their files, those of an animation into its memory.
fn keep(
    plan: &Plan,
    sky: &Sky,
    sensor: &dyn Sensor,
    film: &Film,
    look: &Look,
    number: usize,
    outputs: &mut [Output],
) -> Result<(), Failure> {
    for output in outputs {
        let path = output.path(number);
        match output {
            Output::Animation(_, animation) => {
                let image = ColourImage::from_film(film, look.observer)?;
                animation.push(&image.display(look.tone, look.exposure)?)?;
            }
            Output::Numbered(..) => {
                let mut entries = metadata(plan, sky, sensor);
                let (azimuth, elevation) = sky.sun.direction.to_azimuth_elevation_deg();
                for (name, value) in &mut entries {
                    match name.as_str() {
                        "sun_elevation_deg" => *value = format!("{elevation:.4}"),
                        "sun_azimuth_deg" => *value = format!("{azimuth:.4}"),
                        _ => {}
                    }
                }
                entries.retain(|(name, _)| name != "time");
                entries.push(("frame".to_owned(), number.to_string()));
                save(&path, film, look, Some(sensor), &entries)?;
            }
        }
    }
    Ok(())
}

/// Writes animations with as many frames as they have.
fn finish(plan: &Plan, outputs: &[Output], frames_per_second: u16) -> Result<(), Failure> {
    for output in outputs {
        if let Output::Animation(path, animation) = output {
            if !animation.is_empty() {
                animation.save(path, frames_per_second, &plan.origin())?;
            }
        }
    }
    Ok(())
}

/// The look of each frame: a fixed exposure stays, an automatic one follows the light.
fn looks(
    args: &FilmArgs,
    plan: &Plan,
    baked: &Sky,
    suns: &[SunPosition],
    look: Look,
) -> Result<Vec<Look>, Failure> {
    if look.exposure != Exposure::Auto {
        return Ok(vec![look; suns.len()]);
    }
    let small = args.picture.small(PILOT_SIZE)?;
    let sensor = small.sensor(plan.wavelength.len())?;
    let pilots = suns.len().min(PILOT_FRAMES);
    let place = |k: usize| k as f64 * (suns.len() - 1) as f64 / (pilots - 1) as f64;
    let mut whites = Vec::new();
    for k in 0..pilots {
        let sun = &suns[place(k).round() as usize];
        let film = frame(plan, &baked.under(sun)?, sensor.as_ref())?;
        let image = ColourImage::from_film(&film, look.observer)?;
        whites.push(Exposure::Auto.white(&image.luminance)?);
    }
    let whites = adapted_whites(&whites, suns.len(), SMOOTHED_OVER * suns.len() as f64);
    Ok(whites
        .into_iter()
        .map(|white| Look {
            exposure: Exposure::of_white(white),
            ..look
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_in_a_name() {
        let parts = |name: &str| pattern(Path::new(name));
        assert_eq!(parts("a/f%04d.exr"), Some(("a/f".into(), ".exr".into(), 4)));
        assert_eq!(parts("f%d.png"), Some(("f".into(), ".png".into(), 1)));
        assert_eq!(parts("f.png"), None);
        assert_eq!(parts("f%x.png"), None);
        assert_eq!(parts("f%099d.png"), None);
        let numbered = Output::Numbered("f".into(), ".exr".into(), 4);
        assert_eq!(numbered.path(7), PathBuf::from("f0007.exr"));
    }
}
