//! The options that commands share, and what the library makes of them.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use celaje::bake::BakeOptions;
use celaje::climate::Conditions;
use celaje::colour::{Exposure, Look, Observer, ToneCurve};
use celaje::error::check_range;
use celaje::irradiance::{Irradiance, Tilt};
use celaje::place::SunPosition;
use celaje::residual::{Correction, Residual};
use celaje::sensor::{Fisheye, LatLong, Perspective, Sensor, PROJECTIONS};
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Accuracy, Budget, Goal, Keep, Outcome, Partial, Reins, MOST_PATHS};
use celaje::{Error, Film, Sky, WavelengthGrid};
use clap::{Args, ValueEnum};

pub use crate::air::{Air, WhereWhen};
use crate::bake::{of_the_sun, Baked};
use crate::failure::Failure;
use crate::interrupt;
use crate::progress::{Progress, ProgressMode};

/// From where, and at which wavelengths.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "View")]
pub struct View {
    /// Vacuum wavelengths, nm, 280 to 2500: START:STOP:STEP or a list such as 450,550,650 [default: 380:780:5]
    #[arg(long, value_name = "NM")]
    wavelengths: Option<String>,
    /// Observer above sea level, m, anywhere from the ground into space [default: on the ground]
    #[arg(long, value_name = "M")]
    observer_altitude: Option<f64>,
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
    method: Option<String>,
    /// How finely shells cuts: preview, default, high [default: default; with --tables: theirs]
    #[arg(long, value_name = "NAME")]
    accuracy: Option<String>,
    /// Paths per pixel or direction, 1 or more; noise falls with their square root [default: 64; radiance: 1024]
    #[arg(long, value_name = "N")]
    spp: Option<u64>,
    /// Follow paths until the relative standard error is this small: 1% or 0.01; --spp is then the most per pixel
    #[arg(long, value_name = "X%")]
    noise: Option<String>,
    /// Follow paths for this long: 60s, 5min, 2h; the batch of paths under way is finished
    #[arg(long, value_name = "TIME")]
    time_limit: Option<String>,
    /// Tables that celaje bake has made: air and ground come from there, any sun and view cost next to nothing
    #[arg(long, value_name = "FILE")]
    tables: Option<PathBuf>,
    /// Count this many scatterings and reflections only [default: all]
    #[arg(long, value_name = "N")]
    max_order: Option<u32>,
    /// Polarisation: on writes Q, U, V beside the radiance (path, shells); off follows scalar light [default: light is
    /// polarised on its way where the method knows how, and the radiance written]
    #[arg(long, value_name = "WHETHER", hide_possible_values = true)]
    polarised: Option<Switch>,
    /// Seed: the same gives the same values, on any number of threads
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Threads, 1 to 1024 [default: all cores]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
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

/// Everything checked that a sky is built from; building it takes a while.
pub struct Plan {
    /// What was found or given.
    pub conditions: Conditions,
    /// Wavelengths of the sky.
    pub wavelength: WavelengthGrid,
    /// Sunlight.
    pub solar: SolarSpectrum,
    /// How it is looked at.
    pub options: RenderOptions,
    /// How much is enough.
    pub goal: Goal,
    threads: Option<NonZeroUsize>,
    baked: Option<Baked>,
}

impl Plan {
    /// Checks all options of a sky and of the way to look at it; `default` is the command's own method and paths.
    pub fn new(
        where_when: &WhereWhen,
        air: &Air,
        view: &View,
        method: &MethodOptions,
        disc: Disc,
        default: (Method, u64),
    ) -> Result<Self, Failure> {
        let baked = method.tables.as_deref().map(|path| Baked::load(path, air));
        let baked = baked.transpose()?;
        let conditions = match &baked {
            Some(tables) => where_when.sun_or(&tables.sun()?, air)?,
            None => where_when.conditions(air)?,
        };
        let wavelength = match &baked {
            Some(tables) => tables_wavelengths(tables, view)?,
            None => wavelengths(view.wavelengths.as_deref())?,
        };
        // The ground of tables is their own; whoever looks from below it is told so when it is looked at.
        let ground_m = match &baked {
            Some(_) => -1e4,
            None => conditions.altitude_m.value,
        };
        if let Some(altitude_m) = view.observer_altitude {
            // Up to the distance of the Sun's own planets there is nothing to go wrong; below the ground there is.
            check_range("observer altitude", altitude_m, "m", ground_m..=1e9)?;
        }
        let goal = method.goal()?;
        let open_ended = goal != Goal::default();
        let default_spp = if open_ended {
            u64::from(MOST_PATHS)
        } else {
            default.1
        };
        let spp = method.spp.unwrap_or(default_spp);
        check_range("spp", spp as f64, "", 1.0..=f64::from(u32::MAX))?;
        // Who asks for a number of paths, or for what only paths have, wants paths.
        let default_method = if method.spp.is_some() || open_ended {
            Method::Path
        } else if baked.is_some() {
            // Who gives tables wants them used.
            Method::Shells
        } else {
            default.0
        };
        let solver = method.method.as_deref();
        let solver = solver.map_or(Ok(default_method), Method::named)?;
        if open_ended && solver == Method::Shells {
            return Err(Failure::usage(
                "--noise and --time-limit have no meaning for shells, which has no noise",
                "leave them out, or add --method path",
            ));
        }
        if method.spp.is_some() && solver == Method::Shells {
            return Err(Failure::usage(
                "--spp has no meaning for shells, which has no noise",
                "leave it out, or add --method path",
            ));
        }
        if let (Some(_), Some(_)) = (&method.accuracy, &baked) {
            return Err(Failure::usage(
                "--accuracy is given beside --tables, which are solved already",
                "leave it out, or bake other tables with it",
            ));
        }
        let polarised = match method.polarised {
            None => Polarised::Radiance,
            Some(Switch::On) => Polarised::Stokes,
            Some(Switch::Off) => Polarised::Off,
        };
        let possible = solver.check_polarised(polarised);
        possible.map_err(|e| Failure::from(e).into_usage())?;
        if let Some(threads) = method.threads {
            check_range("threads", threads.get() as f64, "", 1.0..=1024.0)?;
        }
        let budget = Budget {
            spp: spp as u32,
            seed: method.seed,
            max_order: method.max_order,
        };
        Ok(Self {
            conditions,
            wavelength,
            solar: air.solar()?,
            options: RenderOptions {
                accuracy: match &method.accuracy {
                    Some(name) => Accuracy::named(name)?,
                    None => Accuracy::default(),
                },
                method: solver,
                polarised,
                budget,
                sun_disc: match disc {
                    Disc::On => SunDisc::On,
                    Disc::Off => SunDisc::Off,
                    Disc::Only => SunDisc::Only,
                },
                altitude_m: view.observer_altitude,
            },
            goal,
            threads: method.threads,
            baked,
        })
    }

    /// Checks the options of a sky to be baked; without a place and a sun, the air is that of no place.
    pub fn to_bake(
        where_when: &WhereWhen,
        air: &Air,
        wavelengths_nm: Option<&str>,
    ) -> Result<Self, Failure> {
        let anywhere = SunPosition::new(180.0, 45.0, 1.0)?;
        Ok(Self {
            conditions: where_when.sun_or(&anywhere, air)?,
            wavelength: wavelengths(wavelengths_nm)?,
            solar: air.solar()?,
            options: RenderOptions {
                method: Method::Shells,
                polarised: Polarised::default(),
                accuracy: Accuracy::default(),
                budget: Budget {
                    spp: 1,
                    seed: 0,
                    max_order: None,
                },
                sun_disc: SunDisc::On,
                altitude_m: None,
            },
            goal: Goal::default(),
            threads: None,
            baked: None,
        })
    }

    /// What a file says of the sky: the conditions, and what came with the tables if there are any.
    pub fn origin(&self) -> Vec<(String, String)> {
        let mut entries = condition_entries(&self.conditions);
        if self.baked.is_some() {
            // Of the conditions beside tables only the sun's are in force.
            entries.retain(|(name, _)| of_the_sun(name));
        }
        match &self.baked {
            Some(tables) => entries.extend(tables.origin.iter().cloned()),
            None => entries.push(("sun_spectrum".to_owned(), self.solar.name().to_owned())),
        }
        entries
    }

    /// Where the sun stands along a film.
    pub fn suns(
        &self,
        where_when: &WhereWhen,
        until: &str,
        frames: usize,
    ) -> Result<Vec<SunPosition>, Failure> {
        where_when.suns(&self.conditions, until, frames)
    }

    /// The sky with its tables, which may have to be solved for so many suns first.
    pub fn baked_for(&self, suns: &[SunPosition]) -> Result<Sky, Failure> {
        let sky = self.sky()?;
        if sky.tables.is_some() {
            return Ok(sky);
        }
        let elevation = |pick: fn(f64, f64) -> f64| {
            let all = suns.iter().map(SunPosition::elevation_deg);
            all.fold(suns.first().map_or(0.0, SunPosition::elevation_deg), pick)
        };
        let options = BakeOptions {
            sun_elevation_deg: (elevation(f64::min), elevation(f64::max)),
            highest_observer_m: self.options.altitude_m.unwrap_or(sky.ground_altitude_m()),
            accuracy: self.options.accuracy,
            polarised: self.options.polarised != Polarised::Off,
        };
        Ok(interrupt::stoppable(|flag| sky.baked(&options, flag))?)
    }

    /// Tells whoever asked for a single path that its standard error is not known.
    pub fn note_single_paths(&self) {
        if self.options.method != Method::Shells && self.options.budget.spp == 1 {
            eprintln!("note: a standard error takes two paths; the columns se_ hold 0");
        }
    }

    /// Tells whoever makes pictures from few wavelengths that their colours are not those of the sky.
    pub fn note_false_colours(&self) {
        // Where the eye sees next to nothing more, and a step that its curves and the sky's spectrum bear.
        const EYE_NM: (f64, f64) = (400.0, 700.0);
        const LONGEST_STEP_NM: f64 = 20.0;
        let nm = self.wavelength.nm();
        let (first, last) = (nm[0], nm[nm.len() - 1]);
        let fine = nm.windows(2).all(|w| {
            let seen = w[1] > EYE_NM.0 && w[0] < EYE_NM.1;
            !seen || w[1] - w[0] <= LONGEST_STEP_NM
        });
        if !fine || first > EYE_NM.0 || last < EYE_NM.1 {
            eprintln!(
                "note: colours made of {} from {first} to {last} nm are not what eyes see; --wavelengths 380:780:5 shows that",
                match nm.len() {
                    1 => "one wavelength".to_owned(),
                    n => format!("{n} wavelengths"),
                }
            );
        }
    }

    /// Builds the sky, or takes it from the tables.
    pub fn sky(&self) -> Result<Sky, Failure> {
        if let Some(tables) = &self.baked {
            return tables.under(&self.conditions.sun()?);
        }
        Ok(Sky::new(
            self.conditions.clone(),
            &self.wavelength,
            self.solar,
        )?)
    }

    /// Looks at a sky, with progress, until it is done or the user has enough.
    pub fn look(
        &self,
        sky: &Sky,
        sensor: &dyn Sensor,
        mode: ProgressMode,
    ) -> Result<Outcome, Failure> {
        self.look_and_keep(sky, sensor, mode, None, None)
    }

    /// As [`Plan::look`], from where an earlier run was interrupted, and keeping what is finished every few seconds.
    pub fn look_and_keep(
        &self,
        sky: &Sky,
        sensor: &dyn Sensor,
        mode: ProgressMode,
        resume: Option<Partial>,
        keep: Option<Keep<'_>>,
    ) -> Result<Outcome, Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        let outcome = interrupt::stoppable(|flag| {
            if self.goal == Goal::default() && keep.is_none() {
                let film = sky.render(sensor, &self.options, flag, &report)?;
                return Ok(Outcome {
                    film,
                    reached: true,
                });
            }
            let reins = Reins {
                resume,
                keep,
                progress: &report,
            };
            sky.render_until(sensor, &self.options, &self.goal, flag, reins)
        })?;
        progress.finish();
        if let (false, Some(noise)) = (outcome.reached, self.goal.noise) {
            let got = outcome
                .film
                .noise()
                .map_or(String::new(), |n| format!("{:.2} % is ", 100.0 * n));
            eprintln!(
                "note: {got}the noise reached, {:.2} % was asked for; more paths or time would be needed",
                100.0 * noise
            );
        }
        Ok(outcome)
    }

    /// Compares a picture with the reference, with progress.
    pub fn check(
        &self,
        sky: &Sky,
        sensor: &dyn Sensor,
        spp: u32,
        mode: ProgressMode,
    ) -> Result<Residual, Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        Ok(interrupt::stoppable(|flag| {
            sky.residual(sensor, &self.options, spp, flag, &report)
        })?)
    }

    /// Looks at a sky by shells and corrects the picture by the reference, with progress.
    pub fn look_and_correct(
        &self,
        sky: &Sky,
        sensor: &dyn Sensor,
        spp: u32,
        mode: ProgressMode,
    ) -> Result<(Film, Correction), Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        let corrected = interrupt::stoppable(|flag| {
            sky.render_corrected(sensor, &self.options, spp, flag, &report)
        })?;
        progress.finish();
        Ok(corrected)
    }

    /// Measures irradiance, with progress, until it is done or the user has enough.
    pub fn measure(
        &self,
        sky: &Sky,
        plane: &Tilt,
        mode: ProgressMode,
    ) -> Result<Irradiance, Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        Ok(interrupt::stoppable(|flag| {
            sky.irradiance(plane, &self.options, flag, &report)
        })?)
    }

    /// Does some work on as many threads as the user wants.
    pub fn on_threads<T: Send>(
        &self,
        work: impl FnOnce() -> Result<T, Failure> + Send,
    ) -> Result<T, Failure> {
        let Some(threads) = self.threads else {
            return work();
        };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build()
            .map_err(|e| Failure::usage(format!("{threads} threads: {e}"), "ask for fewer"))?
            .install(work)
    }
}

impl MethodOptions {
    /// Noise and time, from words.
    fn goal(&self) -> Result<Goal, Failure> {
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

/// Name and text of every condition and of its reason, as files keep them.
pub fn condition_entries(conditions: &Conditions) -> Vec<(String, String)> {
    let mut entries = Vec::new();
    for row in conditions.rows() {
        let reason = format!("{} [{}]", row.condition.reason, row.condition.source);
        entries.push((row.key.to_owned(), row.text));
        entries.push((format!("{}.reason", row.key), reason));
    }
    entries
}

/// The wavelengths of tables, which nobody may change.
fn tables_wavelengths(tables: &Baked, view: &View) -> Result<WavelengthGrid, Failure> {
    let own = WavelengthGrid::new(tables.wavelength_nm().to_vec())?;
    if view.wavelengths.is_some() && wavelengths(view.wavelengths.as_deref())? != own {
        return Err(Failure::usage(
            "--wavelengths are not those of the tables",
            "leave --wavelengths out, or bake other tables with them",
        ));
    }
    Ok(own)
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
