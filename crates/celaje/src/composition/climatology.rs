//! What the climate's conditions hold: mixtures of aerosol, and blended air with its own ozone layer.

use super::aerosol::{AerosolLayer, AerosolType, LayerComponent, ParticleSource, VerticalProfile};
use super::grid::{column, VerticalGrid};
use super::{AirProfile, Atmosphere, GasColumns, DOBSON_UNIT_M2};
use crate::climate::{
    AerosolMixture, AtmosphereClass, Conditions, MixtureComponent, MixtureLayer, CLIMATE,
};
use crate::error::{check_range, Error, Result};

impl AerosolType {
    /// The aerosol of a mixture that the climate found; it has no stratosphere of its own.
    ///
    /// Number densities are those of the data set; the optical depth in force scales them afterwards.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a mixture without layers, or a layer without components.
    pub fn from_components(mixture: &AerosolMixture) -> Result<Self> {
        let empty = |l: &MixtureLayer| l.components.is_empty();
        if mixture.layers.is_empty() || mixture.layers.iter().any(empty) {
            return Err(Error::invalid(
                "an aerosol mixture has a layer without components, or no layer at all",
                "leave empty layers out",
            ));
        }
        Ok(Self {
            name: CLIMATE.to_owned(),
            layers: mixture.layers.iter().map(layer).collect(),
            default_aod_550: None,
        })
    }

    /// The aerosol of some conditions: their mixture if they name [`CLIMATE`], else the type of that name.
    ///
    /// # Errors
    /// As [`Self::from_components`] and [`Self::named`].
    pub fn of_conditions(conditions: &Conditions) -> Result<Self> {
        match &conditions.mixture {
            Some(mixture) if conditions.aerosol.value == CLIMATE => Self::from_components(mixture),
            _ => {
                let latitude_deg = conditions.latitude_deg.as_ref().map_or(45.0, |c| c.value);
                Self::named(&conditions.aerosol.value, latitude_deg)
            }
        }
    }
}

fn layer(layer: &MixtureLayer) -> AerosolLayer {
    AerosolLayer {
        name: layer.name.to_owned(),
        components: layer.components.iter().map(component).collect(),
        profile: VerticalProfile::Slab {
            reference_m: layer.reference_m,
            bottom_m: layer.bottom_m,
            top_m: layer.top_m,
            scale_height_m: layer.scale_height_m.unwrap_or(f64::INFINITY),
        },
        scales_with_aod: true,
    }
}

fn component(component: &MixtureComponent) -> LayerComponent {
    let id = component.id.to_owned();
    LayerComponent {
        source: match component.humidity_percent {
            None => ParticleSource::Opac(id),
            Some(own) => ParticleSource::OpacAt(id, own),
        },
        number_density: component.number_density,
    }
}

impl AirProfile {
    /// The air of some conditions on a vertical grid, with their columns of gases.
    ///
    /// Where they name [`CLIMATE`], temperature is the weighted mean of their atmospheres, pressure and density the
    /// weighted geometric mean (exponentials stay exponentials), and ozone has the shape of their own layer.
    ///
    /// # Errors
    /// As [`Atmosphere::named`] and [`Atmosphere::profile`].
    pub fn of_conditions(conditions: &Conditions, grid: &VerticalGrid) -> Result<Self> {
        let gases = GasColumns {
            ozone_du: conditions.ozone_du.value,
            no2_du: conditions.no2_du.value,
            water_mm: conditions.water_mm.value,
            co2_ppm: conditions.co2_ppm.value,
        };
        match &conditions.atmosphere_blend {
            Some(blend) if conditions.atmosphere.value == CLIMATE => {
                let mut air = blended(blend, grid, &gases)?;
                if let Some(shape) = &conditions.ozone_shape {
                    let ratio = air.pressure_pa.iter().map(|&p| shape.at(p));
                    let density = ratio.zip(&air.air_number_density).map(|(r, n)| r * n);
                    air.ozone_number_density = density.collect();
                    air.scale_ozone(gases.ozone_du)?;
                }
                Ok(air)
            }
            _ => Atmosphere::named(&conditions.atmosphere.value)?.profile_with(grid, &gases),
        }
    }

    fn scale_ozone(&mut self, ozone_du: f64) -> Result<()> {
        check_range("ozone", ozone_du, "DU", crate::climate::OZONE_RANGE_DU)?;
        let now = column(&self.altitude_m, &self.ozone_number_density);
        let scale = ozone_du * DOBSON_UNIT_M2 / now;
        self.ozone_number_density
            .iter_mut()
            .for_each(|n| *n *= scale);
        Ok(())
    }
}

fn blended(
    blend: &[(AtmosphereClass, f64)],
    grid: &VerticalGrid,
    gases: &GasColumns,
) -> Result<AirProfile> {
    let parts = blend
        .iter()
        .map(|(class, weight)| Ok((Atmosphere::new(*class)?.profile_with(grid, gases)?, *weight)))
        .collect::<Result<Vec<_>>>()?;
    let sum: f64 = parts.iter().map(|(_, w)| w).sum();
    if sum.is_nan() || sum <= 0.0 {
        return Err(Error::invalid(
            "a blend of atmospheres has no weight",
            "give at least one atmosphere a positive weight",
        ));
    }
    let mean = |of: fn(&AirProfile) -> &[f64], to: fn(f64) -> f64, from: fn(f64) -> f64| {
        let node = |i: usize| -> f64 { parts.iter().map(|(p, w)| w / sum * to(of(p)[i])).sum() };
        (0..grid.altitude_m().len())
            .map(|i| from(node(i)))
            .collect()
    };
    let same: fn(f64) -> f64 = |x| x;
    Ok(AirProfile {
        altitude_m: grid.altitude_m().to_vec(),
        temperature_k: mean(|p| &p.temperature_k, same, same),
        pressure_pa: mean(|p| &p.pressure_pa, f64::ln, f64::exp),
        air_number_density: mean(|p| &p.air_number_density, f64::ln, f64::exp),
        ozone_number_density: mean(|p| &p.ozone_number_density, same, same),
        no2_number_density: mean(|p| &p.no2_number_density, same, same),
        water_number_density: mean(|p| &p.water_number_density, same, same),
        co2_ppm: gases.co2_ppm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::climate::Overrides;
    use crate::place::Site;

    fn conditions(lat: f64, lon: f64, overrides: &Overrides) -> Conditions {
        let site = Site::new(lat, lon, 0.0).unwrap();
        Conditions::at(&site, &"2026-06-21T12:00Z".parse().unwrap(), overrides).unwrap()
    }

    #[test]
    fn blended_air_is_air() {
        for lat in [-90.0, -37.0, 0.0, 15.0, 30.0, 52.5, 90.0] {
            let c = conditions(lat, 20.0, &Overrides::default());
            let grid = VerticalGrid::standard(0.0).unwrap();
            let air = AirProfile::of_conditions(&c, &grid).unwrap();
            assert!((air.ozone_column_du() / c.ozone_du.value - 1.0).abs() < 1e-12);
            for i in 0..air.altitude_m.len() {
                // The gas law, which a geometric mean of densities and an arithmetic one of temperatures keep to 1 %;
                // nodes above 25 km are moved by up to 0.3 % to keep columns.
                let allowed = if air.altitude_m[i] > 25e3 {
                    0.013
                } else {
                    0.01
                };
                let ratio = air.pressure_pa[i]
                    / (1.380_649e-23 * air.air_number_density[i] * air.temperature_k[i]);
                assert!(
                    (ratio - 1.0).abs() < allowed,
                    "{lat} {} m: {ratio}",
                    air.altitude_m[i]
                );
            }
        }
    }

    #[test]
    fn named_types_stay_one_word_away() {
        let desert = Overrides {
            aerosol: Some("desert".into()),
            atmosphere: Some("us76".into()),
            ..Overrides::default()
        };
        let c = conditions(50.0, 10.0, &desert);
        assert_eq!(AerosolType::of_conditions(&c).unwrap().name, "desert");
        assert!(c.mixture.is_none() && c.atmosphere_blend.is_none());
        let found = conditions(50.0, 10.0, &Overrides::default());
        let aerosol = AerosolType::of_conditions(&found).unwrap();
        assert_eq!(aerosol.name, CLIMATE);
        assert!(aerosol.layers.iter().any(|l| l.name == "continental"));
        assert!(aerosol.upper_layers().is_empty());
    }
}
