use core::fmt;

/// The controlword, object 6040h. Source: CiA 402-2, 8.4.1.
#[doc(alias = "control word")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Controlword(pub u16);

impl Controlword {
    /// Bit 0.
    pub const SWITCH_ON: u16 = 1 << 0;
    /// Bit 1.
    pub const ENABLE_VOLTAGE: u16 = 1 << 1;
    /// Bit 2; active low: 0 asks for a quick stop.
    pub const QUICK_STOP: u16 = 1 << 2;
    /// Bit 3.
    pub const ENABLE_OPERATION: u16 = 1 << 3;
    /// Bit 4 in profile position: a rising edge takes the set-point; in homing: start.
    pub const NEW_SET_POINT: u16 = 1 << 4;
    /// Bit 5 in profile position.
    pub const CHANGE_SET_IMMEDIATELY: u16 = 1 << 5;
    /// Bit 6 in profile position: the target position is relative.
    pub const RELATIVE: u16 = 1 << 6;
    /// Bit 4 in velocity mode: the velocity follows the ramp.
    pub const ENABLE_RAMP: u16 = 1 << 4;
    /// Bit 5 in velocity mode: the ramp goes on; 0 keeps it where it is.
    pub const UNLOCK_RAMP: u16 = 1 << 5;
    /// Bit 6 in velocity mode: the ramp leads to the target; 0 leads it to standstill.
    pub const REFERENCE_RAMP: u16 = 1 << 6;
    /// Bit 7: a rising edge resets a fault.
    pub const FAULT_RESET: u16 = 1 << 7;
    /// Bit 8.
    pub const HALT: u16 = 1 << 8;

    /// True if all bits of `mask` are set.
    pub const fn has(self, mask: u16) -> bool {
        self.0 & mask == mask
    }

    /// True if `mask` is set here and was not in `before`.
    pub const fn rises(self, before: Self, mask: u16) -> bool {
        self.has(mask) && !before.has(mask)
    }

    /// The command for the power drive state machine in bits 0 to 3 and 7. Source: CiA 402-2, table 24.
    ///
    /// Bits 0 to 3 = 0111 is "switch on" and, in Operation enabled, "disable operation": the table of transitions
    /// shows which. While bit 7 is set the command is [`PowerCommand::FaultReset`]; that only its rising edge
    /// counts is for the caller to see to.
    pub const fn command(self) -> PowerCommand {
        if self.has(Self::FAULT_RESET) {
            return PowerCommand::FaultReset;
        }
        if !self.has(Self::ENABLE_VOLTAGE) {
            return PowerCommand::DisableVoltage;
        }
        if !self.has(Self::QUICK_STOP) {
            return PowerCommand::QuickStop;
        }
        match (self.has(Self::SWITCH_ON), self.has(Self::ENABLE_OPERATION)) {
            (false, _) => PowerCommand::Shutdown,
            (true, false) => PowerCommand::SwitchOn,
            (true, true) => PowerCommand::EnableOperation,
        }
    }
}

impl fmt::Display for Controlword {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}h ({})", self.0, self.command().name())?;
        let extra = [
            (Self::NEW_SET_POINT, "bit 4"),
            (Self::CHANGE_SET_IMMEDIATELY, "bit 5"),
            (Self::RELATIVE, "bit 6"),
            (Self::HALT, "halt"),
        ];
        extra.iter().filter(|(mask, _)| self.has(*mask)).try_for_each(|(_, name)| write!(f, ", {name}"))
    }
}

/// What a controlword asks of the power drive state machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PowerCommand {
    /// Bits 0 to 3 = x110.
    Shutdown,
    /// Bits 0 to 3 = 0111; in Operation enabled this is "disable operation".
    SwitchOn,
    /// Bits 0 to 3 = 1111.
    EnableOperation,
    /// Bit 1 = 0.
    DisableVoltage,
    /// Bits 1 and 2 = 1 and 0.
    QuickStop,
    /// Bit 7 rises.
    FaultReset,
}

impl PowerCommand {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Shutdown,
        Self::SwitchOn,
        Self::EnableOperation,
        Self::DisableVoltage,
        Self::QuickStop,
        Self::FaultReset,
    ];

    /// The controlword that carries the command and nothing else.
    pub const fn controlword(self) -> Controlword {
        Controlword(match self {
            Self::Shutdown => 0x06,
            Self::SwitchOn => 0x07,
            Self::EnableOperation => 0x0F,
            Self::DisableVoltage => 0x00,
            Self::QuickStop => 0x02,
            Self::FaultReset => 0x80,
        })
    }

    /// The command as the standard names it, in lower case: `quick stop`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Shutdown => "shutdown",
            Self::SwitchOn => "switch on or disable operation",
            Self::EnableOperation => "enable operation",
            Self::DisableVoltage => "disable voltage",
            Self::QuickStop => "quick stop",
            Self::FaultReset => "fault reset",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_decodes_from_its_own_controlword() {
        for command in PowerCommand::ALL {
            assert_eq!(command.controlword().command(), command);
        }
    }

    #[test]
    fn do_not_care_bits_are_ignored() {
        // Shutdown is x110, disable voltage xx0x, quick stop x01x (CiA 402-2, table 24).
        assert_eq!(Controlword(0x0E).command(), PowerCommand::Shutdown);
        assert_eq!(Controlword(0x0D).command(), PowerCommand::DisableVoltage);
        assert_eq!(Controlword(0x0B).command(), PowerCommand::QuickStop);
        assert_eq!(Controlword(0x015F).command(), PowerCommand::EnableOperation);
    }
}
