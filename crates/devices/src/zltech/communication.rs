//! Communication parameters, 1000h to 1A03h ("ZLAC8030L quick start guide V1.00", chapter 9; "ZLIM42-C user manual
//! V1.03", 5.4), in the words of CiA 301.
//!
//! Both manuals count PDOs from 0. Both print COB-IDs and sub-index 00 of the mappings as RO, which would make mapping
//! impossible; the first one's examples write them and the maker's EDS have both as rw: both are rw here. The second lost
//! some rows at its page breaks; all four PDOs are alike.

use canopen::od::Entry;

use crate::row::cia::{ro, rw, rws};
use crate::row::{U8, U16, U32, join};

/// The rows of a drive with these versions (1009h, 100Ah).
pub(super) const fn rows(hardware_version: i64, software_version: i64) -> [Entry; 102] {
    let general = general(hardware_version, software_version);
    join(&[&general, &RPDO_PARAMETERS, &RPDO_MAPPINGS, &TPDO_PARAMETERS, &TPDO_MAPPINGS])
}

const fn general(hardware_version: i64, software_version: i64) -> [Entry; 14] {
    [
        // The CiA 402 type code of a stepper, in the servo drive too: the manual and the maker's EDS agree on it.
        ro(0x1000, 0, U32).default(0x0004_0192),
        ro(0x1001, 0, U8),
        rw(0x1005, 0, U32).default(0x80),
        ro(0x1009, 0, U16).described("Hardware version").default(hardware_version),
        // The ZLAC8030L's manual prints "Hardware version" a second time.
        ro(0x100A, 0, U16).described("Software version").default(software_version),
        // Printed 0x80, which is SYNC; CiA 301 and the maker's EDS add the node-ID.
        rw(0x1014, 0, U32).node_id_plus(0x80),
        rws(0x1017, 0, U16).unit("ms"),
        // Printed 5 with two sub-indexes; CiA 301 allows at most 4 and the maker's EDS has 3.
        ro(0x1018, 0, U8).default(3),
        ro(0x1018, 1, U32).default(0x0100),
        ro(0x1018, 2, U32).default(0x0001),
        ro(0x1018, 3, U32),
        ro(0x1200, 0, U8).default(2),
        ro(0x1200, 1, U32).node_id_plus(0x600),
        ro(0x1200, 2, U32).node_id_plus(0x580),
    ]
}

const RPDO_PARAMETERS: [Entry; 24] = join(&[
    &pdo_parameters!(0x1400, "RPDO0", 0x200),
    &pdo_parameters!(0x1401, "RPDO1", 0x300),
    &pdo_parameters!(0x1402, "RPDO2", 0x400),
    &pdo_parameters!(0x1403, "RPDO3", 0x500),
]);

// Factory mapping: RPDO0 carries the controlword, nothing else is mapped. (The maker's EDS have more.)
const RPDO_MAPPINGS: [Entry; 20] = join(&[
    &pdo_mapping!(0x1600, "RPDO0", 1, 0x6040_0010),
    &pdo_mapping!(0x1601, "RPDO1", 0, 0),
    &pdo_mapping!(0x1602, "RPDO2", 0, 0),
    &pdo_mapping!(0x1603, "RPDO3", 0, 0),
]);

const TPDO_PARAMETERS: [Entry; 24] = join(&[
    &pdo_parameters!(0x1800, "TPDO0", 0x180),
    &pdo_parameters!(0x1801, "TPDO1", 0x280),
    &pdo_parameters!(0x1802, "TPDO2", 0x380),
    &pdo_parameters!(0x1803, "TPDO3", 0x480),
]);

// The ZLAC8030L's manual names these rows RPDO1, RPDO1, RPDO2, RPDO3; by index they are the TPDOs.
const TPDO_MAPPINGS: [Entry; 20] = join(&[
    &pdo_mapping!(0x1A00, "TPDO0", 0, 0),
    &pdo_mapping!(0x1A01, "TPDO1", 0, 0),
    &pdo_mapping!(0x1A02, "TPDO2", 0, 0),
    &pdo_mapping!(0x1A03, "TPDO3", 0, 0),
]);

/// The six rows of one PDO's communication parameter. Both times are in 0.5 ms (ZLAC8030L, 6.1: `03E8h` is 500 ms); the
/// ZLIM42-C's manual gives no unit.
macro_rules! pdo_parameters {
    ($index:literal, $title:literal, $cob_id:literal) => {
        [
            ro($index, 0, U8).default(5),
            rw($index, 1, U32).described(concat!($title, " COB-ID")).node_id_plus($cob_id),
            rws($index, 2, U8).default(0xFF),
            rws($index, 3, U16).unit("0.5 ms"),
            rw($index, 4, U8),
            rws($index, 5, U16).unit("0.5 ms"),
        ]
    };
}
use pdo_parameters;

/// The five rows of one PDO's mapping: how many objects, then up to four mapping records.
macro_rules! pdo_mapping {
    ($index:literal, $title:literal, $count:literal, $first:literal) => {
        [
            rws($index, 0, U8).default($count),
            rws($index, 1, U32).described(concat!($title, " mapping 1")).default($first),
            rws($index, 2, U32).described(concat!($title, " mapping 2")),
            rws($index, 3, U32).described(concat!($title, " mapping 3")),
            rws($index, 4, U32).described(concat!($title, " mapping 4")),
        ]
    };
}
use pdo_mapping;
