//! Columns along one straight ray, and where on it an optical depth is reached.

use super::columns::Columns;
use super::Ray;

/// Where a ray runs, as seen from the planet's centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayGeometry {
    /// Radius at the start \[m\].
    r0: f64,
    /// Distance to the point nearest the planet's centre \[m\]; negative when it lies behind.
    tangent_m: f64,
}

impl RayGeometry {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Self {
        Self::from_start(ray.origin.length(), ray.distance_to_tangent_m())
    }

    /// The same from the radius at the start and the distance to the point nearest the planet's centre \[m\].
    #[inline(always)]
    pub(crate) fn from_start(r0: f64, tangent_m: f64) -> Self {
        Self { r0, tangent_m }
    }

    /// Distance to the point nearest the planet's centre \[m\]; negative when it lies behind.
    #[inline(always)]
    pub(crate) fn tangent_m(&self) -> f64 {
        self.tangent_m
    }

    /// Radius at the point nearest the planet's centre \[m\].
    #[inline(always)]
    pub(crate) fn lowest_m(&self) -> f64 {
        (self.r0 * self.r0 - self.tangent_m * self.tangent_m)
            .max(0.0)
            .sqrt()
    }

    /// Radius at a distance \[m\].
    #[inline(always)]
    pub(crate) fn radius_at(&self, distance_m: f64) -> f64 {
        (self.r0 * self.r0 + distance_m * (distance_m - 2.0 * self.tangent_m)).sqrt()
    }

    /// Radius and cosine of the zenith angle at a distance.
    #[inline(always)]
    pub(crate) fn at(&self, distance_m: f64) -> (f64, f64) {
        let r = self.radius_at(distance_m);
        (r, (distance_m - self.tangent_m) / r)
    }
}

/// Columns from the start of a ray to points along it.
pub(crate) struct RayColumns<'a> {
    columns: &'a Columns,
    pub(crate) geometry: RayGeometry,
    /// Columns to the top from the start, backwards if the ray falls.
    start: &'a mut [f32],
    /// Columns to the top from the point nearest the planet's centre, if the ray passes one above the ground.
    tangent: &'a mut [f32],
    /// Whether it does.
    grazes: bool,
}

impl<'a> RayColumns<'a> {
    /// `start` and `tangent` are memory of [`Columns::count`] values each.
    #[inline(always)]
    pub(crate) fn new(
        columns: &'a Columns,
        ray: &Ray,
        start: &'a mut [f32],
        tangent: &'a mut [f32],
    ) -> Self {
        Self::along(columns, RayGeometry::new(ray), start, tangent)
    }

    /// The same for a ray given by its geometry.
    #[inline(always)]
    pub(crate) fn along(
        columns: &'a Columns,
        geometry: RayGeometry,
        start: &'a mut [f32],
        tangent: &'a mut [f32],
    ) -> Self {
        columns.to_top_from(geometry.r0, geometry.tangent_m.abs(), start);
        let mut grazes = false;
        if geometry.tangent_m > 0.0 {
            let lowest = geometry.lowest_m();
            // Rounding may put a ray that just misses the ground a hair below it.
            let ground = columns.ground_m();
            grazes = lowest > ground - 1e-3;
            if grazes {
                columns.to_top(lowest.max(ground), 0.0, tangent);
            }
        }
        Self {
            columns,
            geometry,
            start,
            tangent,
            grazes,
        }
    }

    /// Whether the ray leads away from the planet from its start.
    #[inline(always)]
    pub(crate) fn rises(&self) -> bool {
        self.geometry.tangent_m <= 0.0
    }

    /// Extinction coefficient at a distance and one wavelength \[m⁻¹\].
    #[inline(always)]
    pub(crate) fn extinction(&self, distance_m: f64, lane: usize) -> f64 {
        self.columns
            .extinction_at(self.geometry.radius_at(distance_m), lane)
    }

    /// Columns from the start to where the ray leaves the air; it must not meet the ground.
    #[inline(always)]
    pub(crate) fn to_space(&self, out: &mut [f32]) {
        let n = self.columns.count();
        let (start, out) = (&self.start[..n], &mut out[..n]);
        if self.rises() {
            out.copy_from_slice(start);
        } else {
            for ((o, &t), &s) in out.iter_mut().zip(self.tangent.iter()).zip(start) {
                *o = 2.0 * t - s;
            }
        }
    }

    /// Columns from the start to a distance.
    #[inline(always)]
    pub(crate) fn to(&self, distance_m: f64, out: &mut [f32]) {
        let beyond = distance_m - self.geometry.tangent_m;
        let r = self.geometry.radius_at(distance_m);
        self.columns.to_top_from(r, beyond.abs(), out);
        self.since_start(beyond, out);
    }

    /// Columns from the start, from those to the top at a point that lies `beyond` \[m\] the one nearest the planet's centre.
    #[inline(always)]
    fn since_start(&self, beyond: f64, out: &mut [f32]) {
        let n = self.columns.count();
        let (start, out) = (&self.start[..n], &mut out[..n]);
        if self.rises() {
            for (o, &s) in out.iter_mut().zip(start) {
                *o = s - *o;
            }
        } else if beyond <= 0.0 || !self.grazes {
            for (o, &s) in out.iter_mut().zip(start) {
                *o -= s;
            }
        } else {
            for ((o, &t), &s) in out.iter_mut().zip(self.tangent.iter()).zip(start) {
                *o = 2.0 * t - *o - s;
            }
        }
    }

    /// Distance at which the optical depth at one wavelength reaches `wanted`, which must lie within the ray's `length_m`; leaves
    /// the columns up to there in `out`. `sigma` is the extinction coefficient at the start \[m⁻¹\].
    ///
    /// What is looked for is the optical depth to the top at that point: on a falling stretch it is that of the start and
    /// what is wanted besides, on a rising one what remains. As it falls off exponentially with height, Newton's method works
    /// on its logarithm, kept inside a bracket.
    #[inline(always)]
    pub(crate) fn invert(
        &self,
        lane: usize,
        mut sigma: f64,
        wanted: f64,
        length_m: f64,
        out: &mut [f32],
    ) -> f64 {
        const ITERATIONS: usize = 40;
        // Length of a last step, times the optical depth it makes up \[m\]: as extinction changes by less than its like in a
        // kilometre, what a straight step misses stays below 2e-6.
        const STRAIGHT_M: f64 = 4e-3;
        let columns = self.columns;
        let at_start = columns.optical_depth_at(self.start, lane);
        let (mut low, mut high) = (0.0, length_m);
        let (mut s, mut now) = (0.0, at_start);
        let (mut target, mut sign) = (at_start + wanted, 1.0);
        if self.rises() {
            (target, sign) = (at_start - wanted, -1.0);
        } else if self.grazes {
            let lowest = columns.optical_depth_at(self.tangent, lane);
            let tangent_m = self.geometry.tangent_m.min(length_m);
            if target < lowest {
                high = tangent_m;
            } else {
                (target, sign) = (2.0 * lowest - target, -1.0);
                (low, s, now) = (tangent_m, tangent_m, lowest);
                sigma = columns.extinction_at(self.geometry.radius_at(tangent_m), lane);
            }
        }
        target = target.max(1e-12);
        // Rounding of the columns in f32 adds to what is asked for.
        let tolerance = 1e-6 + 1e-5 * wanted + 2e-7 * now.max(target);
        let mut iteration = 0;
        // Logarithm of what is missing, distance, and their derivative at the place before.
        let mut before: Option<(f64, f64, f64)> = None;
        let (at, step) = loop {
            iteration += 1;
            let (x, slope) = (ln(target / now), sign * now / sigma);
            let guess = match before {
                Some(before) => hermite_at_zero(before, (x, s, slope)),
                None => s + slope * x,
            };
            before = Some((x, s, slope));
            s = if guess > low && guess < high {
                guess
            } else {
                0.5 * (low + high)
            };
            let r = self.geometry.radius_at(s);
            let at;
            (at, now, sigma) = columns.to_top_at(r, (s - self.geometry.tangent_m).abs(), lane);
            let missing = target - now;
            if missing.abs() < tolerance || iteration == ITERATIONS {
                break (at, 0.0);
            }
            // A short step within a shell goes straight, along the densities here.
            let step = sign * missing / sigma;
            if (step * missing).abs() < STRAIGHT_M
                && s + step > low
                && s + step < high
                && at.holds(self.geometry.radius_at(s + step))
            {
                s += step;
                break (at, sign * step);
            }
            if sign * missing > 0.0 {
                low = s;
            } else {
                high = s;
            }
        };
        at.stepped(step as f32, &mut out[..columns.count()]);
        self.since_start(s - self.geometry.tangent_m, out);
        s
    }
}

/// Value at x = 0 of the cubic in x with given values and slopes at two places, (x, value, −slope) each; the slope's step from
/// the second one if x = 0 lies far outside them.
#[inline(always)]
fn hermite_at_zero(first: (f64, f64, f64), second: (f64, f64, f64)) -> f64 {
    let ((x0, s0, d0), (x1, s1, d1)) = (first, second);
    let h = x0 - x1;
    // Share of the way from the first place to the second one at which x = 0.
    let t = x0 / h;
    if !(-1.0..3.0).contains(&t) {
        return s1 + d1 * x1;
    }
    let u = 1.0 - t;
    u * u * (s0 * (1.0 + 2.0 * t) + d0 * h * t) + t * t * (s1 * (3.0 - 2.0 * t) - d1 * h * u)
}

/// Natural logarithm, by the first terms of its series where they are good to 1e-6: all that a step of Newton's needs.
#[inline(always)]
fn ln(x: f64) -> f64 {
    if !(0.7..1.4).contains(&x) {
        return x.ln();
    }
    let y = (x - 1.0) / (x + 1.0);
    let y2 = y * y;
    2.0 * y * (1.0 + y2 * (1.0 / 3.0 + y2 * (1.0 / 5.0)))
}
