//! Lookups of columns for several rays abreast, and searches along them for where an optical depth is reached.
//!
//! A lookup is a chain of roots and loads each of which waits for the one before, and a search is a chain of lookups. Eight abreast
//! share their roots, which are one instruction for all, and the loads of one fall into the waiting of another. Every
//! ray comes out as it would alone.

use super::columns::{Aligned, Columns, COSINES};
use super::shell::{cubic_weights, mean_fraction, Node};
use super::RayColumns;
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

/// A number for each ray in f32.
#[inline(always)]
fn single(values: &Abreast) -> [f32; RAYS] {
    let mut out = [0.0; RAYS];
    for (v, &x) in out.iter_mut().zip(values) {
        *v = x as f32;
    }
    out
}

/// Places in the table of columns, as `Columns::look_up` finds one.
#[derive(Clone, Copy)]
pub(crate) struct Lookups {
    /// Where each ray's rows begin in the table, and the node above it.
    row: [usize; RAYS],
    node: [usize; RAYS],
    /// Weights of four rows.
    cubic: [[f32; RAYS]; 4],
    /// The way to the node above \[m\], and the mean fraction of the shell on it.
    length: [f32; RAYS],
    mean: [f32; RAYS],
    /// Fraction of the shell at the point itself.
    fraction: [f32; RAYS],
    /// Radii of the shells' nodes \[m\].
    below: Abreast,
    above: Abreast,
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
        let (inverse_radius, thickness) = (of(|n| n.inverse_radius), of(|n| n.inverse_thickness));
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
        let start = all(|k| (r[k] - below[k]) * thickness[k]);
        let mean = all(|k| mean_fraction(s[k], s_node[k], inverse_r[k], start[k], thickness[k]));
        Self {
            row,
            node,
            cubic,
            length: single(&all(|k| s_node[k] - s[k])),
            mean: single(&mean),
            fraction: single(&all(|k| start[k].clamp(0.0, 1.0))),
            below,
            above,
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

    /// Optical depth of a ray to the top at one wavelength of `Columns::spectrum_of`, and the extinction coefficient \[m⁻¹\] at the
    /// point.
    #[inline(always)]
    fn at(&self, columns: &Columns, k: usize, spectrum: &[Aligned]) -> (f64, f64) {
        let (mut tau, mut sigma) = ([0.0; BLOCK], [0.0; BLOCK]);
        for (b, Aligned(s)) in spectrum.iter().enumerate() {
            let (columns, density) = self.block(columns, k, b, self.fraction[k]);
            tau = lanes::each(|i| tau[i] + s[i] * columns[i]);
            sigma = lanes::each(|i| sigma[i] + s[i] * density[i]);
        }
        (
            f64::from(lanes::tree_sum(tau)),
            f64::from(lanes::tree_sum(sigma)),
        )
    }

    /// The columns of one ray, moved on by `step` \[m\] to the radius `r` \[m\] in the same shell.
    #[inline(always)]
    fn stepped(&self, columns: &Columns, k: usize, (step, r): (f32, f64), out: &mut [f32]) {
        // Density is linear in radius, and radius nearly so along a short step: its mean is that halfway.
        let end = ((r - self.below[k]) / (self.above[k] - self.below[k])) as f32;
        let halfway = 0.5 * (self.fraction[k] + end);
        for (b, out) in lanes::blocks_mut(out).enumerate() {
            let (columns, density) = self.block(columns, k, b, halfway);
            *out = lanes::each(|i| columns[i] + step * density[i]);
        }
    }
}

/// Searches, on several rays, for the distances at which optical depths at one wavelength each are reached.
///
/// What is looked for is the optical depth to the top at that point: on a falling stretch it is that of the start and
/// what is wanted besides, on a rising one what remains. As it falls off exponentially with height, Newton's method works
/// on its logarithm, kept inside a bracket, and so does a cubic through the last two places.
pub(crate) struct Search<'a> {
    columns: &'a Columns,
    /// How many rays take part; the others are idle.
    count: usize,
    lane: [usize; RAYS],
    r0_squared: Abreast,
    tangent: Abreast,
    low: Abreast,
    high: Abreast,
    /// Distances, and the optical depths to the top and extinction coefficients there.
    s: Abreast,
    now: Abreast,
    sigma: Abreast,
    target: Abreast,
    sign: Abreast,
    tolerance: Abreast,
    /// Where the columns of each ray are found, and the last step from there.
    place: Lookups,
    step: Abreast,
}

impl<'a> Search<'a> {
    #[inline(always)]
    pub(crate) fn new(columns: &'a Columns) -> Self {
        Self {
            columns,
            count: 0,
            lane: [0; RAYS],
            r0_squared: [1.0; RAYS],
            tangent: [0.0; RAYS],
            low: [0.0; RAYS],
            high: [0.0; RAYS],
            s: [0.0; RAYS],
            now: [1.0; RAYS],
            sigma: [1.0; RAYS],
            target: [1.0; RAYS],
            sign: [1.0; RAYS],
            tolerance: [f64::INFINITY; RAYS],
            place: Lookups::NONE,
            step: [0.0; RAYS],
        }
    }

    /// Adds a ray: the distance at which a share `lost` of the light of a wavelength is lost, which must lie within `length_m`.
    /// `sigma` is the extinction coefficient at the start \[m⁻¹\].
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        along: &RayColumns<'_>,
        lane: usize,
        mut sigma: f64,
        lost: f64,
        length_m: f64,
    ) {
        let wanted = optical_depth(lost);
        let (columns, geometry) = (self.columns, along.geometry);
        let at_start = columns.optical_depth_at(along.start, lane);
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
            }
        }
        let target = target.max(1e-12);
        let k = self.count;
        self.lane[k] = lane;
        self.r0_squared[k] = geometry.start_squared();
        self.tangent[k] = geometry.tangent_m();
        (self.low[k], self.high[k], self.s[k]) = (low, high, s);
        (self.now[k], self.sigma[k]) = (now, sigma);
        (self.target[k], self.sign[k]) = (target, sign);
        // Rounding of the columns in f32 adds to what is asked for.
        self.tolerance[k] = 1e-6 + 1e-5 * wanted + 2e-7 * now.max(target);
        self.count += 1;
    }

    /// Searches, for [`Search::found`].
    #[inline(always)]
    pub(crate) fn run(&mut self) {
        // Most rays are there after three looks: so many are taken without asking.
        const LOOKS: usize = 3;
        const MOST_LOOKS: usize = 40;
        // Length of a last step, times the optical depth it makes up \[m\]: where extinction changes by its like in a kilometre,
        // the step ends 2e-6 of optical depth beside the aim. Columns are told to where it ends.
        const STRAIGHT_M: f64 = 4e-3;
        // A shorter step than this leads nowhere: near an end of the ray rounding may put what is wanted beyond it.
        const STUCK_M: f64 = 1e-3;
        let (r0_squared, tangent, sign) = (self.r0_squared, self.tangent, self.sign);
        let (target, tolerance) = (self.target, self.tolerance);
        let radius_at =
            |s: &Abreast| all(|k| (r0_squared[k] + s[k] * (s[k] - 2.0 * tangent[k])).sqrt());
        let mut there = [false; RAYS];
        // Logarithm of what is missing, distance, and their derivative at the place before.
        let (mut x0, mut s0, mut d0) = ([0.0; RAYS], [0.0; RAYS], [0.0; RAYS]);
        for look in 1..=MOST_LOOKS {
            let (before, now, sigma) = (self.s, self.now, self.sigma);
            let (low, high) = (self.low, self.high);
            let x = all(|k| ln(target[k] / now[k]));
            let slope = all(|k| sign[k] * now[k] / sigma[k]);
            let newton = all(|k| before[k] + slope[k] * x[k]);
            let guess = if look == 1 {
                newton
            } else {
                let old = |k: usize| (x0[k], s0[k], d0[k]);
                all(|k| hermite_at_zero(old(k), (x[k], before[k], slope[k]), newton[k]))
            };
            (x0, s0, d0) = (x, before, slope);
            let s = all(|k| {
                let inside = guess[k] > low[k] && guess[k] < high[k];
                let next = if inside {
                    guess[k]
                } else {
                    0.5 * (low[k] + high[k])
                };
                if there[k] {
                    before[k]
                } else {
                    next
                }
            });
            let (r, from_tangent) = (radius_at(&s), all(|k| (s[k] - tangent[k]).abs()));
            let (mut now, mut sigma) = (now, sigma);
            let place = Lookups::new(self.columns, &r, &from_tangent);
            for k in 0..self.count {
                let spectrum = self.columns.spectrum_of(self.lane[k]);
                (now[k], sigma[k]) = place.at(self.columns, k, spectrum);
            }
            let missing = all(|k| target[k] - now[k]);
            // A short step within a shell goes straight, along the densities here.
            let straight = all(|k| sign[k] * missing[k] / sigma[k]);
            let end = all(|k| s[k] + straight[k]);
            let end_r = radius_at(&end);
            let (below, above) = (place.below, place.above);
            self.place = place;
            for k in 0..RAYS {
                let close =
                    (missing[k].abs() < tolerance[k]) | ((s[k] - before[k]).abs() < STUCK_M);
                let short = ((straight[k] * missing[k]).abs() < STRAIGHT_M)
                    & (end[k] > low[k])
                    & (end[k] < high[k])
                    & (below[k] <= end_r[k])
                    & (end_r[k] <= above[k]);
                let step = if short & !close { straight[k] } else { 0.0 };
                self.step[k] = if there[k] { self.step[k] } else { step };
                there[k] |= close | short;
            }
            self.low = all(|k| {
                if sign[k] * missing[k] > 0.0 {
                    s[k]
                } else {
                    low[k]
                }
            });
            self.high = all(|k| {
                if sign[k] * missing[k] > 0.0 {
                    high[k]
                } else {
                    s[k]
                }
            });
            (self.s, self.now, self.sigma) = (s, now, sigma);
            if look >= LOOKS && there[..self.count].iter().all(|&there| there) {
                break;
            }
        }
    }

    /// The distance \[m\] that the search on the `k`-th ray came to, and the node below; leaves the columns up to there in `out`.
    #[inline(always)]
    pub(crate) fn found(&self, k: usize, along: &RayColumns<'_>, out: &mut [f32]) -> (f64, usize) {
        let distance_m = self.s[k] + self.step[k];
        let step = (self.sign[k] * self.step[k]) as f32;
        let r = along.geometry.radius_at(distance_m);
        self.place.stepped(self.columns, k, (step, r), out);
        along.since_start(distance_m - self.tangent[k], out);
        (distance_m, self.place.node[k] - 1)
    }
}

/// Value at x = 0 of the cubic in x with given values and slopes at two places, (x, value, −slope) each; `otherwise`, if x = 0
/// lies far outside them.
#[inline(always)]
fn hermite_at_zero(first: (f64, f64, f64), second: (f64, f64, f64), otherwise: f64) -> f64 {
    let ((x0, s0, d0), (x1, s1, d1)) = (first, second);
    let h = x0 - x1;
    // Share of the way from the first place to the second one at which x = 0.
    let t = x0 / h;
    let u = 1.0 - t;
    let cubic =
        u * u * (s0 * (1.0 + 2.0 * t) + d0 * h * t) + t * t * (s1 * (3.0 - 2.0 * t) - d1 * h * u);
    if (-1.0..3.0).contains(&t) {
        cubic
    } else {
        otherwise
    }
}

/// The optical depth on which a share of the light is lost, −ln(1 − x), to a relative error of 1e-8 or 1e-16 / x.
#[inline(always)]
fn optical_depth(lost: f64) -> f64 {
    -ln(1.0 - lost)
}

/// Natural logarithm of a number above zero to some 1e-8, more than a step of Newton's needs.
#[inline(always)]
fn ln(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    // x = 2^e m, m from √½ to √2: the bits of √½ are taken off before the exponent is cut out, and put back to the rest.
    const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const TWO_52: f64 = 4_503_599_627_370_496.0;
    let shifted = x.to_bits().wrapping_sub(ROOT_HALF).wrapping_add(1023 << 52);
    let exponent = f64::from_bits((shifted >> 52) | TWO_52.to_bits()) - (TWO_52 + 1023.0);
    let m = f64::from_bits((shifted & MANTISSA).wrapping_add(ROOT_HALF));
    let y = (m - 1.0) / (m + 1.0);
    let y2 = y * y;
    let series = 1.0 + y2 * (1.0 / 3.0 + y2 * (1.0 / 5.0 + y2 * (1.0 / 7.0 + y2 * (1.0 / 9.0))));
    exponent * std::f64::consts::LN_2 + 2.0 * y * series
}

#[cfg(test)]
mod tests {
    use super::super::columns::tests::medium;
    use super::super::{LayeredMedium, Medium, Ray, RayGeometry};
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
            let mut search = Search::new(&columns);
            for ((ray, length_m, meets_ground), along) in rays.iter().zip(&along) {
                if *meets_ground {
                    along.to(*length_m, &mut out);
                } else {
                    along.to_space(&mut out);
                }
                let end = columns.optical_depth_at(&out, lane);
                let lost = rng.uniform() * -(-end).exp_m1();
                let sigma = m.coefficients_at(lane, ray.origin).0;
                wanted.push((lost, sigma));
                search.add(along, lane, sigma, lost, *length_m);
            }
            search.run();
            for k in 0..RAYS {
                let (_, length_m, _) = rays[k];
                let (lost, sigma) = wanted[k];
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
                let mut alone = Search::new(&columns);
                alone.add(&along[k], lane, sigma, lost, length_m);
                alone.run();
                assert_eq!(alone.found(0, &along[k], &mut again), (distance_m, node));
                assert_eq!(out, again);
            }
        }
        assert!(close > 3900, "{close}");
    }

    #[test]
    fn logarithms_keep_their_error() {
        for i in 0..20_000 {
            let x = 1e-12 * 1e14f64.powf(f64::from(i) / 2e4);
            assert!((ln(x) - x.ln()).abs() < 2e-8, "{x}");
            let lost = 1e-9f64.powf(f64::from(i) / 2e4);
            let exact = -(-lost).ln_1p();
            if lost < 0.999_999 {
                let error = optical_depth(lost) / exact - 1.0;
                assert!(error.abs() < 2e-7, "{lost}: {error:e}");
            }
        }
    }
}
