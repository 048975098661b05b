//! The medium that multiple scattering sees: forward peaks cut off, as few wavelengths as will do.
//!
//! The δ-M method (Wiscombe 1977, doi:10.1175/1520-0469(1977)034<1408:TDMRYA>2.0.CO;2) counts a share `f = g_(L+1)` of each
//! species' scattering as not scattered at all: its phase function then has only L degrees, and all optical depths shrink.

use std::f64::consts::FRAC_1_SQRT_2;

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
    /// Truncates a medium to several degrees, each at a choice of wavelengths. The columns of all, and those of the medium
    /// itself, share one table.
    pub fn several<const N: usize>(
        original: &LayeredMedium,
        wanted: [(usize, Vec<usize>); N],
    ) -> ([Self; N], Columns) {
        let truncated = wanted.map(|(degree, chosen)| Truncated::new(original, degree, chosen));
        let mut media: Vec<&LayeredMedium> = truncated.iter().map(|t| &t.medium).collect();
        media.push(original);
        let mut columns = Columns::of_several(&media).into_iter();
        let mut next = || columns.next().unwrap_or_else(|| Columns::new(original));
        let all = truncated.map(|t| Self {
            columns: next(),
            medium: t.medium,
            chosen: t.chosen,
            degree: t.degree,
            coefficients: t.coefficients,
            interval_degree: t.interval_degree,
        });
        (all, next())
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
    /// Near the planet's edge the disc is taken in three strips, each with its own grazing ray and its share above the
    /// edge: over the disc's half degree, such rays pass kilometres apart, through haze or over it. Returns `false` in full
    /// shadow.
    #[inline(always)]
    pub fn sun_transmittance(
        &self,
        sunlit: &mut Sunlit,
        radius_m: f64,
        mu_sun: f64,
        out: &mut [f32],
    ) -> bool {
        /// Height above the edge from which the disc counts as a point \[rad\], and over which it grows to its size.
        const HIGH: f64 = 0.035;
        const GROWS: f64 = 0.015;
        /// Middles and half widths of the strips, in radii, and their shares: those of Gauss's rule for a disc.
        const STRIPS: [(f64, f64, f32); 3] = [
            (-FRAC_1_SQRT_2, 0.30, 0.25),
            (0.0, 0.404, 0.5),
            (FRAC_1_SQRT_2, 0.30, 0.25),
        ];
        let ground_m = self.medium.ground_radius_m();
        let ratio = (ground_m / radius_m).min(1.0);
        let mu_edge = -(1.0 - ratio * ratio).sqrt();
        if mu_sun > mu_edge + HIGH {
            self.beam(sunlit, radius_m, mu_sun, out);
            return true;
        }
        let edge = mu_edge.asin();
        let above = mu_sun.clamp(-1.0, 1.0).asin() - edge;
        let radius = sunlit.radius_rad * ((HIGH - above) / GROWS).clamp(0.0, 1.0);
        if radius <= 0.0 {
            if above < 0.0 {
                return false;
            }
            self.beam(sunlit, radius_m, mu_sun, out);
            return true;
        }
        if above <= -1.01 * radius {
            return false;
        }
        out.fill(0.0);
        let mut strip = std::mem::take(&mut sunlit.strip);
        for (middle, half, share) in STRIPS {
            let (middle, half) = (above + middle * radius, half * radius);
            let visible = ((middle + half) / (2.0 * half)).clamp(0.0, 1.0);
            if visible <= 0.0 {
                continue;
            }
            let middle = if visible < 1.0 {
                0.5 * (middle + half)
            } else {
                middle
            };
            let mu = (edge + middle).sin().max(mu_edge);
            self.beam(sunlit, radius_m, mu, &mut strip);
            let weight = share * visible as f32;
            for (o, &t) in out.iter_mut().zip(&strip) {
                *o += weight * t;
            }
        }
        sunlit.strip = strip;
        true
    }

    /// Transmittance along one ray that does not meet the ground.
    #[inline(always)]
    fn beam(&self, sunlit: &mut Sunlit, radius_m: f64, mu: f64, out: &mut [f32]) {
        sunlit.columns(&self.columns, self.medium.ground_radius_m(), radius_m, mu);
        self.columns.optical_depth(&sunlit.columns, &mut sunlit.tau);
        lanes::exp_neg(&sunlit.tau, out);
    }
}

/// A [`Scaled`] without its columns.
struct Truncated {
    medium: LayeredMedium,
    chosen: Vec<usize>,
    degree: usize,
    coefficients: Vec<f32>,
    interval_degree: Vec<usize>,
}

impl Truncated {
    /// Truncates a medium to a degree, at `chosen` wavelengths.
    fn new(original: &LayeredMedium, degree: usize, chosen: Vec<usize>) -> Self {
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
        Self {
            medium,
            chosen,
            degree,
            coefficients,
            interval_degree,
        }
    }
}

/// The way from a point to the sun.
#[derive(Debug, Clone, Default)]
pub struct Sunlit {
    /// Angular radius of the sun.
    pub radius_rad: f64,
    columns: Vec<f32>,
    scratch: Vec<f32>,
    tau: Vec<f32>,
    strip: Vec<f32>,
}

impl Sunlit {
    pub fn new(columns: &Columns, lanes: usize, radius_rad: f64) -> Self {
        Self {
            radius_rad,
            columns: vec![0.0; columns.count()],
            scratch: vec![0.0; columns.count()],
            tau: vec![0.0; lanes],
            strip: vec![0.0; lanes],
        }
    }

    /// Fills `columns` along a ray to space.
    #[inline(always)]
    fn columns(&mut self, columns: &Columns, ground_m: f64, radius_m: f64, mu: f64) {
        if mu >= 0.0 {
            columns.to_top(radius_m, mu, &mut self.columns);
            return;
        }
        let lowest = (radius_m * (1.0 - mu * mu).max(0.0).sqrt()).max(ground_m);
        columns.to_top(lowest, 0.0, &mut self.columns);
        columns.to_top(radius_m, -mu, &mut self.scratch);
        for (c, &s) in self.columns.iter_mut().zip(&self.scratch) {
            *c = 2.0 * *c - s;
        }
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
