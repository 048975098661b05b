//! The part of the sun's disc that a pixel shows.
//!
//! A pixel may be thirty times as wide as the disc, or a small part of it. Points spread over the pixel meet a small disc by
//! luck only; so the part of the pixel that the disc may fill is found first, by cutting the pixel into quarters again and
//! again and leaving out what lies too far from the sun, and points are spread over that part. Nothing is known of the
//! projection but the direction seen through a point.

use super::scene::SunLight;
use crate::math::{Rng, Vec3};

/// Size of the last quarters: distance from the middle to the corners over the radius of the disc.
const FINENESS: f64 = 0.25;

/// Most cuts, each of which halves the sides.
const MOST_CUTS: u32 = 14;

/// Cuts until which a quarter whose corners the sensor does not see is kept in view.
const CUTS_BESIDE_THE_VIEW: u32 = 4;

/// Size of a quarter \[rad\] up to which its corners are its farthest points.
const SMALL_RAD: f64 = 0.3;

/// Binary digits of each coordinate within a quarter.
const DIGITS: u32 = 20;

/// A square of a pixel: its left upper corner and side, in units of the pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Square {
    u: f64,
    v: f64,
    side: f64,
}

/// The squares of a pixel that its sun's disc may touch.
#[derive(Debug, Default)]
pub(super) struct DiscRegion {
    squares: Vec<Square>,
    /// Area up to and with each square, in units of the pixel.
    areas: Vec<f64>,
    /// Whether the whole pixel looks in one direction.
    single: bool,
}

impl DiscRegion {
    /// Finds the squares; `look` is the direction through a point of the pixel, in [0, 1]².
    ///
    /// Nothing of the disc lies outside them but what shows through less than a thousandth of the pixel, on the rim of the view.
    pub fn find(&mut self, sun: &SunLight, look: &impl Fn(f64, f64) -> Option<Vec3>) {
        self.squares.clear();
        self.areas.clear();
        self.single = false;
        // A collimated beam is never seen.
        if sun.solid_angle_sr() > 0.0 {
            let pixel = Square {
                u: 0.0,
                v: 0.0,
                side: 1.0,
            };
            self.cut(sun, look, pixel, 0);
        }
        let mut area = 0.0;
        self.areas.extend(self.squares.iter().map(|s| {
            area += s.side * s.side;
            area
        }));
    }

    fn cut(
        &mut self,
        sun: &SunLight,
        look: &impl Fn(f64, f64) -> Option<Vec3>,
        square: Square,
        cuts: u32,
    ) {
        let Square { u, v, side } = square;
        let places = [(0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        let places = places.map(|(a, b)| (u + a * side, v + b * side));
        let seen = places.map(|(u, v)| look(u, v));
        let whole = seen.iter().all(Option::is_some);
        let directions = || seen.into_iter().flatten();
        match directions().next() {
            // Beside the view, as far as one sees.
            None if cuts >= CUTS_BESIDE_THE_VIEW => return,
            None => {}
            Some(first) => {
                let mut size_rad = directions().map(|d| apart(d, first)).fold(0.0, f64::max);
                if !whole {
                    size_rad = size_rad.max(size_by_steps(look, places, side));
                }
                let distances = directions().map(|d| apart(d, sun.direction));
                let distance_rad = distances.fold(f64::INFINITY, f64::min);
                let radius_rad = sun.angular_radius_rad();
                if size_rad < SMALL_RAD && distance_rad > 1.01 * radius_rad + size_rad {
                    return;
                }
                self.single |= cuts == 0 && whole && size_rad == 0.0;
                let fine = size_rad <= FINENESS * radius_rad;
                if (fine && (whole || cuts >= CUTS_BESIDE_THE_VIEW)) || cuts == MOST_CUTS {
                    self.squares.push(square);
                    return;
                }
            }
        }
        let side = 0.5 * side;
        for (column, row) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let quarter = Square {
                u: u + column * side,
                v: v + row * side,
                side,
            };
            self.cut(sun, look, quarter, cuts + 1);
        }
    }

    /// Whether the pixel shows nothing of the disc.
    pub fn is_empty(&self) -> bool {
        self.squares.is_empty()
    }

    /// Area of all squares, in units of the pixel.
    pub fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// The disc's points of a regular grid, some `wanted` in all squares: `add(direction, mu_squared, area)`, the area in units of
    /// the pixel.
    pub fn grid(
        &self,
        sun: &SunLight,
        look: &impl Fn(f64, f64) -> Option<Vec3>,
        wanted: u32,
        mut add: impl FnMut(Vec3, f64, f64),
    ) {
        let wanted = if self.single { 1.0 } else { f64::from(wanted) };
        let across = (wanted / self.squares.len() as f64).sqrt().ceil() as u32;
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(across);
        for &Square { u, v, side } in &self.squares {
            for k in 0..across * across {
                let (a, b) = (place(k % across), place(k / across));
                let Some(direction) = look(u + side * a, v + side * b) else {
                    continue;
                };
                if let Some(mu_squared) = sun.disc(direction) {
                    add(direction, mu_squared, (side / f64::from(across)).powi(2));
                }
            }
        }
    }

    /// A point of the squares, uniform by area for a uniform `t` in [0, 1); neighbours in `t` are neighbours in the pixel, so that
    /// strata of `t` are strata of the disc.
    fn place(&self, t: f64) -> (f64, f64) {
        let at = t * self.area();
        let index = self.areas.partition_point(|&a| a <= at);
        let index = index.min(self.squares.len().saturating_sub(1));
        let Some(&Square { u, v, side }) = self.squares.get(index) else {
            return (0.5, 0.5);
        };
        let before = if index == 0 {
            0.0
        } else {
            self.areas[index - 1]
        };
        // The rest of t as a number of base 4: a digit for each quarter of a quarter (Morton's order).
        let rest = ((at - before) / (side * side)).clamp(0.0, 1.0);
        let mut digits = (rest * f64::from(1u32 << DIGITS).powi(2)) as u64;
        let (mut a, mut b) = (0.0, 0.0);
        for _ in 0..DIGITS {
            a = 0.5 * (a + (digits & 1) as f64);
            b = 0.5 * (b + (digits >> 1 & 1) as f64);
            digits >>= 2;
        }
        (u + side * a, v + side * b)
    }

    /// The disc's points of `wanted` random ones, one in each equal part of the squares: `add(direction, mu_squared, area, rng)`, the
    /// area that each stands for in units of the pixel.
    pub fn scatter(
        &self,
        sun: &SunLight,
        look: &impl Fn(f64, f64) -> Option<Vec3>,
        wanted: u32,
        rng: &mut Rng,
        mut add: impl FnMut(Vec3, f64, f64, &mut Rng),
    ) {
        let count = if self.single { 1 } else { wanted };
        let area = self.area() / f64::from(count);
        for k in 0..count {
            let (u, v) = self.place((f64::from(k) + rng.uniform()) / f64::from(count));
            if let Some(direction) = look(u, v) {
                if let Some(mu_squared) = sun.disc(direction) {
                    add(direction, mu_squared, area, rng);
                }
            }
        }
    }
}

/// Angle between two unit vectors \[rad\].
fn apart(a: Vec3, b: Vec3) -> f64 {
    let off = a - b;
    2.0 * (0.5 * off.dot(off).sqrt()).min(1.0).asin()
}

/// Size of a square that is seen in part only \[rad\]: twice what small steps from its visible places tell.
fn size_by_steps(
    look: &impl Fn(f64, f64) -> Option<Vec3>,
    places: [(f64, f64); 5],
    side: f64,
) -> f64 {
    const STEP: f64 = 1e-3;
    let mut longest: f64 = 0.0;
    for (u, v) in places {
        let Some(here) = look(u, v) else { continue };
        for (a, b) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            if let Some(there) = look(u + a * STEP * side, v + b * STEP * side) {
                longest = longest.max(apart(here, there) / STEP);
            }
        }
    }
    // Half a diagonal is 0.71 sides; a corner may be a whole one from the farthest.
    2.0 * std::f64::consts::SQRT_2 * longest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::{Fisheye, LatLong, Perspective, Sensor};

    /// Rationale: squares that miss a part of the disc would dim the sun. Expected: in every pixel, and in all together, the area of
    /// the disc is that of a plain count over a fine grid, also where it lies on the rim of the view, at a pole or across a seam;
    /// by the regular points and by the random ones.
    #[test]
    fn the_disc_is_found_whole() {
        let fisheye = Fisheye::new(12, 12, 180.0).unwrap();
        let latlong = LatLong::new(24, 12).unwrap();
        let flat = Perspective::new(12, 9, 60.0, 180.0, 10.0).unwrap();
        let cases: [(&dyn Sensor, f64, f64); 8] = [
            (&fisheye, 180.0, 40.0),
            (&fisheye, 77.0, 90.0),
            (&fisheye, 130.0, 0.5),
            (&fisheye, 10.0, -1.0),
            (&latlong, 0.1, 20.0),
            (&latlong, 300.0, 89.0),
            (&flat, 178.0, 12.0),
            (&flat, 211.0, 3.0),
        ];
        for (sensor, azimuth, elevation) in cases {
            let towards = Vec3::from_azimuth_elevation_deg(azimuth, elevation);
            let sun = SunLight::new(towards, &[550.0], &[1.0], 3.0).unwrap();
            let (width, height) = sensor.size();
            let mut sums = [0.0; 3];
            let (mut region, mut rng) = (DiscRegion::default(), Rng::new(7, 7));
            for (row, column) in (0..height).flat_map(|r| (0..width).map(move |c| (r, c))) {
                let look = |u, v| sensor.direction(column, row, u, v);
                const FINE: usize = 160;
                let place = |k: usize| (k as f64 + 0.5) / FINE as f64;
                let plain = (0..FINE * FINE)
                    .filter_map(|i| look(place(i % FINE), place(i / FINE)))
                    .filter(|&d| sun.disc(d).is_some())
                    .count() as f64
                    / (FINE * FINE) as f64;
                let (mut regular, mut random) = (0.0, 0.0);
                region.find(&sun, &look);
                region.grid(&sun, &look, 4096, |_, _, area| regular += area);
                region.scatter(&sun, &look, 4096, &mut rng, |_, _, area, _| random += area);
                for (sum, area) in sums.iter_mut().zip([plain, regular, random]) {
                    *sum += area;
                }
                let label = format!("{azimuth} {elevation}: {plain} {regular} {random}");
                // Half a step of both grids, for at a pole the edge of the disc runs along their rows.
                assert!((regular - plain).abs() < 0.008, "{label}");
                assert!((random - plain).abs() < 0.01, "{label}");
            }
            let [plain, regular, random] = sums;
            assert!(plain > 0.02, "{plain}");
            assert!((regular - plain).abs() < 0.01 * plain + 0.001, "{sums:?}");
            assert!((random - plain).abs() < 0.02 * plain + 0.001, "{sums:?}");
        }
    }

    /// Pixels that cannot see the sun cost nothing, single directions one point, and a beam without a disc is never seen.
    #[test]
    fn no_more_points_than_are_needed() {
        let towards = Vec3::from_azimuth_elevation_deg(180.0, 40.0);
        let disc = SunLight::new(towards, &[550.0], &[1.0], 0.27).unwrap();
        let beam = SunLight::new(towards, &[550.0], &[1.0], 0.0).unwrap();
        let mut region = DiscRegion::default();
        region.find(&disc, &|_, _| Some(-towards));
        assert!(region.is_empty());
        region.find(&beam, &|_, _| Some(towards));
        assert!(region.is_empty());
        region.find(&disc, &|_, _| Some(towards));
        assert_eq!((region.squares.len(), region.area()), (1, 1.0));
        let mut points = 0;
        region.grid(&disc, &|_, _| Some(towards), 4096, |_, mu_squared, area| {
            points += 1;
            assert!((mu_squared - 1.0).abs() < 1e-12 && area == 1.0);
        });
        assert_eq!(points, 1);
        // Half a degree in a pixel of fifteen: a thousandth of it, held by squares of less than two.
        let fisheye = Fisheye::new(12, 12, 180.0).unwrap();
        let (x, y) = fisheye.pixel_of(towards).unwrap();
        let look = |u, v| fisheye.direction(x as usize, y as usize, u, v);
        region.find(&disc, &look);
        assert!(
            region.area() < 0.002 && region.squares.len() < 100,
            "{region:?}"
        );
    }
}
