//! Exposure and tone curves: from luminance in cd m⁻² to what a display shows.

use super::srgb::{desaturated_into_unit, srgb_encoded};
use crate::error::{check_range, Error, Result};

/// The luminance that a fixed exposure of 0 EV shows as white \[cd m⁻²\]: a bright clear sky near the horizon by day.
pub const REFERENCE_WHITE: f64 = 10_000.0;

/// Share of the pixels below the luminance that stands for the bright part of a picture.
const AUTO_SHARE: f64 = 0.98;
/// Pixels brighter than this many medians are light sources to automatic exposure, not sky.
const AUTO_SOURCE: f64 = 100.0;

/// How much of a change of the light, in logarithm, a film's exposure takes up: a million times less is shown as four times.
const ADAPTATION: f64 = 0.9;

/// Hable's white point, in units of his curve.
const FILMIC_WHITE: f64 = 11.2;
/// Stops above the exposure's white that the filmic curve still tells apart, as a factor.
const FILMIC_HEADROOM: f64 = 4.0;

/// How luminance above black becomes display value; hue and saturation follow by constant chromaticity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ToneCurve {
    /// `Y′ = (Y / Y_white)^(1/2.5)` at constant chromaticity, then linear sRGB *without* a display encoding: the curve
    /// is one. Shows the dark parts of a sky beside the bright ones.
    #[default]
    Gamma,
    /// Linear sRGB with the sRGB encoding: what a plain camera would show.
    Srgb,
    /// Hable's filmic curve on luminance at constant chromaticity, with the sRGB encoding; it keeps detail up to two
    /// stops above white.
    ///
    /// # Source
    /// J. Hable, *Uncharted 2: HDR Lighting*, Game Developers Conference 2010, with its printed parameters.
    Filmic,
    /// Linear sRGB, nothing encoded.
    None,
}

impl ToneCurve {
    /// Every curve.
    pub const ALL: [Self; 4] = [Self::Gamma, Self::Srgb, Self::Filmic, Self::None];

    /// By its name on the command line: `gamma`, `srgb`, `filmic`, `none`.
    ///
    /// # Errors
    /// [`Error::UnknownName`].
    pub fn by_name(name: &str) -> Result<Self> {
        let found = Self::ALL.into_iter().find(|t| t.name() == name);
        found.ok_or_else(|| Error::UnknownName {
            kind: "tone curve",
            name: name.to_owned(),
            known: Self::ALL.map(|t| t.name().to_owned()).to_vec(),
        })
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gamma => "gamma",
            Self::Srgb => "srgb",
            Self::Filmic => "filmic",
            Self::None => "none",
        }
    }

    /// Display values in [0, 1] of a colour.
    ///
    /// # Arguments
    /// * `rgb` — linear sRGB \[cd m⁻²\]
    /// * `luminance` — Y of its observer \[cd m⁻²\]
    /// * `white` — the luminance to show as white \[cd m⁻²\], positive
    ///
    /// Colours out of gamut are desaturated ([`desaturated_into_unit`]); anything that is not a number is black.
    pub fn display(self, rgb: [f64; 3], luminance: f64, white: f64) -> [f64; 3] {
        if luminance.is_nan() || luminance <= 0.0 {
            return [0.0; 3];
        }
        let relative = luminance / white;
        let toned = match self {
            Self::Gamma => relative.min(1.0).powf(1.0 / 2.5),
            Self::Filmic => filmic(relative),
            Self::Srgb | Self::None => relative,
        };
        let linear = desaturated_into_unit(rgb.map(|c| c * (toned / luminance)));
        match self {
            Self::Gamma | Self::None => linear,
            Self::Srgb | Self::Filmic => linear.map(srgb_encoded),
        }
    }
}

/// Hable's curve, 1 at [`FILMIC_HEADROOM`] times white.
fn filmic(relative: f64) -> f64 {
    let curve = |x: f64| {
        let (a, b, c, d, e, f) = (0.15, 0.50, 0.10, 0.20, 0.02, 0.30);
        (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f
    };
    let x = (relative / FILMIC_HEADROOM).min(1.0) * FILMIC_WHITE;
    curve(x) / curve(FILMIC_WHITE)
}

/// Which luminance is shown as white.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Exposure {
    /// Chosen from the picture by [`auto_white`].
    #[default]
    Auto,
    /// Stops relative to [`REFERENCE_WHITE`]: white is `10 000 cd m⁻² · 2^(−EV)`, so a larger value is a brighter picture.
    /// In [−40, 40].
    Ev(f64),
}

impl Exposure {
    /// The exposure that shows a luminance as white \[cd m⁻²\], positive.
    pub fn of_white(white: f64) -> Self {
        Self::Ev((REFERENCE_WHITE / white).log2().clamp(-40.0, 40.0))
    }

    /// White \[cd m⁻²\] for the luminances of a picture's pixels.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for the stops.
    pub fn white(self, luminance: &[f32]) -> Result<f64> {
        match self {
            Self::Auto => Ok(auto_white(luminance)),
            Self::Ev(stops) => {
                check_range("exposure", stops, "EV", -40.0..=40.0)?;
                Ok(REFERENCE_WHITE * (-stops).exp2())
            }
        }
    }
}

/// White of an automatic exposure \[cd m⁻²\]: twice the geometric mean of the median and the 98th percentile of the
/// luminances, and at least that percentile.
///
/// So an even sky is shown at half of white, and the glow of a low sun burns out in 2 % of the picture at most, while the
/// display's curve keeps the rest from sinking into the dark. Black pixels
/// and those that are not numbers do not count, nor do light sources: the sun's disc is brighter than 100 medians
/// (10⁴ at least by day, while the aureole and the glow of twilight stay below 100). So noon and deep twilight both
/// fill the range of the display, and a disc in the picture, large or small, changes nothing to speak of.
/// [`REFERENCE_WHITE`] if every pixel is black.
pub fn auto_white(luminance: &[f32]) -> f64 {
    let mut y: Vec<f32> = luminance
        .iter()
        .copied()
        .filter(|v| v.is_finite() && *v > 0.0)
        .collect();
    if y.is_empty() {
        return REFERENCE_WHITE;
    }
    let limit = AUTO_SOURCE * f64::from(quantile(&mut y, 0.5));
    y.retain(|&v| f64::from(v) <= limit);
    let median = f64::from(quantile(&mut y, 0.5));
    let bright = f64::from(quantile(&mut y, AUTO_SHARE));
    (2.0 * (median * bright).sqrt()).max(bright)
}

/// The whites of a film's frames \[cd m⁻²\]: they follow the light smoothly, and not wholly.
///
/// An eye at dusk adapts, but knows that it is dark: the whites move by [`ADAPTATION`] of the way in logarithm, about the
/// brightest of them. They are smoothed by a Gaussian, beyond the ends of which the trend goes on.
///
/// # Arguments
/// * `automatic` — whites of some frames by [`auto_white`], evenly spread from the first to the last; positive
/// * `frames` — number of frames
/// * `width` — standard deviation of the Gaussian, in frames
///
/// Returns one white per frame; none if `automatic` is empty.
pub fn adapted_whites(automatic: &[f64], frames: usize, width: f64) -> Vec<f64> {
    let Some(brightest) = automatic.iter().copied().reduce(f64::max) else {
        return Vec::new();
    };
    let logs: Vec<f64> = automatic.iter().map(|w| (w / brightest).ln()).collect();
    let last = logs.len() - 1;
    let at = |frame: f64| {
        let x = frame * last as f64 / (frames.max(2) - 1) as f64;
        let i = (x as usize).min(last.saturating_sub(1));
        let next = logs[(i + 1).min(last)];
        logs[i] + (x - i as f64) * (next - logs[i])
    };
    let end = (frames.max(1) - 1) as f64;
    // Beyond an end, what lies before it is turned about that end.
    let extended = |frame: f64| {
        if frame < 0.0 {
            2.0 * at(0.0) - at((-frame).min(end))
        } else if frame > end {
            2.0 * at(end) - at((2.0 * end - frame).max(0.0))
        } else {
            at(frame)
        }
    };
    let reach = (3.0 * width).ceil() as i64;
    (0..frames)
        .map(|frame| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in -reach..=reach {
                let weight = (-0.5 * (k as f64 / width.max(1e-9)).powi(2)).exp();
                sum += weight * extended(frame as f64 + k as f64);
                weights += weight;
            }
            brightest * (ADAPTATION * sum / weights).exp()
        })
        .collect()
}

/// The value below which a share of the values lies; `values` not empty and free of NaN.
fn quantile(values: &mut [f32], share: f64) -> f32 {
    let index = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(index, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::super::srgb::luminance;
    use super::*;

    #[test]
    fn gamma_is_the_stated_power_and_nothing_more() {
        for (y, expected) in [
            (100.0, 1.0),
            (10.0, 0.1f64.powf(0.4)),
            (0.1, 0.001f64.powf(0.4)),
        ] {
            let shown = ToneCurve::Gamma.display([y; 3], y, 100.0);
            for c in shown {
                assert!((c - expected).abs() < 1e-12, "{c} {expected}");
            }
        }
    }

    #[test]
    fn srgb_of_middle_grey_is_the_standard_one() {
        // 0.18 → 0.4613561 (IEC 61966-2-1).
        let shown = ToneCurve::Srgb.display([18.0; 3], 18.0, 100.0);
        assert!((shown[0] - 0.461_356_1).abs() < 1e-6);
        assert_eq!(
            ToneCurve::None.display([25.0; 3], 25.0, 100.0),
            [0.25, 0.25, 0.25]
        );
    }

    #[test]
    fn curves_rise_from_black_to_white() {
        for tone in ToneCurve::ALL {
            let mut last = -1.0;
            for i in 0..=400 {
                let y = f64::from(i);
                let shown = tone.display([y; 3], y, 100.0)[1];
                // Up to rounding: at white, grey is 1 − 2⁻⁵³ or 1.
                assert!(shown >= last - 1e-12, "{tone:?} {y}");
                assert!((0.0..=1.0).contains(&shown));
                last = shown;
            }
            assert!((last - 1.0).abs() < 1e-12);
            assert_eq!(tone.display([0.0; 3], 0.0, 100.0), [0.0; 3]);
            assert_eq!(tone.display([f64::NAN; 3], 1.0, 100.0), [0.0; 3]);
            assert_eq!(tone.display([1.0; 3], f64::NAN, 100.0), [0.0; 3]);
            assert_eq!(ToneCurve::by_name(tone.name()).unwrap(), tone);
        }
        // Filmic still tells 1 from 3 times white.
        let shown = |y| ToneCurve::Filmic.display([y; 3], y, 1.0)[0];
        assert!(shown(3.0) - shown(1.0) > 0.1);
    }

    #[test]
    fn chromaticity_stays_where_the_gamut_allows() {
        let rgb = [30.0, 40.0, 50.0];
        let y = luminance(rgb);
        let shown = ToneCurve::Gamma.display(rgb, y, 400.0);
        assert!((shown[0] / shown[1] - 0.75).abs() < 1e-12);
        assert!((shown[2] / shown[1] - 1.25).abs() < 1e-12);
    }

    #[test]
    fn automatic_exposure_ignores_the_disc() {
        let mut sky: Vec<f32> = (0..1000).map(|i| 1000.0 + i as f32).collect();
        let without = auto_white(&sky);
        let expected = 2.0 * (1499.5f64 * 1979.0).sqrt();
        assert!((without / expected - 1.0).abs() < 1e-3);
        // An even sky is half of white.
        assert_eq!(auto_white(&[300.0; 9]), 600.0);
        // A disc that fills a tenth of a telephoto picture.
        sky.extend([1.5e9; 100]);
        assert_eq!(auto_white(&sky), without);
        sky.extend([f32::NAN, f32::INFINITY, 0.0, -3.0]);
        assert_eq!(auto_white(&sky), without);
        // The scale of the light does not matter.
        let dusk: Vec<f32> = sky.iter().map(|y| y * 1e-8).collect();
        assert!((auto_white(&dusk) / without * 1e8 - 1.0).abs() < 1e-6);
        assert_eq!(auto_white(&[0.0, f32::NAN]), REFERENCE_WHITE);
    }

    /// A steady light keeps its white; a fall by 10⁶ leaves a tenth of its logarithm; noise of the pilots is smoothed.
    #[test]
    fn a_film_adapts_smoothly() {
        let steady = adapted_whites(&[300.0; 5], 50, 4.0);
        assert!(steady.len() == 50 && steady.iter().all(|w| (w / 300.0 - 1.0).abs() < 1e-12));
        let falling: Vec<f64> = (0..40)
            .map(|k| 1e4 * 10f64.powf(-6.0 * f64::from(k) / 39.0))
            .collect();
        let whites = adapted_whites(&falling, 400, 16.0);
        assert!((whites[0] / 1e4 - 1.0).abs() < 1e-9);
        assert!((whites[399] / (1e4 * 10f64.powf(-5.4)) - 1.0).abs() < 1e-9);
        let step = |w: &[f64]| (w[1] / w[0]).ln();
        let steps: Vec<f64> = whites.windows(2).map(step).collect();
        let bend = |s: &[f64]| {
            s.windows(2)
                .map(|s| (s[1] - s[0]).abs())
                .fold(0.0, f64::max)
        };
        assert!(bend(&steps) < 1e-9);
        let nervous: Vec<f64> = falling
            .iter()
            .enumerate()
            .map(|(k, w)| w * if k % 2 == 0 { 1.2 } else { 1.0 / 1.2 })
            .collect();
        let smoothed: Vec<f64> = adapted_whites(&nervous, 400, 16.0)
            .windows(2)
            .map(step)
            .collect();
        // Unsmoothed, each pilot would bend the curve by 0.07.
        assert!(bend(&smoothed[40..360]) < 2e-3, "{}", bend(&smoothed));
        assert!(adapted_whites(&[], 3, 1.0).is_empty());
        assert_eq!(adapted_whites(&[7.0], 3, 0.0), [7.0; 3]);
        let exposure = Exposure::of_white(1250.0);
        assert_eq!(exposure, Exposure::Ev(3.0));
    }

    #[test]
    fn stops_are_powers_of_two() {
        assert_eq!(Exposure::Ev(0.0).white(&[]).unwrap(), 10_000.0);
        assert_eq!(Exposure::Ev(3.0).white(&[]).unwrap(), 1250.0);
        assert!(Exposure::Ev(f64::NAN).white(&[]).is_err());
        assert!(ToneCurve::by_name("gama").is_err());
    }
}
