//! Two devices with one node-ID, by what they send without being asked: a producer of heartbeats sends one each period, and one
//! boot-up message after each start (CiA 301, 7.2.8.3.2 and 7.2.8.3.3).

use core::fmt;
use std::time::Duration;

use can::Instant;
use canopen::NmtState;

/// Heartbeats in a row that are looked at.
const KEPT: usize = 8;

/// Heartbeats that speak of a rhythm: five times between them.
const RHYTHM: usize = 6;

/// Changes of the state, back and forth between two of them, that no master has commanded.
const FLIPS: usize = 4;

/// By how much two times of a rhythm have to differ at least. An adapter or a program that hands frames over in bundles makes a rhythm
/// of its own, of some tens of milliseconds.
const DISTINCT: Duration = Duration::from_millis(100);

/// No device starts twice within this time, unless it is commanded to.
const START: Duration = Duration::from_millis(100);

/// What speaks for two devices with one node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Twins {
    /// SDO requests have two answers.
    Answers,
    /// Two boot-up messages came at almost the same time.
    BootUps,
    /// The heartbeats name these two states in turn, without a command.
    States(NmtState, NmtState),
    /// The heartbeats come at these two times after each other, in turn.
    Rhythm(Duration, Duration),
}

impl fmt::Display for Twins {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Answers => f.write_str("one SDO request has two answers"),
            Self::BootUps => write!(f, "two boot-up messages came within {} ms", START.as_millis()),
            Self::States(one, other) => write!(f, "its heartbeats say {one} and {other} in turn, without a command"),
            Self::Rhythm(one, other) => {
                write!(f, "its heartbeats come after {} ms and after {} ms in turn", one.as_millis(), other.as_millis())
            }
        }
    }
}

/// The heartbeats and boot-up messages of one node-ID, as far as they speak for one device or two.
#[derive(Clone, Debug, Default)]
pub(super) struct Heartbeats {
    /// Oldest first; the first `count` of them.
    kept: [(Instant, Option<NmtState>); KEPT],
    count: usize,
    /// When the last boot-up message came, unless the node was since commanded to start anew.
    booted_at: Option<Instant>,
}

impl Heartbeats {
    /// A boot-up message: the device begins anew, and its heartbeats with it.
    pub(super) fn booted(&mut self, now: Instant) -> Option<Twins> {
        self.count = 0;
        let before = self.booted_at.replace(now);
        before.filter(|before| now - *before < START).map(|_| Twins::BootUps)
    }

    /// The node was commanded to change its state, by this master or another.
    pub(super) fn commanded(&mut self) {
        (self.count, self.booted_at) = (0, None);
    }

    /// A heartbeat.
    pub(super) fn heard(&mut self, state: NmtState, now: Instant) -> Option<Twins> {
        if self.count == KEPT {
            self.kept.rotate_left(1);
            self.count -= 1;
        }
        self.kept[self.count] = (now, Some(state));
        self.count += 1;
        self.states().or_else(|| self.rhythm())
    }

    /// The shortest time between two heartbeats.
    pub(super) fn shortest(&self) -> Option<Duration> {
        self.kept[..self.count].windows(2).map(|pair| pair[1].0 - pair[0].0).min()
    }

    fn states(&self) -> Option<Twins> {
        let kept = &self.kept[..self.count];
        let (one, other) = (kept.last()?.1?, kept.iter().rev().find(|(_, state)| *state != kept[kept.len() - 1].1)?.1?);
        let are_two = kept.iter().all(|(_, state)| *state == Some(one) || *state == Some(other));
        let flips = kept.windows(2).filter(|pair| pair[0].1 != pair[1].1).count();
        (are_two && flips >= FLIPS).then_some(Twins::States(other, one))
    }

    /// The times between them are in turn one and another, each about the same every time: two producers of one period.
    fn rhythm(&self) -> Option<Twins> {
        let last = self.kept[..self.count].last_chunk::<RHYTHM>()?;
        let time = |at: usize| last[at + 1].0 - last[at].0;
        let tolerance = (last[2].0 - last[0].0) / 20;
        let is_kept = (0..RHYTHM - 3).all(|at| time(at).abs_diff(time(at + 2)) <= tolerance);
        let (short, long) = (time(0).min(time(1)), time(0).max(time(1)));
        // One of which frames are lost.
        let is_multiple = [2, 3].iter().any(|times| long.abs_diff(*times * short) <= tolerance);
        let are_distinct = long - short >= DISTINCT.max(4 * tolerance);
        (is_kept && are_distinct && !is_multiple).then(|| Twins::Rhythm(time(0), time(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use NmtState::{Operational, PreOperational, Stopped};

    /// What is made of heartbeats at these times in ms.
    fn judged(heartbeats: impl IntoIterator<Item = (u64, NmtState)>) -> Option<Twins> {
        let mut kept = Heartbeats::default();
        heartbeats.into_iter().find_map(|(at, state)| kept.heard(state, Instant::from_millis(at)))
    }

    /// Two producers of these periods and phases, in the order of time.
    fn merged(producers: [(u64, u64, NmtState); 2]) -> Vec<(u64, NmtState)> {
        let beats =
            producers.into_iter().flat_map(|(period, phase, state)| (0..20).map(move |n| (phase + n * period, state)));
        let mut beats: Vec<_> = beats.collect();
        beats.sort_by_key(|(at, _)| *at);
        beats
    }

    #[test]
    fn two_producers_are_seen_by_their_rhythm_or_their_states() {
        let ms = Duration::from_millis;
        for (phase, times) in [(0, (0, 1000)), (300, (300, 700)), (850, (850, 150))] {
            let same = merged([(1000, 0, Operational), (1000, phase, Operational)]);
            assert_eq!(judged(same), Some(Twins::Rhythm(ms(times.0), ms(times.1))), "{phase}");
        }
        for (period, phase) in [(1000, 500), (1000, 0), (100, 50), (700, 10)] {
            let states = merged([(1000.min(period), 0, Operational), (period, phase, PreOperational)]);
            assert_eq!(judged(states), Some(Twins::States(PreOperational, Operational)), "{period} {phase}");
        }
        let periods = merged([(1000, 0, Operational), (700, 10, Stopped)]);
        assert!(matches!(judged(periods), Some(Twins::States(..))));
    }

    #[test]
    fn one_producer_is_one_whatever_holds_its_frames_up() {
        let steady = |period: u64| (0..50).map(move |n| (n * period, Operational));
        assert_eq!(judged(steady(1000)), None);
        // Behind other frames, differently each time.
        let late = |n: u64| n * 37 % 90;
        assert_eq!(judged((0..50).map(|n| (n * 1000 + late(n), Operational))), None);
        // A host that stands still for 3 s, and an adapter that hands two frames over at a time.
        assert_eq!(
            judged(steady(1000).map(|(at, state)| (if (5000..8000).contains(&at) { 8000 } else { at }, state))),
            None
        );
        assert_eq!(judged(steady(20).map(|(at, state)| (at / 40 * 40, state))), None);
        // Frames that are lost, even in a rhythm, and a period that was changed.
        for (of, lost) in [(3, 1), (4, 2), (2, 1), (7, 3)] {
            assert_eq!(judged(steady(1000).filter(|(at, _)| at / 1000 % of >= lost)), None, "{lost} of {of}");
        }
        assert_eq!(judged(steady(1000).chain((0..50).map(|n| (50_300 + n * 300, Operational)))), None);
        // An alarm that a heartbeat shows by its state, and that comes and goes.
        assert_eq!(judged((0..50).map(|n| (n * 1000, if n % 10 < 4 { Stopped } else { Operational }))), None);
    }

    #[test]
    fn what_was_commanded_says_nothing_and_neither_does_one_start() {
        let mut kept = Heartbeats::default();
        for n in 0..20 {
            kept.commanded();
            let state = if n % 2 == 0 { Operational } else { PreOperational };
            assert_eq!(kept.heard(state, Instant::from_secs(n)), None);
        }
        let at = Instant::from_millis;
        assert_eq!(kept.booted(at(30_000)), None);
        kept.commanded();
        assert_eq!(kept.booted(at(30_050)), None, "reset twice in a row");
        assert_eq!(kept.booted(at(30_150)), None, "a supply that comes and goes");
        assert_eq!(kept.booted(at(30_160)), Some(Twins::BootUps));
    }
}
