//! The statusword of each mode. Source: CiA 402-2, 8.4.2, and the clause on the statusword of each mode.

use cia402::{ModeOfOperation, PowerState, Statusword};

/// What bits 7 and 10 to 13 show, whatever the mode calls it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Facts {
    /// The supply of the power stage is there.
    pub(super) voltage: bool,
    /// The mode's target is reached; under halt: the motor stands.
    pub(super) target_reached: bool,
    /// A limit holds the set-point back.
    pub(super) limited: bool,
    /// Set-point acknowledge.
    pub(super) acknowledged: bool,
    /// The motor stands, by 606Fh and 6070h.
    pub(super) standing: bool,
    /// The following error is outside its window, by 6065h and 6066h.
    pub(super) following_error: bool,
    /// Homing attained.
    pub(super) homing_attained: bool,
    /// Homing failed.
    pub(super) homing_error: bool,
    /// Set-points are followed: interpolation is active, or the cyclic command value is.
    pub(super) follows: bool,
}

/// The statusword in a state and mode.
pub(super) fn statusword(state: PowerState, mode: ModeOfOperation, facts: &Facts) -> Statusword {
    let bit = |on: bool, mask: u16| if on { mask } else { 0 };
    let common = state.statusword_bits()
        | bit(facts.voltage, Statusword::VOLTAGE_ENABLED)
        | bit(facts.limited, Statusword::INTERNAL_LIMIT_ACTIVE)
        | bit(facts.target_reached, Statusword::TARGET_REACHED)
        | Statusword::REMOTE;
    let (bit_12, bit_13) = match mode {
        ModeOfOperation::PROFILE_POSITION => (facts.acknowledged, facts.following_error),
        ModeOfOperation::PROFILE_VELOCITY => (facts.standing, false),
        ModeOfOperation::HOMING => (facts.homing_attained, facts.homing_error),
        ModeOfOperation::INTERPOLATED_POSITION => (facts.follows, facts.following_error),
        ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => (facts.follows, facts.following_error),
        ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY
        | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE
        | ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE => (facts.follows, false),
        _ => (false, false),
    };
    Statusword(common | bit(bit_12, 1 << 12) | bit(bit_13, 1 << 13))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENABLED: PowerState = PowerState::OperationEnabled;

    #[test]
    fn the_states_have_the_standards_bits_whatever_the_mode() {
        let facts = Facts { voltage: true, ..Facts::default() };
        for state in PowerState::ALL {
            for mode in (0..=11).map(ModeOfOperation) {
                assert_eq!(statusword(state, mode, &facts).state(), Some(state), "{state:?} {mode}");
            }
        }
    }

    #[test]
    fn bits_12_and_13_mean_what_the_mode_says() {
        // CiA 402-2: bit 12 and bit 13 by mode.
        let acknowledged = Facts { acknowledged: true, ..Facts::default() };
        let standing = Facts { standing: true, ..Facts::default() };
        let follows = Facts { follows: true, ..Facts::default() };
        let attained = Facts { homing_attained: true, ..Facts::default() };
        let lost = Facts { following_error: true, homing_error: true, ..Facts::default() };
        let bits = |mode, facts: &Facts| statusword(ENABLED, ModeOfOperation(mode), facts).0 >> 12 & 3;
        assert_eq!([1, 3, 6, 7, 8].map(|mode| bits(mode, &acknowledged)), [1, 0, 0, 0, 0]);
        assert_eq!([1, 3, 6, 7, 8].map(|mode| bits(mode, &standing)), [0, 1, 0, 0, 0]);
        assert_eq!([1, 2, 3, 6, 7, 8, 9, 10, 11].map(|mode| bits(mode, &follows)), [0, 0, 0, 0, 1, 1, 1, 1, 1]);
        assert_eq!([1, 3, 6, 7, 8].map(|mode| bits(mode, &attained)), [0, 0, 1, 0, 0]);
        assert_eq!([1, 3, 4, 6, 7, 8, 9, 10].map(|mode| bits(mode, &lost)), [2, 0, 0, 2, 2, 2, 0, 0]);
    }
}
