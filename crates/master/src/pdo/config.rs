use std::time::Duration;

use canopen::Mux;
use devices::Description;

use crate::core::PdoMap;
use canopen::pdo::{AddressMode, PdoId};

/// When a PDO is sent or taken over. Source: CiA 301, tables 64 and 68.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransmissionType(pub u8);

impl TransmissionType {
    /// After the next SYNC, if something has changed.
    pub const SYNC_ACYCLIC: Self = Self(0);
    /// After every SYNC.
    pub const EVERY_SYNC: Self = Self(1);
    /// Sampled with each SYNC, sent when a remote frame asks for it.
    pub const SYNC_RTR: Self = Self(252);
    /// Sampled and sent when a remote frame asks for it.
    pub const EVENT_RTR: Self = Self(253);
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

    /// Those of a model.
    pub const fn of(description: &Description) -> Self {
        Self {
            inhibit: Duration::from_nanos(description.pdo.inhibit_unit_ns),
            event: Duration::from_nanos(description.pdo.event_timer_unit_ns),
        }
    }
}

/// Of a multiplexed PDO. Source: CiA 301, 7.2.3.
const MPDO_BYTES: usize = 8;

/// How one PDO of a device is set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoConfig {
    /// Which one.
    pub pdo: PdoId,
    /// What it carries.
    pub map: PdoMap,
    /// Whose objects the frames name, of a multiplexed PDO (CiA 301, 7.2.3), which has no mapping.
    pub multiplexed: Option<AddressMode>,
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
    pub const fn new(pdo: PdoId, map: PdoMap) -> Self {
        let transmission = TransmissionType::EVENT_PROFILE;
        Self { pdo, map, multiplexed: None, transmission, inhibit_time: None, event_time: None, id: None }
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

    /// Neither objects are mapped, nor is it multiplexed.
    pub fn is_empty(&self) -> bool {
        self.map.0.is_empty() && self.multiplexed.is_none()
    }

    /// Bytes of a frame of it.
    pub fn bytes(&self) -> usize {
        if self.multiplexed.is_some() { MPDO_BYTES } else { self.map.bytes() }
    }

    pub(super) const fn parameter(&self, sub_index: u8) -> Mux {
        Mux::new(self.pdo.parameter_index(), sub_index)
    }

    pub(super) const fn mapping(&self, sub_index: u8) -> Mux {
        Mux::new(self.pdo.mapping_index(), sub_index)
    }
}
