//! The SDO server of a device: expedited, segmented and block transfer (CiA 301, 7.2.4).
//!
//! A frame goes in with the values; out come a reply, or for a complete download the entry to write, which the owner
//! checks, stores and reports back with [`Server::finish`], at once or later ([`Server::defer`]). A value longer than a cell
//! waits in the dictionary until all of it has come, and an upload reads from a copy: a transfer that ends half way changes
//! nothing, and one that takes its time gives the value of its first frame. One transfer at a time: a new request replaces
//! an unfinished one. Block transfer is answered with 0504 0001h by a server that has none.

mod block;

use can::{Frame, Instant};

use super::block::{Receiver, Sender};
use super::wire::{LENGTH, MAX_EXPEDITED, MAX_SEGMENT, Payload, Reply, Request, Segment};
use crate::od::{Dictionary, RowFacts, Slot, Storage, View};
use crate::{AbortCode, Mux};

/// Which requests a server listens to, by their data length code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameLength {
    /// Eight bytes, as CiA 301 wants; other frames are ignored.
    Eight,
    /// As many bytes as the request uses: 4 for an upload, 4 + data for a download. Shorter frames are ignored.
    Used,
}

/// A complete download that waits for the owner's verdict: see [`Server::finish`].
#[derive(Clone, Copy, Debug)]
pub struct Write {
    /// The entry.
    pub slot: Slot,
    /// The value to store, in as many low bytes as the entry has; what stands above them means nothing. Of a value longer
    /// than a cell how many bytes wait in the dictionary.
    pub raw: u32,
    pub(crate) facts: &'static RowFacts,
    mux: Mux,
    confirm: Confirm,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Confirm {
    Expedited,
    Segment { toggle: bool },
    Block,
}

/// One server channel.
#[derive(Clone, Debug)]
pub struct Server {
    transfer: Transfer,
    reply: Option<[u8; LENGTH]>,
    deadline: Instant,
    timeout_ns: u64,
    frame_length: FrameLength,
    /// Segments of the blocks that it takes; 0 for no block transfer.
    block_size: u8,
    /// Which of the node's servers it is: where a long value waits.
    number: u8,
    /// A download of blocks has begun: what comes may be a segment of it, and not what its bytes say. Set somewhat longer.
    takes_segments: bool,
}

/// A transfer under way.
#[derive(Clone, Debug)]
enum Transfer {
    None,
    Upload {
        mux: Mux,
        source: UploadSource,
        sent: usize,
        toggle: bool,
    },
    Download {
        mux: Mux,
        slot: Slot,
        facts: &'static RowFacts,
        room: Room,
        declared: Option<u32>,
        length: usize,
        toggle: bool,
    },
    BlockUpload {
        mux: Mux,
        source: UploadSource,
        sender: Sender,
        phase: BlockUploadPhase,
    },
    BlockDownload {
        mux: Mux,
        slot: Slot,
        facts: &'static RowFacts,
        room: Room,
        declared: Option<u32>,
        receiver: Receiver,
    },
    /// The server has given up a download of blocks, whose client may have sent more of them meanwhile: after this number. Taken for
    /// requests they would write whatever their bytes say.
    Abandoned(u8),
    /// The owner has not decided yet.
    Deferred(Write),
}

/// What becomes of a frame in a download of blocks.
enum SubBlockFrame {
    /// It is a part of it; perhaps its end.
    Here(Option<Write>),
    /// It is another request, and the download is over.
    Another,
}

/// How far the upload of blocks is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BlockUploadPhase {
    /// The client has not started it yet.
    Agreed,
    /// Segments are sent, or a confirmation is waited for.
    Segments,
    /// The client has all, and has not confirmed the end.
    Ended,
}

/// What an upload sends.
#[derive(Clone, Copy, Debug)]
enum UploadSource {
    Constant(&'static [u8]),
    /// A cell, this many bytes of it.
    Cell([u8; MAX_EXPEDITED], u8),
    /// What waits in the dictionary, this many bytes.
    Staged(usize),
}

/// Where a download puts what comes.
#[derive(Clone, Copy, Debug)]
enum Room {
    Cell {
        bytes: [u8; MAX_EXPEDITED],
        size: usize,
    },
    /// In the dictionary, this many bytes at most.
    Staging {
        capacity: usize,
    },
}

impl Server {
    /// A server with nothing under way. A transfer whose client is silent for `timeout_ns` is aborted with
    /// 0504 0000h, as is a download on which the owner has not decided for so long; 0 waits forever. `block_size` is how many segments,
    /// up to 127, the blocks of a download have that it asks for; 0 for a server without block transfer.
    pub const fn new(frame_length: FrameLength, timeout_ns: u64, block_size: u8) -> Self {
        Self {
            transfer: Transfer::None,
            reply: None,
            deadline: Instant::FAR_FUTURE,
            timeout_ns,
            frame_length,
            block_size,
            number: 0,
            takes_segments: false,
        }
    }

    /// The same as another server of its node: values longer than a cell wait at a place of its own.
    pub(crate) const fn numbered(mut self, number: u8) -> Self {
        self.number = number;
        self
    }

    /// A request arrived. Returns the write that the owner has to carry out, if it completes a download.
    #[inline]
    pub fn handle_frame<S: Storage>(
        &mut self,
        frame: &Frame,
        values: &mut Dictionary<S>,
        now: Instant,
    ) -> Option<Write> {
        if !self.listens_to(frame) {
            return None;
        }
        if self.takes_segments
            && let SubBlockFrame::Here(write) = self.take_in_download(frame, values, now)
        {
            return write;
        }
        match Request::parse(frame.padded()) {
            Request::InitiateUpload(mux) => self.initiate_upload(mux, values, now),
            Request::InitiateDownload(mux, _) => return self.initiate_download(mux, frame.padded(), values, now),
            _ => return self.go_on(frame, values, now),
        }
        None
    }

    /// Any request but those with which a transfer begins. It reads the frame again, so that for those two comparisons do.
    #[inline(never)]
    fn go_on<S: Storage>(&mut self, frame: &Frame, values: &mut Dictionary<S>, now: Instant) -> Option<Write> {
        match Request::parse(frame.padded()) {
            Request::Unknown { .. } if self.block_size > 0 => self.take_block_request(frame.padded(), values, now),
            Request::UploadSegment { toggle } => self.upload_segment(toggle, &values.view(), now),
            Request::DownloadSegment(segment) => {
                let staging = values.staging_mut(self.number);
                return self.download_segment(segment, staging, now);
            }
            Request::Abort(..) => self.end(),
            Request::Unknown { mux, .. } | Request::InitiateUpload(mux) | Request::InitiateDownload(mux, _) => {
                let mux = self.transfer_mux().unwrap_or(mux);
                self.refuse(mux, AbortCode::UNKNOWN_COMMAND);
            }
        }
        None
    }

    /// The owner stored `write`, or refuses it: confirms or aborts.
    #[inline]
    pub fn finish(&mut self, write: Write, result: Result<(), AbortCode>) {
        if let (Ok(()), Confirm::Expedited) = (result, write.confirm) {
            self.answer(Reply::InitiateDownload(write.mux));
        } else {
            self.finish_long(write, result);
        }
    }

    #[inline(never)]
    fn finish_long(&mut self, write: Write, result: Result<(), AbortCode>) {
        match (result, write.confirm) {
            (Ok(()), Confirm::Expedited) => self.answer(Reply::InitiateDownload(write.mux)),
            (Ok(()), Confirm::Segment { toggle }) => self.answer(Reply::DownloadSegment { toggle }),
            (Ok(()), Confirm::Block) => self.confirm_block_download(),
            (Err(code), _) => self.answer(Reply::Abort(write.mux, code)),
        }
    }

    /// The owner decides later: [`take_deferred`](Self::take_deferred), then [`finish`](Self::finish). A new request, the client's
    /// abort and the timeout end it before.
    #[cold]
    pub fn defer(&mut self, write: Write, now: Instant) {
        self.transfer = Transfer::Deferred(write);
        self.restart_timeout(now);
    }

    /// Takes the download on which the owner decides now; `None` if it has ended meanwhile.
    pub fn take_deferred(&mut self) -> Option<Write> {
        let Transfer::Deferred(write) = self.transfer else { return None };
        self.end();
        Some(write)
    }

    /// The download on which the owner has to decide.
    pub const fn deferred(&self) -> Option<&Write> {
        match &self.transfer {
            Transfer::Deferred(write) => Some(write),
            _ => None,
        }
    }

    /// Time has reached `now`: aborts a transfer whose client, or owner, has gone silent.
    pub fn handle_timeout(&mut self, now: Instant) {
        if now >= self.deadline
            && let Some(mux) = self.transfer_mux()
            && !self.confirms_early(now)
        {
            self.refuse(mux, AbortCode::TIMED_OUT);
        }
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called; [`Instant::FAR_FUTURE`] for never.
    pub const fn deadline(&self) -> Instant {
        self.deadline
    }

    /// True if a reply waits.
    pub const fn has_reply(&self) -> bool {
        self.reply.is_some()
    }

    /// Takes the reply that waits to be sent, eight bytes; `None` if there is none.
    pub const fn take_reply(&mut self) -> Option<[u8; LENGTH]> {
        self.reply.take()
    }

    /// Drops the transfer and the reply: communication was stopped or reset.
    pub const fn reset(&mut self) {
        self.end();
        self.reply = None;
    }

    #[inline]
    fn listens_to(&self, frame: &Frame) -> bool {
        match (frame.dlc(), self.frame_length) {
            (8, _) => true,
            (_, FrameLength::Eight) => false,
            // The first byte must be there to say what the request is.
            (dlc, FrameLength::Used) => dlc > 0 && dlc >= Request::parse(frame.padded()).used_length(),
        }
    }

    #[inline(always)]
    fn initiate_upload<S: Storage>(&mut self, mux: Mux, values: &mut Dictionary<S>, now: Instant) {
        self.end();
        let table = values.table();
        let (slot, facts) = match table.look_up(mux) {
            Ok(found) => found,
            Err(code) => return self.refuse(mux, code),
        };
        let row = facts.summary;
        if !row.is_readable_cell() {
            return self.initiate_long_upload(mux, (slot, facts), values, now);
        }
        let length = row.size();
        let bytes = values.raw(slot).to_le_bytes();
        self.answer(Reply::InitiateUpload(mux, Payload::Expedited { length: Some(length), bytes }));
    }

    /// Of a value that is longer than a cell, or may not be read.
    #[inline(never)]
    fn initiate_long_upload<S: Storage>(
        &mut self,
        mux: Mux,
        (slot, facts): (Slot, &'static RowFacts),
        values: &mut Dictionary<S>,
        now: Instant,
    ) {
        if !facts.summary.is_readable() {
            return self.refuse(mux, AbortCode::WRITE_ONLY);
        }
        let source = UploadSource::of_long(self.number, slot, values);
        let view = values.view();
        let data = source.bytes(self.number, &view);
        if let Some(payload) = Payload::expedited(data) {
            return self.answer(Reply::InitiateUpload(mux, payload));
        }
        self.transfer = Transfer::Upload { mux, source, sent: 0, toggle: false };
        self.restart_timeout(now);
        self.answer(Reply::InitiateUpload(mux, Payload::Segmented { size: Some(data.len() as u32) }));
    }

    fn upload_segment(&mut self, toggle: bool, values: &View<'_>, now: Instant) {
        let Transfer::Upload { mux, source, sent, toggle: expected } = &mut self.transfer else {
            return self.unexpected();
        };
        if toggle != *expected {
            let mux = *mux;
            return self.refuse(mux, AbortCode::TOGGLE_BIT);
        }
        let rest = &source.bytes(self.number, values)[*sent..];
        let (data, after) = rest.split_at(rest.len().min(MAX_SEGMENT));
        let last = after.is_empty();
        (*sent, *expected) = (*sent + data.len(), !toggle);
        let segment = Segment::new(toggle, last, data);
        self.answer(Reply::UploadSegment(segment));
        if last {
            self.end();
        } else {
            self.restart_timeout(now);
        }
    }

    #[inline(always)]
    fn initiate_download<S: Storage>(
        &mut self,
        mux: Mux,
        raw: &[u8; LENGTH],
        values: &mut Dictionary<S>,
        now: Instant,
    ) -> Option<Write> {
        self.end();
        let (slot, facts) = match values.table().look_up(mux) {
            Ok(found) => found,
            Err(code) => {
                self.refuse(mux, code);
                return None;
            }
        };
        let row = facts.summary;
        // Read where it is used, and made anew for the calls that need it whole: only the data of an expedited one is kept at hand.
        let (length, bytes) = match Payload::parse(raw) {
            Payload::Expedited { length, bytes } if row.is_writable_cell() => (length, bytes),
            Payload::Expedited { length, bytes } => {
                let payload = Payload::Expedited { length, bytes };
                return self.initiate_long_download(mux, (slot, facts), payload, values, now);
            }
            Payload::Segmented { size } => {
                return self.initiate_segmented_download(mux, (slot, facts), size, values, now);
            }
        };
        // The usual case first: one comparison.
        if let Some(length) = length
            && length != row.size()
            && let Err(code) = check_length(length.into(), row.size().into())
        {
            self.refuse(mux, code);
            return None;
        }
        Some(Write { slot, raw: u32::from_le_bytes(bytes), facts, mux, confirm: Confirm::Expedited })
    }

    #[inline(never)]
    fn initiate_segmented_download<S: Storage>(
        &mut self,
        mux: Mux,
        (slot, facts): (Slot, &'static RowFacts),
        declared: Option<u32>,
        values: &mut Dictionary<S>,
        now: Instant,
    ) -> Option<Write> {
        let row = facts.summary;
        if !row.is_writable_cell() {
            let payload = Payload::Segmented { size: declared };
            return self.initiate_long_download(mux, (slot, facts), payload, values, now);
        }
        let size = row.size().into();
        match declared.map_or(Ok(()), |declared| check_length(declared as usize, size)) {
            Ok(()) => {
                let room = Room::Cell { bytes: [0; MAX_EXPEDITED], size };
                self.begin_download(mux, (slot, facts), room, declared, now);
            }
            Err(code) => self.refuse(mux, code),
        }
        None
    }

    /// Of a value that is longer than a cell, or may not be written.
    #[inline(never)]
    fn initiate_long_download<S: Storage>(
        &mut self,
        mux: Mux,
        (slot, facts): (Slot, &'static RowFacts),
        payload: Payload,
        values: &mut Dictionary<S>,
        now: Instant,
    ) -> Option<Write> {
        let capacity = values.table().row(slot).stored_bytes() as usize;
        let declared = match payload {
            Payload::Expedited { length, .. } => Some(length.map_or(capacity.min(MAX_EXPEDITED), usize::from)),
            Payload::Segmented { size } => size.map(|size| size as usize),
        };
        let fits = match declared {
            _ if !facts.summary.is_writable() => Err(AbortCode::READ_ONLY),
            Some(length) => values.view().check_length(slot, length),
            None => Ok(()),
        };
        if let Err(code) = fits {
            self.refuse(mux, code);
            return None;
        }
        match payload {
            Payload::Expedited { bytes, .. } => {
                let length = declared.unwrap_or(0).min(MAX_EXPEDITED);
                values.staging_mut(self.number)[..length].copy_from_slice(&bytes[..length]);
                Some(Write { slot, raw: length as u32, facts, mux, confirm: Confirm::Expedited })
            }
            Payload::Segmented { size: declared } => {
                self.begin_download(mux, (slot, facts), Room::Staging { capacity }, declared, now);
                None
            }
        }
    }

    #[inline(never)]
    fn begin_download(
        &mut self,
        mux: Mux,
        (slot, facts): (Slot, &'static RowFacts),
        room: Room,
        declared: Option<u32>,
        now: Instant,
    ) {
        self.transfer = Transfer::Download { mux, slot, facts, room, declared, length: 0, toggle: false };
        self.restart_timeout(now);
        self.answer(Reply::InitiateDownload(mux));
    }

    fn download_segment(&mut self, segment: Segment, staging: &mut [u8], now: Instant) -> Option<Write> {
        let Transfer::Download { mux, slot, facts, room, declared, length, toggle } = &mut self.transfer else {
            self.unexpected();
            return None;
        };
        let (mux, slot, facts, declared) = (*mux, *slot, *facts, *declared);
        if segment.toggle != *toggle {
            self.refuse(mux, AbortCode::TOGGLE_BIT);
            return None;
        }
        let (start, end) = (*length, *length + segment.data().len());
        let most = declared.map_or(usize::MAX, |declared| declared as usize);
        let (to, most) = match room {
            Room::Cell { bytes, size } => (&mut bytes[..], most.min(*size)),
            Room::Staging { capacity } => (staging, most.min(*capacity)),
        };
        if end > most {
            self.refuse(mux, AbortCode::TOO_LONG);
            return None;
        }
        to[start..end].copy_from_slice(segment.data());
        (*length, *toggle) = (end, !segment.toggle);
        if !segment.last {
            self.answer(Reply::DownloadSegment { toggle: segment.toggle });
            self.restart_timeout(now);
            return None;
        }
        // A declared length was checked when the transfer began; fewer bytes came than were declared.
        let (raw, short) = match (*room, declared) {
            (_, Some(declared)) if end < declared as usize => (0, Some(AbortCode::LENGTH_MISMATCH)),
            (Room::Cell { size, .. }, None) if end < size => (0, Some(AbortCode::TOO_SHORT)),
            (Room::Cell { bytes, .. }, _) => (u32::from_le_bytes(bytes), None),
            (Room::Staging { .. }, _) => (end as u32, None),
        };
        self.end();
        if let Some(code) = short {
            self.refuse(mux, code);
            return None;
        }
        Some(Write { slot, raw, facts, mux, confirm: Confirm::Segment { toggle: segment.toggle } })
    }

    /// A segment without a transfer, or of the other direction.
    #[cold]
    fn unexpected(&mut self) {
        let mux = self.transfer_mux().unwrap_or(Mux::new(0, 0));
        self.refuse(mux, AbortCode::UNKNOWN_COMMAND);
    }

    #[inline(never)]
    fn refuse(&mut self, mux: Mux, code: AbortCode) {
        self.end();
        self.answer(Reply::Abort(mux, code));
    }

    #[inline(always)]
    fn answer(&mut self, reply: Reply) {
        self.reply = Some(reply.emit());
    }

    const fn end(&mut self) {
        self.transfer = Transfer::None;
        self.deadline = Instant::FAR_FUTURE;
    }

    fn restart_timeout(&mut self, now: Instant) {
        if self.timeout_ns > 0 {
            self.deadline = now.plus_nanos(self.timeout_ns);
        }
    }

    fn transfer_mux(&self) -> Option<Mux> {
        match &self.transfer {
            Transfer::None | Transfer::Abandoned(_) => None,
            Transfer::Upload { mux, .. }
            | Transfer::Download { mux, .. }
            | Transfer::BlockUpload { mux, .. }
            | Transfer::BlockDownload { mux, .. } => Some(*mux),
            Transfer::Deferred(write) => Some(write.mux),
        }
    }
}

impl UploadSource {
    /// Of a value that is longer than a cell.
    fn of_long<S: Storage>(server: u8, slot: Slot, values: &mut Dictionary<S>) -> Self {
        match values.table().row(slot).constant_bytes() {
            Some(constant) => Self::Constant(constant),
            None => Self::Staged(values.stage(server, slot)),
        }
    }

    fn bytes<'a>(&'a self, server: u8, values: &View<'a>) -> &'a [u8] {
        match self {
            Self::Constant(bytes) => bytes,
            Self::Cell(bytes, length) => &bytes[..usize::from(*length)],
            Self::Staged(length) => values.staged(server, *length),
        }
    }
}

const fn check_length(length: usize, size: usize) -> Result<(), AbortCode> {
    if length > size {
        Err(AbortCode::TOO_LONG)
    } else if length < size {
        Err(AbortCode::TOO_SHORT)
    } else {
        Ok(())
    }
}
