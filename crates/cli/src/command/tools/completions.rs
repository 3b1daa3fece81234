//! `ferrodrive completions`: completion scripts for shells.

use clap::ValueEnum;
use clap_complete::env::Shells;

use crate::failure::Failure;
use crate::output::print;

/// Print a completion script for a shell
///
/// The shell then asks this program how a command line may continue: commands and options, the nodes heard on the bus,
/// the objects of their models, models, modes and buses. Commands at a terminal remember what was heard in
/// $XDG_CACHE_HOME/ferrodrive.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  source <(ferrodrive completions bash)              # in ~/.bashrc\n  \
    ferrodrive completions zsh > ~/.zfunc/_ferrodrive     # a folder of $fpath\n  \
    ferrodrive completions fish > ~/.config/fish/completions/ferrodrive.fish")]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shell {
    Bash,
    Elvish,
    Fish,
    Powershell,
    Zsh,
}

impl Shell {
    const fn name(self) -> &'static str {
        match self {
            Self::Bash => "bash",
            Self::Elvish => "elvish",
            Self::Fish => "fish",
            Self::Powershell => "powershell",
            Self::Zsh => "zsh",
        }
    }
}

impl Completions {
    /// Writes the script for a command line to standard output.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let name = self.shell.name();
        let mut script = Vec::new();
        if matches!(self.shell, Shell::Bash) {
            script.extend_from_slice(BASH.as_bytes());
        } else {
            let known = Shells::builtins();
            let shell = known.completer(name).ok_or_else(|| {
                Failure::new(format!("cannot print a script for {name}")).next("name bash, fish or zsh")
            })?;
            let written = shell.write_registration(ASKED_BY, "ferrodrive", "ferrodrive", "ferrodrive", &mut script);
            written.map_err(Failure::of_stdout)?;
        }
        if matches!(self.shell, Shell::Zsh) {
            script.extend_from_slice(ZSH_AUTOLOAD.as_bytes());
        }
        print(&script).map_err(Failure::of_stdout)
    }
}

/// The script for bash; the other shells have that of `clap_complete`, whose protocol it speaks.
const BASH: &str = include_str!("completions.bash");

/// A file of $fpath is read when it is first asked: it has to answer that press of the Tab key too.
const ZSH_AUTOLOAD: &str =
    "if [[ $funcstack[1] == _ferrodrive ]]; then\n    _clap_dynamic_completer_ferrodrive \"$@\"\nfi\n";

/// The variable by which a script asks, that of bash too.
pub(crate) const ASKED_BY: &str = "FERRODRIVE_COMPLETE";
