//! Temperature, pressure and number densities of the reference atmospheres.

use super::grid::{column, VerticalGrid};
use super::us76;
use crate::climate::{AtmosphereClass, OZONE_RANGE_DU};
use crate::error::{check_range, Result};
use crate::math::interp::{interval, linear_clamped};
use crate::math::Table;

/// Molecules in a vertical column of 1 m² per Dobson unit \[m⁻²\]: 2.68678e16 per cm².
pub const DOBSON_UNIT_M2: f64 = 2.68678e20;

/// State of the air at one altitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirState {
    /// Temperature \[K\].
    pub temperature_k: f64,
    /// Pressure \[Pa\].
    pub pressure_pa: f64,
    /// Number density of air \[m⁻³\].
    pub air_number_density: f64,
}

/// The gases of a sky on a vertical grid; every array has the shape (z,) of `altitude_m`, and each density is
/// linear between the nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct AirProfile {
    /// Altitude of the nodes above sea level, the ground first \[m\].
    pub altitude_m: Vec<f64>,
    /// Temperature \[K\].
    pub temperature_k: Vec<f64>,
    /// Pressure \[Pa\].
    pub pressure_pa: Vec<f64>,
    /// Number density of air \[m⁻³\].
    pub air_number_density: Vec<f64>,
    /// Number density of ozone \[m⁻³\].
    pub ozone_number_density: Vec<f64>,
}

impl AirProfile {
    /// Air in a vertical column from the ground to the top \[m⁻²\].
    pub fn air_column_m2(&self) -> f64 {
        column(&self.altitude_m, &self.air_number_density)
    }

    /// Ozone in a vertical column from the ground to the top \[DU\].
    pub fn ozone_column_du(&self) -> f64 {
        column(&self.altitude_m, &self.ozone_number_density) / DOBSON_UNIT_M2
    }
}

/// A tabulated density; logarithm linear in altitude, the end slopes continued.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LogLinear {
    altitude_m: Vec<f64>,
    log: Vec<f64>,
}

impl LogLinear {
    pub(super) fn new(altitude_m: Vec<f64>, value: &[f64]) -> Self {
        let log = value.iter().map(|v| v.ln()).collect();
        Self { altitude_m, log }
    }

    pub(super) fn at(&self, altitude_m: f64) -> f64 {
        let (z, log) = (&self.altitude_m, &self.log);
        let i = interval(z, altitude_m);
        let t = (altitude_m - z[i]) / (z[i + 1] - z[i]);
        (log[i] + t * (log[i + 1] - log[i])).exp()
    }
}

/// A reference atmosphere, as a function of altitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Atmosphere {
    class: AtmosphereClass,
    air: Air,
    /// Ozone number density \[m⁻³\], of which only the shape matters.
    ozone: LogLinear,
}

#[derive(Debug, Clone, PartialEq)]
enum Air {
    Us76(us76::Us76),
    Afgl {
        altitude_m: Vec<f64>,
        temperature_k: Vec<f64>,
        pressure_pa: LogLinear,
        number_density: LogLinear,
    },
}

impl Atmosphere {
    /// Range of altitudes above sea level \[m\].
    pub const ALTITUDE_RANGE_M: std::ops::RangeInclusive<f64> = -500.0..=VerticalGrid::TOP_M;

    /// The atmosphere of a name such as `us76` or `midlatitude-summer`.
    ///
    /// # Errors
    /// [`crate::Error::UnknownName`] with the names there are.
    pub fn named(name: &str) -> Result<Self> {
        Self::new(AtmosphereClass::named(name)?)
    }

    /// The atmosphere of a class.
    ///
    /// US76 is computed from its definition with the ozone of Krueger & Minzner; the AFGL atmospheres are
    /// interpolated, logarithms of pressure and densities linear in altitude.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if an embedded table is damaged.
    ///
    /// # Source
    /// NOAA/NASA/USAF 1976, U.S. Standard Atmosphere, NASA-TM-X-74335; Krueger & Minzner 1976,
    /// doi:10.1029/JC081i024p04477; Anderson et al. 1986, AFGL-TR-86-0110.
    pub fn new(class: AtmosphereClass) -> Result<Self> {
        if class == AtmosphereClass::Us76 {
            return Ok(Self {
                class,
                air: Air::Us76(us76::Us76::new()?),
                ozone: super::ozone::krueger_minzner()?,
            });
        }
        let table = Table::parse(
            "afgl1986",
            include_str!("../../../../data/atmosphere_afgl/afgl1986.csv"),
        )?
        .select("atmosphere", class.name())?;
        let altitude_m = table.numbers("altitude_m")?;
        let log_linear = |name: &str| -> Result<LogLinear> {
            Ok(LogLinear::new(altitude_m.clone(), &table.numbers(name)?))
        };
        Ok(Self {
            class,
            ozone: log_linear("ozone_m3")?,
            air: Air::Afgl {
                temperature_k: table.numbers("temperature_k")?,
                pressure_pa: log_linear("pressure_pa")?,
                number_density: log_linear("air_m3")?,
                altitude_m,
            },
        })
    }

    /// Which atmosphere it is.
    pub fn class(&self) -> AtmosphereClass {
        self.class
    }

    /// Temperature, pressure and number density at an altitude above sea level, −500 to 100 000 m.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`].
    pub fn air_at(&self, altitude_m: f64) -> Result<AirState> {
        check_range("altitude", altitude_m, "m", Self::ALTITUDE_RANGE_M)?;
        Ok(match &self.air {
            Air::Us76(us76) => us76.at(altitude_m),
            Air::Afgl {
                altitude_m: z,
                temperature_k,
                pressure_pa,
                number_density,
            } => AirState {
                temperature_k: linear_clamped(z, temperature_k, altitude_m),
                pressure_pa: pressure_pa.at(altitude_m),
                air_number_density: number_density.at(altitude_m),
            },
        })
    }

    /// The atmosphere on a vertical grid, its ozone scaled to a column.
    ///
    /// `ozone_du` is the column above the lowest node, 0 to 1000 DU; the column of the result, as integrated
    /// over its linear pieces, is this value.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for the column or for nodes outside −500 to 100 000 m.
    pub fn profile(&self, grid: &VerticalGrid, ozone_du: f64) -> Result<AirProfile> {
        check_range("ozone", ozone_du, "DU", OZONE_RANGE_DU)?;
        let altitude_m = grid.altitude_m().to_vec();
        let states = altitude_m
            .iter()
            .map(|&z| self.air_at(z))
            .collect::<Result<Vec<_>>>()?;
        let mut ozone: Vec<f64> = altitude_m.iter().map(|&z| self.ozone.at(z)).collect();
        let scale = ozone_du * DOBSON_UNIT_M2 / column(&altitude_m, &ozone);
        ozone.iter_mut().for_each(|n| *n *= scale);
        Ok(AirProfile {
            temperature_k: states.iter().map(|s| s.temperature_k).collect(),
            pressure_pa: states.iter().map(|s| s.pressure_pa).collect(),
            air_number_density: states.iter().map(|s| s.air_number_density).collect(),
            ozone_number_density: ozone,
            altitude_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn columns_are_kept_on_the_grid() {
        for class in AtmosphereClass::ALL {
            let atmosphere = Atmosphere::new(class).unwrap();
            for ground in [-430.0, 0.0, 1234.5, 8848.0] {
                let grid = VerticalGrid::standard(ground).unwrap();
                let profile = atmosphere.profile(&grid, 300.0).unwrap();
                let du = profile.ozone_column_du();
                assert!((du / 300.0 - 1.0).abs() < 1e-12, "{class:?} {du}");
                // The exact column by trapezia of 2 m or so.
                let n = 50_000;
                let step = (VerticalGrid::TOP_M - ground) / f64::from(n);
                let fine: Vec<f64> = (0..=n).map(|i| ground + f64::from(i) * step).collect();
                let fine =
                    VerticalGrid::new(fine.iter().map(|z| z.min(VerticalGrid::TOP_M)).collect());
                let exact = atmosphere.profile(&fine.unwrap(), 300.0).unwrap();
                let error = profile.air_column_m2() / exact.air_column_m2() - 1.0;
                assert!(error.abs() < 2e-4, "{class:?} from {ground} m: {error:e}");
            }
        }
    }

    /// What "densities linear between nodes" costs: 0.1 % at most below 20 km, 0.6 % above.
    #[test]
    fn densities_between_nodes_are_close() {
        let us76 = Atmosphere::named("us76").unwrap();
        let grid = VerticalGrid::standard(0.0).unwrap();
        let profile = us76.profile(&grid, 300.0).unwrap();
        for p in grid.altitude_m().windows(2) {
            let middle = 0.5 * (p[0] + p[1]);
            let linear = linear_clamped(&profile.altitude_m, &profile.air_number_density, middle);
            let error = linear / us76.air_at(middle).unwrap().air_number_density - 1.0;
            let allowed = if middle < 20_000.0 { 1e-3 } else { 6e-3 };
            assert!(error.abs() < allowed, "{middle} m: {error:e}");
        }
    }

    /// Vertical Rayleigh optical depth of US76 at 550 nm: 0.0972 (Bucholtz 1995, table 4: 0.09721), within 0.5 %.
    #[test]
    fn rayleigh_optical_depth_is_the_published_one() {
        let us76 = Atmosphere::named("us76").unwrap();
        let grid = VerticalGrid::standard(0.0).unwrap();
        let air = us76.profile(&grid, 300.0).unwrap().air_column_m2();
        // Bucholtz's own cross section at 550 nm, 4.509e-27 cm²; optics lies to the right of this stage.
        let tau = air * 4.509e-31;
        assert!((tau / 0.0972 - 1.0).abs() < 5e-3, "{tau}");
    }

    /// AFGL's own columns of ozone, integrated log-linearly, are within 0.5 % of those of linear pieces on our
    /// grid: 282.0, 334.4, 378.2, 347.7 and 375.5 DU.
    #[test]
    fn afgl_ozone_columns_are_the_published_ones() {
        let grid = VerticalGrid::standard(0.0).unwrap();
        for (name, du) in [
            ("tropical", 282.0),
            ("midlatitude-summer", 334.4),
            ("midlatitude-winter", 378.2),
            ("subarctic-summer", 347.7),
            ("subarctic-winter", 375.5),
        ] {
            let atmosphere = Atmosphere::named(name).unwrap();
            let z = grid.altitude_m();
            let ozone: Vec<f64> = z.iter().map(|&z| atmosphere.ozone.at(z)).collect();
            let got = column(z, &ozone) / DOBSON_UNIT_M2;
            assert!((got / du - 1.0).abs() < 5e-3, "{name}: {got}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let us76 = Atmosphere::named("us76").unwrap();
        let grid = VerticalGrid::standard(0.0).unwrap();
        assert!(us76.profile(&grid, -1.0).is_err());
        assert!(us76.profile(&grid, f64::NAN).is_err());
        assert!(us76.air_at(100_001.0).is_err());
        assert!(us76.air_at(f64::NAN).is_err());
        let e = Atmosphere::named("tropic").unwrap_err();
        assert!(matches!(e, Error::UnknownName { .. }));
        let none = us76.profile(&grid, 0.0).unwrap();
        assert_eq!(none.ozone_column_du(), 0.0);
    }
}
