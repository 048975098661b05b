//! What one kind of particle is: how large and of which matter.

use crate::error::{check_range, Error, Result};
use crate::math::interp;

/// One log-normal mode of a number distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LognormalMode {
    /// Number of particles in the mode over that of the whole distribution, before it is cut at its bounds \[1\].
    pub number_fraction: f64,
    /// Mode (median) radius \[µm\].
    pub r_mode_um: f64,
    /// Geometric standard deviation \[1\], above 1.
    pub sigma: f64,
}

/// A sum of log-normal modes, cut at two radii.
///
/// `dN/dln r = Σ f_i / (√(2π) ln σ_i) exp(−½ [ln(r/r_i) / ln σ_i]²)` between `r_min` and `r_max`, zero outside. It is *not*
/// renormalised after the cut: doing so would add 4–12 % to the published types.
#[derive(Debug, Clone, PartialEq)]
pub struct SizeDistribution {
    modes: Vec<LognormalMode>,
    r_min_um: f64,
    r_max_um: f64,
}

impl SizeDistribution {
    /// From its modes, whose number fractions are normalised to add up to 1, and its bounds \[µm\].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a negative fraction, `sigma` outside (1, 20], radii outside \[1e-5, 1e3\] µm;
    /// [`Error::Invalid`] for no mode, fractions that are all zero, or `r_min ≥ r_max`.
    pub fn new(mut modes: Vec<LognormalMode>, r_min_um: f64, r_max_um: f64) -> Result<Self> {
        for mode in &modes {
            check_range("number fraction", mode.number_fraction, "", 0.0..=1e300)?;
            check_range("mode radius", mode.r_mode_um, "µm", 1e-5..=1e3)?;
            check_range(
                "geometric standard deviation",
                mode.sigma,
                "",
                1.0 + 1e-6..=20.0,
            )?;
        }
        check_range("r_min", r_min_um, "µm", 1e-5..=1e3)?;
        check_range("r_max", r_max_um, "µm", 1e-5..=1e3)?;
        if r_min_um >= r_max_um {
            return Err(Error::invalid(
                format!("r_min = {r_min_um} µm is not below r_max = {r_max_um} µm"),
                "give the lower bound first",
            ));
        }
        let total: f64 = modes.iter().map(|m| m.number_fraction).sum();
        if total <= 0.0 {
            return Err(Error::invalid(
                "a size distribution without particles",
                "give at least one mode with a positive number fraction",
            ));
        }
        for mode in &mut modes {
            mode.number_fraction /= total;
        }
        Ok(Self {
            modes,
            r_min_um,
            r_max_um,
        })
    }

    /// A single mode of median radius \[µm\] and geometric standard deviation, from a thousandth to a thousand times the
    /// radius (within 1e-5 to 100 µm): wide enough to hold all of it that light can see.
    ///
    /// # Errors
    /// As [`SizeDistribution::new`].
    pub fn lognormal(r_mode_um: f64, sigma: f64) -> Result<Self> {
        check_range("mode radius", r_mode_um, "µm", 1e-4..=50.0)?;
        let mode = LognormalMode {
            number_fraction: 1.0,
            r_mode_um,
            sigma,
        };
        let bounds_um = [(1e-3 * r_mode_um).max(1e-5), (1e3 * r_mode_um).min(100.0)];
        Self::new(vec![mode], bounds_um[0], bounds_um[1])
    }

    /// The distribution of the modes that are not narrower than a `ln σ`, if there are any, and the narrower modes; all with
    /// their shares of the whole.
    pub(crate) fn split(&self, ln_sigma: f64) -> (Option<Self>, Vec<LognormalMode>) {
        let (narrow, modes): (Vec<LognormalMode>, Vec<LognormalMode>) =
            self.modes.iter().partition(|m| m.sigma.ln() < ln_sigma);
        let broad = (!modes.is_empty()).then_some(Self { modes, ..*self });
        (broad, narrow)
    }

    /// Smallest radius \[µm\].
    pub fn r_min_um(&self) -> f64 {
        self.r_min_um
    }

    /// Largest radius \[µm\].
    pub fn r_max_um(&self) -> f64 {
        self.r_max_um
    }

    /// Mean of `r²` \[µm²\], without regard to the bounds.
    pub fn mean_square_radius_um2(&self) -> f64 {
        let moment = |m: &LognormalMode| {
            let width = m.sigma.ln();
            m.number_fraction * (m.r_mode_um * (width * width).exp()).powi(2)
        };
        self.modes.iter().map(moment).sum()
    }

    /// `dN/dln r` \[1\] at a radius within the bounds \[µm\]; the bounds themselves are the caller's business.
    pub fn per_ln_radius(&self, r_um: f64) -> f64 {
        let density = |m: &LognormalMode| {
            let width = m.sigma.ln();
            let t = (r_um / m.r_mode_um).ln() / width;
            m.number_fraction / ((2.0 * std::f64::consts::PI).sqrt() * width) * (-0.5 * t * t).exp()
        };
        self.modes.iter().map(density).sum()
    }
}

/// A complex refractive index `n + ik`, `k ≥ 0`, tabulated over wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct RefractiveIndex {
    wavelength_nm: Vec<f64>,
    n: Vec<f64>,
    k: Vec<f64>,
}

/// A refractive index at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndexAt {
    /// Real part.
    pub n: f64,
    /// Imaginary part, ≥ 0 for absorption.
    pub k: f64,
    /// Whether the wavelength lies below the table, so that the value is extrapolated.
    pub extrapolated: bool,
}

impl RefractiveIndex {
    /// From columns of equal length, vacuum wavelengths \[nm\] strictly increasing.
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`], [`Error::Invalid`] (empty or not increasing), [`Error::OutOfRange`] (`n` not positive,
    /// negative `k`: the other sign convention is refused, not conjugated).
    pub fn new(wavelength_nm: Vec<f64>, n: Vec<f64>, k: Vec<f64>) -> Result<Self> {
        for (name, column) in [("n", &n), ("k", &k)] {
            if column.len() != wavelength_nm.len() {
                return Err(Error::ShapeMismatch {
                    name: format!("refractive index {name}"),
                    got: format!("({},)", column.len()),
                    expected: format!("({},)", wavelength_nm.len()),
                });
            }
        }
        let increasing = wavelength_nm.windows(2).all(|w| w[0] < w[1]);
        if wavelength_nm.is_empty() || !increasing {
            return Err(Error::invalid(
                "the wavelengths of a refractive index must increase, and there must be some",
                "sort the table by wavelength",
            ));
        }
        for i in 0..n.len() {
            check_range("wavelength", wavelength_nm[i], "nm", 1.0..=1e6)?;
            check_range("refractive index n", n[i], "", 1e-3..=100.0)?;
            check_range("refractive index k", k[i], "", 0.0..=100.0)?;
        }
        Ok(Self {
            wavelength_nm,
            n,
            k,
        })
    }

    /// The same index at every wavelength.
    ///
    /// # Errors
    /// As [`RefractiveIndex::new`].
    pub fn constant(n: f64, k: f64) -> Result<Self> {
        Self::new(vec![1.0, 1e6], vec![n, n], vec![k, k])
    }

    /// `n` and `k` at a vacuum wavelength \[nm\], linear between the tabulated ones.
    ///
    /// Below the first one: the cubic through the first four, `k` clamped at 0 (with fewer than four, the first
    /// value), and marked as extrapolated.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] above the last wavelength.
    pub fn at(&self, wavelength_nm: f64) -> Result<IndexAt> {
        let w = &self.wavelength_nm;
        let last = w[w.len() - 1];
        check_range("wavelength", wavelength_nm, "nm", 1.0..=last)?;
        let extrapolated = wavelength_nm < w[0];
        let value = |column: &[f64]| {
            if extrapolated && w.len() >= 4 {
                lagrange(&w[..4], &column[..4], wavelength_nm)
            } else {
                interp::linear_clamped(w, column, wavelength_nm)
            }
        };
        Ok(IndexAt {
            n: value(&self.n).max(1e-3),
            k: value(&self.k).max(0.0),
            extrapolated,
        })
    }

    /// `self + weight (other − self)`, value by value; both must have the same wavelengths.
    pub(super) fn mixed_with(&self, other: &Self, weight: f64) -> Self {
        let mix = |a: &[f64], b: &[f64]| {
            let pairs = a.iter().zip(b);
            pairs.map(|(a, b)| a + weight * (b - a)).collect()
        };
        Self {
            wavelength_nm: self.wavelength_nm.clone(),
            n: mix(&self.n, &other.n),
            k: mix(&self.k, &other.k),
        }
    }
}

/// The polynomial through all points, at `at`.
fn lagrange(x: &[f64], y: &[f64], at: f64) -> f64 {
    let basis = |i: usize| -> f64 {
        let others = (0..x.len()).filter(|&j| j != i);
        others.map(|j| (at - x[j]) / (x[i] - x[j])).product()
    };
    (0..x.len()).map(|i| y[i] * basis(i)).sum()
}

/// One kind of homogeneous sphere: a name, a size distribution and a refractive index.
#[derive(Debug, Clone, PartialEq)]
pub struct Particle {
    /// Name of the component, such as `waso`.
    pub id: String,
    /// Number distribution over radius.
    pub size: SizeDistribution,
    /// Index of its matter.
    pub index: RefractiveIndex,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(number_fraction: f64, sigma: f64) -> LognormalMode {
        LognormalMode {
            number_fraction,
            r_mode_um: 0.1,
            sigma,
        }
    }

    #[test]
    fn nonsense_sizes_are_refused() {
        assert!(SizeDistribution::new(vec![mode(1.0, 1.0)], 0.01, 1.0).is_err());
        assert!(SizeDistribution::new(vec![mode(-1.0, 2.0)], 0.01, 1.0).is_err());
        assert!(SizeDistribution::new(vec![mode(0.0, 2.0)], 0.01, 1.0).is_err());
        assert!(SizeDistribution::new(vec![mode(1.0, 2.0)], 1.0, 1.0).is_err());
        assert!(SizeDistribution::new(vec![mode(1.0, f64::NAN)], 0.01, 1.0).is_err());
        assert!(SizeDistribution::new(vec![], 0.01, 1.0).is_err());
    }

    #[test]
    fn number_is_one_within_wide_bounds() {
        let size =
            SizeDistribution::new(vec![mode(3.0, 1.5), mode(1.0, 2.0)], 1e-4, 100.0).unwrap();
        let step = 0.01;
        let number: f64 = (-800..400)
            .map(|i| size.per_ln_radius((f64::from(i) * step).exp()) * step)
            .sum();
        assert!((number - 1.0).abs() < 1e-9, "{number}");
    }

    /// The extrapolation must return a cubic exactly, clamp k at zero and say that it extrapolated.
    #[test]
    fn below_the_table_a_cubic_is_continued_and_flagged() {
        let w = vec![300.0, 400.0, 500.0, 600.0, 700.0];
        let cubic = |x: f64| 1.5 + 1e-9 * (x - 450.0).powi(3);
        let n: Vec<f64> = w.iter().map(|&x| cubic(x)).collect();
        let k = w.iter().map(|&x| 1e-5 * (x - 300.0)).collect();
        let index = RefractiveIndex::new(w, n, k).unwrap();
        let at = index.at(280.0).unwrap();
        assert!((at.n - cubic(280.0)).abs() < 1e-12 && at.k == 0.0 && at.extrapolated);
        assert!(!index.at(300.0).unwrap().extrapolated);
        assert!(index.at(701.0).is_err());
    }

    #[test]
    fn negative_k_is_refused() {
        assert!(RefractiveIndex::constant(1.5, -0.01).is_err());
    }
}
