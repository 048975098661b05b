//! How long Mie theory takes: `make bench`, or with sasktran2's beside it, `make bench-mie`.
//!
//! The first job (81 wavelengths × 200 radii × 1801 angles, amplitudes S1 and S2 kept, one thread) is one that other codes can
//! be timed on; `benches/sasktran2_mie.py` is the same in Python. The others are an aerosol type computed anew, the same from
//! the shipped tables, and a whole sky. Times are of the processor.

use std::process::Command;

use celaje::climate::{Conditions, Overrides};
use celaje::composition::aerosol::AerosolType;
use celaje::optics::{aerosol_optics, aerosol_optics_on, mie, AngleGrid};
use celaje::spectrum::SolarSpectrum;
use celaje::{Result, Sky, WavelengthGrid};
use cpu_time::ProcessTime;

const TYPE: &str = "opac:continental-average";
/// The shortest of so many runs counts: what is longer was disturbed.
const RUNS: usize = 3;

/// Radii \[µm\], 0.01 to 10.
fn radii_um() -> Vec<f64> {
    let radius = |i| 0.01 * 1e3_f64.powf(f64::from(i) / 199.0);
    (0..200).map(radius).collect()
}

/// Cosines of 0, 0.1, … 180 degrees, exactly symmetric.
fn cosines() -> Vec<f64> {
    let mut cos_theta: Vec<f64> = (0..1801)
        .map(|i| (0.1 * f64::from(i)).to_radians().cos())
        .collect();
    for i in 0..=900 {
        cos_theta[1800 - i] = -cos_theta[i];
    }
    cos_theta[900] = 0.0;
    cos_theta
}

/// Processor time \[s\] of the job, and a sum that other codes must have too.
fn spheres(grid: &WavelengthGrid) -> Result<(f64, f64)> {
    let (radii_um, cos_theta) = (radii_um(), cosines());
    let start = ProcessTime::now();
    let mut sum = 0.0;
    for wavelength_nm in grid.nm() {
        for r in &radii_um {
            let x = std::f64::consts::TAU * r / (wavelength_nm * 1e-3);
            let (s1, s2) = mie(1.5, 0.01, x)?.amplitudes(&cos_theta)?;
            sum += s1[0].re + s2[1800].norm();
        }
    }
    Ok((start.elapsed().as_secs_f64(), sum))
}

/// The shortest processor time of some runs \[s\].
fn timed(mut work: impl FnMut() -> Result<()>) -> Result<f64> {
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let start = ProcessTime::now();
        work()?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    Ok(least)
}

/// Seconds and sum of the same job by sasktran2, in the Python that was named.
fn sasktran2(python: &str) -> Option<(f64, f64)> {
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../benches/sasktran2_mie.py"
    );
    let output = Command::new(python).arg(script).output().ok()?;
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).ok()?;
    let (seconds, sum) = text.trim().split_once(' ')?;
    Some((seconds.parse().ok()?, sum.parse().ok()?))
}

fn main() -> Result<()> {
    let grid = WavelengthGrid::default();
    let mut ours = f64::INFINITY;
    let mut sum = 0.0;
    for _ in 0..RUNS {
        let run = spheres(&grid)?;
        (ours, sum) = (ours.min(run.0), run.1);
    }
    println!("81 wavelengths x 200 radii x 1801 angles: {ours:.3} s, sum {sum:.6e}");
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(i) = arguments.iter().position(|a| a == "--python") {
        match arguments.get(i + 1).and_then(|python| sasktran2(python)) {
            Some((theirs, their_sum)) => println!(
                "sasktran2: {theirs:.3} s, sum {their_sum:.6e}; ours is {:.2} times as fast",
                theirs / ours
            ),
            None => println!("sasktran2 did not run"),
        }
    }
    let aerosol = AerosolType::named(TYPE, 45.0)?;
    let angles = AngleGrid::default();
    let by_mie = timed(|| aerosol_optics_on(&aerosol, 80.0, &grid, &angles).map(|_| ()))?;
    println!("{TYPE}, 81 wavelengths by Mie theory: {by_mie:.3} s");
    let by_table = timed(|| aerosol_optics(&aerosol, 80.0, &grid).map(|_| ()))?;
    println!("{TYPE}, 81 wavelengths from the tables: {by_table:.3} s");
    let overrides = Overrides {
        humidity_percent: Some(73.0),
        ..Overrides::default()
    };
    let sky = timed(|| {
        let conditions = Conditions::from_sun(30.0, 180.0, &overrides)?;
        Sky::new(conditions, &grid, SolarSpectrum::default()).map(|_| ())
    })?;
    println!("a sky at 73 % humidity, ready to be looked at: {sky:.3} s");
    Ok(())
}
