//! Light scattered not at all or once: a line integral along the first ray, by stratified quadrature.

use super::render::Start;
use super::scene::{Scene, SunLight};
use super::stokes::add_first_order;
use super::traveller::Departure;
use super::way::Leg;
use crate::math::lanes::{self, blocks, blocks_mut, each};
use crate::math::Vec3;
use crate::medium::{
    all, Abreast, Columns, LayeredMedium, Lookups, Medium, Ray, RayColumns, RayGeometry, RAYS,
};

/// Cells of the first look along a pixel's ray.
const CELLS: usize = 32;

/// Share of the points that ignore the first look, so that nothing it missed is lost.
const BLIND: f32 = 0.15;

/// Least guess of a wavelength's radiance over its sunlight, relative to the brightest one.
const FLOOR: f32 = 0.02;

/// Rows under work.
struct Rows {
    tau: Vec<f32>,
    columns: Vec<f32>,
    /// Columns of a second ray, towards the sun.
    sun_columns: Vec<f32>,
    sun_scratch: Vec<f32>,
}

impl Rows {
    /// From columns up to a place, and those from there to the sun, the columns of the whole way.
    #[inline(always)]
    fn go_on_to_sun(&mut self) {
        lanes::add_scaled(&self.sun_columns, 1.0, &mut self.columns);
    }
}

/// Columns to the top from the start of a ray, and from where it is lowest.
#[derive(Default)]
struct Ends {
    start: Vec<f32>,
    tangent: Vec<f32>,
}

/// Single scattering of a pixel: a first look that says where along the ray light comes from, and estimates after it.
pub(super) struct FirstOrder<'a> {
    scene: &'a Scene<'a, LayeredMedium>,
    columns: &'a Columns,
    /// First guess of the pixel's spectrum, positive, one row (1 in the padding).
    pub guess: Vec<f32>,
    /// Density of the places at the nodes between cells, linear from one to the next, shape (CELLS + 1,).
    density: Vec<f32>,
    /// Its integral up to the nodes.
    cdf: Vec<f32>,
    /// The integrand at the nodes, shape (CELLS + 1, lanes).
    nodes: Vec<f32>,
    phase: Vec<f32>,
    light: Vec<f32>,
    polarised: Option<Polarised>,
    /// Species that scatter anywhere.
    pub scatterers: Vec<usize>,
    dark_universe: bool,
    wavelengths: usize,
    rows: Rows,
    ends: Ends,
}

/// The sunlight that a path meets.
pub(super) struct Sunbeam {
    /// Direction towards the point of the sun that it comes from.
    pub towards: Vec3,
    /// Irradiance on a plane across it above the air, one row.
    pub irradiance: Vec<f32>,
}

impl Sunbeam {
    /// From the middle of the sun, as if it were the mean of the disc.
    pub fn middle(sun: &SunLight) -> Self {
        Self {
            towards: sun.direction,
            irradiance: sun.irradiance.clone(),
        }
    }

    /// Moves it to another point of the disc, two numbers uniform in [0, 1).
    #[inline(always)]
    pub fn draw(&mut self, sun: &SunLight, u: f64, v: f64) {
        let (towards, mu_squared) = sun.sample(u, v);
        self.towards = towards;
        self.irradiance.copy_from_slice(&sun.irradiance);
        sun.limb(mu_squared, &mut self.irradiance);
    }
}

/// How a stretch of ray is walked: `x` in [0, 1] to distance, crowding where the air is densest.
#[derive(Debug, Clone, Copy)]
pub(super) enum Walk {
    /// Away from the ground: crowds at the start.
    Rising,
    /// Onto the ground: crowds at both ends.
    Falling,
    /// Past a lowest point, at this share of the length: crowds about it.
    Grazing(f64),
}

impl Walk {
    pub fn new(tangent_m: f64, length_m: f64, meets_ground: bool) -> Self {
        if meets_ground {
            Self::Falling
        } else if tangent_m > 0.0 {
            Self::Grazing((tangent_m / length_m).min(1.0))
        } else {
            Self::Rising
        }
    }

    /// Share of the length, and its derivative.
    #[inline(always)]
    pub fn at(self, x: f64) -> (f64, f64) {
        match self {
            Self::Rising => (x * x * x, 3.0 * x * x),
            Self::Falling => (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x)),
            Self::Grazing(low) => {
                let y = 2.0 * x - 1.0;
                let side = if y < 0.0 { low } else { 1.0 - low };
                (low + side * y * y * y, 6.0 * side * y * y)
            }
        }
    }
}

/// A ray cut to the air, and what is needed to integrate along it.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    ray: Ray,
    geometry: RayGeometry,
    length_m: f64,
    meets_ground: bool,
    walk: Walk,
}

impl Stretch {
    #[inline(always)]
    fn new(medium: &LayeredMedium, ray: &Ray) -> Option<Self> {
        let (span, meets_ground) =
            ray.through_air(medium.ground_radius_m(), medium.top_radius_m())?;
        let inside = Ray {
            origin: ray.at(span.start_m),
            direction: ray.direction,
        };
        let geometry = RayGeometry::new(&inside);
        let length_m = span.end_m - span.start_m;
        let walk = Walk::new(geometry.tangent_m(), length_m, meets_ground);
        Some(Self {
            ray: inside,
            geometry,
            length_m,
            meets_ground,
            walk,
        })
    }

    /// Columns along it; those to the top at its start are in `ends` already.
    #[inline(always)]
    fn with_start<'a>(&self, columns: &'a Columns, ends: &'a mut Ends) -> RayColumns<'a> {
        let lowest_m = self.geometry.grazes(columns.ground_m());
        if let Some(lowest_m) = lowest_m {
            columns.to_top_from(lowest_m, 0.0, &mut ends.tangent);
        }
        let grazes = lowest_m.is_some();
        RayColumns::again(columns, self.geometry, &ends.start, &ends.tangent, grazes)
    }

    /// Columns along it, from those to the top at its ends, which this leaves in `ends`.
    #[inline(always)]
    fn along<'a>(&self, columns: &'a Columns, ends: &'a mut Ends) -> RayColumns<'a> {
        RayColumns::along(columns, self.geometry, &mut ends.start, &mut ends.tangent)
    }
}

/// Places on lines of sight, one for each ray abreast, and the columns from there.
struct Spots {
    /// Distances \[m\] from the planet's centre, beyond the point of the line of sight that is nearest to it, and above the plane
    /// through it that faces the sun.
    radius_m: Abreast,
    beyond_m: Abreast,
    sunward_m: Abreast,
    view: Lookups,
    sun: Lookups,
}

impl Spots {
    /// At so far along each stretch \[m\], with the sun towards there. Where there is none, the place is some other one.
    #[inline(always)]
    fn new(columns: &Columns, on: &[Option<(&Stretch, f64, Vec3)>; RAYS]) -> Self {
        let mut radius_m = [columns.ground_m(); RAYS];
        let (mut beyond_m, mut sunward_m) = ([0.0; RAYS], [0.0; RAYS]);
        for (k, on) in on.iter().enumerate() {
            if let Some((stretch, at_m, towards)) = on {
                radius_m[k] = stretch.geometry.radius_at(*at_m);
                beyond_m[k] = at_m - stretch.geometry.tangent_m();
                sunward_m[k] = stretch.ray.at(*at_m).dot(*towards);
            }
        }
        Self {
            view: Lookups::new(columns, &radius_m, &all(|k| beyond_m[k].abs())),
            sun: Lookups::new(columns, &radius_m, &all(|k| sunward_m[k].max(0.0))),
            radius_m,
            beyond_m,
            sunward_m,
        }
    }

    /// Columns from the observer to the `k`-th place and on to the sun, in `rows.columns`; `false` where the planet stands before it.
    #[inline(always)]
    fn columns(
        &self,
        columns: &Columns,
        k: usize,
        along: &RayColumns<'_>,
        rows: &mut Rows,
    ) -> bool {
        let sun = &mut rows.sun_columns;
        if self.sunward_m[k] >= 0.0 {
            self.sun.columns(columns, k, sun);
        } else {
            let (radius_m, sunward_m) = (self.radius_m[k], self.sunward_m[k]);
            if !columns_to_sun(columns, radius_m, sunward_m, sun, &mut rows.sun_scratch) {
                return false;
            }
        }
        self.view.columns(columns, k, &mut rows.columns);
        along.since_start(self.beyond_m[k], &mut rows.columns);
        rows.go_on_to_sun();
        true
    }
}

/// The same with F12 in the place of the phase function: Q in the scattering plane.
struct Polarised {
    phase: Vec<f32>,
    light: Vec<f32>,
}

impl<'a> FirstOrder<'a> {
    pub fn new(scene: &'a Scene<'a, LayeredMedium>, columns: &'a Columns) -> Self {
        let medium = scene.medium;
        let (lanes, count) = (medium.lanes(), columns.count());
        let scatters = |&k: &usize| {
            (0..medium.node_radii_m().len())
                .any(|node| medium.species_row(k, node).iter().any(|&s| s > 0.0))
        };
        Self {
            scene,
            columns,
            guess: vec![1.0; lanes],
            density: vec![0.0; CELLS + 1],
            cdf: vec![0.0; CELLS + 1],
            nodes: vec![0.0; (CELLS + 1) * lanes],
            phase: vec![0.0; lanes * medium.phases().len()],
            light: vec![0.0; lanes],
            polarised: None,
            scatterers: (0..medium.phases().len()).filter(scatters).collect(),
            dark_universe: scene.background.iter().all(|&l| l == 0.0),
            wavelengths: medium.wavelength_nm().len(),
            rows: Rows {
                tau: vec![0.0; lanes],
                columns: vec![0.0; count],
                sun_columns: vec![0.0; count],
                sun_scratch: vec![0.0; count],
            },
            ends: Ends {
                start: vec![0.0; count],
                tangent: vec![0.0; count],
            },
        }
    }

    /// Adds Q and U to estimates from now on.
    pub fn polarise(&mut self) {
        self.polarised = Some(Polarised {
            phase: vec![0.0; self.phase.len()],
            light: vec![0.0; self.light.len()],
        });
    }

    /// The first look along a pixel's central ray: fills the guess and the distribution.
    #[inline(always)]
    pub fn prepare(&mut self, centre: Option<&Ray>) {
        let (medium, sun) = (self.scene.medium, &self.scene.sun);
        self.guess.fill(0.0);
        self.nodes.fill(0.0);
        if let Some(stretch) = centre.and_then(|ray| Stretch::new(medium, ray)) {
            self.look_along(&stretch, &Sunbeam::middle(sun));
        }
        // A floor relative to the sunlight, so that one dark wavelength does not draw all attention.
        let sunlight = &sun.irradiance;
        let brightest = (0..self.wavelengths)
            .filter(|&i| sunlight[i] > 0.0)
            .map(|i| self.guess[i] / sunlight[i])
            .fold(0.0, f32::max);
        for (g, &sunlight) in self.guess.iter_mut().zip(sunlight) {
            *g = if brightest > 0.0 {
                g.max(FLOOR * brightest * sunlight)
            } else {
                sunlight
            };
            if !(*g > 0.0 && g.is_finite()) {
                *g = 1.0;
            }
        }
        self.distribute();
    }

    /// Fills `nodes` with what the nodes between the cells of a stretch scatter, and adds it up in `guess`, with the ground's.
    #[inline(always)]
    fn look_along(&mut self, stretch: &Stretch, beam: &Sunbeam) {
        self.evaluate_phases(stretch.ray.direction.dot(beam.towards));
        let mut ends = std::mem::take(&mut self.ends);
        let along = stretch.along(self.columns, &mut ends);
        let n = self.light.len();
        let at = |node: usize| stretch.walk.at(node.min(CELLS) as f64 / CELLS as f64);
        for first in (0..=CELLS).step_by(RAYS) {
            let mut on = [None; RAYS];
            for (k, on) in on.iter_mut().enumerate() {
                *on = Some((stretch, at(first + k).0 * stretch.length_m, beam.towards));
            }
            let spots = Spots::new(self.columns, &on);
            for k in 0..RAYS.min(CELLS + 1 - first) {
                let node = first + k;
                if !self.scatter(&spots, k, &along, beam) {
                    continue;
                }
                let factor = (at(node).1 * stretch.length_m) as f32;
                let width = if node == 0 || node == CELLS { 0.5 } else { 1.0 } / CELLS as f32;
                let out = blocks_mut(&mut self.nodes[node * n..(node + 1) * n]);
                let rows = out.zip(blocks_mut(&mut self.guess));
                for ((c, g), light) in rows.zip(blocks(&self.light)) {
                    let before = *g;
                    *c = each(|i| light[i] * factor);
                    *g = each(|i| before[i] + light[i] * factor * width);
                }
            }
        }
        if stretch.meets_ground && self.reflect(stretch, &along, beam) {
            lanes::add_scaled(&self.light, 1.0, &mut self.guess);
        }
        self.ends = ends;
    }

    /// The density of places, from each node's share of every wavelength's guess.
    #[inline(always)]
    fn distribute(&mut self) {
        let n = self.guess.len();
        for (density, node) in self.density.iter_mut().zip(self.nodes.chunks_exact(n)) {
            let shares = node.iter().zip(&self.guess).take(self.wavelengths);
            *density = shares.map(|(c, guess)| c / guess).sum();
        }
        let mass = |d: &[f32]| 0.5 * (d[0] + d[1]) / CELLS as f32;
        let total: f32 = self.density.windows(2).map(mass).sum();
        let (blind, scale) = if total > 0.0 {
            (BLIND, (1.0 - BLIND) / total)
        } else {
            (1.0, 0.0)
        };
        for density in &mut self.density {
            *density = blind + scale * *density;
        }
        for (cell, density) in self.density.windows(2).enumerate() {
            self.cdf[cell + 1] = self.cdf[cell] + mass(density);
        }
    }

    /// Adds one estimate for each of at most [`RAYS`] rays: of the light from outside the air, without the sun's disc, and, if
    /// `scattered`, of the light scattered once. Leaves in `departures` where paths begin, and the sunlight that they meet.
    #[inline(always)]
    pub fn add(
        &mut self,
        starts: &mut [Start],
        scattered: bool,
        departures: &mut [Departure],
        out: &mut [f32],
    ) {
        let (medium, sun, n) = (self.scene.medium, &self.scene.sun, self.light.len());
        let (mut stretches, mut factor) = ([None; RAYS], [0.0; RAYS]);
        for (k, (start, departure)) in starts.iter_mut().zip(&mut *departures).enumerate() {
            let Start { ray, sampler } = start;
            let place = sampler.uniform();
            let (u, v) = (sampler.uniform(), sampler.rng().uniform());
            departure.beam.draw(sun, u, v);
            departure.sampler = sampler.clone();
            let stretch = Stretch::new(medium, ray);
            departure.leg = stretch.map(|stretch| {
                let radius_m = stretch.ray.origin.length();
                Leg {
                    at: stretch.ray.origin,
                    radius_m,
                    place: medium.locate_radius(radius_m),
                    direction: ray.direction,
                }
            });
            stretches[k] = stretch.map(|stretch| {
                let (x, density) = self.draw(place as f32);
                let (share, derivative) = stretch.walk.at(x);
                factor[k] = (derivative * stretch.length_m) as f32 / density;
                (stretch, share * stretch.length_m)
            });
        }
        let mut on = [None; RAYS];
        let (mut r, mut s) = ([self.columns.ground_m(); RAYS], [0.0; RAYS]);
        for (k, (stretch, departure)) in stretches.iter().zip(&*departures).enumerate() {
            if let Some((stretch, at_m)) = stretch {
                on[k] = Some((stretch, *at_m, departure.beam.towards));
                r[k] = stretch.geometry.start_m();
                s[k] = stretch.geometry.tangent_m().abs();
            }
        }
        let begin = Lookups::new(self.columns, &r, &s);
        let spots = Spots::new(self.columns, &on);
        let mut ends = std::mem::take(&mut self.ends);
        for (k, departure) in departures.iter().enumerate().take(starts.len()) {
            let Some((stretch, _)) = &stretches[k] else {
                lanes::add_scaled(&self.scene.background, 1.0, &mut out[..n]);
                continue;
            };
            begin.columns(self.columns, k, &mut ends.start);
            let along = stretch.with_start(self.columns, &mut ends);
            if !stretch.meets_ground && !self.dark_universe {
                self.see_through(&along);
                let behind = blocks(&self.light).zip(blocks(&self.scene.background));
                for (out, (t, b)) in blocks_mut(out).zip(behind) {
                    let before = *out;
                    *out = each(|i| before[i] + t[i] * b[i]);
                }
            }
            if !scattered {
                continue;
            }
            let beam = &departure.beam;
            self.evaluate_phases(stretch.ray.direction.dot(beam.towards));
            if self.scatter(&spots, k, &along, beam) {
                lanes::add_scaled(&self.light, factor[k], &mut out[..n]);
                if let Some(p) = &mut self.polarised {
                    lanes::scale(&mut p.light, factor[k]);
                    add_first_order(stretch.ray.direction, beam.towards, &p.light, out);
                }
            }
            if stretch.meets_ground && self.reflect(stretch, &along, beam) {
                lanes::add_scaled(&self.light, 1.0, &mut out[..n]);
            }
        }
        self.ends = ends;
    }

    /// A place in [0, 1] drawn from the density, and the density there.
    #[inline(always)]
    fn draw(&self, u: f32) -> (f64, f32) {
        let target = u * self.cdf[CELLS];
        let cell = self.cdf.partition_point(|&c| c <= target).clamp(1, CELLS) - 1;
        let (a, b) = (self.density[cell], self.density[cell + 1]);
        // a f + (b − a) f²/2 = v, v what is left in units of the cell's width.
        let v = (target - self.cdf[cell]) * CELLS as f32;
        let root = (a * a + 2.0 * (b - a) * v).max(0.0).sqrt();
        let within = (2.0 * v / (a + root)).clamp(0.0, 1.0);
        let x = (cell as f64 + f64::from(within)) / CELLS as f64;
        (x, (a + (b - a) * within) / self.cdf[CELLS])
    }

    /// `p` of every species at one scattering angle: it is the same all along a straight ray.
    #[inline(always)]
    fn evaluate_phases(&mut self, cos_theta: f64) {
        let (n, phases) = (self.light.len(), self.scene.medium.phases());
        for &k in &self.scatterers {
            phases[k].eval(cos_theta, &mut self.phase[k * n..(k + 1) * n]);
        }
        if let Some(p) = &mut self.polarised {
            p.phase.fill(0.0);
            self.light.fill(1.0);
            for &k in &self.scatterers {
                let row = &mut p.phase[k * n..(k + 1) * n];
                phases[k].add_f12(cos_theta, &self.light, row);
            }
        }
    }

    /// `light = T(view) Σ_k σ_s,k p_k T(sun) E` at a spot, and the same of Q; `false` where no sun shines.
    #[inline(always)]
    fn scatter(&mut self, spots: &Spots, k: usize, along: &RayColumns<'_>, beam: &Sunbeam) -> bool {
        if !spots.columns(self.columns, k, along, &mut self.rows) {
            return false;
        }
        let (medium, n) = (self.scene.medium, self.light.len());
        let place = medium.locate_radius(spots.radius_m[k]);
        self.light.fill(0.0);
        if let Some(p) = &mut self.polarised {
            p.light.fill(0.0);
        }
        for &k in &self.scatterers {
            let row = k * n..(k + 1) * n;
            medium.add_scattering(k, place, &self.phase[row.clone()], &mut self.light);
            if let Some(p) = &mut self.polarised {
                medium.add_scattering(k, place, &p.phase[row], &mut p.light);
            }
        }
        self.columns
            .optical_depth(&self.rows.columns, &mut self.rows.tau);
        attenuate(&mut self.light, &self.rows.tau, beam);
        if let Some(p) = &mut self.polarised {
            attenuate(&mut p.light, &self.rows.tau, beam);
        }
        true
    }

    /// `light = T(view) · albedo / π · cos · T(sun) E` where a ray meets the ground; `false` where no sun shines.
    #[inline(always)]
    fn reflect(&mut self, stretch: &Stretch, along: &RayColumns<'_>, beam: &Sunbeam) -> bool {
        let at = stretch.ray.at(stretch.length_m);
        let (radius_m, sunward_m) = (at.length(), at.dot(beam.towards));
        let (sun, scratch) = (&mut self.rows.sun_columns, &mut self.rows.sun_scratch);
        if sunward_m <= 0.0 || !columns_to_sun(self.columns, radius_m, sunward_m, sun, scratch) {
            return false;
        }
        along.to(stretch.length_m, &mut self.rows.columns);
        self.rows.go_on_to_sun();
        self.light.copy_from_slice(&self.scene.albedo);
        let cosine = sunward_m / radius_m;
        lanes::scale(&mut self.light, (cosine / std::f64::consts::PI) as f32);
        self.columns
            .optical_depth(&self.rows.columns, &mut self.rows.tau);
        attenuate(&mut self.light, &self.rows.tau, beam);
        true
    }

    /// `light` = transmittance of all the air along a ray.
    #[inline(always)]
    fn see_through(&mut self, along: &RayColumns<'_>) {
        along.to_space(&mut self.rows.columns);
        self.columns
            .optical_depth(&self.rows.columns, &mut self.rows.tau);
        lanes::exp_neg(&self.rows.tau, &mut self.light);
    }

    /// Adds `factor` times the radiance of the sun's disc behind the air, where a ray meets it at `mu_squared`.
    #[inline(always)]
    pub fn add_disc(
        &mut self,
        ray: &Ray,
        (mu_squared, factor): (f64, f32),
        beam: &mut Sunbeam,
        out: &mut [f32],
    ) {
        match Stretch::new(self.scene.medium, ray) {
            Some(stretch) if stretch.meets_ground => return,
            Some(stretch) => {
                let mut ends = std::mem::take(&mut self.ends);
                self.see_through(&stretch.along(self.columns, &mut ends));
                self.ends = ends;
            }
            None => self.light.fill(1.0),
        }
        let sun = &self.scene.sun;
        beam.irradiance.copy_from_slice(&sun.irradiance);
        sun.limb(mu_squared, &mut beam.irradiance);
        let factor = factor / sun.solid_angle_sr() as f32;
        let rows = blocks(&self.light).zip(blocks(&beam.irradiance));
        for (out, (t, l)) in blocks_mut(out).zip(rows) {
            let before = *out;
            *out = each(|i| before[i] + factor * t[i] * l[i]);
        }
    }
}

/// Takes light through so much air, and sunlight for its source.
#[inline(always)]
fn attenuate(light: &mut [f32], tau: &[f32], beam: &Sunbeam) {
    let rows = blocks(tau).zip(blocks(&beam.irradiance));
    for (light, (tau, beam)) in blocks_mut(light).zip(rows) {
        let (transmittance, before) = (lanes::exp_neg_block(tau), *light);
        *light = each(|i| before[i] * transmittance[i] * beam[i]);
    }
}

/// Columns to the top towards the sun, from a distance from the planet's centre \[m\] and the height above the plane through it
/// that faces the sun \[m\]; `false` where the planet stands before it.
#[inline(always)]
pub(super) fn columns_to_sun(
    columns: &Columns,
    radius_m: f64,
    sunward_m: f64,
    out: &mut [f32],
    scratch: &mut [f32],
) -> bool {
    if sunward_m >= 0.0 {
        columns.to_top_from(radius_m, sunward_m, out);
        return true;
    }
    let lowest = (radius_m * radius_m - sunward_m * sunward_m)
        .max(0.0)
        .sqrt();
    if lowest < columns.ground_m() {
        return false;
    }
    // Down to the lowest point and up again.
    columns.to_top_from(lowest, 0.0, out);
    columns.to_top_from(radius_m, -sunward_m, scratch);
    for (o, &s) in out.iter_mut().zip(scratch.iter()) {
        *o = 2.0 * *o - s;
    }
    true
}
