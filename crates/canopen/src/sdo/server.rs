//! The SDO server of a device: expedited and segmented transfer (CiA 301, 7.2.4).
//!
//! A frame goes in with a view of the values; out come a reply, or for a complete download the entry to write,
//! which the owner checks, stores and reports back with [`Server::finish`]. One transfer at a time: a new request
//! replaces an unfinished one. Block transfer is answered with 0504 0001h.

use can::{Frame, Instant};

use super::wire::{LENGTH, MAX_EXPEDITED, MAX_SEGMENT, Payload, Reply, Request, Segment};
use crate::od::{Slot, Table, View};
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Write {
    /// The entry.
    pub slot: Slot,
    /// The value to store, in as many low bytes as the entry has; what stands above them means nothing.
    pub raw: u32,
    mux: Mux,
    confirm: Confirm,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Confirm {
    Expedited,
    Segment { toggle: bool },
}

/// One server channel.
#[derive(Clone, Debug)]
pub struct Server {
    transfer: Transfer,
    reply: Option<[u8; LENGTH]>,
    deadline: Instant,
    timeout_ns: u64,
    frame_length: FrameLength,
}

/// A segmented transfer under way.
#[derive(Clone, Debug)]
enum Transfer {
    None,
    Upload { mux: Mux, rest: &'static [u8], toggle: bool },
    Download { mux: Mux, slot: Slot, declared: Option<u32>, bytes: [u8; MAX_EXPEDITED], length: usize, toggle: bool },
}

impl Server {
    /// A server with nothing under way. A segmented transfer whose client is silent for `timeout_ns` is aborted with
    /// 0504 0000h; 0 waits forever.
    pub const fn new(frame_length: FrameLength, timeout_ns: u64) -> Self {
        Self { transfer: Transfer::None, reply: None, deadline: Instant::FAR_FUTURE, timeout_ns, frame_length }
    }

    /// A request arrived. Returns the write that the owner has to carry out, if it completes a download.
    #[inline]
    pub fn handle_frame(&mut self, frame: &Frame, values: &View<'_>, now: Instant) -> Option<Write> {
        if !self.listens_to(frame) {
            return None;
        }
        match Request::parse(frame.padded()) {
            Request::InitiateUpload(mux) => self.initiate_upload(mux, values, now),
            Request::InitiateDownload(mux, payload) => {
                return self.initiate_download(mux, payload, values.table(), now);
            }
            Request::UploadSegment { toggle } => self.upload_segment(toggle, now),
            Request::DownloadSegment(segment) => return self.download_segment(segment, values.table(), now),
            Request::Abort(..) => self.end(),
            Request::Unknown { mux, .. } => {
                let mux = self.transfer_mux().unwrap_or(mux);
                self.refuse(mux, AbortCode::UNKNOWN_COMMAND);
            }
        }
        None
    }

    /// The owner stored `write`, or refuses it: confirms or aborts.
    #[inline]
    pub fn finish(&mut self, write: Write, result: Result<(), AbortCode>) {
        self.reply = Some(
            match (result, write.confirm) {
                (Ok(()), Confirm::Expedited) => Reply::InitiateDownload(write.mux),
                (Ok(()), Confirm::Segment { toggle }) => Reply::DownloadSegment { toggle },
                (Err(code), _) => Reply::Abort(write.mux, code),
            }
            .emit(),
        );
    }

    /// Time has reached `now`: aborts a transfer whose client has gone silent.
    pub fn handle_timeout(&mut self, now: Instant) {
        if now >= self.deadline
            && let Some(mux) = self.transfer_mux()
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

    /// Takes the reply.
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

    fn initiate_upload(&mut self, mux: Mux, values: &View<'_>, now: Instant) {
        self.end();
        let table = values.table();
        let slot = match table.find(mux) {
            Ok(slot) => slot,
            Err(code) => return self.refuse(mux, code),
        };
        let row = table.summary(slot);
        if !row.is_readable() {
            return self.refuse(mux, AbortCode::WRITE_ONLY);
        }
        if row.is_long() {
            let bytes = table.row(slot).constant_bytes().unwrap_or_default();
            return self.initiate_text(mux, bytes, now);
        }
        let length = row.size();
        let bytes = values.raw(slot).to_le_bytes();
        self.answer(Reply::InitiateUpload(mux, Payload::Expedited { length: Some(length), bytes }));
    }

    #[inline(never)]
    fn initiate_text(&mut self, mux: Mux, text: &'static [u8], now: Instant) {
        if let Some(payload) = Payload::expedited(text) {
            return self.answer(Reply::InitiateUpload(mux, payload));
        }
        self.transfer = Transfer::Upload { mux, rest: text, toggle: false };
        self.restart_timeout(now);
        self.answer(Reply::InitiateUpload(mux, Payload::Segmented { size: Some(text.len() as u32) }));
    }

    fn upload_segment(&mut self, toggle: bool, now: Instant) {
        let Transfer::Upload { mux, rest, toggle: expected } = &mut self.transfer else { return self.unexpected() };
        if toggle != *expected {
            let mux = *mux;
            return self.refuse(mux, AbortCode::TOGGLE_BIT);
        }
        let (data, after) = rest.split_at(rest.len().min(MAX_SEGMENT));
        let last = after.is_empty();
        (*rest, *expected) = (after, !toggle);
        self.answer(Reply::UploadSegment(Segment::new(toggle, last, data)));
        if last {
            self.end();
        } else {
            self.restart_timeout(now);
        }
    }

    // Inlined, the payload stays in registers.
    #[inline(always)]
    fn initiate_download(&mut self, mux: Mux, payload: Payload, table: &Table, now: Instant) -> Option<Write> {
        self.end();
        let (slot, size) = match writable(mux, table) {
            Ok(found) => found,
            Err(code) => {
                self.refuse(mux, code);
                return None;
            }
        };
        let declared = match payload {
            Payload::Expedited { length, .. } => length.map(u32::from),
            Payload::Segmented { size } => size,
        };
        if let Err(code) = declared.map_or(Ok(()), |declared| check_length(declared as usize, size)) {
            self.refuse(mux, code);
            return None;
        }
        match payload {
            Payload::Expedited { bytes, .. } => {
                Some(Write { slot, raw: u32::from_le_bytes(bytes), mux, confirm: Confirm::Expedited })
            }
            Payload::Segmented { size: declared } => {
                self.begin_download(mux, slot, declared, now);
                None
            }
        }
    }

    #[inline(never)]
    fn begin_download(&mut self, mux: Mux, slot: Slot, declared: Option<u32>, now: Instant) {
        let bytes = [0; MAX_EXPEDITED];
        self.transfer = Transfer::Download { mux, slot, declared, bytes, length: 0, toggle: false };
        self.restart_timeout(now);
        self.answer(Reply::InitiateDownload(mux));
    }

    #[inline(never)]
    fn download_segment(&mut self, segment: Segment, table: &Table, now: Instant) -> Option<Write> {
        let Transfer::Download { mux, slot, declared, bytes, length, toggle } = &mut self.transfer else {
            self.unexpected();
            return None;
        };
        let (mux, slot) = (*mux, *slot);
        let size = table.row(slot).data_type.size();
        if segment.toggle != *toggle {
            self.refuse(mux, AbortCode::TOGGLE_BIT);
            return None;
        }
        let end = *length + segment.data().len();
        if end > size {
            self.refuse(mux, AbortCode::TOO_LONG);
            return None;
        }
        bytes[*length..end].copy_from_slice(segment.data());
        (*length, *toggle) = (end, !segment.toggle);
        if !segment.last {
            self.answer(Reply::DownloadSegment { toggle: segment.toggle });
            self.restart_timeout(now);
            return None;
        }
        // A declared length was the object's when the transfer began; fewer bytes came than were declared.
        let short = if declared.is_some() { AbortCode::LENGTH_MISMATCH } else { AbortCode::TOO_SHORT };
        let raw = u32::from_le_bytes(*bytes);
        self.end();
        if end < size {
            self.refuse(mux, short);
            return None;
        }
        Some(Write { slot, raw, mux, confirm: Confirm::Segment { toggle: segment.toggle } })
    }

    /// A segment without a transfer, or of the other direction.
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
        match self.transfer {
            Transfer::None => None,
            Transfer::Upload { mux, .. } | Transfer::Download { mux, .. } => Some(mux),
        }
    }
}

/// The entry to write and its length in bytes.
fn writable(mux: Mux, table: &Table) -> Result<(Slot, usize), AbortCode> {
    let slot = table.find(mux)?;
    let row = table.summary(slot);
    if row.is_writable() { Ok((slot, usize::from(row.size()))) } else { Err(AbortCode::READ_ONLY) }
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
