//! Light scattered not at all or once: a line integral along the first ray, by stratified quadrature.

use super::scene::{Scene, SunLight};
use super::stokes::add_first_order;
use crate::math::{lanes, Sampler, Vec3};
use crate::medium::{Columns, LayeredMedium, Medium, Ray, RayColumns};

/// Cells of the first look along a pixel's ray.
const CELLS: usize = 32;

/// Share of the points that ignore the first look, so that nothing it missed is lost.
const BLIND: f32 = 0.15;

/// Least guess of a wavelength's radiance over its sunlight, relative to the brightest one.
const FLOOR: f32 = 0.02;

/// Rows that both the first order and the later ones work on.
pub(super) struct Rows {
    pub tau: Vec<f32>,
    pub transmittance: Vec<f32>,
    pub columns: Vec<f32>,
    pub start: Vec<f32>,
    pub tangent: Vec<f32>,
    /// Columns of a second ray, towards the sun.
    pub sun_columns: Vec<f32>,
    pub sun_scratch: Vec<f32>,
}

impl Rows {
    pub fn new(lanes: usize, columns: usize) -> Self {
        Self {
            tau: vec![0.0; lanes],
            transmittance: vec![0.0; lanes],
            columns: vec![0.0; columns],
            start: vec![0.0; columns],
            tangent: vec![0.0; columns],
            sun_columns: vec![0.0; columns],
            sun_scratch: vec![0.0; columns],
        }
    }
}

/// Single scattering of a pixel: a first look that says where along the ray light comes from, and estimates after it.
pub(super) struct FirstOrder {
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
struct Stretch {
    ray: Ray,
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
        let length_m = span.end_m - span.start_m;
        let walk = Walk::new(inside.distance_to_tangent_m(), length_m, meets_ground);
        Some(Self {
            ray: inside,
            length_m,
            meets_ground,
            walk,
        })
    }
}

/// The same with F12 in the place of the phase function: Q in the scattering plane.
struct Polarised {
    phase: Vec<f32>,
    light: Vec<f32>,
}

impl FirstOrder {
    pub fn new(scene: &Scene<'_, LayeredMedium>) -> Self {
        let medium = scene.medium;
        let lanes = medium.lanes();
        let scatters = |&k: &usize| {
            (0..medium.node_radii_m().len())
                .any(|node| medium.species_row(k, node).iter().any(|&s| s > 0.0))
        };
        Self {
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
    pub fn prepare(
        &mut self,
        scene: &Scene<'_, LayeredMedium>,
        columns: &Columns,
        rows: &mut Rows,
        centre: Option<&Ray>,
    ) {
        let w = self.wavelengths;
        self.guess.fill(0.0);
        self.nodes.fill(0.0);
        let beam = Sunbeam::middle(&scene.sun);
        if let Some(stretch) = centre.and_then(|ray| Stretch::new(scene.medium, ray)) {
            self.evaluate_phases(scene, stretch.ray.direction.dot(beam.towards));
            let n = self.light.len();
            for node in 0..=CELLS {
                let x = node as f64 / CELLS as f64;
                let (share, derivative) = stretch.walk.at(x);
                let at_m = share * stretch.length_m;
                let factor = (derivative * stretch.length_m) as f32;
                let width = if node == 0 || node == CELLS { 0.5 } else { 1.0 } / CELLS as f32;
                self.light.fill(0.0);
                self.scattered_at(scene, columns, rows, &stretch, at_m, &beam);
                for ((c, g), &l) in self.nodes[node * n..(node + 1) * n]
                    .iter_mut()
                    .zip(&mut self.guess)
                    .zip(&self.light)
                {
                    *c = l * factor;
                    *g += *c * width;
                }
            }
            if stretch.meets_ground {
                self.light.fill(0.0);
                self.ground(scene, columns, rows, &stretch, &beam);
                for (g, &l) in self.guess.iter_mut().zip(&self.light) {
                    *g += l;
                }
            }
        }
        // A floor relative to the sunlight, so that one dark wavelength does not draw all attention.
        let sunlight = &scene.sun.irradiance;
        let brightest = (0..w)
            .filter(|&i| sunlight[i] > 0.0)
            .map(|i| self.guess[i] / sunlight[i])
            .fold(0.0, f32::max);
        for (i, g) in self.guess.iter_mut().enumerate() {
            *g = if brightest > 0.0 {
                g.max(FLOOR * brightest * sunlight[i])
            } else {
                sunlight[i]
            };
            if !(*g > 0.0 && g.is_finite()) {
                *g = 1.0;
            }
        }
        self.distribute();
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

    /// Adds one estimate of the light from outside the air, without the sun's disc, and, if `scattered`, of the light scattered once;
    /// leaves in `beam` the sunlight that the path meets.
    #[inline(always)]
    pub fn add(
        &mut self,
        scene: &Scene<'_, LayeredMedium>,
        columns: &Columns,
        rows: &mut Rows,
        ray: &Ray,
        scattered: bool,
        sampler: &mut Sampler,
        beam: &mut Sunbeam,
        out: &mut [f32],
    ) {
        let place = sampler.uniform();
        beam.draw(&scene.sun, sampler.uniform(), sampler.rng().uniform());
        let Some(stretch) = Stretch::new(scene.medium, ray) else {
            for (o, &b) in out.iter_mut().zip(&scene.background) {
                *o += b;
            }
            return;
        };
        if !stretch.meets_ground && !self.dark_universe {
            transmittance_to_space(columns, rows, &stretch.ray);
            let behind = rows.transmittance.iter().zip(&scene.background);
            for (o, (&t, &b)) in out.iter_mut().zip(behind) {
                *o += t * b;
            }
        }
        if !scattered {
            return;
        }
        self.evaluate_phases(scene, stretch.ray.direction.dot(beam.towards));
        let (x, density) = self.draw(place as f32);
        let (share, derivative) = stretch.walk.at(x);
        let factor = (derivative * stretch.length_m) as f32 / density;
        self.light.fill(0.0);
        let distance_m = share * stretch.length_m;
        self.scattered_at(scene, columns, rows, &stretch, distance_m, beam);
        if let Some(p) = &mut self.polarised {
            lanes::scale(&mut p.light, factor);
            add_first_order(stretch.ray.direction, beam.towards, &p.light, out);
        }
        if stretch.meets_ground {
            lanes::scale(&mut self.light, factor);
            self.ground(scene, columns, rows, &stretch, beam);
            for (o, &l) in out.iter_mut().zip(&self.light) {
                *o += l;
            }
        } else {
            for (o, &l) in out.iter_mut().zip(&self.light) {
                *o += factor * l;
            }
        }
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
    fn evaluate_phases(&mut self, scene: &Scene<'_, LayeredMedium>, cos_theta: f64) {
        let n = self.light.len();
        for &k in &self.scatterers {
            scene.medium.phases()[k].eval(cos_theta, &mut self.phase[k * n..(k + 1) * n]);
        }
        if let Some(p) = &mut self.polarised {
            p.phase.fill(0.0);
            self.light.fill(1.0);
            for &k in &self.scatterers {
                let row = &mut p.phase[k * n..(k + 1) * n];
                scene.medium.phases()[k].add_f12(cos_theta, &self.light, row);
            }
        }
    }

    /// `light += T(view) Σ_k σ_s,k p_k T(sun) E` at a distance.
    #[inline(always)]
    fn scattered_at(
        &mut self,
        scene: &Scene<'_, LayeredMedium>,
        columns: &Columns,
        rows: &mut Rows,
        stretch: &Stretch,
        distance_m: f64,
        beam: &Sunbeam,
    ) {
        let medium = scene.medium;
        let at = stretch.ray.at(distance_m);
        if let Some(p) = &mut self.polarised {
            p.light.fill(0.0);
        }
        if !sun_columns(
            columns,
            at,
            beam.towards,
            &mut rows.sun_columns,
            &mut rows.sun_scratch,
        ) {
            return;
        }
        view_columns(columns, rows, stretch, distance_m);
        for (c, &s) in rows.columns.iter_mut().zip(&rows.sun_columns) {
            *c += s;
        }
        columns.optical_depth(&rows.columns, &mut rows.tau);
        lanes::exp_neg(&rows.tau, &mut rows.transmittance);
        let n = self.light.len();
        let place = medium.locate_radius(at.length());
        for &k in &self.scatterers {
            let p = &self.phase[k * n..(k + 1) * n];
            medium.add_scattering(k, place, p, &mut self.light);
            if let Some(polarised) = &mut self.polarised {
                let f12 = &polarised.phase[k * n..(k + 1) * n];
                medium.add_scattering(k, place, f12, &mut polarised.light);
            }
        }
        if let Some(p) = &mut self.polarised {
            let sunlight = rows.transmittance.iter().zip(&beam.irradiance);
            for (l, (&t, &e)) in p.light.iter_mut().zip(sunlight) {
                *l *= t * e;
            }
        }
        for ((l, &t), &e) in self
            .light
            .iter_mut()
            .zip(&rows.transmittance)
            .zip(&beam.irradiance)
        {
            *l *= t * e;
        }
    }

    /// `light += T(view) · albedo / π · cos · T(sun) E` where the ray meets the ground.
    #[inline(always)]
    fn ground(
        &mut self,
        scene: &Scene<'_, LayeredMedium>,
        columns: &Columns,
        rows: &mut Rows,
        stretch: &Stretch,
        beam: &Sunbeam,
    ) {
        let at = stretch.ray.at(stretch.length_m);
        let cosine = at.normalized().dot(beam.towards);
        if cosine <= 0.0
            || !sun_columns(
                columns,
                at,
                beam.towards,
                &mut rows.sun_columns,
                &mut rows.sun_scratch,
            )
        {
            return;
        }
        view_columns(columns, rows, stretch, stretch.length_m);
        for (c, &s) in rows.columns.iter_mut().zip(&rows.sun_columns) {
            *c += s;
        }
        columns.optical_depth(&rows.columns, &mut rows.tau);
        lanes::exp_neg(&rows.tau, &mut rows.transmittance);
        let factor = (cosine / std::f64::consts::PI) as f32;
        let lit = rows
            .transmittance
            .iter()
            .zip(&beam.irradiance)
            .zip(&scene.albedo);
        for (l, ((&t, &e), &a)) in self.light.iter_mut().zip(lit) {
            *l += factor * t * e * a;
        }
    }

    /// Adds `factor` times the radiance of the sun's disc behind the air, where a ray meets it at `mu_squared`.
    #[inline(always)]
    pub fn add_disc(
        &mut self,
        scene: &Scene<'_, LayeredMedium>,
        columns: &Columns,
        rows: &mut Rows,
        ray: &Ray,
        (mu_squared, factor): (f64, f32),
        out: &mut [f32],
    ) {
        match Stretch::new(scene.medium, ray) {
            Some(stretch) if stretch.meets_ground => return,
            Some(stretch) => transmittance_to_space(columns, rows, &stretch.ray),
            None => rows.transmittance.fill(1.0),
        }
        self.light.copy_from_slice(&scene.sun.irradiance);
        scene.sun.limb(mu_squared, &mut self.light);
        let factor = factor / scene.sun.solid_angle_sr() as f32;
        for ((o, &t), &l) in out.iter_mut().zip(&rows.transmittance).zip(&self.light) {
            *o += factor * t * l;
        }
    }
}

/// `rows.transmittance` = that of all the air along a ray from within it.
#[inline(always)]
fn transmittance_to_space(columns: &Columns, rows: &mut Rows, ray: &Ray) {
    let Rows {
        columns: through,
        start,
        tangent,
        ..
    } = rows;
    RayColumns::new(columns, ray, start, tangent).to_space(through);
    columns.optical_depth(&rows.columns, &mut rows.tau);
    lanes::exp_neg(&rows.tau, &mut rows.transmittance);
}

/// `rows.columns` = columns from the start of a stretch to a distance.
#[inline(always)]
fn view_columns(columns: &Columns, rows: &mut Rows, stretch: &Stretch, distance_m: f64) {
    let Rows {
        columns: at,
        start,
        tangent,
        ..
    } = rows;
    RayColumns::new(columns, &stretch.ray, start, tangent).to(distance_m, at);
}

/// Columns from a point to the top towards the sun; `false` where the planet stands before it.
#[inline(always)]
pub(super) fn sun_columns(
    columns: &Columns,
    at: Vec3,
    towards: Vec3,
    out: &mut [f32],
    scratch: &mut [f32],
) -> bool {
    columns_to_sun(columns, at.length(), at.dot(towards), out, scratch)
}

/// The same from a distance from the planet's centre \[m\] and the height above the plane through it that faces the sun \[m\].
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
