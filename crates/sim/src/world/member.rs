//! Who can be on the bus: drives, stations, probes.

use std::any::Any;

use can::{Frame, Instant, Station};

use super::probe::Probe;
use crate::VirtualDrive;

/// A station that a world can copy and hand back; comes by itself with `Clone + Send`.
pub trait AnyStation: Station + Send {
    /// A copy that goes its own way from here.
    fn clone_box(&self) -> Box<dyn AnyStation>;
    /// For looking at the station as what it is.
    fn as_any(&self) -> &dyn Any;
    /// For changing the station as what it is.
    fn as_any_mut(&mut self) -> &mut dyn Any;
}

impl<S: Station + Clone + Send + 'static> AnyStation for S {
    fn clone_box(&self) -> Box<dyn AnyStation> {
        Box::new(self.clone())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn as_any_mut(&mut self) -> &mut dyn Any {
        self
    }
}

impl Clone for Box<dyn AnyStation> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

/// The station that is joined to one controller of the bus.
#[derive(Clone)]
pub(super) enum Member {
    Drive { number: u8, drive: Box<dyn VirtualDrive> },
    Station(Box<dyn AnyStation>),
    Probe(Box<Probe>),
    Gone(Vacant),
}

impl Member {
    pub(super) fn station(&mut self) -> &mut dyn Station {
        match self {
            Self::Drive { drive, .. } => &mut **drive,
            Self::Station(station) => &mut **station,
            Self::Probe(probe) => &mut **probe,
            Self::Gone(vacant) => vacant,
        }
    }
}

/// What is left of a station that was removed.
#[derive(Clone)]
pub(super) struct Vacant;

impl Station for Vacant {
    fn handle_frame(&mut self, _: &Frame, _: Instant) {}

    fn handle_timeout(&mut self, _: Instant) {}

    fn poll_transmit(&mut self) -> Option<Frame> {
        None
    }

    fn poll_timeout(&self) -> Option<Instant> {
        None
    }
}
