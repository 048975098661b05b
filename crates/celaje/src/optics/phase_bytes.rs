//! Phase functions to bytes and back, for files of tables.

use super::phase::{Kind, Phase, Table};
use crate::error::{Error, Result};
use crate::math::bytes::{ByteReader, ByteWriter};
use crate::math::lanes;

impl Phase {
    /// Writes kind and values.
    pub(crate) fn encode(&self, w: &mut ByteWriter) {
        match &self.0 {
            Kind::Rayleigh {
                constant,
                square,
                circular,
            } => {
                w.text("rayleigh");
                w.f32s(constant);
                w.f32s(square);
                w.f32s(circular);
            }
            Kind::HenyeyGreenstein { g, .. } => {
                w.text("henyey-greenstein");
                w.f32s(g);
            }
            Kind::Table(t) => {
                w.text("table");
                w.f64s(&t.cos_theta);
                w.f32s(&t.p);
                w.f32s(&t.polarisation);
                w.f64s(&t.cdf);
            }
        }
    }

    /// The phase function that [`Phase::encode`] wrote, at so many wavelengths (padded).
    ///
    /// # Errors
    /// [`Error::Invalid`] for values that are no phase function.
    pub(crate) fn decode(r: &mut ByteReader<'_>, lanes: usize) -> Result<Self> {
        let wrong = || Error::invalid("values that are no phase function", "bake it again");
        let row = |values: Vec<f32>| {
            let sound = values.len() == lanes && values.iter().all(|v| v.is_finite());
            sound.then_some(values).ok_or_else(wrong)
        };
        let kind = match r.text()?.as_str() {
            "rayleigh" => Kind::Rayleigh {
                constant: row(r.f32s()?)?,
                square: row(r.f32s()?)?,
                circular: row(r.f32s()?)?,
            },
            "henyey-greenstein" => Kind::henyey_greenstein(row(r.f32s()?)?),
            "table" => {
                let table = Table {
                    cos_theta: r.f64s()?,
                    p: r.f32s()?,
                    polarisation: r.f32s()?,
                    cdf: r.f64s()?,
                    lanes,
                };
                if !table.is_sound() {
                    return Err(wrong());
                }
                Kind::Table(table)
            }
            _ => return Err(wrong()),
        };
        Ok(Self(kind))
    }
}

impl Table {
    /// Whether shapes, order and values are those of a table.
    fn is_sound(&self) -> bool {
        let t = self.cos_theta.len();
        let rising = |x: &[f64], strictly: bool| {
            x.windows(2)
                .all(|w| w[0] < w[1] || (!strictly && w[0] == w[1]))
        };
        t >= 2
            && self.cos_theta[0] == -1.0
            && self.cos_theta[t - 1] == 1.0
            && rising(&self.cos_theta, true)
            && self.p.len() == t * self.lanes
            && self.p.iter().all(|p| (0.0..=1e12).contains(p))
            && [0, 3 * t * self.lanes].contains(&self.polarisation.len())
            && self.polarisation.iter().all(|p| p.is_finite())
            && !self.cdf.is_empty()
            && self.cdf.len().is_multiple_of(t)
            && lanes::padded(self.cdf.len() / t) == self.lanes
            && self.cdf.chunks_exact(t).all(|c| rising(c, false))
    }
}
