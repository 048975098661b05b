//! Small tables of numbers and words, embedded in the library as CSV text.

use crate::error::{Error, Result};

/// A table read from CSV text: `#` comment lines, one header line, then rows of plain cells.
///
/// Cells are separated by commas and trimmed; there is no quoting. Columns are asked for by name.
///
/// ```
/// # use celaje::math::Table;
/// let table = Table::parse("colours", "# comment\nname,wavelength_nm\nblue,450\nred,650\n")?;
/// assert_eq!(table.words("name")?, ["blue", "red"]);
/// assert_eq!(table.numbers("wavelength_nm")?, [450.0, 650.0]);
/// # Ok::<(), celaje::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Table<'a> {
    name: &'a str,
    header: Vec<&'a str>,
    rows: Vec<Vec<&'a str>>,
}

impl<'a> Table<'a> {
    /// Reads a table; `name` is what error messages call it.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no header or a row has not as many cells as the header.
    pub fn parse(name: &'a str, text: &'a str) -> Result<Self> {
        let mut lines = text
            .lines()
            .map(str::trim)
            .enumerate()
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let Some((_, header)) = lines.next() else {
            return Err(Self::error(name, "it has no header line".to_owned()));
        };
        let header = split(header);
        let mut rows = Vec::new();
        for (number, line) in lines {
            let row = split(line);
            if row.len() != header.len() {
                let (got, expected) = (row.len(), header.len());
                return Err(Self::error(
                    name,
                    format!("line {} has {got} cells, not {expected}", number + 1),
                ));
            }
            rows.push(row);
        }
        Ok(Self { name, header, rows })
    }

    /// Names of the columns, from left to right.
    pub fn header(&self) -> &[&'a str] {
        &self.header
    }

    /// Number of rows below the header.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row below the header.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The cells of one column as they are written.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if there is no such column.
    pub fn words(&self, column: &str) -> Result<Vec<&'a str>> {
        let Some(index) = self.header.iter().position(|h| *h == column) else {
            return Err(Error::UnknownName {
                kind: "column",
                name: column.to_owned(),
                known: self.header.iter().map(|h| (*h).to_owned()).collect(),
            });
        };
        Ok(self.rows.iter().map(|row| row[index]).collect())
    }

    /// The cells of one column as finite numbers.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if there is no such column; [`Error::Invalid`] if a cell is not a finite number.
    pub fn numbers(&self, column: &str) -> Result<Vec<f64>> {
        self.words(column)?
            .into_iter()
            .map(|cell| match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(Self::error(
                    self.name,
                    format!("'{cell}' in column {column} is not a number"),
                )),
            })
            .collect()
    }

    /// The rows whose cell in `column` is `word`.
    ///
    /// # Errors
    /// [`Error::UnknownName`] if there is no such column.
    pub fn select(&self, column: &str, word: &str) -> Result<Self> {
        let keep = self.words(column)?;
        let rows = self.rows.iter().zip(keep);
        Ok(Self {
            name: self.name,
            header: self.header.clone(),
            rows: rows
                .filter(|(_, cell)| *cell == word)
                .map(|(row, _)| row.clone())
                .collect(),
        })
    }

    fn error(name: &str, what: String) -> Error {
        Error::invalid(
            format!("table {name}: {what}"),
            "restore the table as it was shipped",
        )
    }
}

fn split(line: &str) -> Vec<&str> {
    line.split(',').map(str::trim).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# a comment\n\nkind, x ,y\na,1,2e3\n# between\nb,-4.5,7\na,3,8\n";

    #[test]
    fn columns_are_found_by_name() {
        let table = Table::parse("test", TEXT).unwrap();
        assert_eq!(table.header(), ["kind", "x", "y"]);
        assert_eq!(table.len(), 3);
        assert!(!table.is_empty());
        assert_eq!(table.numbers("x").unwrap(), [1.0, -4.5, 3.0]);
        assert_eq!(table.words("kind").unwrap(), ["a", "b", "a"]);
        let a = table.select("kind", "a").unwrap();
        assert_eq!(a.numbers("y").unwrap(), [2000.0, 8.0]);
    }

    #[test]
    fn faults_are_named() {
        let table = Table::parse("test", TEXT).unwrap();
        assert!(table.numbers("z").is_err());
        let message = table.numbers("kind").unwrap_err().to_string();
        assert_eq!(message, "table test: 'a' in column kind is not a number");
        let ragged = Table::parse("test", "x,y\n1,2\n\n3\n").unwrap_err();
        assert_eq!(ragged.to_string(), "table test: line 4 has 1 cells, not 2");
        assert!(Table::parse("test", "# nothing\n").is_err());
        let nan = Table::parse("test", "x\nNaN\n").unwrap();
        assert!(nan.numbers("x").is_err());
    }
}
