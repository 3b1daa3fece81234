//! The values of a TOML file, each with its line, and what is wrong with them, quoting the file.
//!
//! In: text. Out: numbers, texts and tables, or a [`Problem`]: the place, the name and what is expected there. What the
//! names mean is not known here. A text may stand for a parameter of the file, `{name}`, whose value is put in its place.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problem::Problem;
use crate::suggest::{did_you_mean, near};

/// Values that texts of a file may name, `{name}`, in the words that they are typed in.
pub type Parameters = BTreeMap<String, String>;

/// A text and the parameters that it may name.
#[derive(Clone, Copy)]
pub struct SourceText<'a> {
    text: &'a str,
    parameters: &'a Parameters,
}

/// The names of one table and what they stand for.
pub struct Table<'a> {
    source: SourceText<'a>,
    /// What the table describes: `a drive`.
    what: &'static str,
    at: Range<usize>,
    table: &'a DeTable<'a>,
}

/// One value and its name.
pub struct Field<'a> {
    source: SourceText<'a>,
    name: String,
    value: &'a Spanned<DeValue<'a>>,
}

/// Reads a whole file and hands its outermost table over.
///
/// # Errors
/// The file is not TOML, or what `take` finds.
pub fn read<T>(
    text: &str,
    parameters: &Parameters,
    what: &'static str,
    take: impl FnOnce(&Table<'_>) -> Result<T, Vec<Problem>>,
) -> Result<T, Vec<Problem>> {
    let parsed = DeTable::parse(text)
        .map_err(|error| vec![Problem::new(error.span().unwrap_or(0..0), error.message().to_owned())])?;
    take(&Table { source: SourceText { text, parameters }, what, at: 0..0, table: parsed.get_ref() })
}

impl<'a> Table<'a> {
    /// Where it stands.
    pub fn place(&self) -> Range<usize> {
        self.at.clone()
    }

    /// The text that it is of.
    pub fn text(&self) -> &'a str {
        self.source.text
    }

    /// The names that are not among `known`.
    pub fn strangers(&self, known: &[&str]) -> Vec<Problem> {
        let strange = self.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        let problems = strange.map(|key| {
            let name = key.get_ref();
            let near = did_you_mean(&near(name, known.iter().copied()));
            let its = if near.is_empty() { "; it has" } else { " It has" };
            let what = format!("{} has no '{name}'{near}{its}: {}", self.what, known.join(", "));
            Problem::new(key.span(), what)
        });
        problems.collect()
    }

    /// Refuses the first name that is not among `known`.
    ///
    /// # Errors
    /// That name.
    pub fn takes_only(&self, known: &[&str]) -> Result<(), Problem> {
        self.strangers(known).into_iter().next().map_or(Ok(()), Err)
    }

    /// The value of a name, if it is there.
    pub fn get(&self, name: &str) -> Option<Field<'a>> {
        self.table.get(name).map(|value| Field { source: self.source, name: name.to_owned(), value })
    }

    /// The value of a name that must be there.
    ///
    /// # Errors
    /// That it is not.
    pub fn need(&self, name: &str, expected: &str) -> Result<Field<'a>, Problem> {
        self.get(name).ok_or_else(|| Problem::new(self.at.clone(), format!("{} needs '{name}': {expected}", self.what)))
    }

    /// That all of several names are there.
    ///
    /// # Errors
    /// Those that are not, at once.
    pub fn need_all(&self, names: &[&str], expected: &str) -> Result<(), Problem> {
        let missing: Vec<_> = names.iter().filter(|name| self.get(name).is_none()).collect();
        if missing.is_empty() {
            return Ok(());
        }
        let names = missing.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
        Err(Problem::new(self.at.clone(), format!("{} needs {names}: {expected}", self.what)))
    }

    /// All names with their values, in the order of the alphabet.
    pub fn fields(&self) -> impl Iterator<Item = Field<'a>> + use<'a> {
        let source = self.source;
        self.table.iter().map(move |(key, value)| Field { source, name: key.get_ref().to_string(), value })
    }
}

impl<'a> Field<'a> {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where it stands.
    pub fn place(&self) -> Range<usize> {
        self.value.span()
    }

    /// The text that it is of.
    pub fn source_text(&self) -> &'a str {
        self.source.text
    }

    /// A number, whole or not.
    ///
    /// # Errors
    /// It is not one; so in all that follow.
    pub fn number(&self, expected: &str) -> Result<f64, Problem> {
        let number = match self.value.get_ref() {
            DeValue::Float(number) => number.as_str().parse().ok(),
            DeValue::Integer(_) => self.integer().map(|number| number as f64),
            DeValue::String(text) if text.contains('{') => self.filled(text)?.trim().parse().ok(),
            _ => None,
        };
        number.filter(|number| number.is_finite()).ok_or_else(|| self.wrong(expected))
    }

    /// A whole number.
    pub fn whole<T: TryFrom<i64>>(&self, expected: &str) -> Result<T, Problem> {
        let number = match self.value.get_ref() {
            DeValue::String(text) if text.contains('{') => self.filled(text)?.trim().parse().ok(),
            _ => self.integer(),
        };
        number.and_then(|number| T::try_from(number).ok()).ok_or_else(|| self.wrong(expected))
    }

    /// A text, with its parameters put in.
    pub fn words(&self, expected: &str) -> Result<String, Problem> {
        self.filled(self.value.get_ref().as_str().ok_or_else(|| self.wrong(expected))?)
    }

    /// A text as it stands.
    pub fn text(&self, expected: &str) -> Result<&'a str, Problem> {
        self.value.get_ref().as_str().ok_or_else(|| self.wrong(expected))
    }

    /// True or false.
    pub fn flag(&self, expected: &str) -> Result<bool, Problem> {
        self.value.get_ref().as_bool().ok_or_else(|| self.wrong(expected))
    }

    /// A whole number or a text, as it is typed.
    pub fn word(&self, expected: &str) -> Result<String, Problem> {
        match self.value.get_ref() {
            DeValue::String(text) => self.filled(text),
            _ => self.integer().map(|number| number.to_string()).ok_or_else(|| self.wrong(expected)),
        }
    }

    /// True for a table.
    pub fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    /// True for a list.
    pub fn is_list(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// The entries of a list.
    pub fn list(&self, expected: &str) -> Result<Vec<Field<'a>>, Problem> {
        let entries = self.value.get_ref().as_array().ok_or_else(|| self.wrong(expected))?;
        Ok(entries.iter().map(|value| Field { source: self.source, name: self.name.clone(), value }).collect())
    }

    /// A table that describes `what`.
    pub fn table(&self, what: &'static str, expected: &str) -> Result<Table<'a>, Problem> {
        let table = self.value.get_ref().as_table().ok_or_else(|| self.wrong(expected))?;
        Ok(Table { source: self.source, what, at: self.value.span(), table })
    }

    /// What is wrong, with its place.
    pub fn wrong(&self, expected: &str) -> Problem {
        let found = match self.value.get_ref() {
            DeValue::String(text) => format!("\"{}\"", shortened(text)),
            DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_) => {
                shortened(self.source.text.get(self.value.span()).unwrap_or_default())
            }
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(entries) => format!("a list of {}", entries.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        self.problem(format!("'{}' is {found}; expected {expected}", self.name))
    }

    /// Something about it, with its place.
    pub fn problem(&self, what: impl Into<String>) -> Problem {
        Problem::new(self.value.span(), what)
    }

    fn integer(&self) -> Option<i64> {
        let number = self.value.get_ref().as_integer()?;
        i64::from_str_radix(number.as_str(), number.radix()).ok()
    }

    /// `text` with the values of the parameters that it names.
    fn filled(&self, text: &str) -> Result<String, Problem> {
        let mut filled = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(begin) = rest.find('{') {
            let Some(length) = rest[begin..].find('}') else { break };
            let name = &rest[begin + 1..begin + length];
            filled.push_str(&rest[..begin]);
            let parameters = self.source.parameters;
            let value = parameters.get(name).ok_or_else(|| {
                let near = did_you_mean(&near(name, parameters.keys().map(String::as_str)));
                self.problem(format!(
                    "there is no parameter '{}'{near}; [parameters] gives each a value",
                    shortened(name)
                ))
            })?;
            filled.push_str(value);
            rest = &rest[begin + length + 1..];
        }
        filled.push_str(rest);
        Ok(filled)
    }
}

/// As much of a text as belongs into a message.
fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    let mut letters = text.chars();
    let shown: String = letters.by_ref().take(MOST).collect();
    if letters.next().is_some() { format!("{shown}..") } else { shown }
}
