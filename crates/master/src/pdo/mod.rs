//! PDO configuration as a transaction (CiA 301, 7.5.2.35 to 7.5.2.38).
//!
//! In: what a PDO shall carry and when it shall be sent. The device is told in the only order that the standard
//! allows (invalidate, clear the mapping, entries, count, transmission type, timers, validate), every value is read
//! back, and on any failure the PDO is put back as it was. The master then sends or receives it by the new mapping.
//! Saving to the device's memory is deliberately not part of it: see [`crate::drive`].

mod transaction;

use core::fmt;
use std::time::Duration;

use canopen::{CobId, Mux, NodeId};

use crate::core::{PdoMap, RpdoTrigger};
use crate::decode::Direction;
use crate::error::Error;
use crate::network::Node;
use transaction::{apply, read};

/// When a PDO is sent or taken over. Source: CiA 301, tables 64 and 68.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransmissionType(pub u8);

impl TransmissionType {
    /// After the next SYNC, if something has changed.
    pub const SYNC_ACYCLIC: Self = Self(0);
    /// After every SYNC.
    pub const EVERY_SYNC: Self = Self(1);
    /// Event-driven, the manufacturer's events.
    pub const EVENT_MANUFACTURER: Self = Self(254);
    /// Event-driven, the device profile's events.
    pub const EVENT_PROFILE: Self = Self(255);

    /// True if SYNC decides.
    pub const fn is_synchronous(self) -> bool {
        self.0 <= 240
    }
}

/// How long one count of a device's PDO timers is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimerUnits {
    /// Inhibit time, sub-index 03h.
    pub inhibit: Duration,
    /// Event timer, sub-index 05h.
    pub event: Duration,
}

impl TimerUnits {
    /// 100 µs and 1 ms. Source: CiA 301, 7.5.2.37.
    pub const STANDARD: Self = Self { inhibit: Duration::from_micros(100), event: Duration::from_millis(1) };
}

/// How one PDO of a device is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoConfig {
    /// RPDO or TPDO, from the device's side.
    pub direction: Direction,
    /// Counted from 0: 1400h, 1800h.
    pub number: u8,
    /// What it carries.
    pub map: PdoMap,
    /// When it is sent or taken over.
    pub transmission: TransmissionType,
    /// Shortest time between two; `None` leaves the device's value.
    pub inhibit_time: Option<Duration>,
    /// Longest time between two; `None` leaves the device's value.
    pub event_time: Option<Duration>,
    /// Its identifier; `None` leaves the device's.
    pub id: Option<u16>,
}

impl PdoConfig {
    /// A PDO that carries `map`, event-driven, with the device's own identifier and timers.
    pub const fn new(direction: Direction, number: u8, map: PdoMap) -> Self {
        let transmission = TransmissionType::EVENT_PROFILE;
        Self { direction, number, map, transmission, inhibit_time: None, event_time: None, id: None }
    }

    /// With another transmission type.
    #[must_use]
    pub const fn transmission(mut self, transmission: TransmissionType) -> Self {
        self.transmission = transmission;
        self
    }

    /// With this shortest time between two.
    #[must_use]
    pub const fn inhibit_time(mut self, time: Duration) -> Self {
        self.inhibit_time = Some(time);
        self
    }

    /// With this longest time between two.
    #[must_use]
    pub const fn event_time(mut self, time: Duration) -> Self {
        self.event_time = Some(time);
        self
    }

    const fn parameter(&self, sub_index: u8) -> Mux {
        Mux::new(self.direction.parameter_base() + self.number as u16, sub_index)
    }

    const fn mapping(&self, sub_index: u8) -> Mux {
        Mux::new(self.direction.mapping_base() + self.number as u16, sub_index)
    }
}

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
        pdo: PdoName,
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
        pdo: PdoName,
        /// Time asked for.
        asked: Duration,
        /// One count of the device's timer.
        unit: Duration,
    },
    /// The device refused a step, or did not answer.
    #[error("{pdo} of node {node} could not be set up, at \"{step}\". {cause} {}", back(*restored))]
    Step {
        /// The device.
        node: NodeId,
        /// Which PDO.
        pdo: PdoName,
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
        pdo: PdoName,
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

/// `TPDO0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoName(pub Direction, pub u8);

impl fmt::Display for PdoName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.0, self.1)
    }
}

const fn back(restored: bool) -> &'static str {
    if restored { "The PDO was put back as it was" } else { "The PDO could not be put back: it may be invalid now" }
}

impl Node {
    /// Sets up a PDO of the device and, when every value reads back right, sends or receives it by its mapping.
    ///
    /// # Errors
    /// [`PdoError`]; the device's PDO is then put back as it was, as far as it answers.
    pub async fn configure_pdo(&self, config: &PdoConfig, units: TimerUnits) -> Result<(), PdoError> {
        let cob_id = apply(self, config, units).await?;
        self.use_pdo(config, cob_id);
        Ok(())
    }

    /// Reads how a PDO of the device is set up and sends or receives it by that.
    ///
    /// # Errors
    /// Those of the SDO reads.
    pub async fn adopt_pdo(&self, direction: Direction, number: u8, units: TimerUnits) -> Result<PdoConfig, Error> {
        let (config, cob_id) = read(self, direction, number, units).await?;
        self.use_pdo(&config, cob_id);
        Ok(config)
    }

    fn use_pdo(&self, config: &PdoConfig, cob_id: CobId) {
        let (node, number, map) = (self.id(), config.number, config.map.clone());
        let id = cob_id.can_id().as_standard().filter(|_| cob_id.is_valid());
        self.network().with_core(|core| match (config.direction, id) {
            (Direction::Tpdo, Some(id)) => core.image_mut().set_tpdo(node, number, id, map),
            (Direction::Tpdo, None) => core.image_mut().remove_tpdo(node, number),
            (Direction::Rpdo, Some(id)) => {
                let synchronous = config.transmission.is_synchronous();
                let trigger = if synchronous { RpdoTrigger::Sync } else { RpdoTrigger::Write };
                core.image_mut().set_rpdo(node, number, id, map, trigger);
            }
            (Direction::Rpdo, None) => core.image_mut().remove_rpdo(node, number),
        });
    }

    /// Puts a value into the RPDOs that carry the object; false if none does. Sent by the PDO's transmission type.
    pub fn send_by_pdo(&self, mux: Mux, raw: u64) -> bool {
        self.network().with_core(|core| core.image_mut().write(self.id(), mux, raw))
    }
}
