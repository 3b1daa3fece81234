use std::time::Duration;

use canopen::{Mux, NodeId};

use crate::error::Error;
use canopen::pdo::{Direction, PdoId, PdoNumber};

/// Why a PDO could not be set up.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PdoError {
    /// The mapping is longer than a frame or has too many objects: nothing was sent.
    #[error(
        "{pdo} of node {node} cannot carry {bits} bits in {objects} objects: a PDO has at most 64 bits. \
             Map fewer or shorter objects"
    )]
    TooLong {
        /// The device.
        node: NodeId,
        /// Which PDO.
        pdo: PdoId,
        /// Bits asked for.
        bits: u32,
        /// Objects asked for.
        objects: usize,
    },
    /// A time does not fit the device's timer: nothing was sent.
    #[error("{pdo} of node {node}: {} ms cannot be set; its timer counts {} µs up to 65535 times. \
             Choose a time up to {} ms", asked.as_millis(), unit.as_micros(), (*unit * 65535).as_millis())]
    Time {
        /// The device.
        node: NodeId,
        /// Which PDO.
        pdo: PdoId,
        /// Time asked for.
        asked: Duration,
        /// One count of the device's timer.
        unit: Duration,
    },
    /// The device refused a step, or did not answer.
    #[error("{pdo} of node {node} could not be set up, at \"{step}\". {}. {}", cause.to_string().trim_end_matches('.'), back(*restored))]
    Step {
        /// The device.
        node: NodeId,
        /// Which PDO.
        pdo: PdoId,
        /// What was being done.
        step: &'static str,
        /// What went wrong.
        cause: Error,
        /// The PDO is as it was before.
        restored: bool,
    },
    /// The device took a value and holds another one.
    #[error("{pdo} of node {node}: {mux} was written {asked:X}h ({step}) and reads back {found:X}h: the device does \
             not take this setting. Read its manual on {mux}, or choose what it supports. {}", back(*restored))]
    ReadBack {
        /// The device.
        node: NodeId,
        /// Which PDO.
        pdo: PdoId,
        /// The object.
        mux: Mux,
        /// What was being done.
        step: &'static str,
        /// The value written.
        asked: u32,
        /// The value read.
        found: u32,
        /// The PDO is as it was before.
        restored: bool,
    },
}

/// Why an object cannot be read from or written to process data.
#[derive(Clone, Debug, thiserror::Error)]
pub enum SignalError {
    /// No PDO that this master knows carries it.
    #[error("{mux} of node {node} is in no {direction} that this master knows: {}", carried(mapped, *direction))]
    NotMapped {
        /// The device.
        node: NodeId,
        /// The object.
        mux: Mux,
        /// To or from the device.
        direction: Direction,
        /// The PDOs of this direction, with what they carry.
        mapped: Vec<(PdoNumber, Vec<Mux>)>,
    },
    /// It is mapped with another length than such a value has, or is a number of another kind.
    #[error("{mux} of node {node} is mapped with {bits} bits: a {wanted} does not hold them, or has another sign")]
    DoesNotSuit {
        /// The device.
        node: NodeId,
        /// The object.
        mux: Mux,
        /// Its length in the PDO.
        bits: u32,
        /// The type asked for.
        wanted: &'static str,
    },
}

/// `TPDO1 has 6041h:00 6064h:00`.
fn carried(mapped: &[(PdoNumber, Vec<Mux>)], direction: Direction) -> String {
    if mapped.is_empty() {
        return format!("none was read from it or set up. Call adopt_pdo or configure_pdo for the {direction} first");
    }
    let pdos = mapped.iter().map(|(number, objects)| {
        let objects = objects.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
        format!(
            "{} has {}",
            PdoId { direction, number: *number },
            if objects.is_empty() { "nothing" } else { &objects }
        )
    });
    format!("{}. Map it with configure_pdo", pdos.collect::<Vec<_>>().join(", "))
}

const fn back(restored: bool) -> &'static str {
    if restored { "The PDO was put back as it was" } else { "The PDO could not be put back: it may be invalid now" }
}
