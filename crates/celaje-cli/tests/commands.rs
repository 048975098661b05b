//! What each command gives when all is well.

mod support;

use std::io::Write;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use exr::prelude::{
    read_first_flat_layer_from_file, AnyChannels, FlatImage, FlatSamples, Image, Layer,
};
use support::{celaje, listing, run, run_well, stderr, stdout};

/// A small quick sky.
const SMALL: [&str; 8] = [
    "render",
    "--size",
    "16",
    "--spp",
    "2",
    "--wavelengths",
    "450,550,650",
    "--seed=7",
];

fn small_with<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], more].concat()
}

type Exr = Image<Layer<AnyChannels<FlatSamples>>>;

fn exr(path: &Path) -> Exr {
    read_first_flat_layer_from_file(path).unwrap()
}

fn attribute(image: &Exr, name: &str) -> String {
    let attributes = &image.layer_data.attributes.other;
    let found = attributes.iter().find(|(key, _)| **key == *name);
    format!("{:?}", found.unwrap_or_else(|| panic!("{name}")).1)
}

#[test]
fn pictures_of_every_format_say_how_they_came_about() {
    let folder = tempfile::tempdir().unwrap();
    let place = ["--at", "-33.4,-70.6", "--time", "2026-06-21T12:30-04:00"];
    let files = ["-o", "a.png", "-o", "a.exr", "-o", "a.hdr", "-o", "a.nc"];
    let output = run_well(
        folder.path(),
        &small_with(&[&place[..], &files[..], &["--exposure", "-2"]].concat()),
    );
    assert_eq!(listing(folder.path()), ["a.exr", "a.hdr", "a.nc", "a.png"]);
    assert!(output.stdout.is_empty());
    let said = stderr(&output);
    assert!(said.contains("16x16 pixels, 3 wavelengths in "), "{said}");
    assert!(
        said.contains("2 paths per pixel, mean relative standard error"),
        "{said}"
    );

    let image = exr(&folder.path().join("a.exr"));
    let channels = &image.layer_data.channel_data.list;
    assert_eq!(channels.len(), 4 + 2 * 3);
    let green = channels.iter().find(|c| c.name == *"S0.550,000000nm");
    let values: Vec<f32> = green.unwrap().sample_data.values_as_f32().collect();
    assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0));
    // The circle of the view touches 224 pixels; two paths through thin air may meet nothing in some of them.
    let lit = values.iter().filter(|v| **v > 0.0).count();
    assert!((100..=224).contains(&lit), "{lit}");
    assert_eq!(values[0], 0.0, "the corner is outside the disc");
    for (name, value) in [
        ("latitude_deg", "-33.4"),
        ("time", "2026-06-21T16:30:00Z"),
        ("atmosphere", "climate"),
        ("ozone_du.reason", "SBUV"),
        ("refraction", "none"),
        ("seed", "7"),
        ("spp", "2"),
        ("method", "path"),
        ("max_order", "all"),
        ("projection", "fisheye"),
        ("north", "up; east is left"),
        ("sun_spectrum", "tsis1"),
        ("version", env!("CARGO_PKG_VERSION")),
    ] {
        let said = attribute(&image, &format!("celaje.{name}"));
        assert!(said.contains(value), "{name}: {said}");
    }

    let decoder = png::Decoder::new(std::io::BufReader::new(
        std::fs::File::open(folder.path().join("a.png")).unwrap(),
    ));
    let reader = decoder.read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (16, 16));
    let hdr = std::fs::read(folder.path().join("a.hdr")).unwrap();
    assert!(hdr.starts_with(b"#?RADIANCE\n"));
    assert!(String::from_utf8_lossy(&hdr).contains("celaje.seed=7\n"));
    let nc = std::fs::read(folder.path().join("a.nc")).unwrap();
    assert!(nc.starts_with(b"CDF\x02"));
    // What it holds is read back by the Python tests.
    let header = String::from_utf8_lossy(&nc).into_owned();
    for word in [
        "downwelling_radiance_per_unit_wavelength_in_air",
        "radiation_wavelength",
        "solar_zenith_angle",
        "radiance_variance",
        "ozone_du_reason",
    ] {
        assert!(header.contains(word), "{word}");
    }
}

#[test]
fn every_projection_and_method_renders() {
    let folder = tempfile::tempdir().unwrap();
    let sun = ["--sun-elevation", "-4", "-o", "a.exr"];
    let view = ["render", "--spp", "1", "--wavelengths", "450,550"];
    for (more, size) in [
        (&["--projection", "latlong", "--size", "8"][..], (16, 8)),
        (
            &[
                "--projection",
                "perspective",
                "--size",
                "8x6",
                "--look",
                "-90,-5",
            ],
            (8, 6),
        ),
        (
            &[
                "--size",
                "8",
                "--fov",
                "345",
                "--observer-altitude",
                "11000",
            ],
            (8, 8),
        ),
        (
            &["--size", "8", "--method", "tracker", "--max-order", "1"],
            (8, 8),
        ),
        (&["--size", "4", "--method", "classic"], (4, 4)),
        (&["--size", "8", "--sun-disc", "only", "--no-ozone"], (8, 8)),
    ] {
        run_well(folder.path(), &[&view[..], &sun, more].concat());
        let size_made = exr(&folder.path().join("a.exr")).layer_data.size;
        assert_eq!((size_made.x(), size_made.y()), size);
    }
}

#[test]
fn the_same_seed_gives_the_same_pixels_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = |threads: &str, seed: &str| -> FlatImage {
        let args = ["--sun-elevation", "20", "-o", "a.exr", "--threads", threads];
        let mut all: Vec<&str> = small_with(&args);
        all.retain(|a| *a != "--seed=7");
        run_well(folder.path(), &[&all[..], &["--seed", seed]].concat());
        exr::prelude::read_all_flat_layers_from_file(folder.path().join("a.exr")).unwrap()
    };
    let one = pixels("1", "7");
    assert_eq!(one.layer_data, pixels("3", "7").layer_data);
    assert_ne!(one.layer_data, pixels("3", "8").layer_data);
}

#[test]
fn a_scene_says_the_same_as_options_and_options_win() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("scene.toml"),
        "at = [41.65, -0.88]\ntime = 2026-06-21T18:30:00Z\naerosol = 'desert'\naod = 0.3\nsize = 16\nspp = 2\n\
         wavelengths = [450, 550, 650]\nseed = 7\noutput = ['s.exr', 's.png']\n",
    )
    .unwrap();
    run_well(folder.path(), &["render", "scene.toml"]);
    let place = ["--at", "41.65,-0.88", "--time", "2026-06-21T18:30Z"];
    let air = ["--aerosol", "desert", "--aod", "0.3", "-o", "o.exr"];
    run_well(folder.path(), &small_with(&[&place[..], &air].concat()));
    let read = |name: &str| exr(&folder.path().join(name)).layer_data;
    assert_eq!(read("s.exr"), read("o.exr"));
    assert_eq!(
        listing(folder.path()),
        ["o.exr", "s.exr", "s.png", "scene.toml"]
    );

    let hazier = run_well(folder.path(), &["explain", "scene.toml", "--aod", "0.5"]);
    let line = |name: &str| {
        let text = stdout(&hazier);
        let line = text.lines().find(|l| l.starts_with(name));
        line.unwrap_or_default().to_owned()
    };
    assert!(line("aod_550").contains(" 0.5 "), "{}", line("aod_550"));
    assert!(line("aerosol").contains(" desert "));
}

#[test]
fn explain_tells_every_condition_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    let place = [
        "explain",
        "--at",
        "41.65,-0.88",
        "--time",
        "2026-06-21T18:30Z",
    ];
    let text = stdout(&run_well(folder.path(), &place));
    let names = [
        "latitude_deg",
        "longitude_deg",
        "time",
        "local_time",
        "altitude_m",
        "sun_elevation_deg",
        "sun_azimuth_deg",
        "sun_distance_au",
        "atmosphere",
        "ozone_du",
        "no2_du",
        "water_mm",
        "co2_ppm",
        "aerosol",
        "aerosol_type",
        "aod_550",
        "stratosphere",
        "mesosphere",
        "humidity_percent",
        "albedo",
        "moon_elevation_deg",
        "moon_azimuth_deg",
        "moon_distance_km",
        "moon_phase_deg",
        "moon_illuminated",
        "astronomical_dawn",
        "nautical_dawn",
        "civil_dawn",
        "sunrise",
        "noon",
        "sunset",
        "civil_dusk",
        "nautical_dusk",
        "astronomical_dusk",
        "refraction",
    ];
    assert_eq!(text.lines().count(), 1 + names.len());
    // Reasons begin in one column.
    let column = text.lines().next().unwrap().find("REASON").unwrap();
    for (line, name) in text.lines().skip(1).zip(names) {
        assert!(line.starts_with(name), "{line}");
        let reason: String = line.chars().skip(column).collect();
        assert!(!reason.starts_with(' ') && reason.contains(" ["), "{line}");
    }
    assert!(
        text.contains("0.5° higher"),
        "refraction is said to be neglected"
    );

    let json = stdout(&run_well(
        folder.path(),
        &[&place[..], &["--json"]].concat(),
    ));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let object = json.as_object().unwrap();
    // Every row is a condition; what the climate found behind them stands beside them.
    assert_eq!(object.len(), names.len() + 1);
    for part in ["atmosphere_blend", "aerosol_mixture", "ground"] {
        assert!(!json["details"][part].is_null(), "{part}");
    }
    assert!(json["ozone_du"]["uncertainty"].as_f64().unwrap() > 1.0);
    for name in names {
        let condition = &object[name];
        for part in ["value", "unit", "source", "reason"] {
            assert!(!condition[part].is_null(), "{name} {part}");
        }
    }
    assert_eq!(json["time"]["value"], "2026-06-21T18:30:00Z");
    assert!((json["sun_elevation_deg"]["value"].as_f64().unwrap() - 11.0016).abs() < 1e-3);

    // Polar day: what does not happen has no value, and a reason.
    let polar = ["--at", "Murmansk", "--time", "2026-06-21T12:00Z", "--json"];
    let polar = stdout(&run_well(
        folder.path(),
        &[&["explain"], &polar[..]].concat(),
    ));
    let polar: serde_json::Value = serde_json::from_str(&polar).unwrap();
    assert!(polar["sunset"]["value"].is_null());
    assert!(polar["sunset"]["reason"]
        .as_str()
        .unwrap()
        .contains("polar day"));
    assert_eq!(polar["latitude_deg"]["reason"], "of Murmansk, Russia");

    let night = run_well(folder.path(), &["explain", "--sun-elevation", "-30"]);
    assert!(stderr(&night).starts_with("note: "), "{}", stderr(&night));
}

/// Two directions through a pipe; the second column of errors belongs to the second wavelength, and the disc of the
/// sun outshines the sky.
#[test]
fn radiance_adds_its_columns() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = celaje(folder.path())
        .args(["radiance", "--sun-elevation", "30", "--spp", "16"])
        .args(["--wavelengths", "450,550.5", "--directions", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let text = b"azimuth_deg,elevation_deg,name\n0,90,zenith\n180,30,sun\n";
    child.stdin.take().unwrap().write_all(text).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let text = stdout(&output);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "azimuth_deg,elevation_deg,name,radiance_450nm,radiance_550.5nm,se_450nm,se_550.5nm"
    );
    assert_eq!(lines.len(), 3);
    let numbers = |line: &str| -> Vec<f64> {
        let fields = line.split(',').skip(3);
        fields.map(|f| f.parse().unwrap()).collect()
    };
    let (zenith, sun) = (numbers(lines[1]), numbers(lines[2]));
    assert!(lines[1].starts_with("0,90,zenith,") && zenith.len() == 4);
    assert!(zenith.iter().all(|v| *v > 0.0) && zenith[2] < zenith[0]);
    assert!(sun[0] > 1e3 * zenith[0]);
}

/// One line per wavelength, sums before them; at 1e6 m there is nothing but the sun: 1.9 W m⁻² nm⁻¹ near 550 nm.
#[test]
fn irradiance_is_a_table_with_sums() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["irradiance", "--sun-elevation", "30", "--spp", "4"];
    let space = ["--observer-altitude", "1e6", "--wavelengths", "540:560:10"];
    let text = stdout(&run_well(folder.path(), &[&args[..], &space].concat()));
    let data: Vec<&str> = text.lines().filter(|l| !l.starts_with('#')).collect();
    assert_eq!(
        data[0],
        "wavelength_nm,direct_normal,direct,diffuse,global,se_direct_normal,se_direct,se_diffuse,se_global"
    );
    assert_eq!(data.len(), 4);
    let row: Vec<f64> = data[2].split(',').map(|f| f.parse().unwrap()).collect();
    assert_eq!(row[0], 550.0);
    assert!((row[1] / 1.88 - 1.0).abs() < 0.02, "{row:?}");
    assert!((row[2] / row[1] - 0.5).abs() < 1e-3 && row[3] == 0.0 && row[4] == row[2]);
    let sums: Vec<&str> = text.lines().filter(|l| l.starts_with("# ")).collect();
    assert_eq!(sums.len(), 4);
    assert!(sums[1].starts_with("# W m-2,5.6"), "{}", sums[1]);
    // One wavelength says nothing of what the eye sees.
    let one = [&args[..], &["--wavelengths", "550"]].concat();
    let text = stdout(&run_well(folder.path(), &one));
    for line in ["# lx,none,none,none,none", "# cct K,none,none,none,none"] {
        assert!(text.lines().any(|l| l == line), "{text}");
    }
}

#[test]
fn lists_have_a_meaning_on_every_line() {
    let folder = tempfile::tempdir().unwrap();
    for (what, first) in [
        ("aerosols", "antarctic"),
        ("albedos", "dark-wet-soil"),
        ("suns", "tsis1"),
        ("atmospheres", "us76"),
        ("ozone-climates", "sbuv"),
        ("projections", "fisheye"),
        ("methods", "shells"),
        ("observers", "1964"),
        ("tones", "gamma"),
    ] {
        let text = stdout(&run_well(folder.path(), &["list", what]));
        assert!(text.starts_with(&format!("{first} ")), "{text}");
        for line in text.lines() {
            let meaning = line
                .split_once("  ")
                .map_or("", |(_, meaning)| meaning.trim());
            assert!(!meaning.is_empty(), "{line}");
        }
    }
}

#[test]
fn progress_is_silent_off_a_terminal_unless_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let sky = small_with(&["--sun-elevation", "20", "-o", "a.png"]);
    let lines = |more: &[&str]| {
        let output = run_well(folder.path(), &[&sky[..], more].concat());
        stderr(&output).lines().count()
    };
    assert_eq!(lines(&[]), 2, "a note on the colours, and the summary");
    assert_eq!(lines(&["--progress", "off"]), 2);
    let long = [
        "render",
        "--sun-elevation",
        "20",
        "-o",
        "a.png",
        "--progress",
        "on",
    ];
    let long = [&long[..], &["--size", "128", "--spp", "256"]].concat();
    let output = run_well(folder.path(), &long);
    assert!(stderr(&output).contains("s left\n"), "{}", stderr(&output));
}

/// Helps are texts; the stated limit is 50 ms, to which an occupied machine may add its own.
#[test]
fn help_is_quick_and_complete() {
    let folder = tempfile::tempdir().unwrap();
    let mut quickest_ms = u128::MAX;
    for _ in 0..5 {
        let start = Instant::now();
        run_well(folder.path(), &["--help"]);
        quickest_ms = quickest_ms.min(start.elapsed().as_millis());
    }
    assert!(quickest_ms < 50, "{quickest_ms} ms");
    let help = stdout(&run_well(folder.path(), &["render", "--help"]));
    for heading in [
        "Where and when:",
        "Air, ground and sunlight:",
        "View:",
        "Method:",
        "Colour:",
    ] {
        assert!(help.contains(heading), "{heading}");
    }
    // What a command refuses is not among its options.
    for (command, refused) in [("film", "--spp <"), ("irradiance", "--noise <")] {
        let help = stdout(&run_well(folder.path(), &[command, "--help"]));
        assert!(!help.contains(refused), "{command}: {help}");
    }
    let version = stdout(&run_well(folder.path(), &["--version"]));
    assert_eq!(version, format!("celaje {}\n", env!("CARGO_PKG_VERSION")));
}

/// Like `celaje list aerosols | head -1`: a reader who leaves is no error and no panic.
#[test]
fn a_closed_pipe_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let status = celaje(folder.path())
        .args(["list", "aerosols"])
        .stdout(writer)
        .stderr(Stdio::null())
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(0));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_stdout_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    let output = celaje(folder.path())
        .args(["list", "aerosols"])
        .stdout(full.unwrap())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).starts_with("error: standard output: "));
    assert!(run(folder.path(), &["list", "suns"]).status.success());
}

/// What the air is made of: tables for people, JSON for programs, files of all three kinds.
#[test]
fn atmosphere_tells_what_the_air_is_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let words = [
        "atmosphere",
        "--sun-elevation",
        "30",
        "--aerosol",
        "rural",
        "--aod",
        "0.3",
    ];
    let files = ["-o", "air.svg", "-o", "air.nc", "-o", "air.csv"];
    let output = run_well(folder.path(), &[&words[..], &files[..]].concat());
    let text = stdout(&output);
    assert!(stderr(&output).is_empty());
    assert_eq!(listing(folder.path()), ["air.csv", "air.nc", "air.svg"]);
    let tables: Vec<&str> = text.split("\n\n").collect();
    assert_eq!(tables.len(), 3, "{text}");
    let header: Vec<&str> = tables[0]
        .lines()
        .nth(1)
        .unwrap()
        .split_whitespace()
        .collect();
    assert_eq!(header[..3], ["nm", "air", "ozone"]);
    assert!(tables[0].contains("troposphere") && tables[0].contains("stratosphere"));
    // Nothing of what is not there.
    assert!(!tables[0].contains("nitrogen"));
    let at_580 = tables[1]
        .lines()
        .find(|l| l.trim().starts_with("580"))
        .unwrap();
    let cells: Vec<f64> = at_580
        .split_whitespace()
        .map(|c| c.parse().unwrap())
        .collect();
    assert!(
        (cells[1] - 0.29).abs() < 0.02 && (cells[2] - 0.90).abs() < 0.01,
        "{at_580}"
    );
    let heights = tables[2]
        .lines()
        .skip(2)
        .map(|l| l.split_whitespace().next().unwrap());
    let km: Vec<f64> = heights.map(|c| c.parse().unwrap()).collect();
    assert!(km[0] == 0.0 && km.windows(2).all(|z| z[0] < z[1]), "{km:?}");
    for (file, start) in [
        ("air.svg", "<svg"),
        ("air.csv", "# altitude_m: 0\n"),
        ("air.nc", "CDF"),
    ] {
        let bytes = std::fs::read(folder.path().join(file)).unwrap();
        assert!(bytes.starts_with(start.as_bytes()), "{file}");
    }

    let json = ["--json", "--wavelengths", "440,550,870", "--no2", "0.5"];
    let output = run_well(folder.path(), &[&words[..], &json[..]].concat());
    let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let depth = value["aerosol"]["optical_depth"][1].as_f64().unwrap();
    // The optical depth that was asked for is the troposphere's; 0.005 of stratosphere comes on top.
    assert!((depth - 0.305).abs() < 0.002, "{depth}");
    let names: Vec<&str> = value["species"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["name"].as_str().unwrap())
        .collect();
    assert!(names.contains(&"nitrogen dioxide"), "{names:?}");
}

/// The amount of aerosol by every word for it: OPAC's urban air has an optical depth of 0.643 by its definition, 0.64 of it in
/// the troposphere (Hess et al. 1998).
#[test]
fn aerosol_is_loaded_by_depth_visibility_turbidity_or_definition() {
    let folder = tempfile::tempdir().unwrap();
    let depth = |more: &[&str]| {
        let words = [
            "atmosphere",
            "--sun-elevation",
            "30",
            "--aerosol",
            "opac:urban",
            "--json",
        ];
        let one = [
            "--wavelengths",
            "550",
            "--stratosphere",
            "none",
            "--mesosphere",
            "none",
        ];
        let output = run_well(folder.path(), &[&words[..], &one[..], more].concat());
        let value: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
        value["aerosol"]["optical_depth"][0].as_f64().unwrap()
    };
    let near = |a: f64, b: f64, within: f64| assert!((a - b).abs() < within, "{a} {b}");
    near(depth(&["--aod", "0.3"]), 0.3, 3e-4);
    near(depth(&["--aod", "0.3", "--turbidity", "2"]), 0.6, 6e-4);
    let defined = depth(&["--as-tabulated"]);
    near(defined, 0.64, 0.005);
    near(
        depth(&["--as-tabulated", "--turbidity", "0.5"]),
        0.5 * defined,
        1e-6,
    );
    // Koschmieder at 20 km: 0.196 - 0.012 of air per km through 2 km of scale height 8 km, and the free troposphere.
    let seen = depth(&["--visibility", "20"]);
    assert!((0.30..0.38).contains(&seen), "{seen}");
}

/// The scene that the documentation shows is one, and its three wavelengths instead of 81 are told not to make true colours.
#[test]
fn the_scene_of_the_documentation_renders() {
    let folder = tempfile::tempdir().unwrap();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene.toml");
    let small = ["render", scene, "--size=12x8", "--accuracy=preview"];
    let said = stderr(&run_well(
        folder.path(),
        &[&small[..], &["--wavelengths=400:700:20"]].concat(),
    ));
    assert!(!said.contains("note: colours"), "{said}");
    assert_eq!(listing(folder.path()), ["dust.exr", "dust.png"]);
    let said = stderr(&run_well(
        folder.path(),
        &[&small[..], &["--wavelengths=450,550,650"]].concat(),
    ));
    assert!(
        said.contains("note: colours made of 3 wavelengths from 450 to 650 nm"),
        "{said}"
    );
}

/// A scene's files are pictures: the air of the same scene is printed.
#[test]
fn atmosphere_takes_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "at = [41.65, -0.88]\ntime = 2026-06-21T18:30:00Z\noutput = [\"sky.png\"]\n";
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = run_well(
        folder.path(),
        &["atmosphere", "scene.toml", "--wavelengths", "550"],
    );
    assert!(
        stdout(&output).contains("continental"),
        "{}",
        stdout(&output)
    );
    assert_eq!(listing(folder.path()), ["scene.toml"]);
}
