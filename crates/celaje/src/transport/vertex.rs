//! What happens to a path at a vertex: what it meets on its way there, the sun that it finds, and where it goes on to.

use super::first_order::columns_to_sun;
use super::guided::Lead;
use super::present::{Peak, Present};
use super::traveller::Traveller;
use super::walker::Walker;
use super::way::Leg;
use super::weights::Weights;
use crate::math::lanes::{self, blocks, blocks_mut, each, BLOCK};
use crate::math::Vec3;
use crate::medium::Medium;

/// Share of the scattered directions that are drawn about the sun, times the sine of the sun's elevation there, and the largest: the
/// lower the sun, the longer its way through haze, and the more of the light comes from about it. Measured: 0.05 are best under a sun
/// 60° high, 0.1 at 30°, 0.25 at 5° and below.
const ABOUT_SUN: f64 = 0.05;
const MOST_ABOUT_SUN: f64 = 0.25;

/// How far below a vertex's horizon directions are still drawn about the sun, as sine of an angle.
const SUN_IN_REACH: f64 = 0.02;

/// A new direction.
pub(super) struct Turn {
    pub direction: Vec3,
    /// The share of directions that are drawn about the sun, and the density there of those \[sr⁻¹\].
    share: f32,
    about_sun: f32,
    /// See [`Peak::gain`].
    gain: f32,
}

impl Walker<'_> {
    /// From the columns to the end of a way: what each wavelength loses in the air on it (`lost`), and what reaches the ground
    /// and comes back (`reached`). Returns the sum of the former.
    #[inline(always)]
    pub fn look_ahead(&mut self, t: &mut Traveller) -> f32 {
        let meets_ground = t.ahead.way.meets_ground;
        let arriving = if meets_ground {
            &self.scene.albedo
        } else {
            &self.scene.background
        };
        let arrives = meets_ground || self.background;
        let mut in_air = [0.0; BLOCK];
        self.columns.optical_depth(&t.columns, &mut self.tau);
        let rows = blocks(&t.weight).zip(blocks(arriving));
        let out = blocks_mut(&mut self.lost).zip(blocks_mut(&mut self.reached));
        for (((&weight, &arriving), (lost, reached)), &tau) in rows.zip(out).zip(blocks(&self.tau))
        {
            if arrives {
                *reached = each(|i| weight[i] * lanes::exp_and_loss(tau[i]).0 * arriving[i]);
            }
            let gone = each(|i| weight[i] * lanes::exp_and_loss(tau[i]).1);
            in_air = each(|i| in_air[i] + gone[i]);
            *lost = gone;
        }
        self.lost_sums = in_air;
        if self.background && !meets_ground && t.order > 1 {
            t.find_unpolarised(&self.reached);
        }
        lanes::tree_sum(in_air)
    }

    /// Adds the sunlight that the ground at the end of a way sends into the path, times `scale`.
    #[inline(always)]
    pub fn find_sun_on_ground(&mut self, t: &mut Traveller, scale: f32) {
        let at = t.leg.at + t.leg.direction * t.ahead.way.length_m;
        let radius_m = at.length();
        let sunward_m = at.dot(t.beam.towards);
        if sunward_m <= 0.0 || !self.look_at_sun(radius_m, sunward_m) {
            return;
        }
        let factor = scale * (sunward_m / radius_m / std::f64::consts::PI) as f32;
        let rows = blocks(&self.reached).zip(blocks(&t.beam.irradiance));
        let rows = rows.zip(blocks_mut(&mut self.light));
        self.columns.optical_depth(&self.sun_columns, &mut self.tau);
        for (((&reached, &beam), light), tau) in rows.zip(blocks(&self.tau)) {
            let sunlight = lanes::exp_neg_block(tau);
            *light = each(|i| reached[i] * sunlight[i] * (beam[i] * factor));
        }
        t.find_unpolarised(&self.light);
    }

    /// Goes on from the ground with everything that arrives there, times `scale`: in a direction by the cosine of the law of Lambert, or
    /// a share of the time from the phase function [`Peak`] about the sun, as in [`Walker::scatter`]. `false` for a
    /// direction of the latter that leads into the ground.
    #[inline(always)]
    pub fn meet_ground(&mut self, t: &mut Traveller, scale: f32) -> bool {
        let at = t.leg.at + t.leg.direction * t.ahead.way.length_m;
        let radius_m = at.length();
        let normal = at * (1.0 / radius_m);
        let sun = t.beam.towards;
        let mut turn = t.ahead.u.turn;
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
                return false;
            }
            let about_sun = peak.density(direction.dot(sun));
            factor *= (lambertian / ((1.0 - share) * lambertian + share * about_sun)) as f32;
            gain = peak.gain(about_sun);
        }
        t.gain = gain;
        for (w, &arrived) in t.weight.iter_mut().zip(&self.reached) {
            *w = arrived * factor;
        }
        if let Some(stokes) = &mut t.stokes {
            stokes.depolarise();
        }
        t.leg = Leg {
            at,
            radius_m,
            place: (0, 0.0),
            direction,
        };
        true
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
    pub fn arrive(&mut self, traveller: &mut Traveller) -> f32 {
        let medium = self.scene.medium;
        let n = medium.lanes();
        let (i, t) = traveller.leg.place;
        let (below, above) = (medium.extinction_row(i), medium.extinction_row(i + 1));
        let Weights {
            split,
            split_sum,
            split_sums,
            total,
            ..
        } = &mut self.weights;
        let weight = &mut traveller.weight;
        let mut density = [0.0; BLOCK];
        self.columns
            .optical_depth(&traveller.columns, &mut self.tau);
        let rows = blocks_mut(weight).zip(blocks(below).zip(blocks(above)));
        for ((weight, (below, above)), tau) in rows.zip(blocks(&self.tau)) {
            let (transmittance, before) = (lanes::exp_neg_block(tau), *weight);
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

    /// Whether there is anything left to scatter at a collision, and the weights are fit for it.
    #[inline(always)]
    pub fn can_scatter(&self, t: &Traveller) -> bool {
        let scale = t.ahead.scale;
        scale > 0.0 && scale.is_finite() && self.weights.total > 0.0
    }

    /// Columns towards the sun; `false` where the planet stands before it.
    #[inline(always)]
    fn look_at_sun(&mut self, radius_m: f64, sunward_m: f64) -> bool {
        let (out, scratch) = (&mut self.sun_columns, &mut self.sun_scratch);
        columns_to_sun(self.columns, radius_m, sunward_m, out, scratch)
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
    pub fn find_sun(&mut self, t: &mut Traveller) {
        let towards = t.beam.towards;
        let Weights {
            split, split_sum, ..
        } = &self.weights;
        let (medium, scale) = (self.scene.medium, t.ahead.scale);
        let present = Present {
            species: &self.first.scatterers,
            split_sum,
        };
        let cosine = t.leg.direction.dot(towards);
        present.evaluate(medium.phases(), cosine, &mut self.phase);
        let n = t.found.len();
        self.columns.optical_depth(&t.sun_columns, &mut self.tau);
        let rows = blocks(&t.beam.irradiance).zip(blocks(&self.tau));
        let Some(stokes) = &mut t.stokes else {
            for (b, ((beam, tau), found)) in rows.zip(blocks_mut(&mut t.found)).enumerate() {
                let (sunlight, before) = (lanes::exp_neg_block(tau), *found);
                let mix = present.mix(split, &self.phase, n, b);
                *found = each(|i| before[i] + mix[i] * sunlight[i] * (beam[i] * scale));
            }
            return;
        };
        let out = blocks_mut(&mut self.light).zip(blocks_mut(&mut self.mixed));
        for (b, ((beam, tau), (light, mixed))) in rows.zip(out).enumerate() {
            let sunlight = lanes::exp_neg_block(tau);
            let mix = present.mix(split, &self.phase, n, b);
            *light = each(|i| mix[i] * sunlight[i] * (beam[i] * scale));
            *mixed = mix;
        }
        stokes.find_sun(
            medium,
            (split, split_sum),
            &self.mixed,
            (t.leg.direction, towards),
            &self.light,
            &mut t.found,
        );
    }

    /// Draws a direction from the mean of all wavelengths' phase functions, or a share of the time from [`Peak`] about the sun.
    ///
    /// The next vertex sees the sun through its phase function, whose peak a path would rarely meet by itself: drawing
    /// the direction from that peak first makes both vertices' peaks common.
    #[inline(always)]
    pub fn turn(&self, t: &Traveller, lead: Option<&Lead>) -> Turn {
        let (medium, sun) = (self.scene.medium, t.beam.towards);
        let (mut u, direction) = (t.ahead.u.turn, t.leg.direction);
        let mut led = None;
        if let Some(lead) = lead {
            match lead.lead(u) {
                Ok(direction) => led = Some(direction),
                Err(rest) => u = rest,
            }
        }
        let about_sun = self.about_sun(t.leg.at.dot(sun), t.leg.radius_m, &mut u);
        let new = match (led, about_sun) {
            (Some(new), _) => new,
            (None, Some((peak, _, true))) => sun.deflected_by_turn(peak.sample(u[1]), u[2]),
            (None, _) => self.weights.draw(medium, direction, u),
        };
        let mut turn = Turn {
            direction: new,
            share: 0.0,
            about_sun: 0.0,
            gain: 1.0,
        };
        if let Some((peak, share, _)) = about_sun {
            let density = peak.density(sun.dot(new));
            turn.share = share as f32;
            turn.about_sun = density as f32;
            turn.gain = peak.gain(density);
        }
        turn
    }

    /// Goes on in a new direction, with the weights divided by its density.
    #[inline(always)]
    pub fn scatter(&mut self, t: &mut Traveller, turn: &Turn, lead: Option<&Lead>) {
        let medium = self.scene.medium;
        let (direction, new) = (t.leg.direction, turn.direction);
        let Weights {
            split,
            split_sum,
            total,
            ..
        } = &self.weights;
        let weight = &mut t.weight;
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
        if let Some(stokes) = &mut t.stokes {
            stokes.scatter(medium, (split, split_sum), weight, (direction, new));
        }
        let mut density =
            turn.share * turn.about_sun + (1.0 - turn.share) * lanes::tree_sum(mixed) / *total;
        if let Some(lead) = lead {
            density = lead.mixed(new, density);
        }
        // A density of zero (a hole in a table, met by rounding) ends the path.
        let factor = if density > 0.0 {
            t.ahead.scale / density
        } else {
            0.0
        };
        lanes::scale(weight, factor);
        t.gain = turn.gain;
        t.leg.direction = new;
    }
}
