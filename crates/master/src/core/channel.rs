use std::collections::VecDeque;

use can::{CanId, Frame, Instant};
use canopen::sdo::client::{self, Client};
use canopen::sdo::wire::Reply;
use canopen::{AbortCode, Mux, NodeId};

use super::payload::Payload;
use super::request::{Failure, Outcome, Request, SdoServer, Ticket, Transfer};

/// Requests that may wait for one node.
const QUEUE: usize = 64;

/// Longest object that is read: larger than any drive's, and a bound on what a broken peer can make us allocate.
const MAX_OBJECT: usize = 1 << 20;

/// Room for an expedited answer and the first segment.
const FIRST_ROOM: usize = 16;

/// A download of at least so many bytes is asked for in blocks: 15 frames instead of 22. Of a device without block transfer the first
/// of them takes two frames more.
pub(super) const DOWNLOAD_BLOCKS_FROM: usize = 64;

/// An upload whose server declares so many bytes is begun anew, in blocks: with the three frames that this takes 46 frames instead
/// of 76.
pub(super) const UPLOAD_BLOCKS_FROM: usize = 256;

/// SDO client channel to one node with its queue: one transfer on the wire, the others wait.
#[derive(Clone, Debug)]
pub(super) struct SdoQueue {
    client: Client,
    /// The server that the client asks, and the default one.
    server: SdoServer,
    default: SdoServer,
    /// Another one from the next request on.
    next_server: Option<SdoServer>,
    active: Option<Active>,
    queue: VecDeque<(Ticket, Request)>,
    ended: Option<Ended>,
    /// The object of a transfer that was given up: its answer may still come and is not about the next one.
    given_up: Option<Mux>,
    /// What is read goes here, what is written comes from here.
    buffer: Vec<u8>,
    /// It has just done so.
    has_refused: bool,
}

/// The transfer on the wire.
#[derive(Clone, Debug)]
struct Active {
    ticket: Ticket,
    mux: Mux,
    timeout: core::time::Duration,
    uploads: bool,
    /// It may be done in blocks.
    may_use_blocks: bool,
    /// It is done in blocks.
    in_blocks: bool,
    /// Its first frame was taken by the runner.
    sent: bool,
}

/// A transfer that has ended.
#[derive(Clone, Debug)]
pub(super) struct Ended {
    pub(super) ticket: Ticket,
    pub(super) mux: Mux,
    pub(super) downloads: bool,
    pub(super) outcome: Outcome,
}

impl SdoQueue {
    pub(super) fn new(node: NodeId) -> Self {
        let client = Client::new(node, core::time::Duration::ZERO);
        Self {
            client,
            server: SdoServer::default_of(node),
            default: SdoServer::default_of(node),
            next_server: None,
            active: None,
            queue: VecDeque::new(),
            ended: None,
            given_up: None,
            buffer: Vec::new(),
            has_refused: false,
        }
    }

    /// No request is on the wire or waits.
    pub(super) fn is_idle(&self) -> bool {
        self.active.is_none() && self.queue.is_empty()
    }

    /// It asks the default server.
    pub(super) fn is_default(&self) -> bool {
        self.server == self.default
    }

    /// Requests that have not begun go to this server.
    pub(super) fn use_server(&mut self, server: SdoServer) {
        self.next_server = Some(server);
    }

    /// Replies with this identifier are awaited, or will be.
    pub(super) fn listens_to(&self, reply: CanId) -> bool {
        let is_asked = self.active.is_some() || self.next_server.is_none();
        (is_asked && self.server.reply == reply) || self.next_server.is_some_and(|server| server.reply == reply)
    }

    /// True once after the node has refused block transfer.
    pub(super) const fn take_refusal(&mut self) -> bool {
        core::mem::replace(&mut self.has_refused, false)
    }

    /// Starts the request, or queues it. Where `blocks` are allowed, a long value is sent in them.
    pub(super) fn push(&mut self, ticket: Ticket, request: Request, blocks: bool, now: Instant) -> Result<(), Failure> {
        if self.queue.len() == QUEUE {
            return Err(Failure::QueueFull);
        }
        self.queue.push_back((ticket, request));
        self.start_next(blocks, now);
        Ok(())
    }

    /// Forgets a request; one on the wire is aborted. False if it is not here.
    pub(super) fn cancel(&mut self, ticket: Ticket, blocks: bool, now: Instant) -> bool {
        if self.active.as_ref().is_some_and(|active| active.ticket == ticket) {
            self.given_up = self.active.take().map(|active| active.mux);
            self.client.abort(AbortCode::GENERAL);
            self.start_next(blocks, now);
            return true;
        }
        let before = self.queue.len();
        self.queue.retain(|(queued, _)| *queued != ticket);
        self.queue.len() < before
    }

    pub(super) fn start_next(&mut self, blocks: bool, now: Instant) {
        if self.active.is_some() || self.ended.is_some() {
            return;
        }
        let Some((ticket, request)) = self.queue.pop_front() else { return };
        if let Some(server) = self.next_server.take().filter(|server| *server != self.server) {
            self.server = server;
            self.client = Client::on(server.request, server.reply, request.timeout);
        }
        let Request { mux, transfer, timeout, .. } = request;
        self.client.set_timeout(timeout);
        self.buffer.clear();
        let (uploads, in_blocks) = match transfer {
            Transfer::Upload => {
                self.buffer.resize(FIRST_ROOM, 0);
                self.client.upload(mux, now);
                (true, false)
            }
            Transfer::Download(data) => {
                self.buffer.extend_from_slice(data.as_bytes());
                let in_blocks = blocks && self.buffer.len() >= DOWNLOAD_BLOCKS_FROM;
                if in_blocks {
                    self.client.download_blocks(mux, &self.buffer, now);
                } else {
                    self.client.download(mux, &self.buffer, now);
                }
                (false, in_blocks)
            }
        };
        self.active = Some(Active { ticket, mux, timeout, uploads, may_use_blocks: blocks, in_blocks, sent: false });
    }

    /// The node has no block transfer: the same again without.
    fn start_without_blocks(&mut self, now: Instant) {
        let Some(active) = &mut self.active else { return };
        self.has_refused = true;
        (active.may_use_blocks, active.in_blocks) = (false, false);
        if active.uploads {
            self.client.upload(active.mux, now);
        } else {
            self.client.download(active.mux, &self.buffer, now);
        }
    }

    pub(super) fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let Some(active) = self.active.as_mut().filter(|_| frame.id() == self.server.reply) else { return };
        // Segments of blocks do not say what they are.
        if !self.client.takes_segments() {
            let about = mux_of(&Reply::parse(frame.padded()));
            if about.is_some() && about != Some(active.mux) && about == self.given_up {
                return;
            }
        }
        if active.uploads
            && let Some(needed) = self.client.needed_room(frame)
        {
            if active.may_use_blocks
                && !active.in_blocks
                && (UPLOAD_BLOCKS_FROM..=MAX_OBJECT).contains(&needed)
                && self.client.begin_in_blocks(now)
            {
                active.in_blocks = true;
                return;
            }
            self.make_room(needed);
        }
        match self.client.handle_frame(frame, &mut self.buffer, now) {
            None => {}
            Some(Ok(client::Outcome::Uploaded { length, .. })) => {
                let bytes = self.buffer.get(..length).unwrap_or_default();
                self.end(Ok(Payload::new(bytes)));
            }
            Some(Ok(client::Outcome::Downloaded { .. })) => self.end(Ok(Payload::EMPTY)),
            Some(Err(client::Failure::Aborted { code: AbortCode::UNKNOWN_COMMAND, .. })) if self.is_in_blocks() => {
                self.start_without_blocks(now);
            }
            Some(Err(failure)) => self.end(Err(self.failure(failure))),
        }
    }

    fn is_in_blocks(&self) -> bool {
        self.active.as_ref().is_some_and(|active| active.in_blocks)
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Some(failure) = self.client.handle_timeout(now) {
            self.given_up = self.active.as_ref().map(|active| active.mux);
            self.end(Err(self.failure(failure)));
        }
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        let frame = self.client.poll_transmit(&self.buffer)?;
        if let Some(active) = &mut self.active {
            active.sent = true;
        }
        Some(frame)
    }

    /// How many bytes of the transfer on the wire are done.
    pub(super) fn bytes_done(&self) -> Option<usize> {
        self.client.bytes_done()
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.client.poll_timeout()
    }

    /// The transfer that has ended; call [`start_next`](Self::start_next) after it.
    pub(super) fn poll_finished(&mut self) -> Option<Ended> {
        self.ended.take()
    }

    /// Lets the buffer grow to what the answer declares, or by a segment where it has declared nothing. What was not asked for takes no
    /// room.
    fn make_room(&mut self, needed: usize) {
        if needed > self.buffer.len() && needed <= MAX_OBJECT {
            self.buffer.resize(needed, 0);
        }
    }

    fn end(&mut self, outcome: Outcome) {
        if let Some(active) = self.active.take() {
            self.ended = Some(Ended { ticket: active.ticket, mux: active.mux, downloads: !active.uploads, outcome });
        }
    }

    fn failure(&self, failure: client::Failure) -> Failure {
        let active = self.active.as_ref();
        match failure {
            client::Failure::Aborted { code, .. } => Failure::Aborted(code),
            client::Failure::TimedOut { .. } => Failure::NoAnswer {
                waited: active.map_or(core::time::Duration::ZERO, |active| active.timeout),
                unsent: active.is_some_and(|active| !active.sent),
            },
            other => Failure::BadAnswer(other),
        }
    }
}

/// The object that an answer is about; segments do not say.
const fn mux_of(reply: &Reply) -> Option<Mux> {
    match reply {
        Reply::InitiateUpload(mux, _) | Reply::InitiateDownload(mux) | Reply::Abort(mux, _) => Some(*mux),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use canopen::AbortCode;

    use super::*;

    const NAME: Mux = Mux::new(0x1008, 0);

    fn frame(data: [u8; 8]) -> Frame {
        Frame::new(can::CanId::standard(0x584), &data)
    }

    /// A channel that reads 1008h:00.
    fn reading() -> SdoQueue {
        let node = NodeId::new(4).unwrap();
        let mut channel = SdoQueue::new(node);
        let request = Request { node, mux: NAME, transfer: Transfer::Upload, timeout: Duration::from_secs(1) };
        channel.push(Ticket(1), request, false, Instant::ZERO).unwrap();
        channel.poll_transmit().unwrap();
        channel
    }

    /// CiA 301, 7.2.4.3.5 and 7.2.4.3.6: initiate upload with or without a size, then segments of 7 bytes with a toggling bit.
    fn read_in_segments(initiate: [u8; 8], segments: usize) -> (SdoQueue, usize) {
        let mut channel = reading();
        channel.handle_frame(&frame(initiate), Instant::ZERO);
        let mut most = 0;
        for n in 0..segments {
            channel.poll_transmit().unwrap();
            let command = (n as u8 % 2) << 4 | u8::from(n + 1 == segments);
            channel.handle_frame(&frame([command, 1, 2, 3, 4, 5, 6, 7]), Instant::ZERO);
            most = most.max(channel.buffer.len());
        }
        (channel, most)
    }

    #[test]
    fn the_buffer_is_as_long_as_what_comes_declared_or_not() {
        for size in [[0x41, 0x08, 0x10, 0, 0xBC, 0x02, 0, 0], [0x40, 0x08, 0x10, 0, 0, 0, 0, 0]] {
            let (mut channel, most) = read_in_segments(size, 100);
            let ended = channel.poll_finished().unwrap();
            assert_eq!(ended.outcome.unwrap().as_bytes().len(), 700, "{size:?}");
            assert_eq!(most, 700, "{size:?}");
        }
    }

    #[test]
    fn what_was_not_requested_takes_no_room() {
        let mut channel = reading();
        for _ in 0..1000 {
            // Segments before the transfer has begun, and the beginning of another object of 64 KiB.
            for data in [[0x00, 1, 2, 3, 4, 5, 6, 7], [0x41, 0x09, 0x10, 0, 0, 0, 1, 0]] {
                channel.handle_frame(&frame(data), Instant::ZERO);
                assert!(channel.buffer.len() <= FIRST_ROOM, "{}", channel.buffer.len());
            }
        }
        // A declared mebibyte is the most.
        let mut channel = reading();
        channel.handle_frame(&frame([0x41, 0x08, 0x10, 0, 1, 0, 0x10, 0]), Instant::ZERO);
        assert!(channel.buffer.len() <= FIRST_ROOM);
        assert!(matches!(
            channel.poll_finished().unwrap().outcome,
            Err(Failure::BadAnswer(_) | Failure::Aborted(AbortCode::OUT_OF_MEMORY))
        ));
    }

    /// What a channel sends after each of these answers, when this is requested of it.
    fn conversation(channel: &mut SdoQueue, transfer: Transfer, blocks: bool, answers: &[&str]) -> Vec<String> {
        let node = NodeId::new(4).unwrap();
        let request = Request { node, mux: NAME, transfer, timeout: Duration::from_secs(1) };
        channel.push(Ticket(1), request, blocks, Instant::ZERO).unwrap();
        let mut sent = Vec::new();
        for answer in answers {
            sent.extend(std::iter::from_fn(|| channel.poll_transmit()).map(|frame| frame.to_string()));
            channel.handle_frame(&answer.parse().unwrap(), Instant::ZERO);
        }
        sent.extend(std::iter::from_fn(|| channel.poll_transmit()).map(|frame| frame.to_string()));
        sent
    }

    const REFUSED: &str = "584#8008100001000405";
    const TAKEN: &str = "584#6008100000000000";

    #[test]
    fn a_long_download_goes_in_blocks_where_they_are_allowed_and_again_in_segments_where_they_are_refused() {
        let download = |bytes: usize| Transfer::Download(Payload::new(&vec![0; bytes]));
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        let sent = conversation(&mut channel, download(63), true, &[]);
        assert_eq!(sent, ["604#210810003F000000"], "too short for it");
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        assert_eq!(conversation(&mut channel, download(64), false, &[]), ["604#2108100040000000"], "not allowed");
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        let sent = conversation(&mut channel, download(64), true, &[REFUSED, TAKEN]);
        assert_eq!(sent, ["604#C608100040000000", "604#2108100040000000", "604#0000000000000000"]);
        assert!(channel.take_refusal() && !channel.take_refusal());
    }

    #[test]
    fn an_upload_is_begun_anew_in_blocks_where_a_long_value_is_declared_and_as_before_where_they_are_refused() {
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        let sent = conversation(&mut channel, Transfer::Upload, true, &["584#41081000FF000000"]);
        assert_eq!(sent, ["604#4008100000000000", "604#6000000000000000"], "255 bytes");
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        let declared = "584#4108100000010000";
        let sent = conversation(&mut channel, Transfer::Upload, true, &[declared, REFUSED, declared]);
        let begin = ["604#4008100000000000", "604#8008100000000008", "604#A40810007F000000"];
        assert_eq!(sent, [&begin[..], &["604#4008100000000000", "604#6000000000000000"]].concat());
        assert!(channel.poll_finished().is_none(), "it goes on");
        // Another abort is the node's answer.
        let mut channel = SdoQueue::new(NodeId::new(4).unwrap());
        conversation(&mut channel, Transfer::Upload, true, &[declared, "584#8008100000000008"]);
        assert_eq!(channel.poll_finished().unwrap().outcome, Err(Failure::Aborted(AbortCode::GENERAL)));
    }
}
