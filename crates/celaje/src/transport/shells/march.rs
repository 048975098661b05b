//! Cutting a ray into steps at the shells it crosses.

use crate::math::lanes;
use crate::medium::{Columns, LayeredMedium, Medium, Ray, RayColumns, RayGeometry, Span};

/// Longest step [m]: the sun's zenith angle turns by half a degree.
const LONGEST_STEP_M: f64 = 50_000.0;

/// Optical depth, at the first wavelength, above which a stretch is cut in parts.
const THICKEST_STEP: f64 = 1.0;

/// The upper of the two Gauss points of [0, 1]: `(1 + 1/√3)/2`.
const GAUSS_2: f64 = 0.788_675_134_594_812_9;

/// Altitudes at which rays are cut: a choice of the medium's nodes, dense near the ground, with both sides of each edge.
#[derive(Debug, Clone)]
pub struct Levels {
    radius_m: Vec<f64>,
}

impl Levels {
    /// Nodes at least `spacing_m` + `growth` · (height above ground) apart, and every pair of nodes closer than 5 m.
    pub fn new(medium: &LayeredMedium, spacing_m: f64, growth: f64) -> Self {
        const EDGE_M: f64 = 5.0;
        let nodes = medium.node_radii_m();
        let ground = nodes[0];
        let mut radius_m = vec![ground];
        for (i, &r) in nodes.iter().enumerate().skip(1) {
            let last = radius_m[radius_m.len() - 1];
            let far = r - last >= spacing_m + growth * (r - ground);
            let edge =
                r - nodes[i - 1] < EDGE_M || nodes.get(i + 1).is_some_and(|n| n - r < EDGE_M);
            if far || edge || i + 1 == nodes.len() {
                radius_m.push(r);
            }
        }
        Self { radius_m }
    }
}

/// A point of a ray at which its source is taken.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    /// Distance along the ray [m].
    pub distance_m: f64,
    /// Distance from the planet's centre [m].
    pub radius_m: f64,
    /// Cosine of the zenith angle of the ray there.
    pub mu: f64,
}

/// A ray cut into steps, each with the weight of its source at every wavelength: transmittance × length.
#[derive(Debug, Default)]
pub struct March {
    pub steps: Vec<Step>,
    /// Weights [m], shape (step, lanes).
    pub weights: Vec<f32>,
    /// Transmittance of the whole ray, one row.
    pub through: Vec<f32>,
    /// Length in the air [m].
    pub length_m: f64,
    /// Whether the ground ends it.
    pub meets_ground: bool,
    cuts: Vec<f64>,
    start: Vec<f32>,
    tangent: Vec<f32>,
    columns: Vec<f32>,
    tau: Vec<f32>,
}

impl March {
    /// Cuts a ray that starts inside the air. Its origin is the start of the steps' distances.
    #[inline(always)]
    pub fn cut(&mut self, medium: &LayeredMedium, columns: &Columns, levels: &Levels, ray: &Ray) {
        let n = medium.lanes();
        self.start.resize(columns.count(), 0.0);
        self.tangent.resize(columns.count(), 0.0);
        self.columns.resize(columns.count(), 0.0);
        for row in [&mut self.tau, &mut self.through] {
            row.resize(n, 0.0);
        }
        self.steps.clear();
        self.weights.clear();
        let Some((span, meets_ground)) =
            ray.through_air(medium.ground_radius_m(), medium.top_radius_m())
        else {
            self.length_m = 0.0;
            self.meets_ground = false;
            self.through.fill(1.0);
            return;
        };
        self.length_m = span.end_m;
        self.meets_ground = meets_ground;
        self.find_cuts(levels, ray, span);

        let along = RayColumns::new(columns, ray, &mut self.start, &mut self.tangent);
        for pair in self.cuts.windows(2) {
            let length = pair[1] - pair[0];
            let middle = 0.5 * (pair[0] + pair[1]);
            let thick = along.extinction(middle, 0) * length / THICKEST_STEP;
            let parts = thick.max(length / LONGEST_STEP_M).ceil().clamp(1.0, 12.0);
            // Two Gauss points in each part: exact for cubics, so for air that thins out exponentially nearly exact.
            let ds = 0.5 * length / parts;
            for half in 0..2 * parts as usize {
                let offset = if half % 2 == 0 {
                    1.0 - GAUSS_2
                } else {
                    GAUSS_2
                };
                let s = pair[0] + ((half - half % 2) as f64 + 2.0 * offset) * ds;
                let (radius_m, mu) = along.geometry.at(s);
                self.steps.push(Step {
                    distance_m: s,
                    radius_m,
                    mu,
                });
                along.to(s, &mut self.columns);
                columns.optical_depth(&self.columns, &mut self.tau);
                let at = self.weights.len();
                self.weights.resize(at + n, 0.0);
                lanes::exp_neg(&self.tau, &mut self.weights[at..]);
                lanes::scale(&mut self.weights[at..], ds as f32);
            }
        }
        if meets_ground {
            along.to(span.end_m, &mut self.columns);
        } else {
            along.to_space(&mut self.columns);
        }
        columns.optical_depth(&self.columns, &mut self.tau);
        lanes::exp_neg(&self.tau, &mut self.through);
    }

    /// Distances at which the ray crosses the levels, in order, from start to end.
    #[inline(always)]
    fn find_cuts(&mut self, levels: &Levels, ray: &Ray, span: Span) {
        let geometry = RayGeometry::new(ray);
        let tangent = geometry.tangent_m();
        let impact = ray.impact_parameter_squared();
        let (start, end) = (span.start_m, span.end_m);
        let cuts = &mut self.cuts;
        cuts.clear();
        cuts.push(start);
        let mut push = |s: f64| {
            if s > start + 1e-3 && s < end - 1e-3 {
                cuts.push(s);
            }
        };
        let crossing = |r: f64| {
            let below = r * r - impact;
            (below > 0.0).then(|| below.sqrt())
        };
        if tangent > start {
            for &r in levels.radius_m.iter().rev() {
                if let Some(d) = crossing(r) {
                    push(tangent - d);
                }
            }
            push(tangent);
        }
        if tangent < end {
            for &r in &levels.radius_m {
                if let Some(d) = crossing(r) {
                    if tangent + d > tangent.max(start) {
                        push(tangent + d);
                    }
                }
            }
        }
        cuts.push(end);
    }
}
