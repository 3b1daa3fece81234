//! The status flags of an adapter (`F`).

/// Status flags. Those beside the state stand for what has been since they were last asked for, and are cleared by that.
///
/// There is no flag for bus-off: an adapter that is off the bus is error-passive before, and answers frames with BEL then.
/// Source: LAWICEL CANUSB manual, command `F`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(pub u8);

impl Status {
    /// An error was on the bus.
    pub const BUS_ERROR: Self = Self(0x80);

    /// A frame of the bus was lost: the receive queue was full, or the controller overran.
    pub const fn is_receive_lost(self) -> bool {
        self.0 & (0x01 | 0x08) != 0
    }

    /// The send queue was full.
    pub const fn is_send_queue_full(self) -> bool {
        self.0 & 0x02 != 0
    }

    /// An error counter has reached the warning limit (ISO 11898-1: 96).
    pub const fn is_error_warning(self) -> bool {
        self.0 & 0x04 != 0
    }

    /// The controller is error-passive (ISO 11898-1).
    pub const fn is_error_passive(self) -> bool {
        self.0 & 0x20 != 0
    }

    /// Arbitration was lost.
    pub const fn is_arbitration_lost(self) -> bool {
        self.0 & 0x40 != 0
    }

    /// An error was on the bus.
    pub const fn is_bus_error(self) -> bool {
        self.0 & Self::BUS_ERROR.0 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits by the manual's table, counted from 0.
    #[test]
    fn flags_have_the_places_of_the_manual() {
        let said = |bit: u8| {
            let flags = Status(1 << bit);
            [
                ("receive lost", flags.is_receive_lost()),
                ("send queue full", flags.is_send_queue_full()),
                ("warning", flags.is_error_warning()),
                ("passive", flags.is_error_passive()),
                ("arbitration lost", flags.is_arbitration_lost()),
                ("bus error", flags.is_bus_error()),
            ]
            .into_iter()
            .filter_map(|(name, set)| set.then_some(name))
            .collect::<Vec<_>>()
        };
        let expected: [&[&str]; 8] = [
            &["receive lost"],
            &["send queue full"],
            &["warning"],
            &["receive lost"],
            &[],
            &["passive"],
            &["arbitration lost"],
            &["bus error"],
        ];
        for (bit, expected) in expected.into_iter().enumerate() {
            assert_eq!(said(bit as u8), expected, "bit {bit}");
        }
    }
}
