//! A command's options, checked and turned into a sky and a way to look at it.

use std::num::NonZeroUsize;

use celaje::bake::BakeOptions;
use celaje::climate::Conditions;
use celaje::error::check_range;
use celaje::irradiance::{Irradiance, Tilt};
use celaje::place::SunPosition;
use celaje::residual::{Correction, Residual};
use celaje::sensor::Sensor;
use celaje::sky::{Method, Polarised, RenderOptions, SunDisc};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{Accuracy, Budget, Goal, Keep, Outcome, Partial, Reins, MOST_PATHS};
use celaje::{Film, Sky, WavelengthGrid};

use crate::air::{Air, WhereWhen};
use crate::bake::{of_the_sun, Baked};
use crate::failure::Failure;
use crate::interrupt;
use crate::options::{wavelengths, Disc, MethodOptions, Switch, View};
use crate::progress::{Progress, ProgressMode};

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
