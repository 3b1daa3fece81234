//! `ferrodrive sync`: SYNC frames (CiA 301, clause 7.2.5), once or at a rate.

use can::CanId;
use canopen::connection_set;
use canopen::sync::Sync;
use serde::Serialize;

use crate::command::repeat::{Repeat, Ticker};
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use plot::Paint;

/// Send SYNC, once or periodically
///
/// Devices with synchronous PDOs then apply those that they have received, and send their own.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive --bus socketcand://HOST:29536/can0 sync\n  \
    ferrodrive --bus slcan:///dev/ttyACM0 sync --every 10ms --count 1000\n  \
    ferrodrive --bus slcan:///dev/ttyACM0 sync --every 10ms --sync-counter 240")]
pub(crate) struct SyncCommand {
    #[command(flatten)]
    repeat: Repeat,
    /// Identifier, if 1005h of the devices is not 80h
    #[arg(long, value_name = "ID", value_parser = identifier)]
    id: Option<CanId>,
}

/// A standard identifier in hexadecimal.
pub(in crate::command) fn identifier(text: &str) -> Result<CanId, String> {
    let digits = text.strip_prefix("0x").unwrap_or(text);
    let raw = u16::from_str_radix(digits.trim_end_matches(['h', 'H']), 16).ok();
    raw.filter(|raw| *raw <= CanId::MAX_STANDARD)
        .map(CanId::standard)
        .ok_or_else(|| format!("expected an identifier of 11 bits, hexadecimal 0 to 7FF, e.g. 080, got '{text}'"))
}

/// What was sent.
#[derive(Debug, Serialize)]
pub(crate) struct SyncReport {
    /// How many SYNCs.
    sent: u64,
    every_ms: Option<f64>,
}

impl SyncCommand {
    /// Sends them.
    pub(crate) async fn run(&self, context: &Context) -> Result<SyncReport, Failure> {
        let times = self.repeat.times(context)?;
        let id = self.id.unwrap_or(connection_set::SYNC);
        let mut pace = Ticker::new(&context.network, self.repeat.every.unwrap_or_default());
        let mut sent = 0;
        while times.is_none_or(|times| sent < times) {
            pace.wait().await;
            let counter = context.sync_counter.map(|overflow| (sent % u64::from(overflow)) as u8 + 1);
            context.network.transmit(Sync { counter }.emit(id));
            sent += 1;
            context.progress.show(format!("{sent} SYNC"));
        }
        context.settle().await;
        Ok(SyncReport { sent, every_ms: self.repeat.every.map(|every| every.as_secs_f64() * 1e3) })
    }
}

impl Report for SyncReport {
    fn text(&self, _: Paint) -> String {
        let rate = self.every_ms.map(|every| format!(", one every {every} ms")).unwrap_or_default();
        format!("{} SYNC sent{rate}", self.sent)
    }
}
