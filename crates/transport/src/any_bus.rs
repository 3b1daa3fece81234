//! A bus of any of the kinds that this crate knows.

use can::{Frame, Instant};

use crate::Received;
use crate::bus::{AsyncBus, BusError};
use crate::log::LogBus;
use crate::slcan::SlcanBus;
use crate::socketcand::SocketcandBus;

/// Any bus that [`crate::BusSpec::open`] opens.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a program has one or two of them, and keeps them where they are")]
pub enum AnyBus {
    /// A socketcand server.
    Socketcand(SocketcandBus),
    /// An slcan adapter or server.
    Slcan(SlcanBus),
    /// A CAN interface of Linux.
    #[cfg(target_os = "linux")]
    SocketCan(crate::SocketCanBus),
    /// A log.
    Log(LogBus),
}

impl AnyBus {
    /// Takes leave: an slcan adapter's channel is closed, so that it stops acknowledging frames on the bus. Dropping does
    /// for the others.
    pub async fn close(self) -> Result<(), BusError> {
        match self {
            Self::Slcan(bus) => bus.close().await,
            Self::Socketcand(_) | Self::Log(_) => Ok(()),
            #[cfg(target_os = "linux")]
            Self::SocketCan(_) => Ok(()),
        }
    }
}

impl AsyncBus for AnyBus {
    async fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        match self {
            Self::Socketcand(bus) => bus.send(frame).await,
            Self::Slcan(bus) => bus.send(frame).await,
            #[cfg(target_os = "linux")]
            Self::SocketCan(bus) => bus.send(frame).await,
            Self::Log(bus) => bus.send(frame).await,
        }
    }

    async fn recv(&mut self) -> Result<(Instant, Received), BusError> {
        match self {
            Self::Socketcand(bus) => bus.recv().await,
            Self::Slcan(bus) => bus.recv().await,
            #[cfg(target_os = "linux")]
            Self::SocketCan(bus) => bus.recv().await,
            Self::Log(bus) => bus.recv().await,
        }
    }
}
