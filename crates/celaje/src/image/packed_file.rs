//! A file of celaje's own: a header, then bytes, compressed and checked.
//!
//! ```text
//! 0   8  89 'c' 'e' 'l' 'a' 'j' 'e' 0A   what it is
//! 8   4  version of the layout
//! 12  8  length of the compressed bytes
//! 20  8  their length when unpacked
//! 28  4  CRC-32 of the 20 bytes before and of the compressed bytes
//! 32  …  zlib (RFC 1950)
//! ```
//!
//! All numbers are little endian. A file is refused, with the reason, unless every part of it fits.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use flate2::{Compression, Crc};

use super::target::{file_error, io_error, write_whole};
use crate::error::Result;

/// The first bytes: the high bit and the line feed do not survive a transfer as text.
const MAGIC: [u8; 8] = *b"\x89celaje\n";
/// Version of the layout, of this header and of what is inside.
const VERSION: u32 = 2;
const HEADER: usize = 32;
/// The most that a file may unpack to \[bytes\]; ours are some ten million.
const MOST_UNPACKED: u64 = 4 << 30;

const BAKE_AGAIN: &str = "make it again with celaje bake";
const NONE_OF_OURS: &str = "give the name of a file that celaje bake has made";

/// Writes bytes to a file, compressed, whole or not at all.
///
/// # Errors
/// [`crate::Error::File`].
pub fn write_packed(path: &Path, bytes: &[u8]) -> Result<()> {
    let failed = |e| io_error(path, &e);
    // The planes of floats compress in their leading bytes only; more effort finds hardly more.
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).map_err(failed)?;
    let packed = encoder.finish().map_err(failed)?;

    let mut header = Vec::with_capacity(HEADER);
    header.extend(MAGIC);
    header.extend(VERSION.to_le_bytes());
    header.extend((packed.len() as u64).to_le_bytes());
    header.extend((bytes.len() as u64).to_le_bytes());
    header.extend(checksum(&header[8..], &packed).to_le_bytes());
    write_whole(path, |writer| {
        writer.write_all(&header)?;
        writer.write_all(&packed)
    })
}

/// The bytes of a file that [`write_packed`] wrote.
///
/// # Errors
/// [`crate::Error::File`] for a file that cannot be read, is none of ours, is of another version, is cut short or longer
/// than it says, or is damaged.
pub fn read_packed(path: &Path) -> Result<Vec<u8>> {
    let refused = |message: String| file_error(path, message, BAKE_AGAIN);
    let mut file = File::open(path).map_err(|e| file_error(path, e.to_string(), NONE_OF_OURS))?;
    let mut header = Vec::with_capacity(HEADER);
    let failed = |e: std::io::Error| refused(format!("cannot be read: {e}"));
    (&mut file)
        .take(HEADER as u64)
        .read_to_end(&mut header)
        .map_err(failed)?;
    if header.len() < MAGIC.len() || header[..8] != MAGIC {
        return Err(file_error(path, "holds no tables of celaje", NONE_OF_OURS));
    }
    let Some([version, packed, unpacked, check]) = fields(&header) else {
        return Err(refused(format!(
            "is cut short: {} bytes, and the header alone has {HEADER}",
            header.len()
        )));
    };
    if version != u64::from(VERSION) {
        return Err(refused(format!(
            "has layout {version}; this celaje, {}, reads layout {VERSION}",
            env!("CARGO_PKG_VERSION")
        )));
    }
    let mut body = Vec::new();
    file.read_to_end(&mut body).map_err(failed)?;
    let got = body.len() as u64;
    if got < packed {
        return Err(refused(format!(
            "is cut short: {got} of {packed} bytes are there"
        )));
    }
    if got > packed {
        return Err(refused(format!("has {} bytes after its end", got - packed)));
    }
    if u64::from(checksum(&header[8..HEADER - 4], &body)) != check || unpacked > MOST_UNPACKED {
        return Err(refused(
            "is damaged: its checksum does not fit its content".to_owned(),
        ));
    }
    let mut bytes = Vec::new();
    ZlibDecoder::new(body.as_slice())
        .take(unpacked + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| refused(format!("is damaged: {e}")))?;
    if bytes.len() as u64 != unpacked {
        return Err(refused(format!(
            "is damaged: it unpacks to {} bytes, not {unpacked}",
            bytes.len()
        )));
    }
    Ok(bytes)
}

fn checksum(lengths: &[u8], packed: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(lengths);
    crc.update(packed);
    crc.sum()
}

/// Version, both lengths and the checksum of a whole header.
fn fields(header: &[u8]) -> Option<[u64; 4]> {
    let short = |at: usize| Some(u32::from_le_bytes(header.get(at..at + 4)?.try_into().ok()?));
    let long = |at: usize| Some(u64::from_le_bytes(header.get(at..at + 8)?.try_into().ok()?));
    Some([short(8)?.into(), long(12)?, long(20)?, short(28)?.into()])
}

#[cfg(test)]
mod tests {
    use super::super::test_support::Folder;
    use super::*;

    fn refusal(path: &Path) -> String {
        read_packed(path).unwrap_err().to_string()
    }

    #[test]
    fn bytes_come_back_and_nothing_else_is_left() {
        let folder = Folder::new("packed");
        let path = folder.join("a.celaje");
        let bytes: Vec<u8> = (0..100_000u32).map(|i| (i / 7) as u8).collect();
        write_packed(&path, &bytes).unwrap();
        write_packed(&path, &bytes).unwrap();
        assert_eq!(read_packed(&path).unwrap(), bytes);
        assert!(std::fs::metadata(&path).unwrap().len() < 50_000);
        assert_eq!(folder.listing(), ["a.celaje"]);
        write_packed(&path, &[]).unwrap();
        assert!(read_packed(&path).unwrap().is_empty());
    }

    /// A hostile file is refused with its own reason: each byte flipped, each length cut, another version, more bytes.
    #[test]
    fn whatever_is_wrong_is_told() {
        let folder = Folder::new("hostile");
        let path = folder.join("a.celaje");
        write_packed(&path, b"some bytes, some bytes, some bytes").unwrap();
        let good = std::fs::read(&path).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 0x10;
            std::fs::write(&path, &bad).unwrap();
            assert!(read_packed(&path).is_err(), "byte {at}");
            std::fs::write(&path, &good[..at]).unwrap();
            assert!(read_packed(&path).is_err(), "cut at {at}");
        }
        let written = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            refusal(&path)
        };
        assert!(written(b"PNG").contains("holds no tables"));
        assert!(written(&good[..20]).contains("cut short"));
        assert!(written(&good[..good.len() - 1]).contains("cut short"));
        assert!(written(&[&good[..], b"x"].concat()).contains("1 bytes after its end"));
        let mut other = good.clone();
        other[8] = 9;
        assert!(written(&other).contains("layout 9"));
        let mut damaged = good.clone();
        damaged[HEADER + 5] ^= 1;
        assert!(written(&damaged).contains("damaged"));
        // Lengths that would take all memory: refused by the checksum, which covers them.
        let mut huge = good;
        huge[20..28].fill(0xff);
        assert!(written(&huge).contains("damaged"));
        assert!(refusal(&folder.join("missing")).contains("missing"));
    }
}
