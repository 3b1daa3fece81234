//! The set-points of the modes that are given one each cycle: ip, csp, csv and cst.
//!
//! A path leads from one to the next within the period 60C2h. When they stay away, the path ends:
//!
//! - Positions (ip, csp) go on for [`FORGIVEN_PERIODS`], slow down, and come back to the last one: [`motion::set_points`].
//! - Velocities and torques that came once a period do not: the axis is brought to rest after the same time, and held.
//! - Those that came by RPDO in another rhythm: after three periods of SYNC, if 1006h says how long one is, else after
//!   [`PATIENCE_S`](crate::servo::parameters::PATIENCE_S). The standard leaves it to makers; a motor that turns on for
//!   ever is never wanted.
//! - Those that a host wrote by SDO stay: they do not come in a cycle. Such a host is watched by its heartbeat (1016h).
//!
//! An RPDO's own deadline (its event timer) and 6007h are the drive's: `drive/connection.rs`.

use motion::profile::Point;
use motion::set_points::{Following, SetPoints};

use crate::servo::parameters::FORGIVEN_PERIODS;

/// Most set-points that wait in ip (60C4h:01): as many as there are bits for the places filled.
pub(in crate::servo) const MOST_WAITING: usize = u64::BITS as usize;

/// The present path, and in ip what waits behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CyclicSetPoints {
    path: SetPoints,
    /// Since the last set-point, s; `None` before the first one of the mode.
    age_s: Option<f64>,
    /// It was beyond the limits.
    held: bool,
    by_rpdo: bool,
    pub(super) waiting: Waiting,
}

impl CyclicSetPoints {
    pub(super) const fn none() -> Self {
        Self {
            path: SetPoints::resting(0.0),
            age_s: None,
            held: false,
            by_rpdo: false,
            waiting: Waiting::none(0, Organisation::FirstInFirstOut),
        }
    }

    /// The next one counts as the first.
    pub(super) const fn forget(&mut self) {
        self.age_s = None;
    }

    /// A set-point came; before it the axis was at `from`. `held`: it was beyond the limits.
    pub(super) fn take(&mut self, target: f64, from: f64, held: bool, by_rpdo: bool, following: &Following) {
        if self.age_s.is_none() {
            self.path = SetPoints::resting(from);
        }
        self.path.push(target, self.age_s.unwrap_or(f64::INFINITY), following);
        self.age_s = Some(0.0);
        self.held = held;
        self.by_rpdo = by_rpdo;
    }

    /// One period of the axis later: where the path is, of positions.
    pub(super) fn advance(&mut self, dt_s: f64, following: &Following) -> Option<Point> {
        let age_s = self.age_s? + dt_s;
        self.age_s = Some(age_s);
        Some(self.path.at(age_s, following))
    }

    /// The same of velocities or torques, which end when they stay away.
    pub(super) fn advance_while_fed(&mut self, dt_s: f64, following: &Following, patience_s: f64) -> Option<f64> {
        let age_s = self.age_s? + dt_s;
        self.age_s = Some(age_s);
        let patience_s = if self.path.is_steady() {
            (1.0 + FORGIVEN_PERIODS) * following.period_s
        } else if self.by_rpdo {
            patience_s
        } else {
            f64::INFINITY
        };
        if age_s > patience_s {
            self.age_s = None;
            return None;
        }
        Some(self.path.at(age_s.min(following.period_s), following).position)
    }

    /// In ip with a buffer: the next set-point is due.
    pub(super) fn take_waiting(&mut self, dt_s: f64, following: &Following) -> Option<i32> {
        let is_due = self.age_s.is_none_or(|age_s| age_s + dt_s > following.period_s);
        if is_due { self.waiting.take() } else { None }
    }

    /// The last set-point was beyond the limits.
    pub(super) const fn is_held(&self) -> bool {
        self.held
    }

    /// What was `by` is 0 from now on.
    pub(super) fn shift(&mut self, by: i32) {
        self.path.shift(f64::from(by));
        self.waiting.shift(by);
    }
}

/// How set-points wait (60C4h:03).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::servo) enum Organisation {
    /// 0: first in, first out. A full one takes no more.
    FirstInFirstOut,
    /// 1: a ring, whose places the host fills as 60C4h:04 says, and the drive reads one after the other, round and round.
    Ring,
}

/// The buffer of ip (60C4h). Values in increments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Waiting {
    places: [i32; MOST_WAITING],
    /// Bit n: place n has a set-point.
    filled: u64,
    /// The place that is read next.
    next: u8,
    size: u8,
    organisation: Organisation,
}

impl Waiting {
    /// An empty buffer of so many places; less than two do not make a buffer: each set-point acts as it comes.
    pub(super) const fn none(size: u8, organisation: Organisation) -> Self {
        Self { places: [0; MOST_WAITING], filled: 0, next: 0, size, organisation }
    }

    /// Set-points wait here.
    pub(super) const fn is_used(&self) -> bool {
        self.size > 1
    }

    /// The oldest one is read first.
    pub(super) fn is_first_in_first_out(&self) -> bool {
        self.organisation == Organisation::FirstInFirstOut
    }

    /// How many wait.
    pub(super) const fn count(&self) -> u32 {
        self.filled.count_ones()
    }

    /// Empties it, and takes another size and organisation.
    pub(super) const fn reorganise(&mut self, size: u8, organisation: Organisation) {
        *self = Self::none(size, organisation);
    }

    /// A set-point came, with 60C4h:04 at `position`. False if there is no room for it.
    pub(super) fn put(&mut self, target: i32, position: usize) -> bool {
        let size = usize::from(self.size);
        let place = match self.organisation {
            Organisation::FirstInFirstOut if self.count() as usize >= size => return false,
            Organisation::FirstInFirstOut => (usize::from(self.next) + self.count() as usize) % size,
            Organisation::Ring if position >= size => return false,
            Organisation::Ring => position,
        };
        self.places[place] = target;
        self.filled |= 1 << place;
        true
    }

    /// The next one, if it is there.
    fn take(&mut self) -> Option<i32> {
        let place = usize::from(self.next);
        if self.filled >> place & 1 == 0 {
            return None;
        }
        if self.organisation == Organisation::FirstInFirstOut {
            self.filled &= !(1 << place);
        }
        self.next = (self.next + 1) % self.size.max(1);
        Some(self.places[place])
    }

    fn shift(&mut self, by: i32) {
        self.places.iter_mut().for_each(|place| *place = place.wrapping_sub(by));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::parameters::PATIENCE_S;
    use motion::set_points::Interpolation;

    const MS: f64 = 1e-3;
    const FOLLOWING: Following = Following {
        interpolation: Interpolation::Linear,
        period_s: 4.0 * MS,
        forgiven: FORGIVEN_PERIODS,
        deceleration: 0.0,
    };

    #[test]
    fn first_in_is_first_out_and_a_full_buffer_takes_no_more() {
        let mut waiting = Waiting::none(3, Organisation::FirstInFirstOut);
        assert!([10, 20, 30].into_iter().all(|target| waiting.put(target, 0)) && !waiting.put(40, 0));
        assert_eq!((waiting.take(), waiting.count()), (Some(10), 2));
        assert!(waiting.put(40, 0));
        assert_eq!([(); 4].map(|()| waiting.take()), [Some(20), Some(30), Some(40), None]);
    }

    #[test]
    fn a_ring_is_filled_where_its_position_says_and_read_round_and_round() {
        let mut waiting = Waiting::none(2, Organisation::Ring);
        assert_eq!(waiting.take(), None);
        assert!(waiting.put(10, 0) && waiting.put(20, 1) && !waiting.put(30, 2));
        assert_eq!([(); 3].map(|()| waiting.take()), [Some(10), Some(20), Some(10)]);
        assert!(waiting.put(21, 1));
        assert_eq!(waiting.take(), Some(21));
    }

    fn path(by_rpdo: bool, came_ms: &[u32]) -> CyclicSetPoints {
        let mut set_points = CyclicSetPoints::none();
        let mut ms = 0;
        for (n, at) in came_ms.iter().enumerate() {
            while ms < *at {
                ms += 1;
                set_points.advance_while_fed(MS, &FOLLOWING, PATIENCE_S);
            }
            set_points.take(100.0 * (n + 1) as f64, 0.0, false, by_rpdo, &FOLLOWING);
        }
        set_points
    }

    /// How many more milliseconds a path goes on for; at most 999.
    fn lasts_ms(mut set_points: CyclicSetPoints) -> usize {
        (0..999).take_while(|_| set_points.advance_while_fed(MS, &FOLLOWING, PATIENCE_S).is_some()).count()
    }

    #[test]
    fn velocities_are_led_to_within_the_period_and_end_when_they_stay_away() {
        // A straight line to 100 within 4 ms.
        let mut rising = path(true, &[0]);
        let course = [(); 5].map(|()| rising.advance_while_fed(MS, &FOLLOWING, PATIENCE_S).unwrap().round());
        assert_eq!(course, [25.0, 50.0, 75.0, 100.0, 100.0]);
        // In the rhythm of 60C2h: its period and two more; in another one by RPDO: the patience; by SDO: for ever.
        for by_rpdo in [true, false] {
            assert!((11..=12).contains(&lasts_ms(path(by_rpdo, &[0, 4, 8, 12]))), "{by_rpdo}");
        }
        assert!((99..=100).contains(&lasts_ms(path(true, &[0, 30, 60]))));
        assert_eq!(lasts_ms(path(false, &[0, 30, 60])), 999);
    }
}
