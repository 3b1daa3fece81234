//! What stops a motor, and how.

use cia402::{HaltOption, QuickStopOption, StopRamp};

/// What may stop the motor while the axis is live; the first that applies decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCause {
    /// Fault reaction active.
    Fault,
    /// Quick stop active.
    QuickStop,
    /// A digital input.
    External,
    /// Shutdown or disable operation with a ramp.
    RampDown,
    /// The host is silent.
    HostTimeout,
    /// A limit switch at the end that the shaft moves to.
    Limit,
    /// Bit 8 of the controlword.
    Halt,
}

/// How an external stop ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExternalStop {
    /// Held where it came to rest.
    Hold,
    /// Still enabled, with the power stage off while the stop lasts.
    LetGo,
    /// In Switch on disabled: an emergency stop at once, a ramp at its end.
    Disable,
}

impl ExternalStop {
    /// How fast: as 605Ah says, but that an emergency stop of a motor that is to be free in the end leaves it to itself, and
    /// one that is to be held has to stop first.
    pub(super) fn ramp(self, option: QuickStopOption, emergency: StopRamp) -> StopRamp {
        match (self, emergency) {
            (Self::Hold, StopRamp::Free) => of_quick_stop(option, StopRamp::CurrentLimit),
            (Self::Hold, _) => of_quick_stop(option, emergency),
            (Self::LetGo | Self::Disable, _) => of_quick_stop(option, StopRamp::Free),
        }
    }
}

/// The ramp of 605Ah; `emergency` is what the drive does where CiA 402 has the current or the voltage limit.
pub(super) fn of_quick_stop(option: QuickStopOption, emergency: StopRamp) -> StopRamp {
    or_emergency(option.ramp(), emergency)
}

/// The ramp of 605Dh; `emergency` as for [`of_quick_stop`].
pub(super) fn of_halt(option: HaltOption, emergency: StopRamp) -> StopRamp {
    or_emergency(option.ramp(), emergency)
}

/// Values that the standard leaves to makers stop as hard as the drive can.
pub(super) fn or_emergency(ramp: Option<StopRamp>, emergency: StopRamp) -> StopRamp {
    match ramp {
        Some(ramp @ (StopRamp::Free | StopRamp::SlowDown | StopRamp::QuickStop)) => ramp,
        // A drive that stops on its current limit can keep to a voltage meanwhile.
        Some(StopRamp::VoltageLimit) if emergency == StopRamp::CurrentLimit => StopRamp::VoltageLimit,
        Some(StopRamp::CurrentLimit | StopRamp::VoltageLimit) | None => emergency,
    }
}
