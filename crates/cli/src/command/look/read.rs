//! `ferrodrive read`: objects of a node by SDO upload, shown or put into a file.

use std::path::{Path, PathBuf};

use console::command::object::ObjectReport;
use console::command::read;

use crate::command::configure::dcf::{is_stdout, keep, new_file};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report, print};
use plot::Paint;

/// Read objects of a node, decoded with unit and meaning
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Objects are hexadecimal indices or names:\n  6064, 0x6064, 6064h, 2026:01, position_actual_value\n\
    Several at once:\n  1018:*        all sub-indices\n  1600:1..4     some of them\n  1000..1FFF    every object between these indices\n\
    Examples:\n  ferrodrive read 4 6064 606C statusword\n  ferrodrive read 4 1018:*\n  ferrodrive read 5 1021 -o device.eds"
)]
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
        self.check_file(path, self.what.one().is_some(), format.json)?;
        let Some(object) = self.what.one() else { return Ok(()) };
        let (mut report, payload) = self.what.read_one(context, object).await?;
        if is_stdout(path) {
            // Nothing else is to be among them.
            return print(payload.as_bytes()).map_err(Failure::of_stdout);
        }
        keep(path, payload.as_bytes(), self.force)?;
        report.file = Some(path.display().to_string());
        show(&report)
    }

    fn check_file(&self, path: &Path, is_one: bool, json: bool) -> Result<(), Failure> {
        if !is_one {
            return Err(Failure::usage("--output accepts one object only")
                .next("read the objects one by one, or use --json > FILE"));
        }
        if json && is_stdout(path) {
            return Err(Failure::usage("the bytes of an object and lines of JSON cannot both go to standard output")
                .next("give --output FILE, or omit --json"));
        }
        new_file(Some(path), self.force).map(drop)
    }
}

impl Report for ObjectReport {
    fn text(&self, paint: Paint) -> String {
        self.text(paint)
    }
}
