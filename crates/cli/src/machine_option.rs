//! `--machine`, read and put where commands look for it.

use clap::ArgMatches;
use clap::parser::ValueSource;
use transport::BusSpec;

use crate::failure::Failure;
use crate::global::{Global, MachineFile, two_files};
use crate::scope::heeds_machine;
use crate::session::read_machine;

impl Global {
    /// The command line with the machine file where the command looks for it: on the virtual bus of a command's own its drives are
    /// there.
    ///
    /// # Errors
    /// Where the file cannot be used, or `--bus` names another one than `--machine`.
    pub(crate) fn with_machine_file(mut self, matches: &ArgMatches) -> Result<Self, Failure> {
        let command = matches.subcommand_name().unwrap_or_default();
        let Some(path) = self.machine_path.clone().filter(|_| heeds_machine(command)) else { return Ok(self) };
        let is_typed = matches.value_source("machine") == Some(ValueSource::CommandLine);
        // The file of the environment may be the one that is to be written.
        if command == "init" && !is_typed {
            return Ok(self);
        }
        // A check reads its file, and asks only a bus that is named; a simulator makes its drives itself.
        let makes_its_own = matches!(command, "check" | "sim");
        match &self.bus {
            BusSpec::Sim { file: None } if !makes_its_own => self.bus = BusSpec::Sim { file: Some(path.clone()) },
            BusSpec::Sim { file: Some(other) } if *other != path => {
                if is_typed {
                    return Err(two_files(other, &path));
                }
                return Ok(self);
            }
            _ => {}
        }
        // A check says of a bad file all that it finds.
        if command != "check" {
            self.machine = Some(read_machine(&path)?);
        }
        self.machine_file = Some(MachineFile { path, is_typed });
        Ok(self)
    }
}
