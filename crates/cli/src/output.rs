//! What a command has to say: one value, printed as text for people or as JSON for programs.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use console::command;
use serde::Serialize;

use crate::failure::{Failure, FailureBody};
use plot::Paint;

/// A value that a command prints.
pub(crate) trait Report: Serialize {
    /// Lines for people, without a line end after the last.
    fn text(&self, paint: Paint) -> String;
}

/// What the console of a page prints, too: its words are the same here.
macro_rules! reports_of_the_console {
    ($($report:ty),+) => {
        $(impl Report for $report {
            fn text(&self, paint: Paint) -> String {
                self.text(paint)
            }
        })+
    };
}
reports_of_the_console!(
    command::Outcome,
    command::departures::DepartureList,
    command::emcy::ErrorEntry,
    command::emcy::RememberedErrors,
    command::objects::ModelList,
    command::objects::ObjectList,
    command::pdo::PdoList
);

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

/// A page that is written beside what goes to standard output: NAME.html.
pub(crate) fn html_path(text: &str) -> Result<PathBuf, String> {
    of_ending(text, ".html")
}

/// A result for build servers that is written beside what goes to standard output: NAME.xml.
pub(crate) fn junit_path(text: &str) -> Result<PathBuf, String> {
    of_ending(text, ".xml")
}

fn of_ending(text: &str, ending: &str) -> Result<PathBuf, String> {
    let path = file_path(text)?;
    if text.to_ascii_lowercase().ends_with(ending) { Ok(path) } else { Err(format!("expected NAME{ending}")) }
}

/// True for the `-` that means standard output.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Refuses lines of JSON beside a file that goes to standard output.
pub(crate) fn refuse_json_beside(what: &str, output: Option<&Path>, prints_json: bool) -> Result<(), Failure> {
    if prints_json && output.is_some_and(is_stdout) {
        return Err(Failure::usage(format!("{what} and lines of JSON cannot both go to standard output"))
            .next("give --output a file, or omit --json"));
    }
    Ok(())
}

/// The line with the places at which a served bus can be reached.
pub(crate) fn ready_line(json: bool, places: &[String]) -> String {
    #[derive(Serialize)]
    struct Ready<'a> {
        ok: bool,
        ready: &'a [String],
    }
    if json {
        return sim::json::line(&Ready { ok: true, ready: places });
    }
    let places = places.iter().map(|place| format!(" {place}"));
    ["ready".to_owned()].into_iter().chain(places).collect()
}

/// Standard output as a file of its own.
pub(crate) fn stdout_file() -> io::Result<File> {
    #[cfg(unix)]
    let own = std::os::fd::AsFd::as_fd(&io::stdout()).try_clone_to_owned();
    #[cfg(windows)]
    let own = std::os::windows::io::AsHandle::as_handle(&io::stdout()).try_clone_to_owned();
    own.map(File::from)
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
