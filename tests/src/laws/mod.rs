//! Laws of everything that reads what others wrote: any bytes give a value or an error, never a panic, and what was
//! read can be written and read again.
//!
//! Each law is a function of bytes that panics when it is broken. [`ALL`] names them with samples to damage.

mod any_frames;
mod bus_yml;
mod concise;
mod control;
mod eds;
mod eeprom;
mod firmware;
mod frame;
mod logs;
mod lss;
mod master_core;
mod modbus;
mod node;
mod pdo_mapping;
mod program_download;
mod scenario;
mod sdo_blocks;
mod sdo_channels;
mod selected_frame;
mod stream;
mod world_command;

/// A law, the name that a fuzz target has for it, and valid inputs to start from.
#[derive(Debug, Clone, Copy)]
pub struct Law {
    /// The name.
    pub name: &'static str,
    /// Panics when the law is broken for these bytes.
    pub holds: fn(&[u8]),
    /// Valid input.
    pub samples: &'static [&'static [u8]],
}

/// Every law.
pub const ALL: &[Law] = &[
    Law { name: "frame_text", holds: frame::text, samples: frame::TEXT_SAMPLES },
    Law { name: "frame_length", holds: frame::length, samples: frame::LENGTH_SAMPLES },
    Law { name: "candump_line", holds: stream::candump_line, samples: stream::CANDUMP_SAMPLES },
    Law { name: "log_asc", holds: logs::asc, samples: logs::ASC_SAMPLES },
    Law { name: "log_trc", holds: logs::trc, samples: logs::TRC_SAMPLES },
    Law { name: "log_blf", holds: logs::blf, samples: logs::BLF_SAMPLES },
    Law { name: "log_pcap", holds: logs::pcap, samples: logs::PCAP_SAMPLES },
    Law { name: "log_pcapng", holds: logs::pcapng, samples: logs::PCAPNG_SAMPLES },
    Law { name: "socketcand", holds: stream::socketcand, samples: stream::SOCKETCAND_SAMPLES },
    Law { name: "slcan", holds: stream::slcan, samples: stream::SLCAN_SAMPLES },
    Law { name: "sdo_wire", holds: node::sdo_wire, samples: node::SDO_WIRE_SAMPLES },
    Law { name: "program_download", holds: program_download::program_download, samples: program_download::SAMPLES },
    Law { name: "sdo_blocks", holds: sdo_blocks::sdo_blocks, samples: sdo_blocks::SAMPLES },
    Law { name: "sdo_channels", holds: sdo_channels::sdo_channels, samples: sdo_channels::SAMPLES },
    Law { name: "node", holds: node::node, samples: node::NODE_SAMPLES },
    Law { name: "pdo_mapping", holds: pdo_mapping::pdo_mapping, samples: pdo_mapping::SAMPLES },
    Law { name: "lss", holds: lss::lss, samples: lss::SAMPLES },
    Law { name: "modbus", holds: modbus::modbus, samples: modbus::SAMPLES },
    Law { name: "mjoint", holds: any_frames::mjoint, samples: any_frames::MJOINT_SAMPLES },
    Law { name: "zlac8030l", holds: any_frames::zlac8030l, samples: any_frames::ZLAC8030L_SAMPLES },
    Law { name: "zlim42c", holds: any_frames::zlim42c, samples: any_frames::ZLIM42C_SAMPLES },
    Law { name: "eds", holds: eds::eds, samples: eds::SAMPLES },
    Law { name: "concise_dcf", holds: concise::concise_dcf, samples: concise::SAMPLES },
    Law { name: "eeprom", holds: eeprom::eeprom, samples: eeprom::SAMPLES },
    Law { name: "world_command", holds: world_command::world_command, samples: world_command::SAMPLES },
    Law { name: "bus_yml", holds: bus_yml::bus_yml, samples: bus_yml::SAMPLES },
    Law { name: "scenario", holds: scenario::scenario, samples: scenario::SAMPLES },
    Law { name: "control", holds: control::control, samples: control::SAMPLES },
    Law { name: "master_core", holds: master_core::master_core, samples: master_core::SAMPLES },
];

/// The law of that name, for the fuzz targets.
///
/// # Panics
///
/// When there is none, or when the law is broken.
pub fn check(name: &str, data: &[u8]) {
    let law = ALL.iter().find(|law| law.name == name).unwrap_or_else(|| panic!("no law is called {name}"));
    (law.holds)(data);
}
