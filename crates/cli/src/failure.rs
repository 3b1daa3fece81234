//! Why a command did not do what was asked: [`Failure`], and those that only this program has.

use std::path::Path;

use clap::error::{ContextKind, ErrorKind};

pub(crate) use console::failure::{Failure, FailureBody, FailureReport};

use crate::plain::short;
use crate::signals::Signal;
use words::unresolved::Unresolved;

/// A signal asked the command to end.
pub(crate) fn ended_by(signal: Signal) -> Failure {
    Failure { status: signal.status(), ..Failure::new(signal.text()).of_kind("interrupted") }
}

/// Refuses a file to be written at the end of something long, where its folder is missing; `-` is standard output.
///
/// # Errors
/// As the writing itself would fail.
pub(crate) fn refuse_missing_folder(what: &str, path: &Path) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.map(std::fs::metadata) {
        Some(Err(error)) => Err(Failure::of_writing(what, path, &error)),
        Some(Ok(found)) if !found.is_dir() => {
            Err(Failure::of_writing(what, path, &std::io::ErrorKind::NotADirectory.into()))
        }
        _ => Ok(()),
    }
}

/// What the parser of the command line found, for programs; people get its own text.
pub(crate) fn of_command_line(error: &clap::Error) -> Failure {
    let text = short(&error.render().to_string());
    let (what, rest) = text.split_once("\n\n").unwrap_or((&text, ""));
    let what: Vec<&str> = what.lines().map(str::trim).collect();
    let failure = Failure::usage(what.join(" ").trim_start_matches("error: "));
    let tips = rest.lines().map(str::trim).filter_map(|line| line.strip_prefix("tip: "));
    let failure = tips.fold(failure, |failure, tip| failure.next(tip));
    match error.kind() {
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            Failure::usage("no command given").next("ferrodrive --help lists the commands")
        }
        _ => match error.get(ContextKind::Usage) {
            Some(usage) => failure.next(usage.to_string().trim().replace("Usage:", "usage:")),
            None if failure.next.is_empty() => failure.next("ferrodrive --help, or --help after the command"),
            None => failure,
        },
    }
}

/// That a file named on the command line is missing or cannot be used, where that is what the parser met: the command line itself
/// makes sense.
pub(crate) fn of_named_file(error: &clap::Error) -> Option<Failure> {
    let unresolved = std::error::Error::source(error)?.downcast_ref::<Unresolved>()?;
    let Unresolved::File(reason) = unresolved else { return None };
    Some(
        Failure::bad_file(short(reason))
            .next("give the path of an EDS or DCF file; `ferrodrive eds lint FILE` says what is wrong with one"),
    )
}
