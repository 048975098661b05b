//! A box in the air whose content varies in all three dimensions, such as a cloud, in front of concentric shells.
//!
//! Cells are bounded by what suits a round planet: planes through its centre, so that columns stand upright, and spheres. Density is
//! constant in a cell, so a ray's optical depth is a sum over the cells that it crosses, and tracking needs no
//! interpolation. Majorants are those of blocks of cells; a ray walks from block to block (Amanatides & Woo 1987, here with planes
//! and spheres in the place of a lattice).
//!
//! ```text
//!            east_m[0]   east_m[1]   east_m[2]
//!                 ╲          │          ╱
//!   altitude_m[2]  ╲─────────┼─────────╱
//!                   ╲        │        ╱
//!   altitude_m[1]    ╲───────┼───────╱
//!                     ╲      │      ╱            all planes meet in the centre of the planet
//! ```

use super::layered::Shells;
use super::{LayeredMedium, Medium, Ray, Segment, Span};
use crate::error::{check_range, Error, Result};
use crate::math::{lanes, Vec3};
use crate::optics::Phase;

/// Cells along each side of a block that shares a majorant.
const BLOCK: usize = 4;

/// Majorants are raised by this factor, so that rounding never lifts a coefficient above its bound.
const MARGIN: f64 = 1.0 + 1e-5;

/// A box of cells, and what fills them.
#[derive(Debug, Clone)]
pub struct GridBox {
    east_m: Vec<f64>,
    north_m: Vec<f64>,
    altitude_m: Vec<f64>,
    /// Factor on the coefficients, shape (altitude, north, east).
    density: Vec<f32>,
    sigma_t: Vec<f32>,
    sigma_s: Vec<f32>,
    phase: Phase,
}

impl GridBox {
    /// A box from its edges and its content.
    ///
    /// # Arguments
    /// * `east_m`, `north_m` — edges of the cells where they cut the plane that touches the sphere of altitude 0 under the
    ///   observer, strictly increasing, shapes (x + 1,) and (y + 1,), in [−10⁶, 10⁶]
    /// * `altitude_m` — edges above the planet's sphere, strictly increasing, shape (z + 1,)
    /// * `density` — factor on the coefficients in each cell \[1\], ≥ 0, shape (z, y, x), east running fastest
    /// * `sigma_s`, `sigma_a` — scattering and absorption coefficients at density 1 \[m⁻¹\], ≥ 0, shape (w,)
    /// * `phase` — phase function at the same wavelengths
    ///
    /// # Errors
    /// [`Error::OutOfRange`], [`Error::ShapeMismatch`], [`Error::Invalid`].
    pub fn new(
        edges_m: [&[f64]; 3],
        density: &[f64],
        sigma_s: &[f64],
        sigma_a: &[f64],
        phase: Phase,
    ) -> Result<Self> {
        let names = ["east", "north", "altitude"];
        let ranges = [-1e6..=1e6, -1e6..=1e6, -1e6..=1e9];
        for ((name, edges), range) in names.into_iter().zip(edges_m).zip(ranges) {
            for &edge in edges {
                check_range(name, edge, "m", range.clone())?;
            }
            if edges.len() < 2 || edges.windows(2).any(|e| e[0] >= e[1]) {
                return Err(Error::invalid(
                    format!("the box's edges in {name} do not make cells"),
                    "give at least two edges, each larger than the one before",
                ));
            }
        }
        let cells: Vec<usize> = edges_m.iter().map(|edges| edges.len() - 1).collect();
        if density.len() != cells[0] * cells[1] * cells[2] {
            return Err(Error::ShapeMismatch {
                name: "density".into(),
                got: format!("({},)", density.len()),
                expected: format!(
                    "(altitude, north, east) = ({}, {}, {})",
                    cells[2], cells[1], cells[0]
                ),
            });
        }
        let (w, lanes) = (sigma_s.len(), lanes::padded(sigma_s.len()));
        if sigma_a.len() != w || phase.lanes() != lanes {
            return Err(Error::ShapeMismatch {
                name: "the box's coefficients".into(),
                got: "different numbers of wavelengths".into(),
                expected: format!("{w} wavelengths in sigma_s, sigma_a and the phase function"),
            });
        }
        for (name, values) in [
            ("density", density),
            ("sigma_s", sigma_s),
            ("sigma_a", sigma_a),
        ] {
            for &v in values {
                check_range(name, v, "", 0.0..=1e6)?;
            }
        }
        Ok(Self {
            east_m: edges_m[0].to_vec(),
            north_m: edges_m[1].to_vec(),
            altitude_m: edges_m[2].to_vec(),
            density: density.iter().map(|&d| d as f32).collect(),
            sigma_t: lanes::row_from(w, |i| sigma_s[i] + sigma_a[i]),
            sigma_s: lanes::row_from(w, |i| sigma_s[i]),
            phase,
        })
    }

    /// Density of a cell, by its indices in east, north and altitude.
    fn density_of(&self, [x, y, z]: [usize; 3]) -> f32 {
        let (nx, ny) = (self.east_m.len() - 1, self.north_m.len() - 1);
        self.density[(z * ny + y) * nx + x]
    }
}

/// Edges of cells around a planet, and a number in each cell.
#[derive(Debug, Clone)]
struct Cells {
    planet_radius_m: f64,
    east_m: Vec<f64>,
    north_m: Vec<f64>,
    radius_m: Vec<f64>,
    value: Vec<f64>,
}

impl Cells {
    /// The largest densities of blocks of cells.
    fn blocks(grid: &GridBox, planet_radius_m: f64) -> Self {
        let coarse = |edges: &[f64]| -> Vec<f64> {
            let inner = edges[..edges.len() - 1].iter().step_by(BLOCK);
            inner.chain(edges.last()).copied().collect()
        };
        let (east_m, north_m) = (coarse(&grid.east_m), coarse(&grid.north_m));
        let altitude_m = coarse(&grid.altitude_m);
        let counts = [&grid.east_m, &grid.north_m, &grid.altitude_m].map(|e| e.len() - 1);
        let (nx, ny) = (east_m.len() - 1, north_m.len() - 1);
        let mut value = vec![0.0f64; nx * ny * (altitude_m.len() - 1)];
        for z in 0..counts[2] {
            for y in 0..counts[1] {
                for x in 0..counts[0] {
                    let block = (z / BLOCK * ny + y / BLOCK) * nx + x / BLOCK;
                    value[block] = value[block].max(f64::from(grid.density_of([x, y, z])));
                }
            }
        }
        Self {
            planet_radius_m,
            east_m,
            north_m,
            radius_m: altitude_m.iter().map(|z| planet_radius_m + z).collect(),
            value,
        }
    }

    fn value_of(&self, [x, y, z]: [usize; 3]) -> f64 {
        let (nx, ny) = (self.east_m.len() - 1, self.north_m.len() - 1);
        self.value[(z * ny + y) * nx + x]
    }
}

/// Which cell of some edges a value falls into; the nearest one outside of them.
#[inline(always)]
fn cell_of(edges: &[f64], value: f64) -> usize {
    edges
        .partition_point(|&e| e <= value)
        .clamp(1, edges.len() - 1)
        - 1
}

/// Concentric shells with a box in them; [`crate::transport::Tracker`] and [`crate::transport::Classic`] take it as it is.
#[derive(Debug, Clone)]
pub struct GriddedMedium<'a> {
    background: &'a LayeredMedium,
    grid: &'a GridBox,
    planet_radius_m: f64,
    blocks: Cells,
    phases: Vec<Phase>,
    /// Largest σ_t at density 1 of all wavelengths \[m⁻¹\].
    highest: f64,
}

impl<'a> GriddedMedium<'a> {
    /// A box in shells. What lies under the ground or above the top of the shells is never seen.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`] for a box of another number of wavelengths.
    pub fn new(background: &'a LayeredMedium, grid: &'a GridBox) -> Result<Self> {
        if grid.sigma_t.len() != background.lanes() || grid.phase.lanes() != background.lanes() {
            return Err(Error::ShapeMismatch {
                name: "the box's coefficients".into(),
                got: "another number of wavelengths".into(),
                expected: format!("{}, those of the air", background.wavelength_nm().len()),
            });
        }
        let planet_radius_m = background.ground_radius_m() - background.altitude_m()[0];
        let mut phases = background.phases().to_vec();
        phases.push(grid.phase.clone());
        Ok(Self {
            background,
            grid,
            planet_radius_m,
            blocks: Cells::blocks(grid, planet_radius_m),
            phases,
            highest: f64::from(grid.sigma_t.iter().copied().fold(0.0, f32::max)) * MARGIN,
        })
    }

    /// Density of the box at a point; 0 outside.
    #[inline(always)]
    fn density_at(&self, at: Vec3) -> f32 {
        let grid = self.grid;
        let altitude_m = at.length() - self.planet_radius_m;
        let scale = self.planet_radius_m / at.z;
        let place = [at.x * scale, at.y * scale, altitude_m];
        let edges = [&grid.east_m, &grid.north_m, &grid.altitude_m];
        let inside = at.z > 0.0
            && place
                .iter()
                .zip(edges)
                .all(|(v, e)| e[0] <= *v && *v < e[e.len() - 1]);
        if !inside {
            return 0.0;
        }
        let cell = [0, 1, 2].map(|k| cell_of(edges[k], place[k]));
        grid.density_of(cell)
    }
}

impl Medium for GriddedMedium<'_> {
    type Segments<'s>
        = Pieces<'s>
    where
        Self: 's;

    fn wavelength_nm(&self) -> &[f64] {
        self.background.wavelength_nm()
    }

    #[inline(always)]
    fn lanes(&self) -> usize {
        self.background.lanes()
    }

    #[inline(always)]
    fn ground_radius_m(&self) -> f64 {
        self.background.ground_radius_m()
    }

    #[inline(always)]
    fn top_radius_m(&self) -> f64 {
        self.background.top_radius_m()
    }

    #[inline(always)]
    fn segments(&self, ray: &Ray, span: Span) -> Pieces<'_> {
        let mut pieces = Pieces {
            shells: self.background.segments(ray, span),
            walk: Walk::new(&self.blocks, ray, span),
            highest: self.highest,
            shell: None,
            block: None,
        };
        pieces.shell = pieces.shells.next();
        pieces.block = pieces.walk.next();
        pieces
    }

    #[inline(always)]
    fn extinction(&self, at: Vec3, sigma_t: &mut [f32]) {
        self.background.extinction(at, sigma_t);
        add(self.density_at(at), &self.grid.sigma_t, sigma_t);
    }

    #[inline(always)]
    fn extinction_and_scattering(&self, at: Vec3, sigma_t: &mut [f32], sigma_s: &mut [f32]) {
        self.background
            .extinction_and_scattering(at, sigma_t, sigma_s);
        let density = self.density_at(at);
        add(density, &self.grid.sigma_t, sigma_t);
        add(density, &self.grid.sigma_s, sigma_s);
    }

    #[inline(always)]
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    #[inline(always)]
    fn species_scattering(&self, species: usize, at: Vec3, sigma_s: &mut [f32]) {
        if species + 1 < self.phases.len() {
            return self.background.species_scattering(species, at, sigma_s);
        }
        sigma_s.fill(0.0);
        add(self.density_at(at), &self.grid.sigma_s, sigma_s);
    }

    #[inline(always)]
    fn coefficients_at(&self, lane: usize, at: Vec3) -> (f64, f64) {
        let (sigma_t, sigma_s) = self.background.coefficients_at(lane, at);
        let density = self.density_at(at);
        (
            sigma_t + f64::from(density * self.grid.sigma_t[lane]),
            sigma_s + f64::from(density * self.grid.sigma_s[lane]),
        )
    }

    #[inline(always)]
    fn species_scattering_at(&self, species: usize, lane: usize, at: Vec3) -> f64 {
        if species + 1 < self.phases.len() {
            return self.background.species_scattering_at(species, lane, at);
        }
        f64::from(self.density_at(at) * self.grid.sigma_s[lane])
    }

    fn global_majorant(&self, lane: usize) -> f64 {
        let densest = self.blocks.value.iter().copied().fold(0.0, f64::max);
        let own = densest * f64::from(self.grid.sigma_t[lane]) * MARGIN;
        self.background.global_majorant(lane) + own
    }
}

#[inline(always)]
fn add(density: f32, sigma: &[f32], out: &mut [f32]) {
    if density > 0.0 {
        for (o, &s) in out.iter_mut().zip(sigma) {
            *o += density * s;
        }
    }
}

/// The pieces of a ray in which both the shell and the block stay the same.
#[derive(Debug)]
pub struct Pieces<'a> {
    shells: Shells<'a>,
    walk: Walk<'a>,
    highest: f64,
    shell: Option<Segment>,
    block: Option<Segment>,
}

impl Iterator for Pieces<'_> {
    type Item = Segment;

    #[inline(always)]
    fn next(&mut self) -> Option<Segment> {
        let shell = self.shell?;
        // Both cover the same span; should rounding end the walk first, the rest of it is outside the box.
        let block = self.block.unwrap_or(Segment {
            end_m: f64::INFINITY,
            sigma_maj: 0.0,
        });
        let end_m = shell.end_m.min(block.end_m);
        if shell.end_m <= end_m {
            self.shell = self.shells.next();
        }
        if block.end_m <= end_m {
            self.block = self.walk.next();
        }
        Some(Segment {
            end_m,
            sigma_maj: shell.sigma_maj + block.sigma_maj * self.highest,
        })
    }
}

/// The cells that a ray crosses, in order, with their values in the place of a majorant; 0 outside.
#[derive(Debug)]
struct Walk<'a> {
    cells: &'a Cells,
    ray: Ray,
    tangent_m: f64,
    impact_squared: f64,
    at_m: f64,
    end_m: f64,
    /// Stretches inside the box: before and behind the sphere under its floor.
    inside: [Span; 2],
    /// The stretch that comes next, or is being crossed.
    stretch: usize,
    /// The cell, while a stretch is being crossed.
    cell: Option<[usize; 3]>,
}

/// A stretch of no length, that nothing ever reaches.
const NOWHERE: Span = Span {
    start_m: f64::INFINITY,
    end_m: f64::NEG_INFINITY,
};

impl<'a> Walk<'a> {
    #[inline(always)]
    fn new(cells: &'a Cells, ray: &Ray, span: Span) -> Self {
        let mut walk = Self {
            cells,
            ray: *ray,
            tangent_m: ray.distance_to_tangent_m(),
            impact_squared: ray.impact_parameter_squared(),
            at_m: span.start_m,
            end_m: span.end_m,
            inside: [NOWHERE; 2],
            stretch: 0,
            cell: None,
        };
        walk.find_stretches(span);
        walk
    }

    /// Cuts the span by the box: its four sides are half-spaces, and together with its ceiling convex; its floor is not.
    #[inline(always)]
    fn find_stretches(&mut self, span: Span) {
        let radii = &self.cells.radius_m;
        let (mut start, mut end) = (span.start_m, span.end_m);
        let Some(ceiling) = self.ray.sphere(radii[radii.len() - 1]) else {
            return;
        };
        start = start.max(ceiling.start_m);
        end = end.min(ceiling.end_m);
        for axis in 0..2 {
            let edges = self.edges(axis);
            for (edge, sign) in [(edges[0], 1.0), (edges[edges.len() - 1], -1.0)] {
                // Inside is where sign · (a + b s) ≥ 0.
                let (a, b) = self.plane(axis, edge);
                let (a, b) = (sign * a, sign * b);
                if b > 0.0 {
                    start = start.max(-a / b);
                } else if b < 0.0 {
                    end = end.min(-a / b);
                } else if a < 0.0 {
                    return;
                }
            }
        }
        let whole = Span {
            start_m: start,
            end_m: end,
        };
        self.inside = match self.ray.sphere(radii[0]) {
            None => [whole, NOWHERE],
            Some(floor) => [
                Span {
                    end_m: end.min(floor.start_m),
                    ..whole
                },
                Span {
                    start_m: start.max(floor.end_m),
                    ..whole
                },
            ],
        };
    }

    #[inline(always)]
    fn edges(&self, axis: usize) -> &'a [f64] {
        match axis {
            0 => &self.cells.east_m,
            _ => &self.cells.north_m,
        }
    }

    /// `a + b s` along the ray, positive on the far side of an edge's plane: `R x − edge · z` of the point.
    #[inline(always)]
    fn plane(&self, axis: usize, edge: f64) -> (f64, f64) {
        let r = self.cells.planet_radius_m;
        let (o, d) = (self.ray.origin, self.ray.direction);
        match axis {
            0 => (r * o.x - edge * o.z, r * d.x - edge * d.z),
            _ => (r * o.y - edge * o.z, r * d.y - edge * d.z),
        }
    }

    /// The cell at a distance.
    #[inline(always)]
    fn locate(&self, distance_m: f64) -> [usize; 3] {
        let at = self.ray.at(distance_m);
        let scale = self.cells.planet_radius_m / at.z;
        [
            cell_of(&self.cells.east_m, at.x * scale),
            cell_of(&self.cells.north_m, at.y * scale),
            cell_of(&self.cells.radius_m, at.length()),
        ]
    }

    /// Where the ray leaves the cell, across which axis, and to which index there.
    #[inline(always)]
    fn exit(&self, cell: [usize; 3]) -> (f64, usize, Option<usize>) {
        let mut first = (f64::INFINITY, 0, None);
        let (o, d) = (self.ray.origin, self.ray.direction);
        for (axis, turn) in [d.x * o.z - o.x * d.z, d.y * o.z - o.y * d.z]
            .into_iter()
            .enumerate()
        {
            // East and north of the point only grow, or only fall, along a ray: its slope has the sign of `turn`.
            if turn == 0.0 {
                continue;
            }
            let edges = self.edges(axis);
            let up = turn > 0.0;
            let (a, b) = self.plane(axis, edges[cell[axis] + usize::from(up)]);
            let crossing = -a / b;
            // Where the plane is neared at all: `a + b s` rises to 0 from within, or falls to it.
            let ahead = if up { b > 0.0 } else { b < 0.0 };
            if ahead && crossing < first.0 {
                let next = neighbour(cell[axis], up, edges.len() - 1);
                first = (crossing, axis, next);
            }
        }
        let radii = &self.cells.radius_m;
        let under = radii[cell[2]] * radii[cell[2]] - self.impact_squared;
        let falls = self.at_m < self.tangent_m && under > 0.0;
        let crossing = if falls {
            self.tangent_m - under.sqrt()
        } else {
            let above = radii[cell[2] + 1];
            self.tangent_m + (above * above - self.impact_squared).max(0.0).sqrt()
        };
        if crossing < first.0 {
            first = (crossing, 2, neighbour(cell[2], !falls, radii.len() - 1));
        }
        first
    }
}

/// The next index up or down of `n`, unless there is none.
#[inline(always)]
fn neighbour(index: usize, up: bool, n: usize) -> Option<usize> {
    if up {
        (index + 1 < n).then_some(index + 1)
    } else {
        index.checked_sub(1)
    }
}

impl Iterator for Walk<'_> {
    type Item = Segment;

    #[inline(always)]
    fn next(&mut self) -> Option<Segment> {
        if self.at_m >= self.end_m {
            return None;
        }
        while self.stretch < 2 {
            let stretch = self.inside[self.stretch];
            if stretch.start_m >= stretch.end_m || self.at_m >= stretch.end_m {
                self.stretch += 1;
                self.cell = None;
                continue;
            }
            let Some(cell) = self.cell else {
                if self.at_m < stretch.start_m {
                    // On the way to the box.
                    self.at_m = stretch.start_m;
                    return Some(Segment {
                        end_m: self.at_m,
                        sigma_maj: 0.0,
                    });
                }
                self.cell = Some(self.locate(self.at_m));
                continue;
            };
            let sigma_maj = self.cells.value_of(cell);
            let (exit, axis, next) = self.exit(cell);
            self.at_m = exit.max(self.at_m).min(stretch.end_m);
            self.cell = match next {
                Some(index) if self.at_m < stretch.end_m => {
                    let mut cell = cell;
                    cell[axis] = index;
                    Some(cell)
                }
                // Out of the box, by rounding a little before the stretch's end.
                _ => {
                    self.at_m = stretch.end_m;
                    None
                }
            };
            return Some(Segment {
                end_m: self.at_m,
                sigma_maj,
            });
        }
        self.at_m = self.end_m;
        Some(Segment {
            end_m: self.end_m,
            sigma_maj: 0.0,
        })
    }
}

#[cfg(test)]
mod tests;
