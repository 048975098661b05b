//! What `path` does on one path: the walk from vertex to vertex.

use super::first_order::{columns_to_sun, FirstOrder, Rows};
use super::guide::Guide;
use super::guided::Lead;
use super::present::{Peak, Present};
use super::scene::Scene;
use super::stokes::Stokes;
use super::way::{Draws, Leg, Way};
use super::weights::Weights;
use crate::math::lanes::{self, blocks, blocks_mut, each, Block, BLOCK};
use crate::math::{Sampler, Vec3};
use crate::medium::{Columns, LayeredMedium, Medium, Ray, RayColumns};

/// Sine of the sun's elevation where a pixel looks below which a guide leads its paths.
pub(super) const GUIDED_BELOW: f64 = 0.035;

/// Share of what the first collision could scatter, below which Russian roulette begins; the best of several measured.
const ROULETTE_BELOW: f32 = 0.1;

/// Share of the scattered directions that are drawn about the sun, times the sine of the sun's elevation there, and the largest: the
/// lower the sun, the longer its way through haze, and the more of the light comes from about it. Measured: 0.05 are best under a sun
/// 60° high, 0.1 at 30°, 0.25 at 5° and below.
const ABOUT_SUN: f64 = 0.05;
const MOST_ABOUT_SUN: f64 = 0.25;

/// How far below a vertex's horizon directions are still drawn about the sun, as sine of an angle.
const SUN_IN_REACH: f64 = 0.02;

/// A path that has scattered this often is let go on by roulette alone; it only guards against endless loops in a medium
/// that absorbs nothing over a white ground.
const MAX_VERTICES: u32 = 10_000;

/// Walks paths; holds the rows it works on.
pub(super) struct Walker<'a> {
    pub scene: &'a Scene<'a, LayeredMedium>,
    pub columns: &'a Columns,
    guide: Option<&'a Guide>,
    /// Whether it leads the paths of the present pixel.
    led: bool,
    max_order: u32,
    first: FirstOrder,
    pub weights: Weights,
    pub rows: Rows,
    /// What the first collision could scatter, in all wavelengths.
    pub first_mass: f32,
    /// Probabilities of the wavelengths to place the next collision.
    lost: Vec<f32>,
    /// Their sums over blocks.
    lost_sums: Block,
    /// Phase functions of the species in a direction, shape (species, lanes).
    phase: Vec<f32>,
    /// Whether light comes from outside.
    background: bool,
    /// The peak about the sun from which a share of the directions is drawn.
    peak: Option<&'a Peak>,
    /// How much more sunlight than elsewhere may be found on the present leg, for its direction is close to the sun's.
    gain: f32,
    /// Columns at the start and at the lowest point of the way under work.
    memory: (Vec<f32>, Vec<f32>),
    /// What the path finds, still in units of `first.guess`.
    found: Vec<f32>,
    /// What becomes of polarisation, if anyone wants to know.
    stokes: Option<Stokes>,
}

impl<'a> Walker<'a> {
    pub fn new(
        scene: &'a Scene<'a, LayeredMedium>,
        columns: &'a Columns,
        guide: Option<&'a Guide>,
        peak: Option<&'a Peak>,
        max_order: Option<u32>,
    ) -> Self {
        let medium = scene.medium;
        let (lanes, species) = (medium.lanes(), medium.phases().len());
        Self {
            scene,
            columns,
            guide,
            led: false,
            max_order: max_order.unwrap_or(u32::MAX),
            first: FirstOrder::new(scene),
            weights: Weights::new(medium),
            rows: Rows::new(lanes, columns.count()),
            first_mass: 0.0,
            lost: vec![0.0; lanes],
            lost_sums: [0.0; BLOCK],
            phase: vec![0.0; lanes * species],
            background: scene.background.iter().any(|&l| l > 0.0),
            peak,
            gain: 1.0,
            memory: (vec![0.0; columns.count()], vec![0.0; columns.count()]),
            found: vec![0.0; lanes],
            stokes: None,
        }
    }

    /// The same, with polarisation; `all` for Q, U and V beside the radiance.
    pub fn polarised(mut self, all: bool) -> Self {
        self.stokes = Some(Stokes::new(self.scene.medium, all));
        if all {
            self.first.polarise();
        }
        self
    }

    /// Gets ready for a pixel, by the ray through its centre.
    #[inline(always)]
    pub fn prepare(&mut self, centre: Option<&Ray>) {
        let medium = self.scene.medium;
        self.first
            .prepare(self.scene, self.columns, &mut self.rows, centre);
        self.led = false;
        let (Some(guide), Some(ray)) = (self.guide, centre) else {
            return;
        };
        let Some((span, _)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m())
        else {
            return;
        };
        // An observer in the air counts where it stands, one outside where its ray is lowest.
        let lowest = ray.distance_to_tangent_m().clamp(span.start_m, span.end_m);
        let sun = &self.scene.sun;
        let at = ray.at(if span.start_m > 0.0 { lowest } else { 0.0 });
        self.led = at.dot(sun.direction) < GUIDED_BELOW * at.length();
        if self.led {
            let start = ray.at(span.start_m);
            guide.raise(start, ray.direction, sun, &mut self.first.guess);
        }
    }

    /// Adds `factor` times the radiance of the sun's disc along a ray that meets it.
    #[inline(always)]
    pub fn add_disc(&mut self, ray: &Ray, mu_squared: f64, factor: f32, out: &mut [f32]) {
        let (scene, rows) = (self.scene, &mut self.rows);
        self.first
            .add_disc(scene, self.columns, rows, ray, (mu_squared, factor), out);
    }

    /// Adds one unbiased estimate of the radiance arriving along a ray, at every wavelength.
    #[inline(always)]
    pub fn walk(&mut self, ray: &Ray, sampler: &mut Sampler, out: &mut [f32]) {
        // Light that was not scattered, and light scattered once.
        self.first.add(
            self.scene,
            self.columns,
            &mut self.rows,
            ray,
            self.max_order >= 1,
            sampler,
            out,
        );
        if self.max_order < 2 {
            return;
        }
        // All later orders.
        let medium = self.scene.medium;
        let Some((span, _)) = ray.through_air(medium.ground_radius_m(), medium.top_radius_m())
        else {
            return;
        };
        let at = ray.at(span.start_m);
        let radius_m = at.length();
        let mut leg = Leg {
            at,
            radius_m,
            place: medium.locate_radius(radius_m),
            direction: ray.direction,
        };
        let w = medium.wavelength_nm().len();
        for (weight, &guess) in self.weights.weight[..w].iter_mut().zip(&self.first.guess) {
            *weight = 1.0 / guess;
        }
        self.first_mass = 0.0;
        self.gain = 1.0;
        self.found.fill(0.0);
        if let Some(stokes) = &mut self.stokes {
            stokes.start(ray.direction);
        }
        let mut memory = std::mem::take(&mut self.memory);
        for order in 1..=self.max_order.min(MAX_VERTICES) {
            let next = match self.guide {
                Some(guide) if self.led => {
                    self.collide_guided(guide, &leg, order, sampler, &mut memory)
                }
                _ => self.collide(&leg, order, sampler, &mut memory),
            };
            match next {
                Some(next) if order < self.max_order => leg = next,
                _ => break,
            }
        }
        self.memory = memory;
        for ((o, &f), &guess) in out.iter_mut().zip(&self.found).zip(&self.first.guess) {
            *o += f * guess;
        }
        if let Some(stokes) = &self.stokes {
            stokes.add_found(&self.first.guess, out);
        }
    }

    /// Forces the next collision, in the air or with the ground; finds the sun there, unless it is the first vertex,
    /// whose sun the line integral has found; and leaves in a new direction.
    ///
    /// `None` when roulette ends the path, or there is nothing to meet. `memory` is that of [`RayColumns`].
    #[inline(always)]
    fn collide(
        &mut self,
        leg: &Leg,
        order: u32,
        sampler: &mut Sampler,
        memory: &mut (Vec<f32>, Vec<f32>),
    ) -> Option<Leg> {
        let u = Draws::new(sampler);
        let way = Way::new(leg, self.scene.medium)?;
        let along = RayColumns::along(self.columns, way.geometry, &mut memory.0, &mut memory.1);
        if way.meets_ground {
            along.to(way.length_m, &mut self.rows.columns);
        } else {
            along.to_space(&mut self.rows.columns);
        }
        let in_air = self.look_ahead(order, way.meets_ground);
        let on_ground = if way.meets_ground {
            lanes::sum(&self.rows.transmittance)
        } else {
            0.0
        };
        let mass = in_air + on_ground;
        if order == 1 {
            self.first_mass = mass;
        }
        let survival = mass * self.gain / (ROULETTE_BELOW * self.first_mass);
        // Asked this way round, a weight that is not a number ends the path too; so do the checks below.
        let survives = survival > 0.0 && (u.roulette as f32) < survival;
        if !survives {
            return None;
        }
        let survival = survival.min(1.0);
        // What the sun sends by way of the ground is found whichever way the path goes on: by day that halves the variance.
        if way.meets_ground && order > 1 {
            self.find_sun_on_ground(leg, &way, 1.0 / survival);
        }
        let mass = mass / survival;
        // Far collisions and the ground behind them lie side by side in the range of one number.
        let before_ground = f64::from(in_air / (in_air + on_ground));
        if u.way >= before_ground {
            return self.meet_ground(leg, &way, mass / on_ground, &u);
        }

        // One wavelength places the collision.
        let lane = lanes::pick_by(&self.lost, &self.lost_sums, u.wavelength as f32 * in_air);
        let tau_end = self.columns.optical_depth_at(&self.rows.columns, lane);
        let (_, loss) = lanes::exp_and_loss(tau_end as f32);
        let wanted = -(-u.way / before_ground * f64::from(loss)).ln_1p();
        let medium = self.scene.medium;
        let sigma = medium.extinction_at(lane, leg.place);
        let distance_m = along.invert(lane, sigma, wanted, way.length_m, &mut self.rows.columns);
        let radius_m = way.geometry.radius_at(distance_m);
        let place = medium.locate_radius(radius_m);
        let at = leg.at + leg.direction * distance_m;
        // Mean density of collisions here over all wavelengths: Σ w σ_t T / mass.
        let density = self.arrive(place);
        let scale = mass / density;
        let usable = scale > 0.0 && scale.is_finite() && self.weights.total > 0.0;
        if !usable {
            return None;
        }
        if order > 1 {
            self.find_sun(at, radius_m, leg.direction, scale);
        }
        let direction = self.scatter(at, radius_m, leg.direction, scale, u.turn, None);
        Some(Leg {
            at,
            radius_m,
            place,
            direction,
        })
    }

    /// From the columns to the end of a way: what each wavelength loses in the air on it (`lost`), and what reaches the ground
    /// and comes back (`rows.transmittance`). Returns the sum of the former.
    #[inline(always)]
    pub fn look_ahead(&mut self, order: u32, meets_ground: bool) -> f32 {
        let arriving = if meets_ground {
            &self.scene.albedo
        } else {
            &self.scene.background
        };
        let arrives = meets_ground || self.background;
        let mut in_air = [0.0; BLOCK];
        let rows = blocks(&self.weights.weight).zip(blocks(arriving));
        let out = blocks_mut(&mut self.lost).zip(blocks_mut(&mut self.rows.transmittance));
        for (b, ((&weight, &arriving), (lost, reached))) in rows.zip(out).enumerate() {
            let tau = self.columns.optical_depth_block(&self.rows.columns, b);
            if arrives {
                *reached = each(|i| weight[i] * lanes::exp_and_loss(tau[i]).0 * arriving[i]);
            }
            let gone = each(|i| weight[i] * lanes::exp_and_loss(tau[i]).1);
            in_air = each(|i| in_air[i] + gone[i]);
            *lost = gone;
        }
        if self.background && !meets_ground && order > 1 {
            let light = &self.rows.transmittance;
            match &mut self.stokes {
                Some(stokes) => stokes.find_unpolarised(light, &mut self.found),
                None => lanes::add_scaled(light, 1.0, &mut self.found),
            }
        }
        self.lost_sums = in_air;
        lanes::tree_sum(in_air)
    }

    /// Adds the sunlight that the ground at the end of a way sends into the path, times `scale`.
    #[inline(always)]
    pub fn find_sun_on_ground(&mut self, leg: &Leg, way: &Way, scale: f32) {
        let at = leg.at + leg.direction * way.length_m;
        let radius_m = at.length();
        let sunward_m = at.dot(self.first.towards_sun);
        if sunward_m <= 0.0 || !self.look_at_sun(radius_m, sunward_m) {
            return;
        }
        let factor = scale * (sunward_m / radius_m / std::f64::consts::PI) as f32;
        let light = &mut self.weights.light;
        let rows = blocks(&self.rows.transmittance).zip(blocks(&self.first.beam));
        for (b, ((&reached, &beam), light)) in rows.zip(blocks_mut(light)).enumerate() {
            let tau = self.columns.optical_depth_block(&self.rows.sun_columns, b);
            let sunlight = lanes::exp_neg_block(&tau);
            *light = each(|i| reached[i] * sunlight[i] * (beam[i] * factor));
        }
        match &mut self.stokes {
            Some(stokes) => stokes.find_unpolarised(light, &mut self.found),
            None => lanes::add_scaled(light, 1.0, &mut self.found),
        }
    }

    /// Goes on from the ground with everything that arrives there, times `scale`: in a direction by the cosine of the law of Lambert, or
    /// a share of the time from the phase function [`Peak`] about the sun, as in [`Walker::scatter`]. `None` for a
    /// direction of the latter that leads into the ground.
    #[inline(always)]
    pub fn meet_ground(&mut self, leg: &Leg, way: &Way, scale: f32, u: &Draws) -> Option<Leg> {
        let at = leg.at + leg.direction * way.length_m;
        let radius_m = at.length();
        let normal = at * (1.0 / radius_m);
        let sun = self.first.towards_sun;
        let mut turn = u.turn;
        let lead = self.about_sun(at.dot(sun), radius_m, &mut turn);
        let (mut direction, mut factor) =
            (normal.deflected_by_turn(turn[0].sqrt(), turn[1]), scale);
        let mut gain = 1.0;
        if let Some((peak, share, chosen)) = lead {
            if chosen {
                direction = sun.deflected_by_turn(peak.sample(turn[0]), turn[1]);
            }
            let lambertian = direction.dot(normal) / std::f64::consts::PI;
            let leaves = lambertian > 0.0;
            if !leaves {
                return None;
            }
            let about_sun = peak.density(direction.dot(sun));
            factor *= (lambertian / ((1.0 - share) * lambertian + share * about_sun)) as f32;
            gain = peak.gain(about_sun);
        }
        self.gain = gain;
        let arrived = self.rows.transmittance.iter();
        for (w, &arrived) in self.weights.weight.iter_mut().zip(arrived) {
            *w = arrived * factor;
        }
        if let Some(stokes) = &mut self.stokes {
            stokes.depolarise();
        }
        Some(Leg {
            at,
            radius_m,
            place: (0, 0.0),
            direction,
        })
    }

    /// The peak from which directions about the sun are drawn, the share of them, and whether `u[0]` says that this is one; what is
    /// left of `u[0]` is uniform again. `None` where that is of no use. `sunward_m` is the vertex's height above the plane through the
    /// planet's centre that faces the sun.
    #[inline(always)]
    fn about_sun(
        &self,
        sunward_m: f64,
        radius_m: f64,
        u: &mut [f64; 3],
    ) -> Option<(&Peak, f64, bool)> {
        let peak = self.peak?;
        if !self.sun_in_reach(sunward_m, radius_m) {
            return None;
        }
        let lowest_m = ABOUT_SUN / MOST_ABOUT_SUN * radius_m;
        let share = ABOUT_SUN * radius_m / sunward_m.max(lowest_m);
        let chosen = u[0] < share;
        u[0] = if chosen {
            u[0] / share
        } else {
            (u[0] - share) / (1.0 - share)
        };
        Some((peak, share, chosen))
    }

    /// Takes the weights, by the columns to a collision, through the air up to it, and splits them over the species that
    /// scatter there. Returns the sum of weights times extinction.
    #[inline(always)]
    pub fn arrive(&mut self, (i, t): (usize, f32)) -> f32 {
        let medium = self.scene.medium;
        let n = medium.lanes();
        let (below, above) = (medium.extinction_row(i), medium.extinction_row(i + 1));
        let Weights {
            weight,
            split,
            split_sum,
            split_sums,
            total,
            ..
        } = &mut self.weights;
        let mut density = [0.0; BLOCK];
        let rows = blocks_mut(weight).zip(blocks(below).zip(blocks(above)));
        for (b, (weight, (below, above))) in rows.enumerate() {
            let tau = self.columns.optical_depth_block(&self.rows.columns, b);
            let (transmittance, before) = (lanes::exp_neg_block(&tau), *weight);
            let sigma = lanes::lerp_block(below, above, t);
            let arrived = each(|i| before[i] * transmittance[i]);
            density = each(|i| density[i] + arrived[i] * sigma[i]);
            *weight = arrived;
        }
        *total = 0.0;
        for &k in &self.first.scatterers {
            let (below, above) = (medium.species_row(k, i), medium.species_row(k, i + 1));
            let row = &mut split[k * n..(k + 1) * n];
            let mut sum = [0.0; BLOCK];
            let rows = blocks(weight).zip(blocks(below).zip(blocks(above)));
            for (row, (&weight, (below, above))) in blocks_mut(row).zip(rows) {
                let sigma = lanes::lerp_block(below, above, t);
                let scattered = each(|i| weight[i] * sigma[i]);
                sum = each(|i| sum[i] + scattered[i]);
                *row = scattered;
            }
            split_sums[k] = sum;
            split_sum[k] = lanes::tree_sum(sum);
            *total += split_sum[k];
        }
        lanes::tree_sum(density)
    }

    /// Columns towards the sun; `false` where the planet stands before it.
    #[inline(always)]
    fn look_at_sun(&mut self, radius_m: f64, sunward_m: f64) -> bool {
        let Rows {
            sun_columns,
            sun_scratch,
            ..
        } = &mut self.rows;
        columns_to_sun(self.columns, radius_m, sunward_m, sun_columns, sun_scratch)
    }

    /// Whether a vertex sees the sun above its horizon, which from aloft lies below the horizontal, or close to it: a peak about a sun
    /// that has just set there still lights the haze above. `sunward_m` is the vertex's height above the plane through the planet's
    /// centre that faces the sun.
    #[inline(always)]
    fn sun_in_reach(&self, sunward_m: f64, radius_m: f64) -> bool {
        let depth_m = -(sunward_m + SUN_IN_REACH * radius_m);
        let ground_m = self.columns.ground_m();
        // Where the horizon is, sin² = 1 − (R / r)².
        depth_m < 0.0 || depth_m * depth_m < (radius_m - ground_m) * (radius_m + ground_m)
    }

    /// Adds the sunlight that a vertex in the air sends into the path: Σ_k split_k p_k × transmittance × irradiance.
    #[inline(always)]
    pub fn find_sun(&mut self, at: Vec3, radius_m: f64, direction: Vec3, scale: f32) {
        let towards = self.first.towards_sun;
        if !self.look_at_sun(radius_m, at.dot(towards)) {
            return;
        }
        let Weights {
            split,
            split_sum,
            light,
            scratch,
            ..
        } = &mut self.weights;
        let medium = self.scene.medium;
        let present = Present {
            species: &self.first.scatterers,
            split_sum,
        };
        present.evaluate(medium.phases(), direction.dot(towards), &mut self.phase);
        let n = self.found.len();
        let rows = blocks_mut(light).zip(blocks_mut(scratch));
        for (b, ((light, mixed), &beam)) in rows.zip(blocks(&self.first.beam)).enumerate() {
            let tau = self.columns.optical_depth_block(&self.rows.sun_columns, b);
            let sunlight = lanes::exp_neg_block(&tau);
            let mix = present.mix(split, &self.phase, n, b);
            *light = each(|i| mix[i] * sunlight[i] * (beam[i] * scale));
            *mixed = mix;
        }
        match &mut self.stokes {
            None => lanes::add_scaled(light, 1.0, &mut self.found),
            Some(stokes) => stokes.find_sun(
                medium,
                (split, split_sum),
                scratch,
                (direction, towards),
                light,
                &mut self.found,
            ),
        }
    }

    /// Draws a direction from the mean of all wavelengths' phase functions, or a share of the time from [`Peak`] about the sun, and
    /// goes on with the weights divided by the density of both together.
    ///
    /// The next vertex sees the sun through its phase function, whose peak a path would rarely meet by itself: drawing
    /// the direction from that peak first makes both vertices' peaks common.
    #[inline(always)]
    pub fn scatter(
        &mut self,
        at: Vec3,
        radius_m: f64,
        direction: Vec3,
        scale: f32,
        mut u: [f64; 3],
        lead: Option<(&Guide, &Lead)>,
    ) -> Vec3 {
        let (medium, sun) = (self.scene.medium, self.first.towards_sun);
        let mut led = None;
        if let Some((_, lead)) = lead {
            match lead.lead(u) {
                Ok(direction) => led = Some(direction),
                Err(rest) => u = rest,
            }
        }
        let about_sun = self.about_sun(at.dot(sun), radius_m, &mut u);
        let new = match (led, about_sun) {
            (Some(new), _) => new,
            (None, Some((peak, _, true))) => sun.deflected_by_turn(peak.sample(u[1]), u[2]),
            (None, _) => self.weights.draw(medium, direction, u),
        };
        let (mut about_sun_density, mut share, mut gain) = (0.0, 0.0, 1.0);
        if let Some((peak, s, _)) = about_sun {
            let density = peak.density(sun.dot(new));
            (about_sun_density, share, gain) = (density as f32, s as f32, peak.gain(density));
        }
        let Weights {
            weight,
            split,
            split_sum,
            total,
            ..
        } = &mut self.weights;
        let present = Present {
            species: &self.first.scatterers,
            split_sum,
        };
        present.evaluate(medium.phases(), direction.dot(new), &mut self.phase);
        let n = weight.len();
        let mut mixed = [0.0; BLOCK];
        for (b, weight) in blocks_mut(weight).enumerate() {
            let light = present.mix(split, &self.phase, n, b);
            mixed = each(|i| mixed[i] + light[i]);
            *weight = light;
        }
        if let Some(stokes) = &mut self.stokes {
            stokes.scatter(medium, (split, split_sum), weight, (direction, new));
        }
        let mut density =
            share * about_sun_density + (1.0 - share) * lanes::tree_sum(mixed) / *total;
        if let Some((guide, lead)) = lead {
            density = lead.mixed(guide, new, density);
        }
        // A density of zero (a hole in a table, met by rounding) ends the path.
        let factor = if density > 0.0 { scale / density } else { 0.0 };
        lanes::scale(weight, factor);
        self.gain = gain;
        new
    }
}
