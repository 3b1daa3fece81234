//! Defects put in on purpose: a place each, what is there, what is written instead, and the tests that have to notice.
//!
//! A line each, of the kind that a person writes by mistake: a limit by one, a sign, a word for its neighbour. Where a defect was not
//! noticed a test was missing, and has been written.

mod drives;
mod standards;
mod tools;

/// One line that is written wrongly.
pub(super) struct Defect {
    /// The file, from the root of the workspace.
    pub(super) file: &'static str,
    /// What is there, once.
    pub(super) text: &'static str,
    /// What is written instead.
    pub(super) instead: &'static str,
    pub(super) noticed_by: Tests,
}

/// A program with tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Tests {
    pub(super) package: &'static str,
    /// `--lib`, or the name of an integration test.
    pub(super) target: &'static str,
    /// A part of the names of the tests that run; empty for all.
    pub(super) filter: &'static str,
}

impl Tests {
    pub(super) const fn of(package: &'static str, target: &'static str) -> Self {
        Self { package, target, filter: "" }
    }
}

/// All of them, in the order of their numbers.
pub(super) fn defects() -> Vec<&'static Defect> {
    [standards::DEFECTS, drives::DEFECTS, tools::DEFECTS].into_iter().flatten().collect()
}

/// The programs that notice.
mod programs {
    use super::Tests;

    pub(super) const CAN: Tests = Tests::of("ferrodrive-can", "--lib");
    pub(super) const CANOPEN: Tests = Tests::of("ferrodrive-canopen", "--lib");
    pub(super) const CANOPEN_IT: Tests = Tests::of("ferrodrive-canopen", "it");
    pub(super) const CIA402: Tests = Tests::of("ferrodrive-cia402", "--lib");
    pub(super) const MOTION_IT: Tests = Tests::of("ferrodrive-motion", "it");
    pub(super) const PLANT: Tests = Tests::of("ferrodrive-plant", "--lib");
    pub(super) const PLANT_IT: Tests = Tests::of("ferrodrive-plant", "it");
    pub(super) const DRIVES: Tests = Tests::of("ferrodrive-drives", "--lib");
    pub(super) const DRIVES_IT: Tests = Tests::of("ferrodrive-drives", "it");
    pub(super) const SIM: Tests = Tests::of("ferrodrive-sim", "--lib");
    pub(super) const SIM_IT: Tests = Tests::of("ferrodrive-sim", "it");
    pub(super) const MASTER: Tests = Tests::of("ferrodrive-master", "--lib");
    pub(super) const MASTER_IT: Tests = Tests::of("ferrodrive-master", "it");
    pub(super) const HOST: Tests = Tests::of("ferrodrive-host", "--lib");
    pub(super) const HOST_IT: Tests = Tests::of("ferrodrive-host", "it");
    pub(super) const EDS: Tests = Tests::of("ferrodrive-eds", "--lib");
    pub(super) const WORDS: Tests = Tests::of("ferrodrive-words", "--lib");
    pub(super) const MACHINE_IT: Tests = Tests::of("ferrodrive-machine", "it");
    pub(super) const SCENARIO: Tests = Tests::of("ferrodrive-scenario", "--lib");
    pub(super) const SCENARIO_IT: Tests = Tests::of("ferrodrive-scenario", "it");
    pub(super) const RECORDING: Tests = Tests::of("ferrodrive-recording", "--lib");
    pub(super) const CANLOG: Tests = Tests::of("ferrodrive-canlog", "--lib");
    pub(super) const SLCAN: Tests = Tests::of("ferrodrive-slcan", "--lib");
    pub(super) const TUNE: Tests = Tests::of("ferrodrive-tune", "--lib");
    pub(super) const FMU: Tests = Tests::of("ferrodrive-fmu", "--lib");
    pub(super) const FOXGLOVE: Tests = Tests::of("ferrodrive-foxglove", "--lib");
    pub(super) const SERVE: Tests = Tests::of("ferrodrive-serve", "--lib");
    pub(super) const CONFORM_IT: Tests = Tests::of("ferrodrive-conform", "it");
    pub(super) const TABLES: Tests = Tests { filter: "tables_of_", ..Tests::of("ferrodrive-tests", "it") };
    pub(super) const WHEEL: Tests = Tests { filter: "zlac8030l", ..Tests::of("ferrodrive-tests", "it") };
}
