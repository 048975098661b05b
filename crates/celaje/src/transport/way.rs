//! The pieces a path is made of.

use crate::math::{Sampler, Vec3};
use crate::medium::{LayeredMedium, Medium, RayGeometry};

/// Where a path stands and where it goes from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub at: Vec3,
    /// Distance from the planet's centre \[m\].
    pub radius_m: f64,
    /// The medium's node below, and how far above it, as [`LayeredMedium::locate_radius`] has it.
    pub place: (usize, f32),
    pub direction: Vec3,
}

impl Leg {
    /// Moves the path on along its way. Where it is among the medium's nodes, `place`, is left to the caller.
    #[inline(always)]
    pub fn move_to(&mut self, way: &Way, distance_m: f64) {
        self.radius_m = way.geometry.radius_at(distance_m);
        self.at = self.at + self.direction * distance_m;
    }
}

/// The random numbers of one vertex: always as many, so that each keeps its dimension of the sequence.
///
/// What decides where a path goes shares one block of four dimensions, the evener the earlier it comes; what hardly matters, as all
/// wavelengths are weighed together whichever decides, and what cannot profit is left to random numbers.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Draws {
    /// How far: to the ground, or up to a collision before it.
    pub way: f64,
    /// Whereto: who decides, the angle, the turn about the old direction.
    pub turn: [f64; 3],
    /// Which wavelength places a collision; which node of a guide is asked.
    pub wavelength: f64,
    pub roulette: f64,
}

impl Draws {
    #[inline(always)]
    pub fn draw(&mut self, sampler: &mut Sampler) {
        let [way, t0, t1, t2] = sampler.uniform4();
        *self = Self {
            way,
            turn: [t0, t1, t2],
            wavelength: sampler.rng().uniform(),
            roulette: sampler.rng().uniform(),
        };
    }
}

/// The way from a point inside the air to where the air or the ground ends it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Way {
    pub geometry: RayGeometry,
    pub length_m: f64,
    pub meets_ground: bool,
}

impl Way {
    #[inline(always)]
    pub fn new(leg: &Leg, medium: &LayeredMedium) -> Option<Self> {
        let (ground, top, r) = (
            medium.ground_radius_m(),
            medium.top_radius_m(),
            leg.radius_m,
        );
        let b = leg.at.dot(leg.direction);
        let geometry = RayGeometry::from_start(r, -b);
        // The roots of s² + 2 b s + c = 0 multiply to c: so neither cancels.
        let c = (r - ground) * (r + ground);
        let discriminant = b * b - c;
        if b < 0.0 && discriminant >= 0.0 {
            let length_m = (c / (discriminant.sqrt() - b)).max(0.0);
            return Some(Self {
                geometry,
                length_m,
                meets_ground: true,
            });
        }
        let c = (r - top) * (r + top);
        let root = (b * b - c).sqrt();
        let length_m = if b > 0.0 { -c / (root + b) } else { root - b };
        (length_m > 0.0).then_some(Self {
            geometry,
            length_m,
            meets_ground: false,
        })
    }
}
