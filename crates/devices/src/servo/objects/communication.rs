//! Communication objects, 1000h to 1029h, and four PDOs a way with the standard's mappings (CiA 301; CiA 402-3 for the
//! mappings of PDO 1 to 4).

use canopen::od::{DataType, Entry};

use crate::row::cia::{ro, rw};
use crate::row::{U8, U16, U32, join};

/// All of them.
pub(super) static ROWS: [Entry; ROW_COUNT] = join(&[
    &GENERAL,
    &rpdo!(0x1400, 0x200),
    &rpdo!(0x1401, 0x300),
    &rpdo!(0x1402, 0x400),
    &rpdo!(0x1403, 0x500),
    &mapping!(0x1600, CONTROLWORD),
    &mapping!(0x1601, CONTROLWORD, 0x6060_0008),
    &mapping!(0x1602, CONTROLWORD, 0x607A_0020),
    &mapping!(0x1603, CONTROLWORD, 0x60FF_0020),
    // The first two are sent when they change. The others hold measurements, which change always: they go with SYNC.
    &tpdo!(0x1800, 0x180, 255),
    &tpdo!(0x1801, 0x280, 255),
    &tpdo!(0x1802, 0x380, 1),
    &tpdo!(0x1803, 0x480, 1),
    &mapping!(0x1A00, STATUSWORD),
    &mapping!(0x1A01, STATUSWORD, 0x6061_0008),
    &mapping!(0x1A02, STATUSWORD, 0x6064_0020),
    &mapping!(0x1A03, STATUSWORD, 0x606C_0020),
]);

/// Number of rows.
pub(super) const ROW_COUNT: usize = GENERAL.len() + 4 * (4 + 5 + 2 * 9);

const CONTROLWORD: i64 = 0x6040_0010;
const STATUSWORD: i64 = 0x6041_0010;

#[rustfmt::skip]
const GENERAL: [Entry; 49] = [
    // Bits 0 to 15: profile 402; bits 16 to 23: servo drive.
    ro(0x1000, 0, U32).default(0x0002_0192),
    ro(0x1001, 0, U8).mappable(),
    rw(0x1003, 0, U8).described("Number of errors kept").values(&[(0, "forgets them")]),
    ro(0x1003, 1, U32).described("Latest error"),
    ro(0x1003, 2, U32).described("Second latest error"),
    ro(0x1003, 3, U32).described("Third latest error"),
    ro(0x1003, 4, U32).described("Fourth latest error"),
    ro(0x1003, 5, U32).described("Fifth latest error"),
    ro(0x1003, 6, U32).described("Sixth latest error"),
    ro(0x1003, 7, U32).described("Seventh latest error"),
    ro(0x1003, 8, U32).described("Eighth latest error"),
    rw(0x1005, 0, U32).default(0x80).saved(),
    rw(0x1006, 0, U32).described("Time between two SYNCs that is awaited; 0 for none").unit("us").saved(),
    text(0x1008, "Ferrodrive CiA 402 servo"),
    text(0x1009, "1"),
    text(0x100A, env!("CARGO_PKG_VERSION")),
    rw(0x100C, 0, U16).described("Guard time; 0 is off").unit("ms").saved(),
    rw(0x100D, 0, U8).described("Life time factor; 0 is off").saved(),
    ro(0x1010, 0, U8).described("Number of groups that can be stored").default(3),
    rw(0x1010, 1, U32).described("Store all: write 'save'").default(1),
    rw(0x1010, 2, U32).described("Store 1000h to 1FFFh: write 'save'").default(1),
    rw(0x1010, 3, U32).described("Store 6000h to 9FFFh: write 'save'").default(1),
    ro(0x1011, 0, U8).described("Number of groups that can be restored").default(3),
    rw(0x1011, 1, U32).described("Restore all with the next reset: write 'load'").default(1),
    rw(0x1011, 2, U32).described("Restore 1000h to 1FFFh: write 'load'").default(1),
    rw(0x1011, 3, U32).described("Restore 6000h to 9FFFh: write 'load'").default(1),
    rw(0x1014, 0, U32).node_id_plus(0x80).saved(),
    rw(0x1015, 0, U16).described("Least time between two EMCY messages").unit("100 us").saved(),
    ro(0x1016, 0, U8).described("Number of nodes that can be watched").default(8),
    rw(0x1016, 1, U32).described("First node watched, and how long it may be silent").saved(),
    rw(0x1016, 2, U32).described("Second node watched, and how long it may be silent").saved(),
    rw(0x1016, 3, U32).described("Third node watched, and how long it may be silent").saved(),
    rw(0x1016, 4, U32).described("Fourth node watched, and how long it may be silent").saved(),
    rw(0x1016, 5, U32).described("Fifth node watched, and how long it may be silent").saved(),
    rw(0x1016, 6, U32).described("Sixth node watched, and how long it may be silent").saved(),
    rw(0x1016, 7, U32).described("Seventh node watched, and how long it may be silent").saved(),
    rw(0x1016, 8, U32).described("Eighth node watched, and how long it may be silent").saved(),
    rw(0x1017, 0, U16).described("Time between two heartbeats; 0 is off").unit("ms").saved(),
    ro(0x1018, 0, U8).default(4),
    // No vendor of CiA: 0 is not assigned.
    ro(0x1018, 1, U32),
    ro(0x1018, 2, U32).default(402),
    ro(0x1018, 3, U32).default(0x0001_0000),
    ro(0x1018, 4, U32).default(1),
    rw(0x1019, 0, U8).described("Counter of SYNC: from 1 to this, 2 to 240; 0 is off").range(0, 240).saved(),
    ro(0x1029, 0, U8).default(1),
    rw(0x1029, 1, U8).described("What a loss of communication does to the NMT state")
        .values(&[(0, "pre-operational"), (1, "nothing"), (2, "stopped")]).default(1).saved(),
    ro(0x1200, 0, U8).default(2),
    ro(0x1200, 1, U32).node_id_plus(0x600),
    ro(0x1200, 2, U32).node_id_plus(0x580),
];

const fn text(index: u16, value: &'static str) -> Entry {
    ro(index, 0, DataType::VisibleString).text(value)
}

/// Communication parameter of an RPDO.
macro_rules! rpdo {
    ($index:literal, $cob_id:literal) => {
        [
            ro($index, 0, U8).default(5),
            rw($index, 1, U32).node_id_plus($cob_id).saved(),
            rw($index, 2, U8).default(255).saved(),
            rw($index, 5, U16).described("Longest time without one, from the first on; 0 is off").unit("ms").saved(),
        ]
    };
}
use rpdo;

/// Communication parameter of a TPDO.
macro_rules! tpdo {
    ($index:literal, $cob_id:literal, $transmission_type:literal) => {
        [
            ro($index, 0, U8).default(5),
            rw($index, 1, U32).node_id_plus($cob_id).saved(),
            rw($index, 2, U8).default($transmission_type).saved(),
            rw($index, 3, U16).described("Least time between two").unit("100 us").saved(),
            rw($index, 5, U16).described("Longest time between two; 0 is off").unit("ms").saved(),
        ]
    };
}
use tpdo;

/// A mapping of up to eight objects, with those that are mapped as delivered.
macro_rules! mapping {
    ($index:literal, $($mapped:expr),*) => {{
        const MAPPED: &[i64] = &[$($mapped),*];
        [
            rw($index, 0, U8)
                .default(MAPPED.len() as i64).range(0, 8).saved(),
            mapping!(@ $index, 1, MAPPED),
            mapping!(@ $index, 2, MAPPED),
            mapping!(@ $index, 3, MAPPED),
            mapping!(@ $index, 4, MAPPED),
            mapping!(@ $index, 5, MAPPED),
            mapping!(@ $index, 6, MAPPED),
            mapping!(@ $index, 7, MAPPED),
            mapping!(@ $index, 8, MAPPED),
        ]
    }};
    (@ $index:literal, $sub:literal, $mapped:ident) => {
        rw($index, $sub, U32).default(nth($mapped, $sub)).saved()
    };
}
use mapping;

/// The `n`th of `mapped`, counted from 1, or 0.
const fn nth(mapped: &[i64], n: usize) -> i64 {
    if n <= mapped.len() { mapped[n - 1] } else { 0 }
}
