//! Device, heartbeat and PDO objects, 1000h to 1A03h ("M Robot Joint Motor CanOpen Manual", 5.04 and 5.08).
//!
//! 1001h and the sub-indexes 00h of the PDO parameters are not printed: CiA 301 has them.

use canopen::od::{Access, Entry};

use crate::row::cia::{ro, rws};
use crate::row::{U8, U16, U32, join};

pub(super) const ROWS: [Entry; 68] =
    join(&[&GENERAL, &RPDO_PARAMETERS, &RPDO_MAPPINGS, &TPDO_PARAMETERS, &TPDO_MAPPINGS]);

crate::row::rows! { const GENERAL: [Entry; 11], general_objects:
    ro(0x1000, 0, U32).default(0x0002_0192);
    ro(0x1001, 0, U8) => ERROR_REGISTER;
    // The description prints 8h.
    ro(0x1005, 0, U32).described("PDO synchronous ID").default(0x80);
    ro(0x1016, 0, U8).default(1);
    // Node 7Fh, 2000 ms.
    rws(0x1016, 1, U32).described("Consumption of time between heartbeats").default(0x007F_07D0)
        => CONSUMER_HEARTBEAT_TIME;
    rws(0x1017, 0, U16).described("The heartbeat generates interval time").default(1000).unit("ms");
    // Printed with 16 bits; CiA 301 has 8, as the manual's 1016h:00.
    ro(0x1018, 0, U8).default(4);
    ro(0x1018, 1, U32).default(0x331);
    ro(0x1018, 2, U32).default(0x1);
    ro(0x1018, 3, U32).described("Version number").default(0x100);
    ro(0x1018, 4, U32).default(0x1);
}

const AT_ONCE: &[(i64, &str)] = &[(255, "asynchronous mode")];
const WITH_SYNC: &[(i64, &str)] = &[(1, "synchronous mode: after one SYNC")];

const RPDO_PARAMETERS: [Entry; 16] = join(&[
    &pdo_parameters!(0x1400, 0x200, AT_ONCE, 255),
    &pdo_parameters!(0x1401, 0x300, AT_ONCE, 255),
    &pdo_parameters!(0x1402, 0x400, AT_ONCE, 255),
    &pdo_parameters!(0x1403, 0x500, WITH_SYNC, 1),
]);

const TPDO_PARAMETERS: [Entry; 16] = join(&[
    &pdo_parameters!(0x1800, 0x180, AT_ONCE, 255),
    &pdo_parameters!(0x1801, 0x280, AT_ONCE, 255),
    &pdo_parameters!(0x1802, 0x380, AT_ONCE, 255),
    &pdo_parameters!(0x1803, 0x480, AT_ONCE, 255),
]);

// "Cannot be changed": all of a mapping is read-only.
#[rustfmt::skip]
const RPDO_MAPPINGS: [Entry; 13] = [
    ro(0x1600, 0, U8).default(3),
    ro(0x1600, 1, U32).default(0x6040_0010),
    ro(0x1600, 2, U32).default(0x6060_0008),
    ro(0x1600, 3, U32).default(0x607A_0020),
    ro(0x1601, 0, U8).default(2),
    ro(0x1601, 1, U32).default(0x607A_0020),
    ro(0x1601, 2, U32).default(0x6081_0020),
    ro(0x1602, 0, U8).default(3),
    ro(0x1602, 1, U32).default(0x6040_0010),
    ro(0x1602, 2, U32).default(0x6060_0008),
    ro(0x1602, 3, U32).default(0x60FF_0020),
    ro(0x1603, 0, U8).default(1),
    ro(0x1603, 1, U32).default(0x607A_0020),
];

const TPDO_MAPPINGS: [Entry; 12] = join(&[
    &tpdo_mapping!(0x1A00, 0x6064_0020),
    &tpdo_mapping!(0x1A01, 0x6064_0020),
    // Printed 60640020; the caption, the frame's layout and the examples in 5.10.2 have the speed.
    &tpdo_mapping!(0x1A02, 0x606C_0020),
    &tpdo_mapping!(0x1A03, 0x6064_0020),
]);

/// What firmware 1.66 has otherwise: 1006h, TPDOs with an event timer, of which the first runs as delivered, and mappings that can
/// be written. Of 1006h and 180xh:04 it says no more than that they are there: types are those of CiA 301, and nothing acts
/// on them. That a mapping is stored is a guess: a PDO's other parameters are.
pub(super) const CHANGES_OF_1_66: [Entry; 38] = {
    let mappings: [Entry; 25] = join(&[&RPDO_MAPPINGS, &TPDO_MAPPINGS]);
    join(&[
        &[rws(0x1006, 0, U32).unit("us")],
        &writable(mappings),
        &event_timer!(0x1800, 100),
        &event_timer!(0x1801, 0),
        &event_timer!(0x1802, 0),
        &event_timer!(0x1803, 0),
    ])
};

/// These rows, to be written and stored.
const fn writable<const N: usize>(mut rows: [Entry; N]) -> [Entry; N] {
    let mut i = 0;
    while i < N {
        rows[i].access = Access::ReadWrite;
        rows[i].stored = true;
        i += 1;
    }
    rows
}

/// The rows of a TPDO's parameter that come with its event timer.
macro_rules! event_timer {
    ($index:literal, $default:literal) => {
        [ro($index, 0, U8).default(5), rws($index, 4, U8), rws($index, 5, U16).default($default).unit("ms")]
    };
}
use event_timer;

/// The four rows of one PDO's parameter. The identifier follows the node-ID.
macro_rules! pdo_parameters {
    ($index:literal, $cob_id:literal, $types:ident, $transmission_type:literal) => {
        [
            ro($index, 0, U8).default(3),
            rws($index, 1, U32).node_id_plus($cob_id),
            rws($index, 2, U8).described("Transport type").values($types).default($transmission_type),
            rws($index, 3, U16).default(1).unit("0.1 ms"),
        ]
    };
}
use pdo_parameters;

/// The three rows of one TPDO's mapping: what it is named after, then the statusword.
macro_rules! tpdo_mapping {
    ($index:literal, $first:literal) => {
        [ro($index, 0, U8).default(2), ro($index, 1, U32).default($first), ro($index, 2, U32).default(0x6041_0010)]
    };
}
use tpdo_mapping;
