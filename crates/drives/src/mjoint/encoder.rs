//! Where the shaft is: the encoder's angle followed over its turns.

use super::assumptions::COUNTS_PER_TURN;
use super::hardware::Sensors;
use super::turns::Turns;

/// Counts of the shaft, and what its turns are known by.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Encoder {
    /// It has been looked at since the start.
    awake: bool,
    angle_count: u16,
    /// Counts of the shaft, wrapping.
    shaft_count: u16,
    turns: Turns,
    position: i32,
    /// The position at the last power-off, until the joint has looked where it is now.
    record: Option<i32>,
}

impl Encoder {
    /// At power-on, with the position at the last power-off, where one was kept.
    pub(super) fn power_on(&mut self, record: Option<i32>, has_brake: bool) {
        (self.turns, self.record) = (Turns::new(record.filter(|_| has_brake)), record);
    }

    /// As the firmware starts over: the turns stay known, and the record is gone from here.
    pub(super) fn restarted(&mut self) -> Self {
        Self { turns: self.turns, record: self.record.take(), ..Self::default() }
    }

    pub(super) const fn is_awake(&self) -> bool {
        self.awake
    }

    /// Counts from the origin, turns included.
    pub(super) const fn position(&self) -> i32 {
        self.position
    }

    /// Counts of the shaft, wrapping.
    pub(super) const fn shaft_count(&self) -> u16 {
        self.shaft_count
    }

    /// The position at the last power-off, once.
    pub(super) fn take_record(&mut self) -> Option<i32> {
        self.record.take()
    }

    pub(super) const fn are_turns_known(&self, sensors: &Sensors) -> bool {
        self.turns.are_known(sensors.turns_lost)
    }

    /// The first look since the start.
    pub(super) fn wake(&mut self, sensors: &Sensors) {
        self.awake = true;
        self.angle_count = angle(sensors);
        self.position = self.turns.position(sensors.position_counts, sensors.turns_lost);
    }

    /// Every control period. What the counts of turns moved by and the shaft did not is a new origin: by how much.
    pub(super) fn follow(&mut self, sensors: &Sensors) -> i32 {
        let angle = angle(sensors);
        let position = self.turns.position(sensors.position_counts, sensors.turns_lost);
        let moved = within_half_a_turn(angle.wrapping_sub(self.angle_count));
        self.angle_count = angle;
        self.shaft_count = self.shaft_count.wrapping_add(moved as u16);
        let shift = self.position.wrapping_add(i32::from(moved)).wrapping_sub(position);
        self.position = position;
        shift
    }

    /// The angle within the turn of the field.
    pub(super) fn electrical_turns(&self, pole_pairs: u16) -> f32 {
        let cycle = u32::from(self.angle_count) * u32::from(pole_pairs) % COUNTS_PER_TURN;
        cycle as f32 / COUNTS_PER_TURN as f32
    }
}

fn angle(sensors: &Sensors) -> u16 {
    sensors.angle_count % COUNTS_PER_TURN as u16
}

/// Counts between two angles, the short way.
fn within_half_a_turn(difference: u16) -> i16 {
    let difference = difference % COUNTS_PER_TURN as u16;
    if difference >= COUNTS_PER_TURN as u16 / 2 {
        difference.wrapping_sub(COUNTS_PER_TURN as u16) as i16
    } else {
        difference as i16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An encoder that sees a turn only cannot tell half a turn forward from half a turn back.
    #[test]
    fn the_shaft_has_moved_the_short_way() {
        let (turn, half) = (COUNTS_PER_TURN as u16, COUNTS_PER_TURN as u16 / 2);
        for (difference, moved) in
            [(0, 0), (1, 1), (half - 1, half as i16 - 1), (half + 1, 1 - half as i16), (turn - 1, -1)]
        {
            assert_eq!(within_half_a_turn(difference), moved, "{difference} counts");
            assert_eq!(within_half_a_turn(difference.wrapping_add(turn)), moved, "a turn more");
        }
    }
}
