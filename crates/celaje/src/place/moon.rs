//! Where the Moon stands, how far away, and how much of it is lit.

use solar_positioning::delta_t;

use super::{Instant, Site};
use crate::error::{Error, Result};

/// The Moon as seen from a place: true direction (no refraction) of the middle of its disc, distance and phase.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct MoonPosition {
    /// Azimuth clockwise from north, in [0, 360) \[deg\].
    pub azimuth_deg: f64,
    /// True elevation, parallax included, −90 to 90 \[deg\].
    pub elevation_deg: f64,
    /// Distance from the place \[km\].
    pub distance_km: f64,
    /// Angle sun–Moon–Earth: 0 at full Moon, 180 at new Moon \[deg\].
    pub phase_angle_deg: f64,
    /// Lit part of the disc, 0 to 1.
    pub illuminated: f64,
    /// Whether it waxes: it stands east of the sun.
    pub waxing: bool,
}

/// Meeus 1998, table 47.A, terms of 0.002° and more: multiples of D, M, M′, F; longitude \[1e-6 deg\], distance \[m\].
const LONGITUDE: [([i8; 4], f64, f64); 31] = [
    ([0, 0, 1, 0], 6288774.0, -20905355.0),
    ([2, 0, -1, 0], 1274027.0, -3699111.0),
    ([2, 0, 0, 0], 658314.0, -2955968.0),
    ([0, 0, 2, 0], 213618.0, -569925.0),
    ([0, 1, 0, 0], -185116.0, 48888.0),
    ([0, 0, 0, 2], -114332.0, -3149.0),
    ([2, 0, -2, 0], 58793.0, 246158.0),
    ([2, -1, -1, 0], 57066.0, -152138.0),
    ([2, 0, 1, 0], 53322.0, -170733.0),
    ([2, -1, 0, 0], 45758.0, -204586.0),
    ([0, 1, -1, 0], -40923.0, -129620.0),
    ([1, 0, 0, 0], -34720.0, 108743.0),
    ([0, 1, 1, 0], -30383.0, 104755.0),
    ([2, 0, 0, -2], 15327.0, 10321.0),
    ([0, 0, 1, 2], -12528.0, 0.0),
    ([0, 0, 1, -2], 10980.0, 79661.0),
    ([4, 0, -1, 0], 10675.0, -34782.0),
    ([0, 0, 3, 0], 10034.0, -23210.0),
    ([4, 0, -2, 0], 8548.0, -21636.0),
    ([2, 1, -1, 0], -7888.0, 24208.0),
    ([2, 1, 0, 0], -6766.0, 30824.0),
    ([1, 0, -1, 0], -5163.0, -8379.0),
    ([1, 1, 0, 0], 4987.0, -16675.0),
    ([2, -1, 1, 0], 4036.0, -12831.0),
    ([2, 0, 2, 0], 3994.0, -10445.0),
    ([4, 0, 0, 0], 3861.0, -11650.0),
    ([2, 0, -3, 0], 3665.0, 14403.0),
    ([0, 1, -2, 0], -2689.0, -7003.0),
    ([2, 0, -1, 2], -2602.0, 0.0),
    ([2, -1, -2, 0], 2390.0, 10056.0),
    ([1, 0, 1, 0], -2348.0, 6322.0),
];

/// Meeus 1998, table 47.B, terms of 0.0018° and more: multiples of D, M, M′, F; latitude \[1e-6 deg\].
const LATITUDE: [([i8; 4], f64); 20] = [
    ([0, 0, 0, 1], 5128122.0),
    ([0, 0, 1, 1], 280602.0),
    ([0, 0, 1, -1], 277693.0),
    ([2, 0, 0, -1], 173237.0),
    ([2, 0, -1, 1], 55413.0),
    ([2, 0, -1, -1], 46271.0),
    ([2, 0, 0, 1], 32573.0),
    ([0, 0, 2, 1], 17198.0),
    ([2, 0, 1, -1], 9266.0),
    ([0, 0, 2, -1], 8822.0),
    ([2, -1, 0, -1], 8216.0),
    ([2, 0, -2, -1], 4324.0),
    ([2, 0, 1, 1], 4200.0),
    ([2, 1, 0, -1], -3359.0),
    ([2, -1, -1, 1], 2463.0),
    ([2, -1, 0, 1], 2211.0),
    ([2, -1, -1, -1], 2065.0),
    ([0, 1, -1, -1], -1870.0),
    ([4, 0, -1, -1], 1828.0),
    ([0, 1, 0, 1], -1794.0),
];

/// Equatorial radius \[km\] and flattening of WGS 84.
const EARTH: (f64, f64) = (6378.137, 1.0 / 298.257_223_563);
const AU_KM: f64 = 149_597_870.7;

impl MoonPosition {
    /// The Moon at a place and an instant, within 0.1° from 1900 to 2100.
    ///
    /// The lunar theory of Meeus's chapter 47 (a truncation of ELP-2000/82), to 0.01°, with the main term of nutation and
    /// the parallax of a flattened Earth.
    ///
    /// # Errors
    /// [`Error::Invalid`] if TT − UT1 cannot be estimated, which no valid [`Instant`] should cause.
    ///
    /// # Source
    /// Meeus 1998, Astronomical Algorithms, 2nd ed., chapters 12, 22, 25, 40, 47, 48.
    pub fn at(site: &Site, instant: &Instant) -> Result<Self> {
        let delta_t_s = delta_t::estimate(instant.decimal_year()).map_err(|e| {
            Error::invalid(
                format!("the Moon's position cannot be found: {e}"),
                "give a time between 1900 and 2100",
            )
        })?;
        let universal = instant.julian_date() - 2_451_545.0;
        let t = (universal + delta_t_s / 86_400.0) / 36_525.0;
        let (longitude_deg, latitude_deg, centre_km) = geocentric(t);
        // Nutation in longitude, its main term, moves sun, Moon and sidereal time alike but for the obliquity's cosine.
        let node = (125.04452 - 1934.136261 * t).to_radians();
        let nutation_deg = -17.2 / 3600.0 * node.sin();
        let obliquity = (23.439_291 - 0.013_004_2 * t + 9.2 / 3600.0 * node.cos()).to_radians();

        let moon = equatorial(
            longitude_deg + nutation_deg,
            latitude_deg,
            centre_km,
            obliquity,
        );
        let sidereal_deg = 280.460_618_37
            + 360.985_647_366_29 * universal
            + 0.000_387_933 * t * t
            + nutation_deg * obliquity.cos();
        let local = (sidereal_deg + site.longitude_deg())
            .rem_euclid(360.0)
            .to_radians();
        let from_place = horizontal(moon, site, local);
        let distance_km = norm(from_place);
        let [east, north, up] = from_place;

        let (sun_deg, sun_au) = sun(t);
        let elongation = (latitude_deg.to_radians().cos()
            * (longitude_deg - sun_deg).to_radians().cos())
        .clamp(-1.0, 1.0)
        .acos();
        let sun_km = sun_au * AU_KM;
        // Meeus, eq. 48.3.
        let phase = (sun_km * elongation.sin()).atan2(centre_km - sun_km * elongation.cos());
        Ok(Self {
            azimuth_deg: east.atan2(north).to_degrees().rem_euclid(360.0),
            elevation_deg: (up / distance_km).clamp(-1.0, 1.0).asin().to_degrees(),
            distance_km,
            phase_angle_deg: phase.to_degrees(),
            illuminated: 0.5 * (1.0 + phase.cos()),
            waxing: (longitude_deg - sun_deg).rem_euclid(360.0) < 180.0,
        })
    }
}

impl MoonPosition {
    /// The phase in words; the quarters and new and full Moon are taken to last two days or so.
    pub fn phase_name(&self) -> &'static str {
        match (self.illuminated, self.waxing) {
            (lit, _) if lit < 0.02 => "new Moon",
            (lit, _) if lit > 0.98 => "full Moon",
            (lit, true) if (0.4..=0.6).contains(&lit) => "first quarter",
            (lit, false) if (0.4..=0.6).contains(&lit) => "last quarter",
            (lit, true) if lit < 0.5 => "waxing crescent",
            (lit, false) if lit < 0.5 => "waning crescent",
            (_, true) => "waxing gibbous",
            (_, false) => "waning gibbous",
        }
    }
}

/// Ecliptic longitude and latitude of the date \[deg\] and distance from the Earth's centre \[km\]; `t` in centuries of TT.
fn geocentric(t: f64) -> (f64, f64, f64) {
    let mean_longitude = 218.316_447_7 + 481_267.881_234_21 * t - 0.001_578_6 * t * t;
    let d = 297.850_192_1 + 445_267.111_403_4 * t - 0.001_881_9 * t * t;
    let m = 357.529_109_2 + 35_999.050_290_9 * t - 0.000_153_6 * t * t;
    let m_moon = 134.963_396_4 + 477_198.867_505_5 * t + 0.008_741_4 * t * t;
    let f = 93.272_095_0 + 483_202.017_523_3 * t - 0.003_653_9 * t * t;
    // The Earth's orbit grows rounder: terms with M shrink.
    let e = 1.0 - 0.002_516 * t - 0.000_007_4 * t * t;
    let argument = |k: &[i8; 4]| {
        let sum = f64::from(k[0]) * d
            + f64::from(k[1]) * m
            + f64::from(k[2]) * m_moon
            + f64::from(k[3]) * f;
        sum.rem_euclid(360.0).to_radians()
    };
    let shrink = |k: &[i8; 4]| e.powi(i32::from(k[1].abs()));
    let (mut longitude, mut distance_m) = (0.0, 385_000_560.0);
    for (k, sine, cosine) in &LONGITUDE {
        longitude += shrink(k) * sine * argument(k).sin();
        distance_m += shrink(k) * cosine * argument(k).cos();
    }
    // Venus and the flattening of the Earth.
    let venus = (119.75 + 131.849 * t).to_radians();
    let flattening = (mean_longitude - f).rem_euclid(360.0).to_radians();
    longitude += 3958.0 * venus.sin() + 1962.0 * flattening.sin();
    let mut latitude = -2235.0 * mean_longitude.rem_euclid(360.0).to_radians().sin();
    for (k, sine) in &LATITUDE {
        latitude += shrink(k) * sine * argument(k).sin();
    }
    (
        (mean_longitude + longitude * 1e-6).rem_euclid(360.0),
        latitude * 1e-6,
        distance_m * 1e-3,
    )
}

/// Ecliptic longitude of the sun \[deg\] and its distance \[au\], to 0.01°; `t` in centuries of TT (Meeus, chapter 25).
fn sun(t: f64) -> (f64, f64) {
    let mean = 280.46646 + 36_000.769_83 * t;
    let m = (357.52911 + 35_999.050_29 * t)
        .rem_euclid(360.0)
        .to_radians();
    let centre = (1.914_602 - 0.004_817 * t) * m.sin() + 0.019_993 * (2.0 * m).sin();
    let eccentricity = 0.016_708_634 - 0.000_042_037 * t;
    let anomaly = m + centre.to_radians();
    let au =
        1.000_001_018 * (1.0 - eccentricity * eccentricity) / (1.0 + eccentricity * anomaly.cos());
    ((mean + centre - 0.005_69).rem_euclid(360.0), au)
}

/// Equatorial vector of an ecliptic direction.
fn equatorial(longitude_deg: f64, latitude_deg: f64, distance: f64, obliquity: f64) -> [f64; 3] {
    let (sin_l, cos_l) = longitude_deg.to_radians().sin_cos();
    let (sin_b, cos_b) = latitude_deg.to_radians().sin_cos();
    let (x, y, z) = (cos_b * cos_l, cos_b * sin_l, sin_b);
    let (sin_e, cos_e) = obliquity.sin_cos();
    [x, cos_e * y - sin_e * z, sin_e * y + cos_e * z].map(|c| c * distance)
}

/// East, north and up \[km\] from a place to an equatorial vector \[km\] at a local sidereal time \[rad\].
fn horizontal(target: [f64; 3], site: &Site, sidereal: f64) -> [f64; 3] {
    let (radius, flattening) = EARTH;
    let (sin_lat, cos_lat) = site.latitude_deg().to_radians().sin_cos();
    let (sin_s, cos_s) = sidereal.sin_cos();
    // Geodetic to geocentric, WGS 84.
    let e2 = flattening * (2.0 - flattening);
    let n = radius / (1.0 - e2 * sin_lat * sin_lat).sqrt();
    let height = site.altitude_m() * 1e-3;
    let from_axis = (n + height) * cos_lat;
    let place = [
        from_axis * cos_s,
        from_axis * sin_s,
        (n * (1.0 - e2) + height) * sin_lat,
    ];
    let [x, y, z] = [0, 1, 2].map(|i| target[i] - place[i]);
    let away = cos_s * x + sin_s * y;
    [
        cos_s * y - sin_s * x,
        cos_lat * z - sin_lat * away,
        cos_lat * away + sin_lat * z,
    ]
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Table;

    /// Meeus, example 47.a: 1992 April 12.0 TD, λ = 133.162655°, β = −3.229126°, Δ = 368409.7 km (all his terms).
    #[test]
    fn meeus_example() {
        let (longitude, latitude, km) = geocentric(-0.077_221_081_451);
        assert!((longitude - 133.162_655).abs() < 0.01, "{longitude}");
        assert!((latitude + 3.229_126).abs() < 0.01, "{latitude}");
        assert!((km - 368_409.7).abs() < 30.0, "{km}");
    }

    /// Against astropy's ephemeris: 0.1° was wanted, 0.03° is held.
    #[test]
    fn positions_agree_with_astropy() {
        let table = Table::parse(
            "moon_positions",
            include_str!("../../../../tests/reference/moon_positions.csv"),
        )
        .unwrap();
        let column = |name: &str| table.numbers(name).unwrap();
        let (lat, lon) = (column("latitude_deg"), column("longitude_deg"));
        let (azimuth, elevation) = (column("azimuth_deg"), column("elevation_deg"));
        let (km, lit) = (column("distance_km"), column("illuminated"));
        let (mut worst, mut squares, mut squares_km) = (0f64, 0.0, 0.0);
        for (i, time) in table.words("time").unwrap().into_iter().enumerate() {
            let site = Site::new(lat[i], lon[i], 0.0).unwrap();
            let moon = MoonPosition::at(&site, &time.parse().unwrap()).unwrap();
            let turn = (moon.azimuth_deg - azimuth[i] + 180.0).rem_euclid(360.0) - 180.0;
            let turn = turn * elevation[i].to_radians().cos();
            let off = turn.hypot(moon.elevation_deg - elevation[i]);
            worst = worst.max(off);
            squares += off * off / km.len() as f64;
            squares_km += (moon.distance_km - km[i]).powi(2) / km.len() as f64;
            assert!(off < 0.03, "{time} {i}: {off}°");
            assert!((moon.distance_km / km[i] - 1.0).abs() < 5e-4, "{time} {i}");
            assert!((moon.illuminated - lit[i]).abs() < 2e-3, "{time} {i}");
        }
        let (rms, rms_km) = (squares.sqrt(), squares_km.sqrt());
        println!(
            "direction of the Moon: rms {rms:.4}°, worst {worst:.4}°; distance: rms {rms_km:.1} km"
        );
    }
}
