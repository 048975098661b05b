//! An aerosol as the climate gives it: OPAC components in layers.

/// Components of OPAC, in the order in which the data set lists them.
pub(super) const COMPONENTS: [&str; 10] = [
    "waso", "inso", "soot", "ssam", "sscm", "minm", "miam", "micm", "mitr", "suso",
];

/// One component of a layer.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct MixtureComponent {
    /// OPAC component: `waso`, `soot`, ….
    pub id: &'static str,
    /// Particles per m³ at the layer's reference altitude.
    pub number_density: f64,
    /// Relative humidity of its own \[%\]; `None` is that of the lowest air.
    pub humidity_percent: Option<f64>,
}

/// Components that share a profile `exp(−(z − reference) / scale height)` between two altitudes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MixtureLayer {
    /// `continental`, `maritime`, `desert`, `transported mineral`, `free troposphere`, ….
    pub name: &'static str,
    /// Altitude above sea level at which number densities are given \[m\].
    pub reference_m: f64,
    /// Lower edge above sea level \[m\].
    pub bottom_m: f64,
    /// Upper edge above sea level \[m\].
    pub top_m: f64,
    /// Scale height \[m\]; `None` is constant.
    pub scale_height_m: Option<f64>,
    /// What it is made of.
    pub components: Vec<MixtureComponent>,
}

impl MixtureLayer {
    /// `∫ profile dz` \[m\] from an altitude upwards.
    pub fn column_above(&self, altitude_m: f64) -> f64 {
        let from = altitude_m.max(self.bottom_m);
        if from >= self.top_m {
            return 0.0;
        }
        match self.scale_height_m {
            None => self.top_m - from,
            Some(height) => {
                let at = |z: f64| (-(z - self.reference_m) / height).exp();
                height * (at(from) - at(self.top_m))
            }
        }
    }
}

/// The aerosol of a place and a season, up to the tropopause: the optical depth sets its amount.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct AerosolMixture {
    /// Layers from the ground up; they may overlap.
    pub layers: Vec<MixtureLayer>,
    /// Relative humidity of the lowest air \[%\].
    pub humidity_percent: f64,
    /// The AIAA type that is most like it, by name.
    pub nearest_type: &'static str,
    /// Share of mineral dust, sea salt, soot, and all else in the optical depth at 550 nm \[1\].
    pub share: [f64; 4],
    /// Share of the mixing layer that is of cities \[1\].
    pub urban: f64,
}
