//! An error frame in words: which of the five errors of ISO 11898-1 a node detected, or that arbitration was lost.

use std::fmt;

/// What a controller reports of an error on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ErrorFrame {
    /// What was detected; empty where the controller does not report it.
    pub kinds: ErrorKinds,
    /// Whether the controller itself was sending; `None` where it does not report that.
    pub transmitting: Option<bool>,
    /// The error counters, where the controller reports them.
    pub counters: Option<ErrorCounters>,
}

/// Error counters of a controller (ISO 11898-1, fault confinement).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ErrorCounters {
    /// Transmit error counter; what is above 255 is bus-off.
    pub transmit: u8,
    /// Receive error counter.
    pub receive: u8,
}

/// A kind of error (ISO 11898-1, error detection), or what controllers report beside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum ErrorKind {
    /// A frame that was sent was not acknowledged.
    Acknowledge,
    /// A bit on the wire was not the one sent.
    Bit,
    /// Six equal bits in a row.
    Stuff,
    /// A bit of fixed form had the wrong level.
    Form,
    /// The checksum is wrong.
    Crc,
    /// Another frame had priority: no error of the wire.
    LostArbitration,
    /// An overload frame.
    Overload,
    /// The transceiver reports a fault of the wires.
    Transceiver,
}

impl ErrorKind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Acknowledge,
        Self::Bit,
        Self::Stuff,
        Self::Form,
        Self::Crc,
        Self::LostArbitration,
        Self::Overload,
        Self::Transceiver,
    ];
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Acknowledge => "a frame was not acknowledged",
            Self::Bit => "bit error",
            Self::Stuff => "stuff error",
            Self::Form => "form error",
            Self::Crc => "CRC error",
            Self::LostArbitration => "arbitration lost",
            Self::Overload => "overload",
            Self::Transceiver => "fault at the transceiver",
        })
    }
}

/// A set of [`ErrorKind`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ErrorKinds(u8);

impl ErrorKinds {
    /// None.
    pub const NONE: Self = Self(0);

    /// These and `kind`.
    #[must_use]
    pub const fn with(self, kind: ErrorKind) -> Self {
        Self(self.0 | 1 << kind as u8)
    }

    /// Whether `kind` is in it.
    pub const fn contains(self, kind: ErrorKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    /// Whether nothing is in it.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// What is in it, in the order of [`ErrorKind::ALL`].
    pub fn iter(self) -> impl Iterator<Item = ErrorKind> {
        ErrorKind::ALL.into_iter().filter(move |kind| self.contains(*kind))
    }
}

impl FromIterator<ErrorKind> for ErrorKinds {
    fn from_iter<I: IntoIterator<Item = ErrorKind>>(kinds: I) -> Self {
        kinds.into_iter().fold(Self::NONE, Self::with)
    }
}

impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.kinds.is_empty() {
            f.write_str("of a kind that the controller does not report")?;
        }
        for (place, kind) in self.kinds.iter().enumerate() {
            write!(f, "{}{kind}", if place == 0 { "" } else { ", " })?;
        }
        match self.transmitting {
            Some(true) => f.write_str(" while sending")?,
            Some(false) => f.write_str(" while receiving")?,
            None => {}
        }
        match self.counters {
            Some(ErrorCounters { transmit, receive }) => {
                write!(f, " (error counters: {transmit} sent, {receive} received)")
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_has_what_was_put_in() {
        for kind in ErrorKind::ALL {
            let one = ErrorKinds::NONE.with(kind);
            assert!(one.iter().eq([kind]) && !one.is_empty());
        }
        let two: ErrorKinds = [ErrorKind::Crc, ErrorKind::Bit].into_iter().collect();
        assert!(two.iter().eq([ErrorKind::Bit, ErrorKind::Crc]));
        let frame = ErrorFrame {
            kinds: two,
            transmitting: Some(true),
            counters: Some(ErrorCounters { transmit: 8, receive: 0 }),
        };
        assert_eq!(frame.to_string(), "bit error, CRC error while sending (error counters: 8 sent, 0 received)");
        assert_eq!(ErrorFrame::default().to_string(), "of a kind that the controller does not report");
    }
}
