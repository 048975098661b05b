//! Rendering until there is enough: noise, time, checkpoints, and films put together.

mod support;

use std::fs;
use std::path::Path;
use std::process::Output;

use celaje::image::read_exr;
use support::{celaje, listing};

/// A small sky with some haze, by paths.
const SKY: [&str; 8] = [
    "--sun-elevation",
    "20",
    "--wavelengths",
    "450,600",
    "--sun-disc",
    "off",
    "--size",
    "12",
];

fn run(folder: &Path, command: &str, args: &[&[&str]]) -> Output {
    celaje(folder)
        .arg(command)
        .args(args.concat())
        .output()
        .unwrap()
}

fn good(folder: &Path, command: &str, args: &[&[&str]]) -> String {
    let output = run(folder, command, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    said
}

fn bad(folder: &Path, command: &str, args: &[&[&str]], exit: i32, word: &str) {
    let output = run(folder, command, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(exit), "{said}");
    assert!(
        said.contains(word) && said.contains("\nhint: "),
        "{word}: {said}"
    );
}

#[test]
fn noise_is_reached_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let said = good(
        folder.path(),
        "render",
        &[&SKY, &["--noise", "5%", "-o", "a.exr"]],
    );
    assert!(
        said.contains("on average ") && said.contains("noisiest"),
        "{said}"
    );
    let (film, metadata) = read_exr(&folder.path().join("a.exr")).unwrap();
    assert!(film.noise().unwrap() <= 0.05, "{:?}", film.noise());
    let find = |name: &str| &metadata.iter().find(|(n, _)| n == name).unwrap().1;
    assert_eq!(find("noise"), "0.05");
    assert!(find("spp").parse::<u32>().unwrap() >= 64);

    let most = ["--noise", "0.01%", "--spp", "64", "-o", "b.exr"];
    let said = good(folder.path(), "render", &[&SKY, &most]);
    assert!(
        said.contains("note: ") && said.contains("0.01 % was asked for"),
        "{said}"
    );
}

/// The disc is a thousandth of so wide a pixel, and brighter than the rest of the picture: it is reached all the same, high and on
/// the horizon, where the rim of the picture cuts it.
#[test]
fn noise_is_reached_with_the_disc() {
    let folder = tempfile::tempdir().unwrap();
    for elevation in ["20", "0.1"] {
        let words = [
            "--sun-elevation",
            elevation,
            "--sun-disc",
            "on",
            "--noise",
            "5%",
            "--spp",
            "16384",
            "-o",
            "a.exr",
        ];
        good(folder.path(), "render", &[&SKY[2..4], &SKY[6..], &words]);
        let (film, _) = read_exr(&folder.path().join("a.exr")).unwrap();
        assert!(film.noise().unwrap() <= 0.05, "{:?}", film.noise());
    }
}

#[test]
fn time_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let said = good(
        folder.path(),
        "render",
        &[&SKY, &["--time-limit", "1s", "-o", "a.png"]],
    );
    assert!(said.contains("on average "), "{said}");
}

/// Two halves of the paths by two seeds are merged to a film with all of them, whose variance is half of each.
#[test]
fn films_of_two_seeds_are_merged() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (seed, name) in [("1", "a.exr"), ("2", "b.exr")] {
        good(
            folder.path(),
            "render",
            &[&SKY, &["--spp", "64", "--seed", seed, "-o", name]],
        );
    }
    let said = good(
        folder.path(),
        "merge",
        &[&["a.exr", "b.exr", "-o", "c.exr", "-o", "c.png"]],
    );
    assert!(
        said.starts_with("merged 2 pictures; 128 paths per pixel"),
        "{said}"
    );
    let [(a, _), (b, _), (c, metadata)] =
        ["a.exr", "b.exr", "c.exr"].map(|n| read_exr(&at(n)).unwrap());
    for i in 0..c.radiance.len() {
        let (n, m) = (a.samples[i / 2] as f32, b.samples[i / 2] as f32);
        let mean = (n * a.radiance[i] + m * b.radiance[i]) / (n + m).max(1.0);
        assert!((c.radiance[i] - mean).abs() <= 1e-6 * mean);
    }
    assert!(metadata.contains(&("seed".to_owned(), "1,2".to_owned())));

    // The same noise twice, another sky, no noise, and what is no film.
    bad(
        folder.path(),
        "merge",
        &[&["a.exr", "c.exr", "-o", "d.exr"]],
        2,
        "the seed 1",
    );
    let other = ["--aod", "0.3", "--spp", "8", "--seed", "3", "-o", "o.exr"];
    good(folder.path(), "render", &[&SKY, &other]);
    bad(
        folder.path(),
        "merge",
        &[&["a.exr", "o.exr", "-o", "d.exr"]],
        2,
        "aod_550",
    );
    bad(
        folder.path(),
        "merge",
        &[&["a.exr", "c.png", "-o", "d.exr"]],
        1,
        "c.png",
    );
    bad(
        folder.path(),
        "merge",
        &[&["a.exr", "none.exr", "-o", "d.exr"]],
        1,
        "none.exr",
    );
    bad(
        folder.path(),
        "merge",
        &[&["a.exr", "-o", "d.exr"]],
        2,
        "1 film",
    );
    assert!(!at("d.exr").exists());
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (words, word) in [
        (&["--noise", "0"][..], "noise = 0"),
        (&["--noise", "much"], "'much'"),
        (&["--time-limit", "soon"], "'soon'"),
        (&["--noise", "1%", "--method", "shells"], "shells"),
        (&["--checkpoint", "a.part"], "shells"),
        (&["--spp", "4", "--checkpoint", "a.exr"], "a.exr"),
        (
            &["--time-limit", "5s", "--checkpoint", "a.part"],
            "--time-limit",
        ),
    ] {
        bad(
            folder.path(),
            "render",
            &[&SKY, &["-o", "a.exr"], words],
            2,
            word,
        );
    }
    let nowhere = ["--spp", "4", "--checkpoint", "nowhere/a.part"];
    bad(
        folder.path(),
        "render",
        &[&SKY, &["-o", "a.exr"], &nowhere],
        1,
        "nowhere",
    );
    assert!(listing(folder.path()).is_empty());
}

/// Interrupted as soon as something is kept, gone on with, and the same to the last bit; then the checkpoint is gone.
#[cfg(unix)]
#[test]
fn an_interrupted_rendering_goes_on() {
    use std::process::{Command, Stdio};
    use std::time::Duration;

    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let sky = [
        &SKY[..6],
        &["--size", "24", "--spp", "2048", "--threads", "1"],
    ]
    .concat();
    good(folder.path(), "render", &[&sky, &["-o", "whole.exr"]]);
    let kept = ["-o", "kept.exr", "--checkpoint", "a.part"];
    let mut child = celaje(folder.path())
        .arg("render")
        .args([&sky[..], &kept].concat())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !at("a.part").exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(2));
    }
    let pid = child.id().to_string();
    Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(listing(folder.path()), ["a.part", "whole.exr"]);

    // Another sky, and a damaged file, are refused; the file stays.
    let other = [&sky[..], &["--aod", "0.3"], &kept].concat();
    bad(folder.path(), "render", &[&other], 1, "aod_550");
    let whole = fs::read(at("a.part")).unwrap();
    fs::write(at("a.part"), &whole[..whole.len() - 3]).unwrap();
    bad(folder.path(), "render", &[&sky, &kept], 1, "damaged");
    fs::write(at("a.part"), &whole).unwrap();

    let said = good(folder.path(), "render", &[&sky, &kept]);
    assert!(said.contains("note: going on from a.part"), "{said}");
    assert_eq!(listing(folder.path()), ["kept.exr", "whole.exr"]);
    let [(kept, _), (whole, _)] = ["kept.exr", "whole.exr"].map(|n| read_exr(&at(n)).unwrap());
    assert_eq!(kept, whole);
}
