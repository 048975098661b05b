//! The peer scene by Eradiate and sasktran2, beside ours: `make bench-peers`.
//!
//! `--eradiate PYTHON` and `--sasktran2 PYTHON` name interpreters that have them; each runs a script of this folder and prints what it
//! found. All of them have one thread, and times are of the processor. Spherical shells throughout.
//!
//! Codes with noise are compared by `⟨variance / L²⟩ × processor seconds / (directions × wavelengths)`, without the setup: what a
//! pixel at one wavelength costs at a given noise. The variance is that of independent repetitions with seeds of their own, `L`
//! the mean of `path`; the mean is over the published directions and wavelengths. Codes without noise are compared by their time and by
//! how far they are off that mean of `path`.

#[path = "../tests/support/mod.rs"]
mod support;

use celaje::math::Vec3;
use celaje::medium::LayeredMedium;
use celaje::transport::{Accuracy, Integrator, Path, Shells};
use celaje::{Film, Result, WavelengthGrid};
use celaje_harness::{estimate, Estimate};
use cpu_time::ThreadTime;
use std::process::Command;
use support::{batches, peer, Job};

const SUN_ZENITH_DEG: f64 = 60.0;
/// Paths per direction and repetition, and repetitions.
const SPP: u32 = 4096;
const REPETITIONS: u64 = 16;
/// What is asked of Eradiate: its repetitions need not be as quiet.
const THEIR_SPP: &str = "2000";
/// The shortest of so many solutions counts.
const RUNS: usize = 3;

/// What one code found.
struct Run {
    label: String,
    /// Processor time of a repetition, without its setup for those with noise.
    seconds: f64,
    /// Wavelengths that a repetition carried.
    wavelengths: usize,
    /// Radiances \[sr⁻¹\] of every repetition, in the order of the published table.
    radiance: Vec<Vec<f64>>,
}

impl Run {
    /// Mean over repetitions, cell by cell.
    fn mean(&self) -> Vec<f64> {
        let cells = 0..self.radiance[0].len();
        cells.map(|i| self.estimate(i).mean).collect()
    }

    /// Mean of one cell and its standard error.
    fn estimate(&self, cell: usize) -> Estimate {
        let values: Vec<f64> = self.radiance.iter().map(|r| r[cell]).collect();
        estimate(&values)
    }

    /// Variance of a repetition over the square of the truth, its mean over all cells.
    fn relative_variance(&self, truth: &[f64]) -> f64 {
        let repetitions = self.radiance.len() as f64;
        let one = |(i, l): (usize, &f64)| {
            repetitions * (self.estimate(i).standard_error / l).powi(2) / truth.len() as f64
        };
        truth.iter().enumerate().map(one).sum()
    }

    fn figure_of_merit(&self, truth: &[f64], directions: usize) -> f64 {
        let values = (directions * self.wavelengths) as f64;
        self.relative_variance(truth) * self.seconds / values
    }

    /// Mean excess over a reference, with its standard error.
    fn bias(&self, reference: &[f64]) -> Estimate {
        let excess = |r: &Vec<f64>| -> f64 {
            let off: f64 = r.iter().zip(reference).map(|(a, b)| a / b - 1.0).sum();
            off / reference.len() as f64
        };
        let means: Vec<f64> = self.radiance.iter().map(excess).collect();
        estimate(&means)
    }
}

/// Root mean square and largest of `a / b - 1`.
fn off(a: &[f64], b: &[f64]) -> (f64, f64) {
    let off = || a.iter().zip(b).map(|(a, b)| a / b - 1.0);
    let square: f64 = off().map(|x| x * x).sum();
    let worst = off().fold(0.0, |w: f64, x| w.max(x.abs()));
    ((square / a.len() as f64).sqrt(), worst)
}

/// The scene at some wavelengths, of which the published ones are kept.
struct Ours {
    wavelength_nm: Vec<f64>,
    medium: LayeredMedium,
    looks: Vec<Vec3>,
    /// Published wavelengths among those above.
    published: Vec<usize>,
}

impl Ours {
    fn new(wavelength_nm: &[f64]) -> Self {
        let (published_nm, looks) = peer::axes(&peer::published("SO"));
        let all = wavelength_nm.iter().enumerate();
        let known = all.filter(|(_, nm)| published_nm.contains(nm));
        Self {
            wavelength_nm: wavelength_nm.to_vec(),
            medium: peer::medium(wavelength_nm),
            looks,
            published: known.map(|(i, _)| i).collect(),
        }
    }

    /// A film and its processor time.
    fn render(
        &self,
        integrator: &dyn Integrator<LayeredMedium>,
        spp: u32,
        seed: u64,
    ) -> (Film, f64) {
        let scene = peer::scene(&self.medium, &self.wavelength_nm, SUN_ZENITH_DEG);
        let job = Job {
            seed,
            batches: 1,
            spp,
            max_order: None,
        };
        let start = ThreadTime::now();
        let mut films = batches(integrator, &scene, peer::PLANET_RADIUS_M, &self.looks, job);
        (films.remove(0), start.elapsed().as_secs_f64())
    }

    /// A film's radiances at the published wavelengths, in the order of the table.
    fn cells(&self, film: &Film) -> Vec<f64> {
        let directions = 0..self.looks.len();
        let row = |lane: usize| {
            let directions = directions.clone();
            directions.map(move |d| f64::from(film.spectrum(d)[lane]))
        };
        self.published.iter().flat_map(|&lane| row(lane)).collect()
    }

    /// Repetitions by `path`.
    fn path(&self, label: &str) -> Run {
        let (_, setup_s) = self.render(&Path, 1, 0);
        let (mut seconds, mut radiance) = (0.0, Vec::new());
        for seed in 1..=REPETITIONS {
            let (film, s) = self.render(&Path, SPP, seed);
            seconds += (s - setup_s) / REPETITIONS as f64;
            radiance.push(self.cells(&film));
        }
        Run {
            label: label.into(),
            seconds,
            wavelengths: self.wavelength_nm.len(),
            radiance,
        }
    }

    /// `shells`, solved and looked at.
    fn shells(&self, accuracy: Accuracy, name: &str) -> Run {
        let (mut seconds, mut radiance) = (f64::INFINITY, Vec::new());
        for _ in 0..RUNS {
            let (film, s) = self.render(&Shells { accuracy }, 1, 0);
            seconds = f64::min(seconds, s);
            radiance = vec![self.cells(&film)];
        }
        Run {
            label: format!("shells, {name}"),
            seconds,
            wavelengths: self.wavelength_nm.len(),
            radiance,
        }
    }
}

/// `path` with a single wavelength at a time, as codes do that share nothing between wavelengths: the published ones together.
fn one_by_one() -> Run {
    let published_nm = peer::axes(&peer::published("SO")).0;
    let mut all = Run {
        label: "path, one wavelength at a time".into(),
        seconds: 0.0,
        wavelengths: published_nm.len(),
        radiance: vec![Vec::new(); REPETITIONS as usize],
    };
    for nm in published_nm {
        let one = Ours::new(&[nm]).path("");
        all.seconds += one.seconds;
        for (cells, more) in all.radiance.iter_mut().zip(one.radiance) {
            cells.extend(more);
        }
    }
    all
}

/// What a script prints, run by the Python that `--NAME` names: a line of JSON per run.
fn theirs(name: &str, script: &str, arguments: &[&str], wavelengths: usize) -> Vec<Run> {
    let flag = format!("--{name}");
    let Some(python) = std::env::args().skip_while(|a| *a != flag).nth(1) else {
        return Vec::new();
    };
    let benches = concat!(env!("CARGO_MANIFEST_DIR"), "/../../benches/");
    let mut command = Command::new(&python);
    command.arg(format!("{benches}{script}")).args(arguments);
    let Ok(output) = command.output() else {
        eprintln!("error: {python} does not run");
        std::process::exit(1)
    };
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let runs: Option<Vec<Run>> = text.lines().map(|l| parsed(l, wavelengths)).collect();
    match runs {
        Some(runs) if output.status.success() && !runs.is_empty() => runs,
        _ => {
            eprintln!("error: {script} did not print what it should");
            std::process::exit(1)
        }
    }
}

fn parsed(line: &str, wavelengths: usize) -> Option<Run> {
    let found: serde_json::Value = serde_json::from_str(line).ok()?;
    // Shape (repetition, wavelength, direction).
    let radiance: Vec<Vec<Vec<f64>>> = serde_json::from_value(found["radiance"].clone()).ok()?;
    Some(Run {
        label: found["label"].as_str()?.into(),
        seconds: found["seconds"].as_f64()?,
        wavelengths,
        radiance: radiance.into_iter().map(|r| r.concat()).collect(),
    })
}

/// Codes with noise, the first of them ours.
fn print_noisy(runs: &[&Run], truth: &[f64], published: &[f64], directions: usize) {
    println!("| method | figure of merit | over path's | off the table, mean | rms | of it noise |\n|---|---|---|---|---|---|");
    let ours = runs[0].figure_of_merit(truth, directions);
    for run in runs {
        let merit = run.figure_of_merit(truth, directions);
        let bias = run.bias(published);
        let noise = (run.relative_variance(truth) / run.radiance.len() as f64).sqrt();
        println!(
            "| {} | {merit:.2e} | {:.1} | {:+.3} ± {:.3} % | {:.2} % | {:.2} % |",
            run.label,
            merit / ours,
            100.0 * bias.mean,
            100.0 * bias.standard_error,
            100.0 * off(&run.mean(), published).0,
            100.0 * noise,
        );
    }
}

/// Codes without noise; theirs against the quickest of ours that is no farther off.
fn print_solvers(ours: &[Run], theirs: &[Run], truth: &[f64], published: &[f64]) {
    println!("| method | seconds | off path, rms | worst | off the table, rms | over shells as close |\n|---|---|---|---|---|---|");
    let rms = |run: &Run| off(&run.radiance[0], truth).0;
    for (run, is_theirs) in ours
        .iter()
        .map(|r| (r, false))
        .chain(theirs.iter().map(|r| (r, true)))
    {
        let as_close = ours.iter().filter(|o| is_theirs && rms(o) <= rms(run));
        let least = as_close.map(|o| o.seconds).min_by(f64::total_cmp);
        println!(
            "| {} | {:.2} | {:.2} % | {:.2} % | {:.2} % | {} |",
            run.label,
            run.seconds,
            100.0 * rms(run),
            100.0 * off(&run.radiance[0], truth).1,
            100.0 * off(&run.radiance[0], published).0,
            least.map_or("".into(), |s| format!("{:.0}", run.seconds / s)),
        );
    }
}

fn measure() -> Result<()> {
    let grid = WavelengthGrid::range(380.0, 780.0, 5.0)?;
    let ours = Ours::new(grid.nm());
    let directions = ours.looks.len();
    let cells = peer::published("SO");
    let published: Vec<f64> = cells.iter().map(|c| c.radiance).collect();
    let path = ours.path("path, 81 wavelengths at a time");
    let truth = path.mean();
    let one = one_by_one();
    let repetitions = REPETITIONS.to_string();
    let published_nm = peer::axes(&cells).0.len();
    let eradiate = theirs(
        "eradiate",
        "eradiate_peer.py",
        &[THEIR_SPP, &repetitions],
        published_nm,
    );
    println!(
        "Peer scene (Rayleigh, sun zenith {SUN_ZENITH_DEG} deg), {directions} directions, {REPETITIONS} repetitions: variance / L² × \
         processor seconds\nper pixel and wavelength, without the setup\n"
    );
    let noisy: Vec<&Run> = [&path, &one].into_iter().chain(&eradiate).collect();
    print_noisy(&noisy, &truth, &published, directions);
    let solved = Accuracy::ALL.map(|(accuracy, name, _)| ours.shells(accuracy, name));
    let sasktran2 = theirs("sasktran2", "sasktran2_peer.py", &[], grid.len());
    println!(
        "\nThe same without noise, {} wavelengths: processor seconds\n",
        grid.len()
    );
    print_solvers(&solved, &sasktran2, &truth, &published);
    Ok(())
}

fn main() -> Result<()> {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(measure),
        Err(e) => {
            eprintln!("error: no thread: {e}");
            std::process::exit(1)
        }
    }
}
