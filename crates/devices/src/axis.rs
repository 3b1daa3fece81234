use core::time::Duration;

use canopen::Mux;
use cia402::{HomingMethod, HomingRow, HomingSequence, ModeOfOperation, PowerState, Statusword};

use crate::loops::{Loops, OpenLoop};
use crate::placement::Placement;
use crate::terminals::Terminals;
use crate::units::{Quantity, Units};

/// One axis of a drive: where its objects are, and what they mean.
///
/// All objects named here are where this axis has them. Where it has an object of the standard that is not named here:
/// [`object`](Self::object).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisDescription {
    /// Where its objects are.
    pub placement: Placement,
    /// Modes that 6060h accepts.
    pub modes: &'static [ModeOfOperation],
    /// Where the present mode is shown: 6061h, or 6060h where there is no such object.
    pub mode_display: Mux,
    /// How it is enabled, and how it shows that.
    pub power: PowerStyle,
    /// How it takes a set-point in profile position.
    pub new_set_point: NewSetPoint,
    /// Bits of the statusword that mean something of this model's own, in words.
    pub statusword_bits: &'static [(u16, &'static str)],
    /// How long it takes from one point of an interpolated position to the next, where that does not follow a period that is
    /// set (60C2h).
    pub interpolation: Option<Duration>,
    /// How it finds its reference position, where it does.
    pub homing: Option<HomingRules>,
    /// Its inputs and its brake, as a drive of one axis has them: [`object`](Self::object) says where this axis has them.
    pub terminals: Terminals,
    /// What raw values are worth.
    pub units: Units,
    /// Highest speed of its motor in r/min, to which the drive holds faster set-points, where the manual says it and no object
    /// (6080h) does.
    pub max_motor_rpm: Option<f64>,
    /// How its loops are set, where it has gains.
    pub loops: Option<Loops>,
    /// What keeps its rotor in step, where nothing measures it.
    pub open_loop: Option<OpenLoop>,
}

impl AxisDescription {
    /// Where this axis has an object of the standard.
    pub const fn object(&self, mux: Mux) -> Mux {
        self.placement.place(mux)
    }

    /// The mode in which it turns at a speed until commanded otherwise: profile velocity, or velocity mode (vl) where it has neither
    /// that nor cyclic velocities, as many frequency inverters do.
    pub fn velocity_mode(&self) -> ModeOfOperation {
        let has = |mode| self.modes.contains(&mode);
        let others = has(ModeOfOperation::PROFILE_VELOCITY) || has(ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY);
        if has(ModeOfOperation::VELOCITY) && !others {
            ModeOfOperation::VELOCITY
        } else {
            ModeOfOperation::PROFILE_VELOCITY
        }
    }

    /// The power state that a statusword shows, or for a drive without the state machine the one that comes closest.
    pub const fn power_state(&self, statusword: Statusword) -> Option<PowerState> {
        self.power.state(statusword)
    }

    /// The same of an axis whose objects are elsewhere: for a device with several axes of one kind. `self` is the first.
    #[must_use]
    pub const fn placed(self, placement: Placement) -> Self {
        Self {
            placement,
            mode_display: placement.place(self.mode_display),
            homing: match self.homing {
                Some(rules) => Some(rules.placed(placement)),
                None => None,
            },
            units: self.units.placed(placement),
            ..self
        }
    }
}

/// How a drive is enabled, and how its statusword shows that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PowerStyle {
    /// The power state machine of CiA 402-2, 8.2.
    Cia402,
    /// No states: the statusword echoes the controlword. One write of 0Fh enables, 0 disables.
    EchoesControlword {
        /// Bits of the statusword that are set while the drive follows its host.
        following: u16,
        /// Bit that is set while the power stage drives the motor.
        live: u16,
        /// Bit that is set while there is an alarm.
        alarm: u16,
    },
}

impl PowerStyle {
    /// True if the statusword shows a fault, or of an alarm, which need not have stopped the drive.
    pub const fn is_faulted(self, statusword: Statusword) -> bool {
        match self {
            Self::Cia402 => matches!(statusword.state(), Some(PowerState::Fault)),
            Self::EchoesControlword { alarm, .. } => statusword.has(alarm),
        }
    }

    /// True if the statusword shows that the power stage is on (CiA 402-2, figure 5).
    pub const fn is_live(self, statusword: Statusword) -> bool {
        use PowerState::{FaultReactionActive, OperationEnabled, QuickStopActive};
        match self {
            Self::Cia402 => {
                matches!(statusword.state(), Some(OperationEnabled | QuickStopActive | FaultReactionActive))
            }
            Self::EchoesControlword { live, .. } => statusword.has(live),
        }
    }

    /// The power state that a statusword shows, or the one of CiA 402 that comes closest: an alarm is a fault only when
    /// it has taken the power off the motor, and a live motor that does not follow a host is switched on.
    pub const fn state(self, statusword: Statusword) -> Option<PowerState> {
        match self {
            Self::Cia402 => statusword.state(),
            Self::EchoesControlword { following, live, alarm } => {
                Some(match (statusword.has(following | live), statusword.has(live), statusword.has(alarm)) {
                    (true, ..) => PowerState::OperationEnabled,
                    (false, true, _) => PowerState::SwitchedOn,
                    (false, false, true) => PowerState::Fault,
                    (false, false, false) => PowerState::SwitchOnDisabled,
                })
            }
        }
    }
}

/// How a drive takes a new set-point in profile position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewSetPoint {
    /// With the rising edge of controlword bit 4, acknowledged by statusword bit 12 (CiA 402-2, 10.1).
    Handshake,
    /// With each write of a 1 to controlword bit 4, which clears itself. Nothing is acknowledged.
    ClearsItself,
}

/// How a drive finds its reference position (mode 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HomingRules {
    /// Where the method is.
    pub method: Mux,
    /// Speed of the search in r/min, where it has an object of its own.
    pub search_speed: Option<Quantity>,
    /// What starts it.
    pub start: HomingStart,
    /// How the statusword shows that it was found.
    pub attained: BitPattern,
    /// How the statusword shows that it was not.
    pub failed: BitPattern,
    /// What its methods do, where they are not those of CiA 402-2, clause 11; empty where they are.
    pub own_methods: &'static [HomingRow],
    /// The inputs that it takes for switches while it looks, as a drive of one axis has them.
    pub switches: Terminals,
    /// What to know of the methods, in a sentence; empty if nothing.
    pub remark: &'static str,
}

impl HomingRules {
    /// What a method does on this drive; `None` for a number that neither it nor the standard defines.
    pub fn sequence(&self, method: HomingMethod) -> Option<HomingSequence> {
        if self.own_methods.is_empty() {
            return method.sequence();
        }
        let row = self.own_methods.iter().find(|row| row.method == method)?;
        Some(HomingSequence { switch: Some(row), index: None })
    }

    const fn placed(self, placement: Placement) -> Self {
        Self {
            method: placement.place(self.method),
            search_speed: match self.search_speed {
                Some(speed) => Some(speed.placed(placement)),
                None => None,
            },
            ..self
        }
    }
}

/// What starts homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomingStart {
    /// A rising edge of controlword bit 4 in mode 6.
    ControlwordBit4,
    /// The write of mode 6, each time.
    ModeWrite,
}

/// Some bits of a word, and how they have to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitPattern {
    /// Bits that matter.
    pub mask: u16,
    /// Their values.
    pub value: u16,
}

impl BitPattern {
    /// True if the bits that matter are so.
    pub const fn matches(self, statusword: Statusword) -> bool {
        statusword.0 & self.mask == self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zltech::ZLIM42C;

    #[test]
    fn an_axis_that_is_placed_has_all_its_own_objects_there() {
        let first = ZLIM42C.axes[0];
        let second = first.placed(Placement::IndexOffset(0x800));
        assert_eq!(second.mode_display, Mux::new(0x6861, 0));
        assert_eq!(second.homing.map(|rules| rules.method), Some(Mux::new(0x6898, 0)));
        assert_eq!(second.units.target_velocity.map(|quantity| quantity.object), Some(Mux::new(0x68FF, 0)));
        assert_eq!(second.units.bus_voltage, first.units.bus_voltage);
        assert_eq!(second.placed(Placement::FIRST).placement, Placement::FIRST);
    }
}
