use core::fmt;
use core::num::NonZeroU16;

/// Which way a PDO goes, from the device's side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// Receive PDO, to the device: objects must be writable.
    Rpdo,
    /// Transmit PDO, from the device: objects must be readable.
    Tpdo,
}

impl Direction {
    /// Index of the communication parameter of PDO 1. Source: CiA 301, 7.5.2.35 and 7.5.2.37.
    pub const fn parameter_base(self) -> u16 {
        match self {
            Self::Rpdo => super::RPDO_PARAMETER,
            Self::Tpdo => super::TPDO_PARAMETER,
        }
    }

    /// Index of the mapping parameter of PDO 1. Source: CiA 301, 7.5.2.36 and 7.5.2.38.
    pub const fn mapping_base(self) -> u16 {
        match self {
            Self::Rpdo => super::RPDO_MAPPING,
            Self::Tpdo => super::TPDO_MAPPING,
        }
    }
}

/// `RPDO`, `TPDO`.
impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rpdo => "RPDO",
            Self::Tpdo => "TPDO",
        })
    }
}

/// The number of a PDO, 1 to 512, as CiA 301 counts: PDO 1 has the objects 1400h and 1600h, or 1800h and 1A00h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PdoNumber(NonZeroU16);

impl PdoNumber {
    /// How many PDOs of each direction CiA 301 has records for.
    pub const MAX: u16 = 512;
    /// How many of each direction have an identifier in the predefined connection set (CiA 301, 7.3.3).
    pub const PREDEFINED: usize = 4;
    /// PDO 1.
    pub const FIRST: Self = Self(NonZeroU16::MIN);

    /// PDO `number`, if it is in 1..=512.
    pub const fn new(number: u16) -> Option<Self> {
        match NonZeroU16::new(number) {
            Some(number) if number.get() <= Self::MAX => Some(Self(number)),
            _ => None,
        }
    }

    /// The PDO whose objects stand at `position` from the base: 0 for PDO 1.
    pub const fn at(position: usize) -> Option<Self> {
        if position < Self::MAX as usize { Self::new(position as u16 + 1) } else { None }
    }

    /// The number of the PDO, 1 to 512 (CiA 301, 7.5.2.35).
    pub const fn number(self) -> u16 {
        self.0.get()
    }

    /// 0 to 511: position in an array, and what is added to the base of the PDO's object indices.
    pub const fn position(self) -> usize {
        self.number() as usize - 1
    }
}

/// `3`.
impl fmt::Display for PdoNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.number().fmt(f)
    }
}

/// One PDO of a device. Prints as `RPDO1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PdoId {
    /// RPDO or TPDO.
    pub direction: Direction,
    /// Which one.
    pub number: PdoNumber,
}

impl PdoId {
    /// The PDO that an object of the communication profile area belongs to, and whether it is the mapping (else the
    /// communication parameter); `None` for an object of no PDO.
    pub const fn of_object(index: u16) -> Option<(Self, bool)> {
        let (direction, is_mapping) = match index & !0x1FF {
            super::RPDO_PARAMETER => (Direction::Rpdo, false),
            super::RPDO_MAPPING => (Direction::Rpdo, true),
            super::TPDO_PARAMETER => (Direction::Tpdo, false),
            super::TPDO_MAPPING => (Direction::Tpdo, true),
            _ => return None,
        };
        match PdoNumber::at((index & 0x1FF) as usize) {
            Some(number) => Some((Self { direction, number }, is_mapping)),
            None => None,
        }
    }

    /// Index of its communication parameter.
    pub const fn parameter_index(self) -> u16 {
        self.direction.parameter_base() + self.number.position() as u16
    }

    /// Index of its mapping parameter.
    pub const fn mapping_index(self) -> u16 {
        self.direction.mapping_base() + self.number.position() as u16
    }
}

/// `RPDO1`.
impl fmt::Display for PdoId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.direction, self.number)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn numbers_are_1_to_512() {
        assert_eq!((PdoNumber::new(0), PdoNumber::new(513), PdoNumber::at(512)), (None, None, None));
        assert_eq!(PdoNumber::new(512).map(PdoNumber::position), Some(511));
        assert_eq!(PdoNumber::at(0), Some(PdoNumber::FIRST));
    }

    #[test]
    fn every_record_of_the_four_areas_names_its_pdo_and_back() {
        let mut named = 0;
        for index in 0x1000..=0x1FFF {
            let Some((pdo, is_mapping)) = PdoId::of_object(index) else { continue };
            assert_eq!(index, if is_mapping { pdo.mapping_index() } else { pdo.parameter_index() });
            named += 1;
        }
        assert_eq!(named, 4 * 512);
        let last = PdoId::of_object(0x1BFF).unwrap();
        assert_eq!((last.0.to_string().as_str(), last.1), ("TPDO512", true));
    }
}
