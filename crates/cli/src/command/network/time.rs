//! `ferrodrive time`: the TIME stamp object (CiA 301, clause 7.2.6).

use std::time::Duration;

use can::CanId;
use canopen::connection_set;
use canopen::time_stamp::TimeOfDay;
use serde::Serialize;
use transport::WallClock;

use super::sync::identifier;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::Report;
use console::numbers::whole;
use plot::Paint;

/// Send the time of day to every device that consumes it (1012h)
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive --bus slcan:///dev/ttyACM0 time\n  ferrodrive time --unix 1000000000 -v"
)]
pub(crate) struct Time {
    /// Time to send instead of now, in seconds since 1 January 1970, UTC
    #[arg(long, value_name = "SECONDS", value_parser = |text: &str| whole(text, 0..=u64::MAX))]
    unix: Option<u64>,
    /// Identifier, if 1012h of the devices is not 100h
    #[arg(long, value_name = "ID", value_parser = identifier)]
    id: Option<CanId>,
}

/// What was sent.
#[derive(Debug, Serialize)]
pub(crate) struct TimeReport {
    /// Days since 1 January 1984.
    days: u16,
    /// Milliseconds since midnight, UTC.
    ms: u32,
    /// Both for people.
    utc: String,
}

impl Time {
    /// Sends it. CiA 301 does not say of which zone the time is: it is UTC here.
    pub(crate) async fn run(&self, context: &Context) -> Result<TimeReport, Failure> {
        // A clock that starts now has its zero now.
        let unix = self.unix.map_or_else(|| WallClock::start().unix_zero(), Duration::from_secs);
        let time = TimeOfDay::from_unix(unix).ok_or_else(|| {
            Failure::usage("this time cannot be sent in a TIME frame")
                .because("it counts days from 1 January 1984 in 16 bits, up to 2163")
                .next("set the clock of this machine, or give another --unix SECONDS")
        })?;
        context.network.transmit(time.emit(self.id.unwrap_or(connection_set::TIME)));
        context.settle().await;
        Ok(TimeReport { days: time.days, ms: time.millis, utc: time.to_string() })
    }
}

impl Report for TimeReport {
    fn text(&self, _: Paint) -> String {
        format!("TIME sent: {} UTC (day {} since 1984, {} ms)", self.utc, self.days, self.ms)
    }
}
