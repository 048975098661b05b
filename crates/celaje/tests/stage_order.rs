//! The architecture, held by a test: a stage imports only stages to its left, and only images are written to files.
//!
//! The order is drawn and explained in `ARCHITECTURE.md`. A new module of the crate must be given its place here.

use std::fs;
use std::path::{Path, PathBuf};

/// What every stage may import; each of these imports only those before it.
const SHARED: [&str; 3] = ["error", "math", "spectrum"];

/// The line, from left to right. The last five are the whole line in one value, and uses of it.
const LINE: [&str; 15] = [
    "place",
    "climate",
    "composition",
    "optics",
    "medium",
    "sensor",
    "film",
    "transport",
    "colour",
    "image",
    "sky",
    "bake",
    "residual",
    "irradiance",
    "inventory",
];

/// Plain values at which transport looks: they know no stage at all.
const LEAVES: [&str; 2] = ["sensor", "film"];

/// The only stage that touches files. (Data are compiled in by `include_str!`.)
const WRITES_FILES: &str = "image";

fn source_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All Rust files below a folder, sorted.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// The code without comments (documentation may point anywhere) and without white space.
fn code_of(source: &str) -> String {
    let lines = source.lines().map(|l| l.split("//").next().unwrap_or(""));
    lines
        .flat_map(|l| l.chars().chain(['\n']))
        .collect::<String>()
        .split_whitespace()
        .collect::<Vec<_>>()
        // One blank where there were some: `pub use x` must not become `pubusex`.
        .join(" ")
        .replace(":: ", "::")
        .replace("{ ", "{")
}

/// The identifier at the beginning of a text.
fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// What a path names after its root: `x` of `x::y`, or `x` and `z` of `{x::{y, w}, z}`.
fn first_names(text: &str) -> Vec<&str> {
    let Some(group) = text.strip_prefix('{') else {
        return vec![identifier(text)];
    };
    let (mut depth, mut start, mut names) = (0, 0, Vec::new());
    for (i, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            ',' | '}' if depth == 0 => {
                names.push(identifier(group[start..i].trim_start()));
                start = i + 1;
                if c == '}' {
                    break;
                }
            }
            '}' => depth -= 1,
            _ => {}
        }
    }
    names.retain(|n| !n.is_empty());
    names
}

/// Modules of the crate and what its root re-exports, as (name, module), from the text of `lib.rs`.
fn root_names(lib: &str) -> Vec<(String, String)> {
    let mut names = Vec::new();
    for statement in code_of(lib).split(';').map(str::trim) {
        if let Some(module) = statement.strip_prefix("pub mod ") {
            names.push((module.to_owned(), module.to_owned()));
        }
        if let Some(path) = statement.strip_prefix("pub use ") {
            let (module, rest) = path.split_once("::").unwrap();
            for name in first_names(rest) {
                names.push((name.to_owned(), module.to_owned()));
            }
        }
    }
    names
}

/// Everything that some code takes from the root of the crate, as modules; `super::` counts where it names one of them.
fn imports(source: &str, root: &[(String, String)]) -> Vec<String> {
    let code = code_of(source);
    let mut modules = Vec::new();
    for (prefix, always) in [("crate::", true), ("super::", false)] {
        for (i, _) in code.match_indices(prefix) {
            for name in first_names(&code[i + prefix.len()..]) {
                let known = root.iter().find(|(n, _)| n == name);
                match known {
                    Some((_, module)) if always || name == module => modules.push(module.clone()),
                    None if always => modules.push(name.to_owned()),
                    _ => {}
                }
            }
        }
    }
    modules
}

/// Whether a module may import another.
fn may_import(from: &str, to: &str) -> bool {
    let place = |list: &[&str], name: &str| list.iter().position(|n| *n == name);
    if from == to {
        return true;
    }
    match (place(&SHARED, from), place(&SHARED, to)) {
        (Some(from), Some(to)) => return to < from,
        (Some(_), None) => return false,
        (None, Some(_)) => return true,
        (None, None) => {}
    }
    match (place(&LINE, from), place(&LINE, to)) {
        (Some(left), Some(right)) => right < left && !LEAVES.contains(&from),
        _ => false,
    }
}

/// The module of the crate that a file belongs to.
fn module_of(file: &Path) -> String {
    let inside = file.strip_prefix(source_folder()).unwrap();
    let first = inside.components().next().unwrap().as_os_str();
    first.to_str().unwrap().trim_end_matches(".rs").to_owned()
}

/// Rationale: a stage that looks back cannot be entered by a user's own value, nor be tested alone. Expected: no import to
/// the right, in code and in its unit tests.
#[test]
fn a_stage_imports_only_stages_to_its_left() {
    let root = root_names(&fs::read_to_string(source_folder().join("lib.rs")).unwrap());
    let mut imports_seen = 0;
    let mut wrong = Vec::new();
    for file in rust_files(&source_folder()) {
        let from = module_of(&file);
        if from == "lib" {
            continue;
        }
        for to in imports(&fs::read_to_string(&file).unwrap(), &root) {
            imports_seen += 1;
            if !may_import(&from, &to) {
                wrong.push(format!("{}: {from} imports {to}", file.display()));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "against the order {SHARED:?}, {LINE:?}:\n{}",
        wrong.join("\n")
    );
    assert!(
        imports_seen > 100,
        "{imports_seen} imports: the reader is blind"
    );
}

/// Every module has its place, and every place its module.
#[test]
fn the_order_is_complete() {
    let root = root_names(&fs::read_to_string(source_folder().join("lib.rs")).unwrap());
    let mut modules: Vec<&str> = root.iter().map(|(_, m)| m.as_str()).collect();
    modules.sort_unstable();
    modules.dedup();
    let mut placed: Vec<&str> = SHARED.iter().chain(&LINE).copied().collect();
    placed.sort_unstable();
    assert_eq!(modules, placed);
}

#[test]
fn only_images_touch_files() {
    for file in rust_files(&source_folder()) {
        // Tests in a file of their own look at what was written.
        if module_of(&file) == WRITES_FILES || file.ends_with("tests.rs") {
            continue;
        }
        let code = code_of(&fs::read_to_string(&file).unwrap());
        for word in ["std::fs", "File::", "std::env", "std::net"] {
            assert!(!code.contains(word), "{}: {word}", file.display());
        }
    }
}

/// The reader sees what it must: groups, re-exports, `super`, and no comments.
#[test]
fn imports_are_read() {
    let root = root_names("pub mod film;\npub mod math;\npub mod sky;\npub use sky::Sky;\n");
    let read = |source| imports(source, &root);
    assert_eq!(read("use crate::film::Film;"), ["film"]);
    assert_eq!(
        read("use crate::{\n    film::{Film, X},\n    math,\n};"),
        ["film", "math"]
    );
    assert_eq!(read("fn f(s: &crate::Sky) {}"), ["sky"]);
    assert_eq!(read("use super::super::sky::Sky;"), ["sky"]);
    assert_eq!(read("use super::path::Rows; // crate::film"), [""; 0]);
    assert_eq!(read("/// See [`crate::Sky`].\nuse crate::new::X;"), ["new"]);
    assert!(may_import("sky", "transport") && may_import("transport", "film"));
    assert!(!may_import("medium", "transport") && !may_import("film", "place"));
    assert!(!may_import("math", "spectrum") && !may_import("math", "film"));
}
