//! The signals that ask this process to end: Ctrl-C, `kill`, a closed terminal, Ctrl-\.
//!
//! One function waits for all of them, so that no command forgets one. Each ends the process with the status that shells
//! give it: 128 and its number. SIGKILL cannot be handled; the drives then act by themselves (`--guard`).

use std::collections::VecDeque;
#[cfg(unix)]
use std::future::poll_fn;
#[cfg(unix)]
use std::task::Poll;
use std::time::Duration;

use can::Instant;
use master::Network;

use console::status::Status;

/// A signal that asks this process to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Signal {
    /// SIGHUP: the terminal is closed, or the connection to it lost.
    HangUp,
    /// SIGINT: Ctrl-C.
    Interrupt,
    /// SIGQUIT: Ctrl-\.
    Quit,
    /// SIGTERM: `kill`, a supervisor, a shutdown.
    Terminate,
}

impl Signal {
    /// The status to end with.
    pub(crate) const fn status(self) -> Status {
        match self {
            Self::HangUp => Status::HungUp,
            Self::Interrupt => Status::Interrupted,
            Self::Quit => Status::Quit,
            Self::Terminate => Status::Terminated,
        }
    }

    /// What happened, in words.
    pub(crate) const fn text(self) -> &'static str {
        match self {
            Self::HangUp => "the terminal was closed (SIGHUP)",
            Self::Interrupt => "interrupted",
            Self::Quit => "interrupted (SIGQUIT)",
            Self::Terminate => "terminated (SIGTERM)",
        }
    }
}

/// Completes with the first signal that asks this process to end, from its first poll on.
pub(crate) async fn asked_to_end() -> Signal {
    Signals::listen().next().await
}

/// Where signals that ask a command to end come from.
pub(crate) trait EndSignals {
    /// Completes with the next one. Nothing is lost if it is dropped before.
    async fn next(&mut self) -> Signal;
}

/// Signals at times of a bus in virtual time.
pub(crate) struct SignalsAt {
    network: Network,
    coming: VecDeque<(Instant, Signal)>,
}

impl SignalsAt {
    /// Each so long after now; in this order.
    pub(crate) fn from_now(network: Network, signals: &[(Duration, Signal)]) -> Self {
        let now = network.now();
        Self { network, coming: signals.iter().map(|(after, signal)| (now + *after, *signal)).collect() }
    }
}

impl EndSignals for SignalsAt {
    async fn next(&mut self) -> Signal {
        let Some((at, signal)) = self.coming.front().copied() else { return std::future::pending().await };
        self.network.sleep(at - self.network.now()).await;
        self.coming.pop_front();
        signal
    }
}

/// The signals that ask this process to end. From [`listen`](Self::listen) on none of them ends it by itself, which is the
/// system's default until then. Needs a runtime about it.
#[cfg(unix)]
pub(crate) struct Signals {
    streams: Vec<(Signal, tokio::signal::unix::Signal)>,
}

#[cfg(unix)]
impl Signals {
    /// Listens from now on.
    pub(crate) fn listen() -> Self {
        use tokio::signal::unix::{SignalKind, signal};
        let all = [
            (Signal::Interrupt, SignalKind::interrupt()),
            (Signal::Terminate, SignalKind::terminate()),
            (Signal::Quit, SignalKind::quit()),
            (Signal::HangUp, SignalKind::hangup()),
        ];
        let wanted = all.into_iter().filter(|(asked, _)| *asked != Signal::HangUp || !hang_up_is_ignored());
        Self { streams: wanted.filter_map(|(asked, kind)| Some((asked, signal(kind).ok()?))).collect() }
    }
}

#[cfg(unix)]
impl EndSignals for Signals {
    async fn next(&mut self) -> Signal {
        poll_fn(|context| {
            let mut streams = self.streams.iter_mut();
            let heard = streams.find_map(|(signal, stream)| stream.poll_recv(context).is_ready().then_some(*signal));
            heard.map_or(Poll::Pending, Poll::Ready)
        })
        .await
    }
}

/// True if the parent process wants this one to outlive its terminal, as `nohup` does. False where the system does not
/// show it.
#[cfg(unix)]
fn hang_up_is_ignored() -> bool {
    /// SIGHUP is signal 1, the lowest bit of the mask.
    const HANG_UP: u64 = 1;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & HANG_UP != 0)
}

/// Ctrl-C, where there are no signals.
#[cfg(not(unix))]
pub(crate) struct Signals;

#[cfg(not(unix))]
impl Signals {
    /// Listens from the first call of [`next`](Self::next) on.
    pub(crate) fn listen() -> Self {
        Self
    }
}

#[cfg(not(unix))]
impl EndSignals for Signals {
    async fn next(&mut self) -> Signal {
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
        Signal::Interrupt
    }
}
