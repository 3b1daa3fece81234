//! What a defect is, and the programs whose tests notice.

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

/// The programs that notice.
pub(super) mod programs {
    use super::Tests;

    pub(in crate::defects) const CAN: Tests = Tests::of("ferrodrive-can", "--lib");
    pub(in crate::defects) const CANOPEN: Tests = Tests::of("ferrodrive-canopen", "--lib");
    pub(in crate::defects) const CANOPEN_IT: Tests = Tests::of("ferrodrive-canopen", "it");
    pub(in crate::defects) const CIA402: Tests = Tests::of("ferrodrive-cia402", "--lib");
    pub(in crate::defects) const MOTION: Tests = Tests::of("ferrodrive-motion", "--lib");
    pub(in crate::defects) const MOTION_IT: Tests = Tests::of("ferrodrive-motion", "it");
    pub(in crate::defects) const PLANT: Tests = Tests::of("ferrodrive-plant", "--lib");
    pub(in crate::defects) const PLANT_IT: Tests = Tests::of("ferrodrive-plant", "it");
    pub(in crate::defects) const DRIVES: Tests = Tests::of("ferrodrive-drives", "--lib");
    pub(in crate::defects) const DRIVES_IT: Tests = Tests::of("ferrodrive-drives", "it");
    pub(in crate::defects) const SIM: Tests = Tests::of("ferrodrive-sim", "--lib");
    pub(in crate::defects) const MASTER: Tests = Tests::of("ferrodrive-master", "--lib");
    pub(in crate::defects) const MASTER_IT: Tests = Tests::of("ferrodrive-master", "it");
    pub(in crate::defects) const EDS: Tests = Tests::of("ferrodrive-eds", "--lib");
    pub(in crate::defects) const WORDS: Tests = Tests::of("ferrodrive-words", "--lib");
    pub(in crate::defects) const SIM_IT: Tests = Tests::of("ferrodrive-sim", "it");
    pub(in crate::defects) const TUNE: Tests = Tests::of("ferrodrive-tune", "--lib");
    pub(in crate::defects) const SLCAN: Tests = Tests::of("ferrodrive-slcan", "--lib");
    pub(in crate::defects) const CANLOG: Tests = Tests::of("ferrodrive-canlog", "--lib");
    pub(in crate::defects) const SCENARIO: Tests = Tests::of("ferrodrive-scenario", "--lib");
    pub(in crate::defects) const SCENARIO_IT: Tests = Tests::of("ferrodrive-scenario", "it");
    pub(in crate::defects) const MACHINE: Tests = Tests::of("ferrodrive-machine", "--lib");
    pub(in crate::defects) const MACHINE_IT: Tests = Tests::of("ferrodrive-machine", "it");
    pub(in crate::defects) const RECORDING: Tests = Tests::of("ferrodrive-recording", "--lib");
    pub(in crate::defects) const FMU: Tests = Tests::of("ferrodrive-fmu", "--lib");
    pub(in crate::defects) const FOXGLOVE: Tests = Tests::of("ferrodrive-foxglove", "--lib");
    pub(in crate::defects) const SERVE: Tests = Tests::of("ferrodrive-serve", "--lib");
    pub(in crate::defects) const CONFORM_IT: Tests = Tests::of("ferrodrive-conform", "it");
    pub(in crate::defects) const IO: Tests = Tests { filter: "io_and_encoders", ..Tests::of("ferrodrive-tests", "it") };
    pub(in crate::defects) const TABLES: Tests = Tests { filter: "tables_of_", ..Tests::of("ferrodrive-tests", "it") };
    pub(in crate::defects) const WHEEL: Tests = Tests { filter: "zlac8030l", ..Tests::of("ferrodrive-tests", "it") };
}
