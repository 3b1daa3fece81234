//! What stops a motor, and how fast.

use cia402::{HaltOption, QuickStopOption};

/// What may stop the motor while the axis is enabled; the first that applies decides on the ramp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopCause {
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

/// How fast to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopRamp {
    /// With the deceleration of the profiles.
    SlowDown,
    /// With the quick stop's deceleration.
    QuickStop,
    /// As fast as the current limit allows.
    CurrentLimit,
    /// The power stage is off, and the motor coasts.
    Coast,
}

/// A stop under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stop {
    pub(super) cause: StopCause,
    pub(super) ramp: StopRamp,
    /// How long the ramp has been over, s.
    pub(super) over_for_s: f64,
    /// The shaft is held where it came to rest.
    pub(super) held: bool,
    /// The power stage is off.
    pub(super) free: bool,
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
            (Self::Hold, StopRamp::Coast) => StopRamp::of_quick_stop(option, StopRamp::CurrentLimit),
            (Self::Hold, _) => StopRamp::of_quick_stop(option, emergency),
            (Self::LetGo | Self::Disable, _) => StopRamp::of_quick_stop(option, StopRamp::Coast),
        }
    }
}

impl Stop {
    /// The motor is to be free: it coasts, or it was held and is let go.
    pub(super) fn is_released(&self, end: ExternalStop) -> bool {
        let let_go = self.held && self.cause == StopCause::External && end == ExternalStop::LetGo;
        self.ramp == StopRamp::Coast || let_go
    }

    /// The axis is to be disabled now.
    pub(super) fn disables(&self, end: ExternalStop) -> bool {
        let over = self.held || self.ramp == StopRamp::Coast;
        self.cause == StopCause::External && end == ExternalStop::Disable && over
    }
}

impl StopRamp {
    /// The ramp of 605Ah; `emergency` is what the drive does where CiA 402 has the current limit.
    pub const fn of_quick_stop(option: QuickStopOption, emergency: Self) -> Self {
        match option {
            QuickStopOption::SLOW_DOWN | QuickStopOption::SLOW_DOWN_AND_STAY => Self::SlowDown,
            QuickStopOption::QUICK_STOP | QuickStopOption::QUICK_STOP_AND_STAY => Self::QuickStop,
            _ => emergency,
        }
    }

    /// The ramp of 605Dh; `emergency` as for [`of_quick_stop`](Self::of_quick_stop).
    pub const fn of_halt(option: HaltOption, emergency: Self) -> Self {
        match option {
            HaltOption::SLOW_DOWN => Self::SlowDown,
            HaltOption::QUICK_STOP => Self::QuickStop,
            _ => emergency,
        }
    }
}
