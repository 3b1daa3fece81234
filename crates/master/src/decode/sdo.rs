use core::fmt;
use std::collections::BTreeMap;

use canopen::sdo::wire::{LENGTH, Payload, Reply, Request, Segment};
use canopen::{AbortCode, Mux, NodeId};

use super::value::{Value, write_name};
use crate::identify::Model;

/// Longest object that is put together; a longer one is shown without its value.
const MAX_OBJECT: usize = 64 * 1024;

/// Who sent an SDO frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The master.
    Client,
    /// The device.
    Server,
}

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

/// What a frame does in an SDO transfer. Bytes are those of the whole object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SdoStep {
    /// The client asks for an object.
    Read(Mux),
    /// The object's value has come, in this frame or with this last segment.
    ReadDone(Mux, Vec<u8>),
    /// The client writes an object, or has sent its last segment.
    Write(Mux, Vec<u8>),
    /// The device has taken the value.
    WriteDone(Mux, Vec<u8>),
    /// A segmented transfer begins; the size is the sender's word.
    Begin(Mux, Option<u32>),
    /// A segment within a transfer, or its confirmation; bytes known so far.
    Segment(Mux, usize),
    /// One side gave up.
    Abort(Mux, AbortCode),
    /// A frame that belongs to no transfer that was seen to begin.
    Stray,
    /// Block transfer, or a command specifier that the standard does not define.
    Other(u8),
}

impl SdoStep {
    /// A value that is known to be in the device now.
    pub(super) fn learned(&self) -> Option<(Mux, &[u8])> {
        match self {
            Self::ReadDone(mux, bytes) | Self::WriteDone(mux, bytes) => Some((*mux, bytes)),
            _ => None,
        }
    }
}

/// The transfers under way, one per node.
#[derive(Clone, Debug, Default)]
pub(super) struct Conversations(BTreeMap<u8, Transfer>);

#[derive(Clone, Debug)]
struct Transfer {
    mux: Mux,
    bytes: Vec<u8>,
    writes: bool,
    complete: bool,
}

impl Conversations {
    pub(super) fn step(&mut self, node: NodeId, from: Side, raw: &[u8; LENGTH]) -> SdoStep {
        match from {
            Side::Client => self.request(node.raw(), Request::parse(raw)),
            Side::Server => self.reply(node.raw(), Reply::parse(raw)),
        }
    }

    fn request(&mut self, node: u8, request: Request) -> SdoStep {
        match request {
            Request::InitiateUpload(mux) => {
                self.begin(node, mux, false);
                SdoStep::Read(mux)
            }
            Request::InitiateDownload(mux, Payload::Expedited { length, bytes }) => {
                let bytes = bytes[..usize::from(length.unwrap_or(4)).min(4)].to_vec();
                self.0.insert(node, Transfer { mux, bytes: bytes.clone(), writes: true, complete: true });
                SdoStep::Write(mux, bytes)
            }
            Request::InitiateDownload(mux, Payload::Segmented { size }) => {
                self.begin(node, mux, true);
                SdoStep::Begin(mux, size)
            }
            Request::DownloadSegment(segment) => self.segment(node, true, &segment),
            Request::UploadSegment { .. } => match self.0.get(&node).filter(|transfer| !transfer.writes) {
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
                self.0.remove(&node);
                SdoStep::ReadDone(mux, bytes[..usize::from(length.unwrap_or(4)).min(4)].to_vec())
            }
            Reply::InitiateUpload(mux, Payload::Segmented { size }) => {
                self.begin(node, mux, false);
                SdoStep::Begin(mux, size)
            }
            Reply::UploadSegment(segment) => self.segment(node, false, &segment),
            Reply::InitiateDownload(mux) => match self.0.get(&node).filter(|transfer| transfer.writes) {
                Some(transfer) if transfer.complete && transfer.mux == mux => self.write_done(node),
                Some(_) => SdoStep::Segment(mux, 0),
                None => SdoStep::Stray,
            },
            Reply::DownloadSegment { .. } => match self.0.get(&node).filter(|transfer| transfer.writes) {
                Some(transfer) if transfer.complete => self.write_done(node),
                Some(transfer) => SdoStep::Segment(transfer.mux, transfer.bytes.len()),
                None => SdoStep::Stray,
            },
            Reply::Abort(mux, code) => self.abort(node, mux, code),
            Reply::Unknown { command, .. } => SdoStep::Other(command),
        }
    }

    fn begin(&mut self, node: u8, mux: Mux, writes: bool) {
        self.0.insert(node, Transfer { mux, bytes: Vec::new(), writes, complete: false });
    }

    fn segment(&mut self, node: u8, writes: bool, segment: &Segment) -> SdoStep {
        let Some(transfer) = self.0.get_mut(&node).filter(|transfer| transfer.writes == writes) else {
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
        self.0.remove(&node);
        SdoStep::ReadDone(mux, bytes)
    }

    fn write_done(&mut self, node: u8) -> SdoStep {
        self.0.remove(&node).map_or(SdoStep::Stray, |transfer| SdoStep::WriteDone(transfer.mux, transfer.bytes))
    }

    fn abort(&mut self, node: u8, mux: Mux, code: AbortCode) -> SdoStep {
        self.0.remove(&node);
        SdoStep::Abort(mux, code)
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
            SdoStep::ReadDone(mux, bytes) => Value::new(*mux, bytes, model).fmt(f),
            SdoStep::Write(mux, bytes) => write!(f, "write {}", Value::new(*mux, bytes, model)),
            SdoStep::WriteDone(mux, _) => {
                f.write_str("done: write ")?;
                named(f, *mux)
            }
            SdoStep::Begin(mux, size) => {
                f.write_str("segmented transfer of ")?;
                named(f, *mux)?;
                size.map_or(Ok(()), |size| write!(f, ", {size} bytes"))
            }
            SdoStep::Segment(mux, so_far) => write!(f, "segment of {mux}, {so_far} bytes so far"),
            SdoStep::Abort(mux, code) => {
                let who = if self.from == Side::Server { "the drive" } else { "the master" };
                write!(f, "{who} aborts ")?;
                named(f, *mux)?;
                write!(f, ": {code}")
            }
            SdoStep::Stray => f.write_str("part of a transfer whose beginning was not seen"),
            SdoStep::Other(command) => write!(f, "command {command:02X}h (block transfer or undefined)"),
        }
    }
}
