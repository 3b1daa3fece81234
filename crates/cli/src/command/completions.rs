//! `ferrodrive completions`: completion scripts for shells.

use clap_complete::Shell;

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
    /// Writes the script for a command line to standard output.
    pub(crate) fn run(&self, whole: &mut clap::Command) -> Result<(), Failure> {
        // The generator panics where it cannot write, so it writes to memory.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, whole, "ferrodrive", &mut script);
        print(&script).map_err(Failure::of_stdout)
    }
}
