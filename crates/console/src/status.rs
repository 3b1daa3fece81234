//! The statuses that the process ends with.

/// How a command ended; the process ends with the same number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It was tried and did not come out, or a file that it was to be done by is bad or missing.
    Failed = 1,
    /// The command line itself makes no sense: no bus and no file is needed to see that.
    Usage = 2,
    /// The terminal was closed. Signals as shells number them: 128 + SIGHUP.
    HungUp = 129,
    /// Ctrl-C: 128 + SIGINT.
    Interrupted = 130,
    /// Ctrl-\: 128 + SIGQUIT.
    Quit = 131,
    /// Asked to end: 128 + SIGTERM.
    Terminated = 143,
}

impl Status {
    /// True if a signal ended the command.
    pub const fn is_signal(self) -> bool {
        self as u8 > 128
    }
}
