//! What the tests of the command share: running it, and reading what it says.

#![allow(dead_code)]

use std::path::Path;
use std::process::{Command, Output};

/// The command, ready for its arguments, working in a folder.
pub fn celaje(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_celaje"));
    command.current_dir(folder);
    command
}

/// Runs the command in a folder.
pub fn run(folder: &Path, args: &[&str]) -> Output {
    celaje(folder).args(args).output().unwrap()
}

/// Runs the command in a folder and expects success.
pub fn run_well(folder: &Path, args: &[&str]) -> Output {
    let output = run(folder, args);
    assert!(output.status.success(), "{args:?}: {}", stderr(&output));
    output
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Names in a folder, hidden ones too, sorted.
pub fn listing(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
