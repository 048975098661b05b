//! How long Mie tables take: `cargo run --release --example mie_speed`.
//!
//! The first job (81 wavelengths × 200 radii × 1801 angles, amplitudes S1 and S2 kept) is the one that other codes can be
//! timed on; the others are a type computed anew, the same from the shipped tables, and the whole composition of its sky.

use celaje::climate::{Conditions, Overrides};
use celaje::composition::aerosol::AerosolType;
use celaje::optics::{aerosol_optics, aerosol_optics_on, mie, AngleGrid};
use celaje::spectrum::SolarSpectrum;
use celaje::{Result, Sky, WavelengthGrid};
use rayon::prelude::*;
use std::time::Instant;

fn main() -> Result<()> {
    let grid = WavelengthGrid::default();
    let radius_um: Vec<f64> = (0..200)
        .map(|i| 0.01 * 1e3_f64.powf(i as f64 / 199.0))
        .collect();
    let mut cos_theta: Vec<f64> = (0..1801)
        .map(|i| (0.1 * f64::from(i)).to_radians().cos())
        .collect();
    for i in 0..=900 {
        cos_theta[1800 - i] = -cos_theta[i];
    }
    cos_theta[900] = 0.0;
    let one = |wavelength_nm: f64| -> Result<f64> {
        let mut forward = 0.0;
        for r in &radius_um {
            let x = std::f64::consts::TAU * r / (wavelength_nm * 1e-3);
            let (s1, s2) = mie(1.5, 0.01, x)?.amplitudes(&cos_theta)?;
            forward += s1[0].re + s2[1800].im;
        }
        Ok(forward)
    };

    let start = Instant::now();
    let serial: f64 = grid.nm().iter().map(|&w| one(w)).sum::<Result<f64>>()?;
    println!(
        "81 × 200 × 1801, one thread: {:.3} s",
        start.elapsed().as_secs_f64()
    );
    let start = Instant::now();
    let parallel = grid
        .nm()
        .par_iter()
        .map(|&w| one(w))
        .collect::<Result<Vec<f64>>>()?;
    println!(
        "81 × 200 × 1801, all threads: {:.3} s",
        start.elapsed().as_secs_f64()
    );
    println!(
        "checksums {serial:.6e} {:.6e}",
        parallel.iter().sum::<f64>()
    );

    let types: Vec<String> = std::env::args().skip(1).collect();
    let default = vec!["opac:continental-average".to_owned()];
    for name in if types.is_empty() { &default } else { &types } {
        let aerosol = AerosolType::named(name, 45.0)?;
        let timed = |what: &str, start: Instant| {
            println!("{name}, {what}: {:.3} s", start.elapsed().as_secs_f64());
        };
        let start = Instant::now();
        aerosol_optics_on(&aerosol, 80.0, &grid, &AngleGrid::default())?;
        timed("81 wavelengths by Mie theory", start);
        let start = Instant::now();
        aerosol_optics(&aerosol, 80.0, &grid)?;
        timed("81 wavelengths from the tables", start);
        let overrides = Overrides {
            aerosol: Some(name.clone()),
            humidity_percent: Some(73.0),
            ..Overrides::default()
        };
        let start = Instant::now();
        let conditions = Conditions::from_sun(30.0, 180.0, &overrides)?;
        Sky::new(conditions, &grid, SolarSpectrum::default())?;
        timed("sky at 73 % humidity", start);
    }
    Ok(())
}
