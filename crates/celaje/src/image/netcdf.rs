//! Arrays with names, dimensions and units, to files in the classic NetCDF format.
//!
//! The format is the one with 64-bit offsets (`CDF\x02`), which everything that knows NetCDF has read since 2004. It is
//! so plain that writing it takes fewer lines than a library would ask for; see `docs/decisions` for why not NetCDF-4.
//!
//! # Source
//! NetCDF classic format specification, <https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html>.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use super::target::write_whole;
use crate::error::{Error, Result};

/// Largest variable of the format \[bytes\]: sizes are counted in 32 bits.
const VARIABLE_LIMIT_BYTES: u128 = (1 << 32) - 4;

/// Tags and types of the format.
const DIMENSIONS: u32 = 0x0a;
const VARIABLES: u32 = 0x0b;
const ATTRIBUTES: u32 = 0x0c;
const CHAR: u32 = 2;
const INT: u32 = 4;
const FLOAT: u32 = 5;
const DOUBLE: u32 = 6;

/// Value of an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// Words, such as a unit.
    Text(String),
    /// A number.
    Number(f64),
}

impl From<&str> for Attribute {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Attribute {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Attribute {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

/// Names and values of attributes, in the order of the file.
pub type Attributes = Vec<(String, Attribute)>;

/// The values of a variable, the last dimension running fastest.
pub enum Values<'a> {
    /// Single precision, each computed when it is written: no second copy of a large film is made.
    Singles(Box<dyn Fn(usize) -> f32 + 'a>),
    /// Double precision.
    Doubles(Cow<'a, [f64]>),
    /// Integers.
    Integers(Vec<i32>),
    /// Words, one per place; written as characters, with a dimension of their own for the length.
    Words(Vec<String>),
}

/// One array of a [`Dataset`].
pub struct Variable<'a> {
    /// Its name: letters, digits, `_`.
    pub name: String,
    /// Names of its dimensions, the slowest first; none for a single value.
    pub dimensions: Vec<&'static str>,
    /// `units`, `long_name`, `standard_name`, …
    pub attributes: Attributes,
    /// As many as the dimensions say.
    pub values: Values<'a>,
}

impl<'a> Variable<'a> {
    /// A variable of double precision with its unit and meaning.
    pub fn doubles(
        name: &str,
        dimensions: &[&'static str],
        (units, long_name): (&str, &str),
        values: impl Into<Cow<'a, [f64]>>,
    ) -> Self {
        Self::new(
            name,
            dimensions,
            (units, long_name),
            Values::Doubles(values.into()),
        )
    }

    /// A variable with its unit and meaning.
    pub fn new(
        name: &str,
        dimensions: &[&'static str],
        (units, long_name): (&str, &str),
        values: Values<'a>,
    ) -> Self {
        let mut attributes = vec![("long_name".to_owned(), long_name.into())];
        // Words have no unit (a pure number has the unit 1), but they have an encoding, as all readers know it.
        attributes.insert(
            0,
            match values {
                Values::Words(_) => ("_Encoding".to_owned(), "utf-8".into()),
                _ => ("units".to_owned(), units.into()),
            },
        );
        Self {
            name: name.to_owned(),
            dimensions: dimensions.to_vec(),
            attributes,
            values,
        }
    }

    /// The same with one more attribute.
    pub fn with(mut self, name: &str, value: impl Into<Attribute>) -> Self {
        self.attributes.push((name.to_owned(), value.into()));
        self
    }
}

/// Variables over shared dimensions, and what is to be said about all of them.
#[derive(Default)]
pub struct Dataset<'a> {
    /// Name and length of each dimension.
    pub dimensions: Vec<(&'static str, usize)>,
    /// Global attributes.
    pub attributes: Attributes,
    /// The arrays.
    pub variables: Vec<Variable<'a>>,
}

/// Writes a dataset, whole or not at all.
///
/// # Errors
/// [`Error::TooLarge`] for a variable beyond 4 GiB; [`Error::ShapeMismatch`] for values that do not fill their dimensions;
/// [`Error::File`] for anything that goes wrong with the file.
pub fn write_netcdf(path: &Path, dataset: &Dataset) -> Result<()> {
    let plan = Plan::new(dataset)?;
    write_whole(path, |out| plan.write(out))
}

/// A variable as it lies in the file.
struct Placed<'a> {
    variable: &'a Variable<'a>,
    /// Indices into [`Plan::dimensions`].
    dimensions: Vec<usize>,
    count: usize,
    /// Length of the longest word \[bytes\].
    word: usize,
}

impl Placed<'_> {
    fn kind(&self) -> (u32, usize) {
        match self.variable.values {
            Values::Singles(_) => (FLOAT, 4),
            Values::Doubles(_) => (DOUBLE, 8),
            Values::Integers(_) => (INT, 4),
            Values::Words(_) => (CHAR, self.word),
        }
    }

    /// Bytes in the file, padded.
    fn bytes(&self) -> u128 {
        padded(self.count as u128 * self.kind().1 as u128)
    }
}

fn padded(bytes: u128) -> u128 {
    bytes.div_ceil(4) * 4
}

/// Everything checked and counted.
struct Plan<'a> {
    dataset: &'a Dataset<'a>,
    dimensions: Vec<(String, usize)>,
    variables: Vec<Placed<'a>>,
}

impl<'a> Plan<'a> {
    fn new(dataset: &'a Dataset<'a>) -> Result<Self> {
        let own = dataset.dimensions.iter();
        let mut dimensions: Vec<(String, usize)> = own.map(|(n, l)| (n.to_string(), *l)).collect();
        let mut variables = Vec::new();
        for variable in &dataset.variables {
            let mut indices = Vec::new();
            let mut count = 1usize;
            for name in &variable.dimensions {
                let index = dimensions.iter().position(|(n, _)| n == name);
                let index = index.ok_or_else(|| unknown_dimension(name, dataset))?;
                count = count.saturating_mul(dimensions[index].1);
                indices.push(index);
            }
            check_count(variable, count)?;
            let mut word = 0;
            if let Values::Words(words) = &variable.values {
                word = words.iter().map(String::len).max().unwrap_or(0).max(1);
                let name = format!("string_{word}");
                let known = dimensions.iter().position(|(n, _)| *n == name);
                indices.push(known.unwrap_or(dimensions.len()));
                if known.is_none() {
                    dimensions.push((name, word));
                }
            }
            let placed = Placed {
                variable,
                dimensions: indices,
                count,
                word,
            };
            if placed.bytes() > VARIABLE_LIMIT_BYTES {
                return Err(Error::TooLarge {
                    what: format!("the variable {} of a NetCDF file", variable.name),
                    bytes: placed.bytes(),
                    limit_bytes: VARIABLE_LIMIT_BYTES,
                });
            }
            variables.push(placed);
        }
        Ok(Self {
            dataset,
            dimensions,
            variables,
        })
    }

    /// The header; with `header_bytes` of 0 it has the right length but wrong offsets.
    fn header(&self, header_bytes: u64) -> Vec<u8> {
        let mut out = b"CDF\x02".to_vec();
        // No record dimension.
        push_u32(&mut out, 0);
        push_list(&mut out, DIMENSIONS, self.dimensions.len());
        for (name, length) in &self.dimensions {
            push_text(&mut out, name);
            push_u32(&mut out, *length as u32);
        }
        push_attributes(&mut out, &self.dataset.attributes);
        push_list(&mut out, VARIABLES, self.variables.len());
        let mut begin = header_bytes;
        for placed in &self.variables {
            push_text(&mut out, &name_of(&placed.variable.name));
            push_u32(&mut out, placed.dimensions.len() as u32);
            placed
                .dimensions
                .iter()
                .for_each(|&d| push_u32(&mut out, d as u32));
            push_attributes(&mut out, &placed.variable.attributes);
            push_u32(&mut out, placed.kind().0);
            push_u32(&mut out, placed.bytes() as u32);
            out.extend(begin.to_be_bytes());
            begin += placed.bytes() as u64;
        }
        out
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let length = self.header(0).len() as u64;
        out.write_all(&self.header(length))?;
        for placed in &self.variables {
            match &placed.variable.values {
                Values::Singles(value) => {
                    for i in 0..placed.count {
                        out.write_all(&value(i).to_be_bytes())?;
                    }
                }
                Values::Doubles(values) => {
                    for value in values.iter() {
                        out.write_all(&value.to_be_bytes())?;
                    }
                }
                Values::Integers(values) => {
                    for value in values {
                        out.write_all(&value.to_be_bytes())?;
                    }
                }
                Values::Words(words) => {
                    for word in words {
                        let mut cell = word.clone().into_bytes();
                        cell.resize(placed.word, 0);
                        out.write_all(&cell)?;
                    }
                }
            }
            let used = placed.count as u128 * placed.kind().1 as u128;
            let padding = (placed.bytes() - used) as usize;
            out.write_all(&[0; 3][..padding])?;
        }
        Ok(())
    }
}

fn unknown_dimension(name: &str, dataset: &Dataset) -> Error {
    let known = dataset.dimensions.iter();
    Error::UnknownName {
        kind: "dimension",
        name: name.to_owned(),
        known: known.map(|(n, _)| n.to_string()).collect(),
    }
}

fn check_count(variable: &Variable, count: usize) -> Result<()> {
    let given = match &variable.values {
        Values::Singles(_) => return Ok(()),
        Values::Doubles(values) => values.len(),
        Values::Integers(values) => values.len(),
        Values::Words(words) => words.len(),
    };
    if given == count {
        return Ok(());
    }
    Err(Error::ShapeMismatch {
        name: variable.name.clone(),
        got: format!("({given},)"),
        expected: format!("({count},)"),
    })
}

fn push_u32(out: &mut Vec<u8>, value: u32) {
    out.extend(value.to_be_bytes());
}

/// Tag and number of a list; an empty one is two zeros.
fn push_list(out: &mut Vec<u8>, tag: u32, length: usize) {
    push_u32(out, if length == 0 { 0 } else { tag });
    push_u32(out, length as u32);
}

/// Length and bytes, padded with zeros.
fn push_text(out: &mut Vec<u8>, text: &str) {
    push_u32(out, text.len() as u32);
    out.extend(text.as_bytes());
    out.resize(out.len().div_ceil(4) * 4, 0);
}

fn push_attributes(out: &mut Vec<u8>, attributes: &Attributes) {
    push_list(out, ATTRIBUTES, attributes.len());
    for (name, value) in attributes {
        push_text(out, &name_of(name));
        match value {
            Attribute::Text(text) => {
                push_u32(out, CHAR);
                push_text(out, text);
            }
            Attribute::Number(number) => {
                push_u32(out, DOUBLE);
                push_u32(out, 1);
                out.extend(number.to_be_bytes());
            }
        }
    }
}

/// A name that every reader takes, as CF recommends: letters, digits and `_`, no digit first.
fn name_of(name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let mut legal: String = name.chars().map(plain).collect();
    if !legal.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        legal.insert_str(0, "x_");
    }
    legal
}

#[cfg(test)]
mod tests {
    use super::super::test_support::Folder;
    use super::*;

    fn dataset() -> Dataset<'static> {
        Dataset {
            dimensions: vec![("x", 3), ("kind", 2)],
            attributes: vec![("Conventions".into(), "CF-1.11".into())],
            variables: vec![
                Variable::doubles("x", &["x"], ("m", "length"), vec![1.0, 2.0, 4.0]),
                Variable::new(
                    "kind",
                    &["kind"],
                    ("", "kind"),
                    Values::Words(vec!["air".into(), "ozone".into()]),
                ),
                Variable::new(
                    "half",
                    &["kind", "x"],
                    ("1", "half the index"),
                    Values::Singles(Box::new(|i| 0.5 * i as f32)),
                )
                .with("scale", 2.0),
                Variable::new("n", &[], ("1", "one"), Values::Integers(vec![-7])),
            ],
        }
    }

    /// The bytes, as the specification lays them out, for the smallest file with everything of one kind in it.
    #[test]
    fn bytes_are_those_of_the_specification() {
        let folder = Folder::new("netcdf-bytes");
        let path = folder.join("a.nc");
        let small = Dataset {
            dimensions: vec![("x", 1)],
            attributes: Vec::new(),
            variables: vec![Variable {
                name: "v".into(),
                dimensions: vec!["x"],
                attributes: vec![("units".into(), "m".into())],
                values: Values::Integers(vec![258]),
            }],
        };
        write_netcdf(&path, &small).unwrap();
        #[rustfmt::skip]
        let expected: Vec<u8> = [
            b"CDF\x02".to_vec(), vec![0, 0, 0, 0],
            vec![0, 0, 0, 10, 0, 0, 0, 1], vec![0, 0, 0, 1, b'x', 0, 0, 0, 0, 0, 0, 1],
            vec![0; 8],
            vec![0, 0, 0, 11, 0, 0, 0, 1], vec![0, 0, 0, 1, b'v', 0, 0, 0],
            vec![0, 0, 0, 1, 0, 0, 0, 0],
            vec![0, 0, 0, 12, 0, 0, 0, 1], vec![0, 0, 0, 5], b"units\0\0\0".to_vec(),
            vec![0, 0, 0, 2, 0, 0, 0, 1, b'm', 0, 0, 0],
            vec![0, 0, 0, 4, 0, 0, 0, 4], vec![0, 0, 0, 0, 0, 0, 0, 108],
            vec![0, 0, 1, 2],
        ]
        .concat();
        assert_eq!(expected.len(), 112);
        assert_eq!(std::fs::read(&path).unwrap(), expected);
    }

    #[test]
    fn values_lie_where_the_header_says() {
        let folder = Folder::new("netcdf-values");
        let path = folder.join("a.nc");
        let dataset = dataset();
        write_netcdf(&path, &dataset).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let plan = Plan::new(&dataset).unwrap();
        assert_eq!(plan.dimensions[2], ("string_5".to_owned(), 5));
        let begin = plan.header(0).len();
        // Three doubles, ten characters and two of padding, six singles, an integer.
        assert_eq!(bytes.len(), begin + 24 + 12 + 24 + 4);
        assert_eq!(bytes[begin..begin + 8], 1f64.to_be_bytes());
        assert_eq!(&bytes[begin + 24..begin + 36], b"air\0\0ozone\0\0");
        assert_eq!(bytes[begin + 56..begin + 60], 2.5f32.to_be_bytes());
        assert_eq!(bytes[begin + 60..], (-7i32).to_be_bytes());
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let folder = Folder::new("netcdf-refused");
        let path = folder.join("a.nc");
        let mut short = dataset();
        short.dimensions[0].1 = 4;
        assert!(matches!(
            write_netcdf(&path, &short),
            Err(Error::ShapeMismatch { .. })
        ));
        let mut nameless = dataset();
        nameless.dimensions.remove(0);
        assert!(matches!(
            write_netcdf(&path, &nameless),
            Err(Error::UnknownName { .. })
        ));
        let huge = Dataset {
            dimensions: vec![("x", 1 << 30)],
            attributes: Vec::new(),
            variables: vec![Variable::new(
                "v",
                &["x"],
                ("1", "v"),
                Values::Singles(Box::new(|_| 0.0)),
            )],
        };
        assert!(matches!(
            write_netcdf(&path, &huge),
            Err(Error::TooLarge { .. })
        ));
        assert!(folder.listing().is_empty());
    }

    #[test]
    fn names_are_made_legal() {
        assert_eq!(name_of("aod_550.reason"), "aod_550_reason");
        assert_eq!(name_of("2nd µ"), "x_2nd__");
        assert_eq!(name_of(""), "x_");
    }
}
