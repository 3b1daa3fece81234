//! What every command takes from the command line.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use canopen::NodeId;
use sim::World;
use transport::BusSpec;

use crate::failure::Failure;
use crate::recording::{LogPath, log_path};
use crate::signals::Signal;
use console::numbers::whole;
use machine::file::Machine;
use words::drive::node_model;
use words::models::Description;
use words::node::node;
use words::time::some_time;

/// NODE=NUMBER as the record of that server: 1 is the default one, 1200h.
fn sdo_server(text: &str) -> Result<(NodeId, u16), String> {
    let Some((at, number)) = text.split_once('=') else {
        return Err(format!("'{text}' is incomplete; expected NODE=NUMBER, e.g. 4=2 for the server of 1201h"));
    };
    let number = number.parse().ok().and_then(machine::file::sdo_server_record);
    Ok((node(at)?, number.ok_or("expected the number of an SDO server, 1 to 128: 2 is that of 1201h")?))
}

/// Request and answer together take half a millisecond on the wire at 500 kbit/s.
fn answer_time(text: &str) -> Result<Duration, String> {
    let time = some_time(text)?;
    if time < Duration::from_millis(1) {
        Err("no node answers in less than 1ms; 500ms is usual".into())
    } else {
        Ok(time)
    }
}

/// What every command takes.
#[derive(Clone, clap::Args)]
#[command(next_help_heading = "On every command")]
pub(crate) struct Global {
    /// The bus: sim, sim:FILE.toml, can0, socketcand://HOST:PORT/can0, slcan:///dev/ttyACM0?bitrate=500k,
    /// slcan://HOST:PORT, cannelloni://HOST:PORT?local=PORT, udp_multicast://239.74.163.2, log:FILE
    ///
    /// `sim` is a virtual bus of this command alone, with factory-fresh drives, and runs as fast as the machine can.
    #[arg(long, value_name = "BUS", env = "FERRODRIVE_BUS", default_value = "sim", global = true)]
    pub(crate) bus: BusSpec,

    /// Print JSON instead of text
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Model of a node whose identity fits several (e.g. 4=zlac8030l, 5=FILE.eds); may be repeated
    #[arg(long = "model", value_name = "NODE=MODEL", value_parser = node_model, global = true)]
    pub(crate) models: Vec<(NodeId, &'static Description)>,

    /// SDO server of a node that is asked: 2 is that of 1201h, up to 128, 127Fh (e.g. 4=2); may be repeated
    ///
    /// For a device that another master asks too: neither takes the other's answers. The record is read at the default
    /// server, 1, with the first request.
    #[arg(long = "sdo-server", value_name = "NODE=NUMBER", value_parser = sdo_server, global = true)]
    pub(crate) sdo_servers: Vec<(NodeId, u16)>,

    /// Add a counter to the SYNC that the command sends, from 1 up to this, equal to 1019h of the devices
    #[arg(long, alias = "counter", value_name = "OVERFLOW", value_parser = |text: &str| whole(text, 2..=240_u8), global = true)]
    pub(crate) sync_counter: Option<u8>,

    /// Machine file: the models of the nodes and their gears; on a virtual bus also its drives
    ///
    /// On a real bus the `model`, `node`, `units` and `sdo_server` of each [[drive]] are used, `sync_counter`, and the groups and bases. On the
    /// virtual bus of a command's own it is the short form of --bus sim:FILE.toml, and `sim` serves the drives that it
    /// describes. A command that takes a machine file as an argument takes it here too.
    #[arg(id = "machine", long = "machine", value_name = "FILE.toml", env = "FERRODRIVE_MACHINE", global = true)]
    pub(crate) machine_path: Option<PathBuf>,

    /// Show every frame that the command sends and receives, decoded, on standard error
    #[arg(long, short = 'v', global = true)]
    pub(crate) verbose: bool,

    /// Run the bus in real time (Linux: SCHED_FIFO, memory locked), so that other programs do not delay its cycles
    #[arg(long, global = true)]
    pub(crate) realtime: bool,

    /// Write every frame that the command sends and receives to this file, with its time
    ///
    /// The extension selects the format: .log (candump), .asc (Vector), .blf (Vector), .pcapng (Wireshark). The file is
    /// new, empty, or a log of that format, which is replaced. Any other file, a symbolic link, a device and a FIFO are
    /// refused. A command that is killed loses less than a second of it.
    #[arg(long, value_name = "FILE", value_parser = log_path, global = true)]
    pub(crate) log: Option<LogPath>,

    /// Longest wait for each answer of a node
    #[arg(long, value_name = "TIME", value_parser = answer_time, default_value = "500ms", global = true)]
    pub(crate) timeout: Duration,

    /// What it says.
    #[arg(skip)]
    pub(crate) machine: Option<Machine>,

    /// A bus in virtual time that outlives the command, whatever `--bus` says: that of a program which gives several.
    #[arg(skip)]
    pub(crate) shared: Option<SharedBus>,

    /// Where the machine file is, and whether the command line names it.
    #[arg(skip)]
    pub(crate) machine_file: Option<MachineFile>,
}

/// A bus in virtual time on which several commands are given, one after the other.
#[derive(Clone)]
pub(crate) struct SharedBus {
    pub(crate) world: Arc<Mutex<World>>,
    /// What asks the command to end, each so long after it began.
    pub(crate) signals: Vec<(Duration, Signal)>,
}

/// Where the machine file of `--machine` or of the environment is.
#[derive(Clone, Debug)]
pub(crate) struct MachineFile {
    pub(crate) path: PathBuf,
    /// By `--machine`; else by the environment, which a file of the command line overrules.
    pub(crate) is_typed: bool,
}

impl Global {
    /// The command line with a machine file that a command names itself, as if it stood behind `--machine`.
    ///
    /// # Errors
    /// Where `--machine` or a virtual bus names another one.
    pub(crate) fn on_machine(&self, path: &Path, machine: &Machine) -> Result<Self, Failure> {
        self.refuse_another(path)?;
        let mut global = self.clone();
        let before = self.machine_file.as_ref();
        let of_machine =
            |file: &Option<PathBuf>| file.as_deref().is_none_or(|file| before.is_some_and(|own| own.path == file));
        match &global.bus {
            BusSpec::Sim { file } if of_machine(file) => global.bus = BusSpec::Sim { file: Some(path.to_owned()) },
            // The drives of a virtual bus are those of its file.
            BusSpec::Sim { file: Some(other) } if !is_same_file(other, path) => {
                return Err(two_files(path, other).next(format!("or --bus sim:{} alone", path.display())));
            }
            _ => global.machine = Some(machine.clone()),
        }
        Ok(global)
    }

    /// Refuses a file that a command names where `--machine` names another one.
    pub(crate) fn refuse_another(&self, path: &Path) -> Result<(), Failure> {
        match &self.machine_file {
            Some(other) if other.is_typed && !is_same_file(&other.path, path) => Err(two_files(path, &other.path)),
            _ => Ok(()),
        }
    }
}

fn is_same_file(one: &Path, other: &Path) -> bool {
    one == other || one.canonicalize().ok().zip(other.canonicalize().ok()).is_some_and(|(one, other)| one == other)
}

pub(crate) fn two_files(one: &Path, other: &Path) -> Failure {
    Failure::usage(format!("two machine files: {} and {}", one.display(), other.display()))
        .because("a bus is described by one")
        .next("give one of them, with --machine FILE or as the command takes it")
}
