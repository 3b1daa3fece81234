//! The second analysis of a bus that is nearly full: frames that come in step with each other are counted once in a cycle.
//!
//! The first one ([`response_times`](super::response_times)) takes every frame for one that may come at the worst moment for every
//! other, and what holds up a SYNC for what holds up its answers again. Here the whole time of a frame is looked at in one
//! window, from the beginning of its period (of that of the frame which it answers) to its end on the wire, and each frame
//! that passes in it is counted as often as it can:
//!
//! - of a frame in step (the set-points of a SYNC, the answers to it) those of the same cycle, of earlier ones that are not gone by
//!   then, and of later ones that begin before the end; an answer never comes before what it answers;
//! - of any other frame as many as a window of that length and the time that one of them takes can touch;
//! - of the own queue what may stand before it.
//!
//! And a cycle as a whole is at its end when all that is in step and all else that can pass meanwhile has passed, and the bus has
//! stood still for no longer than a host is late and a device takes to answer: a node that has something to send,
//! sends. A cycle that takes longer than its period takes of the next one, and so on until one is in time again.
//!
//! As K. Tindell, "Adding time-offsets to schedulability analysis", 1994, and M. Palencia and M. González Harbour, "Exploiting
//! precedence relations in the schedulability analysis of distributed real-time systems", 1999, with all offsets but those of
//! precedence left open. Both analyses are bounds, so that the smaller one is.

use super::queued::{Queued, after, nanos, wire_ns};

/// Rounds in which the times settle. What has not by then is taken for having no bound.
const ROUNDS: usize = 100;

/// Periods of a frame beyond which a bound says nothing.
const MOST_PERIODS: u64 = 64;

/// A frame in nanoseconds.
struct Member<'a> {
    frame: &'a Queued,
    key: u32,
    time_ns: u64,
    period_ns: u64,
    jitter_ns: u64,
    /// When it may begin at the earliest, from the beginning of its period (of that of what it answers).
    first_ns: u64,
    /// The frame with whose period it comes; itself, if with none.
    root: usize,
}

/// Frames and what an error costs.
pub(super) struct InStep<'a> {
    bit_ns: u64,
    members: Vec<Member<'a>>,
    /// One in this time, and what it costs.
    error: Option<(u64, u64)>,
}

/// The longest time of each frame so far, from the beginning of its period; `None`: no bound.
type Times = Vec<Option<u64>>;

impl<'a> InStep<'a> {
    pub(super) fn new(frames: &'a [Queued], bit_ns: u64, error_every_ns: Option<u64>, error_bits: u64) -> Self {
        let root = |number: usize| {
            let first = frames[number].trigger.map_or(number, |trigger| trigger.by);
            frames[first].with.unwrap_or(first)
        };
        let member = |(number, frame): (usize, &'a Queued)| Member {
            frame,
            key: can::Frame::new(frame.id, &[]).arbitration_key(),
            time_ns: wire_ns(frame, bit_ns),
            period_ns: nanos(frame.period).max(1),
            jitter_ns: nanos(frame.jitter),
            first_ns: frame.trigger.map_or(0, |trigger| after(&trigger, frames, bit_ns)),
            root: root(number),
        };
        let members: Vec<_> = frames.iter().enumerate().map(member).collect();
        let longest_ns = members.iter().map(|member| member.time_ns).max().unwrap_or_default();
        let error = error_every_ns.map(|every_ns| (every_ns, error_bits * bit_ns + longest_ns));
        Self { bit_ns, members, error }
    }

    /// The longest time of each frame, from the beginning of its period (of that of what it answers) to its end.
    pub(super) fn longest(&self) -> Times {
        let mut times: Times = vec![Some(0); self.members.len()];
        for round in 0.. {
            let ends: Vec<_> = (0..self.members.len()).map(|root| self.end_of_cycle(root, &times)).collect();
            let longest = |number: usize| {
                let end = ends[self.members[number].root].filter(|_| times[number].is_some());
                [self.longest_of(number, &times), end].into_iter().flatten().min()
            };
            let mut next: Times = (0..self.members.len()).map(longest).collect();
            if next == times {
                break;
            }
            if round >= ROUNDS {
                // What grows without end takes along what depends on it.
                next.iter_mut()
                    .zip(&times)
                    .filter(|(next, before)| *next != *before)
                    .for_each(|(next, _)| *next = None);
            }
            times = next;
        }
        times
    }

    /// When everything that comes in step with a frame has come, from the beginning of its period; `None`: nothing does, or there is no
    /// bound.
    fn end_of_cycle(&self, root: usize, times: &Times) -> Option<u64> {
        let cycle = || self.members.iter().filter(|member| member.root == root);
        // Of one alone the other way is the better one.
        cycle().nth(1)?;
        let period_ns = self.members[root].period_ns;
        let late_ns = cycle().map(|member| member.jitter_ns).max()?;
        let answer_ns = cycle().filter_map(|member| member.frame.trigger).map(|trigger| nanos(trigger.most)).max();
        let own_ns = cycle().map(|member| member.time_ns).sum::<u64>() + late_ns + answer_ns.unwrap_or_default();
        let mut longest_ns = 0;
        // Cycles before this one that have not been in time, after one that was.
        for before in 0..MOST_PERIODS {
            let from_ns = (before + 1) * own_ns;
            let mut window_ns = from_ns;
            loop {
                let next_ns = from_ns + self.beside_ns(root, window_ns, times)?;
                if next_ns <= window_ns {
                    break;
                }
                if next_ns > MOST_PERIODS * period_ns {
                    return None;
                }
                window_ns = next_ns;
            }
            let end_ns = window_ns.saturating_sub(before * period_ns);
            longest_ns = longest_ns.max(end_ns);
            if end_ns <= period_ns {
                return Some(longest_ns);
            }
        }
        None
    }

    /// What all that does not come in step with a frame can take of a window, and errors.
    fn beside_ns(&self, root: usize, window_ns: u64, times: &Times) -> Option<u64> {
        let mut sum_ns = self.errors_ns(window_ns);
        for (it, longest) in self.members.iter().zip(times).filter(|(it, _)| it.root != root) {
            sum_ns += ((*longest)? + window_ns + self.bit_ns).div_ceil(it.period_ns) * it.time_ns;
        }
        Some(sum_ns)
    }

    /// What errors take of a time.
    fn errors_ns(&self, within_ns: u64) -> u64 {
        self.error.map_or(0, |(every_ns, cost_ns)| within_ns.div_ceil(every_ns).saturating_mul(cost_ns))
    }

    fn longest_of(&self, number: usize, times: &Times) -> Option<u64> {
        times[number]?;
        let last = &self.members[number];
        let answered = last.frame.trigger.map(|trigger| trigger.by);
        let first = answered.unwrap_or(number);
        if answered.is_some() && !last.frame.ahead.is_empty() {
            // An answer leaves a controller that sends the most urgent first.
            return None;
        }
        let level = self.level(first, times)?;
        let mut fixed_ns = self.members[first].jitter_ns + self.blocking_ns(first, level) + last.time_ns;
        if let Some(trigger) = last.frame.trigger {
            fixed_ns += self.members[first].time_ns + nanos(trigger.most);
            fixed_ns += last.jitter_ns + self.blocking_ns(number, last.key);
        }
        let most_ns = self.members[last.root].period_ns.max(last.period_ns).saturating_mul(MOST_PERIODS);
        let mut total_ns = fixed_ns;
        while total_ns <= most_ns {
            let until_ns = total_ns - last.time_ns + self.bit_ns;
            let mut next_ns = fixed_ns + self.errors_ns(total_ns);
            for other in 0..self.members.len() {
                let count = self.count(other, (first, number), level, until_ns, times)?;
                next_ns = next_ns.saturating_add(count.saturating_mul(self.members[other].time_ns));
            }
            if next_ns <= total_ns {
                return Some(total_ns);
            }
            total_ns = next_ns;
        }
        None
    }

    /// How often a frame can pass in the window of the frame `number`, which answers `first` or is it, beside itself.
    fn count(
        &self,
        other: usize,
        (first, number): (usize, usize),
        level: u32,
        until_ns: u64,
        times: &Times,
    ) -> Option<u64> {
        let (it, own) = (&self.members[other], &self.members[number]);
        let is_answer = first != number;
        let queues = other != first && self.queues(first, other);
        let urgent_to_answer = is_answer && it.key <= own.key;
        let urgent = (it.key <= level && !queues) || urgent_to_answer;
        let in_step = it.root == own.root;
        let period_ns = if in_step { self.members[it.root].period_ns } else { it.period_ns };
        if other != first && other != number && !urgent && !queues {
            return Some(0);
        }
        let longest_ns = times[other]?;
        let earlier = longest_ns.div_ceil(period_ns).saturating_sub(1);
        if other == number {
            return Some(earlier);
        }
        let later = until_ns.saturating_sub(it.first_ns).div_ceil(period_ns).saturating_sub(1);
        if other == first {
            return Some(if urgent_to_answer { earlier + later } else { earlier });
        }
        let is_ahead = self.members[first].frame.ahead.contains(&other);
        Some(match (in_step, urgent) {
            (true, true) => {
                let answers_it = it.frame.trigger.is_some_and(|trigger| trigger.by == number);
                earlier + u64::from(!answers_it) + later
            }
            (true, false) => earlier + u64::from(is_ahead),
            (false, true) => (longest_ns + until_ns).saturating_sub(it.first_ns).div_ceil(period_ns).max(1),
            (false, false) if is_ahead => (longest_ns + self.members[first].jitter_ns).div_ceil(period_ns).max(1),
            (false, false) => 0,
        })
    }

    /// The priority at which a frame waits: that of the least urgent which may stand before it.
    fn level(&self, number: usize, times: &Times) -> Option<u32> {
        let own = &self.members[number];
        let mut level = own.key;
        for (other, it) in self.members.iter().enumerate().filter(|(other, _)| self.queues(number, *other)) {
            let is_late = times[other]? > it.period_ns;
            if own.frame.ahead.contains(&other) || is_late {
                level = level.max(it.key);
            }
        }
        Some(level)
    }

    /// Both leave through one queue.
    fn queues(&self, one: usize, other: usize) -> bool {
        self.members[one].frame.ahead.contains(&other) || self.members[other].frame.ahead.contains(&one)
    }

    /// The longest frame that may have begun before one that waits at this priority.
    fn blocking_ns(&self, number: usize, level: u32) -> u64 {
        let others = self
            .members
            .iter()
            .enumerate()
            .filter(|(other, it)| it.key > level && *other != number && !self.queues(number, *other));
        others.map(|(_, it)| it.time_ns).max().unwrap_or_default()
    }
}
