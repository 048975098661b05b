//! Place, time and air: the options that conditions come from.

use celaje::climate::{due_south, Albedo, Condition, Conditions, Overrides, OzoneClimate};
use celaje::composition::aerosol::AerosolType;
use celaje::composition::upper::{Mesosphere, Stratosphere};
use celaje::error::check_range;
use celaje::place::{clock_doubt, parse_time, parse_time_at, Site, SunPosition};
use celaje::spectrum::SolarSpectrum;
use clap::Args;

use crate::failure::Failure;

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
    /// Aerosol of the mesosphere: dust, ice, dust-and-ice, none [default: none]
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
    /// Spectrum of the sun above the air (celaje list suns) [default: tsis1]
    #[arg(long, value_name = "NAME")]
    sun_spectrum: Option<String>,
}

impl WhereWhen {
    /// The conditions there and then, everything checked.
    pub fn conditions(&self, air: &Air) -> Result<Conditions, Failure> {
        let overrides = self.overrides(air)?;
        let conditions = match (&self.at, &self.time, self.sun_elevation) {
            (Some(at), Some(time), _) => {
                let site = Site::parse(at)?;
                let instant = parse_time(time, &site, self.local)?;
                if let Some(doubt) = self.local.then(|| clock_doubt(time, &site)).flatten() {
                    eprintln!("note: {doubt}");
                }
                Conditions::at(&site, &instant, &overrides)?
            }
            (None, None, Some(elevation_deg)) => {
                let azimuth_deg = self.sun_azimuth.unwrap_or(due_south().value);
                let mut conditions = Conditions::from_sun(elevation_deg, azimuth_deg, &overrides)?;
                if self.sun_azimuth.is_none() {
                    conditions.sun_azimuth_deg = due_south();
                }
                conditions
            }
            (at, time, _) => return Err(incomplete(at.is_some(), time.is_some())),
        };
        // Names are looked up where things are composed: an unknown one is refused here, before any work.
        AerosolType::of_conditions(&conditions)?;
        Stratosphere::named(&conditions.stratosphere.value)?;
        Mesosphere::named(&conditions.mesosphere.value)?;
        Ok(conditions)
    }

    /// The conditions there and then; under a given sun where neither place and time nor a sun is given.
    pub fn sun_or(&self, sun: &SunPosition, air: &Air) -> Result<Conditions, Failure> {
        if self.at.is_some() || self.time.is_some() || self.sun_elevation.is_some() {
            return self.conditions(air);
        }
        let mut overrides = self.overrides(air)?;
        overrides.sun_distance_au = Some(sun.distance_au());
        let azimuth_deg = self.sun_azimuth.unwrap_or(sun.azimuth_deg());
        let mut conditions = Conditions::from_sun(sun.elevation_deg(), azimuth_deg, &overrides)?;
        let of_tables = |value, unit| Condition::new(value, unit, "tables", "no sun given: theirs");
        conditions.sun_elevation_deg = of_tables(sun.elevation_deg(), "deg");
        conditions.sun_distance_au = of_tables(sun.distance_au(), "au");
        if self.sun_azimuth.is_none() {
            conditions.sun_azimuth_deg = of_tables(sun.azimuth_deg(), "deg");
        }
        Ok(conditions)
    }

    /// The sun in each frame from the time or the elevation that begins a film to the one that ends it.
    pub fn suns(
        &self,
        conditions: &Conditions,
        until: &str,
        frames: usize,
    ) -> Result<Vec<SunPosition>, Failure> {
        let share = |k: usize| k as f64 / (frames.max(2) - 1) as f64;
        let (Some(at), Some(begin)) = (&self.at, &conditions.time) else {
            let first = conditions.sun()?;
            let last_deg: f64 = until.parse().map_err(|_| {
                Failure::usage(
                    format!("until '{until}' is not an elevation of the sun"),
                    "give degrees such as --until -18, or begin with --at and --time",
                )
            })?;
            check_range("until", last_deg, "deg", -90.0..=90.0)?;
            let rise = last_deg - first.elevation_deg();
            return (0..frames)
                .map(|k| {
                    let elevation_deg = first.elevation_deg() + share(k) * rise;
                    let (azimuth, distance) = (first.azimuth_deg(), first.distance_au());
                    Ok(SunPosition::new(azimuth, elevation_deg, distance)?)
                })
                .collect();
        };
        let site = Site::parse(at)?;
        // A word such as sunset means that of the film's day.
        let end = parse_time_at(until, &site, self.local, &begin.value)?;
        let seconds = end.unix_seconds() - begin.value.unix_seconds();
        if seconds <= 0.0 {
            return Err(Failure::usage(
                format!(
                    "the film ends at {end}, before it begins at {}",
                    begin.value
                ),
                "give a later --until, such as sunset+90min",
            ));
        }
        (0..frames)
            .map(|k| {
                let instant = begin.value.later_by(share(k) * seconds)?;
                Ok(SunPosition::at(&site, &instant)?)
            })
            .collect()
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

impl Air {
    /// An option of the air that was given, if any was.
    pub fn given(&self) -> Option<&'static str> {
        let given = [
            ("--aerosol", self.aerosol.is_some()),
            ("--aod", self.aod.is_some()),
            ("--turbidity", self.turbidity.is_some()),
            ("--visibility", self.visibility.is_some()),
            ("--as-tabulated", self.as_tabulated),
            ("--stratosphere", self.stratosphere.is_some()),
            ("--mesosphere", self.mesosphere.is_some()),
            ("--humidity", self.humidity.is_some()),
            ("--ozone", self.ozone.is_some()),
            ("--ozone-climate", self.ozone_climate.is_some()),
            ("--no2", self.no2.is_some()),
            ("--water", self.water.is_some()),
            ("--co2", self.co2.is_some()),
            ("--no-ozone", self.no_ozone),
            ("--albedo", self.albedo.is_some()),
            ("--atmosphere", self.atmosphere.is_some()),
            ("--sun-spectrum", self.sun_spectrum.is_some()),
        ];
        let mut given = given.into_iter().filter(|(_, is)| *is);
        given.next().map(|(name, _)| name)
    }

    /// The sun's spectrum.
    pub fn solar(&self) -> Result<SolarSpectrum, Failure> {
        let name = self.sun_spectrum.as_deref();
        Ok(name.map_or(Ok(SolarSpectrum::Tsis1), SolarSpectrum::named)?)
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
