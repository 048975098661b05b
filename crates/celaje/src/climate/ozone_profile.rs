//! The shape of the ozone layer by latitude and month.

use std::sync::OnceLock;

use super::blend::{cached, damaged, months};
use crate::error::Result;
use crate::math::interp::interval;
use crate::place::Instant;

const LATITUDES: usize = 64;
const LEVELS: usize = 59;

/// Mixing ratio of ozone along pressure; only its shape matters, for a column is given besides.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct OzoneShape {
    /// Pressure \[Pa\], from the top down.
    pub pressure_pa: Vec<f64>,
    /// Ozone per air by number \[1\], same shape.
    pub mixing_ratio: Vec<f64>,
}

impl OzoneShape {
    /// Mixing ratio \[1\] at a pressure \[Pa\]: linear in the logarithm of pressure, constant below the lowest level; above
    /// the highest one (near 57 km) it falls with the square root of pressure, as the AFGL profiles do up to 75 km.
    pub fn at(&self, pressure_pa: f64) -> f64 {
        let (p, ratio) = (&self.pressure_pa, &self.mixing_ratio);
        let last = p.len() - 1;
        if pressure_pa <= p[0] {
            return ratio[0] * (pressure_pa / p[0]).max(0.0).sqrt();
        }
        if pressure_pa >= p[last] {
            return ratio[last];
        }
        let i = interval(p, pressure_pa);
        let t = (pressure_pa / p[i]).ln() / (p[i + 1] / p[i]).ln();
        ratio[i] + t * (ratio[i + 1] - ratio[i])
    }
}

struct Zonal {
    latitude_deg: Vec<f64>,
    pressure_pa: Vec<f64>,
    /// Month, latitude, level \[1e-9\].
    ratio_ppb: Vec<u16>,
}

/// The layer over a latitude at an instant, linear in both.
///
/// `latitude_deg` −90 to 90; held beyond ±87.9°.
///
/// # Errors
/// [`crate::Error::Invalid`] if the embedded table is damaged.
///
/// # Source
/// Zonal monthly means that the model CAM3 was run with, see `data/climate_ozone_profile/SOURCE.md`.
pub fn ozone_shape(latitude_deg: f64, instant: &Instant) -> Result<OzoneShape> {
    static ZONAL: OnceLock<Result<Zonal>> = OnceLock::new();
    let zonal = cached(&ZONAL, load)?;
    let i = interval(&zonal.latitude_deg, latitude_deg);
    let (south, north) = (zonal.latitude_deg[i], zonal.latitude_deg[i + 1]);
    let v = ((latitude_deg - south) / (north - south)).clamp(0.0, 1.0);
    let (first, second, u) = months(instant);
    let mut mixing_ratio = vec![0.0; LEVELS];
    for (month, in_time) in [(first, 1.0 - u), (second, u)] {
        for (row, in_place) in [(i, 1.0 - v), (i + 1, v)] {
            let from = (month * LATITUDES + row) * LEVELS;
            let profile = &zonal.ratio_ppb[from..from + LEVELS];
            for (sum, ppb) in mixing_ratio.iter_mut().zip(profile) {
                *sum += in_time * in_place * f64::from(*ppb) * 1e-9;
            }
        }
    }
    Ok(OzoneShape {
        pressure_pa: zonal.pressure_pa.clone(),
        mixing_ratio,
    })
}

fn load() -> Result<Zonal> {
    let bytes = include_bytes!("../../../../data/climate_ozone_profile/profile.bin");
    let floats = LATITUDES + LEVELS;
    if bytes.len() != 4 * floats + 2 * 12 * LATITUDES * LEVELS {
        return Err(damaged("climate_ozone_profile"));
    }
    let (head, body) = bytes.split_at(4 * floats);
    let head: Vec<f64> = head
        .chunks_exact(4)
        .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
        .collect();
    let ratio = body.chunks_exact(2);
    Ok(Zonal {
        latitude_deg: head[..LATITUDES].to_vec(),
        pressure_pa: head[LATITUDES..].iter().map(|hpa| hpa * 100.0).collect(),
        ratio_ppb: ratio.map(|b| u16::from_le_bytes([b[0], b[1]])).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The layer's maximum of mixing ratio lies near 10 hPa in the tropics; its number density peaks lower at the poles
    /// than in the tropics (textbook: 25–27 km against 17–20 km).
    #[test]
    fn the_layer_lies_where_it_should() {
        let april: Instant = "2021-04-16T00:00Z".parse().unwrap();
        let peak_pa = |lat: f64, weight: fn(f64) -> f64| {
            let shape = ozone_shape(lat, &april).unwrap();
            let value = |i: usize| shape.mixing_ratio[i] * weight(shape.pressure_pa[i]);
            let best = (0..LEVELS).max_by(|&a, &b| value(a).total_cmp(&value(b)));
            shape.pressure_pa[best.unwrap()]
        };
        assert!((700.0..1500.0).contains(&peak_pa(0.0, |_| 1.0)));
        let (tropics, pole) = (peak_pa(0.0, |p| p), peak_pa(85.0, |p| p));
        assert!((1500.0..3000.0).contains(&tropics), "{tropics}");
        assert!((4000.0..9000.0).contains(&pole), "{pole}");
    }

    #[test]
    fn beyond_its_levels_it_goes_on_smoothly() {
        let shape = ozone_shape(40.0, &"2021-01-01T00:00Z".parse().unwrap()).unwrap();
        let (top, bottom) = (shape.pressure_pa[0], shape.pressure_pa[LEVELS - 1]);
        assert!((shape.at(top * 0.999) / shape.at(top * 1.001) - 1.0).abs() < 1e-2);
        assert_eq!(shape.at(bottom * 1.1), shape.at(bottom));
        assert_eq!(shape.at(0.0), 0.0);
    }
}
