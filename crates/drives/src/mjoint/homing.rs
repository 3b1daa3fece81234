//! Homing, mode 6, methods 17 to 22 ("M Robot Joint Motor CanOpen Manual", 5.09; CiA 402-2, clause 11), with switches on
//! PU and DIR.
//!
//! The manual has pictures of 17, 18, 19 and 21; 20 and 22 are as CiA 402 pairs them. One speed serves all moves, so the
//! first edge that is crossed in the right direction counts. A switch that never comes is looked for up to the mechanical
//! stop, where an alarm ends homing.

use cia402::{HomingMethod, HomingSequence, HomingSwitch};

use crate::engine::axis::Switches;

/// What 6098h asks for.
pub(super) fn sequence(method: i8) -> Option<HomingSequence> {
    HomingMethod(method).sequence()
}

/// What the levels of PU and DIR are to a method: its own switch and no other. PU is the positive limit; DIR is the negative
/// one, or the origin.
pub(super) fn switches(sequence: Option<HomingSequence>, pu: bool, dir: bool) -> Switches {
    let none = Switches::default();
    match sequence.and_then(|sequence| sequence.switch).map(|row| row.switch) {
        Some(HomingSwitch::PositiveLimit) => Switches { positive_limit: pu, ..none },
        Some(HomingSwitch::NegativeLimit) => Switches { negative_limit: dir, ..none },
        Some(HomingSwitch::Home) => Switches { home: dir, ..none },
        None => none,
    }
}
