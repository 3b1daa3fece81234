//! Incremental encoder and the hardware counter that decodes its quadrature.
//!
//! Four counts per line; the counter is 16 bits wide and wraps, as a microcontroller's timer does, and starts from
//! zero wherever the rotor stands when power comes on. There is no index pulse.

use crate::angle::Angle;

/// What never changes about an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EncoderModel {
    /// Lines per turn.
    pub lines: u32,
}

/// What may be wrong with an encoder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum EncoderFault {
    /// Nothing.
    #[default]
    None,
    /// No edges arrive: unplugged, no supply, or the disc is stuck. The counter keeps its value.
    Disconnected,
    /// One of the two channels is dead: the counter steps to and fro over one count.
    ChannelLost,
}

/// State of the counter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct EncoderData {
    /// What the counter register holds.
    pub count: u16,
    /// What is wrong.
    pub fault: EncoderFault,
    seen: u16,
    half_step: bool,
}

impl EncoderModel {
    /// Counts per turn: four edges per line.
    pub fn counts_per_turn(&self) -> u32 {
        4 * self.lines
    }

    /// The counter as it is after power-on: zero at this angle.
    pub fn power_on(&self, angle: Angle) -> EncoderData {
        EncoderData { seen: angle.count(self.counts_per_turn()) as u16, ..EncoderData::default() }
    }

    /// Counts the edges since the last step. The rotor must turn by less than 32768 counts in a step.
    #[inline]
    pub fn step(&self, data: &mut EncoderData, angle: Angle) {
        let now = angle.count(self.counts_per_turn()) as u16;
        let edges = now.wrapping_sub(data.seen);
        data.seen = now;
        match data.fault {
            EncoderFault::None => data.count = data.count.wrapping_add(edges),
            EncoderFault::Disconnected => {}
            EncoderFault::ChannelLost => {
                // Every second edge is of the live channel; each one turns the decoded direction around.
                let live = now & 2 != 0;
                if live != data.half_step {
                    data.half_step = live;
                    data.count = if live { data.count.wrapping_add(1) } else { data.count.wrapping_sub(1) };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENCODER: EncoderModel = EncoderModel { lines: 1024 };

    fn turn(data: &mut EncoderData, from: Angle, turns: f64) -> Angle {
        let steps = 1000;
        let target = from.advanced_by(turns);
        for step in 1..steps {
            ENCODER.step(data, from.advanced_by(turns * f64::from(step) / f64::from(steps)));
        }
        ENCODER.step(data, target);
        target
    }

    #[test]
    fn whole_turns_give_exact_counts_in_both_directions_and_across_the_wrap() {
        let start = Angle::new(3, 0.371);
        let mut data = ENCODER.power_on(start);
        let there = turn(&mut data, start, 40.0);
        assert_eq!(data.count, (40 * 4096_i32) as u16);
        let back = turn(&mut data, there, -41.0);
        assert_eq!(data.count, (-4096_i32) as u16);
        turn(&mut data, back, 1.0);
        assert_eq!(data.count, 0);
    }

    #[test]
    fn a_disconnected_encoder_loses_counts_for_good() {
        let start = Angle::default();
        let mut data = ENCODER.power_on(start);
        let at = turn(&mut data, start, 1.0);
        data.fault = EncoderFault::Disconnected;
        let at = turn(&mut data, at, 1.0);
        assert_eq!(data.count, 4096);
        data.fault = EncoderFault::None;
        turn(&mut data, at, 1.0);
        assert_eq!(data.count, 8192);
    }

    #[test]
    fn a_lost_channel_makes_the_counter_step_to_and_fro() {
        let start = Angle::default();
        let mut data = ENCODER.power_on(start);
        data.fault = EncoderFault::ChannelLost;
        let mut seen = [false; 2];
        for step in 0..4096 {
            ENCODER.step(&mut data, start.advanced_by(f64::from(step) / 4096.0));
            seen[usize::from(data.count)] = true;
        }
        assert_eq!(seen, [true, true]);
    }
}
