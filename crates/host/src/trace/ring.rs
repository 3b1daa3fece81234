//! The ring buffer of frames, and the snapshot of a reader.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use can::{Frame, Instant};
use canopen::sdo::wire::Reply;
use canopen::{Mux, NodeId, connection_set};
use devices::Description;
use master::Models;
use master::decode::{Decoded, Decoder};

use super::origin::Origin;
use can::BusFrame;

/// Least number of kept frames: about seven minutes of a bus with three drives, half a minute of a full one at 1 Mbit/s.
pub(super) const KEPT: usize = 200_000;

/// Frames of a chunk: few enough to skip those before a wanted one quickly, many enough that a decoder for each
/// chunk is small beside them.
pub(super) const CHUNK: usize = 4_000;

/// Most chunks: each model that is found starts a chunk, however often that happens.
const MOST_CHUNKS: usize = 2 * KEPT / CHUNK;

/// The frames of a bus, numbered from 0 in their order.
#[derive(Debug)]
pub struct Trace {
    ring: Mutex<Ring>,
    origin: Origin,
    logs_saved: AtomicU64,
}

#[derive(Debug)]
struct Ring {
    chunks: VecDeque<Chunk>,
    held: usize,
    next: u64,
    /// The decoder, which has learned from the frames so far.
    decoder: Decoder,
    models: BTreeMap<NodeId, &'static Description>,
    /// The models among which nodes are identified.
    known: Models,
}

/// Consecutive frames.
#[derive(Clone, Debug)]
pub(super) struct Chunk {
    /// Number of the first one.
    first: u64,
    /// The decoder before the first one.
    before: Arc<Decoder>,
    frames: Arc<Vec<BusFrame>>,
}

impl Trace {
    /// Notes that the frames kept here were saved as a log once more.
    pub fn note_saved(&self) {
        self.logs_saved.fetch_add(1, Ordering::Relaxed);
    }

    /// How often the frames kept here were saved as a log.
    pub fn logs_saved(&self) -> u64 {
        self.logs_saved.load(Ordering::Relaxed)
    }

    /// A trace that identifies nodes among these models.
    pub fn new(models: Models, origin: Origin) -> Self {
        let decoder = Decoder::knowing(models.clone());
        let (chunks, nodes) = (VecDeque::new(), BTreeMap::new());
        let ring = Ring { chunks, held: 0, next: 0, decoder, models: nodes, known: models };
        Self { ring: Mutex::new(ring), origin, logs_saved: AtomicU64::new(0) }
    }

    /// Adds a frame; times must not go back.
    pub fn append(&self, passed: BusFrame) {
        self.lock().append(passed);
    }

    /// Decodes this node by its model, from the next frame on.
    pub fn set_model(&self, node: NodeId, model: &'static Description) {
        let mut ring = self.lock();
        // Setting it again would reset the learned mappings to the defaults.
        if ring.models.get(&node).is_some_and(|known| core::ptr::eq(*known, model)) {
            return;
        }
        ring.models.insert(node, model);
        ring.decoder.set_model(node, model);
        ring.begin_chunk();
    }

    /// The model of a node, where it is known.
    pub fn model(&self, node: NodeId) -> Option<&'static Description> {
        self.lock().models.get(&node).copied()
    }

    /// A decoder that has seen no frame, and knows the models of this bus's nodes.
    pub fn fresh_decoder(&self) -> Decoder {
        let ring = self.lock();
        let mut decoder = Decoder::knowing(ring.known.clone());
        ring.models.iter().for_each(|(node, model)| decoder.set_model(*node, model));
        decoder
    }

    /// A trace of the frames of a log of another time, decoded by the models of this bus's nodes. A frame whose time is before that of
    /// the one before it has the time of that.
    pub fn of_log(&self, frames: impl IntoIterator<Item = (Instant, Frame)>) -> Self {
        let (known, models) = {
            let ring = self.lock();
            (ring.known.clone(), ring.models.clone())
        };
        let trace = Self::new(known, Origin::default());
        models.into_iter().for_each(|(node, model)| trace.set_model(node, model));
        let mut newest = Instant::ZERO;
        for (at, frame) in frames {
            newest = newest.max(at);
            trace.append(BusFrame { at: newest, frame, own: false });
        }
        trace
    }

    /// What a frame would mean after those that have passed.
    pub(crate) fn meaning(&self, frame: &Frame) -> Decoded {
        let mut decoder = self.lock().decoder.clone();
        decoder.decode(frame)
    }

    /// The number of the next frame.
    pub fn next(&self) -> u64 {
        self.lock().next
    }

    /// Visits the kept frames of others from this number on; the number of the next one.
    pub fn others_from(&self, number: u64, each: impl FnMut(&BusFrame)) -> u64 {
        let held = self.held();
        let new = |chunk: &Chunk| usize::try_from(number.saturating_sub(chunk.first)).unwrap_or(usize::MAX);
        let frames = held.chunks.iter().flat_map(|chunk| chunk.frames.iter().skip(new(chunk)));
        frames.filter(|passed| !passed.own).for_each(each);
        held.next
    }

    /// A snapshot of the kept frames, unaffected by further ones.
    pub fn held(&self) -> Held {
        let ring = self.lock();
        Held { chunks: ring.chunks.iter().cloned().collect(), next: ring.next }
    }

    /// The contents of a log besides frames.
    pub const fn origin(&self) -> &Origin {
        &self.origin
    }

    fn lock(&self) -> MutexGuard<'_, Ring> {
        // Frames are added whole: a panic elsewhere leaves the ring consistent.
        self.ring.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Ring {
    fn append(&mut self, passed: BusFrame) {
        if self.chunks.back().is_none_or(|chunk| chunk.frames.len() == CHUNK) {
            self.begin_chunk();
        }
        self.decoder.pass(&passed.frame);
        if let Some(chunk) = self.chunks.back_mut() {
            // Copied only if a reader holds it now.
            Arc::make_mut(&mut chunk.frames).push(passed);
            self.held += 1;
            self.next += 1;
        }
    }

    fn begin_chunk(&mut self) {
        // Only the newest is ever empty.
        if self.chunks.back().is_some_and(|newest| newest.frames.is_empty()) {
            self.chunks.pop_back();
        }
        while let Some(oldest) = self.chunks.front()
            && (self.held - oldest.frames.len() >= KEPT || self.chunks.len() == MOST_CHUNKS)
        {
            self.held -= oldest.frames.len();
            self.chunks.pop_front();
        }
        let before = Arc::new(self.decoder.clone());
        self.chunks.push_back(Chunk { first: self.next, before, frames: Arc::default() });
    }
}

/// A snapshot of the kept frames.
#[derive(Clone, Debug)]
pub struct Held {
    chunks: Vec<Chunk>,
    next: u64,
}

impl Held {
    /// Number of the oldest frame; that of the next one if there is none.
    pub fn oldest(&self) -> u64 {
        self.chunks.first().map_or(self.next, |chunk| chunk.first)
    }

    /// Number of the next frame.
    pub const fn next(&self) -> u64 {
        self.next
    }

    /// Number of the first frame at or after a time.
    pub(super) fn number_at(&self, at: Instant) -> u64 {
        let chunk = self.chunks.partition_point(|chunk| chunk.frames.first().is_some_and(|passed| passed.at < at));
        // It may be in the previous chunk, after its first frame.
        let Some(before) = chunk.checked_sub(1).map(|place| &self.chunks[place]) else { return self.oldest() };
        before.first + before.frames.partition_point(|passed| passed.at < at) as u64
    }

    /// When a node last sent the value of an object by SDO, within the second up to a time.
    pub fn answered_at(&self, node: NodeId, object: Mux, until: Instant) -> Option<Instant> {
        /// Longer than the reading period of a drive.
        const SECOND: u64 = 1_000_000_000;
        let id = connection_set::sdo_reply(node);
        let said = |passed: &&BusFrame| {
            let reply = Reply::parse(passed.frame.padded());
            passed.frame.id() == id && matches!(reply, Reply::InitiateUpload(of, _) if of == object)
        };
        let newest = self.chunks.iter().rev().flat_map(|chunk| chunk.frames.iter().rev());
        let before = newest.skip_while(|passed| passed.at > until);
        let mut recent = before.take_while(|passed| until.nanos_since(passed.at) < SECOND);
        recent.find(said).map(|passed| passed.at)
    }

    /// Number of the first frame in the chunk of this one.
    pub(super) fn chunk_start(&self, number: u64) -> u64 {
        self.overlapping(number, number + 1).next().map_or(number, |chunk| chunk.first)
    }

    /// Visits each frame with a number from `from` to below `to`, decoded.
    pub(super) fn decode(&self, from: u64, to: u64, mut each: impl FnMut(u64, &BusFrame, &Decoded)) {
        for chunk in self.overlapping(from, to) {
            let mut decoder = (*chunk.before).clone();
            for (number, passed) in (chunk.first..to).zip(chunk.frames.iter()) {
                if number < from {
                    decoder.pass(&passed.frame);
                } else {
                    each(number, passed, &decoder.decode(&passed.frame));
                }
            }
        }
    }

    fn overlapping(&self, from: u64, to: u64) -> impl Iterator<Item = &Chunk> {
        self.chunks.iter().filter(move |chunk| chunk.first < to && from < chunk.first + chunk.frames.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use can::CanId;
    use sim::Prng;

    use super::*;

    const SPACING: Duration = Duration::from_micros(500);

    fn trace_of(count: u64) -> Trace {
        let trace = Trace::new(Models::default(), Origin::default());
        for number in 0..count {
            let at = Instant::ZERO + SPACING * number as u32;
            trace.append(BusFrame { at, frame: "080#".parse().expect("a frame"), own: false });
        }
        trace
    }

    #[test]
    fn two_hundred_thousand_frames_are_kept_and_less_than_a_chunk_more() {
        let count = 3 * KEPT as u64 + 17;
        let held = trace_of(count).held();
        let kept = (held.next() - held.oldest()) as usize;
        assert_eq!(held.next(), count);
        assert!((KEPT..KEPT + CHUNK).contains(&kept), "{kept}");
        assert!(size_of::<BusFrame>() * (KEPT + CHUNK) <= 10 << 20, "{} bytes a frame", size_of::<BusFrame>());
        let mut numbers = Vec::new();
        held.decode(held.oldest(), held.next(), |number, _, _| numbers.push(number));
        assert!(numbers.len() == kept && numbers.is_sorted(), "each once, in order");
    }

    /// Longer than the trace is.
    #[test]
    fn who_looks_often_enough_misses_no_frame_of_others() {
        let trace = Trace::new(Models::default(), Origin::default());
        let (mut next, mut heard) = (trace.next(), Vec::new());
        for number in 0..(KEPT + 2 * CHUNK) as u64 {
            let at = Instant::from_nanos(number);
            trace.append(BusFrame { at, frame: "181#".parse().expect("a frame"), own: number % 3 == 0 });
            if number % 10_007 == 0 {
                next = trace.others_from(next, |passed| heard.push(passed.at));
            }
        }
        trace.others_from(next, |passed| heard.push(passed.at));
        let others = (0..(KEPT + 2 * CHUNK) as u64).filter(|number| number % 3 != 0).map(Instant::from_nanos);
        assert!(heard.iter().copied().eq(others), "each once, in order: {}", heard.len());
    }

    #[test]
    fn a_frame_is_found_by_its_time() {
        let held = trace_of(3 * CHUNK as u64).held();
        for number in [0, 1, CHUNK as u64 - 1, CHUNK as u64, CHUNK as u64 + 1, 3 * CHUNK as u64 - 1] {
            let at = Instant::ZERO + SPACING * number as u32;
            assert_eq!(held.number_at(at), number);
            assert_eq!(held.number_at(at + Duration::from_nanos(1)), number + 1, "behind frame {number}");
        }
        assert_eq!(trace_of(0).held().number_at(Instant::ZERO), 0);
    }

    #[test]
    fn a_snapshot_does_not_change_while_frames_are_added() {
        let trace = trace_of(10);
        let held = trace.held();
        trace.append(BusFrame { at: Instant::from_secs(9), frame: "704#05".parse().expect("a frame"), own: false });
        let mut count = 0;
        held.decode(0, u64::MAX, |_, _, _| count += 1);
        assert_eq!((count, held.next(), trace.held().next()), (10, 10, 11));
    }

    /// Frames of two nodes: SDO transfers whole and broken off, among them such as set up PDOs, and PDOs.
    fn random_frame(random: &mut Prng) -> Frame {
        let pick = |random: &mut Prng, of: &[u8]| of[random.below(of.len() as u64) as usize];
        let base = [0x180_u16, 0x200, 0x280, 0x580, 0x600, 0x600, 0x580, 0x700][random.below(8) as usize];
        let node = pick(random, &[2, 4]);
        // Command specifiers of CiA 301, 7.2.4.3, segmented and in blocks too.
        let command =
            pick(random, &[0x40, 0x43, 0x4F, 0x41, 0x2F, 0x23, 0x21, 0x60, 0x70, 0x80, 0x00, 0x0B, 0xA0, 0xC2, 0xC6]);
        let [low, high] = [0x1800_u16, 0x1A00, 0x1400, 0x1600, 0x6041, 0x1000][random.below(6) as usize].to_le_bytes();
        let sub_index = pick(random, &[0, 1, 2]);
        let value = [0x184_u32, 0x8000_0184, 0x604, 0x6041_0010, 0x606C_0020, 1, 2, 0][random.below(8) as usize];
        let [a, b, c, d] = value.to_le_bytes();
        Frame::new(CanId::standard(base + u16::from(node)), &[command, low, high, sub_index, a, b, c, d])
    }

    /// Parts read from anywhere are decoded as by a decoder that has seen all frames.
    #[test]
    fn every_part_reads_as_if_all_before_it_had_been_read() {
        let mut random = Prng::new(7);
        let trace = trace_of(0);
        let mut whole = Decoder::new();
        let mut texts = Vec::new();
        let model = devices::model("zlac8030l").expect("a model");
        for number in 0..3 * CHUNK {
            if number == CHUNK + CHUNK / 2 {
                let node = NodeId::new(4).expect("a node-ID");
                trace.set_model(node, model);
                whole.set_model(node, model);
            }
            let frame = random_frame(&mut random);
            trace.append(BusFrame { at: Instant::from_millis(number as u64), frame, own: false });
            texts.push(whole.decode(&frame).to_string());
        }
        let held = trace.held();
        assert!(texts.iter().any(|text| text.contains("velocity_actual_value")), "PDOs were mapped");
        for _ in 0..50 {
            let from = random.below(texts.len() as u64);
            let to = (from + random.below(200)).min(texts.len() as u64);
            let mut part = Vec::new();
            held.decode(from, to, |_, _, decoded| part.push(decoded.to_string()));
            assert_eq!(part, texts[from as usize..to as usize], "from {from}");
        }
    }

    #[test]
    fn a_model_that_is_found_again_and_again_costs_no_more_memory() {
        let trace = trace_of(10);
        let node = NodeId::new(4).expect("a node-ID");
        let models = ["zlac8030l", "zlim42c"].map(|name| devices::model(name).expect("a model"));
        for round in 0..3 * MOST_CHUNKS {
            trace.set_model(node, models[round % 2]);
            trace.append(BusFrame { at: Instant::from_secs(9), frame: "704#05".parse().expect("a frame"), own: false });
        }
        assert!(trace.held().chunks.len() <= MOST_CHUNKS);
    }
}
