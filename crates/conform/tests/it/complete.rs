//! A device that has as much of CiA 301 as a described node of ours has, as its sheet says it.

use std::fmt::Write;

use devices::Description;
use eds::{Eds, keep};

/// Index, sub-index, data type, access, default, whether it can be mapped, limits.
type Row = (u16, u8, u8, &'static str, &'static str, bool, &'static [&'static str]);

const U8: u8 = 5;
const U16: u8 = 6;
const U32: u8 = 7;
const TEXT: u8 = 9;
const NO: bool = false;
const MAP: bool = true;

#[rustfmt::skip]
const ROWS: &[Row] = &[
    (0x1000, 0, U32, "ro", "0x000F0191", NO, &[]), (0x1001, 0, U8, "ro", "0", MAP, &[]),
    (0x1003, 0, U8, "rw", "0", NO, &[]), (0x1003, 1, U32, "ro", "0", NO, &[]), (0x1003, 2, U32, "ro", "0", NO, &[]),
    (0x1005, 0, U32, "rw", "0x80", NO, &[]), (0x1006, 0, U32, "rw", "0", NO, &[]),
    (0x1008, 0, TEXT, "const", "A device with a long name", NO, &[]), (0x100A, 0, TEXT, "const", "version 1", NO, &[]),
    (0x100C, 0, U16, "rw", "0", NO, &[]), (0x100D, 0, U8, "rw", "0", NO, &[]),
    (0x1010, 0, U8, "const", "2", NO, &[]), (0x1010, 1, U32, "rw", "1", NO, &[]), (0x1010, 2, U32, "rw", "1", NO, &[]),
    (0x1011, 0, U8, "const", "2", NO, &[]), (0x1011, 1, U32, "rw", "1", NO, &[]), (0x1011, 2, U32, "rw", "1", NO, &[]),
    (0x1014, 0, U32, "rw", "$NODEID+0x80", NO, &[]), (0x1015, 0, U16, "rw", "0", NO, &[]),
    (0x1016, 0, U8, "const", "2", NO, &[]), (0x1016, 1, U32, "rw", "0", NO, &[]), (0x1016, 2, U32, "rw", "0", NO, &[]),
    (0x1017, 0, U16, "rw", "0", NO, &[]),
    (0x1018, 0, U8, "const", "4", NO, &[]), (0x1018, 1, U32, "ro", "0x11", NO, &[]), (0x1018, 2, U32, "ro", "0x22", NO, &[]),
    (0x1018, 3, U32, "ro", "0x33", NO, &[]), (0x1018, 4, U32, "ro", "0x44", NO, &[]),
    (0x1019, 0, U8, "rw", "0", NO, &[]),
    (0x1029, 0, U8, "const", "1", NO, &[]), (0x1029, 1, U8, "rw", "0", NO, &[]),
    (0x1200, 0, U8, "const", "2", NO, &[]), (0x1200, 1, U32, "ro", "$NODEID+0x600", NO, &[]), (0x1200, 2, U32, "ro", "$NODEID+0x580", NO, &[]),
    (0x1400, 0, U8, "const", "2", NO, &[]), (0x1400, 1, U32, "rw", "$NODEID+0x200", NO, &[]), (0x1400, 2, U8, "rw", "255", NO, &[]),
    (0x1600, 0, U8, "rw", "1", NO, &[]), (0x1600, 1, U32, "rw", "0x20030008", NO, &[]), (0x1600, 2, U32, "rw", "0", NO, &[]),
    (0x1600, 3, U32, "rw", "0", NO, &[]),
    (0x1800, 0, U8, "const", "5", NO, &[]), (0x1800, 1, U32, "rw", "$NODEID+0x180", NO, &[]), (0x1800, 2, U8, "rw", "255", NO, &[]),
    (0x1800, 3, U16, "rw", "0", NO, &[]), (0x1800, 5, U16, "rw", "0", NO, &[]),
    (0x1A00, 0, U8, "rw", "1", NO, &[]), (0x1A00, 1, U32, "rw", "0x20020010", NO, &[]), (0x1A00, 2, U32, "rw", "0", NO, &[]),
    (0x1A00, 3, U32, "rw", "0", NO, &[]),
    (0x2000, 0, U8, "rw", "15", MAP, &["10", "20"]), (0x2001, 0, U8, "wo", "0", NO, &[]),
    (0x2002, 0, U16, "rwr", "0", MAP, &[]), (0x2003, 0, U8, "rww", "0", MAP, &[]),
    (0x2004, 0, U32, "rw", "1000", MAP, &["100", "2000"]), (0x2005, 0, U16, "ro", "7", MAP, &[]),
    (0x2006, 0, U8, "const", "2", NO, &[]), (0x2006, 1, U32, "rw", "5", NO, &[]), (0x2006, 2, U16, "rw", "6", NO, &[]),
];

/// The description of that sheet.
pub(crate) fn complete() -> &'static Description {
    described(ROWS.to_vec())
}

/// The same with mappings that cannot be changed.
pub(crate) fn with_fixed_mappings() -> &'static Description {
    let mut rows = ROWS.to_vec();
    rows.iter_mut().filter(|row| matches!(row.0, 0x1600 | 0x1A00)).for_each(|row| row.3 = "ro");
    described(rows)
}

/// The same, producing SYNC as delivered, each 10 ms.
pub(crate) fn producing_sync() -> &'static Description {
    let mut rows = ROWS.to_vec();
    for row in &mut rows {
        row.4 = match row.0 {
            0x1005 => "0x40000080",
            0x1006 => "10000",
            _ => row.4,
        };
    }
    described(rows)
}

/// The same without remote frames, which bit 30 of its transmit PDO says.
pub(crate) fn without_remote_frames() -> &'static Description {
    let mut rows = ROWS.to_vec();
    rows.iter_mut().filter(|row| (row.0, row.1) == (0x1800, 1)).for_each(|row| row.4 = "$NODEID+0x40000180");
    described(rows)
}

/// The same without SYNC.
pub(crate) fn without_sync() -> &'static Description {
    described(ROWS.iter().filter(|row| !matches!(row.0, 0x1005 | 0x1006 | 0x1019)).copied().collect())
}

/// The same without a heartbeat consumer.
pub(crate) fn without_consumer() -> &'static Description {
    described(ROWS.iter().filter(|row| row.0 != 0x1016).copied().collect())
}

/// The same with a SYNC start value, the date of the configuration, and a second SDO server, off as delivered.
pub(crate) fn extended() -> &'static Description {
    const FURTHER: &[Row] = &[
        (0x1020, 0, U8, "const", "2", NO, &[]),
        (0x1020, 1, U32, "rw", "0", NO, &[]),
        (0x1020, 2, U32, "rw", "0", NO, &[]),
        (0x1201, 0, U8, "const", "2", NO, &[]),
        (0x1201, 1, U32, "rw", "0x80000000", NO, &[]),
        (0x1201, 2, U32, "rw", "0x80000000", NO, &[]),
        (0x1800, 6, U8, "rw", "0", NO, &[]),
    ];
    described(ROWS.iter().chain(FURTHER).copied().collect())
}

fn described(rows: Vec<Row>) -> &'static Description {
    keep(&Eds::load(sheet(rows).as_bytes()).unwrap().eds).unwrap()
}

fn sheet(mut all: Vec<Row>) -> String {
    all.sort_by_key(|row| (row.0, row.1));
    let mut out = String::from(
        "[FileInfo]\nFileName=complete.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\nDescription=\nCreatedBy=\n\
         [DeviceInfo]\nVendorName=Example\nVendorNumber=0x11\nProductName=Complete\nProductNumber=0x22\nRevisionNumber=0x33\n\
         BaudRate_500=1\nSimpleBootUpSlave=1\nGranularity=8\nNrOfRXPDO=1\nNrOfTXPDO=1\nLSS_Supported=1\n\
         [DummyUsage]\nDummy0005=1\n",
    );
    let mut indexes: Vec<u16> = all.iter().map(|row| row.0).collect();
    indexes.dedup();
    let mandatory = |index: &u16| [0x1000, 0x1001, 0x1018].contains(index);
    let maker = |index: &u16| (0x2000..0x6000).contains(index);
    list(&mut out, "MandatoryObjects", indexes.iter().filter(|index| mandatory(index)));
    list(&mut out, "OptionalObjects", indexes.iter().filter(|index| !mandatory(index) && !maker(index)));
    list(&mut out, "ManufacturerObjects", indexes.iter().filter(|index| maker(index)));
    for index in &indexes {
        let rows: Vec<&Row> = all.iter().filter(|row| row.0 == *index).collect();
        if let [row] = rows[..] {
            variable(&mut out, &format!("{index:X}"), row);
            continue;
        }
        let _ = write!(out, "[{index:X}]\nParameterName=Object {index:X}\nObjectType=0x9\nSubNumber={}\n", rows.len());
        for row in rows {
            variable(&mut out, &format!("{index:X}sub{:X}", row.1), row);
        }
    }
    out
}

fn list<'a>(out: &mut String, name: &str, indexes: impl Iterator<Item = &'a u16> + Clone) {
    let _ = write!(out, "[{name}]\nSupportedObjects={}\n", indexes.clone().count());
    for (place, index) in (1..).zip(indexes) {
        let _ = writeln!(out, "{place}=0x{index:04X}");
    }
}

fn variable(out: &mut String, section: &str, (index, sub_index, data_type, access, default, mapping, limits): &Row) {
    let _ = write!(
        out,
        "[{section}]\nParameterName=Object {index:X} {sub_index:X}\nObjectType=0x7\nDataType={data_type:#06x}\nAccessType={access}\n\
         DefaultValue={default}\nPDOMapping={}\n",
        u8::from(*mapping)
    );
    if let [low, high] = limits {
        let _ = write!(out, "LowLimit={low}\nHighLimit={high}\n");
    }
}
