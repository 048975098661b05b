//! From solved tables to pixels.

use std::sync::atomic::{AtomicU64, Ordering};

use multiversion::multiversion;
use rayon::prelude::*;

use super::along::{Along, Stand, Target};
use super::azimuths::EveryOther;
use super::march::March;
use super::scaled::Sunlit;
use super::skygrid::SkyGrid;
use super::tables::Tables;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::math::{lanes, Vec3};
use crate::medium::{Medium, Ray, RayColumns};
use crate::sensor::Sensor;
use crate::transport::disc::DiscRegion;
use crate::transport::render::{Control, Observer};
use crate::transport::scene::SunLight;
use crate::transport::stokes::{across_meridian, Turn};

/// Points spread over the sun's disc in a pixel.
const DISC_POINTS: u32 = 1024;

/// Points across a pixel on the rim of the view, each way, at which it is looked how much of it is seen.
const VIEW_POINTS: usize = 32;

/// Pixels above which it pays to compute the sky on a grid of directions first.
const MANY_PIXELS: usize = 1000;

/// Tables looked at under one sun.
pub struct Gatherer<'a> {
    pub tables: &'a Tables,
    pub sun: &'a SunLight,
    /// Orders that are seen: 0, 1, or all of the tables.
    pub max_order: Option<u32>,
    /// Whether Q and U are wanted beside the radiance.
    pub stokes: bool,
}

impl<'a> Gatherer<'a> {
    pub fn new(
        tables: &'a Tables,
        sun: &'a SunLight,
        max_order: Option<u32>,
        stokes: bool,
    ) -> Self {
        Self {
            tables,
            sun,
            max_order,
            stokes,
        }
    }

    /// Stokes components that are wanted.
    pub fn components(&self) -> usize {
        if self.stokes {
            3
        } else {
            1
        }
    }

    /// Length of what [`RayWorker::gather`] finds in one direction.
    pub fn parts(&self) -> usize {
        let medium = &self.tables.medium;
        (medium.phases().len() + self.components()) * medium.lanes()
    }

    /// The film of a sensor.
    pub fn render(
        &self,
        observer: &Observer,
        sensor: &dyn Sensor,
        control: &Control<'_>,
    ) -> Result<Film> {
        let (width, height) = sensor.size();
        let nm = self.tables.medium.wavelength_nm();
        let w = nm.len();
        let n = self.tables.medium.lanes();
        let mut film = if self.stokes {
            Film::new_polarised(width, height, nm)?
        } else {
            Film::new(width, height, nm)?
        };
        let done = AtomicU64::new(0);
        let total = (width * height) as u64;
        let origin = Vec3::new(0.0, 0.0, observer.radius_m);
        let grid = if width * height > MANY_PIXELS && self.max_order != Some(0) {
            let seen = |pixel: usize| sensor.direction(pixel % width, pixel / width, 0.5, 0.5);
            let looks = (0..width * height).filter_map(seen);
            Some(SkyGrid::new(
                self,
                observer.radius_m,
                looks,
                control.cancel,
            )?)
        } else {
            None
        };
        film.pixels_mut()
            .into_par_iter()
            .enumerate()
            .try_for_each_init(
                || Worker::new(self),
                |worker, (pixel, out)| {
                    if control.cancel.load(Ordering::Relaxed) {
                        return Err(Error::Interrupted);
                    }
                    let (row, column) = (pixel / width, pixel % width);
                    if let Some(direction) = sensor.direction(column, row, 0.5, 0.5) {
                        let ray = Ray { origin, direction };
                        match &grid {
                            Some(grid) => look_up(worker, grid, direction),
                            None => gather_pixel(worker, &ray),
                        }
                        if observer.sun_disc {
                            worker.add_disc(&ray, |u, v| sensor.direction(column, row, u, v));
                        }
                        // V, the last component, stays 0.
                        let found = worker.radiance.chunks_exact(n);
                        for ((mean, _), found) in out.stokes.into_iter().zip(found) {
                            mean.copy_from_slice(&found[..w]);
                        }
                        *out.samples = 1;
                    }
                    let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
                    (control.progress)(so_far, total);
                    Ok(())
                },
            )?;
        Ok(film)
    }

    /// Radiances in directions, without the disc, shape (direction, w).
    pub fn radiance(&self, observer_m: f64, directions: &[Vec3]) -> Vec<f32> {
        let w = self.tables.medium.wavelength_nm().len();
        let origin = Vec3::new(0.0, 0.0, observer_m);
        let mut out = vec![0.0; directions.len() * w];
        out.par_chunks_mut(w).zip(directions).for_each_init(
            || Worker::new(self),
            |worker, (out, &direction)| {
                gather_pixel(worker, &Ray { origin, direction });
                out.copy_from_slice(&worker.radiance[..w]);
            },
        );
        out
    }
}

/// Memory of one thread.
pub struct Worker<'a> {
    gatherer: &'a Gatherer<'a>,
    rays: RayWorker<'a>,
    /// The radiance and, if wanted, Q and U, shape (components, lanes).
    radiance: Vec<f32>,
    phases: Vec<f32>,
    /// What [`RayWorker::gather`] returns for one direction.
    parts: Vec<f32>,
    source: Vec<f32>,
    beam: Vec<f32>,
    disc: DiscRegion,
}

impl<'a> Worker<'a> {
    fn new(gatherer: &'a Gatherer<'a>) -> Self {
        let medium = &gatherer.tables.medium;
        let n = medium.lanes();
        let species = medium.phases().len();
        Self {
            gatherer,
            rays: RayWorker::new(gatherer),
            radiance: vec![0.0; n * gatherer.components()],
            phases: vec![0.0; n * species],
            parts: vec![0.0; gatherer.parts()],
            source: vec![0.0; n],
            beam: vec![0.0; n],
            disc: DiscRegion::default(),
        }
    }
}

/// Where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn gather_pixel<'a>(worker: &mut Worker<'a>, ray: &Ray) {
    worker.gather(ray);
}

/// Where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn look_up<'a>(worker: &mut Worker<'a>, grid: &SkyGrid, direction: Vec3) {
    worker.look_up(grid, direction);
}

/// Where the processor's vector width is chosen.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
pub fn gather_row<'a>(
    worker: &mut RayWorker<'a>,
    ray: &Ray,
    targets: &[Target],
    azimuths: &EveryOther,
    parts: &mut [f32],
) {
    worker.gather_around(ray, targets, azimuths, parts);
}

impl Worker<'_> {
    /// The radiance along a ray, without the sun's disc: the line integrals themselves.
    #[inline(always)]
    fn gather(&mut self, ray: &Ray) {
        let g = self.gatherer;
        let ray = Ray {
            direction: self.with_a_meridian(ray.direction),
            ..*ray
        };
        let target = Target {
            cos_sun: g.sun.direction.z,
            cos_theta: ray.direction.dot(g.sun.direction),
        };
        self.rays.gather(&ray, &[target], &mut self.parts);
        self.combine(ray.direction);
    }

    /// The same, interpolated on a grid.
    #[inline(always)]
    fn look_up(&mut self, grid: &SkyGrid, direction: Vec3) {
        let direction = self.with_a_meridian(direction);
        grid.interpolate(direction, &mut self.parts);
        self.combine(direction);
    }

    /// A direction with a vertical plane of its own, if polarisation is wanted: straight up or down it is that of the azimuth as
    /// far as there is one, else of north and south.
    #[inline(always)]
    fn with_a_meridian(&self, direction: Vec3) -> Vec3 {
        /// Slope at which the azimuth from the sun keeps its digits \[rad\].
        const SLOPE: f64 = 1e-4;
        let across = direction.x.hypot(direction.y);
        if !self.gatherer.stokes || across >= SLOPE {
            return direction;
        }
        let (x, y) = if across > 0.0 {
            (direction.x / across, direction.y / across)
        } else {
            (0.0, 1.0)
        };
        Vec3::new(SLOPE * x, SLOPE * y, direction.z).normalized()
    }

    /// The radiance from its parts: `Σ_k p_k(Θ) J_k`, and all that is smooth.
    #[inline(always)]
    fn combine(&mut self, direction: Vec3) {
        let g = self.gatherer;
        let medium = &g.tables.medium;
        let n = medium.lanes();
        let (radiance, q_u) = self.radiance.split_at_mut(n);
        let cos_theta = direction.dot(g.sun.direction);
        for (row, phase) in self.phases.chunks_exact_mut(n).zip(medium.phases()) {
            phase.eval(cos_theta, row);
        }
        combine(&self.phases, &self.parts, &g.sun.irradiance, radiance);
        if !g.stokes {
            return;
        }
        // What is scattered once is polarised along the plane of view and sun or across it.
        let (q, u) = q_u.split_at_mut(n);
        self.beam.fill(0.0);
        for (phase, single) in medium.phases().iter().zip(self.parts.chunks_exact(n)) {
            phase.add_f12(cos_theta, single, &mut self.beam);
        }
        let sun = g.sun.direction;
        let turn = Turn::new(across_meridian(direction), direction, sun);
        // φ̂ of arriving light is that of the view turned round, and U is odd about the sun's plane.
        let side = sun.x * direction.y - sun.y * direction.x;
        let sign = if side > 0.0 { -1.0 } else { 1.0 };
        let smooth = &self.parts[self.phases.len() + n..];
        for (i, &e) in g.sun.irradiance.iter().enumerate() {
            q[i] = (turn.cos2 * self.beam[i] + smooth[i]) * e;
            u[i] = (sign * smooth[n + i] - turn.sin2 * self.beam[i]) * e;
        }
    }

    /// The sun's disc behind the true air, by its share of the pixel.
    fn add_disc(&mut self, ray: &Ray, look: impl Fn(f64, f64) -> Option<Vec3>) {
        let g = self.gatherer;
        let sun = g.sun;
        self.disc.find(sun, &look);
        if self.disc.is_empty() {
            return;
        }
        let mut hits = Vec::new();
        let keep = |direction, mu_squared, area| hits.push((direction, mu_squared, area));
        self.disc.grid(sun, &look, DISC_POINTS, keep);
        if hits.is_empty() {
            return;
        }
        let part_seen = part_seen(&look);
        let medium = &g.tables.medium;
        let columns = &g.tables.true_columns;
        let (mut start, mut tangent, mut through) = (
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
            vec![0.0; columns.count()],
        );
        for (direction, mu_squared, area) in &hits {
            let view = Ray {
                origin: ray.origin,
                direction: *direction,
            };
            self.beam.fill(1.0);
            if let Some((span, ground)) =
                view.through_air(medium.ground_radius_m(), medium.top_radius_m())
            {
                if ground {
                    continue;
                }
                let inside = Ray {
                    origin: view.at(span.start_m),
                    direction: *direction,
                };
                RayColumns::new(columns, &inside, &mut start, &mut tangent).to_space(&mut through);
                columns.optical_depth(&through, &mut self.source);
                lanes::exp_neg(&self.source, &mut self.beam);
            }
            sun.limb(*mu_squared, &mut self.beam);
            let scale = (area / (part_seen * sun.solid_angle_sr())) as f32;
            for ((l, &b), &e) in self
                .radiance
                .iter_mut()
                .zip(&self.beam)
                .zip(&sun.irradiance)
            {
                *l += b * e * scale;
            }
        }
    }
}

/// The part of a pixel that the sensor sees.
fn part_seen(look: &impl Fn(f64, f64) -> Option<Vec3>) -> f64 {
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    if corners.iter().all(|&(u, v)| look(u, v).is_some()) {
        return 1.0;
    }
    let place = |k: usize| (k as f64 + 0.5) / VIEW_POINTS as f64;
    let points =
        (0..VIEW_POINTS * VIEW_POINTS).map(|i| (place(i % VIEW_POINTS), place(i / VIEW_POINTS)));
    let seen = points.filter(|&(u, v)| look(u, v).is_some()).count();
    seen.max(1) as f64 / (VIEW_POINTS * VIEW_POINTS) as f64
}

/// `out = E (Σ_k p_k J_k + M)`; `parts` holds `J_k` for every species and `M` last.
#[inline(always)]
pub fn combine(phases: &[f32], parts: &[f32], irradiance: &[f32], out: &mut [f32]) {
    let n = out.len();
    let (single, rest) = parts.split_at(phases.len());
    out.copy_from_slice(&rest[..n]);
    for (p, j) in phases.chunks_exact(n).zip(single.chunks_exact(n)) {
        for ((o, &p), &j) in out.iter_mut().zip(p).zip(j) {
            *o += p * j;
        }
    }
    for (o, &e) in out.iter_mut().zip(irradiance) {
        *o = o.max(0.0) * e;
    }
}

/// Line integrals along rays, without phase functions: memory of one thread.
pub struct RayWorker<'a> {
    gatherer: &'a Gatherer<'a>,
    march: March,
    along: Along,
    sunlit: Sunlit,
    /// Each species' scattering at a point times the weight of the step, shape (species, lanes).
    scattering: Vec<f32>,
    present: Vec<bool>,
    beam: Vec<f32>,
    /// Multiple scattering, good at few wavelengths and rough at all, shape (target, lanes).
    few: Vec<f32>,
    rough: Vec<f32>,
    share: Vec<f32>,
    /// Multiple scattering at every other azimuth, shape (target, components, lanes).
    every_other: Vec<f32>,
}

impl<'a> RayWorker<'a> {
    pub fn new(gatherer: &'a Gatherer<'a>) -> Self {
        let Tables { fine, medium, .. } = gatherer.tables;
        let n = medium.lanes();
        let species = medium.phases().len();
        Self {
            gatherer,
            march: March::default(),
            along: Along::default(),
            sunlit: Sunlit::new(&fine.columns, n, gatherer.sun.angular_radius_rad()),
            scattering: vec![0.0; n * species],
            present: vec![false; species],
            beam: vec![0.0; n],
            few: Vec::new(),
            rough: Vec::new(),
            share: vec![0.0; n],
            every_other: Vec::new(),
        }
    }

    /// For one ray under suns in several azimuths: each species' `J_k = ∫ σ_k T T_sun ds`, which becomes single scattering
    /// when multiplied by its phase function, and last everything else: light reflected by the ground, and multiple
    /// scattering, and its Q and U if they are wanted. All for a sun of unit irradiance.
    ///
    /// Q and U refer to (θ̂, φ̂) of the view, φ in [0, π] from the sun's azimuth.
    ///
    /// * `parts` — shape (target, species + components, lanes)
    #[inline(always)]
    pub fn gather(&mut self, ray: &Ray, targets: &[Target], parts: &mut [f32]) {
        parts.fill(0.0);
        let Some((inside, stand)) = self.enter(ray) else {
            return;
        };
        self.add_single(&inside, stand, targets, parts);
        self.add_multiple(&inside, stand, targets, parts, self.scattering.len());
    }

    /// [`RayWorker::gather`] at all azimuths of a grid, with multiple scattering found at every other one.
    #[inline(always)]
    pub fn gather_around(
        &mut self,
        ray: &Ray,
        targets: &[Target],
        azimuths: &EveryOther,
        parts: &mut [f32],
    ) {
        parts.fill(0.0);
        let Some((inside, stand)) = self.enter(ray) else {
            return;
        };
        self.add_single(&inside, stand, targets, parts);
        let n = self.gatherer.tables.medium.lanes();
        let every_other: Vec<Target> = targets.iter().step_by(2).copied().collect();
        let mut found = std::mem::take(&mut self.every_other);
        found.clear();
        found.resize(every_other.len() * self.gatherer.components() * n, 0.0);
        self.add_multiple(&inside, stand, &every_other, &mut found, 0);
        let stride = parts.len() / targets.len();
        azimuths.add(&found, parts, stride, self.scattering.len(), n);
        self.every_other = found;
    }

    /// A ray from where it meets the air, and where its observer stands; none if there is nothing to be seen along it.
    #[inline(always)]
    fn enter(&self, ray: &Ray) -> Option<(Ray, Stand)> {
        let g = self.gatherer;
        if g.max_order == Some(0) {
            return None;
        }
        let medium = &g.tables.medium;
        let (span, _) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m())?;
        let inside = Ray {
            origin: ray.at(span.start_m),
            direction: ray.direction,
        };
        let stand = Stand {
            radius_m: ray.origin.length(),
            offset_m: span.start_m,
        };
        Some((inside, stand))
    }

    /// Multiple scattering.
    ///
    /// * `out` — a row of each target; `first` — where in a row the components begin
    #[inline(always)]
    fn add_multiple(
        &mut self,
        inside: &Ray,
        stand: Stand,
        targets: &[Target],
        out: &mut [f32],
        first: usize,
    ) {
        let g = self.gatherer;
        let Tables {
            few,
            rough,
            medium,
            levels,
            rough_levels,
            ..
        } = g.tables;
        let Some(fields) = g.tables.fields.as_ref().filter(|_| g.max_order != Some(1)) else {
            return;
        };
        let n = medium.lanes();
        self.march.cut(&few.medium, &few.columns, levels, inside);
        self.few.clear();
        let few_stride = g.components() * few.medium.lanes();
        self.few.resize(targets.len() * few_stride, 0.0);
        self.along.add_scattered(
            (&fields.few, few, &g.tables.bases),
            &g.tables.few_albedo,
            &self.march,
            stand,
            targets,
            &mut self.few,
        );
        self.march
            .cut(&rough.medium, &rough.columns, rough_levels, inside);
        self.rough.clear();
        self.rough.resize(targets.len() * g.components() * n, 0.0);
        self.along.add_scattered(
            (&fields.rough, rough, &g.tables.rough_bases),
            &g.tables.albedo,
            &self.march,
            stand,
            targets,
            &mut self.rough,
        );
        let stride = out.len() / targets.len();
        let both = self
            .few
            .chunks_exact(few_stride)
            .zip(self.rough.chunks_exact(g.components() * n));
        let spread = &g.tables.spread;
        for (out, (few_found, rough_found)) in out.chunks_exact_mut(stride).zip(both) {
            let mut few_found = few_found.chunks_exact(few.medium.lanes());
            let mut rough_found = rough_found.chunks_exact(n);
            let mut rest = out[first..].chunks_exact_mut(n);
            let (Some(few), Some(rough), Some(out)) =
                (few_found.next(), rough_found.next(), rest.next())
            else {
                continue;
            };
            spread.add(few, rough, &mut self.beam, out);
            for ((f, r), out) in few_found.zip(rough_found).zip(rest) {
                spread.add_component([few, f], [rough, r], &self.beam, &mut self.share, out);
            }
        }
    }

    /// Sunlight scattered once, by species, and reflected by the ground.
    #[inline(always)]
    fn add_single(&mut self, inside: &Ray, stand: Stand, targets: &[Target], parts: &mut [f32]) {
        let Tables {
            fine,
            medium,
            albedo,
            levels,
            ..
        } = self.gatherer.tables;
        self.march.cut(&fine.medium, &fine.columns, levels, inside);
        let n = medium.lanes();
        let stride = parts.len() / targets.len();
        let march = &self.march;
        for (step, weights) in march.steps.iter().zip(march.weights.chunks_exact(n)) {
            let place = medium.locate_radius(step.radius_m);
            for (k, row) in self.scattering.chunks_exact_mut(n).enumerate() {
                medium.species_at(k, place, row);
                for (s, &w) in row.iter_mut().zip(weights) {
                    *s *= w;
                }
                self.present[k] = row.iter().any(|&s| s > 0.0);
            }
            for (target, parts) in targets.iter().zip(parts.chunks_exact_mut(stride)) {
                let mu_sun = stand.mu_sun(target, step.distance_m, step.radius_m);
                let beam = &mut self.beam;
                if !fine.sun_transmittance(&mut self.sunlit, step.radius_m, mu_sun, beam) {
                    continue;
                }
                let species = self.scattering.chunks_exact(n).zip(&self.present);
                for (part, (sigma, &present)) in parts.chunks_exact_mut(n).zip(species) {
                    if present {
                        for ((p, &s), &t) in part.iter_mut().zip(sigma).zip(beam.iter()) {
                            *p += s * t;
                        }
                    }
                }
            }
        }
        if !march.meets_ground {
            return;
        }
        let ground_m = medium.ground_radius_m();
        for (target, parts) in targets.iter().zip(parts.chunks_exact_mut(stride)) {
            let mu_sun = stand.mu_sun(target, march.length_m, ground_m);
            let beam = &mut self.beam;
            if mu_sun <= -self.sunlit.radius_rad
                || !fine.sun_transmittance(&mut self.sunlit, ground_m, mu_sun, beam)
            {
                continue;
            }
            let factor = (mu_sun.max(0.0) / std::f64::consts::PI) as f32;
            let ground = albedo.iter().zip(&march.through);
            let first = medium.phases().len() * n;
            let rest = &mut parts[first..first + n];
            for ((o, &b), (&a, &t)) in rest.iter_mut().zip(beam.iter()).zip(ground) {
                *o += factor * b * a * t;
            }
        }
    }
}
