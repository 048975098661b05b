//! Optics of an aerosol type: one set of cross sections and one phase function per layer.

use super::angles::AngleGrid;
use super::lognormal::{
    particle_optics, particle_optics_with, ParticleOptics, Quadrature, ScatteringMatrix,
};
use super::tables;
use crate::composition::aerosol::{AerosolLayer, AerosolType, ParticleSource, VerticalProfile};
use crate::composition::opac;
use crate::composition::particle::Particle;
use crate::composition::upper::Spectrum;
use crate::composition::{keep_columns, with_middles};
use crate::error::{check_range, Error, Result};
use crate::spectrum::WavelengthGrid;
use rayon::prelude::*;

/// `−ln 0.02`: the optical depth over which a black object's contrast falls to 2 %.
const KOSCHMIEDER: f64 = 3.912;

/// Optics of one kind of particle over wavelength, per particle.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentOptics {
    /// Name of the component.
    pub id: String,
    /// Vacuum wavelengths \[nm\].
    pub wavelength_nm: Vec<f64>,
    /// Scattering angles of the matrices.
    pub angles: AngleGrid,
    /// One per wavelength.
    pub optics: Vec<ParticleOptics>,
    /// Whether the refractive index had to be extrapolated at any wavelength.
    pub extrapolated: bool,
}

/// Optics of the mixture of all components that share a vertical profile, per particle of the mixture.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerOptics {
    /// Name of the layer.
    pub name: String,
    /// How number density falls off.
    pub profile: VerticalProfile,
    /// Number density where the profile is 1, as tabulated \[m⁻³\].
    pub number_density_ref: f64,
    /// Factor on that density, set through [`AerosolOptics`] \[1\].
    pub scale: f64,
    /// Whether optical depth sets the amount.
    pub scales_with_aod: bool,
    /// Mean extinction cross section \[m²\], per wavelength.
    pub xs_ext: Vec<f64>,
    /// Mean scattering cross section \[m²\], per wavelength.
    pub xs_sca: Vec<f64>,
    /// Mean cosine of the scattering angle, per wavelength.
    pub asymmetry: Vec<f64>,
    /// Scattering matrix of the mixture, per wavelength.
    pub matrix: Vec<ScatteringMatrix>,
    /// Extinction cross section at 550 nm \[m²\].
    pub xs_ext_550: f64,
}

impl LayerOptics {
    /// Particles per m³ at an altitude above sea level \[m\].
    pub fn number_density(&self, altitude_m: f64) -> f64 {
        self.scale * self.number_density_ref * self.profile.relative(altitude_m)
    }

    /// Particles per m³ at nodes of altitude \[m\], such that what is linear between them keeps the layer's columns.
    pub fn number_densities(&self, altitude_m: &[f64]) -> Vec<f64> {
        let fine_m = with_middles(altitude_m);
        let fine: Vec<f64> = fine_m.iter().map(|&z| self.number_density(z)).collect();
        keep_columns(altitude_m, &fine)
    }

    /// Optical depth at 550 nm from an altitude \[m\] upwards.
    pub fn aod_550_above(&self, altitude_m: f64) -> f64 {
        let column = self.number_density_ref * self.profile.column_above(altitude_m);
        self.scale * column * self.xs_ext_550
    }
}

/// Everything that light needs to know about an aerosol type.
#[derive(Debug, Clone, PartialEq)]
pub struct AerosolOptics {
    /// Name of the type.
    pub name: String,
    /// Vacuum wavelengths \[nm\].
    pub wavelength_nm: Vec<f64>,
    /// Scattering angles of all matrices.
    pub angles: AngleGrid,
    /// One per layer of the type.
    pub layers: Vec<LayerOptics>,
    /// Whether any refractive index was extrapolated below its table.
    pub extrapolated: bool,
}

impl AerosolOptics {
    /// Optical depth at 550 nm of the layers that scale with it (the troposphere), from an altitude \[m\] upwards.
    pub fn aod_550_above(&self, altitude_m: f64) -> f64 {
        let scaled = self.layers.iter().filter(|layer| layer.scales_with_aod);
        scaled.map(|layer| layer.aod_550_above(altitude_m)).sum()
    }

    /// Sets the amount of tropospheric aerosol by its optical depth at 550 nm above the ground.
    ///
    /// `aod_550` \[1\], 0 to 100; `ground_altitude_m` above sea level \[m\]: the air below it is cut away before the column
    /// is taken. The stratosphere stays as tabulated.
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Invalid`] if the ground lies above all of the aerosol.
    pub fn scale_to_aod_550(&mut self, aod_550: f64, ground_altitude_m: f64) -> Result<()> {
        check_range("aod_550", aod_550, "", 0.0..=100.0)?;
        check_range("ground altitude", ground_altitude_m, "m", -1000.0..=100e3)?;
        self.set_scale(1.0)?;
        let tabulated = self.aod_550_above(ground_altitude_m);
        if tabulated <= 0.0 && aod_550 > 0.0 {
            return Err(Error::invalid(
                format!(
                    "no aerosol of type '{}' lies above {ground_altitude_m} m to be scaled to an optical depth",
                    self.name
                ),
                "set the optical depth to 0 or lower the ground",
            ));
        }
        self.set_scale(if tabulated > 0.0 {
            aod_550 / tabulated
        } else {
            0.0
        })
    }

    /// Sets the amount of tropospheric aerosol as a multiple of the tabulated one, 0 to 1e9.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn set_scale(&mut self, scale: f64) -> Result<()> {
        check_range("aerosol scale", scale, "", 0.0..=1e9)?;
        self.for_scaled(|layer| layer.scale = scale);
        Ok(())
    }

    /// Sets the amount of tropospheric aerosol by the visibility at the ground.
    ///
    /// Koschmieder's law at 550 nm, for a black object whose contrast falls to 2 %: extinction by air and aerosol together
    /// is `3.912 / visibility`.
    ///
    /// # Arguments
    /// * `visibility_km` — meteorological range, 0.1 to what clean air allows (about 340 km at sea level)
    /// * `air_sigma_550` — scattering coefficient of the air at the ground, 550 nm \[m⁻¹\]
    /// * `ground_altitude_m` — above sea level \[m\]
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Invalid`] if there is no aerosol of this type at the ground.
    ///
    /// # Source
    /// Koschmieder 1924, Beitr. Phys. freien Atm. 12, 33–53; with the 2 % of Middleton 1952 and LOWTRAN 7.
    pub fn scale_to_visibility(
        &mut self,
        visibility_km: f64,
        air_sigma_550: f64,
        ground_altitude_m: f64,
    ) -> Result<()> {
        let clean_air_km = KOSCHMIEDER / air_sigma_550 * 1e-3;
        check_range("visibility", visibility_km, "km", 0.1..=clean_air_km)?;
        check_range("ground altitude", ground_altitude_m, "m", -1000.0..=100e3)?;
        self.set_scale(1.0)?;
        let scaled = self.layers.iter().filter(|layer| layer.scales_with_aod);
        let at_ground =
            |layer: &LayerOptics| layer.number_density(ground_altitude_m) * layer.xs_ext_550;
        let sigma: f64 = scaled.map(at_ground).sum();
        if sigma <= 0.0 {
            return Err(Error::invalid(
                format!(
                    "no aerosol of type '{}' lies at {ground_altitude_m} m",
                    self.name
                ),
                "give an optical depth instead of a visibility",
            ));
        }
        let wanted = KOSCHMIEDER / (visibility_km * 1e3) - air_sigma_550;
        self.set_scale(wanted.max(0.0) / sigma)
    }

    /// Multiplies the amount of tropospheric aerosol by a turbidity factor, 0 to 1e3.
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn multiply(&mut self, turbidity: f64) -> Result<()> {
        check_range("turbidity", turbidity, "", 0.0..=1e3)?;
        self.for_scaled(|layer| layer.scale *= turbidity);
        Ok(())
    }

    fn for_scaled(&mut self, change: impl FnMut(&mut LayerOptics)) {
        let scaled = self.layers.iter_mut().filter(|layer| layer.scales_with_aod);
        scaled.for_each(change);
    }
}

/// Optics of one kind of particle at every wavelength of a grid.
///
/// # Errors
/// [`Error::OutOfRange`] for a wavelength above the table of refractive indices.
pub fn component_optics(
    particle: &Particle,
    wavelength: &WavelengthGrid,
    angles: &AngleGrid,
) -> Result<ComponentOptics> {
    let mut optics = Vec::with_capacity(wavelength.len());
    let mut extrapolated = false;
    let computed: Vec<Result<(ParticleOptics, bool)>> = wavelength
        .nm()
        .par_iter()
        .map(|&wavelength_nm| {
            let at = particle.index.at(wavelength_nm)?;
            let optics = particle_optics(&particle.size, at.n, at.k, wavelength_nm, angles)?;
            Ok((optics, at.extrapolated))
        })
        .collect();
    for result in computed {
        let (one, flagged) = result?;
        optics.push(one);
        extrapolated |= flagged;
    }
    Ok(ComponentOptics {
        id: particle.id.clone(),
        wavelength_nm: wavelength.nm().to_vec(),
        angles: angles.clone(),
        optics,
        extrapolated,
    })
}

/// Optics of one OPAC component (`waso`, `soot`, …) at a relative humidity \[%\], 0 to 99, per particle, from the
/// shipped tables.
///
/// Times 1e6 m⁻³ the cross sections are the coefficients \[m⁻¹\] at 1 cm⁻³.
///
/// # Errors
/// As [`opac::component`] and [`tables::lookup`].
pub fn component(
    id: &str,
    humidity_percent: f64,
    wavelength: &WavelengthGrid,
) -> Result<ComponentOptics> {
    let particle = opac::component(id, humidity_percent)?;
    let source = ParticleSource::Opac(id.to_owned());
    match tables::lookup(&source, humidity_percent, wavelength.nm())? {
        Some(optics) => Ok(ComponentOptics {
            id: particle.id,
            wavelength_nm: wavelength.nm().to_vec(),
            angles: AngleGrid::default(),
            optics,
            extrapolated: false,
        }),
        None => component_optics(&particle, wavelength, &AngleGrid::default()),
    }
}

/// Optics of an aerosol type, in the amounts of its definition (OPAC) or scaled to its default optical depth above
/// sea level (AIAA).
///
/// Known particles come from the shipped [`tables`], one's own from Mie theory on the spot. `humidity_percent` \[%\], 0 to
/// 99, is that of the lowest air; OPAC's upper layers keep their own.
///
/// # Errors
/// [`Error::OutOfRange`] for humidity, or a wavelength beyond the refractive indices.
pub fn aerosol_optics(
    aerosol: &AerosolType,
    humidity_percent: f64,
    wavelength: &WavelengthGrid,
) -> Result<AerosolOptics> {
    let angles = AngleGrid::default();
    assemble(aerosol, humidity_percent, wavelength, &angles, true)
}

/// [`aerosol_optics`] by Mie theory throughout, with matrices at chosen angles: slow, and what the tables are held against.
///
/// # Errors
/// As [`aerosol_optics`].
pub fn aerosol_optics_on(
    aerosol: &AerosolType,
    humidity_percent: f64,
    wavelength: &WavelengthGrid,
    angles: &AngleGrid,
) -> Result<AerosolOptics> {
    assemble(aerosol, humidity_percent, wavelength, angles, false)
}

fn assemble(
    aerosol: &AerosolType,
    humidity_percent: f64,
    wavelength: &WavelengthGrid,
    angles: &AngleGrid,
    tabulated: bool,
) -> Result<AerosolOptics> {
    check_range("humidity", humidity_percent, "%", 0.0..=99.0)?;
    // 550 nm rides along at the end, for scaling by optical depth.
    let mut nm = wavelength.nm().to_vec();
    nm.push(550.0);

    let kinds = kinds(aerosol, humidity_percent)?;
    let computed = kinds
        .par_iter()
        .map(|kind| {
            if let ParticleSource::Spectrum(spectrum) = &kind.source {
                return Ok((from_spectrum(spectrum, &nm, angles), false));
            }
            if tabulated {
                if let Some(optics) = tables::lookup(&kind.source, humidity_percent, &nm)? {
                    return Ok((optics, false));
                }
            }
            kind.by_mie(humidity_percent, &nm, angles)
        })
        .collect::<Result<Vec<(Vec<ParticleOptics>, bool)>>>()?;
    let extrapolated = computed.iter().any(|(_, flagged)| *flagged);

    let mut layers = Vec::new();
    for layer in &aerosol.layers {
        let mut parts = Vec::new();
        for component in &layer.components {
            if let Some(p) = kinds
                .iter()
                .position(|kind| kind.source == component.source)
            {
                parts.push((component.number_density, computed[p].0.as_slice()));
            }
        }
        layers.push(mix(layer, &parts, angles));
    }
    let mut optics = AerosolOptics {
        name: aerosol.name.clone(),
        wavelength_nm: wavelength.nm().to_vec(),
        angles: angles.clone(),
        layers,
        extrapolated,
    };
    if let Some(aod_550) = aerosol.default_aod_550 {
        optics.scale_to_aod_550(aod_550, 0.0)?;
    }
    Ok(optics)
}

/// Published extinction, albedo and asymmetry as the optics of a particle whose extinction cross section is 1 m² at 550 nm.
///
/// The phase function is Henyey & Greenstein's. How such particles polarise is not known: `F12 = F34 = 0`, and
/// `F33 = F11 cos θ`, which has the sign that spheres have forwards and backwards.
fn from_spectrum(spectrum: &Spectrum, nm: &[f64], angles: &AngleGrid) -> Vec<ParticleOptics> {
    let one = |&wavelength_nm: &f64| {
        let [xs_ext, ssa, g] = spectrum.at(wavelength_nm);
        let mu = angles.cos_theta();
        let phase = |c: &f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * c).powf(1.5);
        let f11: Vec<f64> = mu.iter().map(phase).collect();
        let mut matrix = ScatteringMatrix {
            f12: vec![0.0; mu.len()],
            f33: f11.iter().zip(mu).map(|(f, c)| f * c).collect(),
            f34: vec![0.0; mu.len()],
            f11,
        };
        matrix.scale(1.0 / angles.sphere_integral(&matrix.f11));
        ParticleOptics {
            xs_ext,
            xs_sca: ssa * xs_ext,
            asymmetry: g,
            matrix,
        }
    };
    nm.iter().map(one).collect()
}

/// One kind of particle of a type.
struct Kind {
    source: ParticleSource,
    /// Largest share of any layer's cross-sectional area \[1\].
    share: f64,
}

impl Kind {
    /// Optics at every wavelength, and whether an index was extrapolated.
    fn by_mie(
        &self,
        humidity_percent: f64,
        nm: &[f64],
        angles: &AngleGrid,
    ) -> Result<(Vec<ParticleOptics>, bool)> {
        let particle = self.source.particle(humidity_percent)?;
        let quadrature = Quadrature::for_share(self.share);
        let one = |&wavelength_nm: &f64| {
            let at = particle.index.at(wavelength_nm)?;
            let size = &particle.size;
            let optics =
                particle_optics_with(size, at.n, at.k, wavelength_nm, angles, &quadrature)?;
            Ok((optics, at.extrapolated))
        };
        let computed = nm.par_iter().map(one).collect::<Result<Vec<_>>>()?;
        let extrapolated = computed.iter().any(|(_, flagged)| *flagged);
        let optics = computed.into_iter().map(|(optics, _)| optics).collect();
        Ok((optics, extrapolated))
    }
}

/// The kinds of particles of all layers, each once.
///
/// # Errors
/// [`Error::OutOfRange`] for a negative number of particles, [`Error::Invalid`] for a layer without any.
fn kinds(aerosol: &AerosolType, humidity_percent: f64) -> Result<Vec<Kind>> {
    let mut kinds: Vec<Kind> = Vec::new();
    for layer in &aerosol.layers {
        let mut areas = Vec::new();
        for component in &layer.components {
            let number_density = component.number_density;
            check_range("number density", number_density, "m^-3", 0.0..=1e30)?;
            let area = match &component.source {
                ParticleSource::Spectrum(_) => number_density,
                source => {
                    let size = source.particle(humidity_percent)?.size;
                    number_density * size.mean_square_radius_um2()
                }
            };
            areas.push((&component.source, area));
        }
        let total: f64 = areas.iter().map(|(_, area)| area).sum();
        if total <= 0.0 {
            return Err(Error::invalid(
                format!(
                    "layer '{}' of aerosol '{}' is empty",
                    layer.name, aerosol.name
                ),
                "give one of its components a positive number density, or leave the layer out",
            ));
        }
        for (source, area) in areas {
            let share = area / total;
            match kinds.iter_mut().find(|kind| kind.source == *source) {
                Some(kind) => kind.share = kind.share.max(share),
                None => kinds.push(Kind {
                    source: source.clone(),
                    share,
                }),
            }
        }
    }
    Ok(kinds)
}

/// The mixture of a layer: number-weighted cross sections, scattering-weighted phase functions.
///
/// `parts` holds, per component, its number density and its optics at every wavelength, 550 nm last.
fn mix(
    layer: &AerosolLayer,
    parts: &[(f64, &[ParticleOptics])],
    angles: &AngleGrid,
) -> LayerOptics {
    let total: f64 = parts.iter().map(|(number, _)| number).sum();
    let wavelengths = parts.first().map_or(0, |(_, optics)| optics.len());
    let mut out = LayerOptics {
        name: layer.name.clone(),
        profile: layer.profile.clone(),
        number_density_ref: total,
        scale: 1.0,
        scales_with_aod: layer.scales_with_aod,
        xs_ext: Vec::new(),
        xs_sca: Vec::new(),
        asymmetry: Vec::new(),
        matrix: Vec::new(),
        xs_ext_550: 0.0,
    };
    for w in 0..wavelengths {
        let (mut ext, mut sca, mut sca_asymmetry) = (0.0, 0.0, 0.0);
        let mut matrix = ScatteringMatrix::zero(angles.theta_deg().len());
        for (number, optics) in parts {
            let one = &optics[w];
            let share = number / total;
            ext += share * one.xs_ext;
            sca += share * one.xs_sca;
            sca_asymmetry += share * one.xs_sca * one.asymmetry;
            matrix.add(&one.matrix, share * one.xs_sca);
        }
        matrix.scale(1.0 / sca);
        out.xs_ext.push(ext);
        out.xs_sca.push(sca);
        out.asymmetry.push(sca_asymmetry / sca);
        out.matrix.push(matrix);
    }
    // The last wavelength was 550 nm, wanted for scaling only.
    out.xs_ext_550 = out.xs_ext.pop().unwrap_or(0.0);
    out.xs_sca.pop();
    out.asymmetry.pop();
    out.matrix.pop();
    out
}
