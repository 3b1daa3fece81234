//! Block transfer of a server (CiA 301, 7.2.4.3.9 to 7.2.4.3.16).

use can::{Frame, Instant};

use super::{BlockUploadPhase, Confirm, Room, Server, SubBlockFrame, Transfer, UploadSource, Write, check_length};
use crate::od::{Dictionary, RowFacts, Slot, Storage, View};
use crate::sdo::block::wire::{ABORT, Acknowledgement, End, Reply, Request, Segment};
use crate::sdo::block::{Receiver, Sender, Sent, is_block_size};
use crate::sdo::wire::{LENGTH, MAX_EXPEDITED};
use crate::{AbortCode, Mux};

impl Server {
    /// True while segments of an upload are to be sent: [`take_segment`](Self::take_segment).
    pub const fn has_segment(&self) -> bool {
        matches!(&self.transfer, Transfer::BlockUpload { sender, phase: BlockUploadPhase::Segments, .. } if sender.has_segment())
    }

    /// Takes the next segment of an upload, after the reply if one waits.
    pub fn take_segment(&mut self, values: &View<'_>) -> Option<[u8; LENGTH]> {
        match &mut self.transfer {
            Transfer::BlockUpload { source, sender, phase: BlockUploadPhase::Segments, .. } => {
                sender.segment(source.bytes(self.number, values))
            }
            _ => None,
        }
    }

    /// A request that only block transfer has. Segments of a download do not come here.
    pub(super) fn take_block_request<S: Storage>(
        &mut self,
        raw: &[u8; LENGTH],
        values: &mut Dictionary<S>,
        now: Instant,
    ) {
        match Request::parse(raw) {
            Some(Request::InitiateDownload { mux, checksum, size }) => {
                self.initiate_block_download(mux, checksum, size, values, now);
            }
            Some(Request::InitiateUpload { mux, checksum, block_size, switch_threshold }) => {
                self.initiate_block_upload(mux, checksum, (block_size, switch_threshold), values, now);
            }
            Some(Request::StartUpload) => self.start_block_upload(now),
            Some(Request::Acknowledge(confirmation)) => self.take_confirmation(confirmation, now),
            Some(Request::EndUpload) => match self.transfer {
                Transfer::BlockUpload { phase: BlockUploadPhase::Ended, .. } => self.end(),
                // It answers nothing that was asked: once more, say, as a wire may repeat it.
                Transfer::None => {}
                _ => self.unexpected(),
            },
            Some(Request::EndDownload(_)) => self.unexpected(),
            None => {
                let mux = self.transfer_mux().unwrap_or(Mux::new(u16::from_le_bytes([raw[1], raw[2]]), raw[3]));
                self.refuse(mux, AbortCode::UNKNOWN_COMMAND);
            }
        }
    }

    fn initiate_block_upload<S: Storage>(
        &mut self,
        mux: Mux,
        checksum: bool,
        (block_size, switch_threshold): (u8, u8),
        values: &mut Dictionary<S>,
        now: Instant,
    ) {
        self.end();
        if !is_block_size(block_size) {
            return self.refuse(mux, AbortCode::INVALID_BLOCK_SIZE);
        }
        let (slot, facts) = match values.table().look_up(mux) {
            Ok(found) => found,
            Err(code) => return self.refuse(mux, code),
        };
        if !facts.summary.is_readable() {
            return self.refuse(mux, AbortCode::WRITE_ONLY);
        }
        if values.view().length(slot) <= usize::from(switch_threshold) {
            return self.initiate_upload(mux, values, now);
        }
        let source = if facts.summary.is_long() {
            UploadSource::of_long(self.number, slot, values)
        } else {
            UploadSource::Cell(values.raw(slot).to_le_bytes(), facts.summary.size())
        };
        let length = source.bytes(self.number, &values.view()).len();
        let Some(sender) = Sender::new(length, checksum, block_size) else {
            return self.refuse(mux, AbortCode::INVALID_BLOCK_SIZE);
        };
        self.transfer = Transfer::BlockUpload { mux, source, sender, phase: BlockUploadPhase::Agreed };
        self.restart_timeout(now);
        // That it could form one is said to a client only that can, too: some look at this bit alone.
        self.answer_block(Reply::InitiateUpload { mux, checksum, size: Some(length as u32) });
    }

    fn start_block_upload(&mut self, now: Instant) {
        match &mut self.transfer {
            Transfer::BlockUpload { phase: phase @ BlockUploadPhase::Agreed, sender, .. } => {
                *phase = BlockUploadPhase::Segments;
                let wire_time_ns = sender.wire_time_ns();
                self.allow(wire_time_ns, now);
            }
            // Once more, as a wire may repeat it.
            Transfer::BlockUpload { phase: BlockUploadPhase::Segments, sender, .. }
                if sender.confirmed_bytes() == 0 => {}
            _ => self.unexpected(),
        }
    }

    fn take_confirmation(&mut self, confirmation: Acknowledgement, now: Instant) {
        let Transfer::BlockUpload { mux, sender, phase: phase @ BlockUploadPhase::Segments, .. } = &mut self.transfer
        else {
            return self.unexpected();
        };
        match sender.confirm(confirmation) {
            Ok(Sent::Part) => {
                let wire_time_ns = sender.wire_time_ns();
                self.allow(wire_time_ns, now);
            }
            Ok(Sent::All) => {
                *phase = BlockUploadPhase::Ended;
                let end = sender.end();
                self.restart_timeout(now);
                self.answer_block(Reply::EndUpload(end));
            }
            Err(invalid) => {
                let mux = *mux;
                self.refuse(mux, invalid.abort_code());
            }
        }
    }

    fn initiate_block_download<S: Storage>(
        &mut self,
        mux: Mux,
        checksum: bool,
        declared: Option<u32>,
        values: &mut Dictionary<S>,
        now: Instant,
    ) {
        self.end();
        match room_for(mux, declared, values) {
            Err(code) => self.refuse(mux, code),
            Ok((slot, facts, room)) => {
                let receiver = Receiver::new(checksum, self.block_size);
                self.transfer = Transfer::BlockDownload { mux, slot, facts, room, declared, receiver };
                self.takes_segments = true;
                self.restart_half_timeout(now);
                self.answer_block(Reply::InitiateDownload { mux, checksum, block_size: self.block_size });
            }
        }
    }

    /// A frame in a download of blocks, or after one that was given up.
    #[cold]
    #[inline(never)]
    pub(super) fn take_in_download<S: Storage>(
        &mut self,
        frame: &Frame,
        values: &mut Dictionary<S>,
        now: Instant,
    ) -> SubBlockFrame {
        let raw = frame.padded();
        match &mut self.transfer {
            // No segment has this number: the client gives up.
            Transfer::BlockDownload { .. } if raw[0] == ABORT => self.end(),
            Transfer::BlockDownload { receiver, .. } if receiver.is_complete() => {
                if !receiver.repeats(raw) {
                    return self.end_block_download(raw, values);
                }
            }
            Transfer::BlockDownload { .. } => self.take_segment_of_block(raw, values, now),
            Transfer::Abandoned(sequence) if Segment::parse(raw).sequence == *sequence + 1 => *sequence += 1,
            Transfer::Abandoned(_) => {
                self.end();
                return self.take_no_segments();
            }
            _ => return self.take_no_segments(),
        }
        SubBlockFrame::Here(None)
    }

    fn take_no_segments(&mut self) -> SubBlockFrame {
        self.takes_segments = false;
        SubBlockFrame::Another
    }

    fn take_segment_of_block<S: Storage>(&mut self, raw: &[u8; LENGTH], values: &mut Dictionary<S>, now: Instant) {
        let Transfer::BlockDownload { mux, room, declared, receiver, .. } = &mut self.transfer else { return };
        let (mux, taken) = (*mux, receiver.take(raw, room.bytes(*declared, values.staging_mut(self.number))));
        match taken {
            Ok(confirmation) => {
                self.restart_half_timeout(now);
                if let Some(confirmation) = confirmation {
                    self.answer_block(Reply::Acknowledge(confirmation));
                }
            }
            Err(invalid) => self.abandon(mux, invalid.abort_code()),
        }
    }

    /// After the last segment: the end of the data, or another request.
    fn end_block_download<S: Storage>(&mut self, raw: &[u8; LENGTH], values: &mut Dictionary<S>) -> SubBlockFrame {
        let transfer = core::mem::replace(&mut self.transfer, Transfer::None);
        self.end();
        let (
            Some(Request::EndDownload(end)),
            Transfer::BlockDownload { mux, slot, facts, mut room, declared, receiver },
        ) = (Request::parse(raw), transfer)
        else {
            return SubBlockFrame::Another;
        };
        match finish(&receiver, &mut room, declared, end, values.staging_mut(self.number)) {
            Ok(raw) => SubBlockFrame::Here(Some(Write { slot, raw, facts, mux, confirm: Confirm::Block })),
            Err(code) => {
                self.refuse(mux, code);
                SubBlockFrame::Here(None)
            }
        }
    }

    #[cold]
    pub(super) fn confirm_block_download(&mut self) {
        self.answer_block(Reply::EndDownload);
    }

    /// Half of the client's time is over: what has come of a block is confirmed, since its end may be lost.
    #[cold]
    pub(super) fn confirms_early(&mut self, now: Instant) -> bool {
        let Transfer::BlockDownload { mux, receiver, .. } = &mut self.transfer else { return false };
        if !receiver.waits_on() {
            let mux = *mux;
            self.abandon(mux, AbortCode::TIMED_OUT);
            return true;
        }
        let confirmation = receiver.confirm_early();
        self.deadline = now.plus_nanos(self.timeout_ns / 2);
        if let Some(confirmation) = confirmation {
            self.answer_block(Reply::Acknowledge(confirmation));
        }
        true
    }

    /// Gives up a download whose client may be in the midst of a block.
    fn abandon(&mut self, mux: Mux, code: AbortCode) {
        let seen = match &self.transfer {
            Transfer::BlockDownload { receiver, .. } if !receiver.is_complete() => Some(receiver.seen()),
            _ => None,
        };
        self.refuse(mux, code);
        if let Some(seen) = seen {
            self.transfer = Transfer::Abandoned(seen);
        }
    }

    #[inline(never)]
    fn answer_block(&mut self, reply: Reply) {
        self.reply = Some(reply.emit());
    }

    /// The client's time, and what the segments of a block take on the wire before.
    fn allow(&mut self, wire_time_ns: u64, now: Instant) {
        if self.timeout_ns > 0 {
            self.deadline = now.plus_nanos(self.timeout_ns.saturating_add(wire_time_ns));
        }
    }

    fn restart_half_timeout(&mut self, now: Instant) {
        if self.timeout_ns > 0 {
            self.deadline = now.plus_nanos(self.timeout_ns / 2);
        }
    }
}

/// Where the value of a download goes that declares as many bytes.
fn room_for<S: Storage>(
    mux: Mux,
    declared: Option<u32>,
    values: &Dictionary<S>,
) -> Result<(Slot, &'static RowFacts, Room), AbortCode> {
    let (slot, facts) = values.table().look_up(mux)?;
    let summary = facts.summary;
    if !summary.is_writable() {
        return Err(AbortCode::READ_ONLY);
    }
    if summary.is_long() {
        declared.map_or(Ok(()), |length| values.view().check_length(slot, length as usize))?;
        return Ok((slot, facts, Room::Staging { capacity: values.table().row(slot).stored_bytes() as usize }));
    }
    let size = summary.size().into();
    declared.map_or(Ok(()), |length| check_length(length as usize, size))?;
    Ok((slot, facts, Room::Cell { bytes: [0; MAX_EXPEDITED], size }))
}

/// What there is to write once all has come.
fn finish(
    receiver: &Receiver,
    room: &mut Room,
    declared: Option<u32>,
    end: End,
    staging: &mut [u8],
) -> Result<u32, AbortCode> {
    let length = receiver.finish(end, room.bytes(declared, staging)).map_err(|invalid| invalid.abort_code())?;
    match room {
        _ if declared.is_some_and(|declared| length < declared as usize) => Err(AbortCode::LENGTH_MISMATCH),
        Room::Cell { size, .. } if length < *size => Err(AbortCode::TOO_SHORT),
        Room::Cell { bytes, .. } => Ok(u32::from_le_bytes(*bytes)),
        Room::Staging { .. } => Ok(length as u32),
    }
}

impl Room {
    /// As much of the room as a value may have that declares as many bytes.
    fn bytes<'a>(&'a mut self, declared: Option<u32>, staging: &'a mut [u8]) -> &'a mut [u8] {
        let (room, most) = match self {
            Self::Cell { bytes, size } => (&mut bytes[..], *size),
            Self::Staging { capacity } => (staging, *capacity),
        };
        let most = declared.map_or(most, |declared| most.min(declared as usize)).min(room.len());
        &mut room[..most]
    }
}
