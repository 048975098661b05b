//! Paths led by a coarse solution (`guide.rs`): where the sun is low, the places and directions that carry light are rare.
//!
//! Both distance and direction are drawn from mixtures with a defensive share that ignores the solution, and divided by the
//! density of the mixture, so that every place stays in reach and no weight runs away.

use super::first_order::Walk;
use super::guide::{bands, Bands, Guide, Known, BANDS};
use super::horizon::{Horizon, ELEVATIONS};
use super::traveller::Traveller;
use super::walker::Walker;
use super::way::{Leg, Way};
use crate::math::lanes::{self, each, Block, BLOCK};
use crate::math::Vec3;

/// Share of the distances that ignore the solution.
const BLIND: f32 = 0.2;

/// Share of the directions that are drawn from the solution.
const LED: f64 = 0.4;

/// Share of what the first leg may find, below which Russian roulette begins, and its least chance of survival.
const ROULETTE_BELOW: f32 = 0.3;
const LEAST_SURVIVAL: f32 = 0.2;

/// A guide's word on the directions at one vertex.
pub(super) struct Lead<'a> {
    horizon: &'a Horizon,
    /// Power per bin of one side, and in all.
    power: [Block; ELEVATIONS],
    total: f32,
    up: Vec3,
    /// Horizontal unit vectors towards the sun and left of it.
    sunward: Vec3,
    left: Vec3,
}

impl<'a> Lead<'a> {
    /// For a path that carries `weight` in the bands; `None` if the guide has no word. `u` draws which node is asked.
    #[inline(always)]
    fn new(guide: &'a Guide, leg: &Leg, sun: Vec3, weight: &Bands, u: f32) -> Option<Self> {
        let up = leg.at * (1.0 / leg.radius_m);
        let place = guide.place(leg.radius_m, up.dot(sun));
        let flat = sun - up * up.dot(sun);
        let sunward = if flat.dot(flat) > 1e-12 {
            flat.normalized()
        } else {
            up.tangents().0
        };
        let left = up.cross(sunward);
        let Known {
            sigma_s, peaked, ..
        } = guide.know(place);
        let evenly = bands(|b| weight[b] * sigma_s[b] * (1.0 - peaked[b]));
        let forwards = bands(|b| weight[b] * sigma_s[b] * peaked[b]);
        let direction = [up, sunward, left].map(|axis| axis.dot(leg.direction) as f32);
        let node = guide.node(place, u);
        let power = guide.arriving(node, &evenly, &forwards, direction);
        let total = lanes::sum(power.as_flattened());
        let lead = Self {
            horizon: guide.horizon(node),
            power,
            total,
            up,
            sunward,
            left,
        };
        (total > 0.0 && total.is_finite()).then_some(lead)
    }

    /// A direction.
    #[inline(always)]
    fn draw(&self, u: [f64; 3]) -> Vec3 {
        let bin = lanes::pick(self.power.as_flattened(), u[0] as f32 * self.total);
        let (sine, phi) = self.horizon.in_bin(bin, [u[1], u[2]]);
        let (sin_phi, cos_phi) = phi.sin_cos();
        let flat = self.sunward * cos_phi + self.left * sin_phi;
        self.up * sine + flat * (1.0 - sine * sine).max(0.0).sqrt()
    }

    /// Density of a direction \[sr⁻¹\].
    #[inline(always)]
    fn density(&self, direction: Vec3) -> f32 {
        let sine = direction.dot(self.up);
        let flat = (1.0 - sine * sine).max(1e-30).sqrt();
        let on_left = direction.dot(self.left) > 0.0;
        let cos_azimuth = direction.dot(self.sunward) / flat;
        let bin = self.horizon.bin(sine, cos_azimuth, on_left);
        self.power.as_flattened()[bin] / (self.total * self.horizon.solid_angle_of_side(bin))
    }
}

/// The cells of a way: probability of each and of the ground, and what may be found in all.
struct Cells {
    probability: Block,
    on_ground: f32,
    importance: f32,
    /// Optical depth of each cell in the band where it is least.
    thinnest: Block,
}

#[inline(always)]
fn bands_min(tau: &[Block; BANDS], k: usize) -> f32 {
    tau.iter()
        .fold(f32::INFINITY, |least, tau| least.min(tau[k]))
}

/// What a path carries in each of the guide's bands.
#[inline(always)]
fn in_bands(t: &Traveller, guide: &Guide) -> Bands {
    bands(|b| t.weight[guide.lanes[b]..guide.lanes[b + 1]].iter().sum())
}

impl Walker<'_> {
    /// As [`Walker::collide`] of one path, led by a guide. `false` where it ends.
    #[inline(always)]
    pub(super) fn collide_guided(&mut self, guide: &Guide, t: &mut Traveller) -> bool {
        t.ahead.u.draw(&mut t.sampler);
        let medium = self.scene.medium;
        let Some(way) = Way::new(&t.leg, medium) else {
            return false;
        };
        t.ahead.way = way;
        let walk = Walk::new(way.geometry.tangent_m(), way.length_m, way.meets_ground);
        let Some(cells) = self.weigh(guide, t, walk) else {
            return false;
        };
        if t.order == 1 {
            t.first_mass = cells.importance;
        }
        let share = cells.importance / (ROULETTE_BELOW * t.first_mass);
        let survival = share.clamp(LEAST_SURVIVAL, 1.0);
        let survives = (t.ahead.u.roulette as f32) < survival;
        if !survives {
            return false;
        }
        t.ahead.survey(self.columns);
        let along = t.ahead.along(self.columns);
        let target = t.ahead.u.way as f32;
        if target < cells.on_ground {
            along.to(way.length_m, &mut t.columns);
            self.look_ahead(t);
            let scale = 1.0 / (cells.on_ground * survival);
            if t.order > 1 {
                self.find_sun_on_ground(t, scale);
            }
            return self.meet_ground(t, scale);
        }
        let (x, density) = draw(&cells, target - cells.on_ground);
        let (share, derivative) = walk.at(x);
        let distance_m = share * way.length_m;
        along.to(distance_m, &mut t.columns);
        t.leg.move_to(&way, distance_m);
        t.leg.place = medium.locate_radius(t.leg.radius_m);
        self.arrive(t);
        t.ahead.scale = (derivative * way.length_m) as f32 / (density * survival);
        if !self.can_scatter(t) {
            return false;
        }
        if t.order > 1 {
            t.look_at_sun(self.columns);
            if t.sees_sun {
                self.find_sun(t);
            }
        }
        let (sun, asked) = (self.scene.sun.direction, t.ahead.u.wavelength as f32);
        let lead = Lead::new(guide, &t.leg, sun, &in_bands(t, guide), asked);
        let turn = self.turn(t, lead.as_ref());
        self.scatter(t, &turn, lead.as_ref());
        true
    }

    /// How likely each cell of a way is to be chosen: by the light it scatters into the path, and a share by what it
    /// scatters at all. `None` if nothing does.
    #[inline(always)]
    fn weigh(&self, guide: &Guide, t: &Traveller, walk: Walk) -> Option<Cells> {
        let (leg, way, first) = (&t.leg, &t.ahead.way, t.order == 1);
        let sun = self.scene.sun.direction;
        let (from, slope) = (leg.at.dot(sun), leg.direction.dot(sun));
        // How much more sunlight haze sends into this leg than into the mean direction.
        let gain = self.peak.map_or(0.0, |peak| {
            4.0 * std::f64::consts::PI * peak.density(slope) - 1.0
        }) as f32;
        let mut tau = [[0.0f32; BLOCK]; BANDS];
        let (mut albedo, mut source) = (tau, tau);
        // Each cell has the mean of what is known at its two ends: where light grows steeply, that is rather too much than too
        // little.
        let place = guide.place(leg.radius_m, from / leg.radius_m);
        let (mut start, mut before) = (0.0, guide.know(place));
        for k in 0..BLOCK {
            let (share, _) = walk.at((k as f64 + 1.0) / BLOCK as f64);
            let end = share * way.length_m;
            let r = way.geometry.radius_at(end);
            let after = guide.know(guide.place(r, (from + slope * end) / r));
            let ds = (end - start) as f32;
            for b in 0..BANDS {
                let sigma_t = before.sigma_t[b] + after.sigma_t[b];
                tau[b][k] = 0.5 * ds * sigma_t;
                // Nothing is lost where nothing is met: the tiny number only keeps 0 / 0 away.
                albedo[b][k] = (before.sigma_s[b] + after.sigma_s[b]) / (sigma_t + 1e-30);
                let sunlight = if first {
                    0.0
                } else {
                    before.sun[b] * (1.0 + gain * before.peaked[b])
                        + after.sun[b] * (1.0 + gain * after.peaked[b])
                };
                source[b][k] = 0.5 * (sunlight + before.diffuse[b] + after.diffuse[b]);
            }
            (start, before) = (end, after);
        }
        let (mut led, mut blind) = ([0.0; BLOCK], [0.0; BLOCK]);
        let mut through = in_bands(t, guide);
        for b in 0..BANDS {
            let lost = each(|i| lanes::exp_and_loss(tau[b][i]).1);
            let mut scattered = [0.0; BLOCK];
            for k in 0..BLOCK {
                let gone = through[b] * lost[k];
                scattered[k] = gone * albedo[b][k];
                through[b] -= gone;
            }
            led = each(|i| led[i] + scattered[i] * source[b][i]);
            blind = each(|i| blind[i] + scattered[i]);
        }
        let (mut led_ground, mut blind_ground) = (0.0, 0.0);
        if way.meets_ground {
            let end = from + slope * way.length_m;
            let ground = guide.ground_at(end / guide.ground_m());
            for b in 0..BANDS {
                led_ground += through[b] * ground[b];
                blind_ground += through[b] * guide.albedo[b];
            }
        }
        let led_sum = lanes::tree_sum(led) + led_ground;
        let blind_sum = lanes::tree_sum(blind) + blind_ground;
        if !(blind_sum > 0.0 && blind_sum.is_finite() && led_sum.is_finite()) {
            return None;
        }
        let (a, b) = if led_sum > 0.0 {
            ((1.0 - BLIND) / led_sum, BLIND / blind_sum)
        } else {
            (0.0, 1.0 / blind_sum)
        };
        Some(Cells {
            probability: each(|i| a * led[i] + b * blind[i]),
            on_ground: a * led_ground + b * blind_ground,
            importance: led_sum,
            thinnest: each(|k| bands_min(&tau, k)),
        })
    }
}

impl Lead<'_> {
    /// The guide's part in [`Walker::scatter`]: a direction, if `u` says that the guide draws it; else what is left of `u`.
    #[inline(always)]
    pub(super) fn lead(&self, u: [f64; 3]) -> Result<Vec3, [f64; 3]> {
        if u[0] < LED {
            Ok(self.draw([u[0] / LED, u[1], u[2]]))
        } else {
            Err([(u[0] - LED) / (1.0 - LED), u[1], u[2]])
        }
    }

    /// Density of a direction in the mixture of guide and phase functions, of which the latter alone has `scattered`.
    #[inline(always)]
    pub(super) fn mixed(&self, direction: Vec3, scattered: f32) -> f32 {
        LED as f32 * self.density(direction) + (1.0 - LED as f32) * scattered
    }
}

/// A place in [0, 1] by the probabilities of equal cells, and its density. Within a cell, places are drawn as light fades in the
/// clearest of the bands.
#[inline(always)]
fn draw(cells: &Cells, mut target: f32) -> (f64, f32) {
    let mut cell = BLOCK - 1;
    for (k, &p) in cells.probability.iter().enumerate() {
        if target < p {
            cell = k;
            break;
        }
        target -= p;
    }
    let p = cells.probability[cell];
    // Rounding may leave a little too much for the last cell.
    let v = if p > 0.0 { (target / p).min(1.0) } else { 0.5 };
    let tau = cells.thinnest[cell];
    let (within, density) = if tau > 0.05 {
        let (_, lost) = lanes::exp_and_loss(tau);
        (
            (-(-v * lost).ln_1p() / tau).min(1.0),
            tau * (1.0 - v * lost) / lost,
        )
    } else {
        (v, 1.0)
    };
    let x = (cell as f64 + f64::from(within)) / BLOCK as f64;
    (x, density * p * BLOCK as f32)
}
