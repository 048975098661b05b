//! Checkpoints: a rendering under way, so that an interruption loses seconds instead of hours.
//!
//! | part | bytes |
//! |---|---|
//! | `celaje checkpoint 1\n` | 20 |
//! | length of the identity | u64 |
//! | the identity: names and values, each followed by a zero | |
//! | width, height, wavelengths, quantities, blocks finished, whether they reached the noise | u64 each |
//! | wavelengths \[nm\] | f64 each |
//! | of every pixel of a finished block, in their order: samples; of each quantity the means, then the variances | u32; f32 each |
//! | CRC-32 of all before it | u32 |
//!
//! Little-endian throughout. Written whole or not at all, as pictures are.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

use flate2::Crc;

use super::target::write_whole;
use super::Metadata;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::transport::Partial;

const MAGIC: &[u8; 20] = b"celaje checkpoint 1\n";

/// Writes a rendering under way; `identity` is all that its values depend on.
///
/// # Errors
/// [`Error::File`]; an older checkpoint is then untouched.
pub fn write_checkpoint(path: &Path, partial: &Partial, identity: &Metadata) -> Result<()> {
    let film = &partial.film;
    let planes = film.planes();
    let head = head_of(identity);
    write_whole(path, |file| {
        let mut out = Summed {
            out: file,
            crc: Crc::new(),
        };
        out.write_all(MAGIC)?;
        out.write_all(&(head.len() as u64).to_le_bytes())?;
        out.write_all(&head)?;
        let numbers = [
            film.width,
            film.height,
            film.wavelength_nm.len(),
            planes.len(),
            partial.blocks_finished,
            usize::from(partial.reached),
        ];
        for n in numbers {
            out.write_all(&(n as u64).to_le_bytes())?;
        }
        for nm in &film.wavelength_nm {
            out.write_all(&nm.to_le_bytes())?;
        }
        let w = film.wavelength_nm.len();
        let mut row = Vec::with_capacity(8 * w * planes.len() + 4);
        for pixel in finished_pixels(film, partial.blocks_finished) {
            row.clear();
            row.extend(film.samples[pixel].to_le_bytes());
            for values in planes.iter().flatten() {
                let values = &values[pixel * w..(pixel + 1) * w];
                row.extend(values.iter().flat_map(|v| v.to_le_bytes()));
            }
            out.write_all(&row)?;
        }
        let sum = out.crc.sum();
        out.out.write_all(&sum.to_le_bytes())
    })
}

/// Reads the checkpoint of a picture of `size` pixels (width, height); `None` if there is no such file.
///
/// # Errors
/// [`Error::File`] for a file that is no checkpoint, is damaged, or belongs to another rendering; says in what they differ.
pub fn read_checkpoint(
    path: &Path,
    size: (usize, usize),
    wavelength_nm: &[f64],
    identity: &Metadata,
) -> Result<Option<Partial>> {
    let refused = |message: String, hint: &str| Error::File {
        path: path.display().to_string(),
        message,
        hint: hint.to_owned(),
    };
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(refused(e.to_string(), "choose another file")),
    };
    if !bytes.starts_with(MAGIC) {
        return Err(refused(
            "is no checkpoint of this version of celaje".to_owned(),
            "give the name of a new file, or of one that --checkpoint has written",
        ));
    }
    let damaged = || {
        refused(
            "is damaged: its checksum is not that of its content".to_owned(),
            "remove it to begin anew",
        )
    };
    let (content, sum) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
    let mut crc = Crc::new();
    crc.update(content);
    if crc.sum() != u32::from_le_bytes(*sum) {
        return Err(damaged());
    }
    let mut input = Input(&content[MAGIC.len()..]);
    let length = input.number().ok_or_else(damaged)?;
    let head = input.take(length).ok_or_else(damaged)?;
    let other = |message: String| {
        refused(
            format!("belongs to another rendering: {message}"),
            "repeat the command that began it, remove the file, or name another",
        )
    };
    if head != head_of(identity) {
        return Err(other(difference(head, identity)));
    }
    read_film(&mut input, size, wavelength_nm)
        .ok_or_else(|| other("its size or wavelengths differ".to_owned()))
        .map(Some)
}

/// Removes the checkpoint of a rendering that is done; whatever cannot be removed is left.
pub fn remove_checkpoint(path: &Path) {
    let _ = fs::remove_file(path);
}

fn read_film(
    input: &mut Input<'_>,
    (width, height): (usize, usize),
    wavelength_nm: &[f64],
) -> Option<Partial> {
    for wanted in [width, height, wavelength_nm.len()] {
        if input.number()? != wanted {
            return None;
        }
    }
    let mut film = match input.number()? {
        1 => Film::new(width, height, wavelength_nm).ok()?,
        4 => Film::new_polarised(width, height, wavelength_nm).ok()?,
        _ => return None,
    };
    let (blocks_finished, reached) = (input.number()?, input.number()? == 1);
    if blocks_finished > Film::blocks(film.width, film.height).len() {
        return None;
    }
    for nm in &film.wavelength_nm {
        if f64::from_le_bytes(input.array()?).to_bits() != nm.to_bits() {
            return None;
        }
    }
    let w = film.wavelength_nm.len();
    for pixel in finished_pixels(&film, blocks_finished) {
        film.samples[pixel] = u32::from_le_bytes(input.array()?);
        for values in film.planes_mut().into_iter().flatten() {
            for value in &mut values[pixel * w..(pixel + 1) * w] {
                *value = f32::from_le_bytes(input.array()?);
            }
        }
    }
    input.0.is_empty().then_some(Partial {
        film,
        blocks_finished,
        reached,
    })
}

fn finished_pixels(film: &Film, blocks: usize) -> Vec<usize> {
    Film::blocks(film.width, film.height)[..blocks].concat()
}

fn head_of(identity: &Metadata) -> Vec<u8> {
    let words = identity.iter().flat_map(|(name, value)| [name, value]);
    words
        .flat_map(|word| word.bytes().chain(std::iter::once(0)))
        .collect()
}

/// In what two identities differ, in words.
fn difference(head: &[u8], identity: &Metadata) -> String {
    let words: Vec<String> = head
        .split(|&byte| byte == 0)
        .map(|word| String::from_utf8_lossy(word).into_owned())
        .collect();
    let theirs = |name: &str| {
        let mut pairs = words.chunks_exact(2);
        pairs.find(|pair| pair[0] == name).map(|pair| &pair[1])
    };
    for (name, value) in identity {
        match theirs(name) {
            Some(other) if other == value => {}
            Some(other) => return format!("{name} is {other} there and {value} here"),
            None => return format!("{name} is not known there"),
        }
    }
    "it knows more conditions".to_owned()
}

/// Bytes yet to be read.
struct Input<'a>(&'a [u8]);

impl<'a> Input<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn number(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.array()?)).ok()
    }
}

/// A writer that sums up what passes.
struct Summed<'a, W: Write> {
    out: &'a mut W,
    crc: Crc,
}

impl<W: Write> Write for Summed<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.out.write(bytes)?;
        self.crc.update(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_support::{film, metadata, Folder};
    use super::*;

    fn partial() -> Partial {
        let mut whole = Film::new_polarised(20, 10, &[450.0, 550.5, 650.0]).unwrap();
        let scalar = film(20, 10, &[450.0, 550.5, 650.0]);
        (whole.samples, whole.radiance, whole.variance) =
            (scalar.samples, scalar.radiance, scalar.variance);
        for plane in whole.polarisation.iter_mut().flat_map(|p| p.planes_mut()) {
            plane.mean = whole.radiance.iter().rev().copied().collect();
        }
        let mut film = whole.black_like(20, 10).unwrap();
        let pixels = Film::blocks(20, 10)[..4].concat();
        film.set_pixels(&whole, pixels.into_iter().map(|p| (p, p)));
        Partial {
            film,
            blocks_finished: 4,
            reached: false,
        }
    }

    fn read(path: &Path, identity: &Metadata) -> Result<Option<Partial>> {
        read_checkpoint(path, (20, 10), &[450.0, 550.5, 650.0], identity)
    }

    #[test]
    fn what_was_kept_comes_back_bit_for_bit() {
        let folder = Folder::new("checkpoint");
        let path = folder.join("a");
        assert_eq!(read(&path, &metadata()).unwrap(), None);
        let mut kept = partial();
        kept.film.radiance[3] = f32::from_bits(0x7fc0_1234);
        kept.film.radiance[4] = -0.0;
        write_checkpoint(&path, &kept, &metadata()).unwrap();
        let back = read(&path, &metadata()).unwrap().unwrap();
        let bits = |p: &Partial| {
            p.film
                .radiance
                .iter()
                .map(|v| v.to_bits())
                .collect::<Vec<_>>()
        };
        assert_eq!(bits(&back), bits(&kept));
        assert_eq!(back.film.variance, kept.film.variance);
        assert_eq!(back.film.samples, kept.film.samples);
        assert_eq!(back.film.polarisation, kept.film.polarisation);
        assert_eq!((back.blocks_finished, back.reached), (4, false));
        remove_checkpoint(&path);
        assert!(folder.listing().is_empty());
    }

    /// Every truncation and every flipped bit is noticed; so are another rendering, and a file of another kind.
    #[test]
    fn a_wrong_file_is_refused_with_a_reason() {
        let folder = Folder::new("checkpoint-wrong");
        let path = folder.join("a");
        write_checkpoint(&path, &partial(), &metadata()).unwrap();
        let whole = fs::read(&path).unwrap();
        let reason = |bytes: &[u8], identity: &Metadata| {
            fs::write(&path, bytes).unwrap();
            let e = read(&path, identity).unwrap_err();
            assert!(matches!(e, Error::File { .. }) && !e.hint().is_empty());
            e.to_string()
        };
        for length in [0, 5, 21, 60, whole.len() / 2, whole.len() - 1] {
            let told = reason(&whole[..length], &metadata());
            assert!(
                told.contains("damaged") || told.contains("no checkpoint"),
                "{told}"
            );
        }
        for at in (20..whole.len()).step_by(97) {
            let mut flipped = whole.clone();
            flipped[at] ^= 4;
            assert!(reason(&flipped, &metadata()).contains("damaged"));
        }
        let mut other = metadata();
        other[1].1 = "Ronda".to_owned();
        let told = reason(&whole, &other);
        assert!(
            told.contains("place is Mañón, 43.7° N there and Ronda here"),
            "{told}"
        );
        fs::write(&path, &whole).unwrap();
        for (width, nm) in [(20, 550.0), (21, 550.5)] {
            let grid = [450.0, nm, 650.0];
            let e = read_checkpoint(&path, (width, 10), &grid, &metadata()).unwrap_err();
            assert!(e.to_string().contains("wavelengths"), "{e}");
        }
    }
}
