//! `ferrodrive eds`: data sheets of devices as files (CiA 306): look into them, check them, compare them.

mod diff;
mod lint;
mod show;
mod source;

use clap::Subcommand;

use crate::failure::Failure;
use crate::output::{Format, Report};

/// Check, show and compare EDS and DCF files (CiA 306)
#[derive(clap::Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Examples:\n  ferrodrive eds lint vendor.eds\n  ferrodrive eds show vendor.eds 6040\n  \
                  ferrodrive eds diff vendor.eds vendor.dcf"
)]
pub(crate) struct Eds {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Lint(lint::Lint),
    Show(show::Show),
    Diff(diff::Diff),
}

impl Eds {
    /// Does it, and prints what came of it.
    pub(crate) fn run(&self, format: Format) -> Result<(), Failure> {
        match &self.what {
            What::Lint(lint) => {
                let report = lint.run();
                print(format, &report)?;
                // For programs the report has it.
                report.failure(lint.strict).map_or(Ok(()), |failure| Err(Failure { told: format.json, ..failure }))
            }
            What::Show(show) => print(format, &show.run()?),
            What::Diff(diff) => print(format, &diff.run()?),
        }
    }
}

fn print(format: Format, report: &impl Report) -> Result<(), Failure> {
    format.print(report).map_err(|error| Failure::new("cannot write to standard output").because(error))
}
