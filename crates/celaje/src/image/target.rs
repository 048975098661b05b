//! Where a file goes: checks before any work is done, and writing that leaves no half file.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A file format, chosen by the extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics, for display.
    Png,
    /// OpenEXR, spectral and linear.
    Exr,
    /// Radiance RGBE, linear.
    Hdr,
    /// NetCDF, spectral, with the direction of each pixel.
    NetCdf,
}

/// What to do about an unknown extension.
const KNOWN: &str = "use .png, .exr, .hdr or .nc";

impl Format {
    /// The format that a file's extension names, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::File`] for another extension or none.
    pub fn of(path: &Path) -> Result<Self> {
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            Some("nc") => Ok(Self::NetCdf),
            Some(other) => Err(file_error(
                path,
                format!("no picture format has the extension '.{other}'"),
                KNOWN,
            )),
            None => Err(file_error(
                path,
                "the name has no extension to tell the format",
                KNOWN,
            )),
        }
    }
}

/// Makes sure, before any rendering, that a picture can be written to a path; returns its format.
///
/// The folder must exist and take new files (one is made and removed again); the path must not be a folder itself.
///
/// # Errors
/// [`Error::File`] with a hint.
pub fn check_target(path: &Path) -> Result<Format> {
    let format = Format::of(path)?;
    check_writable(path)?;
    Ok(format)
}

/// Makes sure that a file of any kind can be written to a path: as [`check_target`], whatever the extension.
///
/// # Errors
/// [`Error::File`] with a hint.
pub fn check_writable(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(file_error(path, "is a folder", "give the name of a file"));
    }
    TempFile::create(path).map(|_| ())
}

/// Writes text to a file, whole or not at all.
///
/// # Errors
/// [`Error::File`]; an older file of that name is then untouched.
pub fn save_text(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |out| out.write_all(text.as_bytes()))
}

/// Removes what this process has left half written beside a target, for a program that must end at once.
///
/// A file `sky.png` is written as `.sky.png.PID-N.tmp` in the same folder; every such file of this process goes, those
/// of others stay. A writer still at work finds its file gone and fails. Whatever cannot be removed is left.
pub fn remove_temporaries(target: &Path) {
    let start = temp_name_start(target);
    let start = start.as_encoded_bytes();
    let Ok(entries) = fs::read_dir(folder_of(target)) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.as_encoded_bytes();
        if name.starts_with(start) && name.ends_with(TEMP_END.as_bytes()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Writes a file under a temporary name in the same folder, then gives it its own name.
///
/// # Errors
/// [`Error::File`]; the temporary file is then removed and an older file of that name is untouched.
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<()> {
    let temp = TempFile::create(path)?;
    let written = (|| {
        let mut writer = BufWriter::new(&temp.file);
        write(&mut writer)?;
        writer.flush()?;
        drop(writer);
        // The name must not point to data that a crash could still lose.
        temp.file.sync_all()?;
        fs::rename(&temp.path, path)
    })();
    written.map_err(|e| io_error(path, &e))
}

/// A new file beside the target; removed when dropped, unless it has been renamed.
struct TempFile {
    file: File,
    path: PathBuf,
}

impl TempFile {
    fn create(target: &Path) -> Result<Self> {
        let folder = folder_of(target);
        if !folder.exists() {
            return Err(file_error(
                target,
                format!("the folder '{}' does not exist", folder.display()),
                "create the folder first",
            ));
        }
        if !folder.is_dir() {
            return Err(file_error(
                target,
                format!("'{}' is not a folder", folder.display()),
                "give a file inside a folder",
            ));
        }
        let mut attempt = 0;
        loop {
            let path = folder.join(temp_name(target, attempt));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok(Self { file, path }),
                Err(e) if e.kind() == ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
                Err(e) => return Err(io_error(target, &e)),
            }
        }
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        // After the rename there is nothing left under this name, and that is as it should be.
        let _ = fs::remove_file(&self.path);
    }
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    }
}

const TEMP_END: &str = ".tmp";

/// `.sky.png.1234-0.tmp`: hidden, unlike any picture, different for each process.
fn temp_name(target: &Path, attempt: u32) -> OsString {
    let mut name = temp_name_start(target);
    name.push(format!("{attempt}{TEMP_END}"));
    name
}

/// What all temporary names of this process for a target begin with: `.sky.png.1234-`.
fn temp_name_start(target: &Path) -> OsString {
    let mut name = OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(format!(".{}-", std::process::id()));
    name
}

pub(super) fn file_error(path: &Path, message: impl Into<String>, hint: &str) -> Error {
    Error::File {
        path: path.display().to_string(),
        message: message.into(),
        hint: hint.to_owned(),
    }
}

/// A system error in words, with what can be done about it.
pub(super) fn io_error(path: &Path, error: &io::Error) -> Error {
    let hint = match error.kind() {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "choose a folder that you may write to"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "free some space on the disk",
        _ => "choose another file or folder",
    };
    file_error(path, error.to_string(), hint)
}

#[cfg(test)]
mod tests {
    use super::super::test_support::Folder;
    use super::*;

    #[test]
    fn formats_follow_the_extension() {
        assert_eq!(Format::of(Path::new("a/b.PNG")).unwrap(), Format::Png);
        assert_eq!(Format::of(Path::new("b.x.exr")).unwrap(), Format::Exr);
        for bad in ["sky", "sky.jpg", "sky.", ".png"] {
            let e = Format::of(Path::new(bad)).unwrap_err();
            assert_eq!(e.hint(), KNOWN, "{bad}");
        }
    }

    #[test]
    fn a_bad_target_is_refused_and_nothing_is_left() {
        let folder = Folder::new("target");
        fs::write(folder.join("plain"), b"").unwrap();
        fs::create_dir(folder.join("dir.png")).unwrap();
        for bad in ["missing/a.png", "plain/a.png", "dir.png", "a.jpg"] {
            let e = check_target(&folder.join(bad)).unwrap_err();
            assert!(
                matches!(e, Error::File { .. }) && !e.hint().is_empty(),
                "{bad}"
            );
        }
        assert_eq!(check_target(&folder.join("a.png")).unwrap(), Format::Png);
        assert_eq!(folder.listing(), ["dir.png", "plain"]);
    }

    /// A folder nobody can write to, even the superuser of a container: the kernel's own.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_unwritable_folder_is_refused() {
        let e = check_target(Path::new("/proc/self/sky.png")).unwrap_err();
        assert!(matches!(e, Error::File { .. }), "{e}");
    }

    #[test]
    fn half_written_files_of_this_process_can_be_removed() {
        let folder = Folder::new("temporaries");
        let target = folder.join("a.png");
        let temp = TempFile::create(&target).unwrap();
        let other_process = ".a.png.1-0.tmp";
        let other_target = TempFile::create(&folder.join("b.png")).unwrap();
        for name in [other_process, "a.png"] {
            fs::write(folder.join(name), b"").unwrap();
        }
        assert_eq!(folder.listing().len(), 4);
        remove_temporaries(&target);
        assert!(!temp.path.exists() && other_target.path.exists());
        assert_eq!(folder.listing().len(), 3);
        remove_temporaries(&folder.join("missing/a.png"));
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = Folder::new("failed");
        fs::write(folder.join("a.png"), b"old").unwrap();
        let e = write_whole(&folder.join("a.png"), |w| {
            w.write_all(b"half a pict")?;
            Err(io::Error::from(ErrorKind::StorageFull))
        });
        assert_eq!(e.unwrap_err().hint(), "free some space on the disk");
        assert_eq!(fs::read(folder.join("a.png")).unwrap(), b"old");
        write_whole(&folder.join("a.png"), |w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(folder.join("a.png")).unwrap(), b"new");
        assert_eq!(folder.listing(), ["a.png"]);
    }
}
