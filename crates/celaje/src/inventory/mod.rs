//! What the air of a sky holds and what each part of it does to light, as tables to read, save and draw.
//!
//! The sky itself needs only sums over all that absorbs, and phase functions where there are particles. Here every gas and
//! every layer of aerosol stands for itself, so that anyone can see what the air is made of before believing its light.

mod figure;
mod files;

pub use files::InventoryFormat;

use crate::composition::column;
use crate::error::Result;
use crate::medium::{air_scattering, gas_absorption};
use crate::optics::rayleigh::Rayleigh;
use crate::optics::{AngleGrid, Phase};
use crate::sky::Composition;
use crate::spectrum::WavelengthGrid;

/// Name of air as a species.
pub const AIR: &str = "air";

/// How a species scatters.
#[derive(Debug, Clone, PartialEq)]
pub struct Scattering {
    /// Mean cosine of the scattering angle, shape (w,).
    pub asymmetry: Vec<f64>,
    /// Phase function \[sr⁻¹\], its integral over the sphere 1, shape (w, angle).
    pub phase: Vec<f64>,
}

/// A gas or a layer of aerosol.
#[derive(Debug, Clone, PartialEq)]
pub struct Species {
    /// `air`, `ozone`, …, or the layer's name.
    pub name: String,
    /// Whether it is a layer of aerosol.
    pub is_aerosol: bool,
    /// Molecules or particles \[m⁻³\], shape (z,).
    pub number_density: Vec<f64>,
    /// Scattering coefficient \[m⁻¹\], shape (z, w).
    pub sigma_s: Vec<f64>,
    /// Absorption coefficient \[m⁻¹\], shape (z, w).
    pub sigma_a: Vec<f64>,
    /// Vertical optical depth of scattering from the ground to space \[1\], shape (w,).
    pub tau_s: Vec<f64>,
    /// Vertical optical depth of absorption from the ground to space \[1\], shape (w,).
    pub tau_a: Vec<f64>,
    /// How it scatters, if it does.
    pub scattering: Option<Scattering>,
}

impl Species {
    /// Vertical optical depth from the ground to space \[1\], shape (w,).
    pub fn tau(&self) -> Vec<f64> {
        let pairs = self.tau_s.iter().zip(&self.tau_a);
        pairs.map(|(s, a)| s + a).collect()
    }

    fn with_depths(mut self, altitude_m: &[f64]) -> Self {
        let w = self.sigma_s.len() / altitude_m.len();
        let depth = |sigma: &[f64], lane: usize| {
            let along: Vec<f64> = sigma.iter().skip(lane).step_by(w).copied().collect();
            column(altitude_m, &along)
        };
        self.tau_s = (0..w).map(|lane| depth(&self.sigma_s, lane)).collect();
        self.tau_a = (0..w).map(|lane| depth(&self.sigma_a, lane)).collect();
        self
    }
}

/// All aerosol of the column together, at each wavelength; the shapes are (w,).
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolColumn {
    /// Vertical optical depth \[1\].
    pub tau: Vec<f64>,
    /// Single-scattering albedo \[1\]; NaN where there is no aerosol.
    pub ssa: Vec<f64>,
    /// Mean cosine of the scattering angle \[1\]; NaN where there is no aerosol.
    pub asymmetry: Vec<f64>,
    /// Ångström exponent `−d ln τ / d ln λ`, between the neighbours on either side \[1\]; NaN for a single wavelength.
    pub angstrom: Vec<f64>,
    /// Phase function \[sr⁻¹\], weighted by scattering optical depth, shape (w, angle); NaN where there is no aerosol.
    pub phase: Vec<f64>,
}

/// The air of a sky, in parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Inventory {
    /// Nodes above sea level \[m\], the ground first, shape (z,); everything is linear between them.
    pub altitude_m: Vec<f64>,
    /// Temperature \[K\], shape (z,).
    pub temperature_k: Vec<f64>,
    /// Pressure \[Pa\], shape (z,).
    pub pressure_pa: Vec<f64>,
    /// Vacuum wavelengths \[nm\], shape (w,).
    pub wavelength_nm: Vec<f64>,
    /// Scattering angles of the phase functions \[deg\], shape (angle,).
    pub theta_deg: Vec<f64>,
    /// Gases, then layers of aerosol from the lowest up.
    pub species: Vec<Species>,
    /// All aerosol together.
    pub aerosol: AerosolColumn,
    /// Whether a refractive index was extrapolated below the first wavelength of its table.
    pub extrapolated: bool,
}

impl Inventory {
    /// Takes a composition apart.
    ///
    /// `wavelength` is the grid that the composition was made on.
    ///
    /// # Errors
    /// As [`gas_absorption`].
    pub fn new(composition: &Composition, wavelength: &WavelengthGrid) -> Result<Self> {
        let (air, particles) = (&composition.air, &composition.aerosol);
        let altitude_m = &air.altitude_m;
        let mut species = vec![molecules(composition, wavelength)?];
        for gas in gas_absorption(air, wavelength)? {
            species.push(Species {
                name: gas.name.to_owned(),
                is_aerosol: false,
                number_density: gas.number_density,
                sigma_s: vec![0.0; gas.sigma_a.len()],
                sigma_a: gas.sigma_a,
                tau_s: Vec::new(),
                tau_a: Vec::new(),
                scattering: None,
            });
        }
        for layer in &particles.layers {
            let number_density = layer.number_densities(altitude_m);
            let pairs = layer.xs_ext.iter().zip(&layer.xs_sca);
            let xs_abs: Vec<f64> = pairs.map(|(e, s)| (e - s).max(0.0)).collect();
            let phase = layer.matrix.iter().flat_map(|m| m.f11.iter().copied());
            species.push(Species {
                name: unused_name(&layer.name, &species),
                is_aerosol: true,
                sigma_s: outer(&number_density, &layer.xs_sca),
                sigma_a: outer(&number_density, &xs_abs),
                number_density,
                tau_s: Vec::new(),
                tau_a: Vec::new(),
                scattering: Some(Scattering {
                    asymmetry: layer.asymmetry.clone(),
                    phase: phase.collect(),
                }),
            });
        }
        let measured = species.into_iter().map(|s| s.with_depths(altitude_m));
        let species: Vec<Species> = measured.collect();
        Ok(Self {
            altitude_m: altitude_m.clone(),
            temperature_k: air.temperature_k.clone(),
            pressure_pa: air.pressure_pa.clone(),
            wavelength_nm: wavelength.nm().to_vec(),
            theta_deg: particles.angles.theta_deg().to_vec(),
            aerosol: AerosolColumn::of(&species, wavelength.nm(), &particles.angles),
            species,
            extrapolated: particles.extrapolated,
        })
    }

    /// Vertical optical depth of everything \[1\], shape (w,).
    pub fn tau(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.wavelength_nm.len()];
        for species in &self.species {
            for (sum, tau) in sum.iter_mut().zip(species.tau()) {
                *sum += tau;
            }
        }
        sum
    }

    /// Index of the wavelength nearest to one \[nm\].
    pub fn nearest_wavelength(&self, nm: f64) -> usize {
        let distance = |i: &usize| (self.wavelength_nm[*i] - nm).abs();
        let all = 0..self.wavelength_nm.len();
        all.min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .unwrap_or(0)
    }
}

/// Air as a species: molecules that scatter.
fn molecules(composition: &Composition, wavelength: &WavelengthGrid) -> Result<Species> {
    let air = &composition.air;
    let angles = &composition.aerosol.angles;
    let xs_sca = air_scattering(air, wavelength)?;
    let rayleigh = Rayleigh::new()?;
    let nm = wavelength.nm().iter();
    let depolarisation: Vec<f64> = nm.map(|&w| rayleigh.depolarisation(w)).collect();
    let phase = Phase::rayleigh(&depolarisation)?;
    let mut row = vec![0.0; phase.lanes()];
    let (w, t) = (wavelength.len(), angles.theta_deg().len());
    let mut table = vec![0.0; w * t];
    for (i, &cos_theta) in angles.cos_theta().iter().enumerate() {
        phase.eval(cos_theta, &mut row);
        for lane in 0..w {
            table[lane * t + i] = f64::from(row[lane]);
        }
    }
    Ok(Species {
        name: AIR.to_owned(),
        is_aerosol: false,
        number_density: air.air_number_density.clone(),
        sigma_s: outer(&air.air_number_density, &xs_sca),
        sigma_a: vec![0.0; w * air.altitude_m.len()],
        tau_s: Vec::new(),
        tau_a: Vec::new(),
        scattering: Some(Scattering {
            asymmetry: vec![0.0; w],
            phase: table,
        }),
    })
}

impl AerosolColumn {
    fn of(species: &[Species], wavelength_nm: &[f64], angles: &AngleGrid) -> Self {
        let (w, t) = (wavelength_nm.len(), angles.theta_deg().len());
        let mut sum = Self {
            tau: vec![0.0; w],
            ssa: vec![0.0; w],
            asymmetry: vec![0.0; w],
            angstrom: Vec::new(),
            phase: vec![0.0; w * t],
        };
        for layer in species.iter().filter(|s| s.is_aerosol) {
            let Some(scattering) = &layer.scattering else {
                continue;
            };
            for i in 0..w {
                let tau_s = layer.tau_s[i];
                sum.tau[i] += tau_s + layer.tau_a[i];
                sum.ssa[i] += tau_s;
                sum.asymmetry[i] += tau_s * scattering.asymmetry[i];
                for j in i * t..(i + 1) * t {
                    sum.phase[j] += tau_s * scattering.phase[j];
                }
            }
        }
        for i in 0..w {
            // Without aerosol these are 0/0, which is NaN, as it should be.
            let tau_s = sum.ssa[i];
            sum.asymmetry[i] /= tau_s;
            sum.ssa[i] /= sum.tau[i];
            sum.phase[i * t..(i + 1) * t]
                .iter_mut()
                .for_each(|p| *p /= tau_s);
        }
        sum.angstrom = angstrom(wavelength_nm, &sum.tau);
        sum
    }
}

/// `−d ln τ / d ln λ` between the neighbours of each wavelength.
fn angstrom(wavelength_nm: &[f64], tau: &[f64]) -> Vec<f64> {
    let last = wavelength_nm.len() - 1;
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        -(tau[b] / tau[a]).ln() / (wavelength_nm[b] / wavelength_nm[a]).ln()
    };
    (0..=last).map(slope).collect()
}

/// A name that no species has as yet: a second `mixing layer` is `mixing layer 2`.
fn unused_name(name: &str, taken: &[Species]) -> String {
    let is_free = |candidate: &str| taken.iter().all(|s| s.name != candidate);
    let mut candidate = name.to_owned();
    let mut number = 2;
    while !is_free(&candidate) {
        candidate = format!("{name} {number}");
        number += 1;
    }
    candidate
}

/// `density[i] · xs[j]`, shape (z, w).
fn outer(density: &[f64], xs: &[f64]) -> Vec<f64> {
    let rows = density.iter();
    rows.flat_map(|d| xs.iter().map(move |x| d * x)).collect()
}

#[cfg(test)]
mod tests;
