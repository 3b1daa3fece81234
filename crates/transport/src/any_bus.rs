//! A bus of any of the kinds that this crate knows.

use can::{CanId, Frame, Instant};

use crate::Received;
use crate::bus::{AsyncBus, BusError};
use crate::cannelloni::CannelloniBus;
use crate::log_bus::LogBus;
use crate::reconnect::Reconnecting;
use crate::slcan_bus::SlcanBus;
use crate::socketcand::SocketcandBus;
use crate::udp_multicast::UdpMulticastBus;

/// Any bus that [`crate::BusSpec::open`] opens. A connection that is lost is made again.
#[derive(Debug)]
pub struct AnyBus(pub(crate) BusKind);

#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a program has one or two of them, and keeps them where they are")]
pub(crate) enum BusKind {
    Socketcand(Reconnecting<SocketcandBus>),
    Slcan(Reconnecting<SlcanBus>),
    Cannelloni(CannelloniBus),
    UdpMulticast(UdpMulticastBus),
    #[cfg(target_os = "linux")]
    SocketCan(crate::SocketCanBus),
    Log(LogBus),
}

impl AnyBus {
    /// Asks for frames with these identifiers only, from here on and over every new connection; of none for all again.
    /// True if the bus has a filter of its own and does so: a CAN interface of Linux, up to 512 identifiers. Any other bus gives
    /// all frames as before. Frames that waited already still come, and notes always.
    ///
    /// For callers that listen to little of a busy bus. A master needs all frames: nodes that it does not know yet, and PDOs whose
    /// identifiers another program may change.
    pub fn hear_only(&mut self, ids: &[CanId]) -> Result<bool, BusError> {
        match &mut self.0 {
            #[cfg(target_os = "linux")]
            BusKind::SocketCan(bus) => bus.hear_only(ids),
            _ => Ok(false),
        }
    }

    /// Takes leave: an slcan adapter's channel is closed, so that it stops acknowledging frames on the bus. Dropping does
    /// for the others.
    pub async fn close(self) -> Result<(), BusError> {
        let BusKind::Slcan(bus) = self.0 else { return Ok(()) };
        match bus.into_inner() {
            Some(bus) => bus.close().await,
            None => Ok(()),
        }
    }
}

impl AsyncBus for AnyBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        match &mut self.0 {
            BusKind::Socketcand(bus) => bus.send(frame).await,
            BusKind::Slcan(bus) => bus.send(frame).await,
            BusKind::Cannelloni(bus) => bus.send(frame).await,
            BusKind::UdpMulticast(bus) => bus.send(frame).await,
            #[cfg(target_os = "linux")]
            BusKind::SocketCan(bus) => bus.send(frame).await,
            BusKind::Log(bus) => bus.send(frame).await,
        }
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        match &mut self.0 {
            BusKind::Socketcand(bus) => bus.recv().await,
            BusKind::Slcan(bus) => bus.recv().await,
            BusKind::Cannelloni(bus) => bus.recv().await,
            BusKind::UdpMulticast(bus) => bus.recv().await,
            #[cfg(target_os = "linux")]
            BusKind::SocketCan(bus) => bus.recv().await,
            BusKind::Log(bus) => bus.recv().await,
        }
    }
}
