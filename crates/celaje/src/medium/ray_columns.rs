//! Columns along one straight ray, and where on it an optical depth is reached.

use super::columns::Columns;
use super::Ray;

/// Where a ray runs, as seen from the planet's centre.
#[derive(Debug, Clone, Copy, Default)]
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

    /// Radius at the start \[m\].
    #[inline(always)]
    pub(crate) fn start_m(&self) -> f64 {
        self.r0
    }

    /// Square of the radius at the start \[m²\].
    #[inline(always)]
    pub(super) fn start_squared(&self) -> f64 {
        self.r0 * self.r0
    }

    /// Radius at the point nearest the planet's centre \[m\].
    #[inline(always)]
    pub(crate) fn lowest_m(&self) -> f64 {
        (self.r0 * self.r0 - self.tangent_m * self.tangent_m)
            .max(0.0)
            .sqrt()
    }

    /// Radius at the point nearest the planet's centre \[m\], if the ray passes one above the ground.
    #[inline(always)]
    pub(crate) fn grazes(&self, ground_m: f64) -> Option<f64> {
        if self.tangent_m <= 0.0 {
            return None;
        }
        let lowest = self.lowest_m();
        // Rounding may put a ray that just misses the ground a hair below it.
        (lowest > ground_m - 1e-3).then_some(lowest.max(ground_m))
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
    pub(super) start: &'a [f32],
    /// Columns to the top from the point nearest the planet's centre, if the ray passes one above the ground.
    pub(super) tangent: &'a [f32],
    /// Whether it does.
    pub(crate) grazes: bool,
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
        let lowest = geometry.grazes(columns.ground_m());
        if let Some(lowest) = lowest {
            columns.to_top(lowest, 0.0, tangent);
        }
        Self {
            columns,
            geometry,
            start,
            tangent,
            grazes: lowest.is_some(),
        }
    }

    /// The same once more from what [`RayColumns::along`] left in `start` and `tangent`, and found of `grazes`.
    #[inline(always)]
    pub(crate) fn again(
        columns: &'a Columns,
        geometry: RayGeometry,
        start: &'a [f32],
        tangent: &'a [f32],
        grazes: bool,
    ) -> Self {
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
    pub(crate) fn since_start(&self, beyond: f64, out: &mut [f32]) {
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
}
