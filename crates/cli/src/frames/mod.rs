//! Frames as people see them: in words, which of them, with what time, and how many there were.

pub(crate) mod counts;
pub(crate) mod filter;
pub(crate) mod stamp;
pub(crate) mod tap;

use canopen::NodeId;
use master::decode::Decoder;

use crate::global::Global;
use machine::file::Machine;
use words::models::{Description, with_files};

/// A decoder that knows the models of the command line and of the machine file, and those of an embedded bus.
pub(crate) fn decoder(global: &Global, embedded: &[(NodeId, &'static Description)]) -> Decoder {
    let mut decoder = Decoder::knowing(with_files(global.models.iter().map(|(_, model)| *model)));
    let of_machine = global.machine.iter().flat_map(Machine::models);
    for (node, model) in embedded.iter().copied().chain(of_machine).chain(global.models.iter().copied()) {
        decoder.set_model(node, model);
    }
    decoder
}
