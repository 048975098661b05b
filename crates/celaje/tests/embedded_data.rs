//! The tables that are compiled in: small enough to be shipped, and each with its papers.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use flate2::write::ZlibEncoder;
use flate2::Compression;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every source file of the library.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Paths under `data/` that `include_str!` and `include_bytes!` name.
fn embedded() -> BTreeSet<String> {
    let mut files = Vec::new();
    sources(&root().join("crates/celaje/src"), &mut files);
    let mut tables = BTreeSet::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for part in text.split("include_").skip(1) {
            let Some(name) = part.split('"').nth(1) else {
                continue;
            };
            if let Some(at) = name.find("/data/") {
                tables.insert(name[at + 1..].to_owned());
            }
        }
    }
    tables
}

/// All of them under 3 MB as a package compresses them (zlib), those of the climate under 1 MB.
#[test]
fn tables_are_small() {
    let (mut all, mut climate) = (0, 0);
    for table in embedded() {
        let bytes = fs::read(root().join(&table)).unwrap();
        let mut zlib = ZlibEncoder::new(Vec::new(), Compression::best());
        zlib.write_all(&bytes).unwrap();
        let size = zlib.finish().unwrap().len();
        all += size;
        let is_climate = ["climate_", "gazetteer", "ozone_column"];
        if is_climate.iter().any(|name| table.contains(name)) {
            climate += size;
        }
    }
    println!("embedded, compressed: {all} bytes, of which the climate {climate}");
    assert!(climate > 100_000 && climate < 1_000_000, "{climate}");
    assert!(all < 3_000_000, "{all}");
}

/// Each folder says where its figures are from and on what terms; the climate's are made by a script that is there.
#[test]
fn tables_have_their_papers() {
    let tables = embedded();
    assert!(tables.len() > 20, "{tables:?}");
    for table in tables {
        let folder = root().join(Path::new(&table).parent().unwrap());
        let source = fs::read_to_string(folder.join("SOURCE.md")).unwrap_or_default();
        assert!(source.contains("Source"), "{table}: no source");
        assert!(source.contains("Licence"), "{table}: no licence");
        if table.contains("climate_") || table.contains("gazetteer") || table.contains("sbuv") {
            assert!(folder.join("make.py").is_file(), "{table}: no script");
        }
    }
}
