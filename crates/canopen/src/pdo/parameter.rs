//! How a PDO travels (CiA 301, 7.5.2.35 and 7.5.2.37): records 1400h and 1800h, and what may be written to them.

use crate::od::View;
use crate::{AbortCode, CobId, Mux};

/// Sub-index of the COB-ID.
pub const COB_ID: u8 = 1;
/// Sub-index of the transmission type.
pub const TRANSMISSION_TYPE: u8 = 2;
/// Sub-index of the inhibit time.
pub const INHIBIT_TIME: u8 = 3;
/// Sub-index of the event timer.
pub const EVENT_TIMER: u8 = 5;
/// Sub-index of the SYNC start value, of TPDOs.
pub const SYNC_START_VALUE: u8 = 6;

/// When a PDO is sent, or takes effect. Source: CiA 301, tables 72 and 77.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransmissionType {
    /// 0: a TPDO at the SYNC after an event.
    SynchronousAcyclic,
    /// 1 to 240: a TPDO at every n-th SYNC.
    SynchronousCyclic(u8),
    /// 252: a TPDO is sampled at each SYNC, and sent when a remote frame asks for it.
    RemoteSynchronous,
    /// 253: a TPDO is sampled and sent when a remote frame asks for it.
    RemoteEventDriven,
    /// 254: the manufacturer defines the event.
    EventDrivenManufacturer,
    /// 255: the device profile defines the event.
    EventDrivenProfile,
}

impl TransmissionType {
    /// From the value of sub-index 02h.
    ///
    /// # Errors
    /// 0609 0030h for the reserved types 241 to 251.
    pub const fn from_raw(raw: u8) -> Result<Self, AbortCode> {
        match raw {
            0 => Ok(Self::SynchronousAcyclic),
            1..=240 => Ok(Self::SynchronousCyclic(raw)),
            252 => Ok(Self::RemoteSynchronous),
            253 => Ok(Self::RemoteEventDriven),
            254 => Ok(Self::EventDrivenManufacturer),
            255 => Ok(Self::EventDrivenProfile),
            241..=251 => Err(AbortCode::INVALID_VALUE),
        }
    }

    /// True for 252 and 253: types of TPDOs only (reserved for RPDOs).
    pub const fn is_remote(self) -> bool {
        matches!(self, Self::RemoteSynchronous | Self::RemoteEventDriven)
    }

    /// True for 0 to 240.
    pub const fn is_synchronous(self) -> bool {
        matches!(self, Self::SynchronousAcyclic | Self::SynchronousCyclic(_))
    }

    /// True for 254 and 255.
    pub const fn is_event_driven(self) -> bool {
        matches!(self, Self::EventDrivenManufacturer | Self::EventDrivenProfile)
    }
}

/// A communication record as it stands in the dictionary. What the record lacks is 0; without COB-ID it is invalid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Sub-index 01h.
    pub cob_id: CobId,
    /// Sub-index 02h; 255 where the dictionary holds something impossible.
    pub transmission_type: TransmissionType,
    /// Sub-index 03h, in the device's unit.
    pub inhibit_time: u16,
    /// Sub-index 05h, in the device's unit.
    pub event_timer: u16,
    /// Sub-index 06h: the counter of the SYNC that counts as the first one; 0 for none.
    pub sync_start_value: u8,
}

impl Parameter {
    /// Reads the record at `index` (1400h or 1800h + n).
    pub fn read(values: &View<'_>, index: u16) -> Self {
        let value = |sub_index| values.value(Mux::new(index, sub_index)).ok().map(|value| value as u32);
        let transmission_type = value(TRANSMISSION_TYPE).unwrap_or(255) as u8;
        Self {
            cob_id: CobId(value(COB_ID).unwrap_or(CobId::INVALID)),
            transmission_type: TransmissionType::from_raw(transmission_type)
                .unwrap_or(TransmissionType::EventDrivenProfile),
            inhibit_time: value(INHIBIT_TIME).unwrap_or(0) as u16,
            event_timer: value(EVENT_TIMER).unwrap_or(0) as u16,
            sync_start_value: value(SYNC_START_VALUE).unwrap_or(0) as u8,
        }
    }

    /// The 11-bit identifier to use; `None` while the PDO is not valid.
    pub fn standard_id(&self) -> Option<u16> {
        self.cob_id.can_id().as_standard().filter(|_| self.cob_id.is_valid())
    }
}
