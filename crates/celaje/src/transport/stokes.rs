//! Polarisation along a path: what becomes of unpolarised sunlight on its way to the observer.
//!
//! A path is walked from the eye, light runs the other way. The observer's Stokes vector is a product of matrices,
//!
//! ```text
//! (I, Q, U, V) = R₁ F₁ · R₂ F₂ · … · Rₙ Fₙ · (E, 0, 0, 0)
//! ```
//!
//! Fⱼ scatters in the plane of the directions at vertex j, Rⱼ turns from that plane to the one of the vertex before (to the
//! observer's meridian plane at the first). Directions, distances and weights `w` are those of the scalar path, whose densities
//! are phase functions: so the product is carried as `N = Π Rⱼ Fⱼ / F11ⱼ`, one 4 × 4 matrix per wavelength, and every
//! contribution of the scalar path is multiplied by the first column of N. The estimate is unbiased whatever the densities,
//! so it is here; and where all elements but F11 vanish it is the scalar one bit for bit.
//!
//! F is block diagonal in a scattering plane (`optics/mueller.rs`) and R mixes Q and U only.

use crate::math::{lanes, Vec3};
use crate::medium::Medium;
use crate::optics::MuellerRows;

/// Components of a Stokes vector.
pub(super) const COMPONENTS: usize = 4;

/// `cos 2η` and `sin 2η` of a turn between reference planes, and the normal of the new plane.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    pub cos2: f32,
    pub sin2: f32,
    normal: Vec3,
}

/// Second vector of a Stokes basis, across the reference plane: φ̂ of the observer's meridian plane.
///
/// Looking straight up or down the plane is that of north and south.
#[inline(always)]
pub(super) fn across_meridian(look: Vec3) -> Vec3 {
    // φ̂ = ẑ × k / |…| with k = −look.
    let across = Vec3::new(look.y, -look.x, 0.0);
    let length = across.length();
    if length > 0.0 {
        across * (1.0 / length)
    } else {
        Vec3::new(1.0, 0.0, 0.0)
    }
}

impl Turn {
    /// From the plane of two directions of a path, `old` walked before the vertex and `new` after it, to the reference plane
    /// that `across` is normal to; `old ⊥ across`, both of length 1.
    #[inline(always)]
    pub fn new(across: Vec3, old: Vec3, new: Vec3) -> Self {
        // With n = old × new: cos η ∝ across · n = new · (across × old), sin η ∝ new · across.
        let (c, s) = (new.dot(across.cross(old)), new.dot(across));
        let squared = c * c + s * s;
        if squared > 1e-24 {
            Self {
                cos2: ((c * c - s * s) / squared) as f32,
                sin2: (2.0 * c * s / squared) as f32,
                normal: old.cross(new) * (1.0 / squared.sqrt()),
            }
        } else {
            // Straight on or back: any plane will do.
            Self {
                cos2: 1.0,
                sin2: 0.0,
                normal: across,
            }
        }
    }
}

/// The matrix `N` of a path at every wavelength, and the plane it refers to.
pub(super) struct Stokes {
    lanes: usize,
    /// `N`, shape (row, column, lanes).
    matrix: Vec<f32>,
    /// Columns in use: 3 where nothing makes light circular, else 4.
    columns: usize,
    /// Rows in use: 1 where the radiance is all that is wanted, else as many as columns.
    rows: usize,
    /// Normal of the plane of its columns.
    across: Vec3,
    /// Whether anything but unpolarised light counts: not below a reflection at the ground.
    alive: bool,
    mueller: MuellerRows,
    f12: Vec<f32>,
    /// What the path finds of Q, U and V, still in units of the first guess, shape (3, lanes).
    found: Vec<f32>,
}

impl Stokes {
    /// `all` — whether Q, U and V are wanted beside I.
    pub fn new<M: Medium>(medium: &M, all: bool) -> Self {
        let lanes = medium.lanes();
        let circular = medium.phases().iter().any(|p| p.makes_circular());
        let columns = if circular { 4 } else { 3 };
        Self {
            lanes,
            matrix: vec![0.0; COMPONENTS * COMPONENTS * lanes],
            columns,
            rows: if all { columns } else { 1 },
            across: Vec3::new(1.0, 0.0, 0.0),
            alive: true,
            mueller: MuellerRows::new(lanes),
            f12: vec![0.0; lanes],
            found: vec![0.0; (COMPONENTS - 1) * lanes],
        }
    }

    /// Begins a path from the eye.
    #[inline(always)]
    pub fn start(&mut self, look: Vec3) {
        self.matrix[..self.rows * COMPONENTS * self.lanes].fill(0.0);
        for k in 0..self.rows {
            let at = k * (COMPONENTS + 1) * self.lanes;
            self.matrix[at..at + self.lanes].fill(1.0);
        }
        self.across = across_meridian(look);
        self.alive = true;
        self.found.fill(0.0);
    }

    /// Takes what was found to the result: `out[component] += found · guess` for Q, U, V, if they are wanted.
    #[inline(always)]
    pub fn add_found(&self, guess: &[f32], out: &mut [f32]) {
        let n = self.lanes;
        if self.rows == 1 {
            return;
        }
        for (row, found) in out[n..].chunks_exact_mut(n).zip(self.found.chunks_exact(n)) {
            for i in 0..n {
                row[i] += found[i] * guess[i];
            }
        }
    }

    /// Scatters at a vertex of the air: `N ← N R F / F11`.
    ///
    /// * `split` — the path's weights times σ_s, split by species, shape (species, lanes), and `split_sum` their sums
    /// * `mixed` — `Σ split · F11` at the angle between the directions, all species
    #[inline(always)]
    pub fn scatter<M: Medium>(
        &mut self,
        medium: &M,
        (split, split_sum): (&[f32], &[f32]),
        mixed: &[f32],
        (old, new): (Vec3, Vec3),
    ) {
        let n = self.lanes;
        let cos_theta = old.dot(new);
        self.mueller.clear();
        for (k, phase) in medium.phases().iter().enumerate() {
            if split_sum[k] > 0.0 {
                phase.add_mueller(cos_theta, &split[k * n..(k + 1) * n], &mut self.mueller);
            }
        }
        let turn = Turn::new(self.across, old, new);
        self.across = turn.normal;
        let mixed = &mixed[..n];
        let [f12, f22, f33, f34, f44] = self.mueller.elements();
        let (cos2, sin2) = (turn.cos2, turn.sin2);
        for row in self.matrix.chunks_exact_mut(COMPONENTS * n).take(self.rows) {
            let (r0, rest) = row.split_at_mut(n);
            let (r1, rest) = rest.split_at_mut(n);
            let (r2, r3) = rest.split_at_mut(n);
            if self.columns == 4 {
                for i in 0..n {
                    let inverse = inverse(mixed[i]);
                    let q = r1[i] * cos2 - r2[i] * sin2;
                    let u = r1[i] * sin2 + r2[i] * cos2;
                    let (i0, v) = (r0[i], r3[i]);
                    r0[i] = i0 + q * f12[i] * inverse;
                    r1[i] = (i0 * f12[i] + q * f22[i]) * inverse;
                    r2[i] = (u * f33[i] + v * f34[i]) * inverse;
                    r3[i] = (v * f44[i] - u * f34[i]) * inverse;
                }
            } else {
                for i in 0..n {
                    let inverse = inverse(mixed[i]);
                    let q = r1[i] * cos2 - r2[i] * sin2;
                    let u = r1[i] * sin2 + r2[i] * cos2;
                    let i0 = r0[i];
                    r0[i] = i0 + q * f12[i] * inverse;
                    r1[i] = (i0 * f12[i] + q * f22[i]) * inverse;
                    r2[i] = u * f33[i] * inverse;
                }
            }
        }
        self.alive = true;
    }

    /// Reflects at a ground that depolarises: only what arrives unpolarised counts from here on.
    #[inline(always)]
    pub fn depolarise(&mut self) {
        let n = self.lanes;
        for row in self.matrix.chunks_exact_mut(COMPONENTS * n).take(self.rows) {
            row[n..].fill(0.0);
        }
        self.alive = false;
    }

    /// Takes a contribution of unpolarised light: `found += light · N e₀`.
    #[inline(always)]
    pub fn find_unpolarised(&mut self, light: &[f32], found: &mut [f32]) {
        let n = self.lanes;
        let (light, found) = (&light[..n], &mut found[..n]);
        for i in 0..n {
            found[i] += light[i] * self.matrix[i];
        }
        let others = self.found.chunks_exact_mut(n).take(self.rows - 1);
        for (c, found) in others.enumerate() {
            let row = &self.matrix[(c + 1) * COMPONENTS * n..][..n];
            for i in 0..n {
                found[i] += light[i] * row[i];
            }
        }
    }

    /// Takes a contribution of sunlight scattered at a vertex of the air: `found += light · N R F e₀ / F11`.
    ///
    /// * `split`, `split_sum` — as in [`Stokes::scatter`]
    /// * `mixed` — `Σ split · F11` at the angle between the path and the sun
    /// * `light` — the scalar contribution
    /// * `found` — the path's radiance
    #[inline(always)]
    pub fn find_sun<M: Medium>(
        &mut self,
        medium: &M,
        (split, split_sum): (&[f32], &[f32]),
        mixed: &[f32],
        (old, towards): (Vec3, Vec3),
        light: &[f32],
        found: &mut [f32],
    ) {
        if !self.alive {
            self.find_unpolarised(light, found);
            return;
        }
        let n = self.lanes;
        let cos_theta = old.dot(towards);
        self.f12.fill(0.0);
        for (k, phase) in medium.phases().iter().enumerate() {
            if split_sum[k] > 0.0 {
                phase.add_f12(cos_theta, &split[k * n..(k + 1) * n], &mut self.f12);
            }
        }
        for (f, &m) in self.f12.iter_mut().zip(mixed) {
            *f *= inverse(m);
        }
        let turn = Turn::new(self.across, old, towards);
        let (cos2, sin2) = (turn.cos2, turn.sin2);
        let (light, f12) = (&light[..n], &self.f12[..n]);
        let mut rows = self.matrix.chunks_exact(COMPONENTS * n);
        let add = |found: &mut [f32], row: &[f32]| {
            let (r0, r1, r2) = (&row[..n], &row[n..2 * n], &row[2 * n..3 * n]);
            let found = &mut found[..n];
            for i in 0..n {
                let polarised = (r1[i] * cos2 - r2[i] * sin2) * f12[i];
                found[i] += light[i] * (r0[i] + polarised);
            }
        };
        if let Some(row) = rows.next() {
            add(found, row);
        }
        for (found, row) in self.found.chunks_exact_mut(n).zip(rows).take(self.rows - 1) {
            add(found, row);
        }
    }
}

/// `1 / x`, and 0 where nothing scatters.
#[inline(always)]
fn inverse(x: f32) -> f32 {
    if x > 0.0 {
        1.0 / x
    } else {
        0.0
    }
}

/// Adds single scattering to Q and U: `light12` is `Σ σ_s F12` along the ray, times transmittances and sunlight.
#[inline(always)]
pub(super) fn add_first_order(look: Vec3, towards_sun: Vec3, light12: &[f32], out: &mut [f32]) {
    let n = light12.len();
    let turn = Turn::new(across_meridian(look), look, towards_sun);
    let (q, u) = out[n..3 * n].split_at_mut(n);
    lanes::add_scaled(light12, turn.cos2, q);
    lanes::add_scaled(light12, -turn.sin2, u);
}
