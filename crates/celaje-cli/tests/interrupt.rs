//! Ctrl-C in every phase: exit code 130 within 0.2 s, and no half file.

#![cfg(unix)]

mod support;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use support::{celaje, listing};

/// What is promised.
const PROMISED: Duration = Duration::from_millis(200);
/// Allowed on top: a machine busy with other tests may take this long to run anybody at all.
const SCHEDULING: Duration = Duration::from_millis(300);

/// Starts a rendering in a folder.
fn start(folder: &Path, args: &[&str]) -> Child {
    celaje(folder)
        .args(["render", "--sun-elevation", "10"])
        .args(args)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends Ctrl-C and waits; checks the exit code, the time and what was said, and prints the time.
fn interrupt(child: Child, phase: &str) {
    let pid = child.id().to_string();
    let sent = Instant::now();
    let kill = Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert!(kill.success(), "{phase}: it had already ended");
    let output = child.wait_with_output().unwrap();
    let took = sent.elapsed();
    println!("{phase}: {took:?}");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{phase}: {said}");
    assert!(took < PROMISED + SCHEDULING, "{phase}: {took:?}");
    assert_eq!(said, "error: interrupted\n", "{phase}");
}

/// The air takes a good part of a second to build, more so with two thousand wavelengths.
#[test]
fn while_building() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["-o", "a.exr", "--wavelengths", "280:2500:1", "--size", "2"];
    let child = start(folder.path(), &args);
    std::thread::sleep(Duration::from_millis(200));
    interrupt(child, "building");
    assert!(listing(folder.path()).is_empty());
}

#[test]
fn while_rendering() {
    let folder = tempfile::tempdir().unwrap();
    let args = [
        "-o", "a.exr", "-o", "a.png", "--spp", "1000000", "--size", "64",
    ];
    let child = start(folder.path(), &args);
    std::thread::sleep(Duration::from_millis(2500));
    interrupt(child, "rendering");
    assert!(listing(folder.path()).is_empty());
}

/// A file appears under a temporary name as soon as its first bytes are written; an EXR of this size takes a second more.
#[test]
fn while_writing() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = start(
        folder.path(),
        &["-o", "a.exr", "--spp", "1", "--size", "512"],
    );
    while !half_written(folder.path()) {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(Duration::from_millis(2));
    }
    interrupt(child, "writing");
    assert!(
        listing(folder.path()).is_empty(),
        "{:?}",
        listing(folder.path())
    );
}

fn half_written(folder: &Path) -> bool {
    let entries = std::fs::read_dir(folder).unwrap();
    entries
        .flatten()
        .any(|e| e.metadata().is_ok_and(|m| m.len() > 0))
}
