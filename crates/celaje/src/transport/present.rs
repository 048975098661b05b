//! The species that scatter at a vertex of a path, and the peak of those that have one.

use std::f64::consts::PI;

use crate::math::lanes::{self, each, Block, BLOCK};
use crate::medium::{LayeredMedium, Medium};
use crate::optics::Phase;

/// Value of a phase function forwards above which it has a peak to speak of \[sr⁻¹\]; an isotropic one has 0.08, Henyey and
/// Greenstein's of g = 0.7 has 1.5, haze some tens.
const PEAK: f64 = 0.5;

/// The species that scatter at a vertex.
pub(super) struct Present<'a> {
    pub species: &'a [usize],
    /// What each scatters, summed over wavelengths; others count as absent.
    pub split_sum: &'a [f32],
}

impl Present<'_> {
    #[inline(always)]
    fn all(&self) -> impl Iterator<Item = usize> + '_ {
        self.species
            .iter()
            .copied()
            .filter(|&k| self.split_sum[k] > 0.0)
    }

    /// `Σ_k split_k p_k` of block `b`; rows of `n` values.
    #[inline(always)]
    pub fn mix(&self, split: &[f32], phase: &[f32], n: usize, b: usize) -> Block {
        let mut sum = [0.0; BLOCK];
        for k in self.all() {
            let at = k * n + b * BLOCK;
            let (split, p) = (*lanes::block(split, at), *lanes::block(phase, at));
            sum = each(|i| sum[i] + split[i] * p[i]);
        }
        sum
    }

    /// Their phase functions at an angle, each into its own row.
    #[inline(always)]
    pub fn evaluate(&self, phases: &[Phase], cos_theta: f64, rows: &mut [f32]) {
        for k in self.all() {
            let n = phases[k].lanes();
            phases[k].eval(cos_theta, &mut rows[k * n..(k + 1) * n]);
        }
    }
}

/// Where the light of haze about the sun comes from: the mean phase function of the species that have a peak, over their columns
/// and all wavelengths; one for all of them, as what counts is that no peak is missed, however narrow.
pub(super) struct Peak {
    phase: Phase,
    /// Its density at the nodes, which lie evenly in sin θ/2 \[sr⁻¹\].
    density: Vec<f64>,
    /// Those species, and how much of what the air scatters they scatter.
    pub species: Vec<usize>,
    share: f64,
}

impl Peak {
    /// `None` if nothing has a peak.
    pub fn new(medium: &LayeredMedium) -> Option<Self> {
        let lanes = medium.wavelength_nm().len();
        let theta_deg: Vec<f64> = cosines().map(|c| c.acos().to_degrees()).collect();
        let mut mean = vec![0.0; theta_deg.len()];
        let (mut all, mut peaked, mut species) = (0.0, 0.0, Vec::new());
        for (k, phase) in medium.phases().iter().enumerate() {
            let has_peak = phase.eval_at(lanes / 2, 1.0) > PEAK;
            if has_peak {
                species.push(k);
            }
            for lane in 0..lanes {
                let column = scattering_column(medium, k, lane);
                all += column;
                if has_peak {
                    peaked += column;
                    for (mean, theta) in mean.iter_mut().zip(&theta_deg) {
                        *mean += column * phase.eval_at(lane, theta.to_radians().cos());
                    }
                }
            }
        }
        let cells = theta_deg.windows(2).zip(mean.windows(2));
        let integral: f64 = cells
            .map(|(t, p)| PI * (p[0] + p[1]) * (t[0].to_radians().cos() - t[1].to_radians().cos()))
            .sum();
        let normalised: Vec<f64> = mean.iter().map(|p| p / integral).collect();
        let phase = Phase::table(&theta_deg, &normalised).ok()?;
        let density = cosines().map(|c| phase.eval_at(0, c)).collect();
        let share = peaked / all;
        Some(Self {
            phase,
            density,
            species,
            share,
        })
    }

    /// Draws the cosine of the angle to the sun.
    #[inline(always)]
    pub fn sample(&self, u: f64) -> f64 {
        self.phase.sample(0, u)
    }

    /// Its density \[sr⁻¹\]: that of the phase function, found without a search.
    #[inline(always)]
    pub fn density(&self, cos_sun: f64) -> f64 {
        let x2 = (0.5 - 0.5 * cos_sun).clamp(0.0, 1.0) * (STEPS * STEPS) as f64;
        let i = (x2.sqrt() as usize).min(STEPS - 1);
        // Linear in the cosine, so in x²: from i² to (i + 1)².
        let t = (x2 - (i * i) as f64) / (2 * i + 1) as f64;
        self.density[i] + t * (self.density[i + 1] - self.density[i])
    }

    /// How much more sunlight than from other directions a vertex sends against one of this density \[1\].
    #[inline(always)]
    pub fn gain(&self, density: f64) -> f32 {
        (1.0 + self.share * 4.0 * PI * density) as f32
    }
}

/// Steps of a peak's table: 0.1° next to the sun.
const STEPS: usize = 1024;

/// Cosines of its angles, evenly in sin θ/2.
fn cosines() -> impl Iterator<Item = f64> {
    (0..=STEPS).map(|i| 1.0 - 2.0 * (i as f64 / STEPS as f64).powi(2))
}

/// Vertical optical depth of what a species scatters.
fn scattering_column(medium: &LayeredMedium, species: usize, lane: usize) -> f64 {
    let nodes = medium.node_radii_m().windows(2).enumerate();
    let shells = nodes.map(|(i, r)| {
        let (below, above) = (
            medium.species_row(species, i),
            medium.species_row(species, i + 1),
        );
        0.5 * f64::from(below[lane] + above[lane]) * (r[1] - r[0])
    });
    shells.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    /// Rationale: a path drawn about the sun is divided by this density, so it must be that of the draw. Expected: it is the phase
    /// function's own wherever one looks, next to the sun above all, and Henyey and Greenstein's is met within a thousandth.
    #[test]
    fn the_density_is_that_of_the_draw() {
        let (g, altitude_m) = (0.9, [0.0, 1000.0, 10_000.0]);
        let mut medium = LayeredMedium::new(&altitude_m, &[550.0], 6_360_000.0).unwrap();
        let phase = Phase::henyey_greenstein(&[g]).unwrap();
        medium.add(&[1e-4, 1e-5, 0.0], &[0.0; 3], phase).unwrap();
        let peak = Peak::new(&medium).unwrap();
        let mut rng = Rng::new(5, 1);
        for _ in 0..10_000 {
            let cos_theta = peak.sample(rng.uniform());
            let (found, own) = (peak.density(cos_theta), peak.phase.eval_at(0, cos_theta));
            assert!(
                (found / own - 1.0).abs() < 1e-4,
                "{cos_theta}: {found}, {own}"
            );
            let exact = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5));
            assert!(
                (found / exact - 1.0).abs() < 1e-3,
                "{cos_theta}: {found}, {exact}"
            );
        }
        for cos_theta in [-1.0, 1.0] {
            let (found, own) = (peak.density(cos_theta), peak.phase.eval_at(0, cos_theta));
            assert!(
                (found / own - 1.0).abs() < 1e-6,
                "{cos_theta}: {found}, {own}"
            );
        }
    }
}
