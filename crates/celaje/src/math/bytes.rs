//! Values to bytes and back: little endian, and nothing read is trusted to be as long as it says.

use crate::error::{Error, Result};

/// Appends values to a row of bytes.
#[derive(Debug, Clone, Default)]
pub struct ByteWriter {
    bytes: Vec<u8>,
}

impl ByteWriter {
    /// Nothing written so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// All that was written.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// A whole number.
    pub fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// A count or an index.
    pub fn count(&mut self, value: usize) {
        self.u64(value as u64);
    }

    /// A number of 64 bits.
    pub fn f64(&mut self, value: f64) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// Numbers of 64 bits, their count first. All first bytes come first, then all second ones, and so on: neighbours
    /// share their leading bytes, so that a compressor finds more.
    pub fn f64s(&mut self, values: &[f64]) {
        self.count(values.len());
        for byte in 0..8 {
            self.bytes
                .extend(values.iter().map(|v| v.to_le_bytes()[byte]));
        }
    }

    /// Numbers of 32 bits, in the manner of [`ByteWriter::f64s`].
    pub fn f32s(&mut self, values: &[f32]) {
        self.count(values.len());
        for byte in 0..4 {
            self.bytes
                .extend(values.iter().map(|v| v.to_le_bytes()[byte]));
        }
    }

    /// Counts or indices, their number first.
    pub fn counts(&mut self, values: &[usize]) {
        self.count(values.len());
        for &v in values {
            self.count(v);
        }
    }

    /// Text, its length in bytes first.
    pub fn text(&mut self, text: &str) {
        self.count(text.len());
        self.bytes.extend(text.as_bytes());
    }
}

/// Takes values from a row of bytes, in the order in which [`ByteWriter`] put them there.
#[derive(Debug, Clone)]
pub struct ByteReader<'a> {
    rest: &'a [u8],
}

impl<'a> ByteReader<'a> {
    /// Begins at the first byte.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Makes sure that nothing is left.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn finish(self) -> Result<()> {
        if self.rest.is_empty() {
            return Ok(());
        }
        Err(broken(format!(
            "{} bytes are left after the last value",
            self.rest.len()
        )))
    }

    /// A whole number.
    ///
    /// # Errors
    /// [`Error::Invalid`] where the bytes end too early; so do all others below.
    pub fn u64(&mut self) -> Result<u64> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// A count or an index.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn count(&mut self) -> Result<usize> {
        let value = self.u64()?;
        usize::try_from(value).map_err(|_| broken(format!("a count of {value} is too large")))
    }

    /// A number of 64 bits.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn f64(&mut self) -> Result<f64> {
        Ok(f64::from_le_bytes(self.array()?))
    }

    /// Numbers of 64 bits.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn f64s(&mut self) -> Result<Vec<f64>> {
        let (n, planes) = self.planes(8)?;
        let value = |i: usize| f64::from_le_bytes(std::array::from_fn(|b| planes[b * n + i]));
        Ok((0..n).map(value).collect())
    }

    /// Numbers of 32 bits.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn f32s(&mut self) -> Result<Vec<f32>> {
        let (n, planes) = self.planes(4)?;
        let value = |i: usize| f32::from_le_bytes(std::array::from_fn(|b| planes[b * n + i]));
        Ok((0..n).map(value).collect())
    }

    /// Counts or indices.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn counts(&mut self) -> Result<Vec<usize>> {
        let n = self.count()?;
        // Each takes 8 bytes: a number beyond what is left is refused before memory is asked for.
        if n > self.rest.len() / 8 {
            return Err(too_short());
        }
        (0..n).map(|_| self.count()).collect()
    }

    /// Text.
    ///
    /// # Errors
    /// [`Error::Invalid`], also for what is not UTF-8.
    pub fn text(&mut self) -> Result<String> {
        let n = self.count()?;
        let bytes = self.take(n)?.to_vec();
        String::from_utf8(bytes).map_err(|_| broken("a text is not UTF-8"))
    }

    /// Number of values and their bytes, plane by plane.
    fn planes(&mut self, width: usize) -> Result<(usize, &'a [u8])> {
        let n = self.count()?;
        let bytes = n.checked_mul(width).ok_or_else(too_short)?;
        Ok((n, self.take(bytes)?))
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let bytes = self.take(N)?;
        <[u8; N]>::try_from(bytes).map_err(|_| too_short())
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n).ok_or_else(too_short)?;
        self.rest = rest;
        Ok(taken)
    }
}

fn too_short() -> Error {
    broken("it ends in the middle of a value")
}

fn broken(message: impl Into<String>) -> Error {
    Error::invalid(message, "bake it again")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written() -> Vec<u8> {
        let mut w = ByteWriter::new();
        w.u64(7);
        w.f64(-1.5e-300);
        w.f64s(&[1.0, f64::MIN_POSITIVE, -3.25]);
        w.f32s(&[0.1, -2e30]);
        w.counts(&[3, 0]);
        w.text("σ, m⁻¹");
        w.into_bytes()
    }

    #[test]
    fn what_was_written_comes_back() {
        let bytes = written();
        let mut r = ByteReader::new(&bytes);
        assert_eq!(r.u64().unwrap(), 7);
        assert_eq!(r.f64().unwrap(), -1.5e-300);
        assert_eq!(r.f64s().unwrap(), [1.0, f64::MIN_POSITIVE, -3.25]);
        assert_eq!(r.f32s().unwrap(), [0.1, -2e30]);
        assert_eq!(r.counts().unwrap(), [3, 0]);
        assert_eq!(r.text().unwrap(), "σ, m⁻¹");
        r.finish().unwrap();
    }

    /// Cut anywhere, some value is missing; and lengths beyond all memory are refused, not asked for.
    #[test]
    fn nothing_is_read_beyond_the_end() {
        let bytes = written();
        for end in 0..bytes.len() {
            let mut r = ByteReader::new(&bytes[..end]);
            let all = (|| {
                r.u64()?;
                r.f64()?;
                r.f64s()?;
                r.f32s()?;
                r.counts()?;
                r.text()
            })();
            assert!(all.is_err(), "{end}");
        }
        let huge = u64::MAX.to_le_bytes();
        assert!(ByteReader::new(&huge).f64s().is_err());
        assert!(ByteReader::new(&huge).f32s().is_err());
        assert!(ByteReader::new(&huge).counts().is_err());
        assert!(ByteReader::new(&huge).text().is_err());
        assert!(ByteReader::new(&[0]).finish().is_err());
    }
}
