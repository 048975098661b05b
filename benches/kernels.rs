//! The innermost work, kernel by kernel: `make bench`.

use celaje::climate::{Conditions, Overrides};
use celaje::math::{lanes, Rng};
use celaje::optics::Phase;
use celaje::place::{Instant, Site};
use criterion::Criterion;
use multiversion::multiversion;
use std::hint::black_box;
use std::time::Duration;

/// As the integrators call it: at the widest vectors of the processor.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl",
    "x86_64+avx2+fma",
    "aarch64+neon"
))]
fn exp_neg(tau: &[f32], out: &mut [f32]) {
    lanes::exp_neg(tau, out);
}

/// Transmittance of 81 wavelengths from their optical depths.
fn exponential(c: &mut Criterion) {
    let tau = lanes::row_from(81, |i| 0.1 * i as f64);
    let mut out = vec![0.0; tau.len()];
    c.bench_function("exp of 81 wavelengths", |b| {
        b.iter(|| exp_neg(black_box(&tau), black_box(&mut out)))
    });
}

/// One scattering angle.
fn phase_sampling(c: &mut Criterion) {
    let theta_deg: Vec<f64> = (0..=1800).map(|i| 0.1 * f64::from(i)).collect();
    let g: f64 = 0.9;
    let hg = |d: &f64| {
        let x = 1.0 + g * g - 2.0 * g * d.to_radians().cos();
        (1.0 - g * g) / (x * x.sqrt()) / (4.0 * std::f64::consts::PI)
    };
    let p: Vec<f64> = theta_deg.iter().map(hg).collect();
    let phases = [
        ("Rayleigh", Phase::rayleigh(&[0.0279])),
        ("Henyey-Greenstein", Phase::henyey_greenstein(&[0.7])),
        ("table of 1801 angles", Phase::table(&theta_deg, &p)),
    ];
    for (name, phase) in phases {
        let Ok(phase) = phase else { continue };
        let mut rng = Rng::new(1, 0);
        c.bench_function(&format!("scattering angle, {name}"), |b| {
            b.iter(|| phase.sample(black_box(0), rng.uniform()))
        });
    }
}

/// Everything that is known of a place and a time, once the tables are read.
fn climate(c: &mut Criterion) {
    let overrides = Overrides::default();
    let site = Site::new(41.65, -0.88, 0.0);
    let time = Instant::from_utc(2026, 6, 21, 18, 30, 0.0);
    let (Ok(site), Ok(time)) = (site, time) else {
        return;
    };
    c.bench_function("conditions of a place and a time", |b| {
        b.iter(|| Conditions::at(black_box(&site), black_box(&time), &overrides))
    });
}

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    exponential(&mut criterion);
    phase_sampling(&mut criterion);
    climate(&mut criterion);
    criterion.final_summary();
}
