//! Plays a procedure: a `.can` file of `procedures`, or a conversation of the tests. What its lines mean is in
//! `crates/showcase/procedures/README.md`.
//!
//! Each line is done as it is read. `{expression}` and `{expression:form}` in it stand for a number or a text that a line
//! before it has named. What the drive answers and what is measured becomes a row of the table, as if a person did it.

mod expression;
mod statement;
mod text;

use std::collections::BTreeMap;
use std::rc::Rc;

use can::Frame;

use crate::bench::Bench;
use crate::error::Error;
use text::columns;

/// How deep procedures may use each other: one that uses itself is a mistake.
const DEEPEST: usize = 8;

/// A line with its place in the file and its indentation.
#[derive(Clone, Debug)]
struct ScriptLine {
    number: usize,
    indent: usize,
    text: String,
}

/// Steps with a name, for one or several places.
struct Definition {
    parameters: Vec<String>,
    lines: Vec<ScriptLine>,
}

/// What went wrong, and in which line if that is known.
struct Trouble {
    line: Option<usize>,
    what: String,
}

impl From<String> for Trouble {
    fn from(what: String) -> Self {
        Self { line: None, what }
    }
}

impl From<&str> for Trouble {
    fn from(what: &str) -> Self {
        what.to_owned().into()
    }
}

/// See the [module](self).
struct Player<'a> {
    bench: &'a mut Bench,
    definitions: BTreeMap<String, Rc<Definition>>,
    /// What lines have named: the innermost definition last.
    names: Vec<BTreeMap<String, String>>,
    /// The frame that answered last.
    answer: Option<Frame>,
    /// Every frame that is heard must be listed, and every difference ends it.
    strict: bool,
}

/// Plays a file. `strict`: a conversation, in which nothing else may be heard.
pub(crate) fn play(bench: &mut Bench, name: &str, text: &str, strict: bool) -> Result<(), Error> {
    let names = vec![BTreeMap::new()];
    let mut player = Player { bench, definitions: BTreeMap::new(), names, answer: None, strict };
    let lines = lines(text);
    let played = player.play(&lines).and_then(|()| player.end(&lines));
    played.map_err(|trouble| Error::line(name, text, trouble.line.unwrap_or(0), trouble.what))
}

/// The lines that do something.
fn lines(text: &str) -> Vec<ScriptLine> {
    let line = |(number, line): (usize, &str)| {
        let text = line.trim();
        let indent = line.len() - line.trim_start().len();
        (!text.is_empty() && !text.starts_with('#')).then(|| ScriptLine { number, indent, text: text.into() })
    };
    (1..).zip(text.lines()).filter_map(line).collect()
}

impl Player<'_> {
    fn play(&mut self, mut lines: &[ScriptLine]) -> Result<(), Trouble> {
        while let Some((line, rest)) = lines.split_first() {
            let inner = rest.iter().take_while(|next| next.indent > line.indent).count();
            let (block, after) = rest.split_at(inner);
            let done = self.line(line, block, after);
            lines = after;
            done.map_err(|trouble| Trouble { line: trouble.line.or(Some(line.number)), ..trouble })?;
        }
        Ok(())
    }

    /// In a conversation: that nothing was heard that is not listed.
    fn end(&self, lines: &[ScriptLine]) -> Result<(), Trouble> {
        let line = lines.last().map(|line| line.number);
        self.expect_silence().map_err(|what| Trouble { line, what })
    }

    fn line(&mut self, line: &ScriptLine, block: &[ScriptLine], after: &[ScriptLine]) -> Result<(), Trouble> {
        let (word, rest) = line.text.split_once(' ').unwrap_or((&line.text, ""));
        match word {
            "def" => {
                let mut words = rest.split_whitespace().map(str::to_owned);
                let name = words.next().ok_or("expected a name after 'def'")?;
                let definition = Definition { parameters: words.collect(), lines: block.to_vec() };
                self.definitions.insert(name, Rc::new(definition));
                return Ok(());
            }
            "each" => return self.each(rest.trim(), block),
            "do" => {
                let call = self.substituted(rest)?;
                let (name, arguments) = call.split_once(' ').unwrap_or((&call, ""));
                return self.perform(name, arguments);
            }
            _ => {}
        }
        if let Some(first) = block.first() {
            return Err(Trouble { line: Some(first.number), what: "unexpected indentation".into() });
        }
        let text = self.substituted(&line.text)?;
        if self.strict && !text.starts_with('<') {
            self.expect_silence()?;
        }
        let is_answered = after.first().is_some_and(|next| next.text.starts_with('<'));
        self.statement(&text, is_answered)?;
        match self.bench.difference().filter(|_| self.strict) {
            Some(seen) => Err(format!("heard {seen}").into()),
            None => Ok(()),
        }
    }

    /// Does the lines of a definition for each row below, or for each number of `NAME 1..20`.
    fn each(&mut self, name: &str, rows: &[ScriptLine]) -> Result<(), Trouble> {
        if let Some((name, range)) = name.split_once(' ') {
            let (first, last) = range.split_once("..").ok_or("expected a range such as 1..20")?;
            let (first, last) = (self.value(first)? as i64, self.value(last)? as i64);
            return (first..=last).try_for_each(|number| self.perform(name, &number.to_string()));
        }
        rows.iter().try_for_each(|row| {
            let done = self.substituted(&row.text).and_then(|arguments| self.perform(name, &arguments));
            done.map_err(|trouble| Trouble { line: trouble.line.or(Some(row.number)), ..trouble })
        })
    }

    /// Does the lines of a definition with these arguments.
    fn perform(&mut self, name: &str, arguments: &str) -> Result<(), Trouble> {
        let definition = self.definitions.get(name).cloned().ok_or_else(|| format!("'{name}' is not defined"))?;
        let arguments = if arguments.is_empty() { Vec::new() } else { columns(arguments) };
        let expected = definition.parameters.len();
        if arguments.len() != expected {
            return Err(format!("expected {expected} values for '{name}', got {}", arguments.len()).into());
        }
        if self.names.len() > DEEPEST {
            return Err(format!("'{name}' uses itself").into());
        }
        self.names.push(definition.parameters.iter().cloned().zip(arguments).collect());
        let done = self.play(&definition.lines);
        self.names.pop();
        done
    }

    /// A text with what its braces stand for.
    fn substituted(&mut self, text: &str) -> Result<String, Trouble> {
        let (mut result, mut rest) = (String::new(), text);
        while let Some((before, braced)) = rest.split_once('{') {
            let (inner, after) = braced.split_once('}').ok_or("expected '}'")?;
            let (expression, form) = match inner.rsplit_once(':') {
                Some((expression, form)) if !form.contains(']') => (expression, Some(form)),
                _ => (inner, None),
            };
            result.push_str(before);
            let shown = match (self.lookup(expression), form) {
                (Some(text), None) => text,
                _ => {
                    let value = self.value(expression)?;
                    text::formatted(value, form.unwrap_or("")).ok_or_else(|| format!("'{inner}' has no such form"))?
                }
            };
            result.push_str(&shown);
            rest = after;
        }
        Ok(result + rest)
    }

    /// What a line has given this name to.
    fn lookup(&self, name: &str) -> Option<String> {
        self.names.iter().rev().find_map(|names| names.get(name)).cloned()
    }

    fn name(&mut self, name: &str, value: f64) {
        if let Some(innermost) = self.names.last_mut() {
            innermost.insert(name.trim().to_owned(), value.to_string());
        }
    }

    fn expect_silence(&self) -> Result<(), String> {
        match self.bench.unlisted().filter(|_| self.strict) {
            Some(frame) => Err(format!("unexpected {frame}")),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
