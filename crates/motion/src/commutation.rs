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
    hall: u8,
    aligned: bool,
    /// Position within one electrical turn in units of `1 / counts_per_turn` of it: each count adds `pole_pairs`.
    phase: i32,
    /// Electrical turns to one of these units.
    unit_turns: f32,
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
    /// The angle by the Hall state; zero while the state is a fault.
    pub fn new(model: &CommutationModel, hall: u8, count: u16) -> Self {
        let turns = model.sixth(hall).map_or(0.0, |sixth| model.offset_turns + (f32::from(sixth) + 0.5) / 6.0);
        Commutation {
            register: count,
            hall,
            aligned: false,
            phase: model.phase(turns),
            unit_turns: 1.0 / model.cycle() as f32,
            disagreement_turns: 0.0,
        }
    }

    /// Takes in both sensors, once each period, and returns the electrical angle in turns, `[0, 1)`.
    #[inline]
    pub fn update(&mut self, model: &CommutationModel, hall: u8, count: u16) -> f32 {
        let moved = count.wrapping_sub(self.register) as i16;
        self.register = count;
        let cycle = model.cycle();
        self.phase = self.phase.wrapping_add(i32::from(moved).wrapping_mul(model.pole_pairs as i32));
        if !(0..cycle).contains(&self.phase) {
            self.phase = self.phase.rem_euclid(cycle);
        }
        if hall != self.hall {
            self.cross(model, hall);
        }
        self.phase as f32 * self.unit_turns
    }

    /// The same of periods in which the shaft may come far beyond a border before it is seen: the border is taken to lie in the
    /// middle of the way of the period, and half of it does not count as a disagreement.
    pub fn follow(&mut self, model: &CommutationModel, hall: u8, count: u16) -> f32 {
        let moved = count.wrapping_sub(self.register) as i16;
        let (was_aligned, changes) = (self.aligned, hall != self.hall);
        let turns = self.update(model, hall, count);
        if !changes {
            return turns;
        }
        let way_turns = f32::from(moved) * model.pole_pairs as f32 * self.unit_turns;
        if was_aligned {
            let beyond = (self.disagreement_turns.abs() - way_turns.abs()).max(0.0);
            self.disagreement_turns = beyond.copysign(self.disagreement_turns);
            turns
        } else {
            // A single count may as well lie before the border.
            let beyond = i32::from(moved) - i32::from(moved).signum();
            let half = beyond.wrapping_mul(model.pole_pairs as i32) / 2;
            self.phase = self.phase.wrapping_add(half).rem_euclid(model.cycle());
            self.phase as f32 * self.unit_turns
        }
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
        let before = model.sixth(core::mem::replace(&mut self.hall, hall));
        // Only a step to a neighbour says which border was crossed.
        let border = match (before, model.sixth(hall)) {
            (Some(before), Some(now)) if now == (before + 1) % 6 => now,
            (Some(before), Some(now)) if before == (now + 1) % 6 => before,
            _ => return,
        };
        let border_turns = model.offset_turns + f32::from(border) / 6.0;
        if self.aligned {
            self.disagreement_turns = wrap_turns(self.phase as f32 * self.unit_turns - border_turns + 0.5) - 0.5;
        } else {
            self.phase = model.phase(border_turns);
            self.aligned = true;
        }
    }
}

impl CommutationModel {
    /// Counts of a mechanical turn, at least one.
    #[inline]
    fn cycle(&self) -> i32 {
        i32::try_from(self.counts_per_turn).unwrap_or(i32::MAX).max(1)
    }

    fn phase(&self, turns: f32) -> i32 {
        ((wrap_turns(turns) * self.cycle() as f32) as i32).min(self.cycle() - 1)
    }
}
