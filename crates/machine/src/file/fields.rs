//! Fields of a machine file that are like in several places.

use std::str::FromStr;

use can::Bitrate;
use words::document::Problem;
use words::document::reader::{Field, Table};

/// The value, or its problem among the others.
pub(super) fn noted<T: Default>(value: Result<T, Problem>, problems: &mut Vec<Problem>) -> T {
    value.unwrap_or_else(|problem| {
        problems.push(problem);
        T::default()
    })
}

pub(super) fn rate(field: &Field<'_>) -> Result<Bitrate, Problem> {
    let expected = "a bit rate as text, e.g. \"500k\"";
    field.text(expected)?.parse().map_err(|error| field.problem(format!("{error}")))
}

/// A word that stands for a value, one of those expected, where the key is there.
pub(super) fn optional_word<T: FromStr>(
    table: &Table<'_>,
    key: &str,
    expected: &'static str,
) -> Result<Option<T>, Problem> {
    let Some(field) = table.get(key) else { return Ok(None) };
    field.text(expected)?.parse().map(Some).map_err(|_| field.wrong(expected))
}
