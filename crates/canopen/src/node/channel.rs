//! One SDO server beside the default one (CiA 301, 7.5.2.33), and as many as a table has.

use can::CanId;

use super::event::Ticket;
use crate::od::{Storage, Table};
use crate::sdo::{Server, parameter};

/// The record of one server, and what it does.
#[derive(Clone)]
pub(super) struct SdoChannel {
    pub(super) index: u16,
    /// What its client sends to; `None` for one that does not exist.
    pub(super) request: Option<u16>,
    /// Where it answers. Stays when the server goes: what ends it, written through it, is confirmed.
    pub(super) reply: CanId,
    pub(super) server: Server,
    /// The latest question to the owner for this client.
    pub(super) asked: Ticket,
}

/// As many as the table has records for, none of them valid. `server` is one with nothing under way.
pub(super) fn of<S: Storage>(table: &Table, server: &Server) -> S::Channels<SdoChannel> {
    let (reply, asked) = (CanId::standard(0), Ticket(0));
    let empty = SdoChannel { index: 0, request: None, reply, server: server.clone(), asked };
    let mut channels = S::channels(table.channel_count(), empty);
    let records = table.rows().iter().filter(|row| parameter::is_further_server(row.index) && row.sub_index == 1);
    for (channel, (number, row)) in channels.as_mut().iter_mut().zip((1..).zip(records)) {
        (channel.index, channel.server) = (row.index, server.clone().numbered(number));
    }
    channels
}

impl SdoChannel {
    pub(super) fn has_frame(&self) -> bool {
        self.server.has_reply() || self.server.has_segment()
    }
}
