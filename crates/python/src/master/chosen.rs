//! How nodes are asked, and what SYNC carries: what a program chooses, and before that its machine file.

use std::collections::BTreeMap;

use canopen::NodeId;
use canopen::sync::MAX_COUNTER;
use machine::file::{Machine, sdo_server_record};
use master::Network;
use pyo3::prelude::*;

use crate::failure::bad_value;

/// What a program chooses.
pub(super) struct Chosen {
    /// Nodes, and the record of the SDO server by which each is asked.
    sdo_servers: Vec<(NodeId, u16)>,
    sync_counter: Option<u8>,
}

impl Chosen {
    /// Servers by their numbers, of which 1 is the default one; the counter overflow value of SYNC (1019h).
    pub(super) fn new(sdo_servers: BTreeMap<i64, i64>, sync_counter: Option<i64>) -> PyResult<Self> {
        let server = |(node, number)| {
            let record = u16::try_from(number).ok().and_then(sdo_server_record);
            u8::try_from(node).ok().and_then(NodeId::new).zip(record).ok_or_else(|| {
                bad_value(format!(
                    "sdo_servers has {node}: {number}; expected node-IDs, 1 to 127, and of each the number of an SDO server, 1 to 128: \
                     2 is that of 1201h"
                ))
            })
        };
        let counter = |value| {
            u8::try_from(value).ok().filter(|value| (2..=MAX_COUNTER).contains(value)).ok_or_else(|| {
                bad_value(format!(
                    "sync_counter is {value}; expected 2 to {MAX_COUNTER}, as 1019h of the devices has it"
                ))
            })
        };
        Ok(Self {
            sdo_servers: sdo_servers.into_iter().map(server).collect::<PyResult<_>>()?,
            sync_counter: sync_counter.map(counter).transpose()?,
        })
    }

    /// What is chosen comes after the file, and overrules it.
    pub(super) fn apply(self, network: &Network, machine: Option<&Machine>) {
        let of_file = machine.into_iter().flat_map(Machine::sdo_servers);
        network.choose_sdo_servers(of_file.chain(self.sdo_servers).collect::<Vec<_>>());
        network.sync_counter(self.sync_counter.or(machine.and_then(|machine| machine.sync_counter)));
    }
}
