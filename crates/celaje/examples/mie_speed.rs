//! How long Mie tables take: `cargo run --release --example mie_speed`.
//!
//! The first job (81 wavelengths × 200 radii × 1801 angles, amplitudes S1 and S2 kept) is the one that other codes can be
//! timed on; the second is what the program does when it starts with its default aerosol.

use celaje::composition::aerosol::AerosolType;
use celaje::optics::{aerosol_optics, mie};
use celaje::{Result, WavelengthGrid};
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
        let start = Instant::now();
        let optics = aerosol_optics(&AerosolType::named(name, 45.0)?, 80.0, &grid)?;
        println!(
            "{name}, 81 wavelengths, {} angles: {:.3} s, optical depth at 550 nm {:.4}",
            optics.angles.theta_deg().len(),
            start.elapsed().as_secs_f64(),
            optics.aod_550_above(0.0)
        );
    }
    Ok(())
}
