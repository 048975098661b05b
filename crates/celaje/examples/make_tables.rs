//! Computes the shipped tables of particle optics: `cargo run --release -p celaje --example make_tables -- data/mie_tables`.
//!
//! Takes some minutes; with `--check` it writes nothing and says whether the shipped ones are the same.

use celaje::composition::aerosol::all_sources;
use celaje::optics::tables::{compute, encode, humidity_nodes};
use celaje::Result;
use rayon::prelude::*;
use std::path::Path;

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let check = arguments.iter().any(|a| a == "--check");
    let folder = arguments.iter().find(|a| *a != "--check");
    let folder = Path::new(folder.map_or("data/mie_tables", String::as_str));

    let jobs: Vec<_> = all_sources()?
        .into_iter()
        .flat_map(|source| {
            humidity_nodes(&source)
                .iter()
                .map(move |&h| (source.clone(), h))
        })
        .collect();
    eprintln!("{} kinds of particles", jobs.len());
    let tables = jobs
        .par_iter()
        .map(|(source, humidity)| compute(source, *humidity))
        .collect::<Result<Vec<_>>>()?;
    let encoded = encode(&tables)?;
    let mut same = true;
    for (name, bytes) in [
        ("cross_sections.csv", encoded.cross_sections.as_bytes()),
        ("phase.bin", &encoded.phase),
        ("polarisation.bin", &encoded.polarisation),
    ] {
        let path = folder.join(name);
        if check {
            let equal = std::fs::read(&path)? == bytes;
            println!("{name}: {}", if equal { "the same" } else { "differs" });
            same &= equal;
        } else {
            std::fs::write(&path, bytes)?;
            println!("{name}: {} bytes", bytes.len());
        }
    }
    if same {
        Ok(())
    } else {
        Err("the shipped tables are not what this program computes".into())
    }
}
