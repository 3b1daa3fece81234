//! What the commands that serve a world share: options, signals, the end.

mod control_options;

use std::io::{self, IsTerminal, stdin};
use std::net::SocketAddr;

use serve::pacer::Clock;
use serve::service::{END_PATIENCE, Parted, Request};
use tokio::net::TcpListener;
use tokio::runtime::Runtime;
use tokio::sync::mpsc;

pub(crate) use control_options::ControlOptions;

use crate::failure::Failure;
use crate::session::{no_runtime, runtime};
use crate::signals::{EndSignals, Signals};

/// What is asked of a served world, and why it ends.
pub(crate) type ServiceRequest = Request<Failure>;

/// What `--clock` says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ClockArg {
    /// Time passes by itself
    #[default]
    Real,
    /// Time passes by `run 20ms` only
    Manual,
}

impl From<ClockArg> for Clock {
    fn from(clock: ClockArg) -> Self {
        match clock {
            ClockArg::Real => Self::Real,
            ClockArg::Manual => Self::Manual,
        }
    }
}

/// The runtime of a served world and its clients.
pub(crate) fn runtime_of_clients() -> Result<Runtime, Failure> {
    serve::service::runtime_of_clients().map_err(|error| no_runtime(&error))
}

/// What `--listen` says: a server there, and its address.
pub(crate) async fn listen(place: &str) -> Result<(TcpListener, SocketAddr), Failure> {
    let listener = TcpListener::bind(place).await.map_err(|error| cannot_listen(place, error))?;
    let address = listener.local_addr().map_err(|error| cannot_listen(place, error))?;
    Ok((listener, address))
}

pub(crate) fn cannot_listen(place: &str, error: io::Error) -> Failure {
    Failure::new(format!("cannot listen at {place}"))
        .because(error)
        .next("give --listen HOST:PORT of this machine, with a port that is free; port 0 takes any")
}

/// Lines of standard input are typed by a person.
pub(crate) fn is_typed() -> bool {
    stdin().is_terminal()
}

/// The end of a served world: the reason that `ended` it is reported first, then what is not whole on the disk.
pub(crate) fn at_the_end(ended: Result<(), Failure>, parted: Parted) -> Result<(), Failure> {
    let Parted { torn, is_read } = parted;
    let ended = torn.into_iter().fold(ended, |ended, torn| match ended {
        Ok(()) => Err(torn.into()),
        Err(failure) => Err(torn.because.into_iter().fold(failure.because(torn.what), Failure::because)),
    });
    // Without a reader the reason cannot be printed either: that would wait for ever.
    ended.map_err(|failure| Failure { reported: failure.reported | !is_read, ..failure })
}

/// Listens to signals from now on, in a thread of its own. The first asks for the end; if that takes too long, or a second
/// one comes, the process ends at once. Stores that were acknowledged are on the disk in any case.
pub(crate) fn listen_to_signals(requests: mpsc::Sender<ServiceRequest>) {
    let (ready, listening) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let Ok(runtime) = runtime() else { return };
        runtime.block_on(async {
            let mut signals = Signals::listen();
            drop(ready);
            let signal = signals.next().await;
            let asked = async {
                let _ = requests.send(ServiceRequest::Ended(crate::failure::ended_by(signal))).await;
                std::future::pending::<()>().await;
            };
            tokio::select! {
                () = asked => {}
                _ = signals.next() => {}
                () = tokio::time::sleep(END_PATIENCE) => {}
            }
            std::process::exit(signal.status() as i32);
        });
    });
    // A client that has read `ready` may ask for the end; the other end is dropped when that is so.
    let _: Result<(), _> = listening.recv();
}
