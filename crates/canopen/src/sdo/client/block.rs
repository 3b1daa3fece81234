//! Block transfer of a client (CiA 301, 7.2.4.3.9 to 7.2.4.3.16).

use can::Instant;

use super::{Client, Failure, Outcome, State};
use crate::sdo::block::wire::{ABORT, Reply, Request, Segment};
use crate::sdo::block::{Invalid, MAX_BLOCK_SIZE, Receiver, Sender, Sent};
use crate::sdo::wire::{self, LENGTH};
use crate::{AbortCode, Mux};

impl Client {
    /// As [`upload`](Self::upload), in blocks. A server may answer as if it had been asked for the other upload where the value has up
    /// to `switch_threshold` bytes; with 0 it may not. One without block transfer aborts with 0504 0001h.
    pub fn upload_blocks(&mut self, mux: Mux, switch_threshold: u8, now: Instant) {
        let request = Request::InitiateUpload { mux, checksum: true, block_size: MAX_BLOCK_SIZE, switch_threshold };
        self.ask_raw(request.emit(), State::BlockUpload { mux }, now);
    }

    /// As [`download`](Self::download), in blocks. A server without block transfer aborts with 0504 0001h.
    pub fn download_blocks(&mut self, mux: Mux, data: &[u8], now: Instant) {
        let request = Request::InitiateDownload { mux, checksum: true, size: Some(data.len() as u32) };
        self.ask_raw(request.emit(), State::BlockDownload { mux }, now);
    }

    /// The upload that was begun is begun anew in blocks, before anything of the value has come; the server is sent an abort. False if
    /// it is further than that.
    pub fn begin_in_blocks(&mut self, now: Instant) -> bool {
        let State::Upload { mux } = self.state else { return false };
        self.closing = Some(wire::Request::Abort(mux, AbortCode::GENERAL).emit());
        self.upload_blocks(mux, 0, now);
        true
    }

    /// True while segments of an upload in blocks come: they do not say what they are.
    pub const fn takes_segments(&self) -> bool {
        matches!(self.state, State::UploadBlocks { .. })
    }

    /// How many bytes of a transfer in more than one frame are done for certain; `None` if none is under way.
    pub fn bytes_done(&self) -> Option<usize> {
        match &self.state {
            State::UploadBlocks { receiver, .. } => Some(receiver.written()),
            State::DownloadBlocks { sender, .. } => Some(sender.confirmed_bytes()),
            State::UploadSegments { received, .. } => Some(*received),
            State::DownloadSegments { sent, .. } => Some(sent.saturating_sub(wire::MAX_SEGMENT)),
            _ => None,
        }
    }

    pub(super) fn next_segment(&mut self, data: &[u8]) -> Option<[u8; LENGTH]> {
        match &mut self.state {
            State::DownloadBlocks { sender, .. } => sender.segment(data),
            _ => None,
        }
    }

    /// True for a segment that the server of an upload has sent before it saw that the upload was given up.
    pub(super) fn is_stray(&mut self, raw: &[u8; LENGTH]) -> bool {
        let next = self.abandoned.take().map(|seen| seen + 1).filter(|next| Segment::parse(raw).sequence == *next);
        self.abandoned = next;
        next.is_some()
    }

    /// The server agrees to an upload.
    pub(super) fn begin_block_upload(
        &mut self,
        mux: Mux,
        raw: &[u8; LENGTH],
        buffer: &[u8],
        now: Instant,
    ) -> Result<Option<Outcome>, Failure> {
        let Some(Reply::InitiateUpload { mux: received, checksum, size }) = Reply::parse(raw) else {
            return Err(Failure::UnexpectedReply { mux, command: raw[0] });
        };
        super::expect_mux(mux, received)?;
        let declared = self.begin_long_upload(mux, size, buffer, now)?;
        let receiver = Receiver::new(checksum, MAX_BLOCK_SIZE);
        self.ask_raw(Request::StartUpload.emit(), State::UploadBlocks { mux, declared, receiver }, now);
        self.wait_for_segment(now);
        Ok(None)
    }

    /// A segment of an upload, or what follows the last one.
    pub(super) fn take_of_blocks(
        &mut self,
        raw: &[u8; LENGTH],
        buffer: &mut [u8],
        now: Instant,
    ) -> Result<Option<Outcome>, Failure> {
        let State::UploadBlocks { mux, declared, receiver } = &mut self.state else { return Ok(None) };
        let mux = *mux;
        if raw[0] == ABORT
            && let wire::Reply::Abort(_, code) = wire::Reply::parse(raw)
        {
            return Err(Failure::Aborted { mux, code });
        }
        if receiver.is_complete() {
            return if receiver.repeats(raw) { Ok(None) } else { self.end_block_upload(raw, buffer) };
        }
        let declared = *declared;
        let most = declared.map_or(buffer.len(), |declared| declared.min(buffer.len()));
        let taken = receiver.take(raw, &mut buffer[..most]);
        let confirmation = taken.map_err(|invalid| failure_of(invalid, mux, declared, 0))?;
        if let Some(confirmation) = confirmation {
            self.request = Some(Request::Acknowledge(confirmation).emit());
        }
        self.wait_for_segment(now);
        Ok(None)
    }

    fn end_block_upload(&mut self, raw: &[u8; LENGTH], buffer: &mut [u8]) -> Result<Option<Outcome>, Failure> {
        let State::UploadBlocks { mux, declared, receiver } = self.state else { return Ok(None) };
        let Some(Reply::EndUpload(end)) = Reply::parse(raw) else {
            return Err(Failure::UnexpectedReply { mux, command: raw[0] });
        };
        let most = declared.map_or(buffer.len(), |declared| declared.min(buffer.len()));
        let finished = receiver.finish(end, &mut buffer[..most]);
        let length = finished.map_err(|invalid| failure_of(invalid, mux, declared, 0))?;
        if let Some(declared) = declared.filter(|declared| *declared != length) {
            return Err(Failure::LengthMismatch { mux, declared, received: length });
        }
        self.closing = Some(Request::EndUpload.emit());
        Ok(Some(Outcome::Uploaded { mux, length }))
    }

    /// A reply to a download.
    pub(super) fn advance_block_download(
        &mut self,
        mux: Mux,
        raw: &[u8; LENGTH],
        data: &[u8],
        now: Instant,
    ) -> Result<Option<Outcome>, Failure> {
        match (&mut self.state, Reply::parse(raw)) {
            (State::BlockDownload { .. }, Some(Reply::InitiateDownload { mux: received, checksum, block_size })) => {
                super::expect_mux(mux, received)?;
                let sender = Sender::new(data.len(), checksum, block_size)
                    .ok_or(Failure::BlockSize { mux, segments: block_size })?;
                self.deadline = now.plus_nanos(sender.wire_time_ns()) + self.timeout;
                self.state = State::DownloadBlocks { mux, sender };
                Ok(None)
            }
            (State::DownloadBlocks { sender, .. }, Some(Reply::Acknowledge(confirmation))) => {
                let confirmed = sender.confirmed_bytes();
                match sender.confirm(confirmation).map_err(|invalid| failure_of(invalid, mux, None, confirmed))? {
                    Sent::Part => self.deadline = now.plus_nanos(sender.wire_time_ns()) + self.timeout,
                    Sent::All => {
                        let end = Request::EndDownload(sender.end());
                        self.ask_raw(end.emit(), State::BlocksSent { mux }, now);
                    }
                }
                Ok(None)
            }
            // Once more, as a wire may repeat it.
            (State::DownloadBlocks { sender, .. }, Some(Reply::InitiateDownload { mux: received, .. }))
                if received == mux && sender.confirmed_bytes() == 0 =>
            {
                Ok(None)
            }
            (State::BlocksSent { .. }, Some(Reply::Acknowledge(_))) => Ok(None),
            (State::BlocksSent { .. }, Some(Reply::EndDownload)) => Ok(Some(Outcome::Downloaded { mux })),
            _ => Err(Failure::UnexpectedReply { mux, command: raw[0] }),
        }
    }

    /// Half of the server's time is over: what has come of a block is confirmed, since its end may be lost.
    pub(super) fn confirms_early(&mut self, now: Instant) -> bool {
        let State::UploadBlocks { receiver, .. } = &mut self.state else { return false };
        if !receiver.waits_on() {
            return false;
        }
        if let Some(confirmation) = receiver.confirm_early() {
            self.request = Some(Request::Acknowledge(confirmation).emit());
        }
        self.wait_for_segment(now);
        true
    }

    fn wait_for_segment(&mut self, now: Instant) {
        self.deadline = now.plus_nanos(self.half_timeout_ns).min(self.ends_at);
    }
}

/// What a transfer ends with where something is wrong with its segments or confirmations.
fn failure_of(invalid: Invalid, mux: Mux, declared: Option<usize>, confirmed: usize) -> Failure {
    match (invalid, declared) {
        (Invalid::Sequence(sequence), _) => Failure::SequenceNumber { mux, sequence },
        (Invalid::BlockSize(segments), _) => Failure::BlockSize { mux, segments },
        (Invalid::Stalled, _) => Failure::Stalled { mux, confirmed },
        (Invalid::TooLong(received), Some(declared)) => Failure::LengthMismatch { mux, declared, received },
        (Invalid::TooLong(needed), None) => Failure::BufferTooSmall { mux, needed },
        (Invalid::Checksum, _) => Failure::Checksum { mux },
    }
}
