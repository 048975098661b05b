//! What `path` does: it takes paths from vertex to vertex, several side by side.
//!
//! What one path does next waits for what it did before: a lookup for the distance, the distance for a random choice. While it waits
//! the processor works on the next path, if that does the same thing. So paths walk together, and each thing is done for all of
//! them before the next one (`docs/decisions/0018-paths-side-by-side.md` and 0019). They share nothing but memory: each comes out as
//! it would alone.

use multiversion::multiversion;

use super::first_order::{FirstOrder, Sunbeam};
use super::guide::Guide;
use super::present::Peak;
use super::render::Start;
use super::scene::Scene;
use super::stokes::Stokes;
use super::traveller::{Departure, Traveller};
use super::way::Way;
use super::weights::Weights;
use crate::math::lanes::{self, Block, BLOCK};
use crate::medium::{all, Columns, LayeredMedium, Lookups, Medium, Ray, Search, RAYS};

/// Paths that walk side by side.
const PATHS: usize = RAYS;

/// Sine of the sun's elevation where a pixel looks below which a guide leads its paths.
pub(super) const GUIDED_BELOW: f64 = 0.075;

/// Share of what the first collision could scatter, below which Russian roulette begins; the best of several measured.
const ROULETTE_BELOW: f32 = 0.1;

/// A path that has scattered this often is let go on by roulette alone; it only guards against endless loops in a medium
/// that absorbs nothing over a white ground.
const MAX_VERTICES: u32 = 10_000;

/// Walks paths; holds the rows it works on.
pub(super) struct Walker<'a> {
    pub scene: &'a Scene<'a, LayeredMedium>,
    pub columns: &'a Columns,
    pub guide: Option<&'a Guide>,
    /// Whether it leads the paths of the present pixel.
    pub led: bool,
    pub max_order: u32,
    pub first: FirstOrder<'a>,
    /// What paths carry at their start.
    pub start_weight: Vec<f32>,
    /// Phase functions of the species in a direction, shape (species, lanes).
    pub phase: Vec<f32>,
    /// Whether light comes from outside.
    pub background: bool,
    /// The peak about the sun from which a share of the directions is drawn.
    pub peak: Option<&'a Peak>,
    /// The weights of the path at hand, split by species at a collision.
    pub weights: Weights,
    /// What each wavelength loses in the air on the way at hand, and the sums over blocks.
    pub lost: Vec<f32>,
    pub lost_sums: Block,
    /// What reaches the end of that way and comes back, from the ground or the universe.
    pub reached: Vec<f32>,
    /// Light on its way to the result, and `Σ split · F11` of it, one row each.
    pub light: Vec<f32>,
    pub mixed: Vec<f32>,
    /// Optical depths under work, one row, and columns towards the sun.
    pub tau: Vec<f32>,
    pub sun_columns: Vec<f32>,
    pub sun_scratch: Vec<f32>,
    /// A beam for the sun's disc.
    disc: Sunbeam,
    pub departures: Vec<Departure>,
    pub travellers: Vec<Traveller>,
    pub search: Search<'a>,
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
            max_order: max_order.unwrap_or(u32::MAX).min(MAX_VERTICES),
            first: FirstOrder::new(scene, columns),
            start_weight: vec![0.0; lanes],
            phase: vec![0.0; lanes * species],
            background: scene.background.iter().any(|&l| l > 0.0),
            peak,
            weights: Weights::new(medium),
            lost: vec![0.0; lanes],
            lost_sums: [0.0; BLOCK],
            reached: vec![0.0; lanes],
            light: vec![0.0; lanes],
            mixed: vec![0.0; lanes],
            tau: vec![0.0; lanes],
            sun_columns: vec![0.0; columns.count()],
            sun_scratch: vec![0.0; columns.count()],
            disc: Sunbeam::middle(&scene.sun),
            departures: (0..RAYS).map(|_| Departure::new(scene)).collect(),
            travellers: (0..PATHS).map(|_| Traveller::new(scene, columns)).collect(),
            search: Search::new(columns, medium),
        }
    }

    /// The same, with polarisation; `all` for Q, U and V beside the radiance.
    pub fn polarised(mut self, all: bool) -> Self {
        for t in &mut self.travellers {
            t.stokes = Some(Stokes::new(self.scene.medium, all));
        }
        if all {
            self.first.polarise();
        }
        self
    }

    /// Gets ready for a pixel, by the ray through its centre.
    #[inline(always)]
    pub fn prepare(&mut self, centre: Option<&Ray>) {
        self.guess(centre);
        self.set_weights();
    }

    /// Guesses the pixel's spectrum, and whether a guide leads its paths.
    #[inline(always)]
    fn guess(&mut self, centre: Option<&Ray>) {
        let medium = self.scene.medium;
        self.first.prepare(centre);
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

    /// What paths of this pixel carry at their start: one over the guess, so that errors count relative to it.
    #[inline(always)]
    fn set_weights(&mut self) {
        let w = self.scene.medium.wavelength_nm().len();
        for (weight, &guess) in self.start_weight[..w].iter_mut().zip(&self.first.guess) {
            *weight = 1.0 / guess;
        }
    }

    /// Adds `factor` times the radiance of the sun's disc along a ray that meets it.
    #[inline(always)]
    pub fn add_disc(&mut self, ray: &Ray, mu_squared: f64, factor: f32, out: &mut [f32]) {
        self.first
            .add_disc(ray, (mu_squared, factor), &mut self.disc, out);
    }

    /// Adds one unbiased estimate of the radiance arriving along each ray, at every wavelength.
    #[inline(always)]
    pub fn walk(&mut self, starts: &mut [Start], out: &mut [f32]) {
        let mut travellers = std::mem::take(&mut self.travellers);
        let mut departures = std::mem::take(&mut self.departures);
        let mut waiting = starts.chunks_mut(RAYS);
        let (mut next, mut ready) = (0, 0);
        loop {
            let mut anyone = false;
            for t in &mut travellers {
                while !t.walking {
                    if next == ready {
                        let Some(starts) = waiting.next() else {
                            break;
                        };
                        first_order(self, starts, &mut departures, out);
                        (next, ready) = (0, starts.len());
                    }
                    self.set_out(t, &mut departures[next]);
                    next += 1;
                }
                anyone |= t.walking;
            }
            if !anyone {
                break;
            }
            match self.guide {
                Some(guide) if self.led => {
                    for t in travellers.iter_mut().filter(|t| t.walking) {
                        t.walking = collide_guided(self, guide, t);
                    }
                }
                _ => self.collide(&mut travellers),
            }
            for t in travellers
                .iter_mut()
                .filter(|t| t.order > 0 && !t.searching)
            {
                t.order += 1;
                t.walking &= t.order <= self.max_order;
                if !t.walking {
                    self.bring_home(t, out);
                }
            }
        }
        self.travellers = travellers;
        self.departures = departures;
    }

    /// Sends a path along its first ray, unless that sees no air.
    #[inline(always)]
    fn set_out(&self, t: &mut Traveller, departure: &mut Departure) {
        let Some(leg) = departure.leg.take_if(|_| self.max_order >= 2) else {
            return;
        };
        t.leg = leg;
        std::mem::swap(&mut t.beam, &mut departure.beam);
        std::mem::swap(&mut t.sampler, &mut departure.sampler);
        t.weight.copy_from_slice(&self.start_weight);
        t.first_mass = 0.0;
        t.gain = 1.0;
        t.found.fill(0.0);
        if let Some(stokes) = &mut t.stokes {
            stokes.start(t.leg.direction);
        }
        t.order = 1;
        t.walking = true;
    }

    /// Adds what a path has found to the result.
    #[inline(always)]
    fn bring_home(&self, t: &mut Traveller, out: &mut [f32]) {
        for ((o, &f), &guess) in out.iter_mut().zip(&t.found).zip(&self.first.guess) {
            *o += f * guess;
        }
        if let Some(stokes) = &t.stokes {
            stokes.add_found(&self.first.guess, out);
        }
        t.order = 0;
    }

    /// Forces the next collision of every path, in the air or with the ground; finds the sun there, unless it is the first vertex,
    /// whose sun the line integral has found; and leaves in a new direction.
    ///
    /// Paths end where roulette says so, or there is nothing to meet. One whose collision is not found yet waits for the next round.
    #[inline(always)]
    fn collide(&mut self, travellers: &mut [Traveller]) {
        survey(self, travellers);
        for t in travellers.iter_mut().filter(|t| t.sets_out()) {
            t.walking = self.decide(t);
        }
        find_collisions(self, travellers);
        self.look_at_sun_from_all(travellers);
        for t in travellers.iter_mut().filter(|t| t.stands_at_collision()) {
            t.walking = self.pass_collision(t);
        }
    }

    /// Takes a path through the collision that it stands at.
    #[inline(always)]
    fn pass_collision(&mut self, t: &mut Traveller) -> bool {
        // Mean density of collisions here over all wavelengths: Σ w σ_t T / mass.
        t.ahead.scale /= self.arrive(t);
        if !self.can_scatter(t) {
            return false;
        }
        // Drawn before its time: while this waits for its roots, sunlight is summed.
        let turn = self.turn(t, None);
        if t.order > 1 && t.sees_sun {
            self.find_sun(t);
        }
        self.scatter(t, &turn, None);
        true
    }

    /// Looks where paths lead, and up columns to the ends of their ways. Those that lead to nothing end.
    #[inline(always)]
    fn survey(&self, travellers: &mut [Traveller]) {
        let columns = self.columns;
        let (mut r, mut s) = ([columns.ground_m(); RAYS], [0.0; RAYS]);
        for (k, t) in travellers.iter_mut().enumerate() {
            if t.sets_out() {
                t.ahead.u.draw(&mut t.sampler);
                let way = Way::new(&t.leg, self.scene.medium);
                t.walking = way.is_some();
                t.ahead.way = way.unwrap_or_default();
                (r[k], s[k]) = (t.leg.radius_m, t.ahead.way.geometry.tangent_m().abs());
            }
        }
        let start = Lookups::new(columns, &r, &s);
        for (k, t) in travellers.iter_mut().enumerate() {
            if t.sets_out() {
                start.columns(columns, k, &mut t.ahead.start);
                (r[k], s[k]) = t.ahead.end(columns.ground_m());
            }
        }
        let end = Lookups::new(columns, &r, &s);
        for (k, t) in travellers.iter_mut().enumerate() {
            if t.sets_out() {
                end.columns(columns, k, &mut t.columns);
                t.ahead.complete(columns, &mut t.columns);
            }
        }
    }

    /// Decides whether a path goes on and whether it collides with the air or the ground, and deals with the latter.
    #[inline(always)]
    fn decide(&mut self, t: &mut Traveller) -> bool {
        let (u, way) = (t.ahead.u, t.ahead.way);
        let in_air = self.look_ahead(t);
        let on_ground = if way.meets_ground {
            lanes::sum(&self.reached)
        } else {
            0.0
        };
        let mass = in_air + on_ground;
        if t.order == 1 {
            t.first_mass = mass;
        }
        let survival = mass * t.gain / (ROULETTE_BELOW * t.first_mass);
        // Asked this way round, a weight that is not a number ends the path too; so do the checks below.
        let survives = survival > 0.0 && (u.roulette as f32) < survival;
        if !survives {
            return false;
        }
        let survival = survival.min(1.0);
        // What the sun sends by way of the ground is found whichever way the path goes on: by day that halves the variance.
        if way.meets_ground && t.order > 1 {
            self.find_sun_on_ground(t, 1.0 / survival);
        }
        let mass = mass / survival;
        // Far collisions and the ground behind them lie side by side in the range of one number.
        let before_ground = f64::from(in_air / (in_air + on_ground));
        t.ahead.collides = u.way < before_ground;
        if !t.ahead.collides {
            return self.meet_ground(t, mass / on_ground);
        }
        // One wavelength places the collision.
        let (lost, sums) = (&self.lost, &self.lost_sums);
        let lane = lanes::pick_by(lost, sums, u.wavelength as f32 * in_air);
        let tau_end = self.columns.optical_depth_at(&t.columns, lane);
        let (_, loss) = lanes::exp_and_loss(tau_end as f32);
        t.ahead.lane = lane;
        t.ahead.lost = u.way / before_ground * f64::from(loss);
        t.ahead.scale = mass;
        true
    }

    /// Searches for where paths collide, and moves those there for whom it is found.
    #[inline(always)]
    fn find_collisions(&mut self, travellers: &mut [Traveller]) {
        let (medium, columns, search) = (self.scene.medium, self.columns, &mut self.search);
        let mut anyone = false;
        for (k, t) in travellers.iter_mut().enumerate() {
            let ahead = &t.ahead;
            if t.sets_out() && ahead.collides {
                let along = ahead.along(columns);
                let (lane, lost) = (ahead.lane, ahead.lost);
                search.begin(k, &along, t.leg.place, lane, lost, ahead.way.length_m);
                t.searching = true;
            }
            anyone |= t.searching;
        }
        if !anyone {
            return;
        }
        search.run();
        for (k, t) in travellers.iter_mut().enumerate() {
            if t.searching && !search.is_searching(k) {
                t.searching = false;
                let along = t.ahead.along(columns);
                let (distance_m, node) = search.found(k, &along, &mut t.columns);
                t.leg.move_to(&t.ahead.way, distance_m);
                t.leg.place = medium.locate_in_shell(node, t.leg.radius_m);
            }
        }
    }

    /// Columns towards the sun from all collisions but the first ones, whose sun the line integral has found.
    #[inline(always)]
    fn look_at_sun_from_all(&self, travellers: &mut [Traveller]) {
        let (mut r, mut s) = ([self.columns.ground_m(); RAYS], [0.0; RAYS]);
        for (k, t) in travellers.iter().enumerate() {
            if t.wants_sun() {
                (r[k], s[k]) = (t.leg.radius_m, t.leg.at.dot(t.beam.towards));
            }
        }
        let upwards = Lookups::new(self.columns, &r, &all(|k| s[k].max(0.0)));
        for (k, t) in travellers.iter_mut().enumerate() {
            if t.wants_sun() {
                t.sees_sun = s[k] >= 0.0;
                if t.sees_sun {
                    upwards.columns(self.columns, k, &mut t.sun_columns);
                } else {
                    t.look_at_sun(self.columns);
                }
            }
        }
    }
}

// What a path does is cut here into functions for every vector width, too: in one piece it takes minutes to compile.

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn first_order<'a>(
    walker: &mut Walker<'a>,
    starts: &mut [Start],
    departures: &mut [Departure],
    out: &mut [f32],
) {
    let scattered = walker.max_order >= 1;
    walker.first.add(starts, scattered, departures, out);
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn collide_guided<'a>(walker: &mut Walker<'a>, guide: &Guide, t: &mut Traveller) -> bool {
    walker.collide_guided(guide, t)
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn survey<'a>(walker: &Walker<'a>, travellers: &mut [Traveller]) {
    walker.survey(travellers);
}

#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn find_collisions<'a>(walker: &mut Walker<'a>, travellers: &mut [Traveller]) {
    walker.find_collisions(travellers);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Rng, Sampler, Vec3};
    use crate::optics::Phase;
    use crate::transport::SunLight;

    const GROUND_M: f64 = 6_360_000.0;

    /// Air and haze over a grey ground.
    fn medium() -> LayeredMedium {
        let altitude_m: Vec<f64> = (0..=40)
            .map(|i| 60_000.0 * (f64::from(i) / 40.0).powi(2))
            .collect();
        let wavelength_nm: Vec<f64> = (0..20).map(|i| 400.0 + 15.0 * f64::from(i)).collect();
        let mut m = LayeredMedium::new(&altitude_m, &wavelength_nm, GROUND_M).unwrap();
        let rows = |height: f64, of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let at = |z: &f64| {
                wavelength_nm
                    .iter()
                    .map(|&w| of(w) * (-z / height).exp())
                    .collect()
            };
            altitude_m
                .iter()
                .flat_map(|z: &f64| -> Vec<f64> { at(z) })
                .collect()
        };
        let air = rows(8000.0, &|w| 4e-5 * (400.0 / w).powi(4));
        let haze = rows(1500.0, &|w| 1.5e-4 * (550.0 / w));
        let none = vec![0.0; air.len()];
        m.add(&air, &none, Phase::rayleigh(&[0.03; 20]).unwrap())
            .unwrap();
        m.add(&haze, &none, Phase::henyey_greenstein(&[0.7; 20]).unwrap())
            .unwrap();
        m
    }

    /// Paths in all directions, each with its own numbers.
    fn starts() -> Vec<Start> {
        let start = |i: u32| Start {
            ray: Ray {
                origin: Vec3::new(0.0, 0.0, GROUND_M + 10.0),
                direction: Vec3::from_azimuth_elevation_deg(
                    f64::from(37 * i),
                    f64::from(i % 89) - 4.0,
                ),
            },
            sampler: Sampler::new(Rng::new(3, u64::from(i)), Some((17, i))),
        };
        (0..300).map(start).collect()
    }

    /// Rationale: paths share nothing but memory. Expected: the sum of 300 paths walked together is that of the same paths walked one
    /// by one, but for the order in which single precision adds them up; by day, led by a guide at sunset, and polarised.
    #[test]
    fn paths_side_by_side_are_those_alone() {
        let m = medium();
        let columns = Columns::new(&m);
        let peak = Peak::new(&m);
        for (sun_deg, polarised) in [(40.0, false), (0.0, false), (40.0, true), (0.0, true)] {
            let towards = Vec3::from_azimuth_elevation_deg(180.0, sun_deg);
            let sun = SunLight::new(towards, m.wavelength_nm(), &[1.0; 20], 0.267).unwrap();
            let scene = Scene::new(&m, sun, &[0.3; 20]).unwrap();
            let guide = (sun_deg < 1.0).then(|| Guide::new(&scene, &columns, peak.as_ref()));
            let walker = || {
                let walker = Walker::new(&scene, &columns, guide.as_ref(), peak.as_ref(), None);
                let mut walker = if polarised {
                    walker.polarised(true)
                } else {
                    walker
                };
                walker.prepare(Some(&starts()[40].ray));
                walker
            };
            let n = if polarised { 4 * m.lanes() } else { m.lanes() };
            let (mut together, mut alone) = (vec![0.0; n], vec![0.0; n]);
            let mut one = walker();
            assert_eq!(one.led, guide.is_some());
            for start in &mut starts() {
                one.walk(std::slice::from_mut(start), &mut alone);
            }
            walker().walk(&mut starts(), &mut together);
            let scale = alone.iter().fold(0.0f32, |a, &b| a.max(b.abs()));
            assert!(scale > 0.0);
            for (a, b) in alone.iter().zip(&together) {
                assert!(
                    (a - b).abs() < 3e-6 * scale,
                    "{sun_deg} {polarised}: {a} {b}"
                );
            }
        }
    }
}
