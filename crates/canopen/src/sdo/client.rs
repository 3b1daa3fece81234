//! The other side of an SDO channel: asks a server to read or write one entry (CiA 301, 7.2.4).
//!
//! One transfer at a time. The bytes live with the caller: a download hands the same bytes to every call, an upload
//! the buffer to fill. Expedited or segmented is chosen by length, and by the server's answer; whether blocks are asked for, retries
//! and queues are the caller's.

mod block;
mod failure;

use core::time::Duration;

use can::{CanId, Frame, Instant};

pub use failure::Failure;

use super::block::{Receiver, Sender, wire as blocks};
use super::wire::{LENGTH, MAX_SEGMENT, Payload, Reply, Request, Segment};
use crate::{AbortCode, Mux, NodeId, connection_set};

/// What a finished transfer did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// `length` bytes of the buffer were filled.
    Uploaded {
        /// The entry that was read.
        mux: Mux,
        /// Bytes in the buffer.
        length: usize,
    },
    /// The server has stored the value.
    Downloaded {
        /// The entry that was written.
        mux: Mux,
    },
}

/// A client of one server channel.
///
/// Start with [`upload`](Self::upload) or [`download`](Self::download); then hand in frames and time until an
/// [`Outcome`] or [`Failure`] comes, and send what [`poll_transmit`](Self::poll_transmit) offers.
#[derive(Clone, Debug)]
pub struct Client {
    request_id: CanId,
    reply_id: CanId,
    timeout: Duration,
    state: State,
    deadline: Instant,
    /// How long an upload may take in all, and when that is over.
    limit: Duration,
    ends_at: Instant,
    /// Of the time for a reply, for what is done with each segment of a block.
    half_timeout_ns: u64,
    request: Option<[u8; LENGTH]>,
    /// The end of an upload of blocks, which goes out before any other request.
    closing: Option<[u8; LENGTH]>,
    /// An upload of blocks was given up, whose server may have sent more of them meanwhile: after this number.
    abandoned: Option<u8>,
    /// What was asked for before, the newest first: a server that is slow answers to that still, and some answer twice.
    earlier: [Option<Mux>; REMEMBERED],
    /// What another client asked for, as a reply that came meanwhile shows.
    foreign: Option<Mux>,
}

/// An upload may take as long in all as if each segment but the last were full and used up its time. Where the server does not say how
/// long the value is, this many are allowed for. A guess: with half a second for each 128 s, and 1 MiB of data (150,000 segments and
/// their requests of up to 130 bits) takes 78 s of a bus at 500 kbit/s.
const UNDECLARED_SEGMENTS: u32 = 256;

/// How many questions ago a late answer may belong to.
const REMEMBERED: usize = 4;

#[derive(Clone, Copy, Debug)]
enum State {
    Idle,
    /// Waits for the answer to an initiate upload.
    Upload {
        mux: Mux,
    },
    /// Waits for a segment.
    UploadSegments {
        mux: Mux,
        declared: Option<usize>,
        received: usize,
        toggle: bool,
    },
    /// Waits for the answer to an initiate download.
    Download {
        mux: Mux,
        expedited: bool,
    },
    /// Waits for a segment to be taken; `sent` includes it.
    DownloadSegments {
        mux: Mux,
        sent: usize,
        toggle: bool,
    },
    /// Waits for the answer to an initiate upload of blocks.
    BlockUpload {
        mux: Mux,
    },
    /// Takes segments of blocks, and after them the end of the data.
    UploadBlocks {
        mux: Mux,
        declared: Option<usize>,
        receiver: Receiver,
    },
    /// Waits for the answer to an initiate download of blocks.
    BlockDownload {
        mux: Mux,
    },
    /// Sends segments of blocks, and waits for the confirmation of each block.
    DownloadBlocks {
        mux: Mux,
        sender: Sender,
    },
    /// Waits for the confirmation of all blocks.
    BlocksSent {
        mux: Mux,
    },
}

impl Client {
    /// The default channel of `server`. `timeout` is for each reply.
    pub const fn new(server: NodeId, timeout: Duration) -> Self {
        Self::on(connection_set::sdo_request(server), connection_set::sdo_reply(server), timeout)
    }

    /// A channel under these identifiers: another one of a server that has several (CiA 301, 7.5.2.33).
    pub const fn on(request_id: CanId, reply_id: CanId, timeout: Duration) -> Self {
        Self {
            request_id,
            reply_id,
            timeout,
            state: State::Idle,
            deadline: Instant::FAR_FUTURE,
            limit: Duration::MAX,
            ends_at: Instant::FAR_FUTURE,
            half_timeout_ns: half_ns(timeout),
            request: None,
            closing: None,
            abandoned: None,
            earlier: [None; REMEMBERED],
            foreign: None,
        }
    }

    /// The identifiers of requests and replies.
    pub const fn channel(&self) -> (CanId, CanId) {
        (self.request_id, self.reply_id)
    }

    /// Time allowed for each reply, from the next request on.
    pub const fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
        self.half_timeout_ns = half_ns(timeout);
    }

    /// True while a transfer is under way.
    pub const fn is_busy(&self) -> bool {
        !matches!(self.state, State::Idle)
    }

    /// How long the buffer of an upload has to be for what `frame` brings, or announces, if it is an answer to it.
    pub fn needed_room(&self, frame: &Frame) -> Option<usize> {
        let raw = frame.padded();
        match (self.state, Reply::parse(raw)) {
            (State::UploadBlocks { declared, receiver, .. }, _) => {
                declared.is_none().then(|| receiver.written() + MAX_SEGMENT)
            }
            (State::BlockUpload { mux }, Reply::Unknown { .. }) => {
                let reply = blocks::Reply::parse(raw).filter(|reply| reply.mux() == Some(mux))?;
                reply.declared_size().map(|size| size as usize)
            }
            (
                State::Upload { mux } | State::BlockUpload { mux },
                Reply::InitiateUpload(received, Payload::Segmented { size: Some(size) }),
            ) if received == mux => Some(size as usize),
            (State::UploadSegments { declared: None, received, .. }, Reply::UploadSegment(segment)) => {
                Some(received + segment.data().len())
            }
            _ => None,
        }
    }

    /// Begins to read an entry. A transfer under way is forgotten: the server drops it when it sees the new one.
    pub fn upload(&mut self, mux: Mux, now: Instant) {
        self.ask(Request::InitiateUpload(mux), State::Upload { mux }, now);
    }

    /// Begins to write `data` to an entry: expedited up to four bytes, else in segments.
    pub fn download(&mut self, mux: Mux, data: &[u8], now: Instant) {
        match Payload::expedited(data) {
            Some(payload) => {
                self.ask(Request::InitiateDownload(mux, payload), State::Download { mux, expedited: true }, now);
            }
            None => self.download_segmented(mux, data, now),
        }
    }

    /// As [`download`](Self::download), in segments whatever the length.
    pub fn download_segmented(&mut self, mux: Mux, data: &[u8], now: Instant) {
        let payload = Payload::Segmented { size: Some(data.len() as u32) };
        self.ask(Request::InitiateDownload(mux, payload), State::Download { mux, expedited: false }, now);
    }

    /// Gives up a transfer under way and reports the reason to the server.
    pub fn abort(&mut self, code: AbortCode) {
        if let Some(mux) = self.mux() {
            self.give_up(mux, code);
        }
    }

    /// A frame arrived. `buffer` is the data of a download, or the room for an upload. Frames that are not this
    /// server's replies do nothing, nor does a reply without a transfer, nor one to an earlier question or to another client's that
    /// asks the same server against CiA 301, 7.2.4.3: the answer to this one may still come.
    pub fn handle_frame(&mut self, frame: &Frame, buffer: &mut [u8], now: Instant) -> Option<Result<Outcome, Failure>> {
        if frame.id() != self.reply_id || frame.is_remote() {
            return None;
        }
        let mux = self.mux()?;
        if self.abandoned.is_some() && self.is_stray(frame.padded()) {
            return None;
        }
        let advanced = if let State::UploadBlocks { .. } = self.state {
            self.take_of_blocks(frame.padded(), buffer, now)
        } else {
            let reply = Reply::parse(frame.padded());
            if let Some(received) = self.of_another(mux, &reply, frame.padded()) {
                if !self.earlier.contains(&Some(received)) {
                    self.foreign = Some(received);
                }
                return None;
            }
            self.advance(mux, reply, frame.padded(), buffer, now)
        };
        match advanced {
            Ok(None) => None,
            Ok(Some(outcome)) => {
                self.end();
                Some(Ok(outcome))
            }
            Err(failure) => {
                match failure.abort_code() {
                    Some(code) => self.give_up(mux, code),
                    None => self.end(),
                }
                Some(Err(failure))
            }
        }
    }

    /// Time has reached `now`.
    pub fn handle_timeout(&mut self, now: Instant) -> Option<Failure> {
        let mux = self.mux().filter(|_| now >= self.deadline)?;
        let is_endless = now >= self.ends_at;
        let endless = match self.state {
            State::UploadSegments { received, .. } if is_endless => Some(received),
            State::UploadBlocks { receiver, .. } if is_endless => Some(receiver.written()),
            _ => None,
        };
        if endless.is_none() && self.confirms_early(now) {
            return None;
        }
        self.give_up(mux, AbortCode::TIMED_OUT);
        Some(match (endless, self.foreign) {
            (Some(received), _) => Failure::Endless { mux, received, limit: self.limit },
            (None, Some(received)) => Failure::WrongMux { expected: mux, received },
            (None, None) => Failure::TimedOut { mux },
        })
    }

    /// The next frame to send. `data` is that of a download.
    pub fn poll_transmit(&mut self, data: &[u8]) -> Option<Frame> {
        let waiting = self.closing.take().or_else(|| self.request.take());
        waiting.or_else(|| self.next_segment(data)).map(|bytes| Frame::full(self.request_id, bytes))
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.is_busy().then_some(self.deadline)
    }

    fn advance(
        &mut self,
        mux: Mux,
        reply: Reply,
        raw: &[u8; LENGTH],
        buffer: &mut [u8],
        now: Instant,
    ) -> Result<Option<Outcome>, Failure> {
        if let Reply::Abort(received, code) = reply {
            // Some servers abort segments without the multiplexor: 0 stands for the transfer under way.
            expect_mux(mux, if received.key() == 0 { mux } else { received })?;
            return Err(Failure::Aborted { mux, code });
        }
        match (self.state, reply) {
            // A server may answer as if no blocks had been asked for.
            (State::Upload { .. } | State::BlockUpload { .. }, Reply::InitiateUpload(received, payload)) => {
                expect_mux(mux, received)?;
                self.begin_upload(mux, payload, buffer, now)
            }
            (State::UploadSegments { declared, received, toggle, .. }, Reply::UploadSegment(segment)) => {
                if segment.toggle != toggle {
                    return Err(Failure::ToggleBit { mux });
                }
                if segment.data().is_empty() && !segment.last {
                    return Err(Failure::EmptySegment { mux, received });
                }
                let end = received + segment.data().len();
                if let Some(declared) = declared.filter(|declared| end > *declared) {
                    return Err(Failure::LengthMismatch { mux, declared, received: end });
                }
                let room = buffer.get_mut(received..end).ok_or(Failure::BufferTooSmall { mux, needed: end })?;
                room.copy_from_slice(segment.data());
                if !segment.last {
                    self.ask_segment(mux, declared, end, !toggle, now);
                    return Ok(None);
                }
                match declared {
                    Some(declared) if declared != end => Err(Failure::LengthMismatch { mux, declared, received: end }),
                    _ => Ok(Some(Outcome::Uploaded { mux, length: end })),
                }
            }
            (State::Download { expedited, .. }, Reply::InitiateDownload(received)) => {
                expect_mux(mux, received)?;
                if expedited {
                    return Ok(Some(Outcome::Downloaded { mux }));
                }
                self.send_segment(mux, buffer, 0, false, now);
                Ok(None)
            }
            (State::DownloadSegments { sent, toggle, .. }, Reply::DownloadSegment { toggle: received }) => {
                if received != toggle {
                    return Err(Failure::ToggleBit { mux });
                }
                if sent >= buffer.len() {
                    return Ok(Some(Outcome::Downloaded { mux }));
                }
                self.send_segment(mux, buffer, sent, !toggle, now);
                Ok(None)
            }
            (State::BlockUpload { .. }, Reply::Unknown { .. }) => self.begin_block_upload(mux, raw, buffer, now),
            (
                State::BlockDownload { .. } | State::DownloadBlocks { .. } | State::BlocksSent { .. },
                Reply::Unknown { .. },
            ) => self.advance_block_download(mux, raw, buffer, now),
            (_, reply) => Err(Failure::UnexpectedReply { mux, command: reply.emit()[0] }),
        }
    }

    fn begin_upload(
        &mut self,
        mux: Mux,
        payload: Payload,
        buffer: &mut [u8],
        now: Instant,
    ) -> Result<Option<Outcome>, Failure> {
        match payload {
            Payload::Expedited { length, bytes } => {
                let length = usize::from(length.unwrap_or(bytes.len() as u8));
                let room = buffer.get_mut(..length).ok_or(Failure::BufferTooSmall { mux, needed: length })?;
                room.copy_from_slice(&bytes[..length]);
                Ok(Some(Outcome::Uploaded { mux, length }))
            }
            Payload::Segmented { size } => {
                let declared = self.begin_long_upload(mux, size, buffer, now)?;
                self.ask_segment(mux, declared, 0, false, now);
                Ok(None)
            }
        }
    }

    /// Checks what is declared, and sets a limit to the whole.
    fn begin_long_upload(
        &mut self,
        mux: Mux,
        size: Option<u32>,
        buffer: &[u8],
        now: Instant,
    ) -> Result<Option<usize>, Failure> {
        let declared = size.map(|size| size as usize);
        if let Some(needed) = declared.filter(|declared| *declared > buffer.len()) {
            return Err(Failure::BufferTooSmall { mux, needed });
        }
        let segments =
            declared.map_or(UNDECLARED_SEGMENTS, |bytes| bytes.div_ceil(MAX_SEGMENT) as u32).saturating_add(1);
        self.limit = self.timeout.saturating_mul(segments);
        self.ends_at = now + self.limit;
        Ok(declared)
    }

    fn ask_segment(&mut self, mux: Mux, declared: Option<usize>, received: usize, toggle: bool, now: Instant) {
        let state = State::UploadSegments { mux, declared, received, toggle };
        self.ask(Request::UploadSegment { toggle }, state, now);
    }

    fn send_segment(&mut self, mux: Mux, data: &[u8], from: usize, toggle: bool, now: Instant) {
        let rest = data.get(from..).unwrap_or(&[]);
        let segment = Segment::new(toggle, rest.len() <= MAX_SEGMENT, rest);
        let sent = from + segment.data().len();
        self.ask(Request::DownloadSegment(segment), State::DownloadSegments { mux, sent, toggle }, now);
    }

    /// The other object that the reply begins or ends a transfer of. In the middle of a transfer only one that was asked for
    /// before is passed over: another client's has ended this one in the server.
    fn of_another(&self, asked: Mux, reply: &Reply, raw: &[u8; LENGTH]) -> Option<Mux> {
        let received = match *reply {
            Reply::InitiateUpload(received, _) | Reply::InitiateDownload(received) | Reply::Abort(received, _) => {
                received
            }
            Reply::Unknown { .. } => blocks::Reply::parse(raw)?.mux()?,
            _ => return None,
        };
        let unnamed = matches!(reply, Reply::Abort(..)) && received.key() == 0;
        let begins = matches!(
            self.state,
            State::Upload { .. } | State::Download { .. } | State::BlockUpload { .. } | State::BlockDownload { .. }
        );
        let passed_over = begins || self.earlier.contains(&Some(received));
        Some(received).filter(|received| *received != asked && !unnamed && passed_over)
    }

    fn ask(&mut self, request: Request, state: State, now: Instant) {
        self.ask_raw(request.emit(), state, now);
    }

    fn ask_raw(&mut self, request: [u8; LENGTH], state: State, now: Instant) {
        self.request = Some(request);
        self.state = state;
        let asked = self.mux();
        if self.earlier[0] != asked {
            self.earlier.rotate_right(1);
            self.earlier[0] = asked;
        }
        self.foreign = None;
        self.deadline = now + self.timeout;
        if let State::UploadSegments { .. } = state {
            self.deadline = self.deadline.min(self.ends_at);
        }
    }

    fn give_up(&mut self, mux: Mux, code: AbortCode) {
        if let State::UploadBlocks { receiver, .. } = self.state {
            self.abandoned = (!receiver.is_complete()).then_some(receiver.seen());
        }
        self.end();
        self.request = Some(Request::Abort(mux, code).emit());
    }

    const fn end(&mut self) {
        self.state = State::Idle;
        self.deadline = Instant::FAR_FUTURE;
    }

    const fn mux(&self) -> Option<Mux> {
        match self.state {
            State::Idle => None,
            State::Upload { mux }
            | State::UploadSegments { mux, .. }
            | State::Download { mux, .. }
            | State::DownloadSegments { mux, .. }
            | State::BlockUpload { mux }
            | State::UploadBlocks { mux, .. }
            | State::BlockDownload { mux }
            | State::DownloadBlocks { mux, .. }
            | State::BlocksSent { mux } => Some(mux),
        }
    }
}

/// Half of a time in nanoseconds, as long as an [`Instant`] can be at most.
const fn half_ns(time: Duration) -> u64 {
    let half = time.as_nanos() / 2;
    if half > u64::MAX as u128 { u64::MAX } else { half as u64 }
}

fn expect_mux(expected: Mux, received: Mux) -> Result<(), Failure> {
    if received == expected { Ok(()) } else { Err(Failure::WrongMux { expected, received }) }
}
