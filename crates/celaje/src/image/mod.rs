//! Films to files: PNG, EXR, HDR, NetCDF; and other files that are data.
//!
//! | file | holds | scale |
//! |---|---|---|
//! | `.png` | what a display shows: tone curve and exposure applied, RGBA | 0–1 |
//! | `.exr` | linear sRGB for a preview, and the spectral radiance at every wavelength, as computed | cd m⁻²; W m⁻² sr⁻¹ nm⁻¹ |
//! | `.hdr` | linear sRGB | cd m⁻² |
//! | `.nc` | the spectral radiance at every wavelength with its variance, where each pixel looks | W m⁻² sr⁻¹ nm⁻¹ |
//!
//! Beside pictures: [`Animation`], a `.png` of many frames, and [`write_packed`], a file of celaje's own.
//!
//! A file appears whole or not at all: it is written under a temporary name in the same folder and then renamed.

mod animation;
mod checkpoint;
mod exr_file;
mod exr_read;
mod film_dataset;
mod hdr_file;
mod merged;
pub mod netcdf;
mod packed_file;
mod png_file;
pub mod svg;
mod target;

use std::path::Path;

pub use animation::Animation;
pub use checkpoint::{read_checkpoint, remove_checkpoint, write_checkpoint};
pub use exr_file::{spectral_channel, write_exr};
pub use exr_read::read_exr;
pub use film_dataset::{circumstances, global_attributes, CONVENTIONS};
pub use hdr_file::write_hdr;
pub use merged::{merged, Described};
pub use packed_file::{read_packed, write_packed};
pub use png_file::{write_png, PngDepth};
pub use target::{check_target, check_writable, remove_temporaries, save_text, Format};

use crate::colour::Look;
use crate::error::Result;
use crate::film::Film;
use crate::sensor::Sensor;

/// Names and values kept in a file beside the picture: the conditions, the seed, what the sensor says of itself.
pub type Metadata = [(String, String)];

/// Writes a film in the format that the file's extension names.
///
/// PNG with 8 bits; EXR with the variances if the film has any. The look's tone and exposure concern PNG only; the
/// sensor, if there is one, tells NetCDF where each pixel looks.
///
/// # Errors
/// [`crate::Error::File`] for anything that goes wrong with the file, none of which is then left; what
/// [`crate::colour::ColourImage`] refuses.
pub fn save(
    path: &Path,
    film: &Film,
    look: &Look,
    view: Option<&dyn Sensor>,
    metadata: &Metadata,
) -> Result<()> {
    match Format::of(path)? {
        Format::Png => write_png(path, film, look, PngDepth::Eight, metadata),
        Format::Exr => write_exr(path, film, look.observer, metadata),
        Format::Hdr => write_hdr(path, film, look.observer, metadata),
        Format::NetCdf => {
            let dataset = film_dataset::film_dataset(film, view, metadata)?;
            netcdf::write_netcdf(path, &dataset)
        }
    }
}

#[cfg(test)]
pub(crate) mod test_support {
    use std::path::{Path, PathBuf};

    use crate::film::Film;

    /// A folder of its own for one test, removed with everything in it afterwards.
    pub struct Folder(pub PathBuf);

    impl Folder {
        pub fn new(test: &str) -> Self {
            let path = std::env::temp_dir().join(format!("celaje-{test}-{}", std::process::id()));
            std::fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        pub fn join(&self, name: &str) -> PathBuf {
            self.0.join(name)
        }

        /// Names in the folder, sorted.
        pub fn listing(&self) -> Vec<String> {
            listing(&self.0)
        }
    }

    fn listing(path: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(path)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    /// A film whose every value is different, whose first pixel is not seen, with odd sizes.
    pub fn film(width: usize, height: usize, wavelength_nm: &[f64]) -> Film {
        let mut film = Film::new(width, height, wavelength_nm).unwrap();
        let n = wavelength_nm.len();
        for pixel in 1..width * height {
            film.samples[pixel] = 7;
            for k in 0..n {
                let value = (1.0 + (pixel * n + k) as f32).sqrt() * 1e-3;
                film.radiance[pixel * n + k] = value;
                film.variance[pixel * n + k] = value * value * 1e-4;
            }
        }
        film
    }

    pub fn metadata() -> Vec<(String, String)> {
        vec![
            ("north".to_owned(), "up; east is left".to_owned()),
            ("place".to_owned(), "Mañón, 43.7° N".to_owned()),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::test_support::{film, metadata, Folder};
    use super::*;

    #[test]
    fn every_format_is_written_and_leaves_nothing_else() {
        let folder = Folder::new("save");
        let film = film(5, 4, &[450.0, 550.0, 650.0]);
        for name in ["a.png", "b.EXR", "c.hdr", "d.nc"] {
            save(
                &folder.join(name),
                &film,
                &Look::default(),
                None,
                &metadata(),
            )
            .unwrap();
            // Writing over an older file is allowed.
            save(
                &folder.join(name),
                &film,
                &Look::default(),
                None,
                &metadata(),
            )
            .unwrap();
        }
        assert_eq!(folder.listing(), ["a.png", "b.EXR", "c.hdr", "d.nc"]);
    }

    #[test]
    fn a_refused_film_leaves_the_old_file_alone() {
        let folder = Folder::new("refused");
        let mut broken = film(5, 4, &[450.0, 550.0]);
        broken.radiance.pop();
        for name in ["a.png", "b.exr", "c.hdr", "d.nc"] {
            std::fs::write(folder.join(name), b"old").unwrap();
            assert!(save(&folder.join(name), &broken, &Look::default(), None, &[]).is_err());
            assert_eq!(std::fs::read(folder.join(name)).unwrap(), b"old");
        }
        assert_eq!(folder.listing(), ["a.png", "b.exr", "c.hdr", "d.nc"]);
    }
}
