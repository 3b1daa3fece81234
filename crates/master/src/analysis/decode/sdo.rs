use core::fmt;
use std::collections::BTreeMap;

use canopen::sdo::wire::{LENGTH, Payload, Reply, Request, Segment};
use canopen::{AbortCode, Mux, NodeId};

use super::block::{Block, BlockStep};
use super::step::{MAX_OBJECT, SdoStep, Side};
use super::value::{DecodedValue, write_name};
use crate::identify::Model;

/// One frame of an SDO transfer.
#[derive(Clone, Debug)]
pub struct Sdo {
    /// The device.
    pub node: NodeId,
    /// Who sent the frame.
    pub from: Side,
    /// What it does in its transfer.
    pub step: SdoStep,
    pub(super) model: Option<Model>,
}

/// The transfers under way, one per node.
#[derive(Clone, Debug, Default)]
pub(super) struct Conversations {
    transfers: BTreeMap<u8, Transfer>,
    blocks: BTreeMap<u8, Block>,
}

#[derive(Clone, Debug)]
struct Transfer {
    mux: Mux,
    bytes: Vec<u8>,
    writes: bool,
    complete: bool,
}

impl Conversations {
    pub(super) fn step(&mut self, node: NodeId, from: Side, raw: &[u8; LENGTH]) -> SdoStep {
        if let Some(step) = self.block(node.raw(), from, raw) {
            return step;
        }
        match from {
            Side::Client => self.request(node.raw(), Request::parse(raw)),
            Side::Server => self.reply(node.raw(), Reply::parse(raw)),
        }
    }

    /// What a frame does in a block transfer; `None` if it belongs to none.
    fn block(&mut self, node: u8, from: Side, raw: &[u8; LENGTH]) -> Option<SdoStep> {
        // First the transfer under way: the last segment of a block may look as the beginning of another transfer does.
        match self.blocks.get_mut(&node).map(|block| block.step(from, raw)) {
            Some(BlockStep::Goes(step)) => return Some(step),
            Some(BlockStep::Over(step)) => {
                self.blocks.remove(&node);
                return Some(step);
            }
            // A device may answer a block upload with a plain one (CiA 301, 7.2.4.3.12), and a client may begin anew.
            Some(BlockStep::NotPart) => drop(self.blocks.remove(&node)),
            None => {}
        }
        let block = Block::begin(from, raw)?;
        let step = SdoStep::BlockBegin(block.mux(), block.size());
        self.transfers.remove(&node);
        self.blocks.insert(node, block);
        Some(step)
    }

    fn request(&mut self, node: u8, request: Request) -> SdoStep {
        match request {
            Request::InitiateUpload(mux) => {
                self.begin(node, mux, false);
                SdoStep::Read(mux)
            }
            Request::InitiateDownload(mux, Payload::Expedited { length, bytes }) => {
                let bytes = bytes[..usize::from(length.unwrap_or(4)).min(4)].to_vec();
                self.transfers.insert(node, Transfer { mux, bytes: bytes.clone(), writes: true, complete: true });
                SdoStep::Write(mux, bytes)
            }
            Request::InitiateDownload(mux, Payload::Segmented { size }) => {
                self.begin(node, mux, true);
                SdoStep::Begin(mux, size)
            }
            Request::DownloadSegment(segment) => self.segment(node, true, &segment),
            Request::UploadSegment { .. } => match self.transfers.get(&node).filter(|transfer| !transfer.writes) {
                Some(transfer) => SdoStep::Segment(transfer.mux, transfer.bytes.len()),
                None => SdoStep::Stray,
            },
            Request::Abort(mux, code) => self.abort(node, mux, code),
            Request::Unknown { command, .. } => SdoStep::Other(command),
        }
    }

    fn reply(&mut self, node: u8, reply: Reply) -> SdoStep {
        match reply {
            Reply::InitiateUpload(mux, Payload::Expedited { length, bytes }) => {
                self.transfers.remove(&node);
                SdoStep::ReadDone(mux, bytes[..usize::from(length.unwrap_or(4)).min(4)].to_vec())
            }
            Reply::InitiateUpload(mux, Payload::Segmented { size }) => {
                self.begin(node, mux, false);
                SdoStep::Begin(mux, size)
            }
            Reply::UploadSegment(segment) => self.segment(node, false, &segment),
            Reply::InitiateDownload(mux) => match self.transfers.get(&node).filter(|transfer| transfer.writes) {
                Some(transfer) if transfer.complete && transfer.mux == mux => self.write_done(node),
                Some(_) => SdoStep::Segment(mux, 0),
                None => SdoStep::Stray,
            },
            Reply::DownloadSegment { .. } => match self.transfers.get(&node).filter(|transfer| transfer.writes) {
                Some(transfer) if transfer.complete => self.write_done(node),
                Some(transfer) => SdoStep::Segment(transfer.mux, transfer.bytes.len()),
                None => SdoStep::Stray,
            },
            Reply::Abort(mux, code) => self.abort(node, mux, code),
            Reply::Unknown { command, .. } => SdoStep::Other(command),
        }
    }

    fn begin(&mut self, node: u8, mux: Mux, writes: bool) {
        self.transfers.insert(node, Transfer { mux, bytes: Vec::new(), writes, complete: false });
    }

    fn segment(&mut self, node: u8, writes: bool, segment: &Segment) -> SdoStep {
        let Some(transfer) = self.transfers.get_mut(&node).filter(|transfer| transfer.writes == writes) else {
            return SdoStep::Stray;
        };
        if transfer.bytes.len() < MAX_OBJECT {
            transfer.bytes.extend_from_slice(segment.data());
        }
        if !segment.last {
            return SdoStep::Segment(transfer.mux, transfer.bytes.len());
        }
        transfer.complete = true;
        let (mux, bytes) = (transfer.mux, transfer.bytes.clone());
        if writes {
            return SdoStep::Write(mux, bytes);
        }
        self.transfers.remove(&node);
        SdoStep::ReadDone(mux, bytes)
    }

    fn write_done(&mut self, node: u8) -> SdoStep {
        self.transfers.remove(&node).map_or(SdoStep::Stray, |transfer| SdoStep::WriteDone(transfer.mux, transfer.bytes))
    }

    fn abort(&mut self, node: u8, mux: Mux, code: AbortCode) -> SdoStep {
        self.transfers.remove(&node);
        SdoStep::Abort(mux, code)
    }
}

impl Sdo {
    /// The whole transfer in words, from the frame that ends it: what was read or written, or why not. `None` before.
    pub fn transfer(&self) -> Option<String> {
        let Self { node, step, .. } = self;
        let value = |mux, bytes| DecodedValue::new(mux, bytes, self.model.map(|model| model.0));
        match step {
            SdoStep::ReadDone(mux, bytes) => Some(format!("SDO node {node}: read {}", value(*mux, bytes))),
            SdoStep::WriteDone(mux, bytes) => Some(format!("SDO node {node}: wrote {}", value(*mux, bytes))),
            SdoStep::Abort(..) | SdoStep::BadChecksum { .. } => Some(self.to_string()),
            _ => None,
        }
    }
}

impl fmt::Display for Sdo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.map(|model| model.0);
        let named = |f: &mut fmt::Formatter<'_>, mux| write_name(f, mux, model);
        write!(f, "SDO node {}: ", self.node)?;
        match &self.step {
            SdoStep::Read(mux) => {
                f.write_str("read ")?;
                named(f, *mux)
            }
            SdoStep::ReadDone(mux, bytes) => DecodedValue::new(*mux, bytes, model).fmt(f),
            SdoStep::Write(mux, bytes) => write!(f, "write {}", DecodedValue::new(*mux, bytes, model)),
            SdoStep::WriteDone(mux, _) => {
                f.write_str("done: write ")?;
                named(f, *mux)
            }
            SdoStep::Begin(mux, size) => {
                f.write_str("segmented transfer of ")?;
                named(f, *mux)?;
                size.map_or(Ok(()), |size| write!(f, ", {size} bytes"))
            }
            SdoStep::Segment(mux, so_far) => {
                f.write_str("segment of ")?;
                named(f, *mux)?;
                write!(f, ", {so_far} bytes so far")
            }
            SdoStep::BlockBegin(mux, size) => {
                f.write_str("block transfer of ")?;
                named(f, *mux)?;
                size.map_or(Ok(()), |size| write!(f, ", {size} bytes"))
            }
            SdoStep::BlockSegment(mux, number, so_far) => {
                write!(f, "block segment {number} of ")?;
                named(f, *mux)?;
                write!(f, ", {so_far} bytes so far")
            }
            SdoStep::BlockConfirmed(mux, number) => {
                write!(f, "confirmed up to block segment {number} of ")?;
                named(f, *mux)
            }
            SdoStep::BlockAgreed(mux) => {
                f.write_str("agreed: block transfer of ")?;
                named(f, *mux)
            }
            SdoStep::BadChecksum { mux, said, found } => {
                f.write_str("block transfer of ")?;
                named(f, *mux)?;
                write!(f, ": its checksum is {found:04X}h, and {said:04X}h was sent")
            }
            SdoStep::Abort(mux, code) => {
                let who = if self.from == Side::Server { "the drive" } else { "the master" };
                write!(f, "{who} aborts ")?;
                named(f, *mux)?;
                write!(f, ": {code}")
            }
            SdoStep::Stray => f.write_str("part of a transfer whose beginning was not seen"),
            SdoStep::Other(command) => write!(
                f,
                "command {command:02X}h, which is not defined, or part of a block transfer whose beginning was not seen"
            ),
        }
    }
}
