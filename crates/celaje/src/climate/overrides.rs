//! What the user wants instead of what the climate says.

use super::{
    Albedo, AtmosphereBlend, AtmosphereClass, Condition, OzoneClimate, CLIMATE, OZONE_RANGE_DU,
};
use crate::error::{check_range, Error, Result};
use crate::place::{Site, SunPosition};

/// Values given by the user; `None` means: find it yourself.
///
/// ```
/// # use celaje::climate::{Conditions, Overrides};
/// let hazy = Overrides { aod_550: Some(0.4), ..Overrides::default() };
/// let conditions = Conditions::from_sun(5.0, 180.0, &hazy)?;
/// assert_eq!(conditions.aod_550.reason, "given by the user");
/// # Ok::<(), celaje::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Overrides {
    /// Altitude of the ground above sea level \[m\], −500 to 9000.
    pub altitude_m: Option<f64>,
    /// True elevation of the sun \[deg\], −90 to 90.
    pub sun_elevation_deg: Option<f64>,
    /// Azimuth of the sun clockwise from north \[deg\], −360 to 360.
    pub sun_azimuth_deg: Option<f64>,
    /// Distance of the sun \[au\], 0.9 to 1.1.
    pub sun_distance_au: Option<f64>,
    /// Name of a reference atmosphere, see [`AtmosphereClass`], or [`CLIMATE`].
    pub atmosphere: Option<String>,
    /// Ozone column \[DU\], 0 to 1000.
    pub ozone_du: Option<f64>,
    /// Climatology that the ozone column is taken from.
    pub ozone_climate: Option<OzoneClimate>,
    /// Leave ozone out.
    pub no_ozone: bool,
    /// Nitrogen dioxide column \[DU\], 0 to 20.
    pub no2_du: Option<f64>,
    /// Precipitable water \[mm\], 0 to 200.
    pub water_mm: Option<f64>,
    /// Carbon dioxide \[ppm\], 0 to 10 000.
    pub co2_ppm: Option<f64>,
    /// Aerosol type by name, or [`CLIMATE`]; whether there is such a type is checked where it is composed.
    pub aerosol: Option<String>,
    /// Vertical aerosol optical depth at 550 nm \[1\], 0 to 10.
    pub aod_550: Option<f64>,
    /// Factor on the aerosol optical depth, given or not \[1\], 0 to 100; their product is 10 at most.
    pub turbidity: Option<f64>,
    /// Visibility at the ground \[km\], 0.1 to 400, instead of an optical depth.
    pub visibility_km: Option<f64>,
    /// Aerosol in the amount of its type's definition (times turbidity), instead of an optical depth.
    pub aerosol_as_tabulated: bool,
    /// Aerosol of the stratosphere by name; which there are is known where it is composed.
    pub stratosphere: Option<String>,
    /// Aerosol of the mesosphere by name; which there are is known where it is composed.
    pub mesosphere: Option<String>,
    /// Relative humidity of the aerosol \[%\], 0 to 99.
    pub humidity_percent: Option<f64>,
    /// Albedo of the ground.
    pub albedo: Option<Albedo>,
}

/// Scale height of water vapour \[m\], and rms deviation of what it gives from monthly measurements at sea level \[mm\].
const WATER_SCALE_M: f64 = 2100.0;
const WATER_RMS_MM: f64 = 8.0;

impl Overrides {
    /// Checks every value given.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a number outside its range or NaN; [`Error::UnknownName`] for an atmosphere
    /// that does not exist; [`Error::Invalid`] for an ozone column together with `no_ozone`.
    pub fn check(&self) -> Result<()> {
        let check = |name, value: Option<f64>, unit, range| {
            value.map_or(Ok(()), |v| check_range(name, v, unit, range))
        };
        check("altitude", self.altitude_m, "m", Site::ALTITUDE_RANGE_M)?;
        check("sun elevation", self.sun_elevation_deg, "deg", -90.0..=90.0)?;
        check("sun azimuth", self.sun_azimuth_deg, "deg", -360.0..=360.0)?;
        let distances_au = SunPosition::DISTANCE_RANGE_AU;
        check("sun distance", self.sun_distance_au, "au", distances_au)?;
        check("ozone", self.ozone_du, "DU", OZONE_RANGE_DU)?;
        check("no2", self.no2_du, "DU", 0.0..=20.0)?;
        check("water", self.water_mm, "mm", 0.0..=200.0)?;
        check("co2", self.co2_ppm, "ppm", 0.0..=10_000.0)?;
        check("aod", self.aod_550, "", 0.0..=10.0)?;
        check("turbidity", self.turbidity, "", 0.0..=100.0)?;
        check("visibility", self.visibility_km, "km", 0.1..=400.0)?;
        let amounts = [
            self.aod_550.is_some() || (self.turbidity.is_some() && !self.aerosol_as_tabulated),
            self.visibility_km.is_some(),
            self.aerosol_as_tabulated,
        ];
        if amounts.iter().filter(|given| **given).count() > 1 {
            return Err(Error::invalid(
                "the amount of aerosol is given twice",
                "give an optical depth, or a visibility, or take it as tabulated",
            ));
        }
        if let Some(aod) = self.aod_550 {
            let optical_depth = aod * self.turbidity.unwrap_or(1.0);
            check("aod times turbidity", Some(optical_depth), "", 0.0..=10.0)?;
        }
        check("humidity", self.humidity_percent, "%", 0.0..=99.0)?;
        if let Some(Albedo::Value(albedo)) = self.albedo {
            Albedo::new(albedo)?;
        }
        if let Some(atmosphere) = self.atmosphere() {
            AtmosphereClass::named(&atmosphere.value)?;
        }
        if self.no_ozone && self.ozone_du.is_some_and(|du| du > 0.0) {
            return Err(Error::invalid(
                "an ozone column is given, and no ozone is asked for",
                "give one of the two",
            ));
        }
        Ok(())
    }

    pub(super) fn sun_azimuth(&self) -> Option<f64> {
        self.sun_azimuth_deg.map(|a| a.rem_euclid(360.0))
    }

    /// The ozone column if the user decides it.
    pub(super) fn ozone(&self) -> Option<Condition<f64>> {
        if self.no_ozone {
            return Some(Condition::new(
                0.0,
                "DU",
                "user",
                "ozone left out by the user",
            ));
        }
        self.ozone_du.map(|du| Condition::given(du, "DU"))
    }

    pub(super) fn no2(&self) -> Condition<f64> {
        Condition::or_found(self.no2_du, "DU", || {
            let reason = "left out unless given: 0.1 to 0.2 over clean land, 0.5 to 2 over cities";
            Condition::new(0.0, "DU", "default", reason)
        })
    }

    /// Precipitable water above a ground: of the atmosphere that the user names, else of a blend.
    pub(super) fn water(&self, blend: &AtmosphereBlend, ground_m: f64) -> Condition<f64> {
        Condition::or_found(self.water_mm, "mm", || {
            let named = self.atmosphere();
            let named = named.and_then(|a| AtmosphereClass::named(&a.value).ok());
            let sea_level_mm = match named {
                Some(class) => class.water_mm(),
                None => blend.iter().map(|(class, w)| w * class.water_mm()).sum(),
            };
            let thinned = (-ground_m / WATER_SCALE_M).exp();
            let water = Condition::new(
                sea_level_mm * thinned,
                "mm",
                "AFGL 1986, Anderson et al., AFGL-TR-86-0110",
                "of the reference atmosphere, half of it for every 1.5 km of the ground above sea level",
            );
            water.with_uncertainty(WATER_RMS_MM * thinned)
        })
    }

    pub(super) fn co2(&self) -> Condition<f64> {
        Condition::or_found(self.co2_ppm, "ppm", || {
            let reason = "global mean of 2023, the same for every year: 100 ppm change the blue of the sky by 0.01 %";
            Condition::new(419.0, "ppm", "NOAA Global Monitoring Laboratory", reason)
        })
    }

    pub(super) fn stratosphere(&self) -> Condition<String> {
        Condition::or_found(self.stratosphere.clone(), "", || {
            let reason = "no great eruption is assumed";
            Condition::new("background".to_owned(), "", "default", reason)
        })
    }

    pub(super) fn mesosphere(&self) -> Condition<String> {
        Condition::or_found(self.mesosphere.clone(), "", || {
            let reason = "too thin to be seen; no noctilucent clouds are assumed";
            Condition::new("none".to_owned(), "", "default", reason)
        })
    }

    /// Factor on the tabulated amount of aerosol, if that is what is wanted.
    pub(super) fn tabulated_factor(&self) -> Option<Condition<f64>> {
        let factor = self
            .aerosol_as_tabulated
            .then(|| self.turbidity.unwrap_or(1.0));
        factor.map(|factor| Condition::given(factor, ""))
    }

    /// The aerosol that the user names, unless that is the climate's own.
    pub(super) fn aerosol(&self) -> Option<Condition<String>> {
        let named = self.aerosol.clone().filter(|name| !is_climate(name));
        named.map(|name| Condition::given(name, ""))
    }

    /// The atmosphere that the user names, unless that is the climate's own.
    pub(super) fn atmosphere(&self) -> Option<Condition<String>> {
        let named = self.atmosphere.clone().filter(|name| !is_climate(name));
        named.map(|name| Condition::given(name, ""))
    }

    /// The optical depth, `found` unless given, times the turbidity.
    pub(super) fn aod_550(&self, found: impl FnOnce() -> Condition<f64>) -> Result<Condition<f64>> {
        let mut aod = Condition::or_found(self.aod_550, "", found);
        if let Some(turbidity) = self.turbidity {
            aod.reason = format!("{}; {} times turbidity {turbidity}", aod.reason, aod.value);
            aod.value *= turbidity;
            aod.uncertainty = aod.uncertainty.map(|u| u * turbidity);
        }
        check_range("aod times turbidity", aod.value, "", 0.0..=10.0)?;
        Ok(aod)
    }

    pub(super) fn albedo(&self) -> Option<Condition<f64>> {
        let albedo = self.albedo.as_ref()?;
        Some(match albedo {
            Albedo::Value(value) => Condition::given(*value, ""),
            Albedo::Preset(preset) => Condition::new(
                preset.value(),
                "",
                "Budikova 2013, Albedo, The Encyclopedia of Earth",
                if preset.low == preset.high {
                    format!("{}, given by the user", preset.name)
                } else {
                    let (name, low, high) = (preset.name, preset.low, preset.high);
                    format!("{name}, given by the user: the middle of {low} to {high}")
                },
            )
            .with_uncertainty(0.5 * (preset.high - preset.low)),
        })
    }
}

/// Whether a name asks for what the climate finds.
fn is_climate(name: &str) -> bool {
    name.trim().eq_ignore_ascii_case(CLIMATE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_by_name() {
        let base = Overrides::default;
        let nan = f64::NAN;
        let cases = [
            (
                "aod",
                Overrides {
                    aod_550: Some(-1.0),
                    ..base()
                },
            ),
            (
                "aod",
                Overrides {
                    aod_550: Some(nan),
                    ..base()
                },
            ),
            (
                "albedo",
                Overrides {
                    albedo: Some(Albedo::Value(1.2)),
                    ..base()
                },
            ),
            (
                "albedo",
                Overrides {
                    albedo: Some(Albedo::Value(nan)),
                    ..base()
                },
            ),
            (
                "ozone",
                Overrides {
                    ozone_du: Some(-3.0),
                    ..base()
                },
            ),
            (
                "humidity",
                Overrides {
                    humidity_percent: Some(101.0),
                    ..base()
                },
            ),
            (
                "turbidity",
                Overrides {
                    turbidity: Some(nan),
                    ..base()
                },
            ),
            (
                "altitude",
                Overrides {
                    altitude_m: Some(1e5),
                    ..base()
                },
            ),
            (
                "no2",
                Overrides {
                    no2_du: Some(-0.1),
                    ..base()
                },
            ),
            (
                "water",
                Overrides {
                    water_mm: Some(nan),
                    ..base()
                },
            ),
            (
                "co2",
                Overrides {
                    co2_ppm: Some(-1.0),
                    ..base()
                },
            ),
            (
                "visibility",
                Overrides {
                    visibility_km: Some(0.0),
                    ..base()
                },
            ),
            (
                "sun elevation",
                Overrides {
                    sun_elevation_deg: Some(91.0),
                    ..base()
                },
            ),
            (
                "sun azimuth",
                Overrides {
                    sun_azimuth_deg: Some(nan),
                    ..base()
                },
            ),
            (
                "sun distance",
                Overrides {
                    sun_distance_au: Some(2.0),
                    ..base()
                },
            ),
        ];
        for (name, overrides) in cases {
            let e = overrides.check().unwrap_err();
            assert!(e.to_string().starts_with(&format!("{name} = ")), "{e}");
            assert!(!e.hint().is_empty());
        }
        let unknown = Overrides {
            atmosphere: Some("us77".into()),
            ..base()
        };
        assert!(matches!(unknown.check(), Err(Error::UnknownName { .. })));
        let amounts = Overrides {
            visibility_km: Some(20.0),
            aod_550: Some(0.1),
            ..base()
        };
        assert!(amounts.check().is_err());
        let both = Overrides {
            no_ozone: true,
            ozone_du: Some(300.0),
            ..base()
        };
        assert!(both.check().is_err());
        base().check().unwrap();
    }
}
