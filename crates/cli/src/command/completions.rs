//! `ferrodrive completions`: completion scripts for shells.

use clap::CommandFactory;
use clap_complete::Shell;

use crate::args::Cli;
use crate::failure::Failure;
use crate::output::print;

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
    pub(crate) fn run(&self) -> Result<(), Failure> {
        // The generator panics where it cannot write, so it writes to memory.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "ferrodrive", &mut script);
        print(&script).map_err(|error| Failure::new("cannot write to standard output").because(error))
    }
}
