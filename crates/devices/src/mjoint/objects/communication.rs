//! Device, heartbeat and PDO objects, 1000h to 1A03h ("M Robot Joint Motor CanOpen Manual", 5.04 and 5.08).
//!
//! 1001h and the sub-indexes 00h of the PDO parameters are not printed: CiA 301 has them.

use canopen::od::{Access, Entry};

use crate::row::{U8, U16, U32, join, ro, rws};

pub(super) const ROWS: [Entry; 68] =
    join(&[&GENERAL, &RPDO_PARAMETERS, &RPDO_MAPPINGS, &TPDO_PARAMETERS, &TPDO_MAPPINGS]);

crate::row::rows! { const GENERAL: [Entry; 11], general_objects:
    ro(0x1000, 0, U32, "device_type", "Device type").default(0x0002_0192);
    ro(0x1001, 0, U8, "error_register", "Error register") => ERROR_REGISTER;
    // The description prints 8h.
    ro(0x1005, 0, U32, "cob_id_sync", "PDO synchronous ID").default(0x80);
    ro(0x1016, 0, U8, "consumer_heartbeat", "0x1016 number of subindexes").default(1);
    // Node 7Fh, 2000 ms.
    rws(0x1016, 1, U32, "consumer_heartbeat_time", "Consumption of time between heartbeats").default(0x007F_07D0)
        => CONSUMER_HEARTBEAT_TIME;
    rws(0x1017, 0, U16, "producer_heartbeat_time", "The heartbeat generates interval time").default(1000).unit("ms");
    // Printed with 16 bits; CiA 301 has 8, as the manual's 1016h:00.
    ro(0x1018, 0, U8, "identity_object", "0x1018 number of subindexes").default(4);
    ro(0x1018, 1, U32, "vendor_id", "Vendor ID").default(0x331);
    ro(0x1018, 2, U32, "product_code", "Product code").default(0x1);
    ro(0x1018, 3, U32, "revision_number", "Version number").default(0x100);
    ro(0x1018, 4, U32, "serial_number", "Serial number").default(0x1);
}

const AT_ONCE: &[(i64, &str)] = &[(255, "asynchronous mode")];
const WITH_SYNC: &[(i64, &str)] = &[(1, "synchronous mode: after one SYNC")];

const RPDO_PARAMETERS: [Entry; 16] = join(&[
    &pdo_parameters!(0x1400, "RPDO1", "rpdo1", 0x200, AT_ONCE, 255),
    &pdo_parameters!(0x1401, "RPDO2", "rpdo2", 0x300, AT_ONCE, 255),
    &pdo_parameters!(0x1402, "RPDO3", "rpdo3", 0x400, AT_ONCE, 255),
    &pdo_parameters!(0x1403, "RPDO4", "rpdo4", 0x500, WITH_SYNC, 1),
]);

const TPDO_PARAMETERS: [Entry; 16] = join(&[
    &pdo_parameters!(0x1800, "TPDO1", "tpdo1", 0x180, AT_ONCE, 255),
    &pdo_parameters!(0x1801, "TPDO2", "tpdo2", 0x280, AT_ONCE, 255),
    &pdo_parameters!(0x1802, "TPDO3", "tpdo3", 0x380, AT_ONCE, 255),
    &pdo_parameters!(0x1803, "TPDO4", "tpdo4", 0x480, AT_ONCE, 255),
]);

// "Cannot be changed": all of a mapping is read-only.
#[rustfmt::skip]
const RPDO_MAPPINGS: [Entry; 13] = [
    ro(0x1600, 0, U8, "rpdo1_mapping", "RPDO1 Number of mapping groups").default(3),
    ro(0x1600, 1, U32, "rpdo1_mapping_1", "RPDO1 Map 1").default(0x6040_0010),
    ro(0x1600, 2, U32, "rpdo1_mapping_2", "RPDO1 Map 2").default(0x6060_0008),
    ro(0x1600, 3, U32, "rpdo1_mapping_3", "RPDO1 Map 3").default(0x607A_0020),
    ro(0x1601, 0, U8, "rpdo2_mapping", "RPDO2 Number of mapping groups").default(2),
    ro(0x1601, 1, U32, "rpdo2_mapping_1", "RPDO2 Map 1").default(0x607A_0020),
    ro(0x1601, 2, U32, "rpdo2_mapping_2", "RPDO2 Map 2").default(0x6081_0020),
    ro(0x1602, 0, U8, "rpdo3_mapping", "RPDO3 Number of mapping groups").default(3),
    ro(0x1602, 1, U32, "rpdo3_mapping_1", "RPDO3 Map 1").default(0x6040_0010),
    ro(0x1602, 2, U32, "rpdo3_mapping_2", "RPDO3 Map 2").default(0x6060_0008),
    ro(0x1602, 3, U32, "rpdo3_mapping_3", "RPDO3 Map 3").default(0x60FF_0020),
    ro(0x1603, 0, U8, "rpdo4_mapping", "RPDO4 Number of mapping groups").default(1),
    ro(0x1603, 1, U32, "rpdo4_mapping_1", "RPDO4 Map 1").default(0x607A_0020),
];

const TPDO_MAPPINGS: [Entry; 12] = join(&[
    &tpdo_mapping!(0x1A00, "TPDO1", "tpdo1", 0x6064_0020),
    &tpdo_mapping!(0x1A01, "TPDO2", "tpdo2", 0x6064_0020),
    // Printed 60640020; the caption, the frame's layout and the examples in 5.10.2 have the speed.
    &tpdo_mapping!(0x1A02, "TPDO3", "tpdo3", 0x606C_0020),
    &tpdo_mapping!(0x1A03, "TPDO4", "tpdo4", 0x6064_0020),
]);

/// What firmware 1.66 has otherwise: 1006h, TPDOs with an event timer, of which the first runs as delivered, and mappings that can
/// be written. Of 1006h and 180xh:04 it says no more than that they are there: types are those of CiA 301, and nothing acts
/// on them. That a mapping is stored is a guess: a PDO's other parameters are.
pub(super) const CHANGES_OF_1_66: [Entry; 38] = {
    let mappings: [Entry; 25] = join(&[&RPDO_MAPPINGS, &TPDO_MAPPINGS]);
    join(&[
        &[rws(0x1006, 0, U32, "communication_cycle_period", "Communication cycle period").unit("us")],
        &writable(mappings),
        &event_timer!(0x1800, "tpdo1", 100),
        &event_timer!(0x1801, "tpdo2", 0),
        &event_timer!(0x1802, "tpdo3", 0),
        &event_timer!(0x1803, "tpdo4", 0),
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
    ($index:literal, $name:literal, $default:literal) => {
        [
            ro($index, 0, U8, concat!($name, "_parameter"), "Number of sub-indexes").default(5),
            rws($index, 4, U8, concat!($name, "_compatibility_entry"), "Reserved"),
            rws($index, 5, U16, concat!($name, "_event_timer"), "Event timer").default($default).unit("ms"),
        ]
    };
}
use event_timer;

/// The four rows of one PDO's parameter. The identifier follows the node-ID.
macro_rules! pdo_parameters {
    ($index:literal, $title:literal, $name:literal, $cob_id:literal, $types:ident, $transmission_type:literal) => {
        [
            ro($index, 0, U8, concat!($name, "_parameter"), "Number of sub-indexes").default(3),
            rws($index, 1, U32, concat!($name, "_cob_id"), concat!("COB-ID of ", $title)).node_id_plus($cob_id),
            rws($index, 2, U8, concat!($name, "_transmission_type"), "Transport type")
                .values($types)
                .default($transmission_type),
            rws($index, 3, U16, concat!($name, "_inhibit_time"), "Inhibit time").default(1).unit("0.1 ms"),
        ]
    };
}
use pdo_parameters;

/// The three rows of one TPDO's mapping: what it is named after, then the statusword.
macro_rules! tpdo_mapping {
    ($index:literal, $title:literal, $name:literal, $first:literal) => {
        [
            ro($index, 0, U8, concat!($name, "_mapping"), concat!($title, " Number of mapping groups")).default(2),
            ro($index, 1, U32, concat!($name, "_mapping_1"), concat!($title, " Map 1")).default($first),
            ro($index, 2, U32, concat!($name, "_mapping_2"), concat!($title, " Map 2")).default(0x6041_0010),
        ]
    };
}
use tpdo_mapping;
