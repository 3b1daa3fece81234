//! The statusword ("M Robot Joint Motor CanOpen Manual", 5.04): no CiA 402 state, but a mirror of the controlword.
//!
//! The manual names the bits after CiA 402, yet 0404h, 0014h, 1414h, 0037h and 0437h of its examples fit no state of
//! it. This rule gives all five.

pub use devices::mjoint::statusword::*;

use cia402::{Controlword, Statusword};

/// What the statusword is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatusCondition {
    /// 6040h as the drive holds it.
    pub controlword: Controlword,
    /// 2601h.
    pub output_enabled: bool,
    /// 260Eh is not 0.
    pub alarm: bool,
    /// The power stage drives the motor.
    pub live: bool,
    /// Nothing is left to be done.
    pub reached: bool,
    /// Mode 6, and the origin is found.
    pub homing_attained: bool,
    /// Mode 6, and homing ended without an origin.
    pub homing_error: bool,
}

/// The value of 6041h.
pub fn statusword(condition: &StatusCondition) -> Statusword {
    let bit = |mask: u16, set: bool| if set { mask } else { 0 };
    let controlword = condition.controlword;
    Statusword(
        bit(0b11, controlword.has(Controlword::SWITCH_ON))
            | bit(1 << 2, condition.output_enabled)
            | bit(Statusword::FAULT, condition.alarm)
            | bit(LIVE, condition.live)
            | bit(1 << 5, controlword.has(Controlword::QUICK_STOP))
            | bit(Statusword::TARGET_REACHED, condition.reached)
            | bit(HOMING_ATTAINED, condition.homing_attained)
            | bit(HOMING_ERROR, condition.homing_error),
    )
}
