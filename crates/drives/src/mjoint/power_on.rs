//! What the joint does by itself after power-on: 2619h ("M Robot Joint Motor CanOpen Manual", 5.04, "Mode selection",
//! and "Instructions for multi-turn absolute value").

use super::assumptions::COUNTS_PER_TURN;

/// The function that 2619h selects; it acts from the next power-on on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Function {
    /// 0: pulse and direction.
    #[default]
    PulseAndDirection,
    /// 2: PU and DIR are the channels of an encoder that is followed.
    EncoderFollowing,
    /// 1 and 3: the duty cycle on PU is a speed. Its number is lost in the manual; these stand beside 2, where it is
    /// described.
    DutyCycleSpeed,
    /// 6: back to the origin of the turns.
    ReturnToOrigin,
    /// 7: as 0, with a brake that keeps the turns in place of a battery.
    Brake,
    /// 8: as 7, and back to the origin.
    BrakeAndReturn,
    /// 9: communication control, pulses are ignored.
    CommunicationControl,
    /// 30 to 32768: to an angle within the turn, X · 360° / 32768.
    TurnToAngle(u16),
}

impl Function {
    /// From 2619h; `None` for a value without a meaning.
    pub const fn from_raw(raw: u16) -> Option<Self> {
        Some(match raw {
            0 => Self::PulseAndDirection,
            1 | 3 => Self::DutyCycleSpeed,
            2 => Self::EncoderFollowing,
            6 => Self::ReturnToOrigin,
            7 => Self::Brake,
            8 => Self::BrakeAndReturn,
            9 => Self::CommunicationControl,
            30..=32768 => Self::TurnToAngle(raw),
            _ => return None,
        })
    }

    /// Pulses are positions: pulse and direction, or an encoder.
    pub const fn takes_pulses(self) -> bool {
        matches!(self, Self::PulseAndDirection | Self::EncoderFollowing)
    }

    /// The drive moves a holding brake.
    pub const fn has_brake(self) -> bool {
        matches!(self, Self::Brake | Self::BrakeAndReturn)
    }

    /// Where to go by itself from `position` after power-on. An angle is looked for in the turn that the shaft is in.
    pub fn target(self, position: i32) -> Option<i32> {
        match self {
            Self::ReturnToOrigin | Self::BrakeAndReturn => Some(0),
            Self::TurnToAngle(angle) => {
                let within = position.rem_euclid(COUNTS_PER_TURN as i32);
                Some(position.wrapping_sub(within).wrapping_add(i32::from(angle)))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_without_a_meaning_are_refused() {
        for raw in [4, 5, 10, 29, 32769, u16::MAX] {
            assert_eq!(Function::from_raw(raw), None, "{raw}");
        }
        assert_eq!(Function::from_raw(30), Some(Function::TurnToAngle(30)));
        assert_eq!(Function::from_raw(32768), Some(Function::TurnToAngle(32768)));
    }

    #[test]
    fn an_angle_is_looked_for_in_the_present_turn() {
        let quarter = Function::TurnToAngle(8192);
        for (position, target) in [(0, 8192), (32767, 8192), (32768, 40960), (-1, -24576), (-32769, -57344)] {
            assert_eq!(quarter.target(position), Some(target), "{position}");
        }
        assert_eq!(Function::ReturnToOrigin.target(-99_999), Some(0));
        assert_eq!(Function::CommunicationControl.target(5), None);
    }
}
