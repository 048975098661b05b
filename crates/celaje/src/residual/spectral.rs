//! Smooth modes in wavelength: the mean over the spectrum, its slope, its curvature.

/// Most modes.
pub const MODES: usize = 3;

/// Relative variance below which nothing is told apart: that of f32.
pub const LEAST_NOISE: f64 = 1e-14;

/// Polynomials of the wavelength that are orthonormal over the wavelengths compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Weights of the wavelengths in sums, adding up to 1; 0 where nothing can be compared. Shape (w,).
    weights: Vec<f64>,
    /// Values, shape (mode, w).
    values: Vec<Vec<f64>>,
}

impl Modes {
    /// * `wavelength_nm` — increasing, shape (w,)
    /// * `noise` — relative variance of the values there, shape (w,); not finite where nothing can be compared
    pub fn new(wavelength_nm: &[f64], noise: &[f64]) -> Self {
        let known: Vec<f64> = noise.iter().copied().filter(|v| v.is_finite()).collect();
        // As in directions: the quietest must not decide alone.
        let floor = median(&known).max(LEAST_NOISE);
        let mut weights: Vec<f64> = noise
            .iter()
            .map(|v| {
                if v.is_finite() {
                    1.0 / (v + floor)
                } else {
                    0.0
                }
            })
            .collect();
        let sum: f64 = weights.iter().sum();
        weights
            .iter_mut()
            .for_each(|g| *g /= sum.max(f64::MIN_POSITIVE));
        let (first, last) = (wavelength_nm[0], wavelength_nm[wavelength_nm.len() - 1]);
        let half = (0.5 * (last - first)).max(1.0);
        let mut modes = Self {
            weights,
            values: Vec::new(),
        };
        for degree in 0..MODES.min(known.len()) {
            let power = |nm: &f64| ((nm - 0.5 * (first + last)) / half).powi(degree as i32);
            let mut row: Vec<f64> = wavelength_nm.iter().map(power).collect();
            for (mode, along) in modes.values.iter().zip(modes.project(&row)) {
                row.iter_mut().zip(mode).for_each(|(r, m)| *r -= along * m);
            }
            let squares = row.iter().zip(&modes.weights).map(|(r, g)| g * r * r);
            let norm = squares.sum::<f64>().sqrt();
            if norm > 1e-6 {
                row.iter_mut().for_each(|r| *r /= norm);
                modes.values.push(row);
            }
        }
        modes
    }

    /// Number of modes.
    pub fn count(&self) -> usize {
        self.values.len()
    }

    /// Amplitudes of the modes in a spectrum; what cannot be compared does not matter.
    pub fn project(&self, spectrum: &[f64]) -> Vec<f64> {
        let amplitude = |mode: &Vec<f64>| {
            let sum = mode.iter().zip(spectrum).zip(&self.weights);
            sum.map(|((m, s), g)| if *g > 0.0 { g * m * s } else { 0.0 })
                .sum()
        };
        self.values.iter().map(amplitude).collect()
    }

    /// The noise of a spectrum's mean if its wavelengths err together, as those of one path do; of relative variances.
    pub fn noise(&self, variance: &[f64]) -> f64 {
        let all = variance.iter().zip(&self.weights);
        let used = all.filter(|(_, g)| **g > 0.0);
        used.map(|(v, g)| g * v.sqrt()).sum::<f64>().powi(2)
    }

    /// The spectrum of amplitudes, at one wavelength.
    pub fn at(&self, amplitudes: &[f64], wavelength: usize) -> f64 {
        let modes = self.values.iter().zip(amplitudes);
        modes.map(|(mode, a)| a * mode[wavelength]).sum()
    }
}

/// The median; 0 of nothing.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a parabola comes back at every wavelength, also where nothing was compared; one wavelength has one mode.
    #[test]
    fn a_parabola_comes_back() {
        let nm: Vec<f64> = (0..9).map(|i| 400.0 + 40.0 * f64::from(i)).collect();
        let mut noise = vec![1e-4; 9];
        noise[8] = f64::NAN;
        noise[2] = 0.5;
        let modes = Modes::new(&nm, &noise);
        assert_eq!(modes.count(), 3);
        let parabola = |nm: f64| 0.02 + 1e-4 * (nm - 500.0) - 3e-7 * (nm - 500.0).powi(2);
        let mut spectrum: Vec<f64> = nm.iter().map(|&nm| parabola(nm)).collect();
        spectrum[8] = f64::INFINITY;
        let amplitudes = modes.project(&spectrum);
        for (i, &nm) in nm.iter().enumerate() {
            assert!((modes.at(&amplitudes, i) - parabola(nm)).abs() < 1e-12);
        }
        assert_eq!(Modes::new(&[550.0], &[0.0]).count(), 1);
        assert_eq!(Modes::new(&[550.0], &[f64::NAN]).count(), 0);
        assert!((Modes::new(&[500.0, 600.0], &[0.1; 2]).noise(&[0.04, 0.04]) - 0.04).abs() < 1e-12);
    }
}
