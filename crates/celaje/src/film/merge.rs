//! Films of the same picture by independent paths: put together, and judged by their noise.

use super::Film;
use crate::error::{Error, Result};

/// How two independent estimates of a pixel become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weights {
    /// By the paths behind each.
    Samples,
    /// Half and half, whatever is behind them.
    Equal,
}

impl Weights {
    /// Shares of two estimates; none if nothing is behind either.
    fn shares(self, samples: [u32; 2]) -> Option<[f64; 2]> {
        match samples {
            [0, 0] => None,
            [_, 0] => Some([1.0, 0.0]),
            [0, _] => Some([0.0, 1.0]),
            [a, b] => {
                let a = match self {
                    Self::Samples => f64::from(a) / (f64::from(a) + f64::from(b)),
                    Self::Equal => 0.5,
                };
                Some([a, 1.0 - a])
            }
        }
    }
}

impl Film {
    /// Means and variances, one pair for each quantity of the film.
    pub(crate) fn planes(&self) -> Vec<[&[f32]; 2]> {
        let mut planes = vec![[&self.radiance[..], &self.variance[..]]];
        let others = self.polarisation.iter().flat_map(|p| p.planes());
        planes.extend(others.map(|plane| [&plane.mean[..], &plane.variance[..]]));
        planes
    }

    /// As [`Film::planes`], to be filled.
    pub(crate) fn planes_mut(&mut self) -> Vec<[&mut [f32]; 2]> {
        let mut planes = vec![[&mut self.radiance[..], &mut self.variance[..]]];
        let others = self.polarisation.iter_mut();
        let others = others.flat_map(|p| p.planes_mut());
        planes.extend(others.map(|plane| [&mut plane.mean[..], &mut plane.variance[..]]));
        planes
    }

    /// A black film of the same quantities and wavelengths in another size.
    pub(crate) fn black_like(&self, width: usize, height: usize) -> Result<Self> {
        match self.polarisation {
            None => Self::new(width, height, &self.wavelength_nm),
            Some(_) => Self::new_polarised(width, height, &self.wavelength_nm),
        }
    }

    /// Puts pixels of another film in the place of one's own; `pairs` are (own, other) pixels.
    pub(crate) fn set_pixels(&mut self, other: &Self, pairs: impl Iterator<Item = (usize, usize)>) {
        let w = self.wavelength_nm.len();
        for (to, from) in pairs {
            self.samples[to] = other.samples[from];
            let own = self.planes_mut().into_iter().flatten();
            for (own, theirs) in own.zip(other.planes().into_iter().flatten()) {
                own[to * w..(to + 1) * w].copy_from_slice(&theirs[from * w..(from + 1) * w]);
            }
        }
    }

    /// Puts independent estimates of pixels together with one's own; `pairs` are (own, other) pixels.
    ///
    /// With shares `a` and `1 − a`, the mean is `a m₁ + (1 − a) m₂` and its variance `a² v₁ + (1 − a)² v₂`.
    pub(crate) fn add_pixels(
        &mut self,
        other: &Self,
        pairs: impl Iterator<Item = (usize, usize)>,
        weights: Weights,
    ) {
        let w = self.wavelength_nm.len();
        for (to, from) in pairs {
            let Some([a, b]) = weights.shares([self.samples[to], other.samples[from]]) else {
                continue;
            };
            self.samples[to] = self.samples[to].saturating_add(other.samples[from]);
            for (own, theirs) in self.planes_mut().into_iter().zip(other.planes()) {
                let [mean, variance] = own.map(|plane| &mut plane[to * w..(to + 1) * w]);
                let [their_mean, their_variance] = theirs.map(|p| &p[from * w..(from + 1) * w]);
                for (m, &n) in mean.iter_mut().zip(their_mean) {
                    *m = (a * f64::from(*m) + b * f64::from(n)) as f32;
                }
                for (v, &u) in variance.iter_mut().zip(their_variance) {
                    *v = (a * a * f64::from(*v) + b * b * f64::from(u)) as f32;
                }
            }
        }
    }

    /// Puts a film of the same picture, rendered with another seed, together with this one.
    ///
    /// Each pixel's means are weighted by the paths behind them, and their variances by the squares of those weights. Whoever
    /// calls this answers for the films' independence: two of the same seed repeat each other's noise.
    ///
    /// # Errors
    /// [`Error::Invalid`] for films of another size or other wavelengths, or without noise.
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        let mismatch = |what: &str, a: String, b: String| {
            Err(Error::invalid(
                format!("films of different {what} cannot be merged: {a} and {b}"),
                "merge films that differ in their seeds only",
            ))
        };
        if (self.width, self.height) != (other.width, other.height) {
            let size = |film: &Self| format!("{}x{}", film.width, film.height);
            return mismatch("sizes", size(self), size(other));
        }
        if self.wavelength_nm != other.wavelength_nm {
            let range = |film: &Self| match film.wavelength_nm[..] {
                [] => "none".to_owned(),
                [first, .., last] => {
                    let count = film.wavelength_nm.len();
                    format!("{count} from {first} to {last} nm")
                }
                [only] => format!("{only} nm"),
            };
            return mismatch("wavelengths", range(self), range(other));
        }
        if self.planes().len() != other.planes().len() {
            let what = |film: &Self| {
                if film.planes().len() > 1 {
                    "with"
                } else {
                    "without"
                }
            };
            return mismatch("polarisation", what(self).into(), what(other).into());
        }
        if [&*self, other].iter().any(|film| !film.has_noise()) {
            return Err(Error::invalid(
                "a film without noise gains nothing from being merged",
                "merge films rendered by path, tracker or classic",
            ));
        }
        let pixels = self.samples.len();
        self.add_pixels(other, (0..pixels).map(|p| (p, p)), Weights::Samples);
        Ok(())
    }

    /// Whether any value has a variance.
    pub fn has_noise(&self) -> bool {
        self.variance.iter().any(|&v| v != 0.0)
    }

    /// Pixels on the edge of the blocks by which noise is judged: 8, or 1 in a single row, which is a list of directions.
    pub fn block_edge(height: usize) -> usize {
        if height == 1 {
            1
        } else {
            8
        }
    }

    /// The pixels of all blocks of [`Film::block_edge`], block by block; those at the right and lower edge may be smaller.
    pub fn blocks(width: usize, height: usize) -> Vec<Vec<usize>> {
        let edge = Self::block_edge(height);
        let mut blocks = Vec::new();
        for top in (0..height).step_by(edge) {
            for left in (0..width).step_by(edge) {
                let rows = top..(top + edge).min(height);
                let row = |r| (left..(left + edge).min(width)).map(move |c| r * width + c);
                blocks.push(rows.flat_map(row).collect());
            }
        }
        blocks
    }

    /// Relative noise \[1\] of some pixels: at each wavelength the root mean square of their standard errors over their mean
    /// radiance, and of those ratios the largest. `None` if the pixels see nothing, or nothing but black.
    pub fn noise_of(&self, pixels: &[usize]) -> Option<f64> {
        let w = self.wavelength_nm.len();
        let mut sums = vec![[0.0; 2]; w];
        for &pixel in pixels.iter().filter(|&&p| self.is_lit(p)) {
            let row = pixel * w..(pixel + 1) * w;
            let values = self.radiance[row.clone()].iter().zip(&self.variance[row]);
            for (sum, (&l, &v)) in sums.iter_mut().zip(values) {
                sum[0] += f64::from(l);
                sum[1] += f64::from(v);
            }
        }
        let lit = pixels.iter().filter(|&&p| self.is_lit(p)).count() as f64;
        let noises = sums.iter().filter(|[l, _]| *l > 0.0);
        noises
            .map(|[l, v]| (v * lit).sqrt() / l)
            .fold(None, |largest, n| {
                Some(largest.map_or(n, |l: f64| l.max(n)))
            })
    }

    /// Relative noise \[1\] of the whole film: the largest over its blocks (see [`Film::blocks`] and [`Film::noise_of`]). In a
    /// list of directions that is the largest relative standard error over directions and wavelengths.
    ///
    /// `None` where nothing tells it: in the dark, or with fewer than two paths per pixel.
    pub fn noise(&self) -> Option<f64> {
        if self.samples.iter().all(|&n| n < 2) {
            return None;
        }
        let blocks = Self::blocks(self.width, self.height);
        blocks
            .iter()
            .filter_map(|block| self.noise_of(block))
            .reduce(f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(radiance: [f32; 4], variance: [f32; 4], samples: [u32; 2]) -> Film {
        let mut film = Film::new(2, 1, &[500.0, 600.0]).unwrap();
        film.radiance = radiance.to_vec();
        film.variance = variance.to_vec();
        film.samples = samples.to_vec();
        film
    }

    /// Q, U and V go the way of the radiance, with its weights.
    #[test]
    fn polarisation_is_merged_too() {
        let mut a = Film::new_polarised(1, 1, &[500.0]).unwrap();
        a.samples[0] = 1;
        a.variance[0] = 1.0;
        let mut b = a.clone();
        b.samples[0] = 3;
        for (k, plane) in b
            .polarisation
            .iter_mut()
            .flat_map(|p| p.planes_mut())
            .enumerate()
        {
            plane.mean[0] = -4.0 * k as f32;
            plane.variance[0] = 16.0;
        }
        assert!(a.clone().merge(&film([1.0; 4], [1.0; 4], [1; 2])).is_err());
        a.merge(&b).unwrap();
        let merged = a.polarisation.unwrap();
        let values = merged
            .planes()
            .map(|plane| (plane.mean[0], plane.variance[0]));
        assert_eq!(values, [(0.0, 9.0), (-3.0, 9.0), (-6.0, 9.0)]);
    }

    /// Of a film with three times the paths, the weights are 1/4 and 3/4; where one film saw nothing, the other counts.
    #[test]
    fn merging_weighs_by_paths() {
        let mut a = film([1.0, 2.0, 5.0, 5.0], [0.16, 0.32, 1.0, 1.0], [10, 0]);
        let b = film([5.0, 2.0, 3.0, 4.0], [0.48, 0.16, 2.0, 3.0], [30, 7]);
        a.merge(&b).unwrap();
        assert_eq!(a.radiance, [4.0, 2.0, 3.0, 4.0]);
        let expected = [
            0.16 / 16.0 + 0.48 * 9.0 / 16.0,
            0.32 / 16.0 + 0.09,
            2.0,
            3.0,
        ];
        for (v, e) in a.variance.iter().zip(expected) {
            assert!((v - e).abs() < 1e-6, "{v} {e}");
        }
        assert_eq!(a.samples, [40, 7]);
    }

    #[test]
    fn films_of_different_pictures_are_refused() {
        let a = film([1.0; 4], [1.0; 4], [2; 2]);
        let mut size = Film::new(1, 2, &[500.0, 600.0]).unwrap();
        size.variance.fill(1.0);
        let mut wavelength = Film::new(2, 1, &[500.0, 601.0]).unwrap();
        wavelength.variance.fill(1.0);
        let exact = film([1.0; 4], [0.0; 4], [2; 2]);
        for (other, word) in [
            (size, "sizes"),
            (wavelength, "wavelengths"),
            (exact, "noise"),
        ] {
            let e = a.clone().merge(&other).unwrap_err().to_string();
            assert!(e.contains(word), "{e}");
        }
    }

    #[test]
    fn noise_is_the_largest_of_all_directions_and_wavelengths() {
        let f = film([1.0, 2.0, 0.0, 4.0], [0.01, 0.16, 0.0, 0.36], [4; 2]);
        assert!((f.noise().unwrap() - 0.2).abs() < 1e-6);
        assert_eq!(film([0.0; 4], [0.0; 4], [4; 2]).noise(), None);
        assert_eq!(film([1.0; 4], [0.0; 4], [1; 2]).noise(), None);
    }

    /// In a picture, pixels of one block are judged together.
    #[test]
    fn noise_of_a_picture_is_that_of_its_worst_block() {
        let mut f = Film::new(9, 8, &[500.0]).unwrap();
        f.samples.fill(4);
        f.radiance.fill(2.0);
        f.variance.fill(0.04);
        // One pixel of 64 with a hundred times the variance; a block of 8 with four times.
        f.variance[9] = 4.0;
        assert!((f.noise().unwrap() - (0.04f64 * 163.0 / 64.0).sqrt() / 2.0).abs() < 1e-6);
        (0..8).for_each(|row| f.variance[row * 9 + 8] = 0.16);
        assert!((f.noise().unwrap() - 0.2).abs() < 1e-6);
        let blocks = Film::blocks(9, 8);
        assert_eq!(blocks.len(), 2);
        assert_eq!(blocks[1], (0..8).map(|r| r * 9 + 8).collect::<Vec<_>>());
    }
}
