//! Option codes: how a drive stops. Open newtypes: a drive supports some values and may add negative ones.
//! Source: CiA 402-2, tables 33 to 44; 6007h: the same part, abort connection option code.

macro_rules! option_code {
    ($(#[$doc:meta])* $name:ident { $($(#[$value_doc:meta])* $constant:ident = $value:literal;)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub i16);

        impl $name {
            $($(#[$value_doc])* pub const $constant: Self = Self($value);)*
        }
    };
}

option_code! {
    /// 605Ah: what a quick stop does.
    QuickStopOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then Switch on disabled.
        SLOW_DOWN = 1;
        /// Quick-stop ramp, then Switch on disabled.
        QUICK_STOP = 2;
        /// Current limit, then Switch on disabled.
        CURRENT_LIMIT = 3;
        /// Voltage limit, then Switch on disabled.
        VOLTAGE_LIMIT = 4;
        /// Slow-down ramp, stay in Quick stop active.
        SLOW_DOWN_AND_STAY = 5;
        /// Quick-stop ramp, stay in Quick stop active.
        QUICK_STOP_AND_STAY = 6;
        /// Current limit, stay in Quick stop active.
        CURRENT_LIMIT_AND_STAY = 7;
        /// Voltage limit, stay in Quick stop active.
        VOLTAGE_LIMIT_AND_STAY = 8;
    }
}

option_code! {
    /// 605Bh: what "shutdown" does in Operation enabled.
    ShutdownOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then off.
        SLOW_DOWN = 1;
    }
}

option_code! {
    /// 605Ch: what "disable operation" does.
    DisableOperationOption {
        /// Drive function off at once.
        DISABLE = 0;
        /// Slow-down ramp, then off.
        SLOW_DOWN = 1;
    }
}

option_code! {
    /// 605Dh: what the halt bit does; the drive stays in Operation enabled.
    HaltOption {
        /// Slow-down ramp.
        SLOW_DOWN = 1;
        /// Quick-stop ramp.
        QUICK_STOP = 2;
        /// Current limit.
        CURRENT_LIMIT = 3;
        /// Voltage limit.
        VOLTAGE_LIMIT = 4;
    }
}

option_code! {
    /// 605Eh: how the motor is stopped in Fault reaction active.
    FaultReactionOption {
        /// Drive function off at once; the motor is free to turn.
        DISABLE = 0;
        /// Slow-down ramp.
        SLOW_DOWN = 1;
        /// Quick-stop ramp.
        QUICK_STOP = 2;
        /// Current limit.
        CURRENT_LIMIT = 3;
        /// Voltage limit.
        VOLTAGE_LIMIT = 4;
    }
}

option_code! {
    /// 6007h: what the loss of the connection (heartbeat, bus-off, life guarding) does.
    AbortConnectionOption {
        /// Nothing.
        NONE = 0;
        /// A fault.
        FAULT = 1;
        /// "Disable voltage".
        DISABLE_VOLTAGE = 2;
        /// "Quick stop".
        QUICK_STOP = 3;
    }
}

/// How the shaft is brought to rest, as all option codes name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StopRamp {
    /// Drive function off: the shaft is free.
    Free,
    /// At the deceleration of the mode (6084h).
    SlowDown,
    /// At the quick-stop deceleration (6085h).
    QuickStop,
    /// As fast as the current limit allows.
    CurrentLimit,
    /// As fast as the voltage limit allows.
    VoltageLimit,
}

impl StopRamp {
    /// By the number that 605Ah (1 to 4), 605Bh, 605Ch, 605Dh and 605Eh share; `None` for reserved values.
    const fn of(code: i16) -> Option<Self> {
        Some(match code {
            0 => Self::Free,
            1 => Self::SlowDown,
            2 => Self::QuickStop,
            3 => Self::CurrentLimit,
            4 => Self::VoltageLimit,
            _ => return None,
        })
    }
}

impl QuickStopOption {
    /// How the motor stops; `None` for values that the standard reserves or leaves to manufacturers.
    pub const fn ramp(self) -> Option<StopRamp> {
        if self.stays() { StopRamp::of(self.0 - 4) } else { StopRamp::of(self.0) }
    }

    /// The drive stays in Quick stop active until it is commanded to leave.
    pub const fn stays(self) -> bool {
        matches!(self.0, 5..=8)
    }
}

impl ShutdownOption {
    /// How the motor stops; `None` for values that the standard reserves or leaves to manufacturers.
    pub const fn ramp(self) -> Option<StopRamp> {
        if matches!(self.0, 0..=1) { StopRamp::of(self.0) } else { None }
    }
}

impl DisableOperationOption {
    /// How the motor stops; `None` for values that the standard reserves or leaves to manufacturers.
    pub const fn ramp(self) -> Option<StopRamp> {
        if matches!(self.0, 0..=1) { StopRamp::of(self.0) } else { None }
    }
}

impl HaltOption {
    /// How the motor stops; `None` for values that the standard reserves (0 among them) or leaves to manufacturers.
    pub const fn ramp(self) -> Option<StopRamp> {
        if self.0 == 0 { None } else { StopRamp::of(self.0) }
    }
}

impl FaultReactionOption {
    /// How the motor stops; `None` for values that the standard reserves or leaves to manufacturers.
    pub const fn ramp(self) -> Option<StopRamp> {
        StopRamp::of(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_code_has_the_ramp_of_its_table() {
        use StopRamp::{CurrentLimit, Free, QuickStop, SlowDown, VoltageLimit};
        let quick_stop =
            [Free, SlowDown, QuickStop, CurrentLimit, VoltageLimit, SlowDown, QuickStop, CurrentLimit, VoltageLimit];
        for (code, ramp) in (0..).zip(quick_stop) {
            assert_eq!(QuickStopOption(code).ramp(), Some(ramp), "605Ah = {code}");
            assert_eq!(QuickStopOption(code).stays(), code >= 5, "605Ah = {code}");
        }
        for (code, ramp) in (0..).zip([Free, SlowDown, QuickStop, CurrentLimit, VoltageLimit]) {
            assert_eq!(FaultReactionOption(code).ramp(), Some(ramp), "605Eh = {code}");
            assert_eq!(HaltOption(code).ramp(), (code > 0).then_some(ramp), "605Dh = {code}");
            assert_eq!(ShutdownOption(code).ramp(), (code < 2).then_some(ramp), "605Bh = {code}");
            assert_eq!(DisableOperationOption(code).ramp(), (code < 2).then_some(ramp), "605Ch = {code}");
        }
    }

    #[test]
    fn reserved_and_makers_codes_have_no_ramp() {
        for code in [i16::MIN, -1, 9, i16::MAX] {
            assert_eq!(QuickStopOption(code).ramp(), None, "{code}");
            assert_eq!(FaultReactionOption(code).ramp(), None, "{code}");
            assert_eq!(HaltOption(code).ramp(), None, "{code}");
        }
    }
}
