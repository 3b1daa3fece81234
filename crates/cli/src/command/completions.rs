//! `ferrodrive completions`: completion scripts for shells.

use std::io;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::Cli;

/// Print a completion script for a shell
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  ferrodrive completions bash > ~/.local/share/bash-completion/completions/ferrodrive\n  \
    ferrodrive completions fish > ~/.config/fish/completions/ferrodrive.fish"
)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

impl Completions {
    /// Writes the script to standard output.
    pub(crate) fn run(&self) {
        clap_complete::generate(self.shell, &mut Cli::command(), "ferrodrive", &mut io::stdout());
    }
}
