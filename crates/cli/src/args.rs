//! The command line as a whole: what every command takes, and the list of commands, each from its own file.

use clap::{Parser, Subcommand};
use console::command::objects;

use crate::command::configure::{dcf, init, lss, params, program, store, tune};
use crate::command::look::{dump, emcy, pdo, read, report, studio, top, watch};
use crate::command::moving::{drive_base, group, test_motion};
use crate::command::network::{boot, check, conform, gateway, latency, plan, send, supervise, sync, time};
use crate::command::record_and_replay::{capture, convert, decode, plot, record, replay};
use crate::command::simulate::{demo, events, run, sim, world};
use crate::command::tools::{completions, eds, export, fmu, man_pages, readings};
use crate::global::Global;

/// CANopen motor drives, virtual and real: simulate them, look into them, move them.
#[derive(Parser)]
#[command(name = "ferrodrive", version, propagate_version = true, max_term_width = 100, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// All commands.
#[derive(Subcommand)]
pub(crate) enum Command {
    Demo(demo::Demo),
    Sim(sim::Sim),
    Run(run::Run),
    World(world::World),
    Events(events::Events),
    Boot(boot::Boot),
    Supervise(supervise::Supervise),
    Read(read::Read),
    Objects(objects::Objects),
    Plot(plot::Plot),
    Readings(readings::Readings),
    Eds(eds::Eds),
    Init(init::Init),
    Dcf(dcf::Dcf),
    Watch(watch::Watch),
    Params(params::Params),
    Pdo(pdo::Pdo),
    Plan(plan::Plan),
    Check(check::Check),
    Emcy(emcy::Emcy),
    Lss(lss::Lss),
    Sync(sync::SyncCommand),
    Time(time::Time),
    Send(send::Send),
    Report(report::Report),
    Conform(conform::Conform),
    /// Those that a page has too.
    #[command(flatten)]
    OfConsole(console::command::Command),
    Group(group::GroupCommand),
    TestMotion(test_motion::TestMotion),
    DriveBase(drive_base::DriveBase),
    Tune(tune::Tune),
    Latency(latency::Latency),
    Record(record::Record),
    Capture(capture::Capture),
    Export(export::Export),
    Fmu(fmu::Fmu),
    Gateway(gateway::Gateway),
    Studio(studio::Studio),
    Top(top::Top),
    Dump(dump::Dump),
    Decode(decode::Decode),
    Convert(convert::Convert),
    Replay(replay::Replay),
    Restore(store::Restore),
    Program(program::Program),
    Completions(completions::Completions),
    #[command(hide = true)]
    ManPages(man_pages::ManPages),
    /// Options that every command takes, before or after it
    ///
    /// A command refuses those that have no effect on it; its help lists the ones it takes.
    #[command(hide = true)]
    Options,
}
