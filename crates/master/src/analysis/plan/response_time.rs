//! How late a frame may come: worst-case response times on a bus that arbitrates by priority.
//!
//! The analysis of R. I. Davis, A. Burns, R. J. Bril and J. J. Lukkien, "Controller Area Network (CAN) schedulability analysis:
//! Refuted, revisited and revised", Real-Time Systems 35 (2007): all instances of a frame in its busy period are
//! looked at, not the first alone. Two things are added that CANopen and its hosts have:
//!
//! - Frames that leave through a queue in the order given ([`Queued::ahead`]), as from a computer: what stands before a frame
//!   has to win arbitration first, so that it waits at the priority of the least urgent of them. As Davis, Kollmann, Pollex and
//!   Slomka, "Controller Area Network (CAN) schedulability analysis with FIFO queues", 2011, with the frames ahead
//!   known by name in place of all of the queue.
//! - Frames that answer others ([`Trigger`](super::Trigger)): a TPDO comes after SYNC, as much later as its device takes.
//!
//! Where that finds a frame late, a second analysis counts what comes in step once (`in_step.rs`), and the smaller
//! bound is given.
//!
//! What is given is an upper bound for a bus without errors, or with one at most in each [`ErrorRate`].

use std::time::Duration;

use can::{Bitrate, Frame};

use super::in_step::InStep;
use super::queued::{HORIZON_NS, Queued, after, nanos, wire_ns};

/// How often the bus destroys a frame, at most: one in this time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorRate(pub Duration);

/// The bound of one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bound {
    /// Time on the wire with the most stuff bits, interframe space included.
    pub transmission: Duration,
    /// From the beginning of its period (of that of the frame which it answers) to its end on the wire, at most. `None`: there
    /// is no bound, because more urgent frames leave no room, or because it is not gone before the next one comes.
    pub worst: Option<Duration>,
}

/// An error flag with its echo, the delimiter and interframe space, and what an error-passive sender waits: bits lost by a
/// destroyed frame beside the frame.
const ERROR_BITS: u64 = 31;

/// Rounds in which triggers, queues and jitters settle. Each raises a bound or ends it.
const ROUNDS: usize = 200;

/// A frame in nanoseconds.
struct PeriodicFrame<'a> {
    key: u32,
    time_ns: u64,
    period_ns: u64,
    ahead: &'a [usize],
}

/// What is known of a frame so far. Both grow from round to round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Known {
    /// Jitter of its being offered, after that of what triggers it.
    jitter_ns: u64,
    /// Longest time in its sender's queue.
    queued_ns: u64,
    /// From being offered (without jitter) to the last bit.
    response_ns: Option<u64>,
}

/// The bounds of all frames of a bus, in their order.
pub fn response_times(frames: &[Queued], bitrate: Bitrate, errors: Option<ErrorRate>) -> Vec<Bound> {
    let bit_ns = bitrate.bit_nanos();
    let bus = LoadedBus {
        bit_ns,
        error_ns: errors.map(|ErrorRate(every)| nanos(every).max(1)),
        frames: frames.iter().map(|frame| PeriodicFrame::new(frame, bit_ns)).collect(),
    };
    let mut known = vec![Known { response_ns: Some(0), ..Known::default() }; frames.len()];
    let mut is_settled = false;
    for _ in 0..ROUNDS {
        let before = known.clone();
        for (number, frame) in frames.iter().enumerate() {
            known[number].jitter_ns = offered_late(frame, frames, &before, bit_ns);
        }
        for number in 0..frames.len() {
            let (response_ns, queued_ns) = match bus.response(number, &known) {
                Some((response_ns, queued_ns)) => (Some(response_ns), queued_ns),
                None => (None, HORIZON_NS),
            };
            (known[number].response_ns, known[number].queued_ns) = (response_ns, queued_ns);
        }
        is_settled = known == before;
        if is_settled {
            break;
        }
    }
    if !is_settled {
        // What still grows has no bound.
        known.iter_mut().for_each(|known| known.response_ns = None);
    }
    let settled = known.iter().zip(frames).map(|(known, frame)| {
        let begins_ns = frame.trigger.map_or(0, |trigger| after(&trigger, frames, bit_ns));
        let worst = known.response_ns.filter(|_| known.jitter_ns < HORIZON_NS);
        worst.map(|response_ns| begins_ns + response_ns)
    });
    let mut settled: Vec<Option<u64>> = settled.collect();
    let is_late =
        |(worst, sent): (&Option<u64>, &PeriodicFrame<'_>)| worst.is_none_or(|worst_ns| worst_ns > sent.period_ns);
    if settled.iter().zip(&bus.frames).any(is_late) && load(frames, bitrate) <= 1.0 {
        let in_step = InStep::new(frames, bit_ns, bus.error_ns, ERROR_BITS).longest();
        for (worst, in_step) in settled.iter_mut().zip(in_step) {
            *worst = [*worst, in_step].into_iter().flatten().min();
        }
    }
    let times = bus.frames.iter().map(|sent| Duration::from_nanos(sent.time_ns));
    let worst = settled.into_iter().map(|worst| worst.map(Duration::from_nanos));
    times.zip(worst).map(|(transmission, worst)| Bound { transmission, worst }).collect()
}

/// Share of its time that the bus is taken, with the most stuff bits: 1 is all of it.
pub fn load(frames: &[Queued], bitrate: Bitrate) -> f64 {
    let bit_ns = bitrate.bit_nanos();
    frames
        .iter()
        .map(|frame| PeriodicFrame::new(frame, bit_ns))
        .map(|sent| sent.time_ns as f64 / sent.period_ns as f64)
        .sum()
}

/// The jitter with which a frame is offered: its own, and that of its trigger's coming.
fn offered_late(frame: &Queued, frames: &[Queued], known: &[Known], bit_ns: u64) -> u64 {
    let own_ns = nanos(frame.jitter);
    let Some(trigger) = frame.trigger else { return own_ns };
    let Some(response_ns) = known[trigger.by].response_ns else { return HORIZON_NS };
    let latest_ns = response_ns + nanos(trigger.most);
    own_ns + latest_ns.saturating_sub(after(&trigger, frames, bit_ns))
}

impl<'a> PeriodicFrame<'a> {
    fn new(frame: &'a Queued, bit_ns: u64) -> Self {
        Self {
            key: Frame::new(frame.id, &[]).arbitration_key(),
            time_ns: wire_ns(frame, bit_ns),
            period_ns: nanos(frame.period).max(1),
            ahead: &frame.ahead,
        }
    }
}

struct LoadedBus<'a> {
    bit_ns: u64,
    error_ns: Option<u64>,
    frames: Vec<PeriodicFrame<'a>>,
}

impl LoadedBus<'_> {
    /// Longest time from a frame's being offered to its last bit, jitter included, and what of it is the wait; `None` if there
    /// is no bound.
    fn response(&self, number: usize, known: &[Known]) -> Option<(u64, u64)> {
        let own = &self.frames[number];
        if known[number].jitter_ns >= HORIZON_NS {
            return None;
        }
        // It waits with the least urgent of what stands before it.
        let level = own.ahead.iter().map(|other| self.frames[*other].key).fold(own.key, u32::max);
        // Of its own queue only what stands before it counts: the rest does not overtake.
        let queues = |other: usize| own.ahead.contains(&other) || self.frames[other].ahead.contains(&number);
        let is_own = |other: usize| other == number || queues(other);
        let others = || self.frames.iter().enumerate().filter(|(other, _)| !is_own(*other));
        let urgent: Vec<(u64, u64, u64)> = others()
            .filter(|(_, frame)| frame.key <= level)
            .map(|(other, frame)| (frame.time_ns, frame.period_ns, known[other].jitter_ns + known[other].queued_ns))
            .collect();
        if urgent.iter().any(|(.., late_ns)| *late_ns >= HORIZON_NS) {
            return None;
        }
        let blocking_ns = others().filter(|(_, frame)| frame.key > level).map(|(_, frame)| frame.time_ns).max();
        let work = UrgentLoad {
            bit_ns: self.bit_ns,
            urgent: &urgent,
            error: self.error_ns.map(|every_ns| {
                let longest_ns = urgent.iter().map(|(time_ns, ..)| *time_ns).chain([own.time_ns]).max();
                (every_ns, ERROR_BITS * self.bit_ns + longest_ns.unwrap_or_default())
            }),
        };
        let late_ns = known[number].jitter_ns;
        if own.ahead.is_empty() {
            let wait_ns = work.longest_wait(own, late_ns, blocking_ns.unwrap_or_default())?;
            return Some((late_ns + wait_ns + own.time_ns, 0));
        }
        // The queue has to be empty before the next batch comes, so that one instance stands for all. A batch before it
        // may have held up more urgent frames as a less urgent one would.
        let ahead = || own.ahead.iter().map(|other| &self.frames[*other]);
        let pushed_ns = ahead().map(|frame| frame.time_ns).chain([own.time_ns]).max().unwrap_or_default();
        let first_ns = blocking_ns.unwrap_or_default().max(pushed_ns) + ahead().map(|frame| frame.time_ns).sum::<u64>();
        let wait_ns = work.settle(first_ns, first_ns)?;
        let response_ns = late_ns + wait_ns + own.time_ns;
        let shortest_ns = ahead().map(|frame| frame.period_ns).fold(own.period_ns, u64::min);
        (response_ns <= shortest_ns).then_some((response_ns, wait_ns))
    }
}

/// What more urgent frames and errors take of a time.
struct UrgentLoad<'a> {
    bit_ns: u64,
    /// Time on the wire, period, jitter.
    urgent: &'a [(u64, u64, u64)],
    /// One in this time, and what it costs.
    error: Option<(u64, u64)>,
}

impl UrgentLoad<'_> {
    fn taken_ns(&self, within_ns: u64) -> u64 {
        let urgent = self.urgent.iter().map(|(time_ns, period_ns, late_ns)| {
            (within_ns + late_ns + self.bit_ns).div_ceil(*period_ns).saturating_mul(*time_ns)
        });
        urgent.fold(self.errors_ns(within_ns), u64::saturating_add)
    }

    /// What errors take of a time.
    fn errors_ns(&self, within_ns: u64) -> u64 {
        self.error.map_or(0, |(every_ns, cost_ns)| within_ns.div_ceil(every_ns).saturating_mul(cost_ns))
    }

    /// The least wait of at least `from_ns` in which `own_ns` and what is more urgent fit.
    fn settle(&self, own_ns: u64, from_ns: u64) -> Option<u64> {
        let mut wait_ns = from_ns;
        loop {
            let next_ns = own_ns.saturating_add(self.taken_ns(wait_ns));
            if next_ns <= wait_ns {
                return Some(wait_ns);
            }
            if next_ns >= HORIZON_NS {
                return None;
            }
            wait_ns = next_ns;
        }
    }

    /// The longest wait of any instance in the busy period, each counted from its own being offered, its jitter left out.
    fn longest_wait(&self, own: &PeriodicFrame<'_>, late_ns: u64, blocking_ns: u64) -> Option<u64> {
        let busy_ns = self.busy(own, late_ns, blocking_ns)?;
        let mut longest_ns = 0;
        let mut from_ns = 0;
        for instance in 0..(busy_ns + late_ns).div_ceil(own.period_ns) {
            let own_ns = blocking_ns + instance * own.time_ns;
            let wait_ns = self.settle(own_ns, from_ns.max(own_ns))?;
            longest_ns = longest_ns.max(wait_ns.saturating_sub(instance * own.period_ns));
            from_ns = wait_ns + own.time_ns;
        }
        Some(longest_ns)
    }

    /// How long the bus may go on with frames that are no less urgent than this one.
    fn busy(&self, own: &PeriodicFrame<'_>, late_ns: u64, blocking_ns: u64) -> Option<u64> {
        let mut busy_ns = own.time_ns;
        loop {
            let own_ns = (busy_ns + late_ns).div_ceil(own.period_ns).saturating_mul(own.time_ns);
            let urgent = self
                .urgent
                .iter()
                .map(|(time_ns, period_ns, late_ns)| (busy_ns + late_ns).div_ceil(*period_ns).saturating_mul(*time_ns));
            let next_ns = urgent.fold(blocking_ns + own_ns + self.errors_ns(busy_ns), u64::saturating_add);
            if next_ns <= busy_ns {
                return Some(busy_ns);
            }
            if next_ns >= HORIZON_NS {
                return None;
            }
            busy_ns = next_ns;
        }
    }
}

#[cfg(test)]
mod tests {
    use can::CanId;

    use super::*;
    use crate::plan::Trigger;

    fn frame(id: u16, length: u8, period_us: u64) -> Queued {
        let period = Duration::from_micros(period_us);
        Queued {
            id: CanId::standard(id),
            length,
            period,
            jitter: Duration::ZERO,
            ahead: vec![],
            with: None,
            trigger: None,
        }
    }

    fn worst_us(frames: &[Queued], bitrate: Bitrate) -> Vec<Option<u128>> {
        response_times(frames, bitrate, None).iter().map(|bound| bound.worst.map(|worst| worst.as_micros())).collect()
    }

    /// The example of Davis et al.: frames of 125 bits at 125 kbit/s. The third misses its deadline of 3.25 ms with its
    /// second instance, which the analysis before 2007 did not see.
    #[test]
    fn the_paper_s_example_is_refuted_and_revised() {
        let frames = [frame(1, 7, 2_500), frame(2, 7, 3_500), frame(3, 7, 3_500)];
        assert_eq!(worst_us(&frames, Bitrate::K125), [Some(2_000), Some(3_000), Some(3_500)]);
    }

    /// Four frames of one period, by hand: each waits for one less urgent frame and for the more urgent ones.
    #[test]
    fn frames_of_one_period_follow_each_other() {
        let frames =
            [frame(0x80, 0, 10_000), frame(0x181, 8, 10_000), frame(0x182, 8, 10_000), frame(0x701, 1, 10_000)];
        // 55 + 10 s bits: 55, 135, 135, 65.
        assert_eq!(
            worst_us(&frames, Bitrate::M1),
            [Some(135 + 55), Some(135 + 55 + 135), Some(65 + 55 + 135 + 135), Some(55 + 135 + 135 + 65)]
        );
    }

    #[test]
    fn a_bus_that_is_too_full_has_no_bound_from_where_it_is_full() {
        let frames = [frame(0x100, 8, 270), frame(0x101, 8, 280), frame(0x102, 8, 1_000)];
        let worst = worst_us(&frames, Bitrate::M1);
        assert!(worst[0].is_some() && worst[1].is_some() && worst[2].is_none(), "{worst:?}");
        assert!(load(&frames, Bitrate::M1) > 1.0);
    }

    #[test]
    fn what_stands_before_a_frame_in_a_queue_counts_whatever_its_priority() {
        // SYNC behind an SDO request: it waits for the TPDO too, which is less urgent than SYNC and more than the request.
        let mut frames = vec![frame(0x80, 0, 10_000), frame(0x601, 8, 10_000), frame(0x181, 8, 10_000)];
        assert_eq!(worst_us(&frames, Bitrate::M1)[0], Some(135 + 55));
        frames[0].ahead = vec![1];
        // Blocked once (135), the request (135), the TPDO (135), itself (55).
        assert_eq!(worst_us(&frames, Bitrate::M1)[0], Some(3 * 135 + 55));
        // What comes behind SYNC in the queue does not hold it up, whatever its priority.
        let set_point = Queued { ahead: vec![0, 1], ..frame(0x10, 8, 10_000) };
        frames.push(set_point);
        frames[1].ahead = vec![0, 3];
        assert_eq!(worst_us(&frames, Bitrate::M1)[0], Some(3 * 135 + 55));
        frames.pop();
        frames[1].ahead = vec![];
        // And the TPDO may find SYNC late, and so twice in a time that is short: its bound does not fall.
        frames[0].period = Duration::from_micros(590);
        let late = worst_us(&frames, Bitrate::M1);
        assert_eq!(late[2], Some(135 + 2 * 55 + 135));
    }

    #[test]
    fn an_answer_counts_from_its_trigger_and_has_its_jitter() {
        let mut frames = vec![frame(0x80, 0, 10_000), frame(0x181, 8, 10_000)];
        let (least, most) = (Duration::from_micros(100), Duration::from_micros(400));
        frames[1].trigger = Some(Trigger { by: 0, least, most });
        // SYNC: 135 blocked and 55. Then 400 at most, and the TPDO: a SYNC of the next period may be in its way.
        assert_eq!(worst_us(&frames, Bitrate::M1), [Some(190), Some(190 + 400 + 55 + 135)]);
    }

    #[test]
    fn a_frame_that_is_late_may_come_twice_in_a_short_time() {
        // Every 1000 us, up to 900 late: one at the end of its lateness, the next one 100 us after it.
        let mut frames = [frame(0x100, 8, 1_000), frame(0x101, 8, 10_000)];
        assert_eq!(worst_us(&frames, Bitrate::M1), [Some(2 * 135), Some(2 * 135)]);
        frames[0].jitter = Duration::from_micros(900);
        assert_eq!(worst_us(&frames, Bitrate::M1), [Some(900 + 2 * 135), Some(3 * 135)]);
    }

    #[test]
    fn an_error_costs_its_frame_again() {
        let frames = [frame(0x80, 0, 10_000), frame(0x181, 8, 10_000)];
        let bounds = response_times(&frames, Bitrate::M1, Some(ErrorRate(Duration::from_millis(5))));
        // Blocked 135, an error with the longest frame that counts here (31 + 55), itself.
        assert_eq!(bounds[0].worst, Some(Duration::from_micros(135 + 31 + 55 + 55)));
    }
}
