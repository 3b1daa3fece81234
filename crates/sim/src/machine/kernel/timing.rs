//! The time that a device takes for itself, between the bus and its firmware: to start, to act on a frame, to store.
//!
//! A firmware here acts on a frame in the instant in which it comes. A real one is busy: a frame waits in the controller's
//! mailboxes until the task that looks after it runs. So frames wait here, requests and process data each in their order,
//! and the answers go out when the firmware has had them. The times are the description's ([`devices::Timing`]), drawn anew
//! each time from the machine's own seed.

use std::collections::VecDeque;

use can::{Frame, Instant};
use canopen::connection_set::SDO_REQUEST_BASE;
use devices::{Span, Timing};
use drives::engine::device::ResetTimes;

use super::chip::Chip;
use crate::Prng;
use crate::nmt_reset::is_sdo_answer;

/// Whether devices take the time that such devices take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TimingMode {
    /// No time at all: for tests of logic, and for what is compared with figures of the standard.
    #[default]
    Ideal,
    /// The times of the description, each with its seeded jitter.
    Device,
}

impl std::str::FromStr for TimingMode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "ideal" => Ok(Self::Ideal),
            "device" => Ok(Self::Device),
            _ => Err(format!("expected device or ideal, not {text:?}")),
        }
    }
}

/// Frames that may wait: the mailboxes of a CAN controller. What comes beyond that is lost, as on a real device.
const MAILBOXES: usize = 16;

/// Frames on their way to a firmware, and its memory chip.
#[derive(Clone, Debug)]
pub(crate) struct OwnTime {
    timing: Timing,
    prng: Prng,
    waiting: VecDeque<WaitingFrame>,
    /// The server has agreed to an SDO download in blocks: segments come as fast as the bus carries them, and a device that offers
    /// that takes them where they come in.
    takes_segments: bool,
    pub(crate) chip: Chip,
}

#[derive(Clone, Copy, Debug)]
struct WaitingFrame {
    frame: Frame,
    kind: MailboxKind,
    due: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MailboxKind {
    /// To the SDO server.
    Request,
    /// RPDO, SYNC, and whatever else is not handled by the operating system.
    Process,
    /// NMT, heartbeats of others: what the controller's interrupt looks after.
    Management,
}

impl OwnTime {
    /// Nothing waits; the chip holds `image`.
    pub(crate) fn new(timing: Timing, seed: u64, image: &[u8], generation: u64) -> Self {
        let chip = Chip::new(image, generation);
        Self { timing, prng: Prng::new(seed), waiting: VecDeque::new(), takes_segments: false, chip }
    }

    /// How long this boot takes.
    pub(crate) fn boot_ns(&mut self) -> u64 {
        let boot = self.timing.boot;
        self.draw(&boot)
    }

    /// How long the next resets take.
    pub(crate) fn reset_times(&mut self) -> ResetTimes {
        let Timing { reset_node, reset_communication, .. } = self.timing;
        ResetTimes { node_ns: self.draw(&reset_node), communication_ns: self.draw(&reset_communication) }
    }

    /// How long this store takes.
    fn store_ns(&mut self) -> u64 {
        let store = self.timing.store;
        self.draw(&store)
    }

    /// A frame has come; the firmware gets it now, or it waits.
    pub(crate) fn take_in(&mut self, frame: &Frame, now: Instant) -> Option<Frame> {
        let kind = kind(frame);
        let span = match kind {
            MailboxKind::Management => return Some(*frame),
            MailboxKind::Request if self.takes_segments => return Some(*frame),
            MailboxKind::Request => self.timing.sdo_answer,
            MailboxKind::Process => self.timing.pdo_reaction,
        };
        let due = now.plus_nanos(self.draw(&span));
        // What came first is taken first, however the dice fall; and a request when the answer to the one before is out.
        let pause_ns = if kind == MailboxKind::Request { u64::from(span.least_us) * 1_000 } else { 0 };
        let before = self.waiting.iter().filter(|other| other.kind == kind).map(|other| other.due).max();
        let due = before.map_or(due, |before| before.plus_nanos(pause_ns).max(due));
        if self.waiting.len() < MAILBOXES {
            self.waiting.push_back(WaitingFrame { frame: *frame, kind, due });
        }
        None
    }

    /// The frame that the firmware gets at `now` or should have had before.
    pub(crate) fn take_out(&mut self, now: Instant) -> Option<Frame> {
        let next = self.next()?;
        if next.1 > now {
            return None;
        }
        self.waiting.remove(next.0).map(|waiting| waiting.frame)
    }

    /// The next frame that may go out: [`Chip::next_frame`].
    pub(crate) fn next_frame(&mut self, needed: u64, poll: impl FnMut() -> Option<Frame>) -> Option<Frame> {
        let frame = self.chip.next_frame(needed, poll)?;
        if is_sdo_answer(&frame) {
            self.takes_segments = match *frame.padded() {
                [0xA0 | 0xA4, ..] => true,
                // A confirmation of a block.
                [0xA2, ..] => self.takes_segments,
                _ => false,
            };
        }
        Some(frame)
    }

    /// When a frame or the chip is due.
    pub(crate) fn next_due(&self) -> Option<Instant> {
        let frame = self.next().map(|(_, due)| due);
        frame.into_iter().chain(self.chip.next_due()).min()
    }

    /// The firmware has stored: the chip takes its time for it.
    pub(crate) fn store(&mut self, image: &[u8], generation: u64, now: Instant) {
        if self.chip.is_new(generation) {
            let takes_ns = self.store_ns();
            self.chip.write(image, generation, takes_ns, now);
        }
    }

    /// The supply is gone, and with it what waited.
    pub(crate) fn power_off(&mut self) {
        self.waiting.clear();
        self.takes_segments = false;
    }

    /// The first due, among equals the one that came first.
    fn next(&self) -> Option<(usize, Instant)> {
        let dues = self.waiting.iter().enumerate().map(|(place, waiting)| (place, waiting.due));
        dues.min_by_key(|(place, due)| (*due, *place))
    }

    fn draw(&mut self, span: &Span) -> u64 {
        let (least_ns, most_ns) = (u64::from(span.least_us) * 1_000, u64::from(span.most_us) * 1_000);
        least_ns + self.prng.below(most_ns.saturating_sub(least_ns) + 1)
    }
}

/// By the predefined connection set (CiA 301, 7.3.5).
fn kind(frame: &Frame) -> MailboxKind {
    let id = frame.id();
    if id.is_extended() {
        return MailboxKind::Process;
    }
    match id.raw() {
        0 | 0x700.. => MailboxKind::Management,
        raw if raw & !0x7F == u32::from(SDO_REQUEST_BASE) => MailboxKind::Request,
        _ => MailboxKind::Process,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIXED: Timing = Timing { sdo_answer: Span::new(900, 1_100, ""), ..Timing::GUESSED };

    fn own(seed: u64) -> OwnTime {
        OwnTime::new(FIXED, seed, &[], 0)
    }

    fn frame(text: &str) -> Frame {
        text.parse().unwrap()
    }

    #[test]
    fn requests_keep_their_order_and_process_data_overtakes_them() {
        for seed in 0..100 {
            let mut own = own(seed);
            assert_eq!(own.take_in(&frame("000#0104"), Instant::ZERO), Some(frame("000#0104")));
            for number in 0..4 {
                let at = Instant::ZERO.plus_nanos(number * 10_000);
                assert_eq!(own.take_in(&frame(&format!("604#400{number}600000000000")), at), None);
            }
            assert_eq!(own.take_in(&frame("204#0F00"), Instant::ZERO.plus_nanos(50_000)), None);
            let mut order = Vec::new();
            while let Some(due) = own.next_due() {
                assert_eq!(own.take_out(Instant::from_nanos(due.as_nanos() - 1)), None);
                order.push((own.take_out(due).unwrap().to_string(), due.as_nanos()));
            }
            let names: Vec<&str> = order.iter().map(|(text, _)| &text[..6]).collect();
            assert_eq!(names, ["204#0F", "604#40", "604#40", "604#40", "604#40"]);
            assert!(order.is_sorted_by_key(|(text, due)| (*due, text.clone())), "{order:?}");
            assert!((150_000..=450_000).contains(&order[0].1), "{order:?}");
            assert!((900_000..=1_100_000).contains(&order[1].1), "{order:?}");
            let gaps: Vec<u64> = order[1..].windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
            assert!(gaps.iter().all(|gap| *gap >= 900_000), "{order:?}");
        }
    }

    #[test]
    fn more_frames_than_there_are_mailboxes_for_are_lost() {
        let mut own = own(1);
        (0..1000).for_each(|_| assert_eq!(own.take_in(&frame("604#4000600000000000"), Instant::ZERO), None));
        assert_eq!(std::iter::from_fn(|| own.take_out(Instant::from_secs(1))).count(), MAILBOXES);
    }

    #[test]
    fn a_seed_gives_the_same_times_again_and_another_gives_others() {
        let times = |seed| {
            let mut own = own(seed);
            (own.boot_ns(), own.reset_times(), own.store_ns())
        };
        assert_eq!(times(1), times(1));
        assert_ne!(times(1), times(2));
        for seed in 0..1000 {
            let (boot_ns, resets, store_ns) = times(seed);
            assert!((800_000_000..=1_200_000_000).contains(&boot_ns));
            assert!((400_000_000..=600_000_000).contains(&resets.node_ns));
            assert!((10_000_000..=30_000_000).contains(&resets.communication_ns));
            assert!((5_000_000..=15_000_000).contains(&store_ns));
        }
    }

    #[test]
    fn segments_of_a_download_in_blocks_are_taken_where_they_come_in() {
        let mut own = own(1);
        let sends = |own: &mut OwnTime, text: &str| {
            let mut frames = [frame(text)].into_iter();
            own.next_frame(0, || frames.next());
        };
        let now = Instant::ZERO;
        assert_eq!(own.take_in(&frame("604#C609200000010000"), now), None);
        sends(&mut own, "584#A40920007F000000");
        for number in 1..=100 {
            let segment = frame(&format!("604#{number:02X}01020304050607"));
            assert_eq!(own.take_in(&segment, now), Some(segment));
        }
        sends(&mut own, "584#A2647F0000000000");
        assert!(own.take_in(&frame("604#C112340000000000"), now).is_some());
        sends(&mut own, "584#A100000000000000");
        assert_eq!(own.take_in(&frame("604#4041600000000000"), now), None);
    }
}
