//! Tables and films: `celaje bake`, `--tables`, `celaje film`.

mod support;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use support::{celaje, listing, run, run_well, stderr, stdout};

/// Bakes a small sky into `air.celaje`.
fn bake(folder: &Path) {
    let output = run_well(
        folder,
        &[
            "bake",
            "--aerosol=desert",
            "--aod=0.2",
            "--wavelengths=450,550,650",
            "--accuracy=preview",
            "--suns=-7:12",
            "-o",
            "air.celaje",
        ],
    );
    assert!(output.stdout.is_empty());
    let said = stderr(&output);
    assert!(said.contains("for suns from -7 to 12 degrees"), "{said}");
}

/// Every frame of an animation, as bytes.
fn frames(path: &Path) -> Vec<Vec<u8>> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path).unwrap()))
        .read_info()
        .unwrap();
    let count = reader.info().animation_control().unwrap().num_frames;
    let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
    (0..count)
        .map(|_| {
            reader.next_frame(&mut buffer).unwrap();
            buffer.clone()
        })
        .collect()
}

/// One file serves every command; what it holds cannot be asked for otherwise, and what it lacks is told.
#[test]
fn tables_serve_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    bake(path);
    let tables = "--tables=air.celaje";
    run_well(
        path,
        &[
            "render",
            tables,
            "--sun-elevation=-5",
            "--size=8",
            "-o",
            "a.png",
        ],
    );
    let finer = ["--accuracy=high", "--sun-elevation=5", "-o", "a.png"];
    let finer = run(path, &[&["render", tables], &finer[..]].concat());
    assert_eq!(finer.status.code(), Some(2));
    let told = stderr(&finer);
    assert!(told.contains("--accuracy is given beside"), "{told}");
    // The sun that the tables were baked with is taken where none is given: 45 degrees, beyond these tables.
    let high = run(path, &["render", tables, "--size=8", "-o", "a.png"]);
    assert_eq!(high.status.code(), Some(2));
    assert!(
        stderr(&high).contains("sun zenith angle"),
        "{}",
        stderr(&high)
    );

    std::fs::write(path.join("d.csv"), "azimuth_deg,elevation_deg\n90,20\n").unwrap();
    let seen = run_well(
        path,
        &[
            "radiance",
            tables,
            "--sun-elevation=5",
            "--directions=d.csv",
        ],
    );
    let line = stdout(&seen).lines().nth(1).unwrap().to_owned();
    let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
    assert!(
        values[2..5].iter().all(|&l| l > 0.0) && values[5..] == [0.0; 3],
        "{line}"
    );
    let level = run_well(path, &["irradiance", tables, "--sun-elevation=5"]);
    let facing = ["--tilt=85", "--tilt-azimuth=180"];
    let tilted = run_well(
        path,
        &[&["irradiance", tables, "--sun-elevation=5"], &facing[..]].concat(),
    );
    let direct = |output: &std::process::Output| -> Vec<f64> {
        let text = stdout(output);
        let line = text.lines().nth(1).unwrap();
        let cells = line.split(',').skip(1);
        cells.map(|v| v.parse().unwrap()).collect()
    };
    let (level, tilted) = (direct(&level), direct(&tilted));
    assert!((tilted[1] / tilted[0] - 1.0).abs() < 1e-3, "{tilted:?}");
    assert!(level[1] < 0.1 * tilted[1], "{level:?}");

    for (more, said) in [
        (&["--aod=0.3"][..], "--aod is given beside --tables"),
        (&["--wavelengths=500"], "are not those of the tables"),
        (&["--tilt=190"], "tilt = 190 deg is outside [0, 180]"),
        (&["--tilt-azimuth=90"], "but the plane is level"),
    ] {
        let args = [&["irradiance", tables, "--sun-elevation=5"], more].concat();
        let output = run(path, &args);
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(stderr(&output).contains(said), "{}", stderr(&output));
    }
}

/// Whatever is wrong with a file of tables ends in an error that says so, never in a sky.
#[test]
fn bad_tables_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    bake(path);
    let good = std::fs::read(path.join("air.celaje")).unwrap();
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 1;
    let mut later = good.clone();
    later[8] = 3;
    for (bytes, said) in [
        (&good[..good.len() - 9], "cut short"),
        (&flipped, "damaged"),
        (&later, "layout 3"),
        (b"a picture", "holds no tables"),
        (b"", "holds no tables"),
    ] {
        std::fs::write(path.join("bad.celaje"), bytes).unwrap();
        let output = run(path, &["render", "--tables=bad.celaje", "-o", "a.png"]);
        assert_eq!(output.status.code(), Some(1));
        let told = stderr(&output);
        assert!(told.contains("bad.celaje") && told.contains(said), "{told}");
        assert!(told.contains("\nhint: "), "{told}");
    }
    assert_eq!(listing(path), ["air.celaje", "bad.celaje"]);
    let missing = run(path, &["bake", "-o", "no/air.celaje"]);
    assert_eq!(missing.status.code(), Some(1));
    assert_eq!(run(path, &["bake"]).status.code(), Some(2));
    let suns = run(path, &["bake", "--suns=10:-5", "-o", "b.celaje"]);
    assert!(
        stderr(&suns).contains("suns run backwards, from 10 to -5 deg"),
        "{}",
        stderr(&suns)
    );
}

/// An animation has its frames, a pattern its files; the light goes down from frame to frame under a fixed exposure.
#[test]
fn a_film_is_an_animation_or_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    bake(path);
    let film = [
        "film",
        "--tables=air.celaje",
        "--sun-elevation=10",
        "--until=-6",
        "--frames=9",
        "--size=8",
    ];
    let fixed = ["--exposure=1", "-o", "dusk.png", "-o", "f%03d.exr"];
    let output = run_well(path, &[&film[..], &fixed].concat());
    assert!(
        stderr(&output).contains("filmed 9 of 9 frames"),
        "{}",
        stderr(&output)
    );
    let mut expected: Vec<String> = (1..=9).map(|k| format!("f{k:03}.exr")).collect();
    expected.extend(["air.celaje".into(), "dusk.png".into()]);
    expected.sort();
    assert_eq!(listing(path), expected);
    let sums = |frames: &[Vec<u8>]| -> Vec<f64> {
        let sum = |f: &Vec<u8>| f.iter().map(|&b| f64::from(b)).sum();
        frames.iter().map(sum).collect()
    };
    let fixed = sums(&frames(&path.join("dusk.png")));
    assert_eq!(fixed.len(), 9);
    assert!(fixed.windows(2).all(|w| w[1] < w[0]), "{fixed:?}");
    // An exposure that follows the light keeps the picture visible to the end.
    run_well(path, &[&film[..], &["-o", "auto.png"]].concat());
    let auto = sums(&frames(&path.join("auto.png")));
    assert!(auto[8] > 0.5 * auto[0], "{auto:?}");

    for (args, said) in [
        (
            &["--until=-6", "-o", "a.exr"][..],
            "cannot hold many frames",
        ),
        (&["--until=-6"], "no file to write"),
        (&["-o", "a.png"], "no end of the film"),
        (&["--until=dusk", "-o", "a.png"], "is not an elevation"),
        (&["--until=-6", "--frames=1", "-o", "a.png"], "frames = 1"),
        (&["--until=-6", "--spp=4", "-o", "a.png"], "shells alone"),
    ] {
        let output = run(path, &[&["film", "--sun-elevation=10"], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains(said), "{}", stderr(&output));
    }
    let place = ["film", "--at=Zaragoza", "--time=2026-06-21T18:30Z"];
    let backwards = run(
        path,
        &[&place[..], &["--until=noon", "-o", "a.png"]].concat(),
    );
    assert!(
        stderr(&backwards).contains("before it begins"),
        "{}",
        stderr(&backwards)
    );
}

/// Ctrl-C in the middle leaves an animation of the frames that were done, and exit code 130.
#[cfg(unix)]
#[test]
fn an_interrupted_film_keeps_its_frames() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    bake(path);
    let args = [
        "film",
        "--tables=air.celaje",
        "--sun-elevation=10",
        "--until=-6",
        "--frames=20000",
        "--size=16",
        "--exposure=1",
    ];
    let files = ["-o", "dusk.png", "-o", "f%05d.png"];
    let child = celaje(path)
        .args(args)
        .args(files)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !path.join("f00005.png").exists() {
        assert!(start.elapsed() < Duration::from_secs(120));
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(Command::new("kill")
        .args(["-INT", &pid])
        .status()
        .unwrap()
        .success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let kept = frames(&path.join("dusk.png")).len();
    let pictures = listing(path).iter().filter(|n| n.starts_with('f')).count();
    assert!(
        (5..20_000).contains(&kept) && kept.abs_diff(pictures) <= 1,
        "{kept} {pictures}"
    );
    assert!(listing(path).iter().all(|n| !n.ends_with(".tmp")));
}

/// The error bar of a picture is told and kept; it belongs to shells alone.
#[test]
fn a_picture_can_be_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let sky = [
        "render",
        "--sun-elevation=40",
        "--wavelengths=450,550,650",
        "--size=16",
    ];
    let output = run_well(path, &[&sky[..], &["--check", "-o", "a.png"]].concat());
    let said = stderr(&output);
    let line = said
        .lines()
        .find(|l| l.starts_with("shells over path"))
        .unwrap();
    let number = |after: &str| -> f64 {
        let rest = &line[line.find(after).unwrap() + after.len()..];
        rest.split_whitespace().next().unwrap().parse().unwrap()
    };
    // By day the solver is within a per cent; the comparison is no echo of itself.
    assert!(
        number("mean ").abs() < 1.0 && number("rms ") < 2.0,
        "{line}"
    );
    assert!(number("worst ") != 0.0, "{line}");
    let reader = png::Decoder::new(BufReader::new(File::open(path.join("a.png")).unwrap()))
        .read_info()
        .unwrap();
    let kept = &reader.info().utf8_text;
    assert!(kept.iter().any(|t| t.keyword == "check_mean"), "{kept:?}");
    for (more, said) in [
        (&["--check", "--spp=4"][..], "leave --check out"),
        (&["--correct", "--method=path"], "leave --correct out"),
        (&["--correct", "--sun-disc=only"], "which is exact"),
    ] {
        let other = run(path, &[&sky[..], more, &["-o", "b.png"]].concat());
        assert_eq!(other.status.code(), Some(2), "{more:?}");
        assert!(stderr(&other).contains(said), "{}", stderr(&other));
    }
}

/// A correction is told before and after, and kept in the file.
#[test]
fn a_picture_can_be_corrected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let sky = [
        "render",
        "--sun-elevation=10",
        "--wavelengths=450,650",
        "--accuracy=preview",
        "--size=16",
        "--correct",
        "-o",
        "a.png",
    ];
    let said = stderr(&run_well(path, &sky));
    let before = said.lines().find(|l| l.starts_with("shells over path"));
    assert!(before.unwrap().contains("32768 paths"), "{said}");
    let after = said.lines().find(|l| l.starts_with("corrected by"));
    assert!(after.unwrap().contains("the smooth part"), "{said}");
    assert!(after.unwrap().contains("; rms 0."), "{said}");
    let reader = png::Decoder::new(BufReader::new(File::open(path.join("a.png")).unwrap()))
        .read_info()
        .unwrap();
    let kept = &reader.info().utf8_text;
    for name in ["check_rms", "corrected_by", "corrected_rms"] {
        assert!(kept.iter().any(|t| t.keyword == name), "{name}: {kept:?}");
    }
}
