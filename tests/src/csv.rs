//! Comma-separated values as RFC 4180 has them: a header line, fields in quotes where they hold a comma or a quote.

/// A table: rows of fields that are found by the name in the header.
#[derive(Debug)]
pub struct CsvTable {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

/// One row of a [`CsvTable`].
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    header: &'a [String],
    fields: &'a [String],
}

impl CsvTable {
    /// Reads a table. The first line is the header.
    ///
    /// # Errors
    ///
    /// The number of the first line whose field count differs from the header's.
    pub fn parse(text: &str) -> Result<Self, usize> {
        let mut lines = text.lines().map(fields);
        let header = lines.next().unwrap_or_default();
        let rows: Vec<Vec<String>> = lines.collect();
        match rows.iter().position(|row| row.len() != header.len()) {
            Some(at) => Err(at + 2),
            None => Ok(Self { header, rows }),
        }
    }

    /// The rows in file order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|fields| Row { header: &self.header, fields })
    }
}

impl<'a> Row<'a> {
    /// The field under `name`.
    ///
    /// # Panics
    ///
    /// When the header has no such name: the test that asks is wrong.
    #[must_use]
    pub fn get(&self, name: &str) -> &'a str {
        let at = self.header.iter().position(|title| title == name);
        &self.fields[at.unwrap_or_else(|| panic!("no column {name} in {:?}", self.header))]
    }
}

fn fields(line: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let (mut quoted, mut chars) = (false, line.chars().peekable());
    while let Some(char) = chars.next() {
        let field = fields.len() - 1;
        match char {
            '"' if quoted && chars.peek() == Some(&'"') => {
                fields[field].push('"');
                chars.next();
            }
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(String::new()),
            _ => fields[field].push(char),
        }
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_and_quotes_inside_quotes_belong_to_the_field() {
        let table = CsvTable::parse("a,b,c\n1,\"x, \"\"y\"\"\",\n").unwrap();
        let row = table.rows().next().unwrap();
        assert_eq!((row.get("a"), row.get("b"), row.get("c")), ("1", "x, \"y\"", ""));
    }

    #[test]
    fn a_line_with_too_few_fields_is_named() {
        assert_eq!(CsvTable::parse("a,b\n1,2\n3\n").unwrap_err(), 3);
    }
}
