//! One path on its way: what it carries, where it stands, and what it is about to do.

use super::first_order::{columns_to_sun, Sunbeam};
use super::scene::Scene;
use super::stokes::Stokes;
use super::way::{Draws, Leg, Way};
use crate::math::lanes;
use crate::math::{Rng, Sampler, Vec3};
use crate::medium::{Columns, LayeredMedium, Medium, RayColumns};

/// What a path begins with, once the first order is done.
pub(super) struct Departure {
    /// Where its ray meets the air, if it does.
    pub leg: Option<Leg>,
    pub sampler: Sampler,
    pub beam: Sunbeam,
}

impl Departure {
    /// One that leads nowhere.
    pub fn new(scene: &Scene<'_, LayeredMedium>) -> Self {
        Self {
            leg: None,
            sampler: Sampler::new(Rng::new(0, 0), None),
            beam: Sunbeam::middle(&scene.sun),
        }
    }
}

/// A path between its start at the observer and its end. [`super::walker::Walker`] takes several of them along side by side.
pub(super) struct Traveller {
    /// Whether it goes on.
    pub walking: bool,
    /// Whether it waits for the place of its next collision to be found.
    pub searching: bool,
    /// The number of the vertex it is on its way to, from 1.
    pub order: u32,
    pub leg: Leg,
    pub sampler: Sampler,
    pub beam: Sunbeam,
    /// What each wavelength carries.
    pub weight: Vec<f32>,
    /// What the first collision could scatter, in all wavelengths.
    pub first_mass: f32,
    /// How much more sunlight than elsewhere may be found on the present leg, for its direction is close to the sun's.
    pub gain: f32,
    /// What it has found, still in units of the pixel's guess.
    pub found: Vec<f32>,
    /// What becomes of polarisation, if anyone wants to know.
    pub stokes: Option<Stokes>,
    /// What is known of the present leg, and the columns along it to where the path has looked.
    pub ahead: Ahead,
    pub columns: Vec<f32>,
    /// Whether a collision sees the sun, and columns towards it.
    pub sees_sun: bool,
    pub sun_columns: Vec<f32>,
    sun_scratch: Vec<f32>,
}

/// The leg that a path is about to walk: random numbers, the way to its end, and what may happen on it.
pub(super) struct Ahead {
    pub u: Draws,
    pub way: Way,
    /// What [`RayColumns`] needs.
    pub start: Vec<f32>,
    pub tangent: Vec<f32>,
    pub grazes: bool,
    /// Whether a collision in the air is what comes next, and where the search for it begins.
    pub collides: bool,
    pub lane: usize,
    /// The share of light that is lost up to it at that wavelength.
    pub lost: f64,
    /// What the weights are to be multiplied by.
    pub scale: f32,
}

impl Traveller {
    /// One that stands still; it has memory for any path of the scene.
    pub fn new(scene: &Scene<'_, LayeredMedium>, columns: &Columns) -> Self {
        let (lanes, count) = (scene.medium.lanes(), columns.count());
        Self {
            walking: false,
            searching: false,
            order: 0,
            leg: Leg {
                at: Vec3::default(),
                radius_m: 0.0,
                place: (0, 0.0),
                direction: Vec3::default(),
            },
            sampler: Sampler::new(Rng::new(0, 0), None),
            beam: Sunbeam::middle(&scene.sun),
            weight: vec![0.0; lanes],
            first_mass: 0.0,
            gain: 1.0,
            found: vec![0.0; lanes],
            stokes: None,
            ahead: Ahead {
                u: Draws::default(),
                way: Way::default(),
                start: vec![0.0; count],
                tangent: vec![0.0; count],
                grazes: false,
                collides: false,
                lane: 0,
                lost: 0.0,
                scale: 0.0,
            },
            columns: vec![0.0; count],
            sees_sun: false,
            sun_columns: vec![0.0; count],
            sun_scratch: vec![0.0; count],
        }
    }

    /// Whether it is about to set out on a leg.
    #[inline(always)]
    pub fn sets_out(&self) -> bool {
        self.walking && !self.searching
    }

    /// Whether it stands at a collision, once all that could be found are.
    #[inline(always)]
    pub fn stands_at_collision(&self) -> bool {
        self.walking && !self.searching && self.ahead.collides
    }

    /// Whether it stands at a collision whose sunlight nobody has found yet.
    #[inline(always)]
    pub fn wants_sun(&self) -> bool {
        self.stands_at_collision() && self.order > 1
    }

    /// Looks up the columns towards the sun from where it stands.
    #[inline(always)]
    pub fn look_at_sun(&mut self, columns: &Columns) {
        let (radius_m, sunward_m) = (self.leg.radius_m, self.leg.at.dot(self.beam.towards));
        let (out, scratch) = (&mut self.sun_columns, &mut self.sun_scratch);
        self.sees_sun = columns_to_sun(columns, radius_m, sunward_m, out, scratch);
    }

    /// Takes unpolarised light.
    #[inline(always)]
    pub fn find_unpolarised(&mut self, light: &[f32]) {
        match &mut self.stokes {
            Some(stokes) => stokes.find_unpolarised(light, &mut self.found),
            None => lanes::add_scaled(light, 1.0, &mut self.found),
        }
    }
}

impl Ahead {
    /// Looks up the columns at the ends of the way, for [`Ahead::along`].
    #[inline(always)]
    pub fn survey(&mut self, columns: &Columns) {
        let (start, tangent) = (&mut self.start, &mut self.tangent);
        self.grazes = RayColumns::along(columns, self.way.geometry, start, tangent).grazes;
    }

    /// Radius at the end of the way, or where it is lowest if it grazes, and the distance from the point nearest the planet's centre
    /// \[m\]: what [`Ahead::complete`] needs the columns of.
    #[inline(always)]
    pub fn end(&mut self, ground_m: f64) -> (f64, f64) {
        let (geometry, length_m) = (&self.way.geometry, self.way.length_m);
        let lowest_m = geometry.grazes(ground_m);
        self.grazes = lowest_m.is_some() && !self.way.meets_ground;
        match lowest_m {
            _ if self.way.meets_ground => (
                geometry.radius_at(length_m),
                (length_m - geometry.tangent_m()).abs(),
            ),
            Some(lowest_m) => (lowest_m, 0.0),
            None => (ground_m, 0.0),
        }
    }

    /// From the columns to the top there, those along the way. As [`Ahead::survey`] and a look along the whole way.
    #[inline(always)]
    pub fn complete(&mut self, columns: &Columns, end: &mut [f32]) {
        if self.way.meets_ground {
            let beyond_m = self.way.length_m - self.way.geometry.tangent_m();
            self.along(columns).since_start(beyond_m, end);
        } else {
            if self.grazes {
                self.tangent.copy_from_slice(end);
            }
            self.along(columns).to_space(end);
        }
    }

    /// Columns along the way, after [`Ahead::survey`].
    #[inline(always)]
    pub fn along<'a>(&'a self, columns: &'a Columns) -> RayColumns<'a> {
        RayColumns::again(
            columns,
            self.way.geometry,
            &self.start,
            &self.tangent,
            self.grazes,
        )
    }
}
