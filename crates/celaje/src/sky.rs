//! The whole line in one value: conditions, atmosphere, medium, sun and ground, ready to be looked at.

use std::sync::atomic::AtomicBool;
use std::sync::Arc;

use crate::climate::{Condition, Conditions};
use crate::composition::aerosol::AerosolType;
use crate::composition::upper::{Mesosphere, Stratosphere};
use crate::composition::AirProfile;
use crate::error::{check_range, Error, Result};
use crate::film::Film;
use crate::math::Vec3;
use crate::medium::{
    from_atmosphere, grid_with_edges, GridBox, GriddedMedium, LayeredMedium, Medium,
};
use crate::optics::rayleigh::Rayleigh;
use crate::optics::{aerosol_optics, AerosolOptics};
use crate::sensor::Sensor;
use crate::spectrum::{SolarSpectrum, WavelengthGrid};
use crate::transport::{
    render_until, Accuracy, Budget, Classic, Control, Goal, Integrator, Observer, Outcome, Path,
    PolarisedPath, PolarisedShells, Reins, Scene, Shells, SunLight, Tables, Tracker,
};

/// Radius of sea level \[m\]; the atmosphere ends 100 km above it.
pub const PLANET_RADIUS_M: f64 = 6_360_000.0;

/// How the radiative transfer equation is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Method {
    /// Successive orders of scattering: deterministic, without noise.
    Shells,
    /// The reference: all wavelengths on one path, unbiased.
    #[default]
    Path,
    /// Plain tracking for any medium, all wavelengths on one path: the oracle of `path`.
    Tracker,
    /// The textbook form, one wavelength at a time: slow, the yardstick.
    Classic,
}

impl Method {
    /// Every method with its name and a line of meaning.
    pub const ALL: [(Self, &'static str, &'static str); 4] = [
        (
            Self::Shells,
            "shells",
            "successive orders of scattering: fast and without noise",
        ),
        (
            Self::Path,
            "path",
            "unbiased path tracing, all wavelengths on one path (the reference)",
        ),
        (
            Self::Tracker,
            "tracker",
            "plain delta and ratio tracking, all wavelengths on one path",
        ),
        (
            Self::Classic,
            "classic",
            "textbook path tracing, one wavelength at a time (slow)",
        ),
    ];

    /// Makes sure that the method can do what is wanted of polarisation.
    ///
    /// # Errors
    /// [`Error::Invalid`] if Q, U and V are wanted of a method of scalar light.
    pub fn check_polarised(self, wanted: Polarised) -> Result<()> {
        if wanted != Polarised::Stokes || matches!(self, Self::Path | Self::Shells) {
            return Ok(());
        }
        let name = Self::ALL.iter().find(|(m, ..)| *m == self);
        Err(Error::invalid(
            format!(
                "the method {} does not know the polarisation of light",
                name.map_or("", |(_, name, _)| name)
            ),
            "use the method shells or path, or leave polarisation off",
        ))
    }

    /// The method of a name.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.iter().find(|(_, n, _)| *n == name);
        found.map(|(m, ..)| *m).ok_or_else(|| Error::UnknownName {
            kind: "method",
            name: name.into(),
            known: Self::ALL.iter().map(|(_, n, _)| (*n).into()).collect(),
        })
    }
}

/// Whether the sun's disc is part of what is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SunDisc {
    /// Sky and disc.
    #[default]
    On,
    /// The sky alone.
    Off,
    /// The disc alone, attenuated by the air, on black.
    Only,
}

/// What becomes of the polarisation of light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Polarised {
    /// Light is a scalar: it is never polarised.
    Off,
    /// Light is polarised on its way, by methods that know how; the radiance alone is kept.
    #[default]
    Radiance,
    /// Light is polarised, and Q, U and V are kept beside the radiance.
    Stokes,
}

/// How to look at a sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// How the equation is solved.
    pub method: Method,
    /// How finely [`Method::Shells`] cuts, unless the sky is [baked](Sky::baked); the other methods do not look at it.
    pub accuracy: Accuracy,
    /// Paths per pixel, seed and number of orders.
    pub budget: Budget,
    /// Whether the sun's disc is seen.
    pub sun_disc: SunDisc,
    /// Observer above sea level \[m\]; `None` is on the ground. Never below it.
    pub altitude_m: Option<f64>,
    /// What becomes of polarisation.
    pub polarised: Polarised,
}

/// The composition behind a sky: what the air holds.
#[derive(Debug, Clone)]
pub struct Composition {
    /// Air and ozone along altitude.
    pub air: AirProfile,
    /// Aerosol layers with their optics.
    pub aerosol: AerosolOptics,
}

impl Composition {
    /// What the air of some conditions holds, with an aerosol type whose amount, and whose layers above the tropopause, are
    /// the conditions'.
    ///
    /// Where a visibility or a tabulated amount sets the optical depth, it is entered in the conditions.
    ///
    /// # Errors
    /// As [`Sky::new`].
    pub fn new(
        conditions: &mut Conditions,
        aerosol: &AerosolType,
        wavelength: &WavelengthGrid,
    ) -> Result<Self> {
        let stratosphere = Stratosphere::named(&conditions.stratosphere.value)?;
        let mut upper = stratosphere.layers(aerosol.upper_layers())?;
        upper.extend(Mesosphere::named(&conditions.mesosphere.value)?.layers()?);
        let aerosol = aerosol.clone().with_upper_layers(upper);
        let mut aerosol = aerosol_optics(&aerosol, conditions.humidity_percent.value, wavelength)?;
        let grid = grid_with_edges(conditions.altitude_m.value, &aerosol)?;
        let air = AirProfile::of_conditions(conditions, &grid)?;
        load_aerosol(&mut aerosol, conditions, &air)?;
        Ok(Self { air, aerosol })
    }
}

/// A sky.
#[derive(Debug, Clone)]
pub struct Sky {
    /// What the climate or the user said; none for a medium of one's own.
    pub conditions: Option<Conditions>,
    /// What the air holds; none for a medium of one's own.
    pub composition: Option<Composition>,
    /// Coefficients along altitude and wavelength.
    pub medium: LayeredMedium,
    /// The sun.
    pub sun: SunLight,
    /// Distance of the sun \[au\], which goes with its irradiance; 1 for a sun of one's own.
    pub sun_distance_au: f64,
    /// Albedo of the ground, shape (w,).
    pub albedo: Vec<f64>,
    /// A box in the air whose content varies in all directions, such as a cloud; only the methods `tracker` and `classic` take it.
    pub cloud: Option<GridBox>,
    /// Solved for many suns, if the sky was [baked](Sky::baked): the method `shells` then looks here. They belong to the
    /// medium and the albedo above; whoever changes one of these takes them off.
    pub tables: Option<Arc<Tables>>,
}

/// Sets the amount of aerosol that the conditions ask for, and enters its optical depth there.
fn load_aerosol(
    aerosol: &mut AerosolOptics,
    conditions: &mut Conditions,
    air: &AirProfile,
) -> Result<()> {
    let ground_m = conditions.altitude_m.value;
    let (method, reason) = if let Some(visibility) = &conditions.visibility_km {
        let xs_sca = Rayleigh::new()?.xs_sca_with_co2(550.0, air.co2_ppm)?;
        let sigma = air.air_number_density[0] * xs_sca;
        aerosol.scale_to_visibility(visibility.value, sigma, ground_m)?;
        let reason = format!("from a visibility of {} km", visibility.value);
        ("Koschmieder's law at 550 nm", reason)
    } else if let Some(factor) = &conditions.tabulated_factor {
        aerosol.set_scale(factor.value)?;
        let reason = format!("{} times the amount in the type's definition", factor.value);
        ("number densities of the aerosol type", reason)
    } else {
        return aerosol.scale_to_aod_550(conditions.aod_550.value, ground_m);
    };
    conditions.aod_550 = Condition::new(aerosol.aod_550_above(ground_m), "", method, reason);
    Ok(())
}

impl Sky {
    /// The sky of some conditions.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for an aerosol or atmosphere that does not exist; out-of-range wavelengths.
    pub fn new(
        conditions: Conditions,
        wavelength: &WavelengthGrid,
        solar: SolarSpectrum,
    ) -> Result<Self> {
        let aerosol = AerosolType::of_conditions(&conditions)?;
        Self::with_aerosol(conditions, &aerosol, wavelength, solar)
    }

    /// [`Sky::new`] with an aerosol of one's own in place of the conditions' type, such as a
    /// [`crate::composition::aerosol::Aerosol`]; its amount, and the layers above the tropopause, are still the
    /// conditions'.
    ///
    /// # Errors
    /// As [`Sky::new`]; what the aerosol's refractive index does not cover.
    pub fn with_aerosol(
        mut conditions: Conditions,
        aerosol: &AerosolType,
        wavelength: &WavelengthGrid,
        solar: SolarSpectrum,
    ) -> Result<Self> {
        if aerosol.name != conditions.aerosol.value {
            conditions.aerosol = Condition::given(aerosol.name.clone(), "");
            conditions.mixture = None;
        }
        let composition = Composition::new(&mut conditions, aerosol, wavelength)?;
        let (air, particles) = (&composition.air, &composition.aerosol);
        let medium = from_atmosphere(air, particles, wavelength, PLANET_RADIUS_M)?;

        let position = conditions.sun()?;
        let distance_squared = position.distance_au() * position.distance_au();
        let irradiance: Vec<f64> = solar
            .irradiance(wavelength)?
            .iter()
            .map(|e| e / distance_squared)
            .collect();
        let towards =
            Vec3::from_azimuth_elevation_deg(position.azimuth_deg(), position.elevation_deg());
        let sun = SunLight::new(
            towards,
            wavelength.nm(),
            &irradiance,
            position.angular_radius_deg(),
        )?;
        let albedo = conditions.spectral_albedo(wavelength.nm())?;
        Ok(Self {
            conditions: Some(conditions),
            composition: Some(composition),
            medium,
            sun,
            sun_distance_au: position.distance_au(),
            albedo,
            cloud: None,
            tables: None,
        })
    }

    /// The sky of a medium of one's own under a sun of one's own.
    ///
    /// # Arguments
    /// * `sun_elevation_deg`, `sun_azimuth_deg` — true direction of the sun's middle
    /// * `albedo` — of the ground \[1\], shape (w,)
    /// * `irradiance` — above the air, on a plane facing the sun \[W m⁻² nm⁻¹\], shape (w,)
    /// * `sun_angular_radius_deg` — 0 is a collimated beam, left out of radiances
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`].
    pub fn from_medium(
        medium: LayeredMedium,
        sun_elevation_deg: f64,
        sun_azimuth_deg: f64,
        albedo: &[f64],
        irradiance: &[f64],
        sun_angular_radius_deg: f64,
    ) -> Result<Self> {
        check_range("sun elevation", sun_elevation_deg, "deg", -90.0..=90.0)?;
        check_range("sun azimuth", sun_azimuth_deg, "deg", -360.0..=360.0)?;
        let towards = Vec3::from_azimuth_elevation_deg(sun_azimuth_deg, sun_elevation_deg);
        let sun = SunLight::new(
            towards,
            medium.wavelength_nm(),
            irradiance,
            sun_angular_radius_deg,
        )?;
        Scene::new(&medium, sun.clone(), albedo)?;
        Ok(Self {
            conditions: None,
            composition: None,
            medium,
            sun,
            sun_distance_au: 1.0,
            albedo: albedo.to_vec(),
            cloud: None,
            tables: None,
        })
    }

    /// Vacuum wavelengths \[nm\].
    pub fn wavelength_nm(&self) -> &[f64] {
        self.medium.wavelength_nm()
    }

    /// Altitude of the ground \[m\].
    pub fn ground_altitude_m(&self) -> f64 {
        self.medium.altitude_m()[0]
    }

    /// Distance of an observer from the planet's centre \[m\]; `None` is on the ground.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] below the ground.
    pub(crate) fn observer_radius_m(&self, altitude_m: Option<f64>) -> Result<f64> {
        let ground_m = self.ground_altitude_m();
        let altitude_m = altitude_m.unwrap_or(ground_m);
        if (ground_m..=1e9).contains(&altitude_m) {
            return Ok(self.medium.ground_radius_m() + (altitude_m - ground_m));
        }
        Err(Error::OutOfRange {
            name: "observer altitude".into(),
            value: altitude_m,
            unit: "m",
            range: format!("[{ground_m}, 1e9]"),
            hint: format!("the ground is at {ground_m} m above sea level here"),
        })
    }

    /// Spectral radiance at every pixel of a sensor.
    ///
    /// `cancel` set to `true` stops the work within milliseconds; `progress(done, total)` is called from any thread.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for an observer below the ground, [`Error::TooLarge`], [`Error::Interrupted`].
    pub fn render(
        &self,
        sensor: &dyn Sensor,
        options: &RenderOptions,
        cancel: &AtomicBool,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Result<Film> {
        let observer = Observer {
            radius_m: self.observer_radius_m(options.altitude_m)?,
            sun_disc: options.sun_disc != SunDisc::Off,
        };
        let mut budget = options.budget;
        if options.sun_disc == SunDisc::Only {
            // No order of scattering at all: what is left is the disc seen through the air.
            budget.max_order = Some(0);
        }
        let control = Control {
            budget,
            cancel,
            progress,
        };
        options.method.check_polarised(options.polarised)?;
        let stokes = options.polarised == Polarised::Stokes;
        let scalar = options.polarised == Polarised::Off;
        let polarised_path = PolarisedPath { stokes };
        if let (Method::Shells, Some(tables), None) = (options.method, &self.tables, &self.cloud) {
            // Tables hold all orders; any other number of them, apart from none and one, is solved anew. So is scalar light where
            // they hold polarised light.
            let all_or_none = budget.max_order.is_none_or(|n| n < 2);
            if all_or_none && !(scalar && tables.polarised()) {
                return if stokes {
                    tables.render_stokes(&self.sun, &observer, sensor, &control)
                } else {
                    tables.render(&self.sun, &observer, sensor, &control)
                };
            }
        }
        let integrator: &dyn Integrator<LayeredMedium> = match options.method {
            Method::Shells if scalar => &Shells {
                accuracy: options.accuracy,
            },
            Method::Shells => &PolarisedShells {
                accuracy: options.accuracy,
                stokes,
            },
            Method::Path if scalar => &Path,
            Method::Path => &polarised_path,
            Method::Tracker => &Tracker,
            Method::Classic => &Classic,
        };
        if let Some(cloud) = &self.cloud {
            let medium = GriddedMedium::new(&self.medium, cloud)?;
            let scene = Scene::new(&medium, self.sun.clone(), &self.albedo)?;
            return match options.method {
                Method::Tracker => Tracker.render(&scene, &observer, sensor, &control),
                Method::Classic => Classic.render(&scene, &observer, sensor, &control),
                Method::Shells | Method::Path => Err(Error::invalid(
                    "a cloud is no concentric shell, and this method takes nothing else",
                    "ask for the method tracker",
                )),
            };
        }
        let scene = Scene::new(&self.medium, self.sun.clone(), &self.albedo)?;
        integrator.render(&scene, &observer, sensor, &control)
    }

    /// As [`Sky::render`], until a goal is met; `reins` hold what an interrupted rendering goes on from, and where it is kept.
    ///
    /// # Errors
    /// Those of [`Sky::render`] and [`render_until`]; [`Error::Invalid`] for a method without noise.
    pub fn render_until(
        &self,
        sensor: &dyn Sensor,
        options: &RenderOptions,
        goal: &Goal,
        cancel: &AtomicBool,
        reins: Reins<'_>,
    ) -> Result<Outcome> {
        if options.method == Method::Shells {
            return Err(Error::invalid(
                "shells has no noise: it takes the time it takes and is done",
                "ask for path, or leave out noise, time limit and checkpoint",
            ));
        }
        let look = |sensor: &dyn Sensor, spp: u32, progress: &(dyn Fn(u64, u64) + Sync)| {
            let mut options = *options;
            options.budget.spp = spp;
            self.render(sensor, &options, cancel, progress)
        };
        render_until(&look, sensor, options.budget.spp, goal, reins)
    }
}
