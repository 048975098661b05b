//! One shell of a layered medium: what `columns.rs` knows of it, and the formulas within.

/// A node of altitude, with the shell below it: all that a lookup needs, in one line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Node {
    pub(super) radius_m: f64,
    pub(super) inverse_radius: f64,
    /// Radius of the node below (of the first one itself) \[m\], and 1 over the distance to it \[m⁻¹\].
    pub(super) below_m: f64,
    pub(super) inverse_thickness: f64,
    /// `R_top² − r²` \[m²\].
    pub(super) to_top_squared: f64,
    /// Shortest way to the top \[m\], and the inverse of how much longer the horizontal one is.
    pub(super) shortest_m: f64,
    pub(super) inverse_stretch: f64,
}

impl Node {
    pub(super) fn new(below_m: f64, radius_m: f64, top_m: f64) -> Self {
        let to_top_squared = (top_m - radius_m) * (top_m + radius_m);
        let shortest_m = top_m - radius_m;
        let stretch = to_top_squared.sqrt() - shortest_m;
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        Self {
            radius_m,
            inverse_radius: 1.0 / radius_m,
            below_m,
            inverse_thickness: inverse(radius_m - below_m),
            to_top_squared,
            shortest_m,
            inverse_stretch: inverse(stretch),
        }
    }
}

/// Mean, along a ray in one shell up to its upper node, of the fraction `(r − below) / (above − below)`.
///
/// * `s`, `s_end` — distances from the point nearest the planet's centre, at the start and at the node
/// * `inverse_r`, `start` — inverse of the radius, and fraction at the start
///
/// Simpson's rule: `r(s)` is a gentle hyperbola.
#[inline(always)]
pub(super) fn mean_fraction(
    s: f64,
    s_end: f64,
    inverse_r: f64,
    start: f64,
    inverse_thickness: f64,
) -> f64 {
    let s_mid = 0.5 * (s + s_end);
    // r_mid − r without cancellation, from r_mid² − r² = s_mid² − s², by the first terms of a series in x = (r_mid / r)² − 1: a
    // shell is thin against its radius.
    let rise = (s_mid - s) * (s_mid + s);
    let x = rise * inverse_r * inverse_r;
    let climb = 0.5 * rise * inverse_r * (1.0 - x * (0.25 - x * (0.125 - 0.078_125 * x)));
    let middle = start + climb * inverse_thickness;
    (start + 4.0 * middle + 1.0) * (1.0 / 6.0)
}

/// Lagrange's cubic through four equidistant values, at `x` from the first; inside, 1 ≤ x ≤ 2.
#[inline(always)]
pub(super) fn cubic_weights(x: f64) -> [f64; 4] {
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    let (ab, cd) = (a * b, c * d);
    [
        -1.0 / 6.0 * b * cd,
        0.5 * a * cd,
        -0.5 * ab * d,
        1.0 / 6.0 * ab * c,
    ]
}
