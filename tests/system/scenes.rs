//! Media that several tests share.

use celaje::math::Vec3;
use celaje::medium::LayeredMedium;
use celaje::optics::Phase;
use celaje::transport::{Scene, SunLight};

pub const PLANET_RADIUS_M: f64 = 6_360_000.0;
pub const WAVELENGTH_NM: [f64; 4] = [400.0, 500.0, 600.0, 700.0];

/// Nodes that grow from 100 m at the ground to 2.7 km at 100 km.
pub fn altitude_m() -> Vec<f64> {
    (0..=120)
        .map(|i| 100_000.0 * (f64::from(i) / 120.0).powf(1.44))
        .collect()
}

/// Coefficients `σ_i · shape(z)` on all nodes, shape (z, w).
pub fn separable(sigma: &[f64], shape: impl Fn(f64) -> f64) -> Vec<f64> {
    altitude_m()
        .iter()
        .flat_map(|&z| sigma.iter().map(move |s| (z, s)))
        .map(|(z, s)| s * shape(z))
        .collect()
}

/// Rayleigh-like air of vertical optical depth 0.36 at 400 nm, ozone-like absorption, and a forward-scattering aerosol of
/// optical depth `aerosol_tau` at 500 nm with a narrow tabulated peak.
pub fn hazy_air(aerosol_tau: f64, absorbing: bool) -> LayeredMedium {
    let mut m = LayeredMedium::new(&altitude_m(), &WAVELENGTH_NM, PLANET_RADIUS_M).unwrap();
    let zero = separable(&[0.0; 4], |_| 0.0);
    let air = WAVELENGTH_NM.map(|w| 0.36 / 8000.0 * (400.0 / w).powi(4));
    let depolarisation = [0.03, 0.029, 0.028, 0.027];
    m.add(
        &separable(&air, |z| (-z / 8000.0).exp()),
        &zero,
        Phase::rayleigh(&depolarisation).unwrap(),
    )
    .unwrap();
    if absorbing {
        let ozone = [1e-8, 5e-7, 2e-6, 6e-7];
        let layer = |z: f64| (-0.5 * ((z - 22_000.0) / 5000.0).powi(2)).exp();
        m.add(
            &zero,
            &separable(&ozone, layer),
            Phase::henyey_greenstein(&[0.0; 4]).unwrap(),
        )
        .unwrap();
    }
    if aerosol_tau > 0.0 {
        let ssa = if absorbing { 0.9 } else { 1.0 };
        let sigma = WAVELENGTH_NM.map(|w| aerosol_tau / 1500.0 * (500.0 / w).powf(1.2));
        let shape = |z: f64| (-z / 1500.0).exp();
        let sigma_s = separable(&sigma.map(|s| s * ssa), shape);
        let sigma_a = separable(&sigma.map(|s| s * (1.0 - ssa)), shape);
        m.add(&sigma_s, &sigma_a, peaked_phase()).unwrap();
    }
    m
}

/// A phase function whose peak rises ten-thousandfold over the side, different at each wavelength.
pub fn peaked_phase() -> Phase {
    let theta_deg: Vec<f64> = (0..50)
        .map(|i| f64::from(i) * 0.1)
        .chain((5..=180).map(f64::from))
        .collect();
    let mut p = Vec::new();
    for lane in 0..4 {
        let (g, share) = (0.97 - 0.01 * f64::from(lane), 0.3);
        let hg = |g: f64, c: f64| {
            (1.0 - g * g) / (1.0 + g * g - 2.0 * g * c).powf(1.5) / (4.0 * std::f64::consts::PI)
        };
        let row: Vec<f64> = theta_deg
            .iter()
            .map(|d| {
                let c = d.to_radians().cos();
                share * hg(g, c) + (1.0 - share) * hg(0.6, c)
            })
            .collect();
        // Normalised under the rule by which the table is read: linear in cos θ.
        let total: f64 = theta_deg
            .windows(2)
            .zip(row.windows(2))
            .map(|(d, r)| {
                std::f64::consts::PI
                    * (r[0] + r[1])
                    * (d[0].to_radians().cos() - d[1].to_radians().cos())
            })
            .sum();
        p.extend(row.into_iter().map(|v| v / total));
    }
    Phase::table(&theta_deg, &p).unwrap()
}

/// A scene under a sun of unit irradiance in the south.
pub fn under_sun(
    medium: &LayeredMedium,
    elevation_deg: f64,
    albedo: f64,
    radius_deg: f64,
) -> Scene<'_, LayeredMedium> {
    let towards = Vec3::from_azimuth_elevation_deg(180.0, elevation_deg);
    let sun = SunLight::new(towards, &WAVELENGTH_NM, &[1.0; 4], radius_deg).unwrap();
    Scene::new(medium, sun, &[albedo; 4]).unwrap()
}

pub fn look(azimuth_deg: f64, elevation_deg: f64) -> Vec3 {
    Vec3::from_azimuth_elevation_deg(azimuth_deg, elevation_deg)
}
