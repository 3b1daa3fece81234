//! SDO servers beside the default one (CiA 301, 7.5.2.33): each serves a client of its own, under the identifiers of its record 1201h
//! to 127Fh.

use can::{Frame, Instant};

use super::Node;
use super::channel::SdoChannel;
use super::event::Ticket;
use super::pending::Source;
use crate::od::Storage;
use crate::sdo::{Server, parameter};
use crate::{CobId, Mux};

impl<S: Storage> Node<S> {
    /// Identifiers are heard from now on.
    pub(super) fn listen_to_channels(&mut self) {
        for channel in self.channels.as_ref() {
            if let Some(id) = channel.request {
                self.received.hear(id);
            }
        }
    }

    /// A record has changed, or communication begins. What was under way on a server that changes is over.
    pub(super) fn configure_channels(&mut self) {
        for position in 0..self.channels.as_ref().len() {
            let index = self.channels.as_ref()[position].index;
            let [request, reply] = [1, 2].map(|sub_index| self.object(Mux::new(index, sub_index)).map(CobId));
            let ids = request.zip(reply).and_then(|(request, reply)| parameter::identifiers(request, reply));
            let channel = &mut self.channels.as_mut()[position];
            let is_same = ids == channel.request.map(|request| (request, channel.reply));
            if !is_same {
                channel.server.reset();
                channel.request = ids.map(|(request, _)| request);
                channel.reply = ids.map_or(channel.reply, |(_, reply)| reply);
            }
        }
    }

    /// NMT state without SDO.
    pub(super) fn reset_channels(&mut self) {
        for channel in self.channels.as_mut() {
            channel.server.reset();
        }
        self.pending.remove(Source::Channel);
    }

    /// A frame that no other service has taken.
    #[cold]
    #[inline(never)]
    pub(super) fn receive_channel(&mut self, frame: &Frame, id: u16) {
        let channels = self.channels.as_mut();
        let Some(position) = channels.iter().position(|channel| channel.request == Some(id)) else { return };
        self.last_addressed = Some(self.now);
        if !self.state.allows_sdo() {
            return;
        }
        let server = &mut channels[position].server;
        if let Some(write) = server.handle_frame(frame, &mut self.dictionary, self.now) {
            let number = position as u8 + 1;
            match self.write(number, write.slot, write.facts, write.raw) {
                Ok(()) => self.server_mut(number).finish(write, Ok(())),
                Err(refusal) => self.refuse(number, write, refusal),
            }
        }
        self.offer_channels();
        self.deadline = self.deadline.min(self.channels.as_ref()[position].server.deadline());
    }

    /// A server by its number; 0 is the default one.
    pub(super) fn server_mut(&mut self, number: u8) -> &mut Server {
        match usize::from(number).checked_sub(1) {
            None => &mut self.sdo,
            Some(position) => &mut self.channels.as_mut()[position].server,
        }
    }

    /// The latest question of a server.
    pub(super) fn asked_mut(&mut self, number: u8) -> &mut Ticket {
        match usize::from(number).checked_sub(1) {
            None => &mut self.asked,
            Some(position) => &mut self.channels.as_mut()[position].asked,
        }
    }

    /// The latest question of each server, with the server.
    pub(super) fn questions(&self) -> impl Iterator<Item = (Ticket, &Server)> {
        let further = self.channels.as_ref().iter().map(|channel| (channel.asked, &channel.server));
        core::iter::once((self.asked, &self.sdo)).chain(further)
    }

    pub(super) fn offer_channels(&mut self) {
        self.pending.set(Source::Channel, self.channels.as_ref().iter().any(SdoChannel::has_frame));
    }

    pub(super) fn serve_channel_deadlines(&mut self) {
        for channel in self.channels.as_mut() {
            channel.server.handle_timeout(self.now);
        }
        self.offer_channels();
    }

    pub(super) fn channel_deadline(&self) -> Instant {
        let deadlines = self.channels.as_ref().iter().map(|channel| channel.server.deadline());
        deadlines.min().unwrap_or(Instant::FAR_FUTURE)
    }

    /// Identifier of the most urgent frame of these servers.
    pub(super) fn channel_id(&self) -> u32 {
        let ids =
            self.channels.as_ref().iter().filter(|channel| channel.has_frame()).map(|channel| channel.reply.raw());
        ids.min().unwrap_or(u32::MAX)
    }

    /// Takes the most urgent frame of these servers; the next one is offered at once.
    #[cold]
    #[inline(never)]
    pub(super) fn take_of_channel(&mut self) -> Option<Frame> {
        let waiting = self.channels.as_mut().iter_mut().filter(|channel| channel.has_frame());
        let channel = waiting.min_by_key(|channel| channel.reply.raw())?;
        let (reply, server) = (channel.reply, &mut channel.server);
        let bytes = server.take_reply().or_else(|| server.take_segment(&self.dictionary.view()));
        self.offer_channels();
        bytes.map(|bytes| Frame::full(reply, bytes))
    }
}
