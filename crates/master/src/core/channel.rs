use std::collections::VecDeque;

use can::{Frame, Instant};
use canopen::sdo::client::{self, Client};
use canopen::sdo::wire::{Payload as Initiation, Reply};
use canopen::{AbortCode, Mux, NodeId};

use super::payload::Payload;
use super::request::{Failure, Outcome, Request, Ticket, Transfer};

/// Requests that may wait for one node.
const QUEUE: usize = 64;

/// Longest object that is read: larger than any drive's, and a bound on what a broken peer can make us allocate.
const MAX_OBJECT: usize = 1 << 20;

/// Room for an expedited answer and the first segment.
const FIRST_ROOM: usize = 16;

/// SDO client channel to one node with its queue: one transfer on the wire, the others wait.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    client: Client,
    active: Option<Active>,
    queue: VecDeque<(Ticket, Request)>,
    ended: Option<Ended>,
    /// The object of a transfer that was given up: its answer may still come and is not about the next one.
    given_up: Option<Mux>,
    /// What is read goes here, what is written comes from here.
    buffer: Vec<u8>,
}

/// The transfer on the wire.
#[derive(Clone, Debug)]
struct Active {
    ticket: Ticket,
    mux: Mux,
    timeout: core::time::Duration,
    uploads: bool,
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

impl Channel {
    pub(super) fn new(node: NodeId) -> Self {
        let client = Client::new(node, core::time::Duration::ZERO);
        Self { client, active: None, queue: VecDeque::new(), ended: None, given_up: None, buffer: Vec::new() }
    }

    /// Starts the request, or queues it.
    pub(super) fn push(&mut self, ticket: Ticket, request: Request, now: Instant) -> Result<(), Failure> {
        if self.queue.len() == QUEUE {
            return Err(Failure::QueueFull);
        }
        self.queue.push_back((ticket, request));
        self.start_next(now);
        Ok(())
    }

    /// Forgets a request; one on the wire is aborted. False if it is not here.
    pub(super) fn cancel(&mut self, ticket: Ticket, now: Instant) -> bool {
        if self.active.as_ref().is_some_and(|active| active.ticket == ticket) {
            self.given_up = self.active.take().map(|active| active.mux);
            self.client.abort(AbortCode::GENERAL);
            self.start_next(now);
            return true;
        }
        let before = self.queue.len();
        self.queue.retain(|(queued, _)| *queued != ticket);
        self.queue.len() < before
    }

    pub(super) fn start_next(&mut self, now: Instant) {
        if self.active.is_some() || self.ended.is_some() {
            return;
        }
        let Some((ticket, request)) = self.queue.pop_front() else { return };
        let Request { mux, transfer, timeout, .. } = request;
        self.client.set_timeout(timeout);
        self.buffer.clear();
        let uploads = match transfer {
            Transfer::Upload => {
                self.buffer.resize(FIRST_ROOM, 0);
                self.client.upload(mux, now);
                true
            }
            Transfer::Download(data) => {
                self.buffer.extend_from_slice(data.as_bytes());
                self.client.download(mux, &self.buffer, now);
                false
            }
        };
        self.active = Some(Active { ticket, mux, timeout, uploads, sent: false });
    }

    pub(super) fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let Some(active) = &self.active else { return };
        let about = mux_of(&Reply::parse(frame.padded()));
        if about.is_some() && about != Some(active.mux) && about == self.given_up {
            return;
        }
        if active.uploads {
            self.make_room(frame);
        }
        match self.client.handle_frame(frame, &mut self.buffer, now) {
            None => {}
            Some(Ok(client::Outcome::Uploaded { length, .. })) => {
                let bytes = self.buffer.get(..length).unwrap_or_default();
                self.end(Ok(Payload::new(bytes)));
            }
            Some(Ok(client::Outcome::Downloaded { .. })) => self.end(Ok(Payload::EMPTY)),
            Some(Err(failure)) => self.end(Err(self.failure(failure))),
        }
    }

    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Some(failure) = self.client.handle_timeout(now) {
            self.given_up = self.active.as_ref().map(|active| active.mux);
            self.end(Err(self.failure(failure)));
        }
    }

    pub(super) fn poll_transmit(&mut self) -> Option<Frame> {
        let frame = self.client.poll_transmit()?;
        if let Some(active) = &mut self.active {
            active.sent = true;
        }
        Some(frame)
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
    fn make_room(&mut self, frame: &Frame) {
        let asked = self.active.as_ref().map(|active| active.mux);
        let wanted = match Reply::parse(frame.padded()) {
            Reply::InitiateUpload(mux, Initiation::Segmented { size: Some(size) }) if Some(mux) == asked => {
                size as usize
            }
            Reply::UploadSegment(segment) => match self.client.undeclared_upload() {
                Some(received) => received + usize::from(segment.length),
                None => return,
            },
            _ => return,
        };
        if wanted > self.buffer.len() && wanted <= MAX_OBJECT {
            self.buffer.resize(wanted, 0);
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
    fn reading() -> Channel {
        let node = NodeId::new(4).unwrap();
        let mut channel = Channel::new(node);
        let request = Request { node, mux: NAME, transfer: Transfer::Upload, timeout: Duration::from_secs(1) };
        channel.push(Ticket(1), request, Instant::ZERO).unwrap();
        channel.poll_transmit().unwrap();
        channel
    }

    /// CiA 301, 7.2.4.3.5 and 7.2.4.3.6: initiate upload with or without a size, then segments of 7 bytes with a toggling bit.
    fn read_in_segments(initiate: [u8; 8], segments: usize) -> (Channel, usize) {
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
}
