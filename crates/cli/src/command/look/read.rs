//! `ferrodrive read`: objects of a node by SDO upload, shown or put into a file.

use std::path::{Path, PathBuf};

use console::command::object::ObjectReport;
use console::command::read;

use crate::command::configure::dcf::{keep, new_file};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report, is_stdout, print};
use plot::Paint;
use words::object::ObjectArg;

/// Read objects of a node, decoded with unit and meaning
#[derive(Debug, clap::Args)]
#[command(after_help = format!("{}\n  ferrodrive read 5 1021 -o device.eds", read::HELP))]
pub(crate) struct Read {
    #[command(flatten)]
    what: read::Read,
    /// Write the bytes of the one object, as they are, to a new file, or as - to standard output
    #[arg(long = "output", short = 'o', alias = "to", value_name = "FILE")]
    to: Option<PathBuf>,
    /// Overwrite an existing file
    #[arg(long, requires = "to")]
    force: bool,
}

impl Read {
    /// Reads, decodes and shows one after the other.
    pub(crate) async fn run(&self, context: &Context, format: Format) -> Result<(), Failure> {
        let show = |report: &ObjectReport| format.print(report).map_err(Failure::of_stdout);
        let Some(path) = &self.to else { return self.what.run(context, show).await };
        let object = self.checked(path, format.json)?;
        let (mut report, payload) = self.what.read_one(context, object).await?;
        if is_stdout(path) {
            // Nothing else is to be among them.
            return print(payload.as_bytes()).map_err(Failure::of_stdout);
        }
        keep(path, payload.as_bytes(), self.force)?;
        report.file = Some(path.display().to_string());
        show(&report)
    }

    /// The one object whose bytes go into a file that may be made.
    fn checked(&self, path: &Path, json: bool) -> Result<&ObjectArg, Failure> {
        let object = self.what.one().ok_or_else(|| {
            Failure::usage("--output accepts one object only").next("read the objects one by one, or use --json > FILE")
        })?;
        if json && is_stdout(path) {
            return Err(Failure::usage("the bytes of an object and lines of JSON cannot both go to standard output")
                .next("give --output FILE, or omit --json"));
        }
        new_file(Some(path), self.force).map(|_| object)
    }
}

impl Report for ObjectReport {
    fn text(&self, paint: Paint) -> String {
        let advice = if self.is_cut() { "\n  note    -o FILE writes all of them into a file" } else { "" };
        format!("{}{advice}", self.text(paint))
    }
}
