//! The letters by which a CANopen manager says how the boot-up of an NMT slave ended. Source: CiA 302-2, error status of the
//! process "boot NMT slave"; the words are ours.

use core::fmt;

/// Why the boot-up of a node ended other than with a started node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[doc(alias = "es")]
pub enum ErrorStatus {
    /// A: it is not in the list of slaves (1F81h, bit 0).
    NotListed,
    /// B: no answer to the request for its device type (1000h).
    NoDeviceType,
    /// C: another device type than 1F84h has.
    OtherDeviceType,
    /// D: another vendor-ID (1018h:01) than 1F85h has.
    OtherVendor,
    /// E: no heartbeat when its state was asked for.
    NoHeartbeat,
    /// F: no answer to node guarding.
    NoGuarding,
    /// G: the program that it has cannot be compared with the one that it is to have, or is another and there is none to load.
    NoProgram,
    /// H: a program would have to be loaded, which is not allowed.
    ProgramNotAllowed,
    /// I: the program could not be loaded.
    ProgramFailed,
    /// J: the configuration could not be written.
    ConfigurationFailed,
    /// K: no heartbeat when its watch was begun.
    NoHeartbeatAtStart,
    /// L: it was operational before, and was left so. Not a failure.
    InitiallyOperational,
    /// M: another product code (1018h:02) than 1F86h has.
    OtherProduct,
    /// N: another revision number (1018h:03) than 1F87h has.
    OtherRevision,
    /// O: another serial number (1018h:04) than 1F88h has.
    OtherSerial,
}

/// A row: the status, its letter, what it means, what to do.
type StatusRow = (ErrorStatus, char, &'static str, &'static str);

use ErrorStatus::{
    ConfigurationFailed, InitiallyOperational, NoDeviceType, NoGuarding, NoHeartbeat, NoHeartbeatAtStart, NoProgram,
    NotListed, OtherDeviceType, OtherProduct, OtherRevision, OtherSerial, OtherVendor, ProgramFailed,
    ProgramNotAllowed,
};

const WRONG_DEVICE: &str =
    "another device than planned is at this node-ID: check which one is wired there, or correct the plan";

/// Every status once, in the order of the letters.
const TABLE: [StatusRow; 15] = [
    (
        NotListed,
        'A',
        "it is not in the list of slaves (1F81h)",
        "set bit 0 of 1F81h for it, or leave it out of the plan",
    ),
    (
        NoDeviceType,
        'B',
        "it does not answer the question for its device type (1000h)",
        "check its supply, its cable and its node-ID",
    ),
    (OtherDeviceType, 'C', "its device type (1000h) is not the expected one (1F84h)", WRONG_DEVICE),
    (OtherVendor, 'D', "its vendor-ID (1018h:01) is not the expected one (1F85h)", WRONG_DEVICE),
    (
        NoHeartbeat,
        'E',
        "it sends no heartbeat that would show its state",
        "check that its 1017h is not 0, and its cable",
    ),
    (
        NoGuarding,
        'F',
        "it does not answer node guarding",
        "check its cable, and that it has node guarding (100Ch, 100Dh) and no heartbeat (1017h is 0)",
    ),
    (
        NoProgram,
        'G',
        "its program cannot be compared, or is another than expected (1F55h) and none is available",
        "load the program with its maker's tool, or correct 1F55h and bit 5 of 1F81h",
    ),
    (
        ProgramNotAllowed,
        'H',
        "its program is not the expected one (1F55h), and must not be replaced (1F81h, bits 6 and 4)",
        "load the program with its maker's tool, or correct 1F55h",
    ),
    (ProgramFailed, 'I', "loading its program failed", "load it with its maker's tool"),
    (ConfigurationFailed, 'J', "its configuration could not be written", "correct the value that was refused"),
    (
        NoHeartbeatAtStart,
        'K',
        "its heartbeat did not come when its watch began",
        "make the consumer time longer than the time in its 1017h",
    ),
    (InitiallyOperational, 'L', "already operational, left unchanged", "to configure it, stop it and reset it"),
    (OtherProduct, 'M', "its product code (1018h:02) is not the expected one (1F86h)", WRONG_DEVICE),
    (
        OtherRevision,
        'N',
        "its revision number (1018h:03) is not the expected one (1F87h)",
        "its firmware or hardware differs from the plan: update it, or correct the plan",
    ),
    (
        OtherSerial,
        'O',
        "its serial number (1018h:04) is not the expected one (1F88h)",
        "the device was replaced by one of its kind: correct the plan if that was meant",
    ),
];

impl ErrorStatus {
    /// Every status, A to O.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.0)
    }

    /// The standard's letter.
    pub fn letter(self) -> char {
        self.row().1
    }

    /// What it means, as a clause about the node.
    pub fn meaning(self) -> &'static str {
        self.row().2
    }

    /// What to do about it, in a clause.
    pub fn advice(self) -> &'static str {
        self.row().3
    }

    /// False for L alone, which says that there was nothing to do.
    pub fn is_failure(self) -> bool {
        self != InitiallyOperational
    }

    fn row(self) -> &'static StatusRow {
        // The rows are in the order of the variants, which a test checks.
        &TABLE[self as usize]
    }
}

/// `B: it does not answer the question for its device type (1000h)`.
impl fmt::Display for ErrorStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.letter(), self.meaning())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_letters_are_a_to_o_and_each_row_is_its_status() {
        let letters: String = ErrorStatus::all().map(ErrorStatus::letter).collect();
        assert_eq!(letters, "ABCDEFGHIJKLMNO");
        assert!(ErrorStatus::all().all(|status| status.row().0 == status));
        assert_eq!(OtherSerial.letter(), 'O');
        assert!(!InitiallyOperational.is_failure());
    }
}
