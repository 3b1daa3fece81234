use can::Frame;

use super::{Mapping, Parameter};

/// A receive PDO: to the device. Source: CiA 301, 7.2.2.5.1.
#[derive(Clone, Copy, Debug)]
pub struct Rpdo {
    id: Option<u16>,
    synchronous: bool,
    mapping: Option<Mapping>,
    latched: Option<u64>,
}

/// What becomes of a received RPDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reception {
    /// The data takes effect now.
    Apply(u64),
    /// The data waits for the next SYNC, in place of what waited before.
    Latched,
    /// Fewer bytes than mapped: nothing of it is used.
    TooShort,
    /// No object is mapped.
    NothingMapped,
}

impl Rpdo {
    /// Not valid.
    pub const INVALID: Self = Self { id: None, synchronous: false, mapping: None, latched: None };

    /// Takes a changed record; what was latched is dropped.
    pub fn configure(parameter: &Parameter, mapping: Option<Mapping>) -> Self {
        Self {
            id: parameter.standard_id(),
            synchronous: parameter.transmission_type.is_synchronous(),
            mapping,
            latched: None,
        }
    }

    /// The identifier to listen to, if the PDO is valid.
    pub const fn standard_id(&self) -> Option<u16> {
        self.id
    }

    /// What is mapped.
    pub const fn mapping(&self) -> Option<&Mapping> {
        self.mapping.as_ref()
    }

    /// A frame with the PDO's identifier arrived while operational. Bytes beyond the mapping are ignored.
    #[inline]
    pub fn receive(&mut self, frame: &Frame) -> Reception {
        let Some(mapping) = &self.mapping else { return Reception::NothingMapped };
        if frame.dlc() < mapping.length() {
            return Reception::TooShort;
        }
        let data = u64::from_le_bytes(*frame.padded());
        if self.synchronous {
            self.latched = Some(data);
            Reception::Latched
        } else {
            Reception::Apply(data)
        }
    }

    /// At SYNC: the data that waited for it.
    #[inline]
    pub const fn take_latched(&mut self) -> Option<u64> {
        self.latched.take()
    }
}
