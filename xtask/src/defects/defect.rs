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
    pub(in crate::defects) const TABLES: Tests = Tests { filter: "tables_of_", ..Tests::of("ferrodrive-tests", "it") };
    pub(in crate::defects) const WHEEL: Tests = Tests { filter: "zlac8030l", ..Tests::of("ferrodrive-tests", "it") };
}
