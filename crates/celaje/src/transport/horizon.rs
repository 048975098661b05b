//! The directions that a guide tells apart: bins of elevation and of azimuth from the sun's.

use crate::math::lanes::BLOCK;

/// Edges of the elevations \[deg\] between which light is told apart, at the ground; [`Horizon`] has those aloft.
const ELEVATION_EDGES_DEG: [f64; 11] = [
    -90.0, -25.0, -6.0, -2.0, 0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 90.0,
];
pub(super) const ELEVATIONS: usize = ELEVATION_EDGES_DEG.len() - 1;
/// Edges of the azimuths from the sun's \[deg\], on both sides of it.
const AZIMUTH_EDGES_DEG: [f64; 9] = [0.0, 8.0, 20.0, 35.0, 55.0, 80.0, 110.0, 145.0, 180.0];
pub(super) const AZIMUTHS: usize = AZIMUTH_EDGES_DEG.len() - 1;
/// Bins of direction, both sides of the sun in one; of one side only, an elevation has a block of them.
pub(super) const BINS: usize = ELEVATIONS * AZIMUTHS;
const _: () = assert!(2 * AZIMUTHS == BLOCK);

/// The elevations at a height. Those about the horizon lie about where it is, and closer the higher the eye: what is bright in twilight
/// is a band of some ten kilometres there.
pub(super) struct Horizon {
    /// Sines of the edges.
    edge_sines: [f64; ELEVATIONS + 1],
    /// Sine and cosine in the middle between them.
    pub middle: [(f32, f32); ELEVATIONS],
    /// Solid angle of each bin \[sr\].
    pub solid_angle: [f32; BINS],
}

impl Horizon {
    /// That of an eye at a distance from the planet's centre \[m\].
    pub fn new(radius_m: f64, ground_m: f64) -> Self {
        let dip_deg = (ground_m / radius_m).min(1.0).acos().to_degrees();
        // From 60 km, whose dip is 8°, and above those over the horizon lie at 0.4 of their distance.
        let closer = 1.0 - 0.6 * (dip_deg / 8.0).min(1.0);
        let mut edge_sines = [0.0; ELEVATIONS + 1];
        for (sine, edge_deg) in edge_sines.iter_mut().zip(ELEVATION_EDGES_DEG) {
            let deg = match edge_deg {
                // All of the ground is in view, however far it lies.
                ..=0.0 => edge_deg - dip_deg * (1.0 + edge_deg / 90.0),
                ..=10.0 => edge_deg * closer - dip_deg,
                _ => edge_deg,
            };
            *sine = deg.to_radians().sin();
        }
        let middle = std::array::from_fn(|e| {
            let sine = 0.5 * (edge_sines[e] + edge_sines[e + 1]);
            (sine as f32, (1.0 - sine * sine).sqrt() as f32)
        });
        let solid_angle = std::array::from_fn(|bin| {
            let (e, a) = (bin / AZIMUTHS, bin % AZIMUTHS);
            let width = (AZIMUTH_EDGES_DEG[a + 1] - AZIMUTH_EDGES_DEG[a]).to_radians();
            (2.0 * width * (edge_sines[e + 1] - edge_sines[e])) as f32
        });
        Self {
            edge_sines,
            middle,
            solid_angle,
        }
    }

    /// A direction in a bin of one side: sine of its elevation and its azimuth from the sun's \[rad\], from two numbers in [0, 1).
    #[inline(always)]
    pub fn in_bin(&self, bin: usize, u: [f64; 2]) -> (f64, f64) {
        let (e, a) = (bin / BLOCK, bin % AZIMUTHS);
        let side = if bin % BLOCK < AZIMUTHS { 1.0 } else { -1.0 };
        let (below, above) = (self.edge_sines[e], self.edge_sines[e + 1]);
        let (from, to) = (AZIMUTH_EDGES_DEG[a], AZIMUTH_EDGES_DEG[a + 1]);
        let phi = (from + u[1] * (to - from)).to_radians();
        (below + u[0] * (above - below), side * phi)
    }

    /// The bin of a direction, by the sine of its elevation, the cosine of its azimuth from the sun's and the side of it.
    #[inline(always)]
    pub fn bin(&self, sine: f64, cos_azimuth: f64, left: bool) -> usize {
        let mut e = 0;
        for &edge in &self.edge_sines[1..ELEVATIONS] {
            e += usize::from(sine >= edge);
        }
        let mut a = if left { 0 } else { AZIMUTHS };
        for &edge in &AZIMUTH_EDGE_COSINES[1..AZIMUTHS] {
            a += usize::from(cos_azimuth <= edge);
        }
        e * BLOCK + a
    }

    /// Solid angle of a bin of one side \[sr\].
    #[inline(always)]
    pub fn solid_angle_of_side(&self, bin: usize) -> f32 {
        0.5 * self.solid_angle[bin / BLOCK * AZIMUTHS + bin % AZIMUTHS]
    }
}

/// Azimuth from the sun's in the middle of a bin of an elevation \[rad\]; those right of the sun follow those left of it.
pub(super) fn middle_azimuth(azimuth: usize) -> f64 {
    let a = azimuth % AZIMUTHS;
    let phi = 0.5 * (AZIMUTH_EDGES_DEG[a] + AZIMUTH_EDGES_DEG[a + 1]).to_radians();
    if azimuth < AZIMUTHS {
        phi
    } else {
        -phi
    }
}

/// Cosines of [`AZIMUTH_EDGES_DEG`].
const AZIMUTH_EDGE_COSINES: [f64; AZIMUTHS + 1] = [
    1.0,
    0.990_268_068_741_570_4,
    0.939_692_620_785_908_4,
    0.819_152_044_288_991_8,
    0.573_576_436_351_046,
    0.173_648_177_666_930_3,
    -0.342_020_143_325_668_7,
    -0.819_152_044_288_991_8,
    -1.0,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rng;

    #[test]
    fn edges_are_those_of_the_angles() {
        for (deg, cosine) in AZIMUTH_EDGES_DEG.iter().zip(AZIMUTH_EDGE_COSINES) {
            assert!((deg.to_radians().cos() - cosine).abs() < 1e-12);
        }
    }

    fn horizons() -> impl Iterator<Item = Horizon> {
        let ground_m = 6_371_000.0;
        [0.0, 1.0, 2500.0, 40_000.0, 120_000.0, 60_000_000.0]
            .map(|h| Horizon::new(ground_m + h, ground_m))
            .into_iter()
    }

    /// Rationale: bins that overlap, or leave a gap, would be a bias. Expected: edges rise from the nadir to the zenith, one of them at the
    /// horizon, and the bins fill the sphere.
    #[test]
    fn bins_fill_the_sphere_at_every_height() {
        for horizon in horizons() {
            let rises = horizon.edge_sines.windows(2).all(|e| e[0] < e[1]);
            assert!(rises, "{:?}", horizon.edge_sines);
            assert_eq!(horizon.edge_sines[0], -1.0);
            assert_eq!(horizon.edge_sines[ELEVATIONS], 1.0);
            let sphere: f32 = horizon.solid_angle.iter().sum();
            assert!((sphere / (4.0 * std::f32::consts::PI) - 1.0).abs() < 1e-5);
        }
        let ground_m = 6_371_000.0;
        let aloft = Horizon::new(ground_m + 40_000.0, ground_m);
        let tangent_m = (ground_m + 40_000.0) * (1.0 - aloft.edge_sines[4].powi(2)).sqrt();
        assert!((tangent_m - ground_m).abs() < 1e-3, "{tangent_m}");
    }

    /// Rationale: the density of a direction is looked up by its bin; a direction drawn in one bin but found in another would
    /// be a bias. Expected: never.
    #[test]
    fn directions_are_found_in_the_bins_they_were_drawn_in() {
        let mut rng = Rng::new(1, 1);
        for horizon in horizons() {
            for bin in 0..2 * BINS {
                for _ in 0..200 {
                    let (sine, phi) = horizon.in_bin(bin, [rng.uniform(), rng.uniform()]);
                    assert_eq!(horizon.bin(sine, phi.cos(), phi > 0.0), bin);
                }
            }
        }
    }
}
