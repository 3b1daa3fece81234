//! Scenarios from their files, with the values of the command line; and the errors of files that cannot be used.

use std::path::Path;

use scenario::Scenario;
use sim::Fidelity;
use words::document::BadFile;
use words::document::reader::Parameters;

use crate::failure::Failure;

/// A scenario as its file has it, and what the command line says of its parameters.
pub(super) struct Loaded<'a> {
    file: &'a Path,
    scenario: Scenario,
    set: &'a [(String, String)],
}

impl<'a> Loaded<'a> {
    pub(super) fn read(
        file: &'a Path,
        set: &'a [(String, String)],
        fidelity: Option<Fidelity>,
    ) -> Result<Self, Failure> {
        let mut scenario = Scenario::read(file).map_err(|reason| unusable(file, &reason))?;
        scenario.fidelity = fidelity;
        Ok(Self { file, scenario, set })
    }

    /// The parameters that the command line names and it does not have.
    pub(super) fn strange(&self) -> impl Iterator<Item = &'a str> {
        self.set.iter().map(|(name, _)| name.as_str()).filter(|name| !self.scenario.parameters.contains_key(*name))
    }

    /// The scenario with all the values of the command line.
    pub(super) fn with_all(self) -> Result<Scenario, Failure> {
        if let Some(name) = self.strange().next() {
            let known: Vec<_> = self.scenario.parameters.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "it has none".into() } else { format!("it has: {}", known.join(", ")) };
            return Err(unusable(self.file, &format!("it has no parameter '{name}'; {known}")));
        }
        self.with_its_own()
    }

    /// The scenario with those of the values that are of its parameters.
    pub(super) fn with_its_own(self) -> Result<Scenario, Failure> {
        let known = self.set.iter().filter(|(name, _)| self.scenario.parameters.contains_key(name));
        let values: Parameters = known.cloned().collect();
        let named = |bad: BadFile| unusable(self.file, &bad.named(self.file.display().to_string()).to_string());
        self.scenario.with(&values).map_err(named)
    }
}

fn unusable(file: &Path, reason: &str) -> Failure {
    Failure::bad_file(format!("cannot use the scenario {}", file.display()))
        .because(reason)
        .next("docs/scenarios.md describes each key; examples/scenarios has some")
}

/// The machine of a scenario cannot be built.
pub(super) fn unbuildable(file: &Path, bad: BadFile) -> Failure {
    Failure::bad_file(format!("cannot build the machine of {}", file.display()))
        .because(bad)
        .next("docs/machine-file.md describes each key of a machine")
}

/// Writes what came of a run.
pub(super) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    std::fs::write(path, text).map_err(|error| Failure::of_writing("the result", path, &error))
}
