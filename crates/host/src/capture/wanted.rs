//! What is to be captured, and for how long.

use std::path::PathBuf;
use std::time::Duration;

use can::Bitrate;
use canopen::pdo::PdoId;
use words::failure::Failure;

use super::{Measurand, Trigger};

/// Shortest time between two readings: more often a bus of 1 Mbit/s carries no frame, the shortest of which has 47 bits (CAN 2.0, 3.2).
const SHORTEST: Duration = Duration::from_micros(50);
/// Readings that are kept at most: eight bytes each.
const MOST: u128 = 100_000_000;

/// What is to be captured, and how.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The quantities.
    pub quantities: Vec<Measurand>,
    /// Time between two readings.
    pub period: Duration,
    /// Of the bus.
    pub bitrate: Bitrate,
    /// TPDOs that are taken although they are in use.
    pub take: Vec<PdoId>,
    /// What cannot come by TPDO is read by SDO.
    pub by_sdo: bool,
    /// Where the way back is kept meanwhile; `None` on a virtual bus that ends with the program.
    pub journal: Option<PathBuf>,
    /// Hears what to do about a journal that stays.
    pub on_kept: fn(&str),
}

/// How long a capture is, and when it begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// From its begin, or from its trigger.
    pub duration: Duration,
    /// What begins it; at once with `None`.
    pub trigger: Option<Trigger>,
    /// What is kept of before the trigger.
    pub pre_trigger: Duration,
}

impl Wanted {
    /// Of a virtual drive that ends with the program: no way back is kept on the disk.
    pub(crate) const fn of_a_virtual_drive(quantities: Vec<Measurand>, period: Duration, bitrate: Bitrate) -> Self {
        Self { quantities, period, bitrate, take: Vec::new(), by_sdo: false, journal: None, on_kept: |_| () }
    }

    /// Checks what can be checked without the bus.
    ///
    /// # Errors
    /// Nothing is asked for, or more often than a bus carries frames; it would be more than is kept.
    pub fn check(&self, span: &Span) -> Result<(), Failure> {
        if self.quantities.is_empty() {
            let what = "expected at least one quantity to capture";
            return Err(Failure::usage(what).next(format!("name some of: {}", super::short_names())));
        }
        if self.period < SHORTEST {
            let what = format!("expected a period of 50 us or more between two readings, got {:?}", self.period);
            return Err(Failure::usage(what).next("1 ms is usual"));
        }
        if self.period > span.duration {
            return Err(
                Failure::usage("a capture that is shorter than its period").next("capture for longer, or more often")
            );
        }
        let rows = span.duration.saturating_add(span.pre_trigger).as_nanos() / self.period.as_nanos();
        let readings = rows * self.quantities.len() as u128;
        if readings > MOST {
            return Err(Failure::usage(format!("{readings} readings are more than are kept, at most {MOST}"))
                .next("capture for a shorter time, at a lower rate, or record it: ferrodrive record"));
        }
        Ok(())
    }
}
