//! `celaje merge`: pictures of different seeds to one with less noise.

use std::path::PathBuf;

use celaje::image::{merged, read_exr, save};
use clap::Args;

use crate::failure::Failure;
use crate::interrupt;
use crate::options::Colour;
use crate::render::{check_outputs, paths_and_noise};

/// Put pictures of one sky with different seeds together, to one with less noise
#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
The .exr files must come from 'celaje render' with paths (--spp, --noise or --time-limit), differ in --seed, and agree in all else.
Each pixel is the mean of all, weighted by the paths behind it, and its variance falls accordingly.

Example:
  celaje render --sun-elevation 5 --spp 256 --seed 1 -o a.exr
  celaje render --sun-elevation 5 --spp 256 --seed 2 -o b.exr
  celaje merge a.exr b.exr -o sky.exr -o sky.png"
)]
pub struct MergeArgs {
    /// Two .exr files or more
    #[arg(value_name = "FILE.exr", required = true)]
    films: Vec<PathBuf>,
    /// File to write: .png, .exr, .hdr or .nc; may be given several times
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    colour: Colour,
}

/// Checks, reads, merges, writes.
pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    let look = args.colour.look()?;
    check_outputs(&args.output)?;
    interrupt::set_targets(&args.output);
    let mut films = Vec::new();
    for path in &args.films {
        interrupt::check()?;
        let (film, mut said) = read_exr(path)?;
        // Each file is written for an observer of its own.
        said.retain(|(name, _)| name != "observer");
        films.push((film, said));
    }
    let count = films.len();
    let (film, said) = merged(films)?;
    for path in &args.output {
        interrupt::check()?;
        save(path, &film, &look, None, &said)?;
    }
    let paths = said.iter().find(|(name, _)| name == "spp");
    let paths = paths.map_or("an unknown number of", |(_, n)| n.as_str());
    eprintln!("merged {count} pictures; {}", paths_and_noise(&film, paths));
    Ok(())
}
