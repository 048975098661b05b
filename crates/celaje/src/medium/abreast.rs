//! Lookups of columns for several rays abreast, and searches along them for where an optical depth is reached.
//!
//! A lookup is a chain of roots and loads each of which waits for the one before, and a search is a chain of lookups. Eight abreast
//! share their roots, which are one instruction for all, and the loads of one fall into the waiting of another. Every
//! ray comes out as it would alone.

use super::columns::{Aligned, Columns, COSINES};
use super::shell::{cubic_weights, mean_fraction, Node};
use super::{LayeredMedium, RayColumns};
use crate::math::lanes::{self, Block, BLOCK};

/// Rays abreast.
pub(crate) const RAYS: usize = 8;

/// A number for each ray.
pub(crate) type Abreast = [f64; RAYS];

/// A number for each ray from a function of its place.
#[inline(always)]
pub(crate) fn all(f: impl Fn(usize) -> f64) -> Abreast {
    let mut out = [0.0; RAYS];
    for (k, v) in out.iter_mut().enumerate() {
        *v = f(k);
    }
    out
}

/// The same in single precision.
type Single = [f32; RAYS];

#[inline(always)]
fn all_single(f: impl Fn(usize) -> f32) -> Single {
    let mut out = [0.0; RAYS];
    for (k, v) in out.iter_mut().enumerate() {
        *v = f(k);
    }
    out
}

#[inline(always)]
fn single(values: &Abreast) -> Single {
    all_single(|k| values[k] as f32)
}

/// Places in the table of columns, as `Columns::look_up` finds one.
#[derive(Clone, Copy)]
pub(crate) struct Lookups {
    /// Where each ray's rows begin in the table, and the node above it.
    row: [usize; RAYS],
    node: [usize; RAYS],
    /// Weights of four rows.
    cubic: [Single; 4],
    /// The way to the node above \[m\], and the mean fraction of the shell on it.
    length: Single,
    mean: Single,
    /// Fraction of the shell at the point itself.
    fraction: Single,
    /// Radii of the shells' nodes \[m\], and 1 over their distance \[m⁻¹\].
    below: Abreast,
    above: Abreast,
    inverse_thickness: Abreast,
}

impl Lookups {
    const NONE: Self = Self {
        row: [0; RAYS],
        node: [1; RAYS],
        cubic: [[0.0; RAYS]; 4],
        length: [0.0; RAYS],
        mean: [0.0; RAYS],
        fraction: [0.0; RAYS],
        below: [0.0; RAYS],
        above: [0.0; RAYS],
        inverse_thickness: [0.0; RAYS],
    };

    /// Columns to the top from several points, along directions that do not fall.
    ///
    /// * `r` — distances from the planet's centre \[m\]
    /// * `s` — distances to the points of the straight lines that are nearest the planet's centre \[m\], ≥ 0
    #[inline(always)]
    pub(crate) fn new(columns: &Columns, r: &Abreast, s: &Abreast) -> Self {
        // Added, this leaves no bits for a fraction and the whole number in the lowest ones.
        const MAGIC: f64 = 6_755_399_441_055_744.0;
        let (nodes, guide) = (columns.nodes(), columns.guide());
        let mut node = [0; RAYS];
        for (node, &r) in node.iter_mut().zip(r) {
            *node = guide.interval(r) + 1;
        }
        let of = |f: fn(&Node) -> f64| all(|k| f(&nodes[node[k]]));
        let (below, above) = (of(|n| n.below_m), of(|n| n.radius_m));
        let (to_top_squared, shortest) = (of(|n| n.to_top_squared), of(|n| n.shortest_m));
        let stretch = of(|n| n.inverse_stretch);
        let (inverse_radius, inverse_thickness) =
            (of(|n| n.inverse_radius), of(|n| n.inverse_thickness));
        let rise = all(|k| ((above[k] - r[k]) * (above[k] + r[k])).max(0.0));
        let s_node = all(|k| (s[k] * s[k] + rise[k]).sqrt());
        // The table at the node above, on the same straight line.
        let d = all(|k| (s_node[k] * s_node[k] + to_top_squared[k]).sqrt() - s_node[k]);
        let x = all(|k| (d[k] - shortest[k]) * stretch[k] * (COSINES - 1) as f64);
        let entry = all(|k| (x[k].clamp(1.0, (COSINES - 3) as f64) - 1.5) + MAGIC);
        let mut row = [0; RAYS];
        for k in 0..RAYS {
            row[k] = node[k] * COSINES + (entry[k].to_bits() & 0xffff) as usize;
        }
        let x = all(|k| x[k] - (entry[k] - MAGIC));
        let mut cubic = [[0.0; RAYS]; 4];
        for k in 0..RAYS {
            let weights = cubic_weights(x[k]);
            for (cubic, weight) in cubic.iter_mut().zip(weights) {
                cubic[k] = weight as f32;
            }
        }
        // The rest of this shell, exactly; 1 / r to 1e-7, from the node's.
        let inverse_r = all(|k| inverse_radius[k] * (1.0 + (above[k] - r[k]) * inverse_radius[k]));
        let start = all(|k| (r[k] - below[k]) * inverse_thickness[k]);
        let mean = all(|k| {
            mean_fraction(
                s[k],
                s_node[k],
                inverse_r[k],
                start[k],
                inverse_thickness[k],
            )
        });
        Self {
            row,
            node,
            cubic,
            length: single(&all(|k| s_node[k] - s[k])),
            mean: single(&mean),
            fraction: single(&all(|k| start[k].clamp(0.0, 1.0))),
            below,
            above,
            inverse_thickness,
        }
    }

    /// One block of a ray's columns to the top, and of the densities at a fraction of the shell.
    #[inline(always)]
    fn block(&self, columns: &Columns, k: usize, b: usize, fraction: f32) -> (Block, Block) {
        let n = columns.count() / BLOCK;
        let rows = &columns.rows()[self.row[k] * n..(self.row[k] + 4) * n];
        let density = &columns.densities()[(self.node[k] - 1) * n..(self.node[k] + 1) * n];
        let row = |i: usize| rows[i * n + b].0;
        let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
        let [w0, w1, w2, w3] = self.cubic;
        let (w0, w1, w2, w3) = (w0[k], w1[k], w2[k], w3[k]);
        let (below, above) = (&density[b].0, &density[n + b].0);
        let shell = lanes::lerp_block(below, above, self.mean[k]);
        let length = self.length[k];
        let columns =
            lanes::each(|i| w0 * r0[i] + w1 * r1[i] + w2 * r2[i] + w3 * r3[i] + length * shell[i]);
        (columns, lanes::lerp_block(below, above, fraction))
    }

    /// The columns of one ray.
    #[inline(always)]
    pub(crate) fn columns(&self, columns: &Columns, k: usize, out: &mut [f32]) {
        for (b, out) in lanes::blocks_mut(out).enumerate() {
            *out = self.block(columns, k, b, 0.0).0;
        }
    }

    /// Optical depth of a ray to the top at one wavelength of `Columns::spectrum_of`.
    #[inline(always)]
    fn optical_depth(&self, columns: &Columns, k: usize, spectrum: &[Aligned]) -> f32 {
        let mut tau = [0.0; BLOCK];
        for (b, Aligned(s)) in spectrum.iter().enumerate() {
            let (columns, _) = self.block(columns, k, b, 0.0);
            tau = lanes::each(|i| tau[i] + s[i] * columns[i]);
        }
        lanes::tree_sum(tau)
    }

    /// The columns of one ray, moved on by `step` \[m\] in the same shell; `middle` and `end` are the radii \[m\] halfway and there.
    #[inline(always)]
    fn stepped(
        &self,
        columns: &Columns,
        k: usize,
        step: f32,
        [middle, end]: [f64; 2],
        out: &mut [f32],
    ) {
        // Density is linear in radius: that of the mean radius counts, which Simpson's rule finds as in `shell::mean_fraction`.
        let mean_r = (4.0 * middle + end - 5.0 * self.below[k]) * self.inverse_thickness[k];
        let mean = (self.fraction[k] + mean_r as f32) * (1.0 / 6.0);
        for (b, out) in lanes::blocks_mut(out).enumerate() {
            let (columns, density) = self.block(columns, k, b, mean);
            *out = lanes::each(|i| columns[i] + step * density[i]);
        }
    }
}

/// Searches, on several rays, for the distances at which optical depths at one wavelength each are reached.
///
/// What is looked for is the optical depth to the top at that point: on a falling stretch it is that of the start and
/// what is wanted besides, on a rising one what remains. It falls off with height about exponentially, so that its logarithm leads
/// to good guesses, kept inside a bracket: from one place by its two derivatives there, from two by both of each. Once a guess lies
/// in the right shell the rest is exact, for there extinction is linear in radius.
///
/// Some rays need more looks than others. They go on while new ones take the places of those that are there.
pub(crate) struct Search<'a> {
    columns: &'a Columns,
    medium: &'a LayeredMedium,
    /// Whether a ray is still searching, and how often it has looked.
    searching: [bool; RAYS],
    looks: [u32; RAYS],
    lane: [usize; RAYS],
    r0_squared: Abreast,
    tangent: Abreast,
    low: Abreast,
    high: Abreast,
    /// Distances \[m\].
    s: Abreast,
    /// The optical depths to the top that are wanted, and that are there, extinction coefficients \[m⁻¹\] and their derivatives along the
    /// ray \[m⁻²\].
    target: Single,
    now: Single,
    sigma: Single,
    gradient: Single,
    /// 1 where the optical depth to the top grows along the ray, −1 where it shrinks.
    sign: Single,
    tolerance: Single,
    before: Places,
    /// Where the columns of each ray are found, and the last step from there.
    place: Lookups,
    step: Single,
}

/// Distances as functions of x, the logarithm of what is wanted over what is there, at one place on each ray.
#[derive(Clone, Copy)]
struct Places {
    x: Single,
    s: Single,
    /// `−ds/dx` and `d²s/dx²`.
    slope: Single,
    bend: Single,
}

impl Places {
    /// What a search remembers that has not looked yet.
    const NONE: Self = Self {
        x: [f32::NAN; RAYS],
        s: [0.0; RAYS],
        slope: [0.0; RAYS],
        bend: [0.0; RAYS],
    };

    /// Where x = 0, told by a place of its own: as if the ray ran through an atmosphere whose extinction is a power of its optical
    /// depth, of which the exponential one is a case and the uniform one.
    #[inline(always)]
    fn guess(&self, k: usize) -> f32 {
        // (1 − exp(−y)) / y = 1 / (1 + y / 2 + y² / 12 − …), y = −x bend / slope.
        let y = -self.x[k] * self.bend[k] / self.slope[k];
        self.s[k] + self.slope[k] * self.x[k] / (1.0 + y * (0.5 + y * (1.0 / 12.0)))
    }

    /// Where x = 0 on the quintic through a place of two; `otherwise`, if that is not about between them.
    #[inline(always)]
    fn guess_between(&self, other: &Self, k: usize, otherwise: f32) -> f32 {
        let h = self.x[k] - other.x[k];
        // Share of the way from the first place to the second one at which x = 0.
        let t = self.x[k] / h;
        let u = 1.0 - t;
        let (th, uh) = (t * h, u * h);
        let first = self.s[k] * (1.0 + t * (3.0 + t * 6.0))
            + th * (self.slope[k] * (1.0 + 3.0 * t) + 0.5 * self.bend[k] * th);
        let second = other.s[k] * (1.0 + u * (3.0 + u * 6.0))
            - uh * (other.slope[k] * (1.0 + 3.0 * u) - 0.5 * other.bend[k] * uh);
        if (-0.5..1.5).contains(&t) {
            u * u * u * first + t * t * t * second
        } else {
            otherwise
        }
    }
}

impl<'a> Search<'a> {
    /// Looks on every ray before it is asked which are there: nine of ten are after two.
    const LOOKS: u32 = 2;
    /// Against endless searches.
    const MOST_LOOKS: u32 = 40;
    /// Longest last step \[m\]: so far the radius changes evenly.
    const LONGEST_STEP_M: f32 = 1000.0;
    /// A shorter step than this leads nowhere: near an end of the ray rounding may put what is wanted beyond it.
    const STUCK_M: f64 = 1e-3;

    #[inline(always)]
    pub(crate) fn new(columns: &'a Columns, medium: &'a LayeredMedium) -> Self {
        Self {
            columns,
            medium,
            searching: [false; RAYS],
            looks: [0; RAYS],
            lane: [0; RAYS],
            r0_squared: [columns.ground_m() * columns.ground_m(); RAYS],
            tangent: [0.0; RAYS],
            low: [0.0; RAYS],
            high: [0.0; RAYS],
            target: [1.0; RAYS],
            sign: [1.0; RAYS],
            tolerance: [0.0; RAYS],
            s: [0.0; RAYS],
            now: [1.0; RAYS],
            sigma: [1.0; RAYS],
            gradient: [0.0; RAYS],
            before: Places::NONE,
            place: Lookups::NONE,
            step: [0.0; RAYS],
        }
    }

    /// Begins with the `k`-th ray: the distance at which a share `lost` of the light of a wavelength is lost, which must lie within
    /// `length_m`. `start` is where among the medium's nodes the ray starts.
    #[inline(always)]
    pub(crate) fn begin(
        &mut self,
        k: usize,
        along: &RayColumns<'_>,
        start: (usize, f32),
        lane: usize,
        lost: f64,
        length_m: f64,
    ) {
        let wanted = f64::from(optical_depth(lost));
        let (columns, geometry) = (self.columns, along.geometry);
        let at_start = columns.optical_depth_at(along.start, lane);
        let (mut sigma, per_radius) = self.medium.extinction_and_slope(lane, start);
        let mut gradient = -per_radius * geometry.tangent_m() / geometry.start_m();
        let (mut low, mut high) = (0.0, length_m);
        let (mut s, mut now) = (0.0, at_start);
        let (mut target, mut sign) = (at_start + wanted, 1.0);
        if along.rises() {
            (target, sign) = (at_start - wanted, -1.0);
        } else if along.grazes {
            let lowest = columns.optical_depth_at(along.tangent, lane);
            let tangent_m = geometry.tangent_m().min(length_m);
            if target < lowest {
                high = tangent_m;
            } else {
                (target, sign) = (2.0 * lowest - target, -1.0);
                (low, s, now) = (tangent_m, tangent_m, lowest);
                sigma = columns.extinction_at(geometry.radius_at(tangent_m), lane);
                gradient = 0.0;
            }
        }
        let target = target.max(1e-12);
        self.searching[k] = true;
        self.looks[k] = 0;
        self.lane[k] = lane;
        self.r0_squared[k] = geometry.start_squared();
        self.tangent[k] = geometry.tangent_m();
        (self.low[k], self.high[k]) = (low, high);
        (self.s[k], self.now[k]) = (s, now as f32);
        (self.sigma[k], self.gradient[k]) = (sigma as f32, gradient as f32);
        (self.target[k], self.sign[k]) = (target as f32, sign);
        self.before.x[k] = f32::NAN;
        // Rounding of the columns in f32 adds to what is asked for.
        self.tolerance[k] = (1e-6 + 1e-5 * wanted + 2e-7 * now.max(target)) as f32;
    }

    /// Whether the `k`-th ray is still searching.
    #[inline(always)]
    pub(crate) fn is_searching(&self, k: usize) -> bool {
        self.searching[k]
    }

    /// Searches on for a few looks.
    #[inline(always)]
    pub(crate) fn run(&mut self) {
        for _ in 0..Self::LOOKS {
            self.look();
        }
    }

    /// Radii at distances.
    #[inline(always)]
    fn radius_at(&self, s: &Abreast) -> Abreast {
        all(|k| (self.r0_squared[k] + s[k] * (s[k] - 2.0 * self.tangent[k])).sqrt())
    }

    /// Where to look next. Single precision is enough: a guess is not asked for more than the right shell.
    #[inline(always)]
    fn aim(&mut self) -> Abreast {
        let (now, sign) = (self.now, self.sign);
        let inverse_sigma = all_single(|k| 1.0 / self.sigma[k]);
        let slope = all_single(|k| sign[k] * now[k] * inverse_sigma[k]);
        let here = Places {
            x: all_single(|k| ln(self.target[k] / now[k])),
            s: single(&self.s),
            slope,
            bend: all_single(|k| slope[k] * (1.0 - self.gradient[k] * slope[k] * inverse_sigma[k])),
        };
        let before = self.before;
        self.before = here;
        let alone = all_single(|k| here.guess(k));
        let guess = all_single(|k| before.guess_between(&here, k, alone[k]));
        let (low, high) = (self.low, self.high);
        let inside = all(|k| {
            let guess = f64::from(guess[k]);
            if guess > low[k] && guess < high[k] {
                guess
            } else {
                0.5 * (low[k] + high[k])
            }
        });
        all(|k| {
            if self.searching[k] {
                inside[k]
            } else {
                self.s[k]
            }
        })
    }

    #[inline(always)]
    fn look(&mut self) {
        let s = self.aim();
        let (sign, tangent) = (self.sign, self.tangent);
        let r = self.radius_at(&s);
        let from_tangent = all(|k| s[k] - tangent[k]);
        let place = Lookups::new(self.columns, &r, &all(|k| from_tangent[k].abs()));
        let mut now = self.now;
        let (mut at_below, mut at_above) = ([1.0; RAYS], [1.0; RAYS]);
        for k in 0..RAYS {
            if self.searching[k] {
                let (lane, node) = (self.lane[k], place.node[k]);
                now[k] = place.optical_depth(self.columns, k, self.columns.spectrum_of(lane));
                at_below[k] = self.medium.extinction_row(node - 1)[lane];
                at_above[k] = self.medium.extinction_row(node)[lane];
            }
        }
        let rise = all_single(|k| at_above[k] - at_below[k]);
        let sigma = all_single(|k| at_below[k] + place.fraction[k] * rise[k]);
        let gradient = all_single(|k| {
            let climbs = from_tangent[k] as f32 / r[k] as f32;
            rise[k] * place.inverse_thickness[k] as f32 * climbs
        });
        // The last step within the shell: σ e + ½ σ' e² is missing.
        let missing = all_single(|k| sign[k] * (self.target[k] - now[k]));
        let step = all_single(|k| {
            let end_squared = sigma[k] * sigma[k] + 2.0 * gradient[k] * missing[k];
            2.0 * missing[k] / (sigma[k] + end_squared.max(0.0).sqrt())
        });
        let end = all(|k| s[k] + f64::from(step[k]));
        let end_r = self.radius_at(&end);
        let (low, high, before) = (self.low, self.high, self.s);
        for k in 0..RAYS {
            let close =
                (missing[k].abs() < self.tolerance[k]) | ((s[k] - before[k]).abs() < Self::STUCK_M);
            let short = (step[k].abs() < Self::LONGEST_STEP_M)
                & (end[k] > low[k])
                & (end[k] < high[k])
                & (place.below[k] <= end_r[k])
                & (end_r[k] <= place.above[k]);
            let last = if short & !close { step[k] } else { 0.0 };
            self.step[k] = if self.searching[k] {
                last
            } else {
                self.step[k]
            };
            self.looks[k] += u32::from(self.searching[k]);
            self.searching[k] &= !(close | short) & (self.looks[k] < Self::MOST_LOOKS);
        }
        self.low = all(|k| if missing[k] > 0.0 { s[k] } else { low[k] });
        self.high = all(|k| if missing[k] > 0.0 { high[k] } else { s[k] });
        (self.s, self.now, self.sigma, self.gradient) = (s, now, sigma, gradient);
        self.place = place;
    }

    /// The distance \[m\] that the search on the `k`-th ray came to, and the node below; leaves the columns up to there in `out`.
    #[inline(always)]
    pub(crate) fn found(&self, k: usize, along: &RayColumns<'_>, out: &mut [f32]) -> (f64, usize) {
        let distance_m = self.s[k] + f64::from(self.step[k]);
        let step = self.sign[k] * self.step[k];
        let middle = along
            .geometry
            .radius_at(self.s[k] + 0.5 * f64::from(self.step[k]));
        let end = along.geometry.radius_at(distance_m);
        self.place
            .stepped(self.columns, k, step, [middle, end], out);
        along.since_start(distance_m - self.tangent[k], out);
        (distance_m, self.place.node[k] - 1)
    }
}

/// The optical depth on which a share of the light is lost, −ln(1 − x), to a relative error of 5e-7.
#[inline(always)]
fn optical_depth(lost: f64) -> f32 {
    // The logarithm of a rounded number, over how much it was rounded (Kahan).
    let left = (1.0 - lost) as f32;
    let rounded = 1.0 - left;
    let depth = -ln(left);
    if rounded > 0.0 {
        depth * (lost as f32 / rounded)
    } else {
        lost as f32
    }
}

/// Natural logarithm of a number above zero, to 2e-7 or that relative error, whichever is larger.
#[inline(always)]
fn ln(x: f32) -> f32 {
    const MANTISSA: u32 = (1 << 23) - 1;
    // x = 2^e m, m from √½ to √2: the bits of √½ are taken off before the exponent is cut out, and put back to the rest.
    const ROOT_HALF: u32 = 0x3f35_04f3;
    const TWO_23: f32 = 8_388_608.0;
    let shifted = x.to_bits().wrapping_sub(ROOT_HALF).wrapping_add(127 << 23);
    let exponent = f32::from_bits((shifted >> 23) | TWO_23.to_bits()) - (TWO_23 + 127.0);
    let m = f32::from_bits((shifted & MANTISSA).wrapping_add(ROOT_HALF));
    let y = (m - 1.0) / (m + 1.0);
    let y2 = y * y;
    let series = 1.0 + y2 * (1.0 / 3.0 + y2 * (1.0 / 5.0 + y2 * (1.0 / 7.0 + y2 * (1.0 / 9.0))));
    exponent * std::f32::consts::LN_2 + 2.0 * y * series
}

#[cfg(test)]
mod tests {
    use super::super::columns::tests::medium;
    use super::super::{Medium, Ray, RayGeometry};
    use super::*;
    use crate::math::{Rng, Vec3};

    /// A ray from somewhere in the air, dense near the ground, and where the air or the ground ends it.
    fn some_ray(m: &LayeredMedium, rng: &mut Rng) -> (Ray, f64, bool) {
        loop {
            let altitude = 100_000.0 * rng.uniform().powi(4);
            let elevation = 90.0 * (2.0 * rng.uniform() - 1.0) * rng.uniform().powi(2);
            let ray = Ray {
                origin: Vec3::new(0.0, 0.0, 6_360_000.0 + altitude),
                direction: Vec3::from_azimuth_elevation_deg(20.0, elevation),
            };
            let through = ray.through_air(m.ground_radius_m(), m.top_radius_m());
            if let Some((span, meets_ground)) = through {
                return (ray, span.end_m, meets_ground);
            }
        }
    }

    /// Rationale: eight lookups share their arithmetic. Expected: each finds what one alone does, to the rounding of single precision.
    #[test]
    fn lookups_are_those_of_one_ray() {
        let m = medium();
        let columns = Columns::new(&m);
        let mut rng = Rng::new(7, 1);
        let n = columns.count();
        let (mut alone, mut abreast) = (vec![0.0; n], vec![0.0; n]);
        for _ in 0..500 {
            let rays: Vec<RayGeometry> = (0..RAYS)
                .map(|_| RayGeometry::new(&some_ray(&m, &mut rng).0))
                .collect();
            let r = all(|k| rays[k].radius_at(0.0));
            let s = all(|k| rays[k].tangent_m().abs());
            let lookups = Lookups::new(&columns, &r, &s);
            for k in 0..RAYS {
                columns.to_top_from(r[k], s[k], &mut alone);
                lookups.columns(&columns, k, &mut abreast);
                for (a, b) in alone.iter().zip(&abreast) {
                    assert!((a - b).abs() <= 1e-5 * a.abs() + 1e-9, "{a} {b}");
                }
            }
        }
    }

    /// Rationale: a collision must lie where its wavelength has lost what was drawn; the search is cut short as soon as it is close.
    /// Expected: over 4000 rays (rising, falling, grazing) the columns it leaves are those up to the distance it names, and hold
    /// the optical depth that was wanted; and each ray comes out the same, bit for bit, whatever others are searched with it.
    #[test]
    fn searches_find_what_is_wanted() {
        let m = medium();
        let columns = Columns::new(&m);
        let mut rng = Rng::new(11, 1);
        let n = columns.count();
        let memory = || (vec![0.0; n], vec![0.0; n]);
        let (mut out, mut check, mut again) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        let mut close = 0;
        for _ in 0..500 {
            let rays: Vec<_> = (0..RAYS).map(|_| some_ray(&m, &mut rng)).collect();
            let mut memories: Vec<_> = rays.iter().map(|_| memory()).collect();
            let along: Vec<RayColumns<'_>> = rays
                .iter()
                .zip(&mut memories)
                .map(|((ray, _, _), (start, tangent))| {
                    RayColumns::new(&columns, ray, start, tangent)
                })
                .collect();
            let lane = (rng.uniform() * 20.0) as usize;
            let mut wanted = Vec::new();
            let mut search = Search::new(&columns, &m);
            for (k, ((ray, length_m, meets_ground), along)) in rays.iter().zip(&along).enumerate() {
                if *meets_ground {
                    along.to(*length_m, &mut out);
                } else {
                    along.to_space(&mut out);
                }
                let end = columns.optical_depth_at(&out, lane);
                let lost = rng.uniform() * -(-end).exp_m1();
                let start = m.locate_radius(ray.origin.length());
                wanted.push((lost, start));
                search.begin(k, along, start, lane, lost, *length_m);
            }
            while (0..RAYS).any(|k| search.is_searching(k)) {
                search.run();
            }
            for k in 0..RAYS {
                let (_, length_m, _) = rays[k];
                let (lost, start) = wanted[k];
                let (distance_m, node) = search.found(k, &along[k], &mut out);
                assert!((0.0..=length_m).contains(&distance_m));
                let r = along[k].geometry.radius_at(distance_m);
                let radii = m.node_radii_m();
                assert!(radii[node] <= r + 1e-6 && r <= radii[node + 1] + 1e-6);
                along[k].to(distance_m, &mut check);
                let reached = columns.optical_depth_at(&out, lane);
                let there = columns.optical_depth_at(&check, lane);
                let depth = -(-lost).ln_1p();
                // What is far above the ground hangs on small differences of large columns in single precision.
                let mut largest = columns.optical_depth_at(along[k].start, lane);
                if along[k].grazes {
                    largest += 2.0 * columns.optical_depth_at(along[k].tangent, lane);
                }
                let rounding = 4e-7 * largest;
                let allowed = 2e-6 + 1e-5 * depth + rounding;
                assert!((reached - there).abs() < allowed, "{reached} {there}");
                // In the two shells where a layer has its edge, the last step may end a little further beside the aim.
                let missed = (reached - depth).abs();
                assert!(missed < allowed + 2e-5, "{reached} {depth}");
                close += u32::from(missed < allowed);
                let mut alone = Search::new(&columns, &m);
                alone.begin(3, &along[k], start, lane, lost, length_m);
                while alone.is_searching(3) {
                    alone.run();
                }
                assert_eq!(alone.found(3, &along[k], &mut again), (distance_m, node));
                assert_eq!(out, again);
            }
        }
        assert!(close > 3900, "{close}");
    }

    #[test]
    fn logarithms_keep_their_error() {
        for i in 0..20_000 {
            let x = 1e-12 * 1e14f32.powf(i as f32 / 2e4);
            let exact = f64::from(x).ln();
            let error = f64::from(ln(x)) - exact;
            assert!(error.abs() < 2e-7 * exact.abs().max(1.0), "{x}: {error:e}");
            let lost = 1e-9f64.powf(f64::from(i) / 2e4);
            let exact = -(-lost).ln_1p();
            if lost < 0.999 {
                let error = f64::from(optical_depth(lost)) / exact - 1.0;
                assert!(error.abs() < 5e-7, "{lost}: {error:e}");
            }
        }
    }
}
