//! A virtual world whose bus is served to other programs: its wire's frames go to clients, theirs go onto its wire.
//!
//! All clients share one CAN adapter of the virtual bus, as the clients of a real socketcand server do: their frames
//! go out in the order they came.

use std::collections::VecDeque;

use can::{Frame, Instant};
use sim::wire::WireEvent;
use sim::{StationId, World};
use transport::{ClientId, Heard, RealTimeWorld};

/// See the [module](self).
pub(crate) struct ServedWorld {
    world: World,
    adapter: StationId,
    /// Whose frames wait in the adapter, in the order they go out.
    waiting: VecDeque<(ClientId, Frame)>,
    heard: VecDeque<Heard>,
    /// Frames carried since the last call of [`Self::take_carried`], for a log.
    carried: Option<Vec<(Instant, Frame)>>,
}

impl ServedWorld {
    /// Adds the adapter to `world`. `logged` keeps carried frames for [`Self::take_carried`].
    pub(crate) fn new(mut world: World, logged: bool) -> Self {
        let adapter = world.add_tap();
        let carried = logged.then(Vec::new);
        Self { world, adapter, waiting: VecDeque::new(), heard: VecDeque::new(), carried }
    }

    /// The world, to operate on its drives.
    pub(crate) fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// Frames carried since the last call.
    pub(crate) fn take_carried(&mut self) -> Vec<(Instant, Frame)> {
        self.carried.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Sorts out what the wire did.
    fn collect(&mut self) {
        while let Some(event) = self.world.log_mut().pull() {
            let WireEvent::Frame { end, source, frame, .. } = event else { continue };
            let from = if source == self.adapter.index() { self.sender(&frame) } else { None };
            self.heard.push_back(Heard::Carried { frame, at: end, from });
            if let Some(carried) = &mut self.carried {
                carried.push((end, frame));
            }
        }
        // What the adapter heard is in the log too.
        while self.world.poll_received(self.adapter).is_some() {}
    }

    fn sender(&mut self, frame: &Frame) -> Option<ClientId> {
        let place = self.waiting.iter().position(|(_, waiting)| waiting == frame)?;
        self.waiting.remove(place).map(|(client, _)| client)
    }
}

impl RealTimeWorld for ServedWorld {
    fn now(&self) -> Instant {
        self.world.now()
    }

    fn next_deadline(&self) -> Option<Instant> {
        self.world.next_event()
    }

    fn advance_to(&mut self, instant: Instant) {
        self.world.run_until(instant);
        self.collect();
    }

    fn inject(&mut self, client: ClientId, frame: &Frame) {
        match self.world.send(self.adapter, *frame) {
            Ok(()) => self.waiting.push_back((client, *frame)),
            Err(_) => self.heard.push_back(Heard::Lost { from: client }),
        }
    }

    fn take_heard(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }
}
