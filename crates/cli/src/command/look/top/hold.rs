//! Whether a key is held down, detected by its repeats: a dead man's switch for a terminal.
//!
//! Most terminals say that a key was pressed, and say it again while it is held, but never that it was released. So a press moves
//! nothing, nor do several: what is held begins with the second repeat, since people do not press a key as fast as systems repeat it, and
//! ends when no further one comes. Repeats that were held up on their way (a connection that stands still) arrive in a burst: they
//! come too soon after the press, and once a hold has ended the key has to be silent before it counts again. Terminals that do report releases
//! end a hold at once.
//!
//! Time is an argument.

use std::time::Duration;

use can::Instant;

/// The least time from a press to its first repeat: systems wait 200 ms and more.
const SOONEST_REPEAT: Duration = Duration::from_millis(120);

/// The most: 660 ms on X11 as delivered, 1 s where people have changed it.
const LATEST_REPEAT: Duration = Duration::from_millis(1_100);

/// How long no repeat may come while a key is held: they come every 25 to 40 ms. The rest of 200 ms is the host's.
pub(super) const REPEAT_SPAN: Duration = Duration::from_millis(150);

/// What to do with what the key holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Act {
    /// It is held: begin.
    Begin,
    /// It is held still.
    Renew,
    /// It has been released: end.
    End,
}

/// A key that may be held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Hold {
    /// It is not pressed.
    #[default]
    Free,
    /// It was pressed, and has not been repeated like one that is held.
    Pressed { at: Instant, last: Instant },
    /// It is held.
    Held { last: Instant },
    /// What it held has ended, and its repeats may still come.
    Over { last: Instant },
}

impl Hold {
    /// The terminal says that it is pressed, for the first time or again.
    pub(super) fn press(&mut self, now: Instant) -> Option<Act> {
        let act = self.look(now);
        match self {
            Self::Free => *self = Self::Pressed { at: now, last: now },
            // The press itself, in a burst; or the first repeat, or another press.
            Self::Pressed { at, last } if now - *at < SOONEST_REPEAT || now - *last > REPEAT_SPAN => *last = now,
            Self::Pressed { .. } => {
                *self = Self::Held { last: now };
                return Some(Act::Begin);
            }
            Self::Held { last } => {
                *last = now;
                return Some(Act::Renew);
            }
            Self::Over { last } => *last = now,
        }
        act
    }

    /// The terminal reports its release.
    pub(super) fn release(&mut self) -> Option<Act> {
        let held = matches!(self, Self::Held { .. });
        *self = Self::Free;
        held.then_some(Act::End)
    }

    /// Another key was pressed, or the window has lost the keyboard.
    pub(super) fn give_up(&mut self, now: Instant) -> Option<Act> {
        let held = matches!(self, Self::Held { .. });
        if *self != Self::Free {
            *self = Self::Over { last: now };
        }
        held.then_some(Act::End)
    }

    /// Time has passed.
    pub(super) fn look(&mut self, now: Instant) -> Option<Act> {
        match *self {
            Self::Held { last } if now - last >= REPEAT_SPAN => {
                *self = Self::Over { last };
                Some(Act::End)
            }
            Self::Pressed { last, .. } | Self::Over { last } if now - last >= LATEST_REPEAT => {
                *self = Self::Free;
                None
            }
            _ => None,
        }
    }

    /// It is held.
    pub(super) const fn is_held(self) -> bool {
        matches!(self, Self::Held { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What each press of these times leads to, with a look every 10 ms; and when a look ended it.
    fn run(presses: &[u64], until: u64) -> Vec<(u64, Act)> {
        let mut hold = Hold::default();
        let mut acts = Vec::new();
        for ms in 0..=until {
            let now = Instant::from_millis(ms);
            if ms % 10 == 0 {
                acts.extend(hold.look(now).map(|act| (ms, act)));
            }
            acts.extend(presses.iter().filter(|at| **at == ms).filter_map(|_| hold.press(now)).map(|act| (ms, act)));
        }
        acts
    }

    /// A press, the wait of the system, and repeats.
    fn held(from: u64, wait: u64, every: u64, to: u64) -> Vec<u64> {
        core::iter::once(from).chain((from + wait..=to).step_by(every as usize)).collect()
    }

    #[test]
    fn a_press_moves_nothing_and_neither_do_a_few() {
        assert_eq!(run(&[0], 3000), []);
        for between in [40, 90, 160, 200, 500, 1200] {
            assert_eq!(run(&[0, between], 3000), [], "twice");
        }
        // Six times a second.
        assert_eq!(run(&(0..3000).step_by(166).collect::<Vec<_>>(), 5000), []);
    }

    #[test]
    fn what_is_held_begins_with_the_second_repeat_and_ends_when_none_comes() {
        for (wait, every) in [(200, 25), (500, 33), (660, 40), (1000, 100)] {
            let presses = held(0, wait, every, 3000);
            let last = *presses.last().expect("one");
            let acts = run(&presses, 6000);
            assert_eq!(acts.first(), Some(&(wait + every, Act::Begin)), "{wait} ms");
            let (ended, end) = *acts.last().expect("an end");
            assert_eq!(end, Act::End);
            assert!((150..=160).contains(&(ended - last)), "{} ms after the last repeat", ended - last);
            assert!(acts[1..acts.len() - 1].iter().all(|(_, act)| *act == Act::Renew));
            assert_eq!(
                acts.len(),
                presses.len() - 1,
                "press and first repeat lead to nothing, and the end is a look's"
            );
        }
    }

    #[test]
    fn repeats_that_were_held_up_begin_nothing() {
        // Held from 0 on; the connection stands still from 1 s to 3 s, and the key is released meanwhile.
        let held_up = (3000..3060).step_by(2);
        let presses: Vec<_> = held(0, 500, 33, 1000).into_iter().chain(held_up).collect();
        let acts = run(&presses, 6000);
        assert_eq!(acts.iter().filter(|(_, act)| *act == Act::Begin).count(), 1);
        assert!(acts.iter().all(|(at, _)| *at < 1200), "{acts:?}");
        // All of it at once, the press among it.
        let burst: Vec<_> = (3000..3100).step_by(2).collect();
        assert_eq!(run(&burst, 6000), []);
    }

    #[test]
    fn after_a_stall_the_key_counts_again_once_it_was_let_go() {
        // A stall of 300 ms ends the hold; the key stays down, and nothing begins by itself.
        let mut presses: Vec<_> = held(0, 500, 33, 1000);
        presses.extend((1300..2000).step_by(33));
        let acts = run(&presses, 2000);
        assert_eq!(acts.last().map(|(_, act)| *act), Some(Act::End));
        assert!(acts.last().is_some_and(|(at, _)| *at < 1200));
        // Let go, and held anew.
        presses.extend(held(3200, 500, 33, 4000));
        let acts = run(&presses, 5000);
        assert_eq!(
            acts.iter().filter(|(_, act)| *act == Act::Begin).map(|(at, _)| *at).collect::<Vec<_>>(),
            [533, 3733]
        );
    }

    #[test]
    fn a_release_and_another_key_end_it_at_once() {
        let mut hold = Hold::default();
        let at = Instant::from_millis;
        let press = |hold: &mut Hold, ms| hold.press(at(ms));
        assert_eq!([0, 500, 530].map(|ms| press(&mut hold, ms)), [None, None, Some(Act::Begin)]);
        assert_eq!((hold.release(), hold), (Some(Act::End), Hold::Free));
        assert_eq!([600, 1100, 1133].map(|ms| press(&mut hold, ms)), [None, None, Some(Act::Begin)]);
        assert_eq!(hold.give_up(at(1140)), Some(Act::End));
        assert_eq!([1166, 1200, 1233].map(|ms| press(&mut hold, ms)), [None; 3], "until it has been released");
        assert_eq!(hold.release(), None);
    }
}
