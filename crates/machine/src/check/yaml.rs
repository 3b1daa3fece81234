//! Values of a YAML file, each with its place. Aliases are resolved by the reader, up to a number that no file of a bus needs.

use saphyr::{LoadableYamlNode, MarkedYaml, Marker, Scalar, YamlData};

use super::finding::Place;
use words::document::{BadFile, Located};

/// A value and where it begins.
pub(super) struct YamlNode<'a>(&'a MarkedYaml<'a>);

/// A key, its value, and where the key stands.
pub(super) struct Entry<'a> {
    pub(super) key: String,
    pub(super) at: Place,
    pub(super) value: YamlNode<'a>,
}

/// Most columns before the first key or value of a line. Each level of a block takes one at least, and the reader of YAML, which
/// bounds the depth of lists in brackets itself, takes a piece of the stack for each.
const MOST_INDENTED: usize = 200;

/// Reads a file and hands its one document to `look`.
///
/// # Errors
/// It is not YAML, nested too deep, or not one document.
pub(super) fn with_document<T>(text: &str, look: impl FnOnce(YamlNode<'_>) -> T) -> Result<T, BadFile> {
    if let Some(line) = text.lines().position(|line| indentation(line) > MOST_INDENTED) {
        let what = format!("indented by more than {MOST_INDENTED} columns; expected the few levels of a bus");
        return Err(bad(text, line + 1, MOST_INDENTED, what));
    }
    let documents = MarkedYaml::load_from_str(text).map_err(|error| {
        let at = error.marker();
        bad(text, at.line(), at.col(), format!("this is not YAML: {}", error.info()))
    })?;
    match &documents[..] {
        [document] => Ok(look(YamlNode(document))),
        [] => Err(bad(
            text,
            1,
            0,
            "the file is empty; expected the keys of a bus: options, master, and a name for each node",
        )),
        [_, second, ..] => {
            let at = second.span.start;
            Err(bad(text, at.line(), at.col(), "a second document begins here; a bus is one document"))
        }
    }
}

/// The columns that open blocks: blanks, and the marks of items (`- - a` are two levels) and of keys.
fn indentation(line: &str) -> usize {
    line.bytes().take_while(|byte| b" -?:".contains(byte)).count()
}

fn bad(text: &str, line: usize, column: usize, what: impl Into<String>) -> BadFile {
    let shown = text.lines().nth(line.saturating_sub(1)).unwrap_or_default().to_owned();
    BadFile::one(Located { line, column: column + 1, width: 1, shown, what: what.into() })
}

fn place(at: Marker) -> Place {
    Place { line: at.line(), column: at.col() + 1 }
}

impl<'a> YamlNode<'a> {
    pub(super) fn at(&self) -> Place {
        place(self.0.span.start)
    }

    fn scalar(&self) -> Option<&'a Scalar<'a>> {
        match &self.0.data {
            YamlData::Value(scalar) => Some(scalar),
            _ => None,
        }
    }

    pub(super) fn is_mapping(&self) -> bool {
        matches!(self.0.data, YamlData::Mapping(_))
    }

    /// The entries of a mapping; none of anything else. A key that is not text is printed as text.
    pub(super) fn entries(&self) -> Vec<Entry<'a>> {
        let YamlData::Mapping(mapping) = &self.0.data else { return Vec::new() };
        let entry = |(key, value): (&'a MarkedYaml<'a>, &'a MarkedYaml<'a>)| Entry {
            key: YamlNode(key).text().unwrap_or_else(|| "?".to_owned()),
            at: place(key.span.start),
            value: YamlNode(value),
        };
        mapping.iter().map(entry).collect()
    }

    /// The items of a list; none of anything else.
    pub(super) fn items(&self) -> Vec<YamlNode<'a>> {
        let YamlData::Sequence(items) = &self.0.data else { return Vec::new() };
        items.iter().map(YamlNode).collect()
    }

    pub(super) fn text(&self) -> Option<String> {
        Some(match self.scalar()? {
            Scalar::String(text) => text.to_string(),
            Scalar::Integer(number) => number.to_string(),
            Scalar::FloatingPoint(number) => number.to_string(),
            Scalar::Boolean(truth) => truth.to_string(),
            Scalar::Null => String::new(),
        })
    }

    /// A whole number, in the spellings of YAML (`0x1A00`); also one in quotes, as generators take it.
    pub(super) fn number(&self) -> Option<i64> {
        match self.scalar()? {
            Scalar::Integer(number) => Some(*number),
            Scalar::String(text) => match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
                Some(digits) => i64::from_str_radix(digits, 16).ok(),
                None => text.parse().ok(),
            },
            _ => None,
        }
    }

    /// A number that need not be whole.
    pub(super) fn real(&self) -> Option<f64> {
        match self.scalar()? {
            Scalar::Integer(number) => Some(*number as f64),
            Scalar::FloatingPoint(number) => Some(number.into_inner()),
            _ => None,
        }
        .filter(|number| number.is_finite())
    }

    /// `true` and `false`; also `yes`, `no` and the rest of YAML 1.1, which the readers of this field take.
    pub(super) fn truth(&self) -> Option<bool> {
        match self.scalar()? {
            Scalar::Boolean(truth) => Some(*truth),
            Scalar::String(text) => match text.to_ascii_lowercase().as_str() {
                "yes" | "y" | "on" | "true" => Some(true),
                "no" | "n" | "off" | "false" => Some(false),
                _ => None,
            },
            _ => None,
        }
    }
}
