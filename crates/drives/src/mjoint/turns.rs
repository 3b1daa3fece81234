//! The turns of a joint with a brake and without a battery ("M Robot Joint Motor CanOpen Manual", 5.04, "Mode selection",
//! 7 and 8: "brake multi-turn absolute value function").
//!
//! The position is recorded at power-off ("could record the position when power off"). The brake holds the shaft until
//! the next power-on; the encoder then knows the place within the turn, and the record the turn.

use super::assumptions::COUNTS_PER_TURN;

const TURN: i32 = COUNTS_PER_TURN as i32;

/// What the encoder's own counter of turns is corrected by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Turns {
    recorded: Option<i32>,
    /// Counts from the encoder's reading to the position: whole turns.
    correction: Option<i32>,
}

impl Turns {
    /// At power-on, with the position at the last power-off if the joint has a brake.
    pub(super) const fn new(recorded: Option<i32>) -> Self {
        Self { recorded, correction: None }
    }

    /// The position, from the encoder's reading: `lost` while it knows the place within the turn only. Of all turns it
    /// is the one that is nearest to the record.
    pub(super) fn position(&mut self, encoder_counts: i32, lost: bool) -> i32 {
        if !lost {
            *self = Self::default();
            return encoder_counts;
        }
        if let Some(recorded) = self.recorded.take() {
            let away = recorded.wrapping_sub(encoder_counts).wrapping_add(TURN / 2);
            self.correction = Some(away.div_euclid(TURN).wrapping_mul(TURN));
        }
        encoder_counts.wrapping_add(self.correction.unwrap_or(0))
    }

    /// The turns are known, by the encoder or by the record.
    pub(super) const fn are_known(&self, lost: bool) -> bool {
        !lost || self.correction.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_turns_are_those_of_the_record_and_the_place_in_the_turn_is_the_encoders() {
        for (recorded, encoder, position) in [
            (7 * TURN + 5000, 5003, 7 * TURN + 5003),
            (-3 * TURN + 100, TURN - 50, -3 * TURN - 50),
            (5 * TURN - 2, 3, 5 * TURN + 3),
            (200, 190, 190),
        ] {
            let mut turns = Turns::new(Some(recorded));
            assert_eq!(turns.position(encoder, true), position);
            assert!(turns.are_known(true));
            assert_eq!(turns.position(encoder + 10 * TURN, true), position + 10 * TURN, "and goes on from there");
        }
    }

    #[test]
    fn an_encoder_that_knows_its_turns_is_believed_and_without_a_record_they_stay_lost() {
        let mut turns = Turns::new(Some(7 * TURN));
        assert_eq!(turns.position(99, false), 99);
        assert!(!turns.are_known(true), "a battery that is lost later is another matter");
        let mut turns = Turns::new(None);
        assert_eq!(turns.position(99, true), 99);
        assert!(!turns.are_known(true) && turns.are_known(false));
    }
}
