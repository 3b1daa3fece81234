//! `cargo demo`: what `ferrodrive demo` shows, by a program that is built from a seventh of the crates.
//!
//! It takes no arguments: the whole demo, as a table on standard output and a picture in `demo.svg`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program that shows something")]

use std::fs;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use plot::Paint;

const PICTURE: &str = "demo.svg";

fn main() -> ExitCode {
    if let Some(word) = std::env::args().nth(1) {
        eprintln!(
            "error: unexpected argument '{word}': this program takes none; `ferrodrive demo --help` has the options"
        );
        return ExitCode::from(2);
    }
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            eprintln!("error: a drive did not do what its manual says: look for DIFFERS in the table");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Whether all was as the manuals say.
fn run() -> Result<bool, String> {
    // For the person who waits.
    let start = std::time::Instant::now();
    let shown = io::stderr().is_terminal();
    let section = move |section: &str| {
        if shown {
            eprint!("\r\x1b[K{section}");
        }
    };
    let showcase = showcase::run(None, section).map_err(|error| error.to_string())?;
    if shown {
        eprint!("\r\x1b[K");
    }
    save(Path::new(PICTURE), &showcase.poster.to_svg()).map_err(|error| format!("cannot write {PICTURE}: {error}"))?;
    let report = showcase::Report::new(showcase.parts, PICTURE.to_owned(), start.elapsed().as_secs_f64());
    let text = report.text(Paint::for_stream(&io::stdout()));
    match writeln!(io::stdout(), "{text}") {
        // `cargo demo | head` has seen what it wanted.
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.to_string()),
        _ => Ok(report.ok),
    }
}

/// Writes the picture in place of an earlier one, and of nothing else.
fn save(path: &Path, svg: &str) -> io::Result<()> {
    if fs::read(path).is_ok_and(|earlier| !earlier.starts_with(b"<svg")) {
        return Err(io::Error::other(
            "it exists and is not a picture of this program: remove it or go to another folder",
        ));
    }
    fs::write(path, svg)
}
