//! A rough idea of where light comes from, for guiding paths in twilight.
//!
//! Once the sun is low, nearly all of the light comes from a small part of the air that a path would rarely find by itself. This
//! solves the same transfer coarsely (isotropic scattering but for haze in sunlight, a few wavelengths, few directions, successive
//! orders on a grid of height and sun angle) for two things: how much light is scattered at a place, and from where it arrives. Both only
//! steer random choices, whose densities are divided out: an error here costs noise, never truth.

use rayon::prelude::*;

use super::first_order::columns_to_sun;
use super::horizon::{middle_azimuth, Horizon, AZIMUTHS, BINS, ELEVATIONS};
use super::present::Peak;
use super::scene::{Scene, SunLight};
use crate::math::lanes::{each, Block, BLOCK};
use crate::math::Vec3;
use crate::medium::{Columns, LayeredMedium, Medium};

/// Wavelengths that stand for all.
pub(super) const BANDS: usize = 4;

/// A value per band.
pub(super) type Bands = [f32; BANDS];

/// Nodes over height, denser towards the ground: `h = top · x²`.
const HEIGHTS: usize = 28;

/// Nodes over the cosine μ of the sun's zenith angle, dense about the terminator: `x ∝ μ / (BEND + |μ|)`.
const SUNS: usize = 64;
const BEND: f32 = 0.15;

/// How sharply haze scatters forwards, see [`forward`]. The mean cosine of 0.84 is more than a haze's own: it has to tell bins apart
/// that lie side by side. Of 1.03 to 1.3 the best measured.
const SHARPNESS: f32 = 1.06;

/// Steps of a ray, and successive orders.
const STEPS: usize = 20;
const ORDERS: usize = 5;

/// Least share of a bin in its node's mean, so that no direction is lost.
const LEAST: f32 = 0.02;

/// The coarse solution.
pub(super) struct Guide {
    ground_m: f64,
    inverse_top: f32,
    /// Coefficients at the heights \[m⁻¹\].
    sigma_t: Vec<Bands>,
    sigma_s: Vec<Bands>,
    /// Share of what is scattered at the heights that haze with a peak scatters.
    peaked: Vec<Bands>,
    /// Elevations at the heights.
    horizons: Vec<Horizon>,
    /// Cosine and sine of the azimuth from the sun's in the middle of each bin, left of the sun and right of it.
    cos_azimuth: Block,
    sin_azimuth: Block,
    /// Mean over all directions of the sunlight alone, and of all later light, shape (height, sun).
    sun: Vec<Bands>,
    diffuse: Vec<Bands>,
    /// What the ground reflects: albedo · irradiance / π, shape (sun,).
    ground: Vec<Bands>,
    /// Power that arrives in each bin, shape (height, sun, band, bin).
    arriving: Vec<f32>,
    pub albedo: Bands,
    /// Irradiance of the sun above the air.
    irradiance: Bands,
    /// First lane of each band, and the end.
    pub lanes: [usize; BANDS + 1],
}

/// A ray from a node: everything but the sun.
struct Chord {
    steps: [Step; STEPS],
    length_m: f64,
    /// What comes through from the ground, if it is met.
    ground: Option<Bands>,
}

/// Light that is scattered at a node: the same in all directions, and as [`forward`] has it.
#[derive(Clone, Copy)]
struct Lit {
    evenly: Bands,
    forwards: Bands,
}

/// A step of a chord.
struct Step {
    distance_m: f64,
    inverse_radius: f64,
    /// Node over height below and the fraction to the next.
    height: usize,
    fraction: f32,
    /// Share of the light here that is scattered into the ray and arrives.
    weight: Bands,
}

/// Four nodes of a grid and their weights.
#[derive(Clone, Copy)]
pub(super) struct Place {
    at: [usize; 4],
    weight: [f32; 4],
    /// Height and fraction, for the coefficients.
    height: usize,
    fraction: f32,
}

impl Place {
    /// The mean of what stands at the four nodes.
    #[inline(always)]
    fn mix(&self, rows: &[Bands]) -> Bands {
        let (w, at) = (self.weight, self.at);
        let (a, b, c, d) = (rows[at[0]], rows[at[1]], rows[at[2]], rows[at[3]]);
        bands(|i| w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i])
    }
}

/// What is known of a place: scattering and extinction coefficients \[m⁻¹\], haze's share of the former, and mean radiance of sunlight
/// and of later light.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub sigma_s: Bands,
    pub sigma_t: Bands,
    pub peaked: Bands,
    pub sun: Bands,
    pub diffuse: Bands,
}

#[inline(always)]
pub(super) fn bands(f: impl Fn(usize) -> f32) -> Bands {
    let mut out = [0.0; BANDS];
    for (b, v) in out.iter_mut().enumerate() {
        *v = f(b);
    }
    out
}

/// Node of the sun's grid for a cosine, not rounded.
#[inline(always)]
fn sun_index(mu: f32) -> f32 {
    let x = mu / (BEND + mu.abs()) * (1.0 + BEND);
    0.5 * (x + 1.0) * (SUNS - 1) as f32
}

/// Node below a cosine and the fraction to the next.
#[inline(always)]
fn sun_node(mu: f64) -> (usize, f32) {
    let y = sun_index(mu as f32).clamp(0.0, (SUNS - 1) as f32);
    let s = (y as usize).min(SUNS - 2);
    (s, y - s as f32)
}

#[inline(always)]
fn mix_two(a: Bands, b: Bands, fraction: f32) -> Bands {
    bands(|i| a[i] + fraction * (b[i] - a[i]))
}

/// A phase function with a peak forwards, times 4π: `(s² − 1) / (s − cos θ)²`, whose mean over the sphere is 1.
#[inline(always)]
fn forward(cosine: f32) -> f32 {
    let away = SHARPNESS - cosine;
    (SHARPNESS * SHARPNESS - 1.0) / (away * away)
}

/// The cosine at a node.
fn sun_cosine(node: usize) -> f64 {
    let x = (2.0 * node as f64 / (SUNS - 1) as f64 - 1.0) / (1.0 + f64::from(BEND));
    (f64::from(BEND) * x / (1.0 - x.abs())).clamp(-1.0, 1.0)
}

impl Guide {
    pub fn new(scene: &Scene<'_, LayeredMedium>, columns: &Columns, peak: Option<&Peak>) -> Self {
        let medium = scene.medium;
        let w = medium.wavelength_nm().len();
        let lanes: [usize; BANDS + 1] = std::array::from_fn(|b| b * w / BANDS);
        let middle: [usize; BANDS] = std::array::from_fn(|b| (lanes[b] + lanes[b + 1]) / 2);
        let middle = middle.map(|lane| lane.min(w - 1));
        let (ground_m, top_m) = (medium.ground_radius_m(), medium.top_radius_m());
        let at_height = |node: usize| {
            let x = node as f64 / (HEIGHTS - 1) as f64;
            ground_m + (top_m - ground_m) * x * x
        };
        let coefficients = |node: usize, pick: fn((f64, f64)) -> f64| {
            let at = Vec3::new(0.0, 0.0, at_height(node));
            bands(|b| pick(medium.coefficients_at(middle[b], at)) as f32)
        };
        let peaked = |node: usize| {
            let place = medium.locate_radius(at_height(node));
            let species = peak.map_or(&[][..], |peak| &peak.species);
            bands(|b| {
                let scattered = |k: &usize| scattered_by(medium, *k, place, middle[b]);
                let all: f32 = (0..medium.phases().len()).map(|k| scattered(&k)).sum();
                // Nothing is scattered where there is nothing: the tiny number only keeps 0 / 0 away.
                species.iter().map(scattered).sum::<f32>() / (all + 1e-30)
            })
        };
        let mut guide = Self {
            ground_m,
            inverse_top: (1.0 / (top_m - ground_m)) as f32,
            sigma_t: (0..HEIGHTS).map(|h| coefficients(h, |c| c.0)).collect(),
            sigma_s: (0..HEIGHTS).map(|h| coefficients(h, |c| c.1)).collect(),
            peaked: (0..HEIGHTS).map(peaked).collect(),
            horizons: (0..HEIGHTS)
                .map(|h| Horizon::new(at_height(h), ground_m))
                .collect(),
            cos_azimuth: each(|i| middle_azimuth(i).cos() as f32),
            sin_azimuth: each(|i| middle_azimuth(i).sin() as f32),
            sun: vec![[0.0; BANDS]; HEIGHTS * SUNS],
            diffuse: vec![[0.0; BANDS]; HEIGHTS * SUNS],
            ground: vec![[0.0; BANDS]; SUNS],
            arriving: vec![0.0; HEIGHTS * SUNS * BANDS * BINS],
            albedo: bands(|b| scene.albedo[middle[b]]),
            irradiance: bands(|b| scene.sun.irradiance[middle[b]]),
            lanes,
        };
        let irradiance = guide.irradiance;
        let mut direct = vec![[0.0; BANDS]; SUNS];
        let (mut out, mut scratch) = (vec![0.0; columns.count()], vec![0.0; columns.count()]);
        for node in 0..HEIGHTS * SUNS {
            let (h, s) = (node / SUNS, node % SUNS);
            let mu = sun_cosine(s);
            let sunward_m = at_height(h) * mu;
            if columns_to_sun(columns, at_height(h), sunward_m, &mut out, &mut scratch) {
                let light = bands(|b| {
                    let tau = columns.optical_depth_at(&out, middle[b]);
                    irradiance[b] * (-tau as f32).exp()
                });
                guide.sun[node] = bands(|b| light[b] / (4.0 * std::f32::consts::PI));
                if h == 0 {
                    direct[s] = bands(|b| light[b] * mu.max(0.0) as f32);
                }
            }
        }
        let shine = guide.albedo.map(|albedo| albedo / std::f32::consts::PI);
        guide.ground = direct.iter().map(|d| bands(|b| shine[b] * d[b])).collect();
        let chords: Vec<Chord> = (0..HEIGHTS * ELEVATIONS)
            .map(|i| {
                let (h, e) = (i / ELEVATIONS, i % ELEVATIONS);
                let sine = f64::from(guide.horizons[h].middle[e].0);
                guide.chord(guide.radius_at(h), sine)
            })
            .collect();
        for order in 0..ORDERS {
            guide.sweep(&chords, order == ORDERS - 1);
            // The ground: sunlight, and what the sky sends down.
            for (s, direct) in direct.iter().enumerate() {
                let sky = guide.downward(s);
                guide.ground[s] = bands(|b| shine[b] * (direct[b] + sky[b]));
            }
        }
        guide
    }

    /// One more order everywhere: what arrives from all directions, if the scattered light is what is known so far.
    fn sweep(&mut self, chords: &[Chord], last: bool) {
        let lit = self.lit();
        let this = &*self;
        let rows: Vec<(Bands, Vec<f32>)> = (0..HEIGHTS * SUNS)
            .into_par_iter()
            .map(|node| this.arrive_at(node, chords, &lit))
            .collect();
        for (node, (mean, arriving)) in rows.into_iter().enumerate() {
            self.diffuse[node] = mean;
            if last || node / SUNS == 0 {
                self.arriving[node * BANDS * BINS..(node + 1) * BANDS * BINS]
                    .copy_from_slice(&arriving);
            }
        }
        if last {
            for (i, bins) in self.arriving.chunks_exact_mut(BINS).enumerate() {
                let mean = bins.iter().sum::<f32>() / (4.0 * std::f32::consts::PI);
                let horizon = &self.horizons[i / (SUNS * BANDS)];
                for (bin, &omega) in bins.iter_mut().zip(&horizon.solid_angle) {
                    *bin = bin.max(LEAST * mean * omega);
                }
            }
        }
    }

    /// Mean radiance at a node, and power per bin.
    fn arrive_at(&self, node: usize, chords: &[Chord], lit: &[Lit]) -> (Bands, Vec<f32>) {
        let (h, mu_sun) = (node / SUNS, sun_cosine(node % SUNS));
        let sin_sun = (1.0 - mu_sun * mu_sun).max(0.0).sqrt();
        let horizon = &self.horizons[h];
        let from = self.radius_at(h) * mu_sun;
        let (mut mean, mut arriving) = ([0.0; BANDS], vec![0.0; BANDS * BINS]);
        for bin in 0..BINS {
            let (e, a) = (bin / AZIMUTHS, bin % AZIMUTHS);
            let mu = f64::from(horizon.middle[e].0);
            let cos_azimuth = f64::from(self.cos_azimuth[a]);
            let slope = mu * mu_sun + (1.0 - mu * mu).sqrt() * sin_sun * cos_azimuth;
            let light = self.along(&chords[h * ELEVATIONS + e], from, slope, lit);
            for b in 0..BANDS {
                let power = light[b] * horizon.solid_angle[bin];
                arriving[b * BINS + bin] = power;
                mean[b] += power / (4.0 * std::f32::consts::PI);
            }
        }
        (mean, arriving)
    }

    /// Radius of a node over height \[m\].
    fn radius_at(&self, height: usize) -> f64 {
        let x = height as f64 / (HEIGHTS - 1) as f64;
        self.ground_m + x * x / f64::from(self.inverse_top)
    }

    /// What a ray weighs its light by, wherever the sun stands.
    fn chord(&self, r: f64, mu: f64) -> Chord {
        let b = r * mu;
        let top = self.ground_m + 1.0 / f64::from(self.inverse_top);
        let to_ground = b * b - (r - self.ground_m) * (r + self.ground_m);
        let meets_ground = b < 0.0 && to_ground >= 0.0;
        let length = if meets_ground {
            (-b - to_ground.sqrt()).max(0.0)
        } else {
            -b + (b * b - (r - top) * (r + top)).max(0.0).sqrt()
        };
        let mut through = [1.0f32; BANDS];
        let mut before = 0.0;
        let steps = std::array::from_fn(|step| {
            let x = (step + 1) as f64 / STEPS as f64;
            let end = length * x * x;
            let (s, ds) = (0.5 * (before + end), (end - before) as f32);
            before = end;
            let radius = (r * r + s * (2.0 * b + s)).sqrt();
            let (height, fraction) = self.height(radius);
            let line = |rows: &[Bands]| mix_two(rows[height], rows[height + 1], fraction);
            let (sigma_t, sigma_s) = (line(&self.sigma_t), line(&self.sigma_s));
            let lost = bands(|b| -(-sigma_t[b] * ds).exp_m1());
            let weight = bands(|b| through[b] * lost[b] * sigma_s[b] / (sigma_t[b] + 1e-30));
            through = bands(|b| through[b] * (1.0 - lost[b]));
            Step {
                distance_m: s,
                inverse_radius: 1.0 / radius,
                height,
                fraction,
                weight,
            }
        });
        Chord {
            steps,
            length_m: length,
            ground: meets_ground.then_some(through),
        }
    }

    /// The light at all nodes.
    fn lit(&self) -> Vec<Lit> {
        let rows = self.sun.iter().zip(&self.diffuse).enumerate();
        let lit = rows.map(|(node, (sun, diffuse))| {
            let peaked = self.peaked[node / SUNS];
            Lit {
                evenly: bands(|b| sun[b] * (1.0 - peaked[b]) + diffuse[b]),
                forwards: bands(|b| sun[b] * peaked[b]),
            }
        });
        lit.collect()
    }

    /// Radiance along a chord; the scalar products of its start \[m\] and its direction with the sun's.
    fn along(&self, chord: &Chord, from: f64, slope: f64, lit: &[Lit]) -> Bands {
        let mut light = [0.0; BANDS];
        let peak = forward(slope as f32);
        let at = |node: usize| bands(|b| lit[node].evenly[b] + peak * lit[node].forwards[b]);
        for step in &chord.steps {
            let mu_sun = (from + slope * step.distance_m) * step.inverse_radius;
            let (s, g) = sun_node(mu_sun);
            let first = step.height * SUNS + s;
            let below = mix_two(at(first), at(first + 1), g);
            let above = mix_two(at(first + SUNS), at(first + SUNS + 1), g);
            let source = mix_two(below, above, step.fraction);
            light = bands(|b| light[b] + step.weight[b] * source[b]);
        }
        if let Some(through) = &chord.ground {
            let ground = self.ground_at((from + slope * chord.length_m) / self.ground_m);
            light = bands(|b| light[b] + through[b] * ground[b]);
        }
        light
    }

    /// Raises a guess of the radiance along a ray, one row, to what this solution has: in twilight most of the light has been
    /// scattered more than once, and of some colours nearly all.
    pub fn raise(&self, at: Vec3, direction: Vec3, sun: &SunLight, guess: &mut [f32]) {
        let lit = self.lit();
        let (r, towards) = (at.length(), sun.direction);
        let chord = self.chord(r, at.dot(direction) / r);
        let light = self.along(&chord, at.dot(towards), direction.dot(towards), &lit);
        for (b, (light, irradiance)) in light.iter().zip(self.irradiance).enumerate() {
            let share = light / irradiance;
            if share.is_finite() {
                let lanes = self.lanes[b]..self.lanes[b + 1];
                for (guess, sunlight) in guess[lanes.clone()].iter_mut().zip(&sun.irradiance[lanes])
                {
                    *guess = guess.max(share * sunlight);
                }
            }
        }
    }

    /// Diffuse irradiance of the ground under a node's sun.
    fn downward(&self, sun: usize) -> Bands {
        let rows = &self.arriving[sun * BANDS * BINS..(sun + 1) * BANDS * BINS];
        bands(|b| {
            (0..BINS)
                .map(|bin| {
                    rows[b * BINS + bin] * self.horizons[0].middle[bin / AZIMUTHS].0.max(0.0)
                })
                .sum()
        })
    }

    /// Finds a place on the grid.
    #[inline(always)]
    pub fn place(&self, radius_m: f64, mu_sun: f64) -> Place {
        let (h, f) = self.height(radius_m);
        let (s, g) = sun_node(mu_sun);
        let first = h * SUNS + s;
        Place {
            at: [first, first + 1, first + SUNS, first + SUNS + 1],
            weight: [(1.0 - f) * (1.0 - g), (1.0 - f) * g, f * (1.0 - g), f * g],
            height: h,
            fraction: f,
        }
    }

    /// What is known of a place.
    #[inline(always)]
    pub fn know(&self, place: Place) -> Known {
        let (h, f) = (place.height, place.fraction);
        Known {
            sigma_s: mix_two(self.sigma_s[h], self.sigma_s[h + 1], f),
            sigma_t: mix_two(self.sigma_t[h], self.sigma_t[h + 1], f),
            peaked: mix_two(self.peaked[h], self.peaked[h + 1], f),
            sun: place.mix(&self.sun),
            diffuse: place.mix(&self.diffuse),
        }
    }

    /// What the ground reflects under a sun.
    #[inline(always)]
    pub fn ground_at(&self, mu_sun: f64) -> Bands {
        let (s, g) = sun_node(mu_sun);
        mix_two(self.ground[s], self.ground[s + 1], g)
    }

    /// Node over height below a radius and the fraction to the next.
    #[inline(always)]
    fn height(&self, radius_m: f64) -> (usize, f32) {
        let share = ((radius_m - self.ground_m) as f32 * self.inverse_top).clamp(0.0, 1.0);
        let x = share.sqrt() * (HEIGHTS - 1) as f32;
        let h = (x as usize).min(HEIGHTS - 2);
        (h, x - h as f32)
    }

    /// One of the nodes about a place, drawn by `u`.
    #[inline(always)]
    pub fn node(&self, place: Place, mut u: f32) -> usize {
        for (&node, &w) in place.at.iter().zip(&place.weight) {
            u -= w;
            if u < 0.0 {
                return node;
            }
        }
        place.at[3]
    }

    /// The elevations at a node.
    #[inline(always)]
    pub fn horizon(&self, node: usize) -> &Horizon {
        &self.horizons[node / SUNS]
    }

    /// Power per bin of one side that arrives at a node and is scattered into the way a path came, one row per elevation. The path carries
    /// `evenly` and `forwards` in the bands, already multiplied by what of it air and haze scatter; its `direction` is given upwards, towards
    /// the sun and to the left.
    #[inline(always)]
    pub fn arriving(
        &self,
        node: usize,
        evenly: &Bands,
        forwards: &Bands,
        direction: [f32; 3],
    ) -> [Block; ELEVATIONS] {
        let rows = &self.arriving[node * BANDS * BINS..(node + 1) * BANDS * BINS];
        let (mut air, mut haze) = ([0.0f32; BINS], [0.0f32; BINS]);
        for (b, row) in rows.chunks_exact(BINS).enumerate() {
            for i in 0..BINS {
                air[i] += evenly[b] * row[i];
                haze[i] += forwards[b] * row[i];
            }
        }
        let horizon = self.horizon(node);
        let [up, sunward, left] = direction;
        let flat = each(|i| sunward * self.cos_azimuth[i] + left * self.sin_azimuth[i]);
        let mut out = [[0.0; BLOCK]; ELEVATIONS];
        let rows = air.chunks_exact(AZIMUTHS).zip(haze.chunks_exact(AZIMUTHS));
        for ((out, (air, haze)), &(sine, cosine)) in out.iter_mut().zip(rows).zip(&horizon.middle) {
            *out = each(|i| {
                let c = sine * up + cosine * flat[i];
                // Rayleigh's phase function, times 4π.
                let rayleigh = 0.75 + 0.75 * c * c;
                air[i % AZIMUTHS] * rayleigh + haze[i % AZIMUTHS] * forward(c)
            });
        }
        out
    }

    /// Radius of the ground \[m\].
    #[inline(always)]
    pub fn ground_m(&self) -> f64 {
        self.ground_m
    }
}

/// What a species scatters at a place between two nodes \[m⁻¹\].
fn scattered_by(
    medium: &LayeredMedium,
    species: usize,
    (below, fraction): (usize, f32),
    lane: usize,
) -> f32 {
    let at = |node: usize| medium.species_row(species, node)[lane];
    at(below) + fraction * (at(below + 1) - at(below))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: how much haze sends where is shared out, neither made nor lost. Expected: the mean over the sphere is 1.
    #[test]
    fn haze_scatters_as_much_as_it_takes() {
        let n = 100_000;
        let cosine = |i: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
        let mean = (0..n)
            .map(|i| f64::from(forward(cosine(i) as f32)))
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }

    #[test]
    fn the_grid_of_suns_runs_through_its_nodes() {
        for node in 0..SUNS {
            let index = sun_index(sun_cosine(node) as f32);
            assert!((index - node as f32).abs() < 1e-3, "{node}: {index}");
        }
    }
}
