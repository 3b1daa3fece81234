//! Why a node with one defect fails further cases: what they need of a node is what is broken. Each case of a cause has to fail
//! with the defect, and no other.

/// What a case needs of a node, and the cases that need it.
#[derive(Clone, Copy)]
pub(crate) struct Cause {
    /// Said of the cases.
    pub(crate) why: &'static str,
    pub(crate) cases: &'static [&'static str],
}

pub(crate) const fn cause(why: &'static str, cases: &'static [&'static str]) -> Cause {
    Cause { why, cases }
}

/// Every case that asks the server something; they are not listed.
pub(crate) const ANSWERS: Cause = cause("They ask the SDO server, and look at each answer.", &["*"]);
pub(crate) const PERIOD: Cause = cause(
    "They write the period to 1017h and listen to the heartbeats that come of it.",
    &["HBG 04", "HBG 05", "HBG 06", "HBG 07", "HB 02", "HB 07", "HB 51"],
);
pub(crate) const PERIOD_AND_OFF: Cause =
    cause("They write a period to 1017h, hear a heartbeat, and then write 0.", &["HBG 02", "HB 03"]);
pub(crate) const STATE: Cause = cause(
    "They see the NMT state in heartbeats, which they switch on by 1017h.",
    &["STATE 03", "STATE 04", "TRANS 02", "TRANS 03", "TRANS 04", "TRANS 51", "TRANS 52", "TRANS 53"],
);
pub(crate) const STATE_AFTER_RESET: Cause =
    cause("It sees the state after the boot-up message in heartbeats, where 1017h takes a period.", &["STATE 02"]);
pub(crate) const SAVED: Cause =
    cause("What it saves, and looks for after a reset, is another value of 1017h.", &["OTHER 52"]);
pub(crate) const LENGTHS: Cause = cause(
    "The object whose length they write wrongly is 1017h, and they compare its value before and after.",
    &["SDO 08", "SDO 09", "SDO 58", "SDO 59"],
);
pub(crate) const QUIET: Cause = cause(
    "They switch the heartbeat off by 1017h = 0 and take what comes with 700h + node-ID for the answer to a remote frame.",
    &["GUARD 03", "GUARD 04", "GUARD 06", "HBG 03"],
);
pub(crate) const TOGGLE: Cause =
    cause("They compare the toggle bits of successive answers to remote frames.", &["GUARD 03", "HBG 03"]);
pub(crate) const DICTIONARY: Cause =
    cause("They read every object, in pre-operational and in operational.", &["OD 01", "OD 07"]);
pub(crate) const CONSTANTS: Cause = cause("It compares every constant with the description.", &["OD 08"]);
pub(crate) const DELIVERED: Cause = cause("It compares every value with that as delivered.", &["OD 02"]);
pub(crate) const GUARD_TIME: Cause =
    cause("The object that they write, or read as one of their two, is 100Ch.", &["SDO 14", "SDO 20", "SDO 24"]);
pub(crate) const ERROR: Cause = cause(
    "They force the error and wait for its EMCY message, before they look at what is their own.",
    &["EMCY 05", "EMCY 06", "EMCY 52"],
);
pub(crate) const LSS_ADDRESS: Cause =
    cause("They select the node by the numbers that 1018h has.", &["LSS 51", "LSS 52", "LSS 53", "LSS 54", "LSS 55"]);
pub(crate) const BLOCKS_OF_NAME: Cause =
    cause("The long object that they read as a block, and in another way, is 1008h.", &["SDO 22", "SDO 23"]);
pub(crate) const NAME: Cause = cause(
    "The object that they read in segments is 1008h, the first that is longer than four bytes.",
    &["SDO 17", "SDO 18", "SDO 55", "SDO 56"],
);
pub(crate) const BLOCKS_OF_TYPE: Cause =
    cause("The object whose block upload they begin is 1000h.", &["SDO 26", "SDO 27"]);
pub(crate) const BLOCKS_OF_PERIOD: Cause =
    cause("They write 1017h as a block, with a right and with a wrong CRC.", &["SDO 25", "SDO 60"]);
pub(crate) const EVENTS: Cause =
    cause("They change a mapped object by SDO in operational and count the PDOs that come.", &["PDO 04", "PDO 51"]);
pub(crate) const RECEIVED: Cause =
    cause("They map an output into the receive PDO and send it.", &["PDO 52", "PDO 53", "PDO 54", "PDO 55"]);
pub(crate) const SYNCHRONOUS: Cause =
    cause("They count the PDOs of type 1 that come with each SYNC.", &["SYNC 03", "SYNC 51"]);
pub(crate) const MAPPING_REFUSED: Cause = cause(
    "They take the code of the refused mapping for their verdict.",
    &["PDO 23", "PDO 24", "PDO 25", "PDO 31", "PDO 32"],
);
pub(crate) const VIA_ENABLED: Cause = cause(
    "They bring the drive to Operation enabled by way of Ready to switch on and Switched on.",
    &[
        "402-33", "402-35", "402-36", "402-40", "402-41", "402-42", "402-43", "402-44", "402-45", "402-46", "402-47",
        "402-48", "402-49", "402-50", "402-51",
    ],
);
pub(crate) const VIA_SWITCHED_ON: Cause = cause(
    "They bring the drive to Switched on by way of Ready to switch on.",
    &["402-32", "402-34", "402-37", "402-38"],
);
pub(crate) const VIA_READY: Cause = cause("They begin in Ready to switch on.", &["402-31", "402-39"]);
pub(crate) const LEFT_READY: Cause =
    cause("They bring the drive to Ready to switch on, to leave it again.", &["402-03", "402-04"]);
pub(crate) const POSITION: Cause = cause(
    "They read 6064h before and after a move, or until the motor stands.",
    &["402-44", "402-45", "402-46", "402-48", "402-49", "402-50"],
);
pub(crate) const VELOCITY: Cause =
    cause("They wait until 6061h is 3, profile velocity.", &["402-46", "402-47", "402-48", "402-49"]);
