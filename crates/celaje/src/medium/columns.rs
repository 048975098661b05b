//! Optical depths along straight rays through a layered medium, from one lookup.
//!
//! The extinction `σ_t(z, λ)` of any layered medium is a short sum `Σ_k c_k(z) s_k(λ)`: air, ozone at a few
//! temperatures, a few aerosols. An adaptive cross approximation (Bebendorf 2000, doi:10.1007/PL00005410) finds such a sum
//! without being told the species. Optical depth is then `Σ_k C_k s_k(λ)` with the columns `C_k = ∫ c_k ds`, and the columns
//! to the top of the air depend on two numbers only, radius and zenith angle.
//!
//! Columns are tabulated *at the medium's own nodes*, over the cosine only, where they are smooth, and interpolated by a
//! cubic. The piece between a point and the node above it is integrated, for within a shell `c_k` is linear in
//! radius. That keeps the kinks of the profile out of the interpolation; `worst_error` in the tests states what is left.

use std::sync::Arc;

use multiversion::multiversion;
use rayon::prelude::*;

use super::cross::cross_approximation;
use super::layered::LayeredMedium;
use super::shell::{cubic_weights, mean_fraction, Node};
use super::Medium;
use crate::math::interp::Guide;
use crate::math::lanes::{self, Block, BLOCK};

/// Nodes of the table over the zenith angle, at each altitude.
pub(super) const COSINES: usize = 112;

/// Columns to the top of the air from every altitude and direction, and what they weigh at each wavelength.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    /// Number of columns, whole blocks.
    count: usize,
    /// The columns themselves; media that were taken together share them.
    of_all: Arc<Table>,
    /// `s_k` at the wavelengths, shape (block of wavelengths, k).
    spectra: Vec<Aligned>,
    /// How many columns are not padding.
    used: usize,
    /// The same with shape (lanes, block of k).
    by_lane: Vec<Aligned>,
}

/// A block that begins where a line of the cache does.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Aligned(pub(super) Block);

/// Columns that need no wavelength.
#[derive(Debug)]
struct Table {
    count: usize,
    nodes: Vec<Node>,
    guide: Guide,
    /// `c_k` at the nodes, shape (node, block of k).
    density: Vec<Aligned>,
    /// `C_k` to the top, shape (node, COSINES, block of k), uniform in the distance to the top.
    table: Vec<Aligned>,
}

impl Columns {
    pub(crate) fn new(medium: &LayeredMedium) -> Self {
        let (lanes, rows) = (medium.lanes(), medium.extinction_rows());
        let (density, spectra, count) = cross_approximation(rows, lanes);
        let of_all = Arc::new(Table::new(medium, &density, count));
        Self::over(of_all, &spectra, lanes, 0, lanes)
    }

    /// Columns of several media over the same nodes: one table for all, since each extinction is a short sum over the same
    /// densities.
    pub(crate) fn of_several(media: &[&LayeredMedium]) -> Vec<Self> {
        let Some(first) = media.first() else {
            return Vec::new();
        };
        let all: usize = media.iter().map(|m| m.lanes()).sum();
        let rows: Vec<f32> = (0..first.node_radii_m().len())
            .flat_map(|node| {
                media.iter().flat_map(move |m| {
                    let at = node * m.lanes();
                    m.extinction_rows()[at..at + m.lanes()].iter().copied()
                })
            })
            .collect();
        let (density, spectra, count) = cross_approximation(&rows, all);
        let of_all = Arc::new(Table::new(first, &density, count));
        let mut from = 0;
        media
            .iter()
            .map(|m| {
                from += m.lanes();
                Self::over(of_all.clone(), &spectra, all, from - m.lanes(), from)
            })
            .collect()
    }

    /// A medium's own view of columns: its part, `from` to `to`, of spectra with rows of `all` values.
    fn over(of_all: Arc<Table>, spectra: &[f32], all: usize, from: usize, to: usize) -> Self {
        let (count, lanes) = (of_all.count, to - from);
        let spectrum = |k: usize, lane: usize| spectra[k * all + from + lane];
        Self {
            count,
            of_all,
            by_lane: (0..lanes * count / BLOCK)
                .map(|i| {
                    let (lane, first) = (i * BLOCK / count, i * BLOCK % count);
                    Aligned(lanes::each(|k| spectrum(first + k, lane)))
                })
                .collect(),
            spectra: (0..lanes / BLOCK * count)
                .map(|i| {
                    let (block, k) = (i / count, i % count);
                    Aligned(lanes::each(|j| spectrum(k, block * BLOCK + j)))
                })
                .collect(),
            used: (0..count)
                .rev()
                .find(|&k| (0..all).any(|lane| spectra[k * all + lane] != 0.0))
                .map_or(0, |k| k + 1),
        }
    }

    /// Radius of the ground \[m\].
    #[inline(always)]
    pub(crate) fn ground_m(&self) -> f64 {
        self.of_all.nodes[0].radius_m
    }

    /// Number of columns of a lookup.
    #[inline(always)]
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Its nodes, what finds them, the columns at them and their densities, for [`super::abreast`].
    #[inline(always)]
    pub(super) fn nodes(&self) -> &[Node] {
        &self.of_all.nodes
    }

    #[inline(always)]
    pub(super) fn guide(&self) -> &Guide {
        &self.of_all.guide
    }

    #[inline(always)]
    pub(super) fn rows(&self) -> &[Aligned] {
        &self.of_all.table
    }

    #[inline(always)]
    pub(super) fn densities(&self) -> &[Aligned] {
        &self.of_all.density
    }

    /// Where the columns from a point to the top along a direction that does not fall are found.
    #[inline(always)]
    fn look_up(&self, r: f64, s: f64) -> Lookup<'_> {
        let n = self.count / BLOCK;
        let t = &*self.of_all;
        let j = t.guide.interval(r) + 1;
        let node = t.nodes[j];
        let (below, above) = (node.below_m, node.radius_m);
        let s_node = (s * s + ((above - r) * (above + r)).max(0.0)).sqrt();
        // The table at the node above, on the same straight line.
        let d = (s_node * s_node + node.to_top_squared).sqrt() - s_node;
        let x = (d - node.shortest_m) * node.inverse_stretch * (COSINES - 1) as f64;
        let i = (x as usize).clamp(1, COSINES - 3) - 1;
        // The rest of this shell, exactly; 1 / r to 1e-7, from the node's.
        let inverse_r = node.inverse_radius * (1.0 + (above - r) * node.inverse_radius);
        let start = (r - below) * node.inverse_thickness;
        let mean = mean_fraction(s, s_node, inverse_r, start, node.inverse_thickness);
        Lookup {
            rows: &t.table[(j * COSINES + i) * n..(j * COSINES + i + 4) * n],
            density: &t.density[(j - 1) * n..(j + 1) * n],
            cubic: cubic_weights(x - i as f64).map(|w| w as f32),
            length: (s_node - s) as f32,
            mean: mean as f32,
        }
    }

    /// Columns from a point to the top along a direction that does not fall.
    ///
    /// * `r` — distance from the planet's centre \[m\]; `mu` — cosine of the zenith angle, ≥ 0
    #[inline(always)]
    pub(crate) fn to_top(&self, r: f64, mu: f64, out: &mut [f32]) {
        self.to_top_from(r, r * mu, out);
    }

    /// The same from the distance `s` = r μ \[m\], ≥ 0, to the point of the straight line that is nearest the planet's centre.
    #[inline(always)]
    pub(crate) fn to_top_from(&self, r: f64, s: f64, out: &mut [f32]) {
        to_top_from(self, r, s, out);
    }

    /// `s_k` at one wavelength.
    #[inline(always)]
    pub(super) fn spectrum_of(&self, lane: usize) -> &[Aligned] {
        let n = self.count / BLOCK;
        &self.by_lane[lane * n..(lane + 1) * n]
    }

    /// Extinction coefficient at a radius and one wavelength \[m⁻¹\].
    #[inline(always)]
    pub(crate) fn extinction_at(&self, r: f64, lane: usize) -> f64 {
        let n = self.count / BLOCK;
        let t = &*self.of_all;
        let i = t.guide.interval(r);
        let node = t.nodes[i + 1];
        let f = ((r - node.below_m) * node.inverse_thickness).clamp(0.0, 1.0) as f32;
        let (below, above) = t.density[i * n..(i + 2) * n].split_at(n);
        let mut total = [0.0; BLOCK];
        for ((a, b), s) in below.iter().zip(above).zip(self.spectrum_of(lane)) {
            let density = lanes::lerp_block(&a.0, &b.0, f);
            total = lanes::each(|k| total[k] + density[k] * s.0[k]);
        }
        f64::from(lanes::tree_sum(total))
    }

    /// Optical depth of columns at every wavelength.
    #[inline(always)]
    pub(crate) fn optical_depth(&self, columns: &[f32], tau: &mut [f32]) {
        let n = self.count;
        let columns = &columns[..self.used];
        let rows = self.spectra.chunks_exact(n);
        for (tau, spectra) in lanes::blocks_mut(tau).zip(rows) {
            let mut sum = [0.0; BLOCK];
            for (&c, &Aligned(spectrum)) in columns.iter().zip(spectra) {
                sum = lanes::each(|i| sum[i] + c * spectrum[i]);
            }
            *tau = sum;
        }
    }

    /// Optical depth of columns at one wavelength.
    #[inline(always)]
    pub(crate) fn optical_depth_at(&self, columns: &[f32], lane: usize) -> f64 {
        let mut tau = [0.0; BLOCK];
        for (c, s) in lanes::blocks(columns).zip(self.spectrum_of(lane)) {
            tau = lanes::each(|k| tau[k] + c[k] * s.0[k]);
        }
        f64::from(lanes::tree_sum(tau))
    }
}

impl Table {
    fn new(medium: &LayeredMedium, density: &[f32], count: usize) -> Self {
        let radius_m = medium.node_radii_m();
        let nodes = radius_m.len();
        let node = |j: usize| Node::new(radius_m[j.max(1) - 1], radius_m[j], radius_m[nodes - 1]);
        let mut this = Self {
            count,
            nodes: (0..nodes).map(node).collect(),
            guide: medium.guide().clone(),
            density: lanes::blocks(density).copied().map(Aligned).collect(),
            table: Vec::new(),
        };
        let mut table = vec![Aligned([0.0; BLOCK]); nodes * COSINES * count / BLOCK];
        table
            .par_chunks_mut(COSINES * count / BLOCK)
            .enumerate()
            .for_each(|(node, rows)| integrate_to_top(&this, node, rows));
        this.table = table;
        this
    }

    /// Cosine of the zenith angle of a table entry: entry 0 looks up, the last one horizontally.
    fn cosine_of(&self, node: usize, entry: usize) -> f64 {
        let node = self.nodes[node];
        let stretch = node.to_top_squared.sqrt() - node.shortest_m;
        let d = node.shortest_m + stretch * entry as f64 / (COSINES - 1) as f64;
        if d == 0.0 {
            return 1.0;
        }
        // d² + 2 r μ d = R_top² − r².
        ((node.to_top_squared - d * d) / (2.0 * node.radius_m * d)).clamp(0.0, 1.0)
    }
}

/// A place in the table: four rows to interpolate, and the piece of a shell below them.
struct Lookup<'a> {
    /// Columns to the top at four directions, shape (4, block of k).
    rows: &'a [Aligned],
    /// Densities at the nodes below and above, shape (2, block of k).
    density: &'a [Aligned],
    cubic: [f32; 4],
    /// The way to the node above \[m\], and the mean fraction of the shell on it.
    length: f32,
    mean: f32,
}

impl Lookup<'_> {
    /// One block of the columns to the top.
    #[inline(always)]
    fn block(&self, b: usize) -> Block {
        let n = self.density.len() / 2;
        let row = |i: usize| self.rows[i * n + b].0;
        let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
        let shell = lanes::lerp_block(&self.density[b].0, &self.density[n + b].0, self.mean);
        let (w, length) = (self.cubic, self.length);
        lanes::each(|k| {
            w[0] * r0[k] + w[1] * r1[k] + w[2] * r2[k] + w[3] * r3[k] + length * shell[k]
        })
    }
}

/// [`Columns::to_top_from`]; it has too many callers to become part of each.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn to_top_from(columns: &Columns, r: f64, s: f64, out: &mut [f32]) {
    let at = columns.look_up(r, s);
    for (b, out) in lanes::blocks_mut(out).enumerate() {
        *out = at.block(b);
    }
}

/// Exact columns from a node upwards to the top in all of the table's directions: shell by shell, with density linear in
/// radius.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn integrate_to_top(table: &Table, node: usize, rows: &mut [Aligned]) {
    let n = table.count;
    // Distances from the point nearest the planet's centre.
    let mut s: Vec<f64> = (0..COSINES)
        .map(|m| table.nodes[node].radius_m * table.cosine_of(node, m))
        .collect();
    let (mut length, mut mean) = (vec![0.0; COSINES], vec![0.0; COSINES]);
    let mut sum = vec![0.0f64; COSINES * n];
    for j in node + 1..table.nodes.len() {
        let upper = table.nodes[j];
        let (below, above) = (upper.below_m, upper.radius_m);
        let (rise, inverse_below) = ((above - below) * (above + below), 1.0 / below);
        for ((s, length), mean) in s.iter_mut().zip(&mut length).zip(&mut mean) {
            let s_next = (*s * *s + rise).sqrt();
            *length = s_next - *s;
            *mean = mean_fraction(*s, s_next, inverse_below, 0.0, upper.inverse_thickness);
            *s = s_next;
        }
        let density: Vec<f64> = table.density[(j - 1) * n / BLOCK..(j + 1) * n / BLOCK]
            .iter()
            .flat_map(|row| row.0.map(f64::from))
            .collect();
        let (a, b) = density.split_at(n);
        let ways = length.iter().zip(&mean);
        for (row, (&length, &mean)) in sum.chunks_exact_mut(n).zip(ways) {
            for ((v, &a), &b) in row.iter_mut().zip(a).zip(b) {
                *v += length * (a + mean * (b - a));
            }
        }
    }
    for (row, sum) in rows.iter_mut().flat_map(|row| &mut row.0).zip(sum) {
        *row = sum as f32;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::{Ray, RayColumns, RayGeometry};
    use super::*;
    use crate::math::{Rng, Vec3};
    use crate::optics::Phase;

    /// Air, a temperature-dependent ozone layer and two aerosol layers with edges: the shapes that a real sky has.
    pub fn medium() -> LayeredMedium {
        let altitude_m: Vec<f64> = (0..=250)
            .map(|i| 100_000.0 * (f64::from(i) / 250.0).powf(1.6))
            .collect();
        let wavelength_nm: Vec<f64> = (0..20).map(|i| 380.0 + 20.0 * f64::from(i)).collect();
        let mut sigma = Vec::new();
        for &z in &altitude_m {
            for &w in &wavelength_nm {
                let air = 4.5e-5 * (400.0 / w).powi(4) * (-z / 8000.0).exp();
                let t = (z - 22_000.0) / 5000.0;
                let ozone = 1e-6
                    * (-0.5 * ((w - 600.0) / 50.0f64).powi(2)).exp()
                    * (1.0 + 0.1 * t * (w / 600.0))
                    * (-0.5 * t * t).exp();
                let mixing = if z < 2000.0 {
                    1e-4 * (550.0 / w).powf(1.3)
                } else {
                    0.0
                };
                let high = if (12_000.0..35_000.0).contains(&z) {
                    3e-7 * (550.0 / w).powf(0.7)
                } else {
                    0.0
                };
                sigma.push(air + ozone.max(0.0) + mixing + high);
            }
        }
        let mut m = LayeredMedium::new(&altitude_m, &wavelength_nm, 6_360_000.0).unwrap();
        let phase = Phase::henyey_greenstein(&[0.0; 20]).unwrap();
        m.add(&sigma, &vec![0.0; sigma.len()], phase).unwrap();
        m
    }

    /// Shell by shell over the very nodes of the medium, 40 steps each: good to 1e-7.
    fn brute_force(m: &LayeredMedium, lane: usize, ray: &Ray, end_m: f64) -> f64 {
        let g = RayGeometry::new(ray);
        let mut cuts: Vec<f64> = vec![0.0, end_m];
        for &r in m.node_radii_m() {
            let below = r * r - ray.impact_parameter_squared();
            if below > 0.0 {
                cuts.extend([g.tangent_m() - below.sqrt(), g.tangent_m() + below.sqrt()]);
            }
        }
        cuts.push(g.tangent_m());
        cuts.retain(|s| (0.0..=end_m).contains(s));
        cuts.sort_by(f64::total_cmp);
        let mut tau = 0.0;
        for c in cuts.windows(2) {
            let n = 40;
            let ds = (c[1] - c[0]) / f64::from(n);
            for i in 0..n {
                tau += m
                    .coefficients_at(lane, ray.at(c[0] + (f64::from(i) + 0.5) * ds))
                    .0
                    * ds;
            }
        }
        tau
    }

    /// Rationale: the tables stand in for exact transmittances in the reference integrator. Expected: over 3000 random
    /// segments (rising, falling, grazing) the transmittance is off by less than 1e-4 at worst and 1e-5 on average.
    #[test]
    fn worst_error() {
        let m = medium();
        let columns = Columns::new(&m);
        let mut rng = Rng::new(3, 1);
        let (mut start, mut tangent, mut out) = (
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
        );
        let mut tau = vec![0.0; m.lanes()];
        let (mut worst, mut mean, mut n) = (0.0f64, 0.0, 0.0);
        while n < 3000.0 {
            let altitude = 100_000.0 * rng.uniform().powi(4);
            let elevation = 90.0 * (2.0 * rng.uniform() - 1.0) * rng.uniform().powi(2);
            let ray = Ray {
                origin: Vec3::new(0.0, 0.0, 6_360_000.0 + altitude),
                direction: Vec3::from_azimuth_elevation_deg(20.0, elevation),
            };
            let Some((span, _)) = ray.through_air(m.ground_radius_m(), m.top_radius_m()) else {
                continue;
            };
            let end = span.end_m
                * if rng.uniform() < 0.3 {
                    1.0
                } else {
                    rng.uniform()
                };
            RayColumns::new(&columns, &ray, &mut start, &mut tangent).to(end, &mut out);
            columns.optical_depth(&out, &mut tau);
            for lane in [0, 11] {
                let exact = (-brute_force(&m, lane, &ray, end)).exp();
                let error = ((-f64::from(tau[lane])).exp() - exact).abs();
                assert!(
                    error < 1e-4,
                    "altitude {altitude}, elevation {elevation}, end {end}: {error:e}"
                );
                let single = (-columns.optical_depth_at(&out, lane)).exp();
                assert!((single - exact).abs() < 1e-4);
                worst = worst.max(error);
                mean += error / 6000.0;
            }
            n += 1.0;
        }
        println!(
            "{} columns: transmittance off by {worst:.1e} at worst, {mean:.1e} on average",
            columns.count()
        );
        assert!(mean < 1e-5, "{mean:e}");
    }

    #[test]
    fn the_sum_of_columns_is_the_extinction() {
        let m = medium();
        let columns = Columns::new(&m);
        let mut row = vec![0.0; m.lanes()];
        for z in [
            0.0, 1_500.0, 1_990.0, 13_000.0, 25_000.0, 60_000.0, 99_000.0,
        ] {
            m.extinction(Vec3::new(0.0, 0.0, 6_360_000.0 + z), &mut row);
            let largest = row.iter().copied().fold(0.0, f32::max);
            for (lane, &b) in row.iter().enumerate().take(20) {
                let a = columns.extinction_at(6_360_000.0 + z, lane);
                let b = f64::from(b);
                assert!(
                    (a - b).abs() < 1e-5 * f64::from(largest),
                    "{z} m: {a} against {b}"
                );
            }
        }
        assert_eq!(lanes::padded(20), m.lanes());
    }
}
