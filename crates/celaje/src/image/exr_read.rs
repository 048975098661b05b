//! Our own EXR files, read back: the film bit for bit, and what the file says of itself.

use std::path::Path;

use exr::image::{AnyChannels, FlatSamples, Layer};
use exr::meta::attribute::AttributeValue;
use exr::prelude::read_first_flat_layer_from_file;

use super::exr_file::{stokes_channel, PREFIX, SAMPLES_CHANNEL, VARIANCE_PREFIX};
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
    let (width, height) = (layer.size.x(), layer.size.y());
    let stokes = channel(&layer, &stokes_channel(1, wavelength_nm[0])).is_some();
    let mut film = if stokes {
        Film::new_polarised(width, height, &wavelength_nm)?
    } else {
        Film::new(width, height, &wavelength_nm)?
    };
    let mut planes = vec![(&mut film.radiance, &mut film.variance)];
    let others = film.polarisation.iter_mut().flat_map(|p| p.planes_mut());
    planes.extend(others.map(|p| (&mut p.mean, &mut p.variance)));
    let w = wavelength_nm.len();
    for (component, (mean, variance)) in planes.into_iter().enumerate() {
        for (k, &nm) in wavelength_nm.iter().enumerate() {
            let name = stokes_channel(component, nm);
            let values = channel(&layer, &name).ok_or_else(|| foreign(format!("lacks {name}")))?;
            let out = mean[k..].iter_mut().step_by(w);
            for (value, out) in values.values_as_f32().zip(out) {
                *out = value;
            }
            if let Some(values) = channel(&layer, &format!("{VARIANCE_PREFIX}{name}")) {
                let out = variance[k..].iter_mut().step_by(w);
                for (value, out) in values.values_as_f32().zip(out) {
                    *out = value;
                }
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
    fn stokes_components_are_read_bit_for_bit() {
        let folder = Folder::new("exr-read-stokes");
        let path = folder.join("a.exr");
        let plain = film(5, 3, &[450.0, 550.0]);
        let mut written = Film::new_polarised(5, 3, &[450.0, 550.0]).unwrap();
        if let Some(p) = &mut written.polarisation {
            for (c, plane) in p.planes_mut().into_iter().enumerate() {
                plane.mean = plain.radiance.iter().map(|v| v - c as f32).collect();
                plane.mean[..2].fill(0.0);
                plane.variance = plain.variance.clone();
            }
        }
        written.radiance = plain.radiance;
        written.variance = plain.variance;
        written.samples = plain.samples;
        write_exr(&path, &written, Observer::Cie1964, &[]).unwrap();
        assert_eq!(read_exr(&path).unwrap().0, written);
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
