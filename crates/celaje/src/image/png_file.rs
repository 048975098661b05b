//! PNG: what a display shows.

use std::io;
use std::path::Path;

use super::target::write_whole;
use super::Metadata;
use crate::colour::{ColourImage, Look};
use crate::error::Result;
use crate::film::Film;

/// Bits per channel of a PNG.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PngDepth {
    /// 8 bits.
    #[default]
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes a film as an RGBA PNG with an sRGB chunk; transparent black where the sensor sees nothing.
///
/// The metadata go into text chunks, names and values as they are.
///
/// # Errors
/// As [`super::save`].
pub fn write_png(
    path: &Path,
    film: &Film,
    look: &Look,
    depth: PngDepth,
    metadata: &Metadata,
) -> Result<()> {
    let image = ColourImage::from_film(film, look.observer)?;
    let values = image.display(look.tone, look.exposure)?;
    let values = values.iter().flatten();
    let bytes: Vec<u8> = match depth {
        PngDepth::Eight => values.map(|v| (v * 255.0).round() as u8).collect(),
        PngDepth::Sixteen => values
            .flat_map(|v| ((v * 65535.0).round() as u16).to_be_bytes())
            .collect(),
    };
    write_whole(path, |writer| {
        let width = u32::try_from(image.width).map_err(io::Error::other)?;
        let height = u32::try_from(image.height).map_err(io::Error::other)?;
        let mut encoder = png::Encoder::new(writer, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(match depth {
            PngDepth::Eight => png::BitDepth::Eight,
            PngDepth::Sixteen => png::BitDepth::Sixteen,
        });
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let software = format!("celaje {}", env!("CARGO_PKG_VERSION"));
        encoder.add_text_chunk("Software".to_owned(), software)?;
        for (name, value) in metadata {
            encoder.add_itxt_chunk(name.clone(), value.clone())?;
        }
        let mut image_writer = encoder.write_header()?;
        image_writer.write_image_data(&bytes)?;
        Ok(image_writer.finish()?)
    })
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::io::BufReader;

    use super::super::test_support::{film, metadata, Folder};
    use super::*;
    use crate::colour::{Exposure, Observer, ToneCurve};

    fn read(path: &Path) -> (png::OutputInfo, Vec<u8>, png::Info<'static>) {
        let decoder = png::Decoder::new(BufReader::new(File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut bytes).unwrap();
        (frame, bytes, reader.info().clone())
    }

    #[test]
    fn pixels_alpha_colour_space_and_text_come_back() {
        let folder = Folder::new("png");
        let film = film(5, 3, &[450.0, 550.0, 650.0]);
        let look = Look {
            observer: Observer::Cie1931,
            tone: ToneCurve::Srgb,
            exposure: Exposure::Ev(10.0),
        };
        let shown = ColourImage::from_film(&film, look.observer)
            .unwrap()
            .display(look.tone, look.exposure)
            .unwrap();
        for depth in [PngDepth::Eight, PngDepth::Sixteen] {
            let path = folder.join("a.png");
            write_png(&path, &film, &look, depth, &metadata()).unwrap();
            let (frame, bytes, info) = read(&path);
            assert_eq!((frame.width, frame.height), (5, 3));
            assert_eq!(frame.color_type, png::ColorType::Rgba);
            assert_eq!(
                info.srgb,
                Some(png::SrgbRenderingIntent::RelativeColorimetric)
            );
            assert_eq!(info.utf8_text[1].keyword, "place");
            assert_eq!(info.utf8_text[1].get_text().unwrap(), "Mañón, 43.7° N");
            let (scale, values): (f32, Vec<u16>) = match depth {
                PngDepth::Eight => (255.0, bytes.iter().map(|&b| u16::from(b)).collect()),
                PngDepth::Sixteen => (
                    65535.0,
                    bytes
                        .chunks(2)
                        .map(|b| u16::from_be_bytes([b[0], b[1]]))
                        .collect(),
                ),
            };
            assert_eq!(values[..4], [0; 4]);
            for (value, expected) in values.iter().zip(shown.iter().flatten()) {
                assert!((f32::from(*value) - expected * scale).abs() <= 0.51);
            }
            assert!(values[4] > 0 && f32::from(values[7]) == scale);
        }
    }
}
