//! Profile position (CiA 402-2, clause 10): set-points with a queue of one, and the handshake of bits 4, 5, 6 and 12.

/// A set-point as the controlword hands it over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetPoint {
    /// Target position, or the way to go.
    pub target: i32,
    /// `target` is relative to the preceding target (CiA 402-2, 60F2h = 0: its default).
    pub relative: bool,
    /// Replaces what is under way; otherwise it waits for its end.
    pub immediately: bool,
}

/// The set-point under way, the one that waits, and the acknowledge bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetPoints {
    /// The present or last target: relative moves count from here.
    target: i32,
    under_way: bool,
    waiting: Option<SetPoint>,
    acknowledged: bool,
}

impl SetPoints {
    /// Nothing under way; `position` stands for the preceding target.
    pub const fn resting(position: i32) -> Self {
        Self { target: position, under_way: false, waiting: None, acknowledged: false }
    }

    /// Bit 4 rose. Aims at the set-point, or puts it into the queue; a set-point that finds the queue full is lost, and
    /// the acknowledge bit shows it by not falling before. True if the move to [`target`](Self::target) begins now.
    #[must_use]
    pub fn take(&mut self, set_point: SetPoint) -> bool {
        let at_once = !self.under_way || set_point.immediately;
        if at_once {
            self.waiting = None;
            self.aim(set_point);
        } else if self.waiting.is_none() {
            self.waiting = Some(set_point);
        } else {
            return false;
        }
        self.acknowledged = true;
        at_once
    }

    /// One period, after the shaft has moved on: a set-point that waits follows one that has ended (`arrived`), and the
    /// acknowledge bit falls once bit 4 (`new_set_point`) is down and the queue has room. True if the move to
    /// [`target`](Self::target) begins now.
    #[must_use]
    pub fn update(&mut self, new_set_point: bool, arrived: bool) -> bool {
        let mut begins = false;
        if self.under_way && arrived {
            self.under_way = false;
            if let Some(next) = self.waiting.take() {
                self.aim(next);
                begins = true;
            }
        }
        self.release(new_set_point);
        begins
    }

    /// The acknowledge bit falls when bit 4 is down and the queue has room.
    pub fn release(&mut self, new_set_point: bool) {
        if !new_set_point && self.waiting.is_none() {
            self.acknowledged = false;
        }
    }

    /// The present or last target.
    pub const fn target(&self) -> i32 {
        self.target
    }

    /// The shaft stands elsewhere than the target: relative moves count from here, unless a move is to go on.
    pub fn rebase(&mut self, position: i32) {
        if !self.under_way {
            self.target = position;
        }
    }

    /// Drops all set-points.
    pub fn abort(&mut self, position: i32) {
        *self = Self::resting(position);
    }

    /// The zero of position moves: what was `by` is 0 from now on.
    pub fn shift(&mut self, by: i32) {
        self.target = self.target.wrapping_sub(by);
        if let Some(waiting) = self.waiting.as_mut().filter(|waiting| !waiting.relative) {
            waiting.target = waiting.target.wrapping_sub(by);
        }
    }

    /// Bit 12.
    pub const fn is_acknowledged(&self) -> bool {
        self.acknowledged
    }

    /// A move is under way or waits.
    pub const fn is_under_way(&self) -> bool {
        self.under_way
    }

    fn aim(&mut self, set_point: SetPoint) {
        self.target = if set_point.relative { self.target.wrapping_add(set_point.target) } else { set_point.target };
        self.under_way = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::axis::{MoveLimits, Ramp, Trajectory};

    const LIMITS: MoveLimits = MoveLimits {
        start_speed: 0.0,
        max_speed: 1000.0,
        end_speed: 0.0,
        passes: false,
        acceleration: Ramp::Time(0.1),
        deceleration: Ramp::Time(0.1),
    };

    struct SetPointBench {
        mode: SetPoints,
        trajectory: Trajectory,
    }

    impl SetPointBench {
        fn new() -> Self {
            Self { mode: SetPoints::resting(0), trajectory: Trajectory::resting(0) }
        }

        fn take(&mut self, target: i32, relative: bool, immediately: bool) {
            if self.mode.take(SetPoint { target, relative, immediately }) {
                self.set_off();
            }
        }

        fn set_off(&mut self) {
            self.trajectory = Trajectory::move_to(self.trajectory.point(), self.mode.target(), &LIMITS);
        }

        fn run(&mut self, periods: u32, bit_4: bool) -> i32 {
            for _ in 0..periods {
                self.trajectory.advance(1e-3);
                if self.mode.update(bit_4, self.trajectory.is_resting()) {
                    self.set_off();
                }
            }
            self.trajectory.point().position
        }
    }

    #[test]
    fn a_set_point_is_acknowledged_until_bit_4_falls() {
        let mut bench = SetPointBench::new();
        bench.take(1000, false, false);
        bench.run(10, true);
        assert!(bench.mode.is_acknowledged());
        bench.run(1, false);
        assert!(!bench.mode.is_acknowledged());
        assert_eq!(bench.run(5000, false), 1000);
    }

    #[test]
    fn a_second_set_point_waits_and_a_third_is_lost() {
        let mut bench = SetPointBench::new();
        bench.take(1000, false, false);
        bench.take(2000, false, false);
        bench.run(1, false);
        assert!(bench.mode.is_acknowledged(), "the queue is full");
        bench.take(3000, false, false);
        let mut stopped_at_first = false;
        for _ in 0..10_000 {
            stopped_at_first |= bench.run(1, false) == 1000 && bench.trajectory.point().velocity == 0.0;
        }
        assert!(stopped_at_first && !bench.mode.is_acknowledged());
        assert_eq!(bench.trajectory.point().position, 2000);
    }

    #[test]
    fn an_immediate_set_point_replaces_the_move_and_the_queue() {
        let mut bench = SetPointBench::new();
        bench.take(5000, false, false);
        bench.take(6000, false, false);
        bench.run(500, true);
        bench.take(-200, false, true);
        assert_eq!(bench.run(10_000, false), -200);
    }

    #[test]
    fn relative_set_points_count_from_the_preceding_target() {
        let mut bench = SetPointBench::new();
        bench.take(1000, true, false);
        bench.run(300, true);
        bench.take(1000, true, true);
        assert_eq!(bench.run(10_000, false), 2000);
        bench.take(-500, true, false);
        assert_eq!(bench.run(10_000, false), 1500);
    }

    #[test]
    fn clearing_the_position_moves_the_numbers_and_not_the_shaft() {
        let mut bench = SetPointBench::new();
        bench.take(1000, false, false);
        bench.run(500, true);
        let here = bench.trajectory.point().position;
        bench.trajectory.shift(here);
        bench.mode.shift(here);
        assert_eq!(bench.run(10_000, false), 1000 - here);
    }
}
