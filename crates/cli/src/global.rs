//! What every command takes from the command line.

use std::path::Path;
use std::time::Duration;

use canopen::NodeId;
use transport::BusSpec;

use crate::recording::{LogPath, log_path};
use testbench::machine_file::{self, Machine};
use testbench::models::Description;
use testbench::words::drive::node_model;

/// What every command takes.
#[derive(Clone, clap::Args)]
#[command(next_help_heading = "On every command")]
pub(crate) struct Global {
    /// The bus: sim, sim:FILE.toml, can0, socketcand://HOST:PORT/can0, slcan:///dev/ttyACM0?bitrate=500k,
    /// slcan://HOST:PORT, cannelloni://HOST:PORT?local=PORT, udp_multicast://239.74.163.2, log:FILE
    ///
    /// `sim` is a virtual bus of this command alone, with factory-fresh drives, as fast as the machine goes.
    #[arg(long, value_name = "BUS", env = "FERRODRIVE_BUS", default_value = "sim", global = true)]
    pub(crate) bus: BusSpec,

    /// Print JSON instead of text
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Which model a node is, where its identity cannot tell (e.g. 4=zlac8030l, 5=FILE.eds); may be repeated
    #[arg(long = "model", value_name = "NODE=MODEL", value_parser = node_model, global = true)]
    pub(crate) models: Vec<(NodeId, &'static Description)>,

    /// Machine file that says which models are where on a real bus; `sim` serves the drives that it describes
    ///
    /// On a real bus the `model` and `node` of each [[drive]] count. The same file describes a bus of a command's own to --bus
    /// sim:FILE.toml, which knows its drives.
    #[arg(long, value_name = "FILE.toml", value_parser = machine_file::machine, env = "FERRODRIVE_MACHINE", global = true)]
    pub(crate) machine: Option<Machine>,

    /// Show every frame that the command sends and hears, in words, on standard error
    #[arg(long, short = 'v', global = true)]
    pub(crate) verbose: bool,

    /// Run the bus in real time (Linux: SCHED_FIFO, memory locked), so that other programs do not delay its cycles
    #[arg(long, global = true)]
    pub(crate) realtime: bool,

    /// Write every frame that the command sends and hears to this file, with its time
    ///
    /// The extension tells the form: .log (candump), .asc (Vector), .blf (Vector), .pcapng (Wireshark). It is a new file, or an
    /// empty one, or a log of that form, which is replaced. Any other file, a symbolic link, a device and a FIFO are
    /// refused. A command that is killed loses less than a second of it.
    #[arg(long, value_name = "FILE", value_parser = log_path, global = true)]
    pub(crate) log: Option<LogPath>,

    /// Longest wait for each answer of a node
    #[arg(long, value_name = "TIME", value_parser = master::units::parse_duration, default_value = "500ms", global = true)]
    pub(crate) timeout: Duration,
}

impl Global {
    /// The command line with a machine file that a command names itself: on the virtual bus of a command's own, its drives are
    /// there.
    pub(crate) fn on_machine(&self, path: &Path, machine: &Machine) -> Self {
        let mut global = self.clone();
        if matches!(global.bus, BusSpec::Sim { file: None }) {
            global.bus = BusSpec::Sim { file: Some(path.to_owned()) };
        } else {
            global.machine = Some(machine.clone());
        }
        global
    }
}
