//! One way for a command to get a network, on any bus: an embedded virtual one driven in virtual time, or a real one
//! driven by `transport` under tokio. The command is the same async code on both.

use std::error::Error;
use std::future::pending;
use std::time::Duration;

use master::Network;
use tokio::sync::Notify;
use transport::{BusSpec, WallClock, run_station};

use crate::args::Global;
use crate::context::Context;
use crate::embedded;

use crate::failure::Failure;
use crate::progress::Progress;

/// Longest virtual time that a command may take; none comes near, and a hang would otherwise never end.
const VIRTUAL_LIMIT: Duration = Duration::from_secs(24 * 3600);

/// How long stopping may take after Ctrl-C.
const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// Runs `command` on the bus of the command line.
pub(crate) fn run<R>(global: &Global, command: impl AsyncFnOnce(&Context) -> Result<R, Failure>) -> Result<R, Failure> {
    match &global.bus {
        BusSpec::Sim { file } => virtual_bus(global, file.as_deref(), command),
        BusSpec::Log { path } => Err(Failure::usage(format!("{} is a log: nobody there can answer", path.display()))
            .next(format!("ferrodrive --bus log:{} dump", path.display()))),
        _ => runtime()?.block_on(real_bus(global, command)),
    }
}

/// A tokio runtime of this thread alone.
pub(crate) fn runtime() -> Result<tokio::runtime::Runtime, Failure> {
    let built = tokio::runtime::Builder::new_current_thread().enable_all().build();
    built.map_err(|error| Failure::new("cannot start the runtime").because(error))
}

fn virtual_bus<R>(
    global: &Global,
    file: Option<&std::path::Path>,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<R, Failure> {
    let (mut world, drives) = embedded::world(file)?;
    let network = Network::new();
    world.add_station(network.clone());
    let progress = Progress::new(global.json);
    let context = Context::new(global, network.clone(), Some(&drives), progress.clone());
    let whole = async {
        embedded::wait_until_booted(&network, &drives).await?;
        command(&context).await
    };
    let ended = sim::block_on_for(&mut world, VIRTUAL_LIMIT, whole);
    progress.clear();
    ended.map_err(|error| Failure::new("the virtual bus came to a halt").because(error))?
}

async fn real_bus<R>(global: &Global, command: impl AsyncFnOnce(&Context) -> Result<R, Failure>) -> Result<R, Failure> {
    let clock = WallClock::start();
    let mut bus = global.bus.open(&clock).await.map_err(|error| bus_failure(global, &error))?;
    let network = Network::new();
    let progress = Progress::new(global.json);
    progress.spin();
    let context = Context::new(global, network.clone(), None, progress.clone());
    let until = async {
        tokio::select! {
            result = command(&context) => result,
            () = interrupted() => {
                stop_what_moves(&context).await;
                Err(Failure::interrupted())
            }
        }
    };
    let mut station = network.clone();
    let ended = run_station(&mut bus, &mut station, &clock, &Notify::new(), until).await;
    progress.clear();
    ended.map_err(|error| bus_failure(global, &error))?
}

/// Completes on Ctrl-C, or when the process is asked to end.
pub(crate) async fn interrupted() {
    let ctrl_c = async {
        if tokio::signal::ctrl_c().await.is_err() {
            pending::<()>().await;
        }
    };
    tokio::select! {
        () = ctrl_c => {}
        () = terminated() => {}
    }
}

#[cfg(unix)]
async fn terminated() {
    use tokio::signal::unix::{SignalKind, signal};
    match signal(SignalKind::terminate()) {
        Ok(mut terminate) => drop(terminate.recv().await),
        Err(_) => pending().await,
    }
}

#[cfg(not(unix))]
async fn terminated() {
    pending().await
}

/// Quick stop to every node that this command has set in motion.
async fn stop_what_moves(context: &Context) {
    // Whether it worked or not, the process ends now.
    let _ = tokio::time::timeout(STOP_PATIENCE, context.network.stop_all_moved()).await;
}

/// A failure of the bus itself, with every cause that is known.
pub(crate) fn bus_failure(global: &Global, error: &dyn Error) -> Failure {
    let mut failure = Failure::new(format!("bus {}: {error}", global.bus));
    let mut source = error.source();
    while let Some(cause) = source {
        failure = failure.because(cause);
        source = cause.source();
    }
    failure
}
