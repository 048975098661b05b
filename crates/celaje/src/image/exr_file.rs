//! EXR: a linear preview and every wavelength, in the layout for spectral images of Fichet, Pacanowski & Wilkie,
//! *An OpenEXR layout for spectral images*, Journal of Computer Graphics Techniques 10 (3), 2021.

use std::io;
use std::path::Path;

use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::image::write::WritableImage;
use exr::image::{Blocks, Encoding, Image, Layer};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, Chromaticities, LevelMode, LineOrder,
    SampleType, Text,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::prelude::Compression;

use super::target::write_whole;
use super::Metadata;
use crate::colour::{ColourImage, Observer, PRIMARIES_XY};
use crate::error::{Error, Result};
use crate::film::Film;

/// What the names of our own attributes begin with.
pub(super) const PREFIX: &str = "celaje.";

/// What the names of the variances' channels begin with.
pub(super) const VARIANCE_PREFIX: &str = "variance.";

/// Name of the channel of paths per pixel.
pub(super) const SAMPLES_CHANNEL: &str = "samples";

/// Name of the channel of radiance (Stokes component 0) at a wavelength \[nm\]: `S0.550,000000nm`, with a comma because
/// a dot separates layers.
pub fn spectral_channel(wavelength_nm: f64) -> String {
    stokes_channel(0, wavelength_nm)
}

/// Name of the channel of a Stokes component, 0 to 3 for I, Q, U, V.
pub(super) fn stokes_channel(component: usize, wavelength_nm: f64) -> String {
    format!(
        "S{component}.{}nm",
        format!("{wavelength_nm:.6}").replace('.', ",")
    )
}

/// Writes a film as an EXR: 32-bit floats, lossless ZIP, scan lines.
///
/// | channels | meaning |
/// |---|---|
/// | `R`, `G`, `B` | linear sRGB \[cd m⁻²\] for the observer (`whiteLuminance` 1); negative out of gamut |
/// | `S0.550,000000nm`, … | spectral radiance \[W m⁻² sr⁻¹ nm⁻¹\], bit for bit that of the film |
/// | `S1`, `S2`, `S3` in the place of `S0` | Stokes components Q, U, V, if the film has them; see `film::Polarisation` for their basis |
/// | `variance.S0.550,000000nm`, … | variance of that mean, the square of its unit; left out if all are 0 |
/// | `samples` | paths behind the pixel, 32-bit integers; 0 where the sensor sees nothing |
///
/// Attributes: `spectralLayoutVersion` and `emissiveUnits` of the layout, and each entry of the metadata as a string
/// (UTF-8) named `celaje.NAME`; with polarisation also `polarisationHandedness` of the layout and `celaje.stokes_basis`. Where the
/// sensor sees nothing every channel is 0.
///
/// [`super::read_exr`] reads all of it back.
///
/// # Errors
/// As [`super::save`].
pub fn write_exr(path: &Path, film: &Film, observer: Observer, metadata: &Metadata) -> Result<()> {
    let preview = ColourImage::from_film(film, observer)?;
    let others = film.polarisation.iter().flat_map(|p| p.planes());
    let others = others.flat_map(|p| {
        [
            ("mean of Q, U or V", &p.mean),
            ("variance of Q, U or V", &p.variance),
        ]
    });
    for (name, values) in others.chain([("film.variance", &film.variance)]) {
        if values.len() != film.radiance.len() {
            return Err(Error::ShapeMismatch {
                name: name.to_owned(),
                got: format!("({},)", values.len()),
                expected: format!("({},)", film.radiance.len()),
            });
        }
    }
    let channels = FilmChannels::new(film, &preview);
    let size = Vec2(film.width, film.height);
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(
        size,
        layer_attributes(film, observer, metadata),
        encoding,
        channels,
    );
    let [red, green, blue] = PRIMARIES_XY.map(|[x, y]| Vec2(x as f32, y as f32));
    let mut attributes = ImageAttributes::with_size(size);
    attributes.chromaticities = Some(Chromaticities {
        red,
        green,
        blue,
        white: Vec2(0.3127, 0.3290),
    });
    let image = Image::new(attributes, layer);
    write_whole(path, |writer| {
        image.write().to_buffered(writer).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => io::Error::other(other.to_string()),
        })
    })
}

/// What Q, U and V of a file refer to.
const STOKES_BASIS: &str = "S1 = |Et|^2 - |Ep|^2, S2 = 2 Re(Et Ep*), S3 = 2 Im(Et Ep*); \
    k: direction of travel of the light, t: along increasing zenith angle of k in its vertical plane, p = k x t; fields as exp(-iwt)";

fn layer_attributes(film: &Film, observer: Observer, metadata: &Metadata) -> LayerAttributes {
    // EXR strings are bytes; those of UTF-8 are what today's readers expect.
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    let string = |s: &str| AttributeValue::Text(text(s));
    let mut attributes = LayerAttributes {
        white_luminance: Some(1.0),
        software_name: Some(text(&format!("celaje {}", env!("CARGO_PKG_VERSION")))),
        ..LayerAttributes::default()
    };
    let other = &mut attributes.other;
    other.insert(text("spectralLayoutVersion"), string("1.0"));
    other.insert(text("emissiveUnits"), string("W.m^-2.sr^-1.nm^-1"));
    other.insert(text(&format!("{PREFIX}observer")), string(observer.name()));
    if film.polarisation.is_some() {
        other.insert(text("polarisationHandedness"), string("right"));
        other.insert(text(&format!("{PREFIX}stokes_basis")), string(STOKES_BASIS));
    }
    for (name, value) in metadata {
        other.insert(text(&format!("{PREFIX}{name}")), string(value));
    }
    attributes
}

/// Where the numbers of a channel come from.
#[derive(Debug, Clone, Copy)]
enum Source {
    Preview(usize),
    /// Stokes component, wavelength.
    Mean(usize, usize),
    Variance(usize, usize),
    Samples,
}

/// The channels of a film, read from where they lie: no second copy of the film is made.
struct FilmChannels<'a> {
    film: &'a Film,
    /// Means and variances of the Stokes components that there are.
    stokes: Vec<(&'a [f32], &'a [f32])>,
    preview: &'a ColourImage,
    /// Sorted by name, as the format demands.
    channels: Vec<(String, Source)>,
}

impl<'a> FilmChannels<'a> {
    fn new(film: &'a Film, preview: &'a ColourImage) -> Self {
        let mut channels: Vec<(String, Source)> = ["R", "G", "B"]
            .into_iter()
            .enumerate()
            .map(|(k, name)| (name.to_owned(), Source::Preview(k)))
            .collect();
        let mut stokes = vec![(&film.radiance[..], &film.variance[..])];
        let others = film.polarisation.iter().flat_map(|p| p.planes());
        stokes.extend(others.map(|p| (&p.mean[..], &p.variance[..])));
        let with_variance = film.variance.iter().any(|&v| v != 0.0);
        for component in 0..stokes.len() {
            for (k, &wavelength_nm) in film.wavelength_nm.iter().enumerate() {
                let name = stokes_channel(component, wavelength_nm);
                if with_variance {
                    let source = Source::Variance(component, k);
                    channels.push((format!("{VARIANCE_PREFIX}{name}"), source));
                }
                channels.push((name, Source::Mean(component, k)));
            }
        }
        channels.push((SAMPLES_CHANNEL.to_owned(), Source::Samples));
        channels.sort_by(|a, b| a.0.cmp(&b.0));
        Self {
            film,
            stokes,
            preview,
            channels,
        }
    }

    fn value(&self, source: Source, pixel: usize) -> f32 {
        let n = self.film.wavelength_nm.len();
        match source {
            Source::Preview(k) => self.preview.rgb[pixel][k],
            _ if !self.film.is_lit(pixel) => 0.0,
            Source::Mean(component, k) => self.stokes[component].0[pixel * n + k],
            Source::Variance(component, k) => self.stokes[component].1[pixel * n + k],
            // Written as they are, below; a float would round them.
            Source::Samples => self.film.samples[pixel] as f32,
        }
    }
}

impl<'s, 'a: 's> WritableChannels<'s> for FilmChannels<'a> {
    type Writer = &'s Self;

    fn infer_channel_list(&self) -> ChannelList {
        ChannelList::new(
            self.channels
                .iter()
                .map(|(name, source)| {
                    let kind = match source {
                        Source::Samples => SampleType::U32,
                        _ => SampleType::F32,
                    };
                    ChannelDescription::new(name.as_str(), kind, true)
                })
                .collect(),
        )
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'s self, _header: &Header) -> Self::Writer {
        self
    }
}

impl ChannelsWriter for &FilmChannels<'_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let at = line.location;
            let first = at.position.y() * self.film.width + at.position.x();
            let source = self.channels[at.channel].1;
            // The line's buffer is exactly as long as its samples, so writing to it cannot fail.
            let written = match source {
                Source::Samples => line.write_samples(|i| self.film.samples[first + i]),
                _ => line.write_samples(|i| self.value(source, first + i)),
            };
            debug_assert!(written.is_ok());
        })
    }
}

#[cfg(test)]
mod tests {
    use exr::prelude::read_first_flat_layer_from_file;

    use super::super::test_support::{film, metadata, Folder};
    use super::*;

    #[test]
    fn channel_names_are_those_of_the_layout() {
        assert_eq!(spectral_channel(550.0), "S0.550,000000nm");
        assert_eq!(spectral_channel(1250.5), "S0.1250,500000nm");
        assert_eq!(spectral_channel(380.1234567), "S0.380,123457nm");
    }

    /// 4 + 2 · 83 channels, more than one block of 16 lines, wavelengths of three and four digits.
    #[test]
    fn every_value_comes_back_bit_for_bit() {
        let folder = Folder::new("exr");
        let mut grid: Vec<f64> = (0..81).map(|i| 380.0 + 5.0 * f64::from(i)).collect();
        grid.extend([999.5, 1000.25]);
        let mut film = film(13, 37, &grid);
        film.radiance[5 * 83 + 7] = f32::NAN;
        film.radiance[6 * 83 + 7] = f32::MIN_POSITIVE / 3.0;
        let path = folder.join("a.exr");
        write_exr(&path, &film, Observer::Cie1964, &metadata()).unwrap();

        let image = read_first_flat_layer_from_file(&path).unwrap();
        let layer = &image.layer_data;
        let find = |name: &str| {
            let channel = layer
                .channel_data
                .list
                .iter()
                .find(|c| c.name == *name)
                .unwrap_or_else(|| panic!("{name}"));
            channel
                .sample_data
                .values_as_f32()
                .map(f32::to_bits)
                .collect::<Vec<_>>()
        };
        assert_eq!(layer.channel_data.list.len(), 4 + 2 * 83);
        assert_eq!((layer.size.x(), layer.size.y()), (13, 37));
        for (k, &wavelength_nm) in grid.iter().enumerate() {
            let name = spectral_channel(wavelength_nm);
            let column = |values: &[f32]| -> Vec<u32> {
                values
                    .chunks(83)
                    .map(|spectrum| spectrum[k].to_bits())
                    .collect()
            };
            assert_eq!(find(&name), column(&film.radiance), "{name}");
            assert_eq!(find(&format!("variance.{name}")), column(&film.variance));
        }
        let preview = ColourImage::from_film(&film, Observer::Cie1964).unwrap();
        for (k, name) in ["R", "G", "B"].into_iter().enumerate() {
            let expected: Vec<u32> = preview.rgb.iter().map(|c| c[k].to_bits()).collect();
            assert_eq!(find(name), expected);
        }

        let attribute = |name: &str| layer.attributes.other[&Text::from(name)].clone();
        let string = |s: &str| AttributeValue::Text(Text::from_slice_unchecked(s.as_bytes()));
        assert_eq!(attribute("spectralLayoutVersion"), string("1.0"));
        assert_eq!(attribute("emissiveUnits"), string("W.m^-2.sr^-1.nm^-1"));
        assert_eq!(attribute("celaje.north"), string("up; east is left"));
        assert_eq!(attribute("celaje.place"), string("Mañón, 43.7° N"));
    }

    #[test]
    fn stokes_components_are_layers_of_their_own() {
        let folder = Folder::new("exr-stokes");
        let mut film = Film::new_polarised(2, 1, &[550.0]).unwrap();
        film.samples = vec![2, 2];
        film.radiance = vec![1.0, 2.0];
        film.variance = vec![0.1, 0.1];
        if let Some(p) = &mut film.polarisation {
            for (c, plane) in p.planes_mut().into_iter().enumerate() {
                plane.mean = vec![c as f32 + 0.25, c as f32 + 0.5];
                plane.variance = vec![c as f32, 0.5];
            }
        }
        let path = folder.join("a.exr");
        write_exr(&path, &film, Observer::Cie1931, &[]).unwrap();
        let image = read_first_flat_layer_from_file(&path).unwrap();
        let layer = &image.layer_data;
        // R, G, B, the paths behind each pixel, and four components with their variances.
        assert_eq!(layer.channel_data.list.len(), 3 + 1 + 8);
        let find = |name: &str| -> Vec<f32> {
            let mut list = layer.channel_data.list.iter();
            let channel = list.find(|c| c.name == *name).unwrap();
            channel.sample_data.values_as_f32().collect()
        };
        assert_eq!(find("S1.550,000000nm"), [0.25, 0.5]);
        assert_eq!(find("S3.550,000000nm"), [2.25, 2.5]);
        assert_eq!(find("variance.S2.550,000000nm"), [1.0, 0.5]);
        let handedness = &layer.attributes.other[&Text::from("polarisationHandedness")];
        assert_eq!(*handedness, AttributeValue::Text(Text::from("right")));
        if let Some(p) = &mut film.polarisation {
            p.u.variance.pop();
        }
        assert!(write_exr(&path, &film, Observer::Cie1931, &[]).is_err());
    }

    #[test]
    fn a_deterministic_film_has_no_variance_channels() {
        let folder = Folder::new("exr-plain");
        let mut film = film(4, 2, &[550.0]);
        film.variance.fill(0.0);
        let path = folder.join("a.exr");
        write_exr(&path, &film, Observer::Cie1931, &[]).unwrap();
        let image = read_first_flat_layer_from_file(&path).unwrap();
        let names: Vec<String> = image
            .layer_data
            .channel_data
            .list
            .iter()
            .map(|c| c.name.to_string())
            .collect();
        assert_eq!(names, ["B", "G", "R", "S0.550,000000nm", "samples"]);
    }
}
