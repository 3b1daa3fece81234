//! What a command has to say: one value, printed as text for people or as JSON for programs.

use std::io::{self, IsTerminal, Write};
use std::path::PathBuf;

use serde::Serialize;

use crate::failure::{Failure, FailureBody};
use plot::Paint;

/// A value that a command prints.
pub(crate) trait Report: Serialize {
    /// Lines for people, without a line end after the last.
    fn text(&self, paint: Paint) -> String;
}

impl Report for console::command::Outcome {
    fn text(&self, paint: Paint) -> String {
        self.text(paint)
    }
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

    /// Prints a report, of which `failure` says what is wrong: as JSON both in one line.
    pub(crate) fn print_failed(self, report: &impl Report, failure: Option<&Failure>) -> Result<(), Failure> {
        #[derive(Serialize)]
        struct Failed<'a, R> {
            #[serde(flatten)]
            report: &'a R,
            error: FailureBody,
        }
        let printed = match failure.filter(|_| self.json) {
            Some(failure) => self.print_json(&Failed { report, error: failure.into() }),
            None => self.print(report),
        };
        printed.map_err(Failure::of_stdout)
    }

    /// As [`print_failed`](Self::print_failed), and then fails with it: for programs the report has said it.
    pub(crate) fn print_judged(self, report: &impl Report, failure: Option<Failure>) -> Result<(), Failure> {
        self.print_failed(report, failure.as_ref())?;
        self.ended(failure)
    }

    /// Fails with what the report that was printed has for programs.
    pub(crate) fn ended(self, failure: Option<Failure>) -> Result<(), Failure> {
        failure.map_or(Ok(()), |failure| Err(Failure { reported: self.json || failure.reported, ..failure }))
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

/// A file that is written beside what goes to standard output.
pub(crate) fn file_path(text: &str) -> Result<PathBuf, String> {
    match text {
        "" | "-" => Err("expected the path of a file: only -o/--output takes - for standard output".into()),
        path => Ok(path.into()),
    }
}

/// One text and a line end on standard output, at once.
pub(crate) fn print_line(text: &str) -> io::Result<()> {
    if text.is_empty() { Ok(()) } else { print(format!("{text}\n").as_bytes()) }
}

/// Bytes on standard output, at once. A reader that has gone away is not an error: it has seen what it wanted
/// (`ferrodrive dump | head`).
pub(crate) fn print(bytes: &[u8]) -> io::Result<()> {
    #[cfg(test)]
    if kept::is_kept(kept::Stream::Out, bytes) {
        return Ok(());
    }
    let mut out = io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
        other => other,
    }
}

/// A line on standard error.
pub(crate) fn print_error(line: &str) {
    let line = format!("{line}\n");
    #[cfg(test)]
    if kept::is_kept(kept::Stream::Error, line.as_bytes()) {
        return;
    }
    // The reader may have gone.
    let _ = io::stderr().write_all(line.as_bytes());
}

/// True if a person reads standard error.
pub(crate) fn has_reader() -> bool {
    // The terminal of a test is not that of the commands in it.
    !cfg!(test) && io::stderr().is_terminal()
}

/// What a command prints, for a test that runs it in its own thread.
#[cfg(test)]
pub(crate) mod kept {
    use std::cell::RefCell;

    thread_local! {
        /// Standard output and standard error of this thread, while they are kept.
        static KEPT: RefCell<Option<[Vec<u8>; 2]>> = const { RefCell::new(None) };
    }

    #[derive(Clone, Copy)]
    pub(crate) enum Stream {
        Out,
        Error,
    }

    /// True if these bytes are kept, and nothing is to be printed.
    pub(super) fn is_kept(stream: Stream, bytes: &[u8]) -> bool {
        KEPT.with_borrow_mut(|kept| kept.as_mut().map(|kept| kept[stream as usize].extend_from_slice(bytes)).is_some())
    }

    /// Keeps what is printed by `work`: standard output, standard error, and what `work` returns.
    pub(crate) fn keep<T>(work: impl FnOnce() -> T) -> ((String, String), T) {
        KEPT.set(Some(Default::default()));
        let done = work();
        let [out, err] = KEPT.take().expect("set above").map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
        ((out, err), done)
    }
}
