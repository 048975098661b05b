//! The options that commands share, and how they are read; `plan` makes a sky of them.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use celaje::colour::{Exposure, Look, Observer, ToneCurve};
use celaje::error::check_range;
use celaje::sensor::{Fisheye, LatLong, Perspective, Sensor, PROJECTIONS};
use celaje::transport::Goal;
use celaje::{Error, Film, WavelengthGrid};
use clap::{Args, ValueEnum};

pub use crate::air::{Air, WhereWhen};
use crate::failure::Failure;
use crate::progress::ProgressMode;

/// From where, and at which wavelengths.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "View")]
pub struct View {
    /// Vacuum wavelengths, nm, 280 to 2500: START:STOP:STEP or a list such as 450,550,650 [default: 380:780:5]
    #[arg(long, value_name = "NM")]
    pub wavelengths: Option<String>,
    /// Observer above sea level, m, anywhere from the ground into space [default: on the ground]
    #[arg(long, value_name = "M")]
    pub observer_altitude: Option<f64>,
}

/// Whether the disc of the sun is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Disc {
    /// Sky and disc
    On,
    /// The sky alone
    Off,
    /// The disc alone, on black
    Only,
}

/// On or off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// On
    On,
    /// Off
    Off,
}

/// Where a picture looks.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "View")]
pub struct Picture {
    /// Projection: fisheye, latlong, perspective (celaje list projections)
    #[arg(long, value_name = "NAME", default_value = "fisheye")]
    projection: String,
    /// Pixels: WxH, or N for NxN (2NxN for latlong)
    #[arg(long, value_name = "WxH", default_value = "256")]
    size: String,
    /// Fisheye: the full cone; perspective: the full horizontal angle; degrees [default: 180; 90]
    #[arg(long, value_name = "DEG")]
    fov: Option<f64>,
    /// Where the middle of a perspective picture looks, degrees [default: 180,30]
    #[arg(long, value_name = "AZ,EL", allow_hyphen_values = true)]
    look: Option<String>,
    /// The sun's disc: on, off (the sky alone), only (the disc on black)
    #[arg(
        long,
        value_name = "WHICH",
        default_value = "on",
        hide_possible_values = true
    )]
    pub sun_disc: Disc,
}

/// How the light is followed.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Method")]
pub struct MethodOptions {
    /// Method: shells, path, tracker, classic (celaje list methods) [default: path; film, and render without
    /// --spp, --noise and --time-limit: shells]
    #[arg(long, value_name = "NAME")]
    pub method: Option<String>,
    /// How finely shells cuts: preview, default, high [default: default; with --tables: theirs]
    #[arg(long, value_name = "NAME")]
    pub accuracy: Option<String>,
    /// Paths per pixel or direction, 1 or more; noise falls with their square root [default: 64; radiance: 1024]
    #[arg(long, value_name = "N")]
    pub spp: Option<u64>,
    /// Follow paths until the relative standard error is this small: 1% or 0.01; --spp is then the most per pixel
    #[arg(long, value_name = "X%")]
    noise: Option<String>,
    /// Follow paths for this long: 60s, 5min, 2h; the batch of paths under way is finished
    #[arg(long, value_name = "TIME")]
    time_limit: Option<String>,
    /// Tables that celaje bake has made: air and ground come from there, any sun and view cost next to nothing
    #[arg(long, value_name = "FILE")]
    pub tables: Option<PathBuf>,
    /// Count this many scatterings and reflections only [default: all]
    #[arg(long, value_name = "N")]
    pub max_order: Option<u32>,
    /// Polarisation: on writes Q, U, V beside the radiance (path, shells); off follows scalar light [default: light is
    /// polarised on its way where the method knows how, and the radiance written]
    #[arg(long, value_name = "WHETHER", hide_possible_values = true)]
    pub polarised: Option<Switch>,
    /// Seed: the same gives the same values, on any number of threads
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads, 1 to 1024 [default: all cores]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    /// Progress and time left, on stderr: on, off, auto (on a terminal only)
    #[arg(
        long,
        value_name = "WHEN",
        default_value = "auto",
        hide_possible_values = true
    )]
    pub progress: ProgressMode,
}

/// How a spectrum becomes a colour.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Colour")]
pub struct Colour {
    /// Whose eyes: the CIE observer of 1964 (10 degrees) or 1931 (2 degrees)
    #[arg(long, value_name = "YEAR", default_value = "1964")]
    observer: String,
    /// From luminance to the display, in .png: gamma, srgb, filmic, none (celaje list tones)
    #[arg(long, value_name = "CURVE", default_value = "gamma")]
    tone: String,
    /// Exposure of .png: auto, or stops: 0 shows 10 000 cd/m2 as white, 1 half of that
    #[arg(
        long,
        value_name = "EV",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    exposure: String,
}

impl MethodOptions {
    /// Noise and time, from words.
    pub fn goal(&self) -> Result<Goal, Failure> {
        let noise = self.noise.as_deref().map(relative).transpose()?;
        if let Some(noise) = noise {
            check_range("noise", noise, "", 1e-6..=1.0)?;
        }
        let time_limit = self.time_limit.as_deref().map(duration).transpose()?;
        Ok(Goal { noise, time_limit })
    }
}

impl Picture {
    /// The same picture with at most so many pixels on its longer side.
    pub fn small(&self, most: usize) -> Result<Self, Failure> {
        let (width, height) = size(&self.size, self.projection == "latlong")?;
        let shrink = most as f64 / width.max(height) as f64;
        let side = |pixels: usize| ((pixels as f64 * shrink.min(1.0)).round() as usize).max(1);
        Ok(Self {
            size: format!("{}x{}", side(width), side(height)),
            ..self.clone()
        })
    }

    /// The sensor, small enough to be rendered at so many wavelengths.
    pub fn sensor(&self, wavelengths: usize) -> Result<Box<dyn Sensor>, Failure> {
        let known = PROJECTIONS.map(|(name, _)| name.to_owned()).to_vec();
        if !known.contains(&self.projection) {
            return Err(unknown("projection", &self.projection, known));
        }
        let latlong = self.projection == "latlong";
        let (width, height) = size(&self.size, latlong)?;
        Film::check_size(width, height, wavelengths)?;
        if latlong && self.fov.is_some() {
            return Err(Failure::usage(
                "--fov has no meaning for latlong, which shows the whole sphere",
                "leave it out",
            ));
        }
        if self.projection != "perspective" && self.look.is_some() {
            return Err(Failure::usage(
                format!("--look has no meaning for {}", self.projection),
                "leave it out, or add --projection perspective",
            ));
        }
        Ok(match self.projection.as_str() {
            "latlong" => Box::new(LatLong::new(width, height)?),
            "perspective" => {
                let (azimuth, elevation) = pair("look", self.look.as_deref().unwrap_or("180,30"))?;
                let fov = self.fov.unwrap_or(90.0);
                Box::new(Perspective::new(width, height, fov, azimuth, elevation)?)
            }
            _ => Box::new(Fisheye::new(width, height, self.fov.unwrap_or(180.0))?),
        })
    }
}

impl Colour {
    /// Observer, tone curve and exposure.
    pub fn look(&self) -> Result<Look, Failure> {
        let exposure = if self.exposure == "auto" {
            Exposure::Auto
        } else {
            let stops = self.exposure.parse().map_err(|_| {
                Failure::usage(
                    format!("exposure '{}' is not a number", self.exposure),
                    "give auto, or stops such as -2 or 1.5",
                )
            })?;
            Exposure::Ev(stops)
        };
        // Nothing is exposed here: the stops are checked.
        exposure.white(&[])?;
        Ok(Look {
            observer: Observer::by_name(&self.observer)?,
            tone: ToneCurve::by_name(&self.tone)?,
            exposure,
        })
    }
}

/// `START:STOP:STEP`, or a list with commas; 380:780:5 if nothing is given.
pub fn wavelengths(text: Option<&str>) -> Result<WavelengthGrid, Failure> {
    let Some(text) = text else {
        return Ok(WavelengthGrid::default());
    };
    let separator = if text.contains(':') { ':' } else { ',' };
    let numbers: Option<Vec<f64>> = text
        .split(separator)
        .map(|part| part.trim().parse().ok())
        .collect();
    Ok(match (numbers, separator) {
        (Some(nm), ',') => WavelengthGrid::new(nm)?,
        (Some(nm), _) if nm.len() == 3 => WavelengthGrid::range(nm[0], nm[1], nm[2])?,
        _ => {
            return Err(Failure::usage(
                format!("wavelengths '{text}' are not understood"),
                "give START:STOP:STEP in nm such as 380:780:5, or a list such as 450,550,650",
            ))
        }
    })
}

/// `1%`, `0.5 %` or `0.01`.
fn relative(text: &str) -> Result<f64, Failure> {
    let (number, unit) = match text.trim().strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text.trim(), 1.0),
    };
    let number: Result<f64, _> = number.parse();
    number.map(|n| n * unit).map_err(|_| {
        Failure::usage(
            format!("noise '{text}' is not understood"),
            "give a relative standard error such as 1% or 0.01",
        )
    })
}

/// `60s`, `5min`, `2h`, or seconds.
fn duration(text: &str) -> Result<Duration, Failure> {
    let plain = text.trim();
    let digits = plain.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit_s = match &plain[digits.len()..] {
        "" | "s" => Some(1.0),
        "m" | "min" => Some(60.0),
        "h" => Some(3600.0),
        _ => None,
    };
    let number = digits.trim_end().parse::<f64>().ok();
    let Some((number, unit_s)) = number.zip(unit_s) else {
        return Err(Failure::usage(
            format!("time limit '{text}' is not understood"),
            "give a time such as 60s, 5min or 2h",
        ));
    };
    // A year is as good as no limit.
    check_range("time limit", number * unit_s, "s", 0.001..=3.2e7)?;
    Ok(Duration::from_secs_f64(number * unit_s))
}

/// `WxH` or `N`.
fn size(text: &str, latlong: bool) -> Result<(usize, usize), Failure> {
    let plain = text.to_ascii_lowercase();
    let side = |part: &str| part.trim().parse::<usize>().ok();
    let size = match plain.split_once('x') {
        Some((width, height)) => side(width).zip(side(height)),
        None => side(&plain).map(|n| (if latlong { n.saturating_mul(2) } else { n }, n)),
    };
    size.ok_or_else(|| {
        Failure::usage(
            format!("size '{text}' is not understood"),
            "give pixels such as 512x512, or 512",
        )
    })
}

/// Two numbers with a comma between.
fn pair(name: &str, text: &str) -> Result<(f64, f64), Failure> {
    let number = |part: &str| part.trim().parse::<f64>().ok();
    text.split_once(',')
        .and_then(|(a, b)| number(a).zip(number(b)))
        .ok_or_else(|| {
            Failure::usage(
                format!("{name} '{text}' is not two numbers"),
                "give two numbers with a comma between, such as 180,30",
            )
        })
}

/// The error of a name that is in none of our lists.
pub fn unknown(kind: &'static str, name: &str, known: Vec<String>) -> Failure {
    let name = name.to_owned();
    Error::UnknownName { kind, name, known }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_time_are_read_in_several_units() {
        for (text, expected) in [("1%", 0.01), ("0.5 %", 0.005), ("0.02", 0.02)] {
            assert!((relative(text).unwrap() - expected).abs() < 1e-15, "{text}");
        }
        for (text, seconds) in [("60s", 60.0), ("1.5 min", 90.0), ("2h", 7200.0), ("7", 7.0)] {
            let got = duration(text).unwrap();
            assert!((got.as_secs_f64() - seconds).abs() < 1e-9, "{text}");
        }
        for bad in ["", "%", "one%"] {
            assert!(relative(bad).is_err(), "{bad}");
        }
        for bad in ["", "s", "5 days", "-1s", "nan", "1e30h"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }
}
