//! The values of a TOML file, each with its line, and what is wrong with them in the words of whoever wrote the file.
//!
//! In: text. Out: numbers, texts and tables, or a sentence with the line, the name and what is expected there. What the
//! names mean is not known here.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::words::suggest::{did_you_mean, near};

/// The names of one table and what they stand for.
pub(super) struct Table<'a> {
    text: &'a str,
    /// What the table describes: `a drive`.
    what: &'static str,
    at: Range<usize>,
    table: &'a DeTable<'a>,
}

/// One value and its name.
pub(super) struct Field<'a> {
    text: &'a str,
    name: String,
    value: &'a Spanned<DeValue<'a>>,
}

/// Reads a whole file and hands its outermost table over.
pub(super) fn read<T>(
    text: &str,
    what: &'static str,
    take: impl FnOnce(&Table<'_>) -> Result<T, String>,
) -> Result<T, String> {
    let parsed = DeTable::parse(text).map_err(|error| {
        let line = error.span().map_or(1, |span| line(text, &span));
        format!("line {line}: {}", error.message())
    })?;
    take(&Table { text, what, at: 0..0, table: parsed.get_ref() })
}

impl<'a> Table<'a> {
    /// Refuses every name that is not among `known`.
    pub(super) fn takes_only(&self, known: &[&str]) -> Result<(), String> {
        let strange = self.table.keys().find(|key| !known.contains(&key.get_ref().as_ref()));
        strange.map_or(Ok(()), |key| {
            let (line, name) = (line(self.text, &key.span()), key.get_ref());
            let near = did_you_mean(&near(name, known.iter().copied()));
            Err(format!("line {line}: {} has no '{name}'{near}; it has: {}", self.what, known.join(", ")))
        })
    }

    /// The value of a name, if it is there.
    pub(super) fn get(&self, name: &str) -> Option<Field<'a>> {
        self.table.get(name).map(|value| Field { text: self.text, name: name.to_owned(), value })
    }

    /// The value of a name that must be there.
    pub(super) fn need(&self, name: &str, expected: &str) -> Result<Field<'a>, String> {
        self.get(name)
            .ok_or_else(|| format!("line {}: {} needs '{name}': {expected}", line(self.text, &self.at), self.what))
    }

    /// All names with their values, in the order of the alphabet.
    pub(super) fn fields(&self) -> impl Iterator<Item = Field<'a>> {
        let text = self.text;
        self.table.iter().map(move |(key, value)| Field { text, name: key.get_ref().to_string(), value })
    }
}

impl<'a> Field<'a> {
    /// Its name.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// A number, whole or not.
    pub(super) fn number(&self, expected: &str) -> Result<f64, String> {
        let number = match self.value.get_ref() {
            DeValue::Float(number) => number.as_str().parse().ok(),
            DeValue::Integer(_) => self.integer().map(|number| number as f64),
            _ => None,
        };
        number.filter(|number| number.is_finite()).ok_or_else(|| self.wrong(expected))
    }

    /// A whole number.
    pub(super) fn whole<T: TryFrom<i64>>(&self, expected: &str) -> Result<T, String> {
        self.integer().and_then(|number| T::try_from(number).ok()).ok_or_else(|| self.wrong(expected))
    }

    /// A text.
    pub(super) fn text(&self, expected: &str) -> Result<&'a str, String> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong(expected))
    }

    /// True or false.
    pub(super) fn flag(&self, expected: &str) -> Result<bool, String> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong(expected))
    }

    /// A whole number or a text, as it is typed.
    pub(super) fn word(&self, expected: &str) -> Result<String, String> {
        match self.value.get_ref() {
            DeValue::String(text) => Ok(text.to_string()),
            _ => self.integer().map(|number| number.to_string()).ok_or_else(|| self.wrong(expected)),
        }
    }

    /// The entries of a list.
    pub(super) fn list(&self, expected: &str) -> Result<Vec<Field<'a>>, String> {
        let entries = self.value.get_ref().as_array().ok_or_else(|| self.wrong(expected))?;
        Ok(entries.iter().map(|value| Field { text: self.text, name: self.name.clone(), value }).collect())
    }

    /// A table that describes `what`.
    pub(super) fn table(&self, what: &'static str, expected: &str) -> Result<Table<'a>, String> {
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong(expected))?;
        Ok(Table { text: self.text, what, at: self.value.span(), table })
    }

    /// What is wrong, with its place.
    pub(super) fn wrong(&self, expected: &str) -> String {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("\"{text}\""),
            DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_) => self.text[self.value.span()].to_owned(),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(entries) => format!("a list of {}", entries.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        self.at(&format!("'{}' is {found}; expected {expected}", self.name))
    }

    /// Something about it, with its place.
    pub(super) fn at(&self, what: &str) -> String {
        format!("line {}: {what}", line(self.text, &self.value.span()))
    }

    fn integer(&self) -> Option<i64> {
        let number = self.value.get_ref().as_integer()?;
        i64::from_str_radix(number.as_str(), number.radix()).ok()
    }
}

fn line(text: &str, at: &Range<usize>) -> usize {
    text.get(..at.start).unwrap_or_default().matches('\n').count() + 1
}
