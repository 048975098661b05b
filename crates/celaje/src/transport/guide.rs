//! A rough idea of where light comes from, for guiding paths in twilight.
//!
//! Once the sun is low, nearly all of the light comes from a small part of the air that a path would rarely find by itself. This
//! solves the same transfer coarsely (isotropic scattering, a few wavelengths, few directions, successive orders on a grid of
//! height and sun angle) for two things: how much light is scattered at a place, and from where it arrives. Both only steer
//! random choices, whose densities are divided out: an error here costs noise, never truth.

use rayon::prelude::*;

use super::first_order::columns_to_sun;
use super::scene::{Scene, SunLight};
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

/// Edges of the elevations \[deg\] between which light is told apart.
const ELEVATION_EDGES_DEG: [f64; 11] = [
    -90.0, -25.0, -6.0, -2.0, 0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 90.0,
];
const ELEVATIONS: usize = ELEVATION_EDGES_DEG.len() - 1;
/// Edges of the azimuths from the sun's \[deg\], on both sides of it.
const AZIMUTH_EDGES_DEG: [f64; 9] = [0.0, 8.0, 20.0, 35.0, 55.0, 80.0, 110.0, 145.0, 180.0];
const AZIMUTHS: usize = AZIMUTH_EDGES_DEG.len() - 1;
/// Bins of direction; whole blocks.
pub(super) const BINS: usize = ELEVATIONS * AZIMUTHS;

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
    /// Mean over all directions of the sunlight alone, and of all later light, shape (height, sun).
    sun: Vec<Bands>,
    diffuse: Vec<Bands>,
    /// What the ground reflects: albedo · irradiance / π, shape (sun,).
    ground: Vec<Bands>,
    /// Power that arrives in each bin, shape (height, sun, band, bin).
    arriving: Vec<f32>,
    /// Solid angle of each bin \[sr\].
    solid_angle: [f32; BINS],
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

/// What is known of a place: scattering and extinction coefficients \[m⁻¹\], and mean radiance of sunlight and of later light.
#[derive(Clone, Copy)]
pub(super) struct Known {
    pub sigma_s: Bands,
    pub sigma_t: Bands,
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

fn sum((a, b): (&Bands, &Bands)) -> Bands {
    bands(|i| a[i] + b[i])
}

/// Sine of the elevation in the middle of a bin.
fn middle_sine(elevation: usize) -> f64 {
    0.5 * (edge_sine(elevation) + edge_sine(elevation + 1))
}

/// The cosine at a node.
fn sun_cosine(node: usize) -> f64 {
    let x = (2.0 * node as f64 / (SUNS - 1) as f64 - 1.0) / (1.0 + f64::from(BEND));
    (f64::from(BEND) * x / (1.0 - x.abs())).clamp(-1.0, 1.0)
}

impl Guide {
    pub fn new(scene: &Scene<'_, LayeredMedium>, columns: &Columns) -> Self {
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
        let mut guide = Self {
            ground_m,
            inverse_top: (1.0 / (top_m - ground_m)) as f32,
            sigma_t: (0..HEIGHTS).map(|h| coefficients(h, |c| c.0)).collect(),
            sigma_s: (0..HEIGHTS).map(|h| coefficients(h, |c| c.1)).collect(),
            sun: vec![[0.0; BANDS]; HEIGHTS * SUNS],
            diffuse: vec![[0.0; BANDS]; HEIGHTS * SUNS],
            ground: vec![[0.0; BANDS]; SUNS],
            arriving: vec![0.0; HEIGHTS * SUNS * BANDS * BINS],
            solid_angle: solid_angles(),
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
            .map(|i| guide.chord(guide.radius_at(i / ELEVATIONS), middle_sine(i % ELEVATIONS)))
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
        let lit: Vec<Bands> = self.sun.iter().zip(&self.diffuse).map(sum).collect();
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
            for bins in self.arriving.chunks_exact_mut(BINS) {
                let mean = bins.iter().sum::<f32>() / (4.0 * std::f32::consts::PI);
                for (bin, &omega) in bins.iter_mut().zip(&self.solid_angle) {
                    *bin = bin.max(LEAST * mean * omega);
                }
            }
        }
    }

    /// Mean radiance at a node, and power per bin.
    fn arrive_at(&self, node: usize, chords: &[Chord], lit: &[Bands]) -> (Bands, Vec<f32>) {
        let (h, mu_sun) = (node / SUNS, sun_cosine(node % SUNS));
        let sin_sun = (1.0 - mu_sun * mu_sun).max(0.0).sqrt();
        let from = self.radius_at(h) * mu_sun;
        let (mut mean, mut arriving) = ([0.0; BANDS], vec![0.0; BANDS * BINS]);
        for bin in 0..BINS {
            let (e, a) = (bin / AZIMUTHS, bin % AZIMUTHS);
            let mu = middle_sine(e);
            let phi = 0.5 * (AZIMUTH_EDGES_DEG[a] + AZIMUTH_EDGES_DEG[a + 1]).to_radians();
            let slope = mu * mu_sun + (1.0 - mu * mu).sqrt() * sin_sun * phi.cos();
            let light = self.along(&chords[h * ELEVATIONS + e], from, slope, lit);
            for b in 0..BANDS {
                let power = light[b] * self.solid_angle[bin];
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

    /// Radiance along a chord; the scalar products of its start \[m\] and its direction with the sun's.
    fn along(&self, chord: &Chord, from: f64, slope: f64, lit: &[Bands]) -> Bands {
        let mut light = [0.0; BANDS];
        for step in &chord.steps {
            let mu_sun = (from + slope * step.distance_m) * step.inverse_radius;
            let (s, g) = sun_node(mu_sun);
            let first = step.height * SUNS + s;
            let below = mix_two(lit[first], lit[first + 1], g);
            let above = mix_two(lit[first + SUNS], lit[first + SUNS + 1], g);
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
        let lit: Vec<Bands> = self.sun.iter().zip(&self.diffuse).map(sum).collect();
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
                .map(|bin| rows[b * BINS + bin] * middle_sine(bin / AZIMUTHS).max(0.0) as f32)
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

    /// Power per bin at one of the nodes about a place, drawn by `u`, for a path that carries `weight` in the bands.
    #[inline(always)]
    pub fn arriving(&self, place: Place, mut u: f32, weight: &Bands, out: &mut [f32; BINS]) {
        let mut corner = 3;
        for (k, &w) in place.weight.iter().enumerate() {
            u -= w;
            if u < 0.0 {
                corner = k;
                break;
            }
        }
        let first = place.at[corner] * BANDS * BINS;
        let rows = &self.arriving[first..first + BANDS * BINS];
        let (r0, rest) = rows.split_at(BINS);
        let (r1, rest) = rest.split_at(BINS);
        let (r2, r3) = rest.split_at(BINS);
        let rows = r0.iter().zip(r1).zip(r2.iter().zip(r3));
        for (o, ((&a, &b), (&c, &d))) in out.iter_mut().zip(rows) {
            *o = weight[0] * a + weight[1] * b + weight[2] * c + weight[3] * d;
        }
    }

    /// A direction in a bin: sine of its elevation and its azimuth from the sun's \[rad\], from two numbers in [0, 1).
    #[inline(always)]
    pub fn in_bin(bin: usize, u: [f64; 2]) -> (f64, f64) {
        let (e, a) = (bin / AZIMUTHS, bin % AZIMUTHS);
        let (below, above) = (edge_sine(e), edge_sine(e + 1));
        let (side, v) = if u[1] < 0.5 {
            (1.0, 2.0 * u[1])
        } else {
            (-1.0, 2.0 * u[1] - 1.0)
        };
        let (from, to) = (AZIMUTH_EDGES_DEG[a], AZIMUTH_EDGES_DEG[a + 1]);
        let phi = (from + v * (to - from)).to_radians();
        (below + u[0] * (above - below), side * phi)
    }

    /// The bin of a direction, by the sine of its elevation and the cosine of its azimuth from the sun's.
    #[inline(always)]
    pub fn bin(sine: f64, cos_azimuth: f64) -> usize {
        let mut e = 0;
        for edge in 1..ELEVATIONS {
            e += usize::from(sine >= edge_sine(edge));
        }
        let mut a = 0;
        for &edge in &AZIMUTH_EDGE_COSINES[1..AZIMUTHS] {
            a += usize::from(cos_azimuth <= edge);
        }
        e * AZIMUTHS + a
    }

    /// Radius of the ground \[m\].
    #[inline(always)]
    pub fn ground_m(&self) -> f64 {
        self.ground_m
    }

    /// Solid angle of a bin \[sr\].
    #[inline(always)]
    pub fn solid_angle(&self, bin: usize) -> f32 {
        self.solid_angle[bin]
    }
}

/// Sines of [`ELEVATION_EDGES_DEG`].
const ELEVATION_EDGE_SINES: [f64; ELEVATIONS + 1] = [
    -1.0,
    -0.422_618_261_740_699_4,
    -0.104_528_463_267_653_47,
    -0.034_899_496_702_500_97,
    0.0,
    0.034_899_496_702_500_97,
    0.087_155_742_747_658_17,
    0.173_648_177_666_930_36,
    0.342_020_143_325_668_7,
    0.642_787_609_686_539_3,
    1.0,
];

/// Cosines of [`AZIMUTH_EDGES_DEG`].
const AZIMUTH_EDGE_COSINES: [f64; AZIMUTHS + 1] = [
    1.0,
    0.990_268_068_741_570_4,
    0.939_692_620_785_908_4,
    0.819_152_044_288_991_8,
    0.573_576_436_351_046,
    0.173_648_177_666_930_3,
    -0.342_020_143_325_668_7,
    -0.819_152_044_288_991_8,
    -1.0,
];

#[inline(always)]
fn edge_sine(edge: usize) -> f64 {
    ELEVATION_EDGE_SINES[edge]
}

fn solid_angles() -> [f32; BINS] {
    std::array::from_fn(|bin| {
        let (e, a) = (bin / AZIMUTHS, bin % AZIMUTHS);
        let width = (AZIMUTH_EDGES_DEG[a + 1] - AZIMUTH_EDGES_DEG[a]).to_radians();
        (2.0 * width * (edge_sine(e + 1) - edge_sine(e))) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn edges_are_those_of_the_angles() {
        for (deg, sine) in ELEVATION_EDGES_DEG.iter().zip(ELEVATION_EDGE_SINES) {
            assert!((deg.to_radians().sin() - sine).abs() < 1e-12);
        }
        for (deg, cosine) in AZIMUTH_EDGES_DEG.iter().zip(AZIMUTH_EDGE_COSINES) {
            assert!((deg.to_radians().cos() - cosine).abs() < 1e-12);
        }
        let sphere: f32 = solid_angles().iter().sum();
        assert!((sphere / (4.0 * std::f32::consts::PI) - 1.0).abs() < 1e-5);
    }

    /// Rationale: the density of a direction is looked up by its bin; a direction drawn in one bin but found in another would
    /// be a bias. Expected: never.
    #[test]
    fn directions_are_found_in_the_bins_they_were_drawn_in() {
        let mut rng = Rng::new(1, 1);
        for bin in 0..BINS {
            for _ in 0..200 {
                let (sine, phi) = Guide::in_bin(bin, [rng.uniform(), rng.uniform()]);
                assert_eq!(Guide::bin(sine, phi.cos()), bin);
            }
        }
    }

    #[test]
    fn the_grid_of_suns_runs_through_its_nodes() {
        for node in 0..SUNS {
            let index = sun_index(sun_cosine(node) as f32);
            assert!((index - node as f32).abs() < 1e-3, "{node}: {index}");
        }
    }
}
