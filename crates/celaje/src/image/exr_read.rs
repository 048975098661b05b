//! Our own EXR files, read back: the film bit for bit, and what the file says of itself.

use std::path::Path;

use exr::image::{AnyChannels, FlatSamples, Layer};
use exr::meta::attribute::AttributeValue;
use exr::prelude::read_first_flat_layer_from_file;

use super::exr_file::{PREFIX, SAMPLES_CHANNEL, VARIANCE_PREFIX};
use crate::error::{Error, Result};
use crate::film::Film;

/// Reads a film that [`super::write_exr`] wrote, and its metadata, sorted by name.
///
/// # Errors
/// [`Error::File`] for a file that cannot be read, is no EXR, or was not written by celaje; [`Error::TooLarge`].
pub fn read_exr(path: &Path) -> Result<(Film, Vec<(String, String)>)> {
    let refused = |message: String, hint: &str| Error::File {
        path: path.display().to_string(),
        message,
        hint: hint.to_owned(),
    };
    let foreign = |message: String| refused(message, "give an .exr that celaje has written");
    let image = read_first_flat_layer_from_file(path).map_err(|e| match e {
        exr::error::Error::Io(e) => refused(e.to_string(), "give the name of a file that exists"),
        other => foreign(format!("cannot be read as EXR: {other}")),
    })?;
    let layer = image.layer_data;
    let mut wavelength_nm: Vec<f64> = layer
        .channel_data
        .list
        .iter()
        .filter_map(|channel| wavelength_of(&channel.name.to_string()))
        .collect();
    wavelength_nm.sort_by(f64::total_cmp);
    if wavelength_nm.is_empty() {
        return Err(foreign("holds no spectral radiance".to_owned()));
    }
    let mut film = Film::new(layer.size.x(), layer.size.y(), &wavelength_nm)?;
    let w = wavelength_nm.len();
    for (k, &nm) in wavelength_nm.iter().enumerate() {
        let name = super::spectral_channel(nm);
        let radiance = channel(&layer, &name).ok_or_else(|| foreign(format!("lacks {name}")))?;
        for (value, out) in radiance
            .values_as_f32()
            .zip(film.radiance[k..].iter_mut().step_by(w))
        {
            *out = value;
        }
        if let Some(variance) = channel(&layer, &format!("{VARIANCE_PREFIX}{name}")) {
            let out = film.variance[k..].iter_mut().step_by(w);
            for (value, out) in variance.values_as_f32().zip(out) {
                *out = value;
            }
        }
    }
    match channel(&layer, SAMPLES_CHANNEL) {
        Some(FlatSamples::U32(samples)) if samples.len() == film.samples.len() => {
            film.samples.copy_from_slice(samples);
        }
        _ => return Err(foreign(format!("lacks the channel {SAMPLES_CHANNEL}"))),
    }
    let mut metadata: Vec<(String, String)> = layer
        .attributes
        .other
        .iter()
        .filter_map(|(name, value)| {
            let name = name.to_string().strip_prefix(PREFIX)?.to_owned();
            match value {
                AttributeValue::Text(text) => {
                    // Its bytes are those of UTF-8.
                    Some((name, String::from_utf8_lossy(text.bytes()).into_owned()))
                }
                _ => None,
            }
        })
        .collect();
    metadata.sort();
    Ok((film, metadata))
}

fn channel<'a>(layer: &'a Layer<AnyChannels<FlatSamples>>, name: &str) -> Option<&'a FlatSamples> {
    let found = layer.channel_data.list.iter().find(|c| c.name == *name);
    found.map(|c| &c.sample_data)
}

/// The wavelength \[nm\] of a channel of radiance.
fn wavelength_of(channel: &str) -> Option<f64> {
    let number = channel.strip_prefix("S0.")?.strip_suffix("nm")?;
    number.replace(',', ".").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::super::test_support::{film, metadata, Folder};
    use super::super::write_exr;
    use super::*;
    use crate::colour::Observer;

    #[test]
    fn what_was_written_is_read_bit_for_bit() {
        let folder = Folder::new("exr-read");
        let path = folder.join("a.exr");
        let mut written = film(13, 37, &[380.0, 999.5, 1000.25]);
        written.samples[5] = u32::MAX;
        written.radiance[20] = f32::MIN_POSITIVE / 3.0;
        write_exr(&path, &written, Observer::Cie1964, &metadata()).unwrap();
        let (read, said) = read_exr(&path).unwrap();
        assert_eq!(read, written);
        let mut expected = metadata();
        expected.push(("observer".to_owned(), Observer::Cie1964.name().to_owned()));
        expected.sort();
        assert_eq!(said, expected);
    }

    #[test]
    fn what_is_no_film_is_refused() {
        let folder = Folder::new("exr-foreign");
        let path = folder.join("a.exr");
        let e = read_exr(&path).unwrap_err();
        assert!(e.hint().contains("exists"), "{e}");
        std::fs::write(&path, b"not an EXR at all").unwrap();
        assert!(read_exr(&path).unwrap_err().to_string().contains("EXR"));
        write_exr(&path, &film(4, 4, &[500.0]), Observer::Cie1964, &[]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        assert!(matches!(read_exr(&path).unwrap_err(), Error::File { .. }));
    }
}
