//! Interpolation in sorted tables.

/// Index `i` of the interval `[x[i], x[i+1]]` that holds `at`, clamped to the first and last interval.
///
/// `x` strictly increasing, at least two values.
#[inline(always)]
pub fn interval(x: &[f64], at: f64) -> usize {
    x.partition_point(|&v| v <= at).clamp(1, x.len() - 1) - 1
}

/// Finds intervals of a fixed table in constant time: a guide of equal cells says where to begin (Chen & Asau 1974).
#[derive(Debug, Clone)]
pub struct Guide {
    x: Vec<f64>,
    /// Where each interval ends; the last one has no end.
    ends: Vec<f64>,
    cells_per_unit: f64,
    first: Vec<u32>,
}

impl Guide {
    /// Cells per node of the table; more make the walk after the first guess shorter.
    const CELLS_PER_NODE: usize = 16;

    /// A guide to `x`, strictly increasing, at least two values.
    pub fn new(x: &[f64]) -> Self {
        let cells = x.len() * Self::CELLS_PER_NODE;
        let range = x[x.len() - 1] - x[0];
        let first = (0..cells)
            .map(|c| interval(x, x[0] + range * c as f64 / cells as f64) as u32)
            .collect();
        let inner = x[1..x.len() - 1].iter().copied();
        Self {
            x: x.to_vec(),
            ends: inner.chain([f64::INFINITY]).collect(),
            cells_per_unit: cells as f64 / range,
            first,
        }
    }

    /// The same as [`interval`].
    #[inline(always)]
    pub fn interval(&self, at: f64) -> usize {
        let cell = ((at - self.x[0]) * self.cells_per_unit) as usize;
        let mut i = self.first[cell.min(self.first.len() - 1)] as usize;
        // Rounding may put the guess one too far.
        if i > 0 && at < self.x[i] {
            i -= 1;
        }
        // A cell seldom holds more than one node: the first step is counted, not decided, for a processor cannot foresee it.
        i += usize::from(self.ends[i] <= at);
        while self.ends[i] <= at {
            i += 1;
        }
        i
    }
}

/// Cubic interpolation through the four nodes about a value; through fewer where a table has fewer.
#[derive(Debug, Clone)]
pub struct Cubic {
    x: Vec<f64>,
    guide: Option<Guide>,
    points: usize,
    /// Lagrange's constant factors `1/Π (x_i − x_j)` for every first node.
    factors: Vec<[f64; 4]>,
}

impl Cubic {
    /// Interpolation on `x`, strictly increasing, at least one value.
    pub fn new(x: &[f64]) -> Self {
        let points = x.len().min(4);
        let factors = (0..=x.len() - points)
            .map(|first| {
                let mut factor = [0.0; 4];
                for (i, f) in factor.iter_mut().enumerate().take(points) {
                    let others = (0..points).filter(|&j| j != i);
                    let product: f64 = others.map(|j| x[first + i] - x[first + j]).product();
                    *f = 1.0 / product;
                }
                factor
            })
            .collect();
        Self {
            guide: (x.len() > 1).then(|| Guide::new(x)),
            x: x.to_vec(),
            points,
            factors,
        }
    }

    /// First of four nodes and their weights, which add up to 1; values beyond the ends are held there. Weights of nodes
    /// that do not exist are 0.
    #[inline(always)]
    pub fn at(&self, at: f64) -> (usize, [f32; 4]) {
        let Some(guide) = &self.guide else {
            return (0, [1.0, 0.0, 0.0, 0.0]);
        };
        let at = at.clamp(self.x[0], self.x[self.x.len() - 1]);
        // As many nodes on either side, as far as there are any.
        let below = self.points / 2 - 1;
        let first = guide
            .interval(at)
            .saturating_sub(below)
            .min(self.x.len() - self.points);
        let factor = &self.factors[first];
        let mut away = [1.0; 4];
        for (d, &x) in away.iter_mut().zip(&self.x[first..first + self.points]) {
            *d = at - x;
        }
        let [a, b, c, d] = away;
        let weights = match self.points {
            4 => [b * c * d, a * c * d, a * b * d, a * b * c],
            3 => [b * c, a * c, a * b, 0.0],
            _ => [b, a, 0.0, 0.0],
        };
        let mut out = [0.0; 4];
        for i in 0..4 {
            out[i] = (weights[i] * factor[i]) as f32;
        }
        (first, out)
    }
}

/// Linear interpolation of `y(x)`; constant beyond both ends.
///
/// `x` strictly increasing, same length as `y`, at least one value.
pub fn linear_clamped(x: &[f64], y: &[f64], at: f64) -> f64 {
    if x.len() == 1 || at <= x[0] {
        return y[0];
    }
    if at >= x[x.len() - 1] {
        return y[y.len() - 1];
    }
    let i = interval(x, at);
    let t = (at - x[i]) / (x[i + 1] - x[i]);
    y[i] + t * (y[i + 1] - y[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guide_agrees_with_bisection() {
        let x: Vec<f64> = (0..90)
            .map(|i| f64::from(i).powf(1.7) + 0.01 * f64::from(i % 7))
            .collect();
        let guide = Guide::new(&x);
        let last = x[x.len() - 1];
        for k in -10..3010 {
            let at = last * f64::from(k) / 3000.0;
            assert_eq!(guide.interval(at), interval(&x, at), "{at}");
        }
        for &at in &x {
            assert_eq!(guide.interval(at), interval(&x, at), "{at}");
        }
    }

    /// Cubics come back exactly from uneven nodes, to the ends; fewer nodes give a parabola, a line, a constant.
    #[test]
    fn cubics_are_exact_for_cubics() {
        let nodes = [-1.0, 0.0, 0.5, 2.0, 3.5, 4.0];
        let value =
            |x: f64, degree: usize| (0..=degree).map(|k| (x - 0.7).powi(k as i32)).sum::<f64>();
        for points in 1..=nodes.len() {
            let x = &nodes[..points];
            let degree = points.min(4) - 1;
            let cubic = Cubic::new(x);
            for k in 0..=100 {
                let at = x[0] + (x[points - 1] - x[0]) * f64::from(k) / 100.0;
                let (first, weights) = cubic.at(at);
                let got: f64 = (0..points.min(4))
                    .map(|i| f64::from(weights[i]) * value(x[first + i], degree))
                    .sum();
                assert!(
                    (got - value(at, degree)).abs() < 1e-4,
                    "{points} nodes at {at}: {got}"
                );
            }
            assert_eq!(cubic.at(99.0).1, cubic.at(x[points - 1]).1);
        }
    }

    #[test]
    fn linear_meets_nodes_and_clamps() {
        let (x, y) = ([0.0, 1.0, 3.0], [1.0, 2.0, 6.0]);
        assert_eq!(linear_clamped(&x, &y, -1.0), 1.0);
        assert_eq!(linear_clamped(&x, &y, 1.0), 2.0);
        assert_eq!(linear_clamped(&x, &y, 2.0), 4.0);
        assert_eq!(linear_clamped(&x, &y, 9.0), 6.0);
    }
}
