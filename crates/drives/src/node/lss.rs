//! The LSS slave of a described device (CiA 305): node-ID and bit rate from the bus, and when they take effect.
//!
//! The protocol is [`canopen::lss::Server`]'s. Here is what the standard leaves to the device: the address is its identity
//! (1018h), the bit rate changes after the silence that the master asked for, and both are kept beside the parameters.

use can::{Bitrate, Frame, Instant};
use canopen::connection_set::LSS_MASTER;
use canopen::lss::{Action, Address, BIT_RATES_KBIT, Request, Server, UNCONFIGURED};
use canopen::od::{Dictionary, Storage};
use canopen::{Mux, NodeId};

use super::Memory;

/// A stored bit rate that is the one as delivered.
const AS_DELIVERED: u8 = 255;
const NANOS_PER_MS: u64 = 1_000_000;

/// Layer setting services of one device.
#[derive(Clone, Debug)]
pub(crate) struct Lss {
    server: Server,
    answer: Option<Frame>,
    /// The index of the bit rate that was configured.
    bit_rate: u8,
    switching: Option<Switching>,
}

/// A change of the bit rate under way: silent until the end of it (CiA 305, 6.3.3).
#[derive(Clone, Copy, Debug)]
struct Switching {
    /// When the new rate begins; `None` once it has.
    change: Option<Instant>,
    end: Instant,
}

/// What the device has to do for a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    Nothing,
    /// Start communication over, with the node-ID that it was given.
    ResetCommunication,
    /// Keep this: [`Memory::store_lss`].
    Store([u8; 2]),
}

impl Lss {
    /// Of a device that has just been started, with what its memory holds; `delivered` is its node-ID where nothing is stored.
    pub(crate) fn start<S: Storage>(values: &Dictionary<impl Storage>, memory: &Memory<S>, delivered: NodeId) -> Self {
        let view = values.view();
        // 1018h:04 is optional: a device without a serial number has 0 there for LSS.
        let number = |sub_index| view.value(Mux::new(0x1018, sub_index)).unwrap_or(0) as u32;
        let address = Address { numbers: [number(1), number(2), number(3), number(4)] };
        let stored = memory.lss();
        let node_id = stored.map_or(Some(delivered), |[node, _]| NodeId::new(node));
        let bit_rate = stored.map_or(AS_DELIVERED, |[_, rate]| rate);
        Self { server: Server::new(address, node_id), answer: None, bit_rate, switching: None }
    }

    /// The node-ID on the bus; `None` without one.
    pub(crate) const fn node_id(&self) -> Option<NodeId> {
        self.server.node_id()
    }

    /// NMT reset communication: the node-ID that was configured.
    pub(crate) const fn take_node_id(&mut self) -> Option<NodeId> {
        self.server.take_node_id()
    }

    /// The bit rate that was configured, if one was.
    pub(crate) fn bitrate(&self) -> Option<Bitrate> {
        let kbit = BIT_RATES_KBIT.get(usize::from(self.bit_rate)).copied().flatten()?;
        Bitrate::new(u32::from(kbit) * 1000)
    }

    /// The frame is a master's request.
    #[inline]
    pub(crate) fn wants(frame: &Frame) -> bool {
        frame.id() == LSS_MASTER
    }

    /// True while it changes its bit rate: nothing is sent, nothing taken.
    pub(crate) const fn is_silent(&self) -> bool {
        self.switching.is_some()
    }

    /// A request arrived.
    pub(crate) fn handle_frame(&mut self, frame: &Frame, now: Instant) -> Wanted {
        let Some(request) = Request::parse(frame) else { return Wanted::Nothing };
        let (reply, action) = self.server.handle(request);
        if let Some(reply) = reply {
            self.answer = Some(reply.emit());
        }
        match action {
            None => Wanted::Nothing,
            Some(Action::BecomeNode) => Wanted::ResetCommunication,
            Some(Action::SetBitRate(kbit)) => {
                let index = BIT_RATES_KBIT.iter().position(|known| *known == Some(kbit));
                self.bit_rate = index.map_or(AS_DELIVERED, |index| index as u8);
                Wanted::Nothing
            }
            Some(Action::ActivateBitRate(ms)) => {
                let silence_ns = u64::from(ms) * NANOS_PER_MS;
                let change = now.plus_nanos(silence_ns);
                self.switching = Some(Switching { change: Some(change), end: change.plus_nanos(silence_ns) });
                Wanted::Nothing
            }
            Some(Action::Store) => {
                Wanted::Store([self.server.pending_node_id().map_or(UNCONFIGURED, NodeId::raw), self.bit_rate])
            }
        }
    }

    /// Time has reached `now`; the bit rate that begins, if one does.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> Option<Bitrate> {
        let switching = self.switching.as_mut()?;
        let changes = switching.change.is_some_and(|change| now >= change);
        if changes {
            switching.change = None;
        }
        if now >= switching.end {
            self.switching = None;
        }
        self.bitrate().filter(|_| changes)
    }

    /// When [`handle_timeout`](Self::handle_timeout) should next be called.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.switching.map(|switching| switching.change.unwrap_or(switching.end))
    }

    /// What a request is answered with.
    pub(crate) const fn take_answer(&mut self) -> Option<Frame> {
        self.answer.take()
    }
}
