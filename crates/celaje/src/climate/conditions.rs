//! Everything that a sky needs to know about its place and time, each value with its reason.

use super::words::{
    aerosol_words, albedo_words, altitude, aod_words, atmosphere_words, coordinate, ozone, spa,
    GADS_SOURCE, OPAC_SOURCE,
};
use super::{
    aerosol_climate, blended_atmosphere, ozone_shape, AerosolMixture, AtmosphereBlend,
    AtmosphereClass, Condition, Ground, Overrides, OzoneShape,
};
use crate::error::{Error, Result};
use crate::place::{Instant, MoonPosition, Site, SunPosition, SunTimes};

/// Name of an aerosol or an atmosphere that is found for its place instead of being one of the named ones.
pub const CLIMATE: &str = "climate";

/// All conditions of a sky.
///
/// Made by [`Conditions::at`] or [`Conditions::from_sun`]; every field may be replaced afterwards, which takes
/// the checks of [`Overrides`] off.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditions {
    /// Latitude, north positive \[deg\]; none when only the sun was given.
    pub latitude_deg: Option<Condition<f64>>,
    /// Longitude, east positive \[deg\]; none when only the sun was given.
    pub longitude_deg: Option<Condition<f64>>,
    /// Instant in UTC; none when only the sun was given.
    pub time: Option<Condition<Instant>>,
    /// Altitude of the ground above sea level \[m\].
    pub altitude_m: Condition<f64>,
    /// True elevation of the sun's centre \[deg\].
    pub sun_elevation_deg: Condition<f64>,
    /// Azimuth of the sun clockwise from north \[deg\].
    pub sun_azimuth_deg: Condition<f64>,
    /// Distance of the sun \[au\].
    pub sun_distance_au: Condition<f64>,
    /// The Moon, which does not shine as yet; none when only the sun was given.
    pub moon: Option<MoonPosition>,
    /// Reference atmosphere, an [`AtmosphereClass`] by name, or [`CLIMATE`]: the blend below.
    pub atmosphere: Condition<String>,
    /// Reference atmospheres and their weights, in force while `atmosphere` is [`CLIMATE`].
    pub atmosphere_blend: Option<AtmosphereBlend>,
    /// Ozone column above the ground \[DU\]; 0 without ozone.
    pub ozone_du: Condition<f64>,
    /// Nitrogen dioxide column above the ground \[DU\].
    pub no2_du: Condition<f64>,
    /// Precipitable water above the ground \[mm\].
    pub water_mm: Condition<f64>,
    /// Carbon dioxide \[ppm\].
    pub co2_ppm: Condition<f64>,
    /// Shape of the ozone layer, in force while `atmosphere` is [`CLIMATE`].
    pub ozone_shape: Option<OzoneShape>,
    /// Aerosol type by name: bare names are AIAA types, `opac:…` OPAC's, [`CLIMATE`] the mixture below.
    pub aerosol: Condition<String>,
    /// Components and layers, in force while `aerosol` is [`CLIMATE`].
    pub mixture: Option<AerosolMixture>,
    /// Optical depth of the tropospheric aerosol at 550 nm, vertical, from the ground up \[1\].
    pub aod_550: Condition<f64>,
    /// Visibility at the ground \[km\], which sets the optical depth if it is given.
    pub visibility_km: Option<Condition<f64>>,
    /// Factor on the amount of the type's own definition, which sets the optical depth if it is given \[1\].
    pub tabulated_factor: Option<Condition<f64>>,
    /// Aerosol of the stratosphere by name.
    pub stratosphere: Condition<String>,
    /// Aerosol of the mesosphere by name.
    pub mesosphere: Condition<String>,
    /// Relative humidity of the aerosol \[%\].
    pub humidity_percent: Condition<f64>,
    /// Albedo of the ground, Lambertian, broadband \[1\].
    pub albedo: Condition<f64>,
    /// What the ground is made of, which gives the albedo its spectrum as long as `albedo` is its broadband value.
    pub ground: Option<Ground>,
}

/// The sun's azimuth where only its elevation is given.
pub fn due_south() -> Condition<f64> {
    Condition::new(180.0, "deg", "default", "no place given: due south")
}

impl Conditions {
    /// Conditions at a place and an instant, found unless overridden.
    ///
    /// `overrides.altitude_m` replaces the altitude of `site`; a site at exactly 0 m counts as one of unknown altitude and
    /// takes it from the map of elevations. The sun's angles follow place and time unless they are overridden too.
    ///
    /// # Errors
    /// As [`Overrides::check`].
    pub fn at(site: &Site, instant: &Instant, overrides: &Overrides) -> Result<Self> {
        overrides.check()?;
        let (latitude_deg, longitude_deg) = (site.latitude_deg(), site.longitude_deg());
        let altitude_m = altitude(overrides.altitude_m, site)?;
        let site = site.at_altitude(altitude_m.value)?;
        let sun = SunPosition::at(&site, instant)?;
        let found = aerosol_climate(latitude_deg, longitude_deg, altitude_m.value, instant)?;
        let aerosol = overrides
            .aerosol()
            .unwrap_or_else(|| aerosol_words(&found.mixture));
        let atmosphere = overrides.atmosphere();
        let blend = blended_atmosphere(latitude_deg, instant);
        let albedo = overrides.albedo();
        let ground = match albedo {
            Some(_) => None,
            None => Some(Ground::at(latitude_deg, longitude_deg, instant)?),
        };
        let water = overrides.water(&blend, altitude_m.value);
        Ok(Self {
            latitude_deg: Some(coordinate(latitude_deg, &site)),
            longitude_deg: Some(coordinate(longitude_deg, &site)),
            time: Some(Condition::given(*instant, "")),
            altitude_m,
            sun_elevation_deg: Condition::or_found(overrides.sun_elevation_deg, "deg", || {
                spa(sun.elevation_deg(), "deg").with_uncertainty(SUN_DEG)
            }),
            sun_azimuth_deg: Condition::or_found(overrides.sun_azimuth(), "deg", || {
                spa(sun.azimuth_deg(), "deg").with_uncertainty(SUN_DEG)
            }),
            sun_distance_au: Condition::or_found(overrides.sun_distance_au, "au", || {
                spa(sun.distance_au(), "au")
            }),
            moon: Some(MoonPosition::at(&site, instant)?),
            atmosphere_blend: atmosphere.is_none().then(|| blend.clone()),
            ozone_shape: match atmosphere {
                Some(_) => None,
                None => Some(ozone_shape(latitude_deg, instant)?),
            },
            atmosphere: atmosphere.unwrap_or_else(|| atmosphere_words(&blend, latitude_deg)),
            ozone_du: match overrides.ozone() {
                Some(given) => given,
                None => ozone(overrides, latitude_deg, longitude_deg, instant)?,
            },
            no2_du: overrides.no2(),
            water_mm: water,
            co2_ppm: overrides.co2(),
            visibility_km: overrides.visibility_km.map(|v| Condition::given(v, "km")),
            tabulated_factor: overrides.tabulated_factor(),
            stratosphere: overrides.stratosphere(),
            mesosphere: overrides.mesosphere(),
            aod_550: overrides.aod_550(|| aod_words(&found))?,
            humidity_percent: Condition::or_found(overrides.humidity_percent, "%", || {
                let reason = "usual here at this time of year";
                Condition::new(found.mixture.humidity_percent, "%", GADS_SOURCE, reason)
                    .with_uncertainty(15.0)
            }),
            mixture: (aerosol.value == CLIMATE).then_some(found.mixture),
            aerosol,
            albedo: albedo.unwrap_or_else(|| albedo_words(ground.as_ref())),
            ground,
        })
    }

    /// Conditions under a sun put anywhere by hand, without place and time.
    ///
    /// What a place would tell is taken from 45° N in June, in the mean: US standard atmosphere, 340 DU of ozone, the
    /// ground at sea level, OPAC's continental average at an optical depth of 0.12, the sun at 1 au.
    ///
    /// # Arguments
    /// * `elevation_deg` — true elevation of the sun, −90 to 90
    /// * `azimuth_deg` — clockwise from north, −360 to 360; kept in [0, 360)
    /// * `overrides` — what is to be taken instead; its sun angles are not looked at
    ///
    /// # Errors
    /// As [`Overrides::check`] and [`SunPosition::new`]; [`Error::Invalid`] for [`CLIMATE`], which needs a place.
    pub fn from_sun(elevation_deg: f64, azimuth_deg: f64, overrides: &Overrides) -> Result<Self> {
        overrides.check()?;
        for (what, name) in [
            ("aerosol", &overrides.aerosol),
            ("atmosphere", &overrides.atmosphere),
        ] {
            if name
                .as_deref()
                .is_some_and(|n| n.trim().eq_ignore_ascii_case(CLIMATE))
            {
                let message = format!("{what} '{CLIMATE}' needs a place and a time");
                return Err(Error::invalid(message, "give them, or name another one"));
            }
        }
        let distance_au = overrides.sun_distance_au.unwrap_or(1.0);
        let sun = SunPosition::new(azimuth_deg, elevation_deg, distance_au)?;
        let us76 = vec![(AtmosphereClass::Us76, 1.0)];
        let water = overrides.water(&us76, overrides.altitude_m.unwrap_or(0.0));
        let no_place = |value, unit, source: &str, reason: &str| {
            Condition::new(value, unit, source, format!("no place given: {reason}"))
        };
        let named = |value: &str, source: &str, reason: &str| {
            Condition::new(
                value.to_owned(),
                "",
                source,
                format!("no place given: {reason}"),
            )
        };
        Ok(Self {
            latitude_deg: None,
            longitude_deg: None,
            time: None,
            altitude_m: Condition::or_found(overrides.altitude_m, "m", || {
                no_place(0.0, "m", "default", "sea level")
            }),
            sun_elevation_deg: Condition::given(sun.elevation_deg(), "deg"),
            sun_azimuth_deg: Condition::given(sun.azimuth_deg(), "deg"),
            sun_distance_au: Condition::or_found(overrides.sun_distance_au, "au", || {
                Condition::new(1.0, "au", "definition", "no date given: the mean distance")
            }),
            moon: None,
            atmosphere: overrides.atmosphere().unwrap_or_else(|| {
                let us76 = AtmosphereClass::Us76.name();
                named(
                    us76,
                    "U.S. Standard Atmosphere 1976",
                    "the mid-latitude mean",
                )
            }),
            atmosphere_blend: None,
            ozone_du: overrides.ozone().unwrap_or_else(|| {
                let source = "NOAA SBUV/2 v8 zonal monthly means 1998-2015";
                no_place(PLACELESS_OZONE_DU, "DU", source, "usual for 45° N in June")
            }),
            ozone_shape: None,
            aerosol: overrides.aerosol().unwrap_or_else(|| {
                named(
                    "opac:continental-average",
                    OPAC_SOURCE,
                    "a common aerosol of land",
                )
            }),
            no2_du: overrides.no2(),
            water_mm: water,
            co2_ppm: overrides.co2(),
            visibility_km: overrides.visibility_km.map(|v| Condition::given(v, "km")),
            tabulated_factor: overrides.tabulated_factor(),
            stratosphere: overrides.stratosphere(),
            mesosphere: overrides.mesosphere(),
            mixture: None,
            aod_550: overrides.aod_550(|| {
                no_place(
                    PLACELESS_AOD_550,
                    "",
                    "default",
                    "near the mean over the globe",
                )
            })?,
            humidity_percent: Condition::or_found(overrides.humidity_percent, "%", || {
                no_place(80.0, "%", OPAC_SOURCE, "OPAC's own reference humidity")
            }),
            albedo: overrides
                .albedo()
                .unwrap_or_else(|| no_place(0.2, "", "default", "grass and crops (0.16 to 0.26)")),
            ground: None,
        })
    }

    /// Albedo of the ground \[1\] at vacuum wavelengths \[nm\]: the spectrum of [`Self::ground`] while `albedo` is its
    /// broadband value, `albedo` at all wavelengths otherwise.
    ///
    /// # Errors
    /// [`Error::Invalid`] if an embedded table is damaged.
    pub fn spectral_albedo(&self, wavelength_nm: &[f64]) -> Result<Vec<f64>> {
        match &self.ground {
            Some(ground) if ground.broadband() == self.albedo.value => {
                ground.spectral(wavelength_nm)
            }
            _ => Ok(vec![self.albedo.value; wavelength_nm.len()]),
        }
    }

    /// The sun's position in force.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] if a field was replaced by a value out of range.
    pub fn sun(&self) -> Result<SunPosition> {
        SunPosition::new(
            self.sun_azimuth_deg.value,
            self.sun_elevation_deg.value,
            self.sun_distance_au.value,
        )
    }

    /// The sun's events of the day around the instant, in UTC; none when only the sun was given.
    ///
    /// # Errors
    /// As [`SunTimes::around`].
    pub fn sun_times(&self) -> Result<Option<SunTimes>> {
        let (Some(lat), Some(lon), Some(time)) =
            (&self.latitude_deg, &self.longitude_deg, &self.time)
        else {
            return Ok(None);
        };
        let site = Site::new(lat.value, lon.value, 0.0)?;
        Ok(Some(SunTimes::around(&site, &time.value)?))
    }
}

/// Ozone column where no place is given \[DU\]: the SBUV table at 45° N in mid-June, rounded to 10 DU.
const PLACELESS_OZONE_DU: f64 = 340.0;

/// Spread of UT1 about UTC, 0.4 s or so, as an angle of the sky \[deg\]: more than SPA's own error.
const SUN_DEG: f64 = 0.002;

/// Optical depth where no place is given \[1\]: near the mean over the globe, and the default of the AIAA types.
const PLACELESS_AOD_550: f64 = 0.12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::climate::{Albedo, OzoneClimate};

    fn zaragoza(overrides: &Overrides) -> Conditions {
        let site = Site::new(41.65, -0.88, 0.0).unwrap();
        let time = "2026-06-21T18:30Z".parse().unwrap();
        Conditions::at(&site, &time, overrides).unwrap()
    }

    #[test]
    fn a_place_and_a_time_tell_everything() {
        let c = zaragoza(&Overrides::default());
        // pvlib 0.16.1, nrel_numpy.
        assert!((c.sun_elevation_deg.value - 11.001644).abs() < 1e-3);
        assert!((c.sun_azimuth_deg.value - 291.674025).abs() < 1e-3);
        assert!((c.sun_distance_au.value - 1.016_219_09).abs() < 1e-5);
        assert_eq!(c.atmosphere.value, "climate");
        assert!(c.atmosphere.reason.contains("midlatitude-summer"));
        assert!((c.ozone_du.value - 327.0).abs() < 10.0, "{:?}", c.ozone_du);
        assert_eq!(c.aerosol.value, "climate");
        assert!(c.aerosol.reason.contains("nearest AIAA type"));
        assert!((0.08..0.35).contains(&c.aod_550.value), "{:?}", c.aod_550);
        // The map's half-degree mean; the city itself stands at 208 m.
        let altitude = &c.altitude_m;
        assert!((altitude.value - 208.0).abs() < 2.0 * altitude.uncertainty.unwrap());
        assert!((0.1..0.25).contains(&c.albedo.value));
        let spectrum = c.spectral_albedo(&[450.0, 850.0]).unwrap();
        assert!(spectrum[1] > 2.0 * spectrum[0], "{spectrum:?}");
    }

    #[test]
    fn what_the_user_gives_wins() {
        let overrides = Overrides {
            altitude_m: Some(250.0),
            sun_elevation_deg: Some(5.0),
            sun_azimuth_deg: Some(-90.0),
            atmosphere: Some("us76".into()),
            ozone_du: Some(300.0),
            aerosol: Some("desert".into()),
            aod_550: Some(0.5),
            turbidity: Some(2.0),
            humidity_percent: Some(50.0),
            albedo: Some("sand".parse().unwrap()),
            ..Overrides::default()
        };
        let c = zaragoza(&overrides);
        assert_eq!(c.altitude_m.value, 250.0);
        assert_eq!(
            (c.sun_elevation_deg.value, c.sun_azimuth_deg.value),
            (5.0, 270.0)
        );
        assert_eq!(c.ozone_du, Condition::given(300.0, "DU"));
        assert_eq!(c.aerosol.reason, "given by the user");
        assert_eq!(c.aod_550.value, 1.0);
        assert!(c.aod_550.reason.contains("0.5 times turbidity 2"));
        assert!((c.albedo.value - 0.3).abs() < 1e-15);
        assert!(c.albedo.reason.contains("sand"));
        assert_eq!(c.sun().unwrap().azimuth_deg(), 270.0);
        let none = Overrides {
            no_ozone: true,
            ..Overrides::default()
        };
        assert_eq!(zaragoza(&none).ozone_du.value, 0.0);
        let formula = Overrides {
            ozone_climate: Some(OzoneClimate::VanHeuklon),
            ..Overrides::default()
        };
        assert!(zaragoza(&formula).ozone_du.source.contains("Van Heuklon"));
        let bad = Overrides {
            albedo: Some(Albedo::Value(1.2)),
            ..Overrides::default()
        };
        assert!(Conditions::from_sun(10.0, 180.0, &bad).is_err());
    }

    #[test]
    fn a_sun_without_a_place() {
        let c = Conditions::from_sun(-3.0, 180.0, &Overrides::default()).unwrap();
        assert!(c.latitude_deg.is_none() && c.time.is_none());
        assert_eq!(c.atmosphere.value, "us76");
        let june = "2021-06-16T00:00Z".parse().unwrap();
        let usual = OzoneClimate::Sbuv.column(45.0, 0.0, &june).unwrap().du;
        assert!((usual - c.ozone_du.value).abs() < 5.0);
        assert!(Conditions::from_sun(91.0, 0.0, &Overrides::default()).is_err());
        assert!(Conditions::from_sun(f64::NAN, 0.0, &Overrides::default()).is_err());
    }
}
