//! Whatever makes no sense is refused in plain words, with a hint, before any work is done, and nothing is written.

mod support;

use std::path::Path;

use support::{listing, run, stderr};

/// A sky whose rendering would take weeks: what is not refused beforehand makes a test hang.
const ENDLESS: [&str; 5] = ["render", "--size", "512", "--spp", "1000000000"];

/// Checks one refusal: exit code, what the error and the hint say, and that no file appears.
fn refused(args: &[&str], exit: i32, error: &str, hint: &str) {
    let folder = tempfile::tempdir().unwrap();
    refused_in(folder.path(), args, exit, error, hint);
    assert!(listing(folder.path()).is_empty(), "{args:?}");
}

fn refused_in(folder: &Path, args: &[&str], exit: i32, error: &str, hint: &str) {
    let output = run(folder, args);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(exit), "{args:?}: {text}");
    assert!(output.stdout.is_empty(), "{args:?}");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{args:?}: {text}");
    let said_error = lines[0].strip_prefix("error: ").unwrap_or_default();
    let said_hint = lines[1].strip_prefix("hint: ").unwrap_or_default();
    assert!(said_error.contains(error), "{args:?}: {text}");
    assert!(
        !said_hint.is_empty() && said_hint.contains(hint),
        "{args:?}: {text}"
    );
}

/// A refusal of options beside a good sun and a good file.
fn refused_beside_sun(args: &[&str], exit: i32, error: &str, hint: &str) {
    let mut all = ENDLESS.to_vec();
    all.extend(["--sun-elevation", "30", "-o", "sky.png"]);
    all.extend(args);
    refused(&all, exit, error, hint);
}

/// A refusal of a place and a time.
fn refused_place(at: &str, time: &str, error: &str, hint: &str) {
    let mut all = ENDLESS.to_vec();
    all.extend(["--at", at, "--time", time, "-o", "sky.png"]);
    refused(&all, 2, error, hint);
    refused(&["explain", "--at", at, "--time", time], 2, error, hint);
}

#[test]
fn places_and_times() {
    let noon = "2026-06-21T12:00Z";
    refused_place("91,0", noon, "latitude = 91 deg", "[-90, 90]");
    refused_place("-91,0", noon, "latitude = -91 deg", "[-90, 90]");
    refused_place("0,-400", noon, "longitude = -400 deg", "[-360, 360]");
    refused_place("nan,0", noon, "latitude = NaN", "[-90, 90]");
    refused_place("0,inf", noon, "longitude = inf", "[-360, 360]");
    refused_place("Zaragozza", noon, "no city 'Zaragozza'", "Zaragoza, Spain");
    refused_place("41.65", noon, "place '41.65'", "41.65,-0.88");
    let naive = "2026-06-21T18:30";
    refused_place("0,0", naive, "time zone", "2026-06-21T18:30Z");
    refused_place("0,0", "-0001-06-21T12:00Z", "year = -1", "[1900, 2100]");
    refused_place("0,0", "-1-06-21 sunset", "year = -1", "[1900, 2100]");
    refused_place("0,0", "1850-06-21T12:00Z", "year = 1850", "[1900, 2100]");
    refused_place(
        "0,0",
        "2026/06/21 12:00",
        "time '2026/06/21 12:00'",
        "2026-06-21T18:30Z",
    );
    refused_place(
        "Valencia",
        noon,
        "'Valencia' is ambiguous",
        "Valencia, Venezuela",
    );
    refused_place("Murmansk", "2026-06-21 sunset", "polar day", "another date");
    refused_place("-90,0", "2026-06-21 sunrise", "polar night", "another date");
    refused_place("0,0", "3000-06-21T12:00Z", "year = 3000", "[1900, 2100]");
    refused_place("0,0", "2026-02-30T12:00Z", "day = 30", "[1, 28]");
    refused_place("0,0", "teatime", "sun event 'teatime'", "civil dusk");
    refused(&["explain", "--at", "0,0"], 2, "no time", "--time");
    refused(&["explain", "--time", noon], 2, "no place", "--at");
    refused(&["explain"], 2, "neither", "--sun-elevation");
}

#[test]
fn numbers_out_of_range_and_not_numbers_at_all() {
    let cases = [
        ("--aod", "-1", "aod = -1", "[0, 10]"),
        ("--albedo", "1.2", "albedo = 1.2", "[0, 1]"),
        ("--albedo", "-0.1", "albedo = -0.1", "[0, 1]"),
        ("--ozone", "-5", "ozone = -5 DU", "[0, 1000]"),
        ("--humidity", "100", "humidity = 100 %", "[0, 99]"),
        ("--turbidity", "-1", "turbidity = -1", "[0, 100]"),
        ("--altitude", "20000", "altitude = 20000 m", "[-500, 9000]"),
        (
            "--sun-azimuth",
            "500",
            "sun azimuth = 500 deg",
            "[-360, 360]",
        ),
        (
            "--observer-altitude",
            "-1",
            "observer altitude = -1 m",
            "[0, 1000000000]",
        ),
        ("--fov", "0", "fov = 0 deg", "(0, 360]"),
        ("--spp", "0", "spp = 0", "[1, "),
        ("--threads", "5000", "threads = 5000", "[1, 1024]"),
        ("--exposure", "50", "exposure = 50 EV", "[-40, 40]"),
    ];
    for (option, value, error, hint) in cases {
        // --spp is given already: a second one would be refused for that.
        if option == "--spp" {
            let args = [
                "render",
                "--sun-elevation",
                "3",
                "-o",
                "a.png",
                option,
                value,
            ];
            refused(&args, 2, error, hint);
        } else {
            refused_beside_sun(&[option, value], 2, error, hint);
        }
    }
    let numbers = [
        "--aod",
        "--albedo",
        "--ozone",
        "--humidity",
        "--turbidity",
        "--altitude",
        "--sun-azimuth",
        "--observer-altitude",
        "--fov",
        "--exposure",
        "--wavelengths",
    ];
    for option in numbers {
        refused_beside_sun(&[option, "NaN"], 2, "= NaN", "]");
        refused_beside_sun(&[option, "inf"], 2, "= inf", "]");
    }
    let nan = ["explain", "--sun-elevation", "NaN"];
    refused(&nan, 2, "sun elevation = NaN", "[-90, 90]");
    let look = ["--projection", "perspective", "--look", "nan,0"];
    refused_beside_sun(&look, 2, "look azimuth = NaN", "[-360, 360]");
    let both = ["--ozone", "300", "--no-ozone"];
    refused_beside_sun(&both, 2, "no ozone is asked for", "one of the two");
}

#[test]
fn sizes() {
    refused_size("0x0", "size 0x0 has no pixels", "1x1");
    refused_size("5x0", "size 5x0 has no pixels", "1x1");
    // 10⁹ pixels of 2 · 81 values of 4 bytes and a count of 4: 607.2 GiB.
    refused_size("100000x10000", "607.2 GiB of memory", "fewer pixels");
    refused_size("18446744073709551615", "of memory", "fewer pixels");
    refused_size("-5", "'-5' is not understood", "512x512");
    refused_size("wide", "'wide' is not understood", "512x512");
}

fn refused_size(size: &str, error: &str, hint: &str) {
    let sky = [
        "render",
        "--sun-elevation",
        "30",
        "-o",
        "sky.png",
        "--size",
        size,
    ];
    refused(&sky, 2, error, hint);
    let latlong = [&sky[..], &["--projection", "latlong"]].concat();
    if !size.contains('x') {
        refused(&latlong, 2, error, hint);
    }
}

#[test]
fn views_that_contradict_themselves() {
    let latlong = [
        "render",
        "--sun-elevation",
        "3",
        "-o",
        "a.png",
        "--projection",
        "latlong",
    ];
    let square = [&latlong[..], &["--size", "64x64"]].concat();
    refused(&square, 2, "twice as wide", "1024x512");
    let cone = [&latlong[..], &["--fov", "90"]].concat();
    refused(&cone, 2, "--fov has no meaning", "leave it out");
    refused_beside_sun(
        &["--look", "0,10"],
        2,
        "--look has no meaning",
        "perspective",
    );
    let wide = ["--projection", "perspective", "--fov", "180"];
    refused_beside_sun(&wide, 2, "fov = 180", "(0, 180)");
    // Beside --spp, which all of these have.
    let noiseless = ["--method", "shells"];
    refused_beside_sun(&noiseless, 2, "--spp has no meaning", "--method path");
}

#[test]
fn unknown_names_list_the_known_ones_and_the_nearest() {
    let cases = [
        (
            "--aerosol",
            "dessert",
            "aerosol 'dessert'",
            "'desert'",
            "opac:urban",
        ),
        (
            "--aerosol",
            "opac:urbane",
            "opac:urbane",
            "'opac:urban'",
            "rural",
        ),
        ("--albedo", "snad", "albedo 'snad'", "'sand'", "glacier-ice"),
        ("--atmosphere", "us67", "'us67'", "'us76'", "tropical"),
        ("--ozone-climate", "sbuw", "'sbuw'", "'sbuv'", "arosa"),
        ("--sun-spectrum", "tsis", "'tsis'", "'tsis1'", "classic"),
        ("--projection", "fishye", "'fishye'", "'fisheye'", "latlong"),
        ("--method", "pahts", "'pahts'", "'path'", "classic"),
        ("--observer", "1965", "'1965'", "'1964'", "1931"),
        ("--tone", "gama", "'gama'", "'gamma'", "filmic"),
    ];
    for (option, name, error, nearest, another) in cases {
        refused_beside_sun(&[option, name], 2, error, nearest);
        refused_beside_sun(&[option, name], 2, error, another);
    }
    refused_beside_sun(&["--sun-disc", "of"], 2, "'of'", "");
    refused(&["list", "aerosol"], 2, "'aerosol'", "aerosols");
    refused(&["rendre"], 2, "'rendre'", "'render'");
    refused(&["render", "--albeod", "0.2"], 2, "--albeod", "--albedo");
    refused(&[], 2, "no command", "celaje --help");
    refused(&["render", "--aod", "much"], 2, "'much'", "and its unit");
    refused(&["render", "--aod", "much"], 2, "not a number", "COMMAND");
    refused(&["render", "--spp", "1.5"], 2, "whole number", "COMMAND");
}

#[test]
fn wavelengths() {
    let cases = [
        ("500,400", "must increase", "sort"),
        ("500,500", "must increase", "sort"),
        ("100,500", "wavelength = 100 nm", "[280, 2500]"),
        ("380:3000:5", "wavelength = 3000 nm", "[280, 2500]"),
        ("780:380:5", "run backwards", "START:STOP:STEP"),
        ("380:780:0", "wavelength step = 0 nm", "[0.25, 2500]"),
        ("380:780", "'380:780' are not understood", "380:780:5"),
        ("blue", "'blue' are not understood", "380:780:5"),
    ];
    for (text, error, hint) in cases {
        refused_beside_sun(&["--wavelengths", text], 2, error, hint);
    }
}

#[test]
fn files_are_checked_before_rendering() {
    let sky = [&ENDLESS[..], &["--sun-elevation", "30"]].concat();
    let with = |file: &'static str| [&sky[..], &["-o", file]].concat();
    refused(&sky, 2, "no file to write", "-o sky.png");
    refused(&with("sky.jpg"), 2, "'.jpg'", ".png, .exr, .hdr or .nc");
    refused(&with("sky"), 2, "no extension", ".png, .exr, .hdr or .nc");
    refused(
        &with("missing/sky.png"),
        1,
        "'missing' does not exist",
        "create the folder",
    );
    let twice = [&with("sky.png")[..], &["-o", "sky.png"]].concat();
    refused(&twice, 2, "given twice", "once");
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("dir.png")).unwrap();
    refused_in(
        folder.path(),
        &with("dir.png"),
        1,
        "is a folder",
        "name of a file",
    );
    assert_eq!(listing(folder.path()), ["dir.png"]);
}

/// A folder that nobody can write to, even the superuser of a container: the kernel's own.
#[cfg(target_os = "linux")]
#[test]
fn an_unwritable_folder_is_refused_before_rendering() {
    let sky = [&ENDLESS[..], &["--sun-elevation", "30"]].concat();
    let args = [&sky[..], &["-o", "/proc/self/sky.png"]].concat();
    refused(&args, 1, "/proc/self/sky.png", "folder");
}

#[test]
fn directions() {
    let folder = tempfile::tempdir().unwrap();
    let sky = ["radiance", "--sun-elevation", "30", "--spp", "1000000000"];
    let with = |text: &str| {
        std::fs::write(folder.path().join("d.csv"), text).unwrap();
        [&sky[..], &["--directions", "d.csv"]].concat()
    };
    let header = "azimuth_deg,elevation_deg\n";
    let cases = [
        (String::new(), "first line", "azimuth_deg,elevation_deg"),
        (
            "0,90\n".to_owned(),
            "first line",
            "azimuth_deg,elevation_deg",
        ),
        (header.to_owned(), "no direction", "at least one"),
        (format!("{header}0,91\n"), "elevation = 91 deg", "[-90, 90]"),
        (format!("{header}nan,9\n"), "azimuth = NaN", "[-360, 360]"),
        (
            format!("{header}x,9\n"),
            "line 2 does not hold two angles",
            "180,10",
        ),
        (
            format!("{header}0,9\n\n1\n"),
            "line 4 does not have the 2 fields",
            "as many fields",
        ),
        (
            format!("{header}0,9,7\n"),
            "line 2 does not have the 2 fields",
            "as many fields",
        ),
    ];
    for (text, error, hint) in cases {
        refused_in(folder.path(), &with(&text), 2, error, hint);
    }
    refused(&sky, 2, "no directions", "--directions");
    let missing = [&sky[..], &["--directions", "none.csv"]].concat();
    refused(&missing, 1, "none.csv", "exists");
}

#[test]
fn scenes() {
    let folder = tempfile::tempdir().unwrap();
    let check = |scene: &str, exit: i32, error: &str, hint: &str| {
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let args = [&ENDLESS[..], &["scene.toml", "-o", "a.png"]].concat();
        refused_in(folder.path(), &args, exit, error, hint);
    };
    check(
        "sun-elevation = 3\naersol = 'desert'",
        2,
        "'aersol'",
        "'aerosol'",
    );
    check("sun_elevation = 3", 2, "'sun_elevation'", "'sun-elevation'");
    check(
        "sun-elevation = 3\naod = 'much'",
        2,
        "scene.toml: invalid value 'much'",
        "",
    );
    check("sun-elevation = 3\naod = -1", 2, "aod = -1", "[0, 10]");
    check("sun-elevation = 3\naod = nan", 2, "aod = NaN", "[0, 10]");
    check(
        "sun-elevation = 3\n\naod 3",
        2,
        "scene.toml: line 3",
        "TOML",
    );
    check(
        "sun-elevation = 3\nno-ozone = 3",
        2,
        "neither true nor false",
        "true",
    );
    check("[air]\naod = 3", 2, "'air'", "known: ");
    let missing = [&ENDLESS[..], &["none.toml", "-o", "a.png"]].concat();
    refused_in(folder.path(), &missing, 1, "none.toml", "exists");
    assert_eq!(listing(folder.path()), ["scene.toml"]);
}

/// The air is checked as a sky is, and its files before any work.
#[test]
fn nonsense_air_and_files_of_the_air() {
    let beside = |more: &[&str], error: &str, hint: &str| {
        let mut all = vec!["atmosphere", "--sun-elevation", "30"];
        all.extend(more);
        refused(&all, 2, error, hint);
    };
    for (option, value, error, hint) in [
        ("--humidity", "99.5", "humidity = 99.5 %", "[0, 99]"),
        ("--humidity", "-1", "humidity = -1 %", "[0, 99]"),
        ("--humidity", "nan", "humidity = NaN %", "[0, 99]"),
        ("--aod", "-0.1", "aod = -0.1", "[0, 10]"),
        ("--turbidity", "-1", "turbidity = -1", "[0, 100]"),
        ("--visibility", "0", "visibility = 0 km", "[0.1, 400]"),
        ("--no2", "21", "no2 = 21 DU", "[0, 20]"),
        ("--water", "-1", "water = -1 mm", "[0, 200]"),
        ("--co2", "20000", "co2 = 20000 ppm", "[0, 10000]"),
        ("--aerosol", "dessert", "aerosol 'dessert'", "'desert'"),
        (
            "--stratosphere",
            "volcano",
            "stratosphere 'volcano'",
            "volcanic-fresh",
        ),
        ("--mesosphere", "snow", "mesosphere 'snow'", "dust-and-ice"),
        (
            "--wavelengths",
            "270,550",
            "wavelength = 270 nm",
            "[280, 2500]",
        ),
        (
            "--wavelengths",
            "550,2600",
            "wavelength = 2600 nm",
            "[280, 2500]",
        ),
        ("--wavelengths", "550,450", "increase", ""),
        ("-o", "air.png", "air.png", ".csv, .nc or .svg"),
        ("-o", "air", "air", ".csv, .nc or .svg"),
    ] {
        beside(&[option, value], error, hint);
    }
    beside(&["-o", "a.nc", "-o", "a.nc"], "given twice", "once");
    refused(
        &[
            "atmosphere",
            "--sun-elevation",
            "30",
            "-o",
            "missing/air.nc",
        ],
        1,
        "does not exist",
        "create the folder",
    );
    beside(
        &["--as-tabulated", "--aod", "0.1"],
        "given twice",
        "as tabulated",
    );
    // Clearer than clean air can be.
    beside(&["--visibility", "390"], "visibility = 390 km", "");
}
