//! Animations: PNG files of many frames, which browsers play and older programs show the first frame of.
//!
//! The layout is that of the PNG specification, third edition (W3C 2025), section 11.3.6: a chunk `acTL` says how many frames
//! there are, a chunk `fcTL` goes before each, and frames after the first are in chunks `fdAT`.

use std::io::{self, Write};
use std::path::Path;

use super::target::write_whole;
use super::Metadata;
use crate::error::{check_range, Error, Result};

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// The frames of an animation, compressed as they come; they all go into the file at once, so that it is whole however
/// many there are.
#[derive(Debug, Clone)]
pub struct Animation {
    width: u32,
    height: u32,
    /// Data of each frame, as a stream of zlib.
    frames: Vec<Vec<u8>>,
}

impl Animation {
    /// An animation without frames.
    ///
    /// # Arguments
    /// * `width`, `height` — pixels, 1 to 2³¹ − 1
    ///
    /// # Errors
    /// [`Error::OutOfRange`].
    pub fn new(width: usize, height: usize) -> Result<Self> {
        let side = |name: &str, pixels: usize| {
            check_range(name, pixels as f64, "pixels", 1.0..=f64::from(i32::MAX))?;
            Ok::<u32, Error>(pixels as u32)
        };
        Ok(Self {
            width: side("width", width)?,
            height: side("height", height)?,
            frames: Vec::new(),
        })
    }

    /// Frames so far.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is no frame as yet.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// Adds a frame.
    ///
    /// # Arguments
    /// * `rgba` — as [`crate::colour::ColourImage::display`] gives them, in [0, 1], shape (height · width,)
    ///
    /// # Errors
    /// [`Error::ShapeMismatch`].
    pub fn push(&mut self, rgba: &[[f32; 4]]) -> Result<()> {
        let pixels = self.width as usize * self.height as usize;
        if rgba.len() != pixels {
            return Err(Error::ShapeMismatch {
                name: "frame".into(),
                got: format!("({},)", rgba.len()),
                expected: format!("({pixels},)"),
            });
        }
        let bytes: Vec<u8> = rgba
            .iter()
            .flatten()
            .map(|v| (v * 255.0).round() as u8)
            .collect();
        let unlikely = |e: png::EncodingError| Error::invalid(format!("a frame: {e}"), "");
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(unlikely)?;
        writer.write_image_data(&bytes).map_err(unlikely)?;
        writer.finish().map_err(unlikely)?;
        self.frames.push(image_data(&file));
        Ok(())
    }

    /// Writes the file, whole or not at all: it plays in a loop, and each frame is shown for the same time.
    ///
    /// # Arguments
    /// * `frames_per_second` — 1 to 1000
    ///
    /// # Errors
    /// [`Error::OutOfRange`]; [`Error::Invalid`] without a frame; [`Error::File`].
    pub fn save(&self, path: &Path, frames_per_second: u16, metadata: &Metadata) -> Result<()> {
        let rate = f64::from(frames_per_second);
        check_range("frames per second", rate, "s^-1", 1.0..=1000.0)?;
        let Some((first, rest)) = self.frames.split_first() else {
            return Err(Error::invalid("an animation without a frame", "add one"));
        };
        let too_many = |_| Error::invalid("an animation of too many frames", "make two of it");
        let count = u32::try_from(self.frames.len()).map_err(too_many)?;
        let write = |w: &mut dyn Write| -> io::Result<()> {
            w.write_all(&SIGNATURE)?;
            let size = [self.width.to_be_bytes(), self.height.to_be_bytes()].concat();
            // 8 bits, RGBA, the only compression and filtering there are, not interlaced.
            chunk(w, b"IHDR", &[&size[..], &[8, 6, 0, 0, 0]].concat())?;
            // Relative colorimetric, as in a still picture.
            chunk(w, b"sRGB", &[1])?;
            chunk(w, b"acTL", &[count.to_be_bytes(), [0; 4]].concat())?;
            for (name, value) in metadata {
                // Keyword, no compression, no language, no translation.
                let text = [name.as_bytes(), &[0; 5], value.as_bytes()].concat();
                chunk(w, b"iTXt", &text)?;
            }
            let mut sequence = 0u32;
            let mut next = || {
                sequence += 1;
                (sequence - 1).to_be_bytes()
            };
            let control = |sequence: [u8; 4]| {
                let offset = [0; 8];
                let delay = [1u16.to_be_bytes(), frames_per_second.to_be_bytes()].concat();
                // Leave the frame, write over the one before.
                [&sequence, &size[..], &offset, &delay, &[0, 0]].concat()
            };
            chunk(w, b"fcTL", &control(next()))?;
            chunk(w, b"IDAT", first)?;
            for frame in rest {
                chunk(w, b"fcTL", &control(next()))?;
                chunk(w, b"fdAT", &[&next()[..], frame].concat())?;
            }
            chunk(w, b"IEND", &[])
        };
        write_whole(path, |w| write(w))
    }
}

/// Length, name, data, checksum.
fn chunk(w: &mut dyn Write, name: &[u8; 4], data: &[u8]) -> io::Result<()> {
    let length = u32::try_from(data.len()).map_err(io::Error::other)?;
    let mut crc = flate2::Crc::new();
    crc.update(name);
    crc.update(data);
    w.write_all(&length.to_be_bytes())?;
    w.write_all(name)?;
    w.write_all(data)?;
    w.write_all(&crc.sum().to_be_bytes())
}

/// The data of all `IDAT` chunks of a PNG file.
fn image_data(file: &[u8]) -> Vec<u8> {
    let mut data = Vec::new();
    let mut rest = &file[SIGNATURE.len().min(file.len())..];
    while let Some((head, after)) = rest.split_at_checked(8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let Some((content, after)) = after.split_at_checked(length) else {
            break;
        };
        if &head[4..] == b"IDAT" {
            data.extend(content);
        }
        rest = after.get(4..).unwrap_or(&[]);
    }
    data
}

#[cfg(test)]
mod tests {
    use super::super::test_support::{metadata, Folder};
    use super::*;

    /// A library that is not ours reads every frame, its delay and the text as they were put in.
    #[test]
    fn frames_come_back() {
        let folder = Folder::new("animation");
        let path = folder.join("a.png");
        let frame =
            |k: usize| -> Vec<[f32; 4]> { (0..12).map(|i| [(i * k) as f32 / 60.0; 4]).collect() };
        let mut animation = Animation::new(4, 3).unwrap();
        assert!(animation.save(&path, 30, &[]).is_err());
        for k in 0..5 {
            animation.push(&frame(k)).unwrap();
        }
        assert!(animation.push(&frame(0)[1..]).is_err());
        assert_eq!(animation.len(), 5);
        animation.save(&path, 25, &metadata()).unwrap();
        assert!(animation.save(&path, 0, &[]).is_err());
        assert_eq!(folder.listing(), ["a.png"]);

        let bytes = std::fs::read(&path).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (5, 0));
        assert_eq!(reader.info().utf8_text.len(), metadata().len());
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        for k in 0..5 {
            reader.next_frame(&mut buffer).unwrap();
            let timing = reader.info().frame_control().unwrap();
            assert_eq!((timing.delay_num, timing.delay_den), (1, 25));
            let expected: Vec<u8> = frame(k)
                .iter()
                .flatten()
                .map(|v| (v * 255.0).round() as u8)
                .collect();
            assert_eq!(buffer, expected, "frame {k}");
        }
        assert!(Animation::new(0, 3).is_err());
    }
}
