//! The options that commands share, and what the library makes of them.

use std::num::NonZeroUsize;

use celaje::climate::{Albedo, Conditions, Overrides, OzoneClimate};
use celaje::colour::{Exposure, Look, Observer, ToneCurve};
use celaje::composition::aerosol::AerosolType;
use celaje::composition::upper::{Mesosphere, Stratosphere};
use celaje::error::check_range;
use celaje::irradiance::Irradiance;
use celaje::place::{parse_time, Site};
use celaje::sensor::{Fisheye, LatLong, Perspective, Sensor, PROJECTIONS};
use celaje::sky::{Method, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Accuracy, Budget};
use celaje::{Error, Film, Sky, WavelengthGrid};
use clap::{Args, ValueEnum};

use crate::failure::Failure;
use crate::interrupt;
use crate::progress::{Progress, ProgressMode};

/// Place and time, or the sun alone.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Where and when")]
pub struct WhereWhen {
    /// Place: latitude (north positive) and longitude (east positive), degrees, or the name of a city
    #[arg(long, value_name = "LAT,LON|NAME", allow_hyphen_values = true)]
    at: Option<String>,
    /// Altitude of the ground above sea level, m, -500 to 9000 [default: climate]
    #[arg(long, value_name = "M")]
    altitude: Option<f64>,
    /// Instant, UTC or with an offset, 1900 to 2100: 2026-06-21T18:30Z; now; or sunset, "civil dusk", "2026-06-21 noon-1h"
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    time: Option<String>,
    /// Read the time in the place's own time zone: --time 2026-06-21T20:30 --local
    #[arg(long)]
    local: bool,
    /// True elevation of the sun, degrees, instead of place and time or of what they say
    #[arg(long, value_name = "DEG")]
    sun_elevation: Option<f64>,
    /// Azimuth of the sun, degrees clockwise from north [default: 180 without a place]
    #[arg(long, value_name = "DEG")]
    sun_azimuth: Option<f64>,
}

/// What the air holds, what it stands on, what shines on it.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Air, ground and sunlight")]
pub struct Air {
    /// Aerosol type: bare names are AIAA, opac:NAME OPAC (celaje list aerosols) [default: climate]
    #[arg(long, value_name = "TYPE")]
    aerosol: Option<String>,
    /// Optical depth of the aerosol at 550 nm, vertical, from the ground up, 0 to 10 [default: climate]
    #[arg(long, value_name = "TAU")]
    aod: Option<f64>,
    /// Factor on that optical depth, 0 to 100 [default: 1]
    #[arg(long, value_name = "X")]
    turbidity: Option<f64>,
    /// Visibility at the ground, km, 0.1 to 400, instead of an optical depth
    #[arg(long, value_name = "KM")]
    visibility: Option<f64>,
    /// As much aerosol as its type's own definition has, times --turbidity, instead of an optical depth
    #[arg(long)]
    as_tabulated: bool,
    /// Aerosol of the stratosphere: background, volcanic-fresh, volcanic-aged, none [default: background]
    #[arg(long, value_name = "NAME")]
    stratosphere: Option<String>,
    /// Aerosol of the mesosphere: dust, dust-and-ice, none [default: dust]
    #[arg(long, value_name = "NAME")]
    mesosphere: Option<String>,
    /// Relative humidity in which the aerosol swells, %, 0 to 99 [default: climate]
    #[arg(long, value_name = "PERCENT")]
    humidity: Option<f64>,
    /// Ozone column, Dobson units, 0 to 1000 [default: climate]
    #[arg(long, value_name = "DU")]
    ozone: Option<f64>,
    /// Where the ozone column comes from, if not given (celaje list ozone-climates) [default: sbuv]
    #[arg(long, value_name = "NAME")]
    ozone_climate: Option<String>,
    /// Nitrogen dioxide column, Dobson units, 0 to 20 [default: 0]
    #[arg(long, value_name = "DU")]
    no2: Option<f64>,
    /// Precipitable water, mm, 0 to 200 [default: climate]
    #[arg(long, value_name = "MM")]
    water: Option<f64>,
    /// Carbon dioxide, ppm, 0 to 10000 [default: climate]
    #[arg(long, value_name = "PPM")]
    co2: Option<f64>,
    /// Leave ozone out
    #[arg(long)]
    no_ozone: bool,
    /// Albedo of the ground, 0 to 1, or a preset (celaje list albedos) [default: climate]
    #[arg(long, value_name = "A|PRESET")]
    albedo: Option<String>,
    /// Reference atmosphere (celaje list atmospheres) [default: climate]
    #[arg(long, value_name = "NAME")]
    atmosphere: Option<String>,
    /// Spectrum of the sun above the air (celaje list suns)
    #[arg(long, value_name = "NAME", default_value = SolarSpectrum::Tsis1.name())]
    sun_spectrum: String,
}

/// From where, and at which wavelengths.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "View")]
pub struct View {
    /// Vacuum wavelengths, nm, 280 to 2500: START:STOP:STEP or a list such as 450,550,650
    #[arg(long, value_name = "NM", default_value = "380:780:5")]
    wavelengths: String,
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
    /// Method: shells, path, tracker, classic (celaje list methods) [default: path; render without --spp: shells]
    #[arg(long, value_name = "NAME")]
    method: Option<String>,
    /// How finely shells cuts: preview, default, high
    #[arg(long, value_name = "NAME", default_value = "default")]
    accuracy: String,
    /// Paths per pixel or direction, 1 or more; noise falls with their square root [default: 64; radiance: 1024]
    #[arg(long, value_name = "N")]
    spp: Option<u64>,
    /// Count this many scatterings and reflections only [default: all]
    #[arg(long, value_name = "N")]
    max_order: Option<u32>,
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

impl WhereWhen {
    /// The conditions there and then, everything checked.
    pub fn conditions(&self, air: &Air) -> Result<Conditions, Failure> {
        let overrides = self.overrides(air)?;
        let conditions = match (&self.at, &self.time, self.sun_elevation) {
            (Some(at), Some(time), _) => {
                let site = Site::parse(at)?;
                let instant = parse_time(time, &site, self.local)?;
                Conditions::at(&site, &instant, &overrides)?
            }
            (None, None, Some(elevation_deg)) => {
                let azimuth_deg = self.sun_azimuth.unwrap_or(180.0);
                Conditions::from_sun(elevation_deg, azimuth_deg, &overrides)?
            }
            (at, time, _) => return Err(incomplete(at.is_some(), time.is_some())),
        };
        // Names are looked up where things are composed: an unknown one is refused here, before any work.
        AerosolType::of_conditions(&conditions)?;
        Stratosphere::named(&conditions.stratosphere.value)?;
        Mesosphere::named(&conditions.mesosphere.value)?;
        Ok(conditions)
    }

    fn overrides(&self, air: &Air) -> Result<Overrides, Failure> {
        let ozone_climate = air.ozone_climate.as_deref().map(OzoneClimate::named);
        let albedo = air.albedo.as_deref().map(str::parse::<Albedo>);
        Ok(Overrides {
            altitude_m: self.altitude,
            sun_elevation_deg: self.sun_elevation,
            sun_azimuth_deg: self.sun_azimuth,
            atmosphere: air.atmosphere.clone(),
            ozone_du: air.ozone,
            ozone_climate: ozone_climate.transpose()?,
            no_ozone: air.no_ozone,
            aerosol: air.aerosol.clone(),
            aod_550: air.aod,
            turbidity: air.turbidity,
            humidity_percent: air.humidity,
            albedo: albedo.transpose()?,
            visibility_km: air.visibility,
            aerosol_as_tabulated: air.as_tabulated,
            no2_du: air.no2,
            water_mm: air.water,
            co2_ppm: air.co2,
            stratosphere: air.stratosphere.clone(),
            mesosphere: air.mesosphere.clone(),
            ..Overrides::default()
        })
    }
}

fn incomplete(place: bool, time: bool) -> Failure {
    let (message, hint) = match (place, time) {
        (true, _) => (
            "a place is given, but no time",
            "add --time, such as --time 2026-06-21T18:30Z",
        ),
        (_, true) => (
            "a time is given, but no place",
            "add --at LAT,LON, such as --at 41.65,-0.88",
        ),
        _ => (
            "neither place and time nor the sun is given",
            "give --at 41.65,-0.88 --time 2026-06-21T18:30Z, or --sun-elevation 10",
        ),
    };
    Failure::usage(message, hint)
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
    threads: Option<NonZeroUsize>,
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
        let conditions = where_when.conditions(air)?;
        let ground_m = conditions.altitude_m.value;
        if let Some(altitude_m) = view.observer_altitude {
            // Up to the distance of the Sun's own planets there is nothing to go wrong; below the ground there is.
            check_range("observer altitude", altitude_m, "m", ground_m..=1e9)?;
        }
        let spp = method.spp.unwrap_or(default.1);
        check_range("spp", spp as f64, "", 1.0..=f64::from(u32::MAX))?;
        // Who asks for a number of paths wants paths.
        let default_method = if method.spp.is_some() {
            Method::Path
        } else {
            default.0
        };
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
            wavelength: wavelengths(&view.wavelengths)?,
            solar: SolarSpectrum::named(&air.sun_spectrum)?,
            options: RenderOptions {
                accuracy: Accuracy::named(&method.accuracy)?,
                method: method
                    .method
                    .as_deref()
                    .map_or(Ok(default_method), Method::named)?,
                budget,
                sun_disc: match disc {
                    Disc::On => SunDisc::On,
                    Disc::Off => SunDisc::Off,
                    Disc::Only => SunDisc::Only,
                },
                altitude_m: view.observer_altitude,
            },
            threads: method.threads,
        })
    }

    /// Builds the sky.
    pub fn sky(&self) -> Result<Sky, Failure> {
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
    ) -> Result<Film, Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        Ok(interrupt::stoppable(|flag| {
            sky.render(sensor, &self.options, flag, &report)
        })?)
    }

    /// Measures irradiance, with progress, until it is done or the user has enough.
    pub fn measure(&self, sky: &Sky, mode: ProgressMode) -> Result<Irradiance, Failure> {
        let progress = Progress::start(mode);
        let report = |done, total| progress.report(done, total);
        Ok(interrupt::stoppable(|flag| {
            sky.irradiance(&self.options, flag, &report)
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

impl Picture {
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

/// `START:STOP:STEP`, or a list with commas.
pub fn wavelengths(text: &str) -> Result<WavelengthGrid, Failure> {
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
