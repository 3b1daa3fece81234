//! How long a node's answers take, and how evenly SYNC comes, from the frames alone.
//!
//! A [`Meter`] is given every frame on the bus, with its time, and gives [`Sample`]s: from an SDO request to its
//! answer (CiA 301, 7.2.4), from a SYNC to each synchronous TPDO that it brings (7.2.5.3), and from one SYNC to the next. It sends
//! nothing, reads no clock, and keeps nothing but the last frame of each kind. On a simulated wire a frame's time is the end
//! of its last bit; on a real bus that of handing it to the connection or of getting it from there.

use std::collections::VecDeque;
use std::time::Duration;

use can::{CanId, Frame, Instant};
use canopen::{NodeId, connection_set};

/// First byte of an abort (CiA 301, 7.2.4.3.17).
const SDO_ABORT: u8 = 0x80;

/// One measured time, or an answer that did not come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// From one SYNC to the next.
    SyncPeriod(Duration),
    /// From an SDO request to the node's answer.
    Sdo(Duration),
    /// A request was followed by another one, or by the client's abort, before it was answered.
    SdoLost,
    /// From a SYNC to a synchronous TPDO.
    Pdo(Duration),
    /// A TPDO did not come with the SYNC that was due to bring it.
    PdoLost,
}

/// A synchronous TPDO that is waited for.
#[derive(Clone, Copy, Debug)]
struct Watched {
    id: CanId,
    /// Comes with every so many SYNCs.
    every: u8,
    /// SYNCs since it came; `None` before it came for the first time.
    since: Option<u8>,
}

/// See the [module](self).
#[derive(Clone, Debug)]
pub struct Meter {
    node: Option<NodeId>,
    watched: Vec<Watched>,
    sync: Option<Instant>,
    request: Option<Instant>,
    samples: VecDeque<Sample>,
}

/// Samples that wait to be fetched; beyond these the oldest give way. A frame makes as many as there are TPDOs.
const MAX_SAMPLES: usize = 4096;

impl Meter {
    /// Measures the period of SYNC, and what `node` answers.
    pub fn new(node: Option<NodeId>) -> Self {
        Self { node, watched: Vec::new(), sync: None, request: None, samples: VecDeque::new() }
    }

    /// Waits for a TPDO that comes with every `every`-th SYNC, 1 to 240 as in sub-index 2 of its communication parameter. The
    /// first one only starts the count: which SYNC brings it is the device's choice.
    pub fn watch_tpdo(&mut self, id: CanId, every: u8) {
        self.watched.push(Watched { id, every: every.max(1), since: None });
    }

    /// Forgets the SYNC and the request that came last: a pause in the measurement is not a sample.
    pub fn pause(&mut self) {
        (self.sync, self.request) = (None, None);
        self.watched.iter_mut().for_each(|watched| watched.since = None);
    }

    /// A frame passed: ours or another participant's.
    pub fn handle_frame(&mut self, frame: &Frame, at: Instant) {
        if self.node.is_some_and(|node| frame.id() == connection_set::sdo_request(node)) {
            if self.request.take().is_some() {
                self.note(Sample::SdoLost);
            }
            // A client that has waited long enough aborts; an abort has no answer.
            self.request = (frame.data().first() != Some(&SDO_ABORT)).then_some(at);
        } else if self.node.is_some_and(|node| frame.id() == connection_set::sdo_reply(node)) {
            if let Some(request) = self.request.take() {
                self.note(Sample::Sdo(at - request));
            }
        } else if let Some(place) = self.watched.iter().position(|watched| watched.id == frame.id()) {
            let first = self.watched[place].since.replace(0).is_none();
            if let Some(sync) = self.sync.filter(|_| !first) {
                self.note(Sample::Pdo(at - sync));
            }
        } else {
            self.synchronise(frame, at);
        }
    }

    /// The next time that was measured; `None` when there is none yet.
    pub fn poll_sample(&mut self) -> Option<Sample> {
        self.samples.pop_front()
    }

    fn synchronise(&mut self, frame: &Frame, at: Instant) {
        if frame.id() != connection_set::SYNC || frame.is_remote() {
            return;
        }
        if let Some(before) = self.sync.replace(at) {
            self.note(Sample::SyncPeriod(at - before));
        }
        for place in 0..self.watched.len() {
            let Watched { every, since: Some(since), .. } = &mut self.watched[place] else { continue };
            if since == every {
                // Counted on from the SYNC that should have brought it.
                *since = 1;
                self.note(Sample::PdoLost);
            } else {
                *since += 1;
            }
        }
    }

    fn note(&mut self, sample: Sample) {
        if self.samples.len() == MAX_SAMPLES {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: NodeId = NodeId::new(4).expect("4 is a node-ID");

    /// A conversation: `>` sent, `<` heard, the time in µs, the frame; the samples.
    fn measured(meter: &mut Meter, lines: &[(char, u64, &str)]) -> Vec<Sample> {
        for (_, micros, frame) in lines {
            let (frame, at): (Frame, _) = (frame.parse().unwrap(), Instant::from_micros(*micros));
            meter.handle_frame(&frame, at);
        }
        std::iter::from_fn(|| meter.poll_sample()).collect()
    }

    const fn micros(count: u64) -> Duration {
        Duration::from_micros(count)
    }

    #[test]
    fn an_answer_is_measured_from_its_request_and_a_missing_one_is_counted() {
        let mut meter = Meter::new(Some(NODE));
        let found = measured(
            &mut meter,
            &[
                ('>', 100, "604#4000100000000000"),
                ('<', 150, "585#4300100000000000"), // another node's
                ('<', 1_300, "584#4300100092010200"),
                ('<', 1_400, "584#4300100092010200"), // without a request
                ('>', 2_000, "604#4000100000000000"),
                ('>', 3_000, "604#4000100000000000"),
                ('>', 8_000, "604#8000100000000405"),
                ('>', 9_000, "604#4000100000000000"),
                ('<', 9_250, "584#4300100092010200"),
            ],
        );
        assert_eq!(found, [Sample::Sdo(micros(1_200)), Sample::SdoLost, Sample::SdoLost, Sample::Sdo(micros(250))]);
    }

    #[test]
    fn periods_of_sync_are_measured_for_any_producer() {
        let mut meter = Meter::new(None);
        let found = measured(&mut meter, &[('>', 0, "080#"), ('>', 10_020, "080#"), ('<', 19_990, "080#01")]);
        assert_eq!(found, [Sample::SyncPeriod(micros(10_020)), Sample::SyncPeriod(micros(9_970))]);
        meter.pause();
        assert_eq!(measured(&mut meter, &[('>', 90_000, "080#")]), []);
    }

    #[test]
    fn a_tpdo_is_measured_from_its_sync_and_missed_when_its_turn_has_passed() {
        let mut meter = Meter::new(Some(NODE));
        meter.watch_tpdo(CanId::standard(0x184), 1);
        meter.watch_tpdo(CanId::standard(0x284), 2);
        let found = measured(
            &mut meter,
            &[
                ('>', 0, "080#"),
                ('<', 300, "184#00"),
                ('<', 400, "284#00"), // each for the first time
                ('>', 10_000, "080#"),
                ('<', 10_350, "184#00"),
                ('>', 20_000, "080#"),
                ('<', 20_500, "284#00"), // 184 did not come
                ('>', 30_000, "080#"),
                ('<', 30_250, "184#00"),
            ],
        );
        let times: Vec<_> = found.iter().filter(|sample| !matches!(sample, Sample::SyncPeriod(_))).copied().collect();
        let expected = [Sample::Pdo(micros(350)), Sample::Pdo(micros(500)), Sample::PdoLost, Sample::Pdo(micros(250))];
        assert_eq!(times, expected);
    }

    #[test]
    fn samples_that_are_not_fetched_are_bounded() {
        let mut meter = Meter::new(None);
        let sync: Frame = "080#".parse().unwrap();
        for cycle in 0..10_000 {
            meter.handle_frame(&sync, Instant::from_millis(cycle));
        }
        assert_eq!(std::iter::from_fn(|| meter.poll_sample()).count(), MAX_SAMPLES);
    }
}
