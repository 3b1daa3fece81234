//! A bus of any of the kinds that this crate knows.

use can::{Frame, Instant};

use crate::Received;
use crate::bus::{AsyncBus, BusError};
use crate::cannelloni::CannelloniBus;
use crate::log::LogBus;
use crate::reconnect::Reconnecting;
use crate::slcan::SlcanBus;
use crate::socketcand::SocketcandBus;
use crate::udp_multicast::UdpMulticastBus;

/// Any bus that [`crate::BusSpec::open`] opens. A connection that is lost is made again.
#[derive(Debug)]
pub struct AnyBus(pub(crate) Kind);

#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a program has one or two of them, and keeps them where they are")]
pub(crate) enum Kind {
    Socketcand(Reconnecting<SocketcandBus>),
    Slcan(Reconnecting<SlcanBus>),
    Cannelloni(CannelloniBus),
    UdpMulticast(UdpMulticastBus),
    #[cfg(target_os = "linux")]
    SocketCan(crate::SocketCanBus),
    Log(LogBus),
}

impl AnyBus {
    /// Takes leave: an slcan adapter's channel is closed, so that it stops acknowledging frames on the bus. Dropping does
    /// for the others.
    pub async fn close(self) -> Result<(), BusError> {
        let Kind::Slcan(bus) = self.0 else { return Ok(()) };
        match bus.into_inner() {
            Some(bus) => bus.close().await,
            None => Ok(()),
        }
    }
}

impl AsyncBus for AnyBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        match &mut self.0 {
            Kind::Socketcand(bus) => bus.send(frame).await,
            Kind::Slcan(bus) => bus.send(frame).await,
            Kind::Cannelloni(bus) => bus.send(frame).await,
            Kind::UdpMulticast(bus) => bus.send(frame).await,
            #[cfg(target_os = "linux")]
            Kind::SocketCan(bus) => bus.send(frame).await,
            Kind::Log(bus) => bus.send(frame).await,
        }
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        match &mut self.0 {
            Kind::Socketcand(bus) => bus.recv().await,
            Kind::Slcan(bus) => bus.recv().await,
            Kind::Cannelloni(bus) => bus.recv().await,
            Kind::UdpMulticast(bus) => bus.recv().await,
            #[cfg(target_os = "linux")]
            Kind::SocketCan(bus) => bus.recv().await,
            Kind::Log(bus) => bus.recv().await,
        }
    }
}
