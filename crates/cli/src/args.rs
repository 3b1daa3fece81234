//! The command line as a whole: what every command takes, and the list of commands.

use std::time::Duration;

use canopen::NodeId;
use clap::{Parser, Subcommand};
use transport::BusSpec;

use crate::command::{completions, demo, drive, dump, home, motion, nmt, objects, readings, scan, sdo, sim, store};
use crate::machine_file::{self, Machine};
use crate::models::Description;
use crate::parse::drive_spec::node_model;

/// CANopen motor drives, virtual and real: simulate them, look into them, move them.
#[derive(Parser)]
#[command(name = "ferrodrive", version, propagate_version = true, max_term_width = 100, arg_required_else_help = true)]
#[command(after_help = "Without --bus everything happens on a virtual bus of its own, in virtual time:\n  \
    ferrodrive demo\n  ferrodrive move 4 90deg\n  ferrodrive --bus socketcand://HOST:29536/can0 state 4")]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What every command takes.
#[derive(Clone, clap::Args)]
#[command(next_help_heading = "On every command")]
pub(crate) struct Global {
    /// The bus: sim, sim:FILE.toml, socketcand://HOST:PORT/can0, slcan:///dev/ttyACM0?bitrate=500k,
    /// slcan://HOST:PORT, log:FILE
    ///
    /// `sim` is a virtual bus of this command alone, with factory-fresh drives, as fast as the machine goes.
    #[arg(long, value_name = "BUS", env = "FERRODRIVE_BUS", default_value = "sim", global = true)]
    pub(crate) bus: BusSpec,

    /// Print JSON instead of text
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Which model a node is, where its identity cannot tell (e.g. 4=zlac8030l); may be repeated
    #[arg(long = "model", value_name = "NODE=MODEL", value_parser = node_model, global = true)]
    pub(crate) models: Vec<(NodeId, &'static Description)>,

    /// Machine file that says which models are where on a real bus; `sim` serves the drives that it describes
    ///
    /// On a real bus the `model` and `node` of each [[drive]] count. The same file describes a bus of a command's own to --bus
    /// sim:FILE.toml, which knows its drives.
    #[arg(long, value_name = "FILE.toml", value_parser = machine_file::machine, env = "FERRODRIVE_MACHINE", global = true)]
    pub(crate) machine: Option<Machine>,

    /// Longest wait for each answer of a node
    #[arg(long, value_name = "TIME", value_parser = master::units::parse_duration, default_value = "500ms", global = true)]
    pub(crate) timeout: Duration,
}

/// All commands.
#[derive(Subcommand)]
pub(crate) enum Command {
    Demo(demo::Demo),
    Sim(sim::Sim),
    Scan(scan::Scan),
    Read(sdo::Read),
    Write(sdo::Write),
    Objects(objects::Objects),
    Readings(readings::Readings),
    Nmt(nmt::Nmt),
    State(drive::State),
    Enable(drive::Enable),
    Disable(drive::Disable),
    Stop(drive::Stop),
    QuickStop(drive::QuickStop),
    Reset(drive::Reset),
    Velocity(motion::Velocity),
    Move(motion::Move),
    Torque(motion::Torque),
    Home(home::Home),
    Dump(dump::Dump),
    Save(store::Save),
    Restore(store::Restore),
    Completions(completions::Completions),
}
