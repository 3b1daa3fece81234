//! Electrical angle from Hall sensors and an incremental encoder.
//!
//! After power-on only the Hall state is known: the angle to within 30 electrical degrees, the middle of its sixth of
//! a turn. Counts are followed from there. The first change of the Hall state fixes the angle at the border between
//! the two sixths; from then on it is as exact as the encoder. Later changes are used to see whether both still
//! agree ([`Commutation::disagreement_turns`]).

use crate::angle::wrap_turns;

/// How motor and sensors are built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommutationModel {
    /// Encoder counts per mechanical turn.
    pub counts_per_turn: u32,
    /// Electrical turns per mechanical turn.
    pub pole_pairs: u32,
    /// Electrical angle at which the forward sequence begins, in turns.
    pub offset_turns: f32,
    /// Hall states in each sixth of an electrical turn, forward.
    pub sequence: [u8; 6],
}

/// State: where the electrical angle is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commutation {
    register: u16,
    sixth: Option<u8>,
    /// Position within one electrical cycle in units of `1 / counts_per_turn` electrical turns:
    /// each count adds `pole_pairs`.
    phase: u32,
    aligned: bool,
    disagreement_turns: f32,
}

impl CommutationModel {
    /// Which sixth of an electrical turn a Hall state stands for; `None` for the states that are faults.
    #[inline]
    pub fn sixth(&self, hall: u8) -> Option<u8> {
        (0..6).find(|&sixth| self.sequence[usize::from(sixth)] == hall)
    }
}

impl Commutation {
    /// The angle as the Hall state tells it; zero while the state is a fault.
    pub fn new(model: &CommutationModel, hall: u8, count: u16) -> Self {
        let sixth = model.sixth(hall);
        let turns = sixth.map_or(0.0, |sixth| model.offset_turns + (f32::from(sixth) + 0.5) / 6.0);
        Commutation { register: count, sixth, phase: model.phase(turns), aligned: false, disagreement_turns: 0.0 }
    }

    /// Takes in both sensors, once each period, and returns the electrical angle in turns, `[0, 1)`.
    #[inline]
    pub fn update(&mut self, model: &CommutationModel, hall: u8, count: u16) -> f32 {
        let moved = count.wrapping_sub(self.register) as i16;
        if moved != 0 {
            self.register = count;
            let cycle = model.counts_per_turn.max(1) as i32;
            let step = (i32::from(moved)).wrapping_mul(model.pole_pairs as i32).rem_euclid(cycle);
            self.phase = (self.phase + step as u32) % cycle as u32;
        }
        let known = self.sixth.map(|sixth| model.sequence[usize::from(sixth)]);
        if known != Some(hall) {
            self.cross(model, hall);
        }
        self.phase as f32 / model.counts_per_turn.max(1) as f32
    }

    /// The angle has been fixed by a change of the Hall state; before that it may be off by 30 degrees.
    pub fn is_aligned(&self) -> bool {
        self.aligned
    }

    /// How far the encoder's angle was off when the Hall state last changed, in electrical turns, after alignment.
    /// A drive that sees a sixth of a turn has lost counts or a sensor.
    pub fn disagreement_turns(&self) -> f32 {
        self.disagreement_turns
    }

    #[cold]
    fn cross(&mut self, model: &CommutationModel, hall: u8) {
        let Some(now) = model.sixth(hall) else {
            self.sixth = None;
            return;
        };
        let before = self.sixth.replace(now);
        // Only a step to a neighbour says which border was crossed.
        let border = match before {
            Some(before) if now == (before + 1) % 6 => now,
            Some(before) if before == (now + 1) % 6 => before,
            _ => return,
        };
        let border_turns = model.offset_turns + f32::from(border) / 6.0;
        if self.aligned {
            let off = wrap_turns(self.phase as f32 / model.counts_per_turn.max(1) as f32 - border_turns + 0.5);
            self.disagreement_turns = off - 0.5;
        } else {
            self.phase = model.phase(border_turns);
            self.aligned = true;
        }
    }
}

impl CommutationModel {
    fn phase(&self, turns: f32) -> u32 {
        let counts = self.counts_per_turn.max(1);
        ((wrap_turns(turns) * counts as f32) as u32).min(counts - 1)
    }
}
