//! Films of different seeds become one, if what is said of them allows it.

use std::collections::BTreeSet;

use super::Metadata;
use crate::error::{Error, Result};
use crate::film::Film;

/// What may differ between films that are merged.
const RUN: [&str; 6] = ["seed", "spp", "noise", "time_limit", "observer", "reached"];

/// A film and what is said of it.
pub type Described = (Film, Vec<(String, String)>);

/// Puts films of one sky by different seeds together; all that is said of them must agree, but for how long each was rendered.
///
/// Weights are the paths behind each pixel ([`Film::merge`]). The seeds of the result are those of all.
///
/// # Errors
/// [`Error::Invalid`] for fewer than two films, a seed that two of them share or that is not known, conditions that differ, and as
/// [`Film::merge`].
pub fn merged(films: Vec<Described>) -> Result<Described> {
    if films.len() < 2 {
        return Err(Error::invalid(
            format!("{} film cannot be merged", films.len()),
            "give two films or more, rendered with different --seed",
        ));
    }
    let mut films = films.into_iter().enumerate();
    let Some((_, (mut film, mut metadata))) = films.next() else {
        return Err(Error::invalid("no film", "give two films or more"));
    };
    let mut seeds = seeds_of(&metadata, 1)?;
    let mut paths = paths_of(&metadata);
    for (i, (other, said)) in films {
        agree(&metadata, &said, i + 1)?;
        agree(&said, &metadata, i + 1)?;
        for seed in seeds_of(&said, i + 1)? {
            if !seeds.insert(seed.clone()) {
                return Err(Error::invalid(
                    format!("film {} has the seed {seed}, which another has too: their noise is the same", i + 1),
                    "render it again with another --seed",
                ));
            }
        }
        film.merge(&other)?;
        paths = paths.zip(paths_of(&said)).map(|(a, b)| a + b);
    }
    let seeds: Vec<String> = seeds.into_iter().collect();
    metadata.retain(|(name, _)| !RUN.contains(&name.as_str()));
    metadata.push(("seed".to_owned(), seeds.join(",")));
    metadata.extend(paths.map(|n| ("spp".to_owned(), n.to_string())));
    Ok((film, metadata))
}

fn value<'a>(metadata: &'a Metadata, name: &str) -> Option<&'a str> {
    let found = metadata.iter().find(|(n, _)| n == name);
    found.map(|(_, value)| value.as_str())
}

fn seeds_of(metadata: &Metadata, film: usize) -> Result<BTreeSet<String>> {
    let seeds = value(metadata, "seed").ok_or_else(|| {
        Error::invalid(
            format!("film {film} does not say its seed: it may be without noise, or have the noise of another"),
            "merge films rendered by path, tracker or classic",
        )
    })?;
    Ok(seeds.split(',').map(str::to_owned).collect())
}

fn paths_of(metadata: &Metadata) -> Option<u64> {
    value(metadata, "spp")?.parse().ok()
}

/// All that `a` says must be said by `b` too.
fn agree(a: &Metadata, b: &Metadata, film: usize) -> Result<()> {
    for (name, said) in a.iter().filter(|(name, _)| !RUN.contains(&name.as_str())) {
        let other = value(b, name).unwrap_or("not said");
        if other != said {
            return Err(Error::invalid(
                format!("films 1 and {film} are not of the same sky: {name} is {said} in one and {other} in the other"),
                "merge films that differ in their seeds only",
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::test_support::film;

    fn described(seed: &str, spp: &str, place: &str) -> Described {
        let said = [("place", place), ("seed", seed), ("spp", spp)];
        let said = said.map(|(n, v)| (n.to_owned(), v.to_owned()));
        (film(3, 2, &[500.0]), said.to_vec())
    }

    #[test]
    fn seeds_and_paths_add_up() {
        let films = ["1", "0", "2,3"].map(|seed| described(seed, "7", "here"));
        let (merged, said) = merged(films.to_vec()).unwrap();
        assert_eq!(value(&said, "seed"), Some("0,1,2,3"));
        assert_eq!(value(&said, "spp"), Some("21"));
        assert_eq!(merged.samples[1], 21);
        let single = film(3, 2, &[500.0]);
        assert!((merged.radiance[4] - single.radiance[4]).abs() < 1e-7 * single.radiance[4]);
        assert!((merged.variance[4] - single.variance[4] / 3.0).abs() < 1e-6 * single.variance[4]);
    }

    #[test]
    fn what_does_not_belong_together_is_refused() {
        let here = described("1", "7", "here");
        let mut unsaid = described("2", "7", "here");
        unsaid.1.remove(1);
        let mut more = described("2", "7", "here");
        more.1.push(("aod_550".to_owned(), "0.1".to_owned()));
        for (other, word) in [
            (described("0,1", "7", "here"), "the seed 1"),
            (
                described("2", "7", "there"),
                "place is here in one and there",
            ),
            (unsaid, "does not say its seed"),
            (more, "aod_550"),
        ] {
            let e = merged(vec![here.clone(), other]).unwrap_err().to_string();
            assert!(e.contains(word), "{e}");
        }
        assert!(merged(vec![here]).is_err());
    }
}
