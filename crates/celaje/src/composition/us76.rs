//! The U.S. Standard Atmosphere 1976 from its definition, to 100 km.
//!
//! Equation and page numbers are those of NASA-TM-X-74335; all constants are the standard's own.

use super::air::{AirState, LogLinear};
use crate::error::Result;
use crate::math::Table;

/// Standard gravity g₀ \[m s⁻²\], molar mass of air M₀ \[kg/kmol\] and gas constant R* \[J kmol⁻¹ K⁻¹\] (table 2).
const G0: f64 = 9.80665;
const M0: f64 = 28.9644;
const R_STAR: f64 = 8314.32;
/// g₀ M₀ / R* \[K per geopotential metre\].
const HYDROSTATIC: f64 = G0 * M0 / R_STAR;
/// Boltzmann's constant of 1976 \[J/K\].
const BOLTZMANN: f64 = 1.380622e-23;
/// Effective radius of the Earth r₀ \[m\].
const RADIUS_M: f64 = 6_356_766.0;
/// Geometric altitude of the seventh layer's top \[m\].
const UPPER_M: f64 = 86_000.0;

/// Base \[geopotential m\] and gradient of molecular-scale temperature \[K/m\] of the seven layers (table 4).
const LAYERS: [(f64, f64); 7] = [
    (0.0, -0.0065),
    (11_000.0, 0.0),
    (20_000.0, 0.001),
    (32_000.0, 0.0028),
    (47_000.0, 0.0),
    (51_000.0, -0.0028),
    (71_000.0, -0.002),
];

/// One layer of linear temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layer {
    base_m: f64,
    gradient: f64,
    temperature_k: f64,
    pressure_pa: f64,
}

impl Layer {
    /// Temperature (eq. 23) and pressure (eqs. 33a, 33b) at a geopotential height.
    fn at(&self, height_m: f64) -> (f64, f64) {
        let above = height_m - self.base_m;
        let temperature_k = self.temperature_k + self.gradient * above;
        let ratio = if self.gradient == 0.0 {
            (-HYDROSTATIC * above / self.temperature_k).exp()
        } else {
            (self.temperature_k / temperature_k).powf(HYDROSTATIC / self.gradient)
        };
        (temperature_k, self.pressure_pa * ratio)
    }
}

/// The standard: seven layers, and the printed pressures above 86 km.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Us76 {
    layers: Vec<Layer>,
    upper_pressure_pa: LogLinear,
}

impl Us76 {
    pub(super) fn new() -> Result<Self> {
        let mut layers = vec![Layer {
            base_m: 0.0,
            gradient: LAYERS[0].1,
            temperature_k: 288.15,
            pressure_pa: 101_325.0,
        }];
        for (base_m, gradient) in LAYERS.into_iter().skip(1) {
            let (temperature_k, pressure_pa) = layers[layers.len() - 1].at(base_m);
            layers.push(Layer {
                base_m,
                gradient,
                temperature_k,
                pressure_pa,
            });
        }
        let upper = Table::parse(
            "us_standard_1976",
            include_str!("../../../../data/us_standard_1976/upper.csv"),
        )?;
        let upper_pressure_pa =
            LogLinear::new(upper.numbers("altitude_m")?, &upper.numbers("pressure_pa")?);
        Ok(Self {
            layers,
            upper_pressure_pa,
        })
    }

    /// The air at a geometric altitude up to 100 km; below sea level the lowest layer goes on, as in table I.
    ///
    /// Below 86 km the temperature is the molecular-scale one, as table I prints it; the kinetic one is lower by
    /// up to 0.04 % from 80 to 86 km.
    pub(super) fn at(&self, altitude_m: f64) -> AirState {
        let (temperature_k, pressure_pa) = if altitude_m < UPPER_M {
            // Geopotential height (eq. 18).
            let height_m = RADIUS_M * altitude_m / (RADIUS_M + altitude_m);
            let above = self.layers.partition_point(|l| l.base_m <= height_m);
            self.layers[above.max(1) - 1].at(height_m)
        } else {
            (
                upper_temperature_k(altitude_m),
                self.upper_pressure_pa.at(altitude_m),
            )
        };
        AirState {
            temperature_k,
            pressure_pa,
            air_number_density: pressure_pa / (BOLTZMANN * temperature_k),
        }
    }
}

/// Kinetic temperature from 86 to 110 km (eqs. 25 and 27).
fn upper_temperature_k(altitude_m: f64) -> f64 {
    let km = altitude_m * 1e-3;
    if km < 91.0 {
        return 186.8673;
    }
    let x = (km - 91.0) / 19.9429;
    263.1905 - 76.3232 * (1.0 - x * x).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Geometric altitude \[km\], temperature \[K\], pressure \[mbar\], number density \[m⁻³\] as printed in
    /// tables I and II of the standard.
    const PRINTED: [(f64, f64, f64, f64); 12] = [
        (0.0, 288.150, 1.01325e3, 2.5470e25),
        (5.0, 255.676, 5.4048e2, 1.5312e25),
        (11.0, 216.774, 2.2700e2, 7.5848e24),
        (20.0, 216.650, 5.5293e1, 1.8486e24),
        (32.0, 228.490, 8.8906e0, 2.8183e23),
        (50.0, 270.650, 7.9779e-1, 2.1350e22),
        (71.0, 216.846, 4.4795e-2, 1.4963e21),
        (80.0, 198.639, 1.0524e-2, 3.8377e20),
        (86.0, 186.87, 3.7338e-3, 1.447e20),
        (90.0, 186.87, 1.8359e-3, 7.116e19),
        (95.0, 188.42, 7.5966e-4, 2.920e19),
        (100.0, 195.08, 3.2011e-4, 1.189e19),
    ];

    #[test]
    fn printed_values_are_met() {
        let us76 = Us76::new().unwrap();
        for (km, kelvin, mbar, density) in PRINTED {
            let s = us76.at(km * 1e3);
            assert!((s.temperature_k - kelvin).abs() < 0.01, "{km} km: {s:?}");
            assert!(
                (s.pressure_pa / (mbar * 100.0) - 1.0).abs() < 1e-4,
                "{km} km: {s:?}"
            );
            assert!(
                (s.air_number_density / density - 1.0).abs() < 1e-3,
                "{km} km: {s:?}"
            );
        }
    }

    #[test]
    fn both_parts_meet_at_86_km() {
        let us76 = Us76::new().unwrap();
        let (below, above) = (us76.at(UPPER_M - 1e-3), us76.at(UPPER_M));
        assert!((below.pressure_pa / above.pressure_pa - 1.0).abs() < 1e-4);
        assert!((below.temperature_k / above.temperature_k - 1.0).abs() < 5e-4);
    }
}
