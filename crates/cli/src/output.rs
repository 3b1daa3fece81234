//! What a command has to say: one value, printed as text for people or as JSON for programs.

use std::io::{self, Write};

use serde::Serialize;

use plot::Paint;

/// A value that a command prints.
pub(crate) trait Report: Serialize {
    /// Lines for people, without a line end after the last.
    fn text(&self, paint: Paint) -> String;
}

/// How to print.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Format {
    /// JSON instead of text.
    pub(crate) json: bool,
    /// Colours of standard output.
    pub(crate) paint: Paint,
}

impl Format {
    /// Prints a report on standard output, one line of JSON or its text.
    pub(crate) fn print(self, report: &impl Report) -> io::Result<()> {
        if self.json { self.print_json(report) } else { print_line(&report.text(self.paint)) }
    }

    /// Prints one line of JSON about something that was done.
    pub(crate) fn print_json(self, value: &impl Serialize) -> io::Result<()> {
        print_line(&json(value)?)
    }
}

/// An object as one line of JSON that begins with whether all is well (docs/json.md): as its first field says, else it is.
fn json(value: &impl Serialize) -> io::Result<String> {
    let line = sim::json::to_string(value)?;
    if line.starts_with("{\"ok\":") {
        return Ok(line);
    }
    let rest = line.strip_prefix('{').unwrap_or(&line);
    let comma = if rest == "}" { "" } else { "," };
    Ok(format!("{{\"ok\":true{comma}{rest}"))
}

/// One text and a line end on standard output, at once.
pub(crate) fn print_line(text: &str) -> io::Result<()> {
    if text.is_empty() { Ok(()) } else { print(format!("{text}\n").as_bytes()) }
}

/// Bytes on standard output, at once. A reader that has gone away is not an error: it has seen what it wanted
/// (`ferrodrive dump | head`).
pub(crate) fn print(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
        other => other,
    }
}
