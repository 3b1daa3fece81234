//! `ferrodrive decode`: a log file in words, as `dump` shows a bus.

use std::path::PathBuf;

use transport::BusSpec;

use crate::command::look::dump::Dump;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::Format;

/// Decode a log file, as dump decodes a bus
///
/// Reads candump, ASC, BLF, TRC, pcap and pcapng, recognised by their first bytes, then by their extension; - is
/// standard input. Parts that are torn or not a frame are reported and skipped. With --log FILE the frames are also
/// written again, in the format of FILE's extension; `ferrodrive convert` does only that.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive decode trace.blf --model 4=zlac8030l\n  \
    ferrodrive decode trace.pcapng --machine base.toml\n  candump -L can0 | ferrodrive decode -")]
pub(crate) struct Decode {
    /// Log file, or - for standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    shown: Dump,
}

impl Decode {
    /// Shows the log to its end.
    pub(crate) fn run(&self, global: &Global, format: Format) -> Result<(), Failure> {
        let bus = BusSpec::Log { path: self.file.clone() };
        self.shown.run(&Global { bus, ..global.clone() }, format)
    }
}
