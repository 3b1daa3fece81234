//! One way for a command to get a network, on any bus: an embedded virtual one driven in virtual time, or a real one
//! driven by `transport` under tokio. The command is the same async code on both.

use std::cell::RefCell;
use std::error::Error;
use std::path::Path;
use std::sync::PoisonError;
use std::time::Duration;

use can::Tap;
use host::stopping::{Account, make_sure, stop};
use host::{Wire, WorldDoor};
use master::Network;
use sim::World;
use transport::realtime::{self, RealTimeError};
use transport::{BusNotes, BusSpec, BusThreadError, Note, WallClock};

use crate::context::Context;
use crate::embedded::{self, Embedded, EmbeddedDrives};
use crate::failure::Failure;
use crate::frames::decoder;
use crate::frames::stamp::Stamps;
use crate::frames::tap::Traffic;
use crate::global::{Global, SharedBus};
use crate::progress::Progress;
use crate::recording::{LogPath, interface_of};
use crate::signals::{EndSignals, Signals, SignalsAt, asked_to_end};
use crate::wire;
use machine::file::Machine;
use serve::live::{LiveBus, LostBus};
use serve::writing::{CommandLog, Pace};
use words::failure::causes;

/// Longest virtual time that a command may take; none comes near, and a hang would otherwise never end.
const VIRTUAL_LIMIT: Duration = Duration::from_secs(24 * 3600);

/// How long a command stays on a shared bus when it has ended.
const PARTING: Duration = Duration::from_millis(10);

/// Runs `command` on the bus of the command line.
pub(crate) fn run<R>(global: &Global, command: impl AsyncFnOnce(&Context) -> Result<R, Failure>) -> Result<R, Failure> {
    if let Some(shared) = &global.shared {
        return shared_bus(global, shared, command);
    }
    match &global.bus {
        BusSpec::Sim { file } => virtual_bus(global, file.as_deref(), command),
        BusSpec::Log { path } => Err(Failure::usage(format!("{} is a log: no node can answer", path.display()))
            .next(format!("ferrodrive --bus log:{} dump", path.display()))),
        _ => runtime()?.block_on(real_bus(global, command)),
    }
}

/// As [`run`], with an embedded bus whose time passes with the clock: for a command that serves people or programs.
pub(crate) fn run_live<R>(
    global: &Global,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<R, Failure> {
    match &global.bus {
        BusSpec::Sim { .. } => runtime()?.block_on(real_bus(global, command)),
        _ => run(global, command),
    }
}

/// A tokio runtime of this thread alone.
pub(crate) fn runtime() -> Result<tokio::runtime::Runtime, Failure> {
    let built = tokio::runtime::Builder::new_current_thread().enable_all().build();
    built.map_err(|error| no_runtime(&error))
}

/// The system gives this program no more of what it needs to wait for several things at once.
pub(crate) fn no_runtime(error: &std::io::Error) -> Failure {
    Failure::new("cannot start the runtime").because(error).next("raise the limit of open files: ulimit -n")
}

/// The world that `--bus sim` or `--bus sim:FILE.toml` means, and which drives are in it.
pub(crate) fn virtual_world(file: Option<&Path>) -> Result<Embedded, Failure> {
    let Some(path) = file else { return embedded::world() };
    let machine = read_machine(path)?;
    let world = machine
        .build()
        .map_err(|bad| host::network::unusable(path, bad.named(path.display().to_string()).to_string()))?;
    Ok((world, machine.models().collect()))
}

/// The machine file that a command names.
pub(crate) fn read_machine(path: &Path) -> Result<Machine, Failure> {
    Ok(host::network::read_machine(path)?)
}

/// On a bus of the command's own, whose drives boot first.
fn virtual_bus<R>(
    global: &Global,
    file: Option<&Path>,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<R, Failure> {
    exit_on_signal();
    let (mut world, drives) = virtual_world(file)?;
    in_virtual_time(global, &mut world, Some(&drives), async |context| {
        embedded::wait_until_booted(&context.network, &drives).await?;
        if global.verbose {
            context.traffic.show(decoder(global, &drives), Stamps::default(), context.progress.clone());
        }
        command(context).await
    })
}

/// On a bus that goes on without the command, as on a real one: its drives are not known, and what moves is stopped where the
/// command fails or is asked to end.
fn shared_bus<R>(
    global: &Global,
    shared: &SharedBus,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let mut world = shared.world.lock().unwrap_or_else(PoisonError::into_inner);
    in_virtual_time(global, &mut world, None, async |context| {
        if global.verbose {
            context.traffic.show(decoder(global, &[]), Stamps::default(), context.progress.clone());
        }
        let signals = SignalsAt::from_now(context.network.clone(), &shared.signals);
        let ended = until_asked_to_end(context, command(context), signals).await;
        context.note_twins();
        ended
    })
}

fn in_virtual_time<R>(
    global: &Global,
    world: &mut World,
    drives: Option<&EmbeddedDrives>,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let network = Network::new();
    let log = global.log.as_ref().map(LogPath::create).transpose()?;
    let (log, writing) = CommandLog::start(log, interface_of(&global.bus), Duration::ZERO, Pace::Free);
    let progress = Progress::new(global.json);
    let traffic = Traffic::default();
    let mut context =
        Context::new(global, network.clone(), drives.map(Vec::as_slice), progress.clone(), traffic.clone());
    // A bus that goes on without the command stands for a real one, of which nothing is known but its frames.
    context.true_values = drives.map(|_| world.live_values());
    let station = world.add_station(Tap::new(Tap::new(network, traffic), log));
    let ended = sim::block_on_for(world, VIRTUAL_LIMIT, command(&context));
    if drives.is_none() {
        // What it still had to send goes out, as it does on a real bus.
        world.run_for(PARTING);
        world.remove(station);
    }
    progress.clear();
    if let (Err(torn), Some(log)) = (writing.finish(), &global.log) {
        log.lacks(torn);
    }
    ended.map_err(|error| {
        let failure = Failure::new("the virtual bus came to a halt").because(error);
        failure.next("give the command less to do, or a shorter --for")
    })?
}

/// Opens the bus of the command line; of an embedded one also which drives are on it, and where their world can be asked.
async fn open(global: &Global, wire: Wire) -> Result<(LiveBus, Option<(EmbeddedDrives, WorldDoor)>), Failure> {
    if let BusSpec::Sim { file } = &global.bus {
        let (world, drives) = virtual_world(file.as_deref())?;
        let (bus, door) = LiveBus::of_world(world, start_clock(global)?, wire);
        return Ok((bus, Some((drives, door))));
    }
    let opened = LiveBus::open(&global.bus, global.realtime).await;
    let bus = opened.map_err(|error| match error {
        BusThreadError::RealTime(error) => no_real_time(&error),
        error => bus_failure(global, &error),
    })?;
    Ok((bus, None))
}

async fn real_bus<R>(global: &Global, command: impl AsyncFnOnce(&Context) -> Result<R, Failure>) -> Result<R, Failure> {
    let log = global.log.as_ref().map(LogPath::create).transpose()?;
    let health = Wire::default();
    let (bus, embedded) = open(global, health.clone()).await?;
    let (embedded, world) = embedded.unzip();
    let (log, writing) = CommandLog::start(log, interface_of(&global.bus), bus.clock().unix_zero(), Pace::RealTime);
    let network = Network::new();
    let progress = Progress::new(global.json);
    progress.spin();
    let traffic = Traffic::since(bus.clock().unix_zero());
    if global.verbose {
        traffic.show(decoder(global, &[]), Stamps::default(), progress.clone());
    }
    let mut context = Context::new(global, network.clone(), embedded.as_deref(), progress.clone(), traffic.clone());
    context.true_values = world.as_ref().and_then(WorldDoor::values).cloned();
    (context.world, context.wire) = (world, health);
    if let Some(unused) =
        global.machine.as_ref().filter(|_| global.verbose && embedded.is_none()).and_then(Machine::unused_by_a_master)
    {
        let text = format!(
            "of the machine file a command on a real bus does not use: {unused}; `ferrodrive sim --machine FILE` and `ferrodrive run` do"
        );
        context.note_once(&format!("{} {text}", global.bus), &text);
    }
    let notes = RefCell::new(BusNotes::of(&global.bus));
    let until = async {
        let booted_first = async {
            embedded::wait_until_booted(&context.network, embedded.as_deref().unwrap_or_default()).await?;
            command(&context).await
        };
        until_asked_to_end(&context, booted_first, Signals::listen()).await.map_err(|failure| {
            let notes = notes.borrow();
            // People have read them when they came; programs have only the final report.
            let failure = notes.troubles().filter(|_| global.json).fold(failure, Failure::because);
            notes.lost().into_iter().fold(failure, |failure, lost| without_bus(&context, failure.because(lost)))
        })
    };
    let station = Tap::new(Tap::new(network.clone(), traffic), log);
    let report = |_, note: &Note| {
        wire::put_down(&context.wire, note);
        let news = notes.borrow_mut().news(note);
        if let Some(text) = news {
            context.note(&text);
            context.wire.tell(&text);
        }
    };
    let ended = bus.run((&network, THIS), station, until, report).await;
    progress.clear();
    context.remember_nodes();
    context.note_twins();
    if let (Err(torn), Some(log)) = (writing.finish(), &global.log) {
        log.lacks(torn);
    }
    ended.map_err(|LostBus { error, moving }| {
        let failure = moving.iter().fold(bus_failure(global, &error), with_account);
        failure.next(format!("find out why {} was lost, and restart it", global.bus))
    })?
}

/// A clock, with `--realtime` one that wakes in real time.
pub(crate) fn start_clock(global: &Global) -> Result<WallClock, Failure> {
    if !global.realtime {
        return Ok(WallClock::start());
    }
    WallClock::start_in_real_time().map_err(|error| no_real_time(&error))
}

/// With `--realtime` this thread, and those that it starts from here on, run in real time.
pub(crate) fn enter_real_time(global: &Global) -> Result<(), Failure> {
    if !global.realtime {
        return Ok(());
    }
    realtime::enter().map_err(|error| no_real_time(&error))
}

fn no_real_time(error: &RealTimeError) -> Failure {
    failure_of(error).of_kind("realtime").next(error.advice())
}

/// Adds what to do where a command ended without its bus: what it moved may move still.
fn without_bus(context: &Context, failure: Failure) -> Failure {
    context.network.moved().iter().map(make_sure).fold(failure, Failure::next)
}

/// Who lets go of drives here.
const THIS: &str = "this command";

/// Ends the process on Ctrl-C and its like from here on: on an embedded bus there is no motor to stop.
pub(crate) fn exit_on_signal() {
    std::thread::spawn(|| {
        if let Ok(runtime) = runtime() {
            let signal = runtime.block_on(asked_to_end());
            std::process::exit(signal.status() as i32);
        }
    });
}

/// Carries out a command to its end, or until a signal comes; what it then has in motion is stopped.
async fn until_asked_to_end<R>(
    context: &Context,
    command: impl Future<Output = Result<R, Failure>>,
    mut signals: impl EndSignals,
) -> Result<R, Failure> {
    let (failure, by_signal) = tokio::select! {
        result = command => match result {
            Ok(done) => return Ok(done),
            Err(failure) => (failure, false),
        },
        signal = signals.next() => (crate::failure::ended_by(signal), true),
    };
    Err(stop_what_moves(context, failure, asked_again(context, signals, by_signal)).await)
}

/// What a terminal and the programs about this one send within this time is one wish to end: a shell, `make` and the like pass
/// Ctrl-C on to a process that has had it already. By then the quick stops are out.
const ONE_WISH: Duration = Duration::from_millis(250);

/// Until a second signal comes that is a wish of its own. Where the command has failed by itself, the first one asks for no more than
/// what is being done: its sender may not have seen the failure.
async fn asked_again(context: &Context, mut signals: impl EndSignals, has_one: bool) {
    if !has_one {
        signals.next().await;
    }
    let began = context.network.now();
    while context.network.now() - began < ONE_WISH {
        signals.next().await;
    }
}

/// Stops every node that this command has set in motion; the failure then says what was seen of that. When `again` is done, the wait
/// for it ends at once: drives that were not seen to stand may still be moving.
async fn stop_what_moves(context: &Context, failure: Failure, again: impl Future<Output = ()>) -> Failure {
    if !context.network.moved().is_empty() {
        context.progress.show("stopping; a second Ctrl-C ends without seeing the drives stand");
    }
    let writes = context.is_to_restore();
    let (accounts, restored) = tokio::select! {
        done = async { (stop(&context.network, THIS).await, context.restore().await) } => done,
        () = again => {
            let failure = Account::of_unawaited(&context.network, THIS).iter().fold(failure, with_account);
            let left = writes.then_some("not all that had been written was put back: the command was interrupted again");
            return left.into_iter().fold(failure, Failure::because);
        }
    };
    let failure = accounts.iter().fold(failure, with_account);
    match restored {
        Some(left) if left.is_empty() => failure.because("what had been written was put back"),
        Some(left) => left.iter().fold(failure, |failure, left| failure.because(format!("not put back: {left}"))),
        None => failure,
    }
}

/// Adds what was seen of a drive that was moving.
fn with_account(failure: Failure, account: &Account) -> Failure {
    let failure = account.because.iter().fold(failure, Failure::because);
    account.next().into_iter().fold(failure, Failure::next)
}

/// A failure of the bus itself, with every cause that is known.
pub(crate) fn bus_failure(global: &Global, error: &dyn Error) -> Failure {
    let mut failure = failure_of(error).of_kind("bus");
    failure.what = format!("bus {}: {}", global.bus, failure.what);
    if failure.next.is_empty() {
        return failure
            .next("check that it exists and is spelled correctly; `ferrodrive help options` lists the forms of --bus");
    }
    failure
}

/// That a place cannot be listened at.
pub(crate) fn not_served(error: &dyn Error) -> Failure {
    failure_of(error)
        .of_kind("bus")
        .next("give an address of this machine with a port that no other program has, or a device that is there; port 0 takes a free one")
}

/// An error with every cause that is known.
pub(crate) fn failure_of(error: &dyn Error) -> Failure {
    causes(error).fold(Failure::new(error.to_string()), Failure::because)
}
