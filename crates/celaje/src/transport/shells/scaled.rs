//! The medium that multiple scattering sees: forward peaks cut off, as few wavelengths as will do.
//!
//! The δ-M method (Wiscombe 1977, doi:10.1175/1520-0469(1977)034<1408:TDMRYA>2.0.CO;2) counts a share `f = g_(L+1)` of each
//! species' scattering as not scattered at all: its phase function then has only L degrees, and all optical depths shrink.

use crate::math::lanes;
use crate::medium::{Columns, LayeredMedium, Medium};

/// A medium with truncated phase functions, at a choice of wavelengths.
#[derive(Debug, Clone)]
pub struct Scaled {
    pub medium: LayeredMedium,
    pub columns: Columns,
    /// Which wavelengths of the original, in order.
    pub chosen: Vec<usize>,
    /// Degree of the expansion.
    pub degree: usize,
    /// `Σ_k σ_s,k (2l + 1)/(4π) g_k,l`, truncated [m⁻¹ sr⁻¹], shape (node, degree + 1, lanes).
    coefficients: Vec<f32>,
    /// Largest degree present in the interval above each node.
    interval_degree: Vec<usize>,
}

impl Scaled {
    /// Truncates a medium to a degree, at `chosen` wavelengths.
    pub fn new(original: &LayeredMedium, degree: usize, chosen: Vec<usize>) -> Self {
        let rows = degree + 1;
        // Legendre moments of every species, and what is cut off.
        let moments: Vec<Vec<Vec<f64>>> = original
            .phases()
            .iter()
            .map(|p| {
                chosen
                    .iter()
                    .map(|&lane| p.legendre_moments(lane, degree + 1))
                    .collect()
            })
            .collect();
        let cut = |k: usize, j: usize| moments[k][j][degree + 1].max(0.0);
        let medium = original.truncated(&chosen, &cut);
        let lanes = medium.lanes();
        let nodes = original.node_radii_m().len();
        let mut coefficients = vec![0.0; nodes * rows * lanes];
        for node in 0..nodes {
            for (k, species) in moments.iter().enumerate() {
                for (j, &lane) in chosen.iter().enumerate() {
                    let sigma_s = f64::from(original.species_row(k, node)[lane]);
                    for (l, g_l) in species[j].iter().enumerate().take(rows) {
                        // σ' g' = σ (1 − f) (g − f)/(1 − f).
                        let g = sigma_s * (g_l - cut(k, j));
                        let at = (node * rows + l) * lanes + j;
                        coefficients[at] +=
                            ((2.0 * l as f64 + 1.0) / (4.0 * std::f64::consts::PI) * g) as f32;
                    }
                }
            }
        }
        let node_degree: Vec<usize> = (0..nodes)
            .map(|node| {
                let row = |l: usize| &coefficients[(node * rows + l) * lanes..][..lanes];
                let reference = lanes::sum(row(0));
                (0..rows)
                    .rev()
                    .find(|&l| row(l).iter().map(|v| v.abs()).sum::<f32>() > 1e-3 * reference)
                    .unwrap_or(0)
            })
            .collect();
        let interval_degree = (0..nodes)
            .map(|i| node_degree[i].max(node_degree[(i + 1).min(nodes - 1)]))
            .collect();
        let columns = Columns::new(&medium);
        Self {
            medium,
            columns,
            chosen,
            degree,
            coefficients,
            interval_degree,
        }
    }

    /// Coefficients at a radius, shape (degree + 1, lanes); returns the largest degree that matters there.
    #[inline(always)]
    pub fn coefficients_at(&self, radius_m: f64, out: &mut [f32]) -> usize {
        let (node, f) = self.medium.locate_radius(radius_m);
        let degree = self.interval_degree[node];
        let n = self.medium.lanes();
        let (rows, used) = ((self.degree + 1) * n, (degree + 1) * n);
        let below = &self.coefficients[node * rows..node * rows + used];
        let above = &self.coefficients[(node + 1) * rows..(node + 1) * rows + used];
        lanes::lerp(below, above, f, &mut out[..used]);
        degree
    }

    /// Transmittance from a radius to the sun, one row, for a sun of some angular radius.
    ///
    /// Where the planet covers part of the disc, the rest shines; its transmittance is that of the grazing ray. Returns
    /// `false` in full shadow.
    #[inline(always)]
    pub fn sun_transmittance(
        &self,
        sunlit: &mut Sunlit,
        radius_m: f64,
        mu_sun: f64,
        out: &mut [f32],
    ) -> bool {
        if !sunlit.columns(
            &self.columns,
            self.medium.ground_radius_m(),
            radius_m,
            mu_sun,
        ) {
            return false;
        }
        self.columns.optical_depth(&sunlit.columns, &mut sunlit.tau);
        lanes::exp_neg(&sunlit.tau, out);
        if sunlit.visible < 1.0 {
            lanes::scale(out, sunlit.visible);
        }
        true
    }
}

/// The way from a point to the sun.
#[derive(Debug, Clone, Default)]
pub struct Sunlit {
    /// Angular radius of the sun.
    pub radius_rad: f64,
    /// Share of the disc above the planet's edge.
    pub visible: f32,
    pub columns: Vec<f32>,
    scratch: Vec<f32>,
    tau: Vec<f32>,
}

impl Sunlit {
    pub fn new(columns: &Columns, lanes: usize, radius_rad: f64) -> Self {
        Self {
            radius_rad,
            visible: 1.0,
            columns: vec![0.0; columns.count()],
            scratch: vec![0.0; columns.count()],
            tau: vec![0.0; lanes],
        }
    }

    /// Fills `columns` towards the sun and `visible`; `false` in full shadow.
    #[inline(always)]
    pub fn columns(
        &mut self,
        columns: &Columns,
        ground_m: f64,
        radius_m: f64,
        mu_sun: f64,
    ) -> bool {
        self.visible = 1.0;
        let ratio = (ground_m / radius_m).min(1.0);
        let mu_horizon = -(1.0 - ratio * ratio).sqrt();
        let mut mu = mu_sun;
        // Within a few radii of the edge, the angle above it.
        let near = 2.0 * self.radius_rad + 1e-6;
        if mu_sun < mu_horizon + near {
            let above = mu_sun.clamp(-1.0, 1.0).asin() - mu_horizon.asin();
            if above <= -self.radius_rad {
                return false;
            }
            if above < self.radius_rad {
                // Area of the disc above a chord at `above` below its middle.
                let x = (above / self.radius_rad).clamp(-1.0, 1.0);
                let covered = (x.acos() - x * (1.0 - x * x).sqrt()) / std::f64::consts::PI;
                self.visible = (1.0 - covered) as f32;
                // The middle of the visible part, for its transmittance.
                let raised = mu_horizon.asin() + 0.5 * (above + self.radius_rad);
                mu = raised.sin().max(mu_horizon);
            }
        }
        if mu >= 0.0 {
            columns.to_top(radius_m, mu, &mut self.columns);
            return true;
        }
        let lowest = (radius_m * (1.0 - mu * mu).max(0.0).sqrt()).max(ground_m);
        columns.to_top(lowest, 0.0, &mut self.columns);
        columns.to_top(radius_m, -mu, &mut self.scratch);
        for (c, &s) in self.columns.iter_mut().zip(&self.scratch) {
            *c = 2.0 * *c - s;
        }
        true
    }
}

/// `cos φ` from the sun's azimuth, of a direction with zenith cosine `mu` at an angle to the sun with cosine `cos_theta`.
#[inline(always)]
pub fn cos_azimuth(mu: f64, mu_sun: f64, cos_theta: f64) -> f64 {
    let product = (1.0 - mu * mu).max(0.0) * (1.0 - mu_sun * mu_sun).max(0.0);
    if product < 1e-12 {
        return 1.0;
    }
    ((cos_theta - mu * mu_sun) / product.sqrt()).clamp(-1.0, 1.0)
}
