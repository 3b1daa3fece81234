//! `--every` and `--count`: what a command does again and again, at a rate that does not drift.

use std::time::Duration;

use can::Instant;
use master::Network;
use master::units::parse_duration;

use crate::context::Context;
use crate::failure::Failure;
use console::numbers::whole;

/// How often, and how many times.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(crate) struct Repeat {
    /// Repeat with this period
    #[arg(long, value_name = "TIME", value_parser = period)]
    pub(crate) every: Option<Duration>,
    /// Number of times (default: until Ctrl-C)
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=u64::MAX))]
    pub(crate) count: Option<u64>,
}

/// In virtual time, which passes as fast as the machine can, Ctrl-C does not come.
const TIMES_ON_AN_EMBEDDED_BUS: u64 = 10;

/// More often than this a bus of 1 Mbit/s cannot carry a frame: the shortest has 47 bits (CAN 2.0, 3.2).
const SHORTEST: Duration = Duration::from_micros(50);

/// A period: a time that is not zero.
pub(crate) fn period(text: &str) -> Result<Duration, String> {
    let period = parse_duration(text).map_err(|error| error.to_string())?;
    if period < SHORTEST { Err("expected a period of 50us or more, e.g. 10ms".into()) } else { Ok(period) }
}

impl Repeat {
    /// How many times: once without a period, and not for ever on an embedded bus. `None` is until Ctrl-C.
    pub(crate) fn times(&self, context: &Context) -> Result<Option<u64>, Failure> {
        match (self.every, self.count) {
            (None, None) => Ok(Some(1)),
            (None, Some(1)) => Ok(Some(1)),
            (None, Some(_)) => {
                Err(Failure::usage("--count needs a period").next("give --every TIME, e.g. --every 10ms"))
            }
            (Some(_), None) if context.is_embedded() => Ok(Some(TIMES_ON_AN_EMBEDDED_BUS)),
            (Some(_), count) => Ok(count),
        }
    }
}

/// Due times with equal distances.
pub(crate) struct Ticker {
    network: Network,
    begin: Instant,
    every: Duration,
    next: u64,
}

impl Ticker {
    /// From now on, the first time at once.
    pub(crate) fn new(network: &Network, every: Duration) -> Self {
        Self { network: network.clone(), begin: network.now(), every, next: 0 }
    }

    /// Waits for the next due time. Those that passed while the caller was busy are left out.
    pub(crate) async fn wait(&mut self) {
        let passed = (self.network.now() - self.begin).as_nanos() as u64;
        let every = self.every.as_nanos().max(1) as u64;
        self.next = self.next.max(passed / every);
        let due = self.next.saturating_mul(every);
        self.next += 1;
        if due > passed {
            self.network.sleep(Duration::from_nanos(due - passed)).await;
        }
    }
}
