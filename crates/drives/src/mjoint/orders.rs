//! What the joint is to do: the host's controlword and mode, and what it does by itself.

use cia402::{Controlword, ModeOfOperation};

/// Bits 1 to 3 of the controlword, without which nothing moves.
const MAY_MOVE: u16 = Controlword::ENABLE_VOLTAGE | Controlword::QUICK_STOP | Controlword::ENABLE_OPERATION;

/// By the host, and by itself.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Orders {
    /// 6040h as the drive holds it.
    pub(super) controlword: Controlword,
    /// 6060h as it is in effect.
    pub(super) mode: ModeOfOperation,
    pub(super) own_motion: OwnMotion,
    /// A target of mode 7 that waits for the free-running time base.
    pub(super) next_point: Option<i32>,
    /// 2601h as it was written last.
    output_enabled: bool,
}

/// What the joint does without a command over CAN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OwnMotion {
    /// Nothing: it waits for a first pulse, or for a host.
    None,
    /// It has to find out where it is, and may then go somewhere (2619h).
    Starting,
    /// It goes where 2619h says.
    Returning,
    /// It follows pulses, and holds between them.
    Following,
}

impl Orders {
    /// None of a host yet.
    pub(super) const fn new(own_motion: OwnMotion) -> Self {
        let mode = ModeOfOperation::PROFILE_POSITION;
        Self { controlword: Controlword(0), mode, own_motion, next_point: None, output_enabled: true }
    }

    /// It does nothing by itself.
    pub(super) fn are_the_hosts(&self) -> bool {
        self.own_motion == OwnMotion::None
    }

    /// The host halts it (bit 8).
    pub(super) fn are_halted(&self) -> bool {
        self.controlword.has(Controlword::HALT) && self.are_the_hosts()
    }

    /// The bits of the controlword allow it to move.
    pub(super) const fn allow_motion(&self) -> bool {
        self.controlword.has(MAY_MOVE)
    }

    /// The host wants the power stage (bit 1), or the joint's own motion does.
    pub(super) const fn want_power(&self) -> bool {
        self.controlword.has(Controlword::ENABLE_VOLTAGE)
            || matches!(self.own_motion, OwnMotion::Returning | OwnMotion::Following)
    }

    /// True if it did something by itself.
    pub(super) fn end_own_motion(&mut self) -> bool {
        core::mem::replace(&mut self.own_motion, OwnMotion::None) != OwnMotion::None
    }

    /// 2601h. True if that is a 1 after a 0.
    pub(super) fn enable_output(&mut self, enabled: bool) -> bool {
        !core::mem::replace(&mut self.output_enabled, enabled) && enabled
    }
}
