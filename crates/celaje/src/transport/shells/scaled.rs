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
    /// Degree of the expansion of polarised light, at least 2; 0 where light is a scalar.
    pub polarised_degree: usize,
    /// `Σ_k σ_s,k (2l + 1)/(4π)` times the moments b, e, h of `Phase::polarising_moments`, truncated [m⁻¹ sr⁻¹], shape (node, l from
    /// 2, 3, lanes).
    polarising: Vec<f32>,
    /// Largest degree of it present in the interval above each node.
    interval_polarised: Vec<usize>,
}

impl Scaled {
    /// Truncates a medium to several degrees, each at a choice of wavelengths. The columns of all, and those of the medium
    /// itself, share one table.
    pub fn several<const N: usize>(
        original: &LayeredMedium,
        wanted: [Wanted; N],
    ) -> ([Self; N], Columns) {
        let truncated = wanted.map(|wanted| Truncated::new(original, wanted));
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
            polarised_degree: t.polarised_degree,
            polarising: t.polarising,
            interval_polarised: t.interval_polarised,
        });
        (all, next())
    }

    /// Stokes components that are solved for.
    pub fn components(&self) -> usize {
        components(self.polarised_degree)
    }

    /// How what is at a radius polarises: shape (l from 2, 3, lanes), see [`Scaled`]; returns the largest degree that matters there.
    /// Only of polarised light.
    #[inline(always)]
    pub fn polarising_at(&self, radius_m: f64, out: &mut [f32]) -> usize {
        let (node, f) = self.medium.locate_radius(radius_m);
        let degree = self.interval_polarised[node];
        let rows = self.polarising_length();
        let used = (degree - 1) * 3 * self.medium.lanes();
        let below = &self.polarising[node * rows..node * rows + used];
        let above = &self.polarising[(node + 1) * rows..(node + 1) * rows + used];
        lanes::lerp(below, above, f, &mut out[..used]);
        degree
    }

    /// Length of what [`Scaled::polarising_at`] fills.
    pub fn polarising_length(&self) -> usize {
        self.polarised_degree.saturating_sub(1) * 3 * self.medium.lanes()
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

/// What a medium is truncated to.
pub struct Wanted {
    /// Degree of the phase functions.
    pub degree: usize,
    /// Degree of what polarises; 0 for scalar light.
    pub polarised_degree: usize,
    /// Which wavelengths, in order.
    pub chosen: Vec<usize>,
}

/// Stokes components of light polarised up to a degree: 1 or 3, for air and spheres make hardly any of the fourth.
pub const fn components(polarised_degree: usize) -> usize {
    if polarised_degree < 2 {
        1
    } else {
        3
    }
}

/// A [`Scaled`] without its columns.
struct Truncated {
    medium: LayeredMedium,
    chosen: Vec<usize>,
    degree: usize,
    coefficients: Vec<f32>,
    interval_degree: Vec<usize>,
    polarised_degree: usize,
    polarising: Vec<f32>,
    interval_polarised: Vec<usize>,
}

impl Truncated {
    /// Truncates a medium to a degree, at `chosen` wavelengths.
    fn new(original: &LayeredMedium, wanted: Wanted) -> Self {
        let Wanted {
            degree,
            polarised_degree,
            chosen,
        } = wanted;
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
        let polarising = polarising(original, polarised_degree, &chosen, &cut);
        // Of rows at a node, the last that matters: shape (node, l, parts, lanes).
        let reference = |node: usize| lanes::sum(&coefficients[node * rows * lanes..][..lanes]);
        let last = |all: &[f32], node: usize, degrees: usize, parts: usize| -> Option<usize> {
            let length = parts * lanes;
            let row = |l: usize| &all[(node * degrees + l) * length..][..length];
            let matters =
                |&l: &usize| row(l).iter().map(|v| v.abs()).sum::<f32>() > 1e-3 * reference(node);
            (0..degrees).rev().find(matters)
        };
        let over_intervals = |of_node: &dyn Fn(usize) -> usize| -> Vec<usize> {
            let ends = |i: usize| [i, (i + 1).min(nodes - 1)].map(of_node);
            (0..nodes).map(|i| ends(i)[0].max(ends(i)[1])).collect()
        };
        let mut interval_degree =
            over_intervals(&|node| last(&coefficients, node, rows, 1).unwrap_or(0));
        let mut interval_polarised = Vec::new();
        if polarised_degree > 0 {
            let degrees = polarised_degree - 1;
            interval_polarised =
                over_intervals(&|node| 2 + last(&polarising, node, degrees, 3).unwrap_or(0));
            for (all, &polarised) in interval_degree.iter_mut().zip(&interval_polarised) {
                *all = polarised.max(*all);
            }
        }
        Self {
            medium,
            chosen,
            degree,
            coefficients,
            interval_degree,
            polarised_degree,
            polarising,
            interval_polarised,
        }
    }
}

/// The coefficients of [`Scaled::polarising_at`] at every node. What is cut off as not scattered keeps its polarisation, and is taken
/// off e and h as it is off g.
fn polarising(
    original: &LayeredMedium,
    degree: usize,
    chosen: &[usize],
    cut: &impl Fn(usize, usize) -> f64,
) -> Vec<f32> {
    if degree < 2 {
        return Vec::new();
    }
    let lanes = lanes::padded(chosen.len());
    let nodes = original.node_radii_m().len();
    let mut all = vec![0.0; nodes * (degree - 1) * 3 * lanes];
    for (k, phase) in original.phases().iter().enumerate() {
        let moments = phase.polarising_moments(chosen, degree);
        for node in 0..nodes {
            let sigma_s = original.species_row(k, node);
            for (j, &lane) in chosen.iter().enumerate() {
                let (f, sigma_s) = (cut(k, j), f64::from(sigma_s[lane]));
                for (i, [b, e, h]) in moments[j].iter().enumerate() {
                    let norm = (2.0 * i as f64 + 5.0) / (4.0 * std::f64::consts::PI) * sigma_s;
                    for (c, moment) in [*b, e - f, h - f].into_iter().enumerate() {
                        let row = (node * (degree - 1) + i) * 3 + c;
                        all[row * lanes + j] += (norm * moment) as f32;
                    }
                }
            }
        }
    }
    all
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
