//! Three Hall sensors, 120 electrical degrees apart.
//!
//! Sensor U (bit 0) is high over the half turn that begins at the offset, V (bit 1) a third of an electrical turn
//! later, W (bit 2) two thirds. Turning forward the state therefore runs 5, 1, 3, 2, 6, 4, each for 60 degrees;
//! 0 and 7 never occur in a sound motor.

/// State in each sixth of an electrical turn, forward from the offset.
pub const FORWARD_SEQUENCE: [u8; 6] = [5, 1, 3, 2, 6, 4];

/// What never changes about the sensors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HallModel {
    /// Electrical angle, in turns, at which the state changes from 4 to 5.
    pub offset_turns: f64,
}

/// What may be wrong with the sensors.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum HallFault {
    /// Nothing.
    #[default]
    None,
    /// Unplugged: the pull-ups make all three high, state 7.
    Disconnected,
    /// Lines shorted to ground: state 0.
    ShortedToGround,
    /// One sensor's line is stuck low.
    StuckLow(u8),
}

impl HallModel {
    /// The state read at an electrical angle in turns.
    #[inline]
    pub fn state(&self, electrical_turns: f64, fault: HallFault) -> u8 {
        let sixths = (electrical_turns - self.offset_turns) * 6.0;
        let truncated = sixths as i32;
        let sixth = if f64::from(truncated) > sixths { truncated - 1 } else { truncated };
        let state = FORWARD_SEQUENCE[sixth.rem_euclid(6) as usize];
        match fault {
            HallFault::None => state,
            HallFault::Disconnected => 7,
            HallFault::ShortedToGround => 0,
            HallFault::StuckLow(sensor) => state & !(1_u8.wrapping_shl(u32::from(sensor))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::floor;

    #[test]
    fn the_states_run_in_sequence_and_one_sensor_changes_at_a_time() {
        let hall = HallModel::default();
        let mut last = hall.state(-0.01, HallFault::None);
        assert_eq!(last, 4);
        for (sixth, expected) in FORWARD_SEQUENCE.iter().enumerate() {
            let state = hall.state((sixth as f64 + 0.5) / 6.0 + 7.0, HallFault::None);
            assert_eq!(state, *expected);
            assert_eq!((state ^ last).count_ones(), 1);
            last = state;
        }
    }

    #[test]
    fn each_sensor_is_high_for_half_an_electrical_turn_a_third_after_the_one_before() {
        let hall = HallModel { offset_turns: 0.1 };
        for step in 0..3600 {
            let turns = (f64::from(step) + 0.5) / 3600.0;
            let state = hall.state(turns, HallFault::None);
            for sensor in 0..3 {
                let phase = turns - 0.1 - f64::from(sensor) / 3.0;
                let high = phase - floor(phase) < 0.5;
                assert_eq!(state >> sensor & 1 == 1, high, "sensor {sensor} at {turns}");
            }
        }
    }

    #[test]
    fn faults_give_the_states_a_drive_must_refuse() {
        let hall = HallModel::default();
        assert_eq!(hall.state(0.3, HallFault::Disconnected), 7);
        assert_eq!(hall.state(0.3, HallFault::ShortedToGround), 0);
        assert_eq!(hall.state(0.25, HallFault::StuckLow(0)), 0);
    }
}
