//! SIGTSTP, which asks a program to give its terminal to the shell. What it leaves has to be as the shell had it, and a drive that is
//! moved needs its program: so nothing is stopped by the system before that is done.

/// Requests that it be suspended. From [`listen`](Self::listen) on none of them does that by itself.
#[cfg(unix)]
pub(super) struct Suspensions(Option<tokio::signal::unix::Signal>);

#[cfg(unix)]
impl Suspensions {
    /// Listens from now on.
    pub(super) fn listen() -> Self {
        use tokio::signal::unix::{SignalKind, signal};
        Self(signal(SignalKind::from_raw(rustix::process::Signal::TSTP.as_raw())).ok())
    }

    /// The next one.
    pub(super) async fn next(&mut self) {
        match &mut self.0 {
            Some(signals) => drop(signals.recv().await),
            None => std::future::pending().await,
        }
    }
}

/// The process stands still until it is continued.
#[cfg(unix)]
pub(super) fn suspend() {
    let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::STOP);
}

/// There is no such signal.
#[cfg(not(unix))]
pub(super) struct Suspensions;

#[cfg(not(unix))]
impl Suspensions {
    pub(super) fn listen() -> Self {
        Self
    }

    pub(super) async fn next(&mut self) {
        std::future::pending().await
    }
}

/// Nothing continues a program there.
#[cfg(not(unix))]
pub(super) fn suspend() {}
