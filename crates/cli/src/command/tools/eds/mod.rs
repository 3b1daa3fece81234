//! `ferrodrive eds`: data sheets of devices as files (CiA 306): write that of a model, look into files, check and compare
//! them.

mod diff;
mod lint;
mod sheet;
mod show;
pub(crate) mod source;

use clap::Subcommand;

use crate::failure::Failure;
use crate::output::{Format, Report};

/// Write the EDS of a model; check, show and compare EDS and DCF files (CiA 306)
#[derive(clap::Args)]
#[command(
    arg_required_else_help = true,
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  ferrodrive eds zlac8030l -o zlac8030l.eds\n  ferrodrive eds zlac8030l defaults=eds --node 4\n  \
                  ferrodrive eds lint vendor.eds\n  ferrodrive eds show vendor.eds 6040\n  \
                  ferrodrive eds diff vendor.eds zlac8030l"
)]
pub(crate) struct Eds {
    #[command(subcommand)]
    what: Option<EdsCommand>,
    #[command(flatten)]
    sheet: sheet::SheetArgs,
}

#[derive(Subcommand)]
enum EdsCommand {
    Lint(lint::Lint),
    Show(show::Show),
    Diff(diff::Diff),
}

impl Eds {
    /// Does it, and prints what came of it.
    pub(crate) fn run(&self, format: Format) -> Result<(), Failure> {
        match &self.what {
            Some(EdsCommand::Lint(lint)) => match lint.rules() {
                Some(rules) => print(format, &rules),
                None => {
                    let report = lint.run();
                    format.print_judged(&report, report.failure(lint.strict))
                }
            },
            Some(EdsCommand::Show(show)) => print(format, &show.run()?),
            Some(EdsCommand::Diff(diff)) => print(format, &diff.run()?),
            None => print(format, &self.sheet.run()?),
        }
    }
}

fn print(format: Format, report: &impl Report) -> Result<(), Failure> {
    format.print(report).map_err(Failure::of_stdout)
}
