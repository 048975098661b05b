//! Temperature, pressure and number densities of the reference atmospheres.

use super::grid::{column, keep_columns, VerticalGrid};
use super::us76;
use crate::climate::{AtmosphereClass, OZONE_RANGE_DU};
use crate::error::{check_range, Result};
use crate::math::interp::{interval, linear_clamped};
use crate::math::Table;

/// Molecules in a vertical column of 1 m² per Dobson unit \[m⁻²\]: 2.68678e16 per cm².
pub const DOBSON_UNIT_M2: f64 = 2.68678e20;

/// Molecules of water per m² that make 1 mm of precipitable water: 1 kg over the mass of a molecule \[m⁻²\].
pub const WATER_PER_MM_M2: f64 = 6.022_140_76e23 / 0.018_015_28;

/// Scale height of the nitrogen dioxide of cities and roads \[m\]: that of a shallow mixing layer.
const CITY_NO2_SCALE_M: f64 = 1000.0;

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
    /// Number density of nitrogen dioxide \[m⁻³\].
    pub no2_number_density: Vec<f64>,
    /// Number density of water vapour \[m⁻³\].
    pub water_number_density: Vec<f64>,
    /// Carbon dioxide in dry air \[ppm\], which changes the refractive index.
    pub co2_ppm: f64,
}

/// Amounts of the gases that vary from day to day, in vertical columns above the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GasColumns {
    /// Ozone \[DU\], 0 to 1000.
    pub ozone_du: f64,
    /// Nitrogen dioxide \[DU\], 0 to 20: 0.1 to 0.2 over clean land, 0.5 to 2 over cities.
    pub no2_du: f64,
    /// Precipitable water \[mm\], 0 to 200.
    pub water_mm: f64,
    /// Carbon dioxide \[ppm\], 0 to 10 000.
    pub co2_ppm: f64,
}

impl Default for GasColumns {
    /// Dry air of 330 ppm CO₂ without ozone or nitrogen dioxide.
    fn default() -> Self {
        Self {
            ozone_du: 0.0,
            no2_du: 0.0,
            water_mm: 0.0,
            co2_ppm: 330.0,
        }
    }
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

    /// Nitrogen dioxide in a vertical column from the ground to the top \[DU\].
    pub fn no2_column_du(&self) -> f64 {
        column(&self.altitude_m, &self.no2_number_density) / DOBSON_UNIT_M2
    }

    /// Precipitable water above the ground \[mm\].
    pub fn water_column_mm(&self) -> f64 {
        column(&self.altitude_m, &self.water_number_density) / WATER_PER_MM_M2
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
    /// Water vapour \[m⁻³\], of which only the shape matters; US76 is dry and has that of AFGL's standard.
    water: LogLinear,
    /// Nitrogen dioxide of clean air \[m⁻³\], AFGL's.
    no2: LogLinear,
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
        let afgl_name = match class {
            AtmosphereClass::Us76 | AtmosphereClass::AfglStandard => "us-standard-1976",
            other => other.name(),
        };
        let table = Table::parse(
            "afgl1986",
            include_str!("../../../../data/atmosphere_afgl/afgl1986.csv"),
        )?
        .select("atmosphere", afgl_name)?;
        let altitude_m = table.numbers("altitude_m")?;
        let log_linear = |name: &str| -> Result<LogLinear> {
            Ok(LogLinear::new(altitude_m.clone(), &table.numbers(name)?))
        };
        let (ozone, air) = if class == AtmosphereClass::Us76 {
            let air = Air::Us76(us76::Us76::new()?);
            (super::ozone::krueger_minzner()?, air)
        } else {
            let air = Air::Afgl {
                temperature_k: table.numbers("temperature_k")?,
                pressure_pa: log_linear("pressure_pa")?,
                number_density: log_linear("air_m3")?,
                altitude_m: altitude_m.clone(),
            };
            (log_linear("ozone_m3")?, air)
        };
        Ok(Self {
            class,
            air,
            ozone,
            water: log_linear("water_m3")?,
            no2: log_linear("no2_m3")?,
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

    /// The atmosphere on a vertical grid, dry and with ozone alone.
    ///
    /// `ozone_du` is the column above the lowest node, 0 to 1000 DU.
    ///
    /// # Errors
    /// As [`Atmosphere::profile_with`].
    pub fn profile(&self, grid: &VerticalGrid, ozone_du: f64) -> Result<AirProfile> {
        let columns = GasColumns {
            ozone_du,
            ..GasColumns::default()
        };
        self.profile_with(grid, &columns)
    }

    /// The atmosphere on a vertical grid, its gases scaled to columns above the lowest node.
    ///
    /// The columns of the result, as integrated over its linear pieces, are the given ones, and that of air is the true one:
    /// densities at the nodes are moved a little for that ([`keep_columns`]), by 0.01 % below 25 km and 0.3 % above. Ozone and water keep the
    /// shape of the reference atmosphere. Nitrogen dioxide has that of AFGL's clean air up to that air's own amount
    /// (0.19 to 0.22 DU from sea level); what is given beyond it lies near the ground, `exp(−height / 1 km)`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfRange`] for a column, or for nodes outside −500 to 100 000 m.
    pub fn profile_with(&self, grid: &VerticalGrid, columns: &GasColumns) -> Result<AirProfile> {
        check_range("ozone", columns.ozone_du, "DU", OZONE_RANGE_DU)?;
        check_range("no2", columns.no2_du, "DU", 0.0..=20.0)?;
        check_range("water", columns.water_mm, "mm", 0.0..=200.0)?;
        check_range("co2", columns.co2_ppm, "ppm", 0.0..=10_000.0)?;
        let altitude_m = grid.altitude_m().to_vec();
        let fine_m = grid.with_middles();
        let states = fine_m
            .iter()
            .map(|&z| self.air_at(z))
            .collect::<Result<Vec<_>>>()?;
        let kept = |fine: Vec<f64>| keep_columns(&altitude_m, &fine);
        let shape = |gas: &LogLinear| kept(fine_m.iter().map(|&z| gas.at(z)).collect());
        let scaled = |shape: Vec<f64>, molecules_m2: f64| -> Vec<f64> {
            let scale = molecules_m2 / column(&altitude_m, &shape);
            shape.iter().map(|n| n * scale).collect()
        };
        let ozone = scaled(shape(&self.ozone), columns.ozone_du * DOBSON_UNIT_M2);
        let water = scaled(shape(&self.water), columns.water_mm * WATER_PER_MM_M2);
        let clean = shape(&self.no2);
        let no2_m2 = columns.no2_du * DOBSON_UNIT_M2;
        let clean_m2 = no2_m2.min(column(&altitude_m, &clean));
        let near_ground = |z: &f64| (-(z - altitude_m[0]) / CITY_NO2_SCALE_M).exp();
        let city = kept(fine_m.iter().map(near_ground).collect());
        let mut no2 = scaled(clean, clean_m2);
        let added = scaled(city, no2_m2 - clean_m2);
        no2.iter_mut().zip(added).for_each(|(n, more)| *n += more);
        // Nodes and middles alternate.
        let nodes = || states.iter().step_by(2);
        Ok(AirProfile {
            temperature_k: nodes().map(|s| s.temperature_k).collect(),
            pressure_pa: nodes().map(|s| s.pressure_pa).collect(),
            air_number_density: kept(states.iter().map(|s| s.air_number_density).collect()),
            ozone_number_density: ozone,
            no2_number_density: no2,
            water_number_density: water,
            co2_ppm: columns.co2_ppm,
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
                assert!(error.abs() < 1e-5, "{class:?} from {ground} m: {error:e}");
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

    /// The ozone columns stated with AFGL's profiles, log-linear between their levels: 0.3 DU; and the columns of water, 0.05 mm.
    #[test]
    fn afgl_columns_of_ozone_and_water_are_the_published_ones() {
        let fine: Vec<f64> = (0..=100_000).map(f64::from).collect();
        for (name, du, mm) in [
            ("tropical", 282.0, 41.2),
            ("midlatitude-summer", 334.4, 29.2),
            ("midlatitude-winter", 378.2, 8.5),
            ("subarctic-summer", 347.7, 20.8),
            ("subarctic-winter", 375.5, 4.2),
            ("afgl-standard", 344.2, 14.2),
        ] {
            let atmosphere = Atmosphere::named(name).unwrap();
            let above = |gas: &LogLinear| {
                let density: Vec<f64> = fine.iter().map(|&z| gas.at(z)).collect();
                column(&fine, &density)
            };
            let ozone = above(&atmosphere.ozone) / DOBSON_UNIT_M2;
            assert!((ozone - du).abs() < 0.3, "{name}: {ozone} DU");
            let water = above(&atmosphere.water) / WATER_PER_MM_M2;
            assert!((water - mm).abs() < 0.05, "{name}: {water} mm");
            assert!((atmosphere.class().water_mm() - mm).abs() < 1e-9);
        }
    }

    /// Every gas has the column that was asked for; nitrogen dioxide beyond the clean air's lies near the ground.
    #[test]
    fn gases_have_the_columns_asked_for() {
        let us76 = Atmosphere::named("us76").unwrap();
        let columns = GasColumns {
            ozone_du: 300.0,
            no2_du: 1.0,
            water_mm: 20.0,
            co2_ppm: 420.0,
        };
        for ground_m in [0.0, 2500.0] {
            let grid = VerticalGrid::standard(ground_m).unwrap();
            let air = us76.profile_with(&grid, &columns).unwrap();
            assert!((air.no2_column_du() - 1.0).abs() < 1e-12);
            assert!((air.water_column_mm() - 20.0).abs() < 1e-9);
            let low = air.altitude_m.iter().filter(|z| **z <= ground_m + 3000.0);
            let n = low.count();
            let low_du = column(&air.altitude_m[..n], &air.no2_number_density[..n]);
            assert!(low_du / DOBSON_UNIT_M2 > 0.7);
        }
        let clean = GasColumns {
            no2_du: 0.1,
            ..columns
        };
        let grid = VerticalGrid::standard(0.0).unwrap();
        let air = us76.profile_with(&grid, &clean).unwrap();
        let highest = (0..air.altitude_m.len())
            .max_by(|&a, &b| air.no2_number_density[a].total_cmp(&air.no2_number_density[b]));
        assert!(air.altitude_m[highest.unwrap()] > 20e3);
        for bad in [
            GasColumns {
                no2_du: -1.0,
                ..columns
            },
            GasColumns {
                water_mm: f64::NAN,
                ..columns
            },
            GasColumns {
                co2_ppm: -1.0,
                ..columns
            },
        ] {
            assert!(us76.profile_with(&grid, &bad).is_err());
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
