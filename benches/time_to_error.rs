//! Time to a stated error, measured: `make bench`.
//!
//! Each integrator renders part of a picture on one thread, and its own film tells its noise. As variance falls with the
//! inverse of the work, both together give the processor time to bring every pixel's whole spectrum to 1 % noise:
//!
//! `T = setup + ⟨variance / L²⟩ / 10⁻⁴ · processor time · (pixels of the picture / pixels rendered)`
//!
//! with the mean over pixels and wavelengths and `L` the radiance by the reference. The mean is a strict judge: a few
//! pixels next to the horizon and the sun dominate it. Processor time of the thread, not time on the clock, so that other
//! programs on the machine matter little.

#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use celaje::climate::{Conditions, Overrides};
use celaje::composition::{column, Atmosphere, VerticalGrid};
use celaje::math::Vec3;
use celaje::medium::{from_atmosphere, LayeredMedium, Medium};
use celaje::optics::{AerosolOptics, AngleGrid, Phase};
use celaje::sensor::{Fisheye, Sensor};
use celaje::spectrum::SolarSpectrum;
use celaje::transport::{
    Budget, Classic, Control, Integrator, Observer, Path, PolarisedPath, Scene, SunLight, Tracker,
};
use celaje::{Film, Result, Sky, WavelengthGrid};
use cpu_time::ThreadTime;
use support::{peer, Looks};

const PLANET_RADIUS_M: f64 = 6_360_000.0;
/// Noise that time is stated for, squared.
const TARGET: f64 = 1e-4;
/// The classic integrator shares nothing between wavelengths, so every tenth tells the cost of all.
const CLASSIC_STRIDE: usize = 10;

/// What the command line asks for: `cargo bench --bench time_to_error -- fisheye 30 85 path` runs one method on one scene under
/// two suns; everything, if it names nothing. `spp=N` and `orders=N` replace the paths per pixel and limit the orders of
/// `path`.
struct Wanted(Vec<String>);

const SCENES: [&str; 3] = ["fisheye", "polarisation", "peer"];
const METHODS: [&str; 4] = ["path", "polarised", "tracker", "classic"];

impl Wanted {
    fn from_arguments() -> Self {
        Self(
            std::env::args()
                .skip(1)
                .filter(|a| !a.starts_with('-'))
                .collect(),
        )
    }

    /// The number given as `name=number`.
    fn number(&self, name: &str) -> Option<u32> {
        let value = |a: &String| a.strip_prefix(name)?.strip_prefix('=')?.parse().ok();
        self.0.iter().find_map(value)
    }

    /// Whether something is named, or nothing of its kind.
    fn has(&self, name: &str, kind: &[&str]) -> bool {
        !self.0.iter().any(|a| kind.contains(&a.as_str())) || self.0.iter().any(|a| a == name)
    }
}

fn main() -> Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    match pool {
        Ok(pool) => pool.install(|| {
            let wanted = Wanted::from_arguments();
            if wanted.has("fisheye", &SCENES) {
                hazy_fisheye(&wanted)?;
            }
            if wanted.has("polarisation", &SCENES) {
                cost_of_polarisation()?;
            }
            if wanted.has("peer", &SCENES) {
                peer_scene()?;
            }
            Ok(())
        }),
        Err(e) => {
            eprintln!("error: no thread: {e}");
            std::process::exit(1)
        }
    }
}

/// A film and what it cost.
struct Run {
    film: Film,
    /// Processor time of what is done once per picture.
    setup_s: f64,
    /// Processor time of all else.
    work_s: f64,
}

impl Run {
    fn new(
        integrator: &dyn Integrator<LayeredMedium>,
        scene: &Scene<'_, LayeredMedium>,
        radius_m: f64,
        sensor: &dyn Sensor,
        (spp, max_order): (u32, Option<u32>),
    ) -> Result<Self> {
        let timed = |sensor: &dyn Sensor, spp: u32| -> Result<(Film, f64)> {
            let cancel = AtomicBool::new(false);
            let control = Control {
                budget: Budget {
                    spp,
                    seed: 1,
                    max_order,
                },
                cancel: &cancel,
                progress: &|_, _| {},
            };
            let observer = Observer {
                radius_m,
                sun_disc: false,
            };
            let start = ThreadTime::now();
            let film = integrator.render(scene, &observer, sensor, &control)?;
            Ok((film, Duration::as_secs_f64(&start.elapsed())))
        };
        // One path straight up costs next to nothing but the setup.
        let (_, setup_s) = timed(&Looks(vec![Vec3::new(0.0, 0.0, 1.0)]), 1)?;
        let (film, all_s) = timed(sensor, spp)?;
        Ok(Self {
            film,
            setup_s,
            work_s: (all_s - setup_s).max(0.0),
        })
    }

    /// Mean over pixels and wavelengths of `variance / L²` of what was rendered; `reference` may hold more wavelengths,
    /// of which every `stride`-th is looked at.
    fn relative_variance(&self, reference: &Film, stride: usize) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        let w = self.film.wavelength_nm.len();
        for pixel in 0..self.film.width * self.film.height {
            for (lane, l) in reference.spectrum(pixel).iter().step_by(stride).enumerate() {
                let variance = f64::from(self.film.variance[pixel * w + lane]);
                sum += variance / f64::from(*l).powi(2);
                n += 1.0;
            }
        }
        sum / n
    }

    /// Median over mean of `variance / L²`: how much a few bad pixels weigh in the mean.
    fn median_over_mean(&self) -> f64 {
        let values = self.film.variance.iter().zip(&self.film.radiance);
        let mut values: Vec<f32> = values.map(|(v, l)| v / (l * l)).collect();
        values.sort_by(f32::total_cmp);
        f64::from(values[values.len() / 2]) / self.relative_variance(&self.film, 1)
    }

    /// Processor time to 1 % noise of a picture `share` times as large in pixels and wavelengths.
    fn seconds_to_target(&self, reference: &Film, stride: usize, share: f64) -> f64 {
        let relative_variance = self.relative_variance(reference, stride);
        self.setup_s + relative_variance / TARGET * self.work_s * share
    }
}

/// Rayleigh air, 300 DU of ozone, and a Henyey–Greenstein aerosol (g = 0.7, single-scattering albedo 0.95, optical depth
/// 0.2 at 550 nm and as λ^−1.2, scale height 1.5 km).
fn hazy_medium(grid: &WavelengthGrid) -> Result<LayeredMedium> {
    let none = AerosolOptics {
        name: "none".into(),
        wavelength_nm: grid.nm().to_vec(),
        angles: AngleGrid::coarse(),
        layers: Vec::new(),
        extrapolated: false,
    };
    let air = Atmosphere::named("us76")?.profile(&VerticalGrid::standard(0.0)?, 300.0)?;
    let mut medium = from_atmosphere(&air, &none, grid, PLANET_RADIUS_M)?;
    let shape: Vec<f64> = air.altitude_m.iter().map(|z| (-z / 1500.0).exp()).collect();
    let height_m = column(&air.altitude_m, &shape);
    let coefficients = |share: f64| -> Vec<f64> {
        let at = |s: f64, w: f64| share * 0.2 * (w / 550.0).powf(-1.2) * s / height_m;
        let rows = shape
            .iter()
            .flat_map(|&s| grid.nm().iter().map(move |&w| (s, w)));
        rows.map(|(s, w)| at(s, w)).collect()
    };
    let phase = Phase::henyey_greenstein(&vec![0.7; grid.len()])?;
    medium.add(&coefficients(0.95), &coefficients(0.05), phase)?;
    Ok(medium)
}

/// Some pixels of a 64×64 fisheye: every sixth in both directions of its eastern half, which the sun in the south mirrors.
struct Pixels {
    fisheye: Fisheye,
    chosen: Vec<(usize, usize)>,
    /// Pixels of the whole disc.
    in_disc: usize,
}

impl Pixels {
    fn new() -> Result<Self> {
        const SIZE: usize = 64;
        let fisheye = Fisheye::new(SIZE, SIZE, 180.0)?;
        let mut seen = Vec::new();
        for row in 0..SIZE {
            for column in 0..SIZE {
                if fisheye.direction(column, row, 0.5, 0.5).is_some() {
                    seen.push((column, row));
                }
            }
        }
        let in_disc = seen.len();
        seen.retain(|(column, row)| column % 6 == 3 && row % 6 == 3 && *column < SIZE / 2);
        Ok(Self {
            fisheye,
            chosen: seen,
            in_disc,
        })
    }
}

impl Sensor for Pixels {
    fn size(&self) -> (usize, usize) {
        (self.chosen.len(), 1)
    }

    fn direction(&self, column: usize, _row: usize, u: f64, v: f64) -> Option<Vec3> {
        let (column, row) = self.chosen[column];
        self.fisheye.direction(column, row, u, v)
    }
}

fn scene_under<'a>(
    medium: &'a LayeredMedium,
    grid: &WavelengthGrid,
    sun_zenith_deg: f64,
) -> Result<Scene<'a, LayeredMedium>> {
    let towards = Vec3::from_azimuth_elevation_deg(180.0, 90.0 - sun_zenith_deg);
    let sun = SunLight::new(towards, grid.nm(), &vec![1.0; grid.len()], 0.267)?;
    Scene::new(medium, sun, &vec![0.2; grid.len()])
}

/// A 64×64 fisheye at 81 wavelengths, under suns from high to 4° below the horizon.
fn hazy_fisheye(wanted: &Wanted) -> Result<()> {
    let grid = WavelengthGrid::range(380.0, 780.0, 5.0)?;
    let few: Vec<f64> = grid.nm().iter().copied().step_by(CLASSIC_STRIDE).collect();
    let few = WavelengthGrid::new(few)?;
    let (medium, medium_of_few) = (hazy_medium(&grid)?, hazy_medium(&few)?);
    let pixels = Pixels::new()?;
    let share = pixels.in_disc as f64 / pixels.chosen.len() as f64;
    let share_of_few = share * grid.len() as f64 / few.len() as f64;
    println!(
        "64x64 fisheye ({} of {} pixels rendered), Rayleigh + ozone + aerosol 0.2, {} wavelengths:",
        pixels.chosen.len(),
        pixels.in_disc,
        grid.len()
    );
    println!(
        "processor seconds of one core to 1 % noise, and how many times faster than classic\n"
    );
    println!("| sun zenith | method | seconds | × | µs per path | variance of a path / L² | median over mean |");
    println!("|---|---|---|---|---|---|---|");
    let (scalar, polarised) = (Path, PolarisedPath { stokes: false });
    // Paths per pixel: more where light is rare, so that the noise itself is known well.
    for (zenith_deg, path_spp, tracker_spp, classic_spp) in [
        (30.0, 16_384, 16_384, 8192),
        (60.0, 16_384, 16_384, 8192),
        (85.0, 16_384, 32_768, 16_384),
        (90.0, 16_384, 65_536, 16_384),
        (94.0, 65_536, 131_072, 32_768),
    ] {
        if !wanted.has(&zenith_deg.to_string(), &["30", "60", "85", "90", "94"]) {
            continue;
        }
        let scene = scene_under(&medium, &grid, zenith_deg)?;
        let scene_of_few = scene_under(&medium_of_few, &few, zenith_deg)?;
        let path_spp = wanted.number("spp").unwrap_or(path_spp);
        let mut truth: Option<Film> = None;
        let mut rows = Vec::new();
        for (name, integrator, spp) in [
            ("path", &scalar as &dyn Integrator<LayeredMedium>, path_spp),
            ("polarised", &polarised, path_spp),
            ("tracker", &Tracker, tracker_spp),
            ("classic", &Classic, classic_spp),
        ] {
            if !wanted.has(name, &METHODS) {
                continue;
            }
            let (scene, stride, share) = match name {
                "classic" => (&scene_of_few, CLASSIC_STRIDE, share_of_few),
                _ => (&scene, 1, share),
            };
            let work = (spp, wanted.number("orders"));
            let run = Run::new(integrator, scene, PLANET_RADIUS_M, &pixels, work)?;
            // The first method's radiance is what all are measured by; `path` where it runs.
            let (seconds, relative) = match &truth {
                None => (
                    run.seconds_to_target(&run.film, 1, share),
                    run.relative_variance(&run.film, 1),
                ),
                Some(film) => (
                    run.seconds_to_target(film, stride, share),
                    run.relative_variance(film, stride),
                ),
            };
            let paths = f64::from(spp) * pixels.chosen.len() as f64;
            rows.push((
                name,
                seconds,
                1e6 * run.work_s / paths,
                relative * f64::from(spp),
                run.median_over_mean(),
            ));
            truth.get_or_insert(run.film);
        }
        let classic_s = rows.iter().find(|r| r.0 == "classic").map(|r| r.1);
        for (name, seconds, us, relative, median) in rows {
            let times = classic_s.map_or("-".into(), |c| format!("{:.0}", c / seconds));
            println!("| {zenith_deg}° | {name} | {seconds:.1} | {times} | {us:.2} | {relative:.3} | {median:.2} |");
        }
    }
    println!();
    Ok(())
}

/// What polarised light costs `path` in real air, where particles have whole matrices: the time to a given error of the
/// radiance, and its two factors.
fn cost_of_polarisation() -> Result<()> {
    let overrides = Overrides {
        aerosol: Some("opac:continental-average".into()),
        ..Overrides::default()
    };
    let look = |i: u32| {
        let i = f64::from(i);
        Vec3::from_azimuth_elevation_deg(47.0 * i, 2.0 + 1.8 * i)
    };
    let looks = Looks((0..48).map(look).collect());
    println!(
        "OPAC continental average, 48 directions, 81 wavelengths: polarised over scalar path\n"
    );
    println!(
        "| sun zenith | carried | seconds, × | time, × | variance, × |\n|---|---|---|---|---|"
    );
    for elevation_deg in [30.0, 0.0] {
        let conditions = Conditions::from_sun(elevation_deg, 180.0, &overrides)?;
        let sky = Sky::new(
            conditions,
            &WavelengthGrid::default(),
            SolarSpectrum::default(),
        )?;
        let scene = Scene::new(&sky.medium, sky.sun.clone(), &sky.albedo)?;
        let ground_m = sky.medium.ground_radius_m();
        let run = |integrator: &dyn Integrator<LayeredMedium>| {
            Run::new(integrator, &scene, ground_m, &looks, (4096, None))
        };
        let scalar = run(&Path)?;
        for (name, stokes) in [("I, Q, U, V", true), ("I alone", false)] {
            let polarised = run(&PolarisedPath { stokes })?;
            let time = polarised.work_s / scalar.work_s;
            let own = |run: &Run| run.relative_variance(&run.film, 1);
            let variance = own(&polarised) / own(&scalar);
            println!(
                "| {}° | {name} | {:.2} | {time:.2} | {variance:.2} |",
                90.0 - elevation_deg,
                time * variance
            );
        }
    }
    println!();
    Ok(())
}

/// The peer scene, whose cost other codes state as `variance / L² × processor seconds`, per pixel and wavelength.
fn peer_scene() -> Result<()> {
    let grid = WavelengthGrid::range(380.0, 780.0, 5.0)?;
    let few: Vec<f64> = grid.nm().iter().copied().step_by(CLASSIC_STRIDE).collect();
    let looks = Looks(peer::axes(&peer::published("SO")).1);
    let values = (looks.0.len() * grid.len()) as f64;
    let medium = peer::medium(grid.nm());
    let scene = peer::scene(&medium, grid.nm(), 60.0);
    let radius_m = peer::PLANET_RADIUS_M;
    let path = Run::new(&Path, &scene, radius_m, &looks, (4096, None))?;
    let tracker = Run::new(&Tracker, &scene, radius_m, &looks, (16_384, None))?;
    let medium = peer::medium(&few);
    let scene = peer::scene(&medium, &few, 60.0);
    let classic = Run::new(&Classic, &scene, radius_m, &looks, (8192, None))?;
    println!(
        "Peer scene (Rayleigh, sun zenith 60 deg), {} directions, {} wavelengths: processor seconds × relative variance",
        looks.0.len(),
        grid.len()
    );
    println!("per pixel and wavelength, without the setup\n");
    println!("| method | figure of merit | setup s |\n|---|---|---|");
    let cases = [
        ("path", &path, 1),
        ("tracker", &tracker, 1),
        ("classic", &classic, CLASSIC_STRIDE),
    ];
    for (name, run, stride) in cases {
        let values = values / grid.len() as f64 * run.film.wavelength_nm.len() as f64;
        let merit = run.relative_variance(&path.film, stride) * run.work_s / values;
        println!("| {name} | {merit:.2e} | {:.3} |", run.setup_s);
    }
    Ok(())
}
