//! What a log holds, whatever its form: frames with their time, interface and direction, and what stands between them.

use std::fmt;

use can::{CanId, Frame, Instant};

use crate::finding::Finding;

/// What stands in a log at one moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// When: Unix time, or time since the log's begin where the log has no calendar. `None` where it has no time at all.
    pub at: Option<Instant>,
    /// On which bus.
    pub interface: Interface,
    /// Whether the logging program sent it; `None` where the log does not have it.
    pub direction: Option<Direction>,
    /// What was on the bus.
    pub content: Content,
}

impl Record {
    /// A frame of the bus called `can0`, without a direction.
    pub fn of_frame(at: Instant, frame: Frame) -> Self {
        let content = Content::Frame(frame);
        Self { at: Some(at), interface: Interface::default(), direction: None, content }
    }

    /// The frame, if it is one of classical CAN.
    pub const fn frame(&self) -> Option<&Frame> {
        match &self.content {
            Content::Frame(frame) => Some(frame),
            Content::Error(_) | Content::FdFrame { .. } => None,
        }
    }
}

/// What was on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A frame of classical CAN.
    Frame(Frame),
    /// An error frame, as Linux reports one.
    Error(RawErrorFrame),
    /// A CAN FD frame, which CANopen (CiA 301) has not; its data is passed over.
    FdFrame {
        /// Its identifier.
        id: CanId,
        /// Bytes of data, 0 to 64.
        length: u8,
    },
}

/// An error frame in the form of Linux (`linux/can/error.h`), which the forms of logs share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawErrorFrame {
    /// Error classes, bits 0 to 28 of the identifier.
    pub class: u32,
    /// What the classes say in detail.
    pub data: [u8; 8],
}

impl RawErrorFrame {
    /// An error frame of which a log gives no details: class `CAN_ERR_BUSERROR`.
    pub const UNSPECIFIED: Self = Self { class: 0x80, data: [0; 8] };
}

/// Which way a frame went, seen from the program that wrote the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// It came from the bus.
    Received,
    /// The program sent it.
    Transmitted,
}

/// Longest name of an interface on Linux (IFNAMSIZ without its terminating zero).
const MAX_NAME_LENGTH: usize = 15;

/// Name of a bus, such as `can0`, at most 15 characters without white space. Formats that number their buses from 1 on mean
/// `can0` by the first.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Interface {
    name: [u8; MAX_NAME_LENGTH],
    length: u8,
}

impl Interface {
    /// `name`, with everything that is not printable ASCII replaced, and cut where it is too long.
    pub fn named(name: &str) -> Self {
        let mut interface = Self { name: [0; MAX_NAME_LENGTH], length: 0 };
        for char in name.chars().take(MAX_NAME_LENGTH) {
            interface.name[usize::from(interface.length)] = if char.is_ascii_graphic() { char as u8 } else { b'_' };
            interface.length += 1;
        }
        if interface.length == 0 { Self::default() } else { interface }
    }

    /// The bus that a format numbers so, from 1 on.
    pub fn numbered(number: u16) -> Self {
        Self::named(&format!("can{}", number.saturating_sub(1)))
    }

    /// The name.
    pub fn name(&self) -> &str {
        str::from_utf8(&self.name[..usize::from(self.length)]).unwrap_or("can0")
    }

    /// The number for formats without names: one more than the digits at the name's end, 1 without digits.
    pub fn number(&self) -> u16 {
        let name = self.name();
        let digits = name.len() - name.trim_end_matches(|char: char| char.is_ascii_digit()).len();
        let number: Option<u16> = name[name.len() - digits..].parse().ok();
        number.and_then(|number| number.checked_add(1)).unwrap_or(1)
    }
}

impl Default for Interface {
    fn default() -> Self {
        Self::named("can0")
    }
}

impl fmt::Debug for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The next thing in a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Entry {
    /// What was on a bus.
    Record(Record),
    /// Something that is not read, and was passed over.
    Finding(Finding),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interface_has_a_name_and_a_number() {
        for (name, shown, number) in
            [("can0", "can0", 1), ("vcan12", "vcan12", 13), ("pcan", "pcan", 1), ("", "can0", 1), ("a b", "a_b", 1)]
        {
            let interface = Interface::named(name);
            assert_eq!((interface.name(), interface.number()), (shown, number));
        }
        assert_eq!(Interface::numbered(3).name(), "can2");
        assert_eq!(Interface::numbered(0).name(), "can0");
        assert_eq!(Interface::named("a-name-that-is-too-long").name(), "a-name-that-is-");
        assert_eq!(Interface::named("x99999").number(), 1);
    }
}
