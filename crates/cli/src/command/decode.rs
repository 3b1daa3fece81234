//! `ferrodrive decode`: a log file in words, as `dump` shows a bus.

use std::path::PathBuf;

use transport::BusSpec;

use crate::command::dump::Dump;
use crate::failure::Failure;
use crate::global::Global;
use crate::output::Format;

/// Show a log file decoded, as dump shows a bus
///
/// Reads candump, ASC, BLF, TRC, pcap and pcapng, told apart by their first bytes, then by their extension; - is standard input. What is
/// torn or no frame is told and passed over. With --log FILE the frames that are read are written again, in the form that
/// FILE's extension says; `ferrodrive convert` does that alone.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive decode trace.blf --model 4=zlac8030l\n  \
    ferrodrive decode trace.pcapng --machine base.toml\n  candump -L can0 | ferrodrive decode -")]
pub(crate) struct Decode {
    /// The log, or - for standard input
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
