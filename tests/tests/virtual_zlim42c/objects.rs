//! Every row of the manual's object table on the running drive: width, default, access, range and store.

use ferrodrive_tests::manual::ObjectRow;
use ferrodrive_tests::zlim42c::objects;

use crate::bench::{Abort, Bench};

const READ_ONLY: Abort = 0x0601_0002;
const INVALID_VALUE: Abort = 0x0609_0030;
const TOO_HIGH: Abort = 0x0609_0031;
const TOO_LOW: Abort = 0x0609_0032;
const NO_SUCH_OBJECT: Abort = 0x0602_0000;
const NO_SUCH_SUB_INDEX: Abort = 0x0609_0011;

/// Collects what `check` finds wrong with each row that `of` picks.
fn wrong_rows(of: impl Fn(&ObjectRow) -> bool, check: impl Fn(&ObjectRow) -> Result<(), String>) -> Vec<String> {
    let rows: Vec<_> = objects().into_iter().filter(of).collect();
    assert!(!rows.is_empty());
    let at = |row: &ObjectRow, text| format!("{:04X}h:{:02X} {}: {text}", row.index, row.sub, row.name);
    rows.iter().filter_map(|row| check(row).err().map(|text| at(row, text))).collect()
}

fn assert_none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} rows:\n{}", wrong.len(), wrong.join("\n"));
}

fn expect<T: PartialEq + std::fmt::Debug>(what: &str, actual: T, expected: T) -> Result<(), String> {
    if actual == expected { Ok(()) } else { Err(format!("{what}: {actual:X?}, expected {expected:X?}")) }
}

#[test]
fn each_object_is_read_with_its_width_and_its_default() {
    let wrong = wrong_rows(
        |_| true,
        |row| {
            let mut bench = Bench::new();
            let width = bench.read(row.index, row.sub).map(|bytes| bytes.len());
            expect("bytes on the wire", width, Ok(row.size))?;
            match row.default {
                Some(default) if !row.live => expect("default", bench.get(row.index, row.sub), default),
                _ => Ok(()),
            }
        },
    );
    assert_none(&wrong);
}

#[test]
fn a_read_only_object_refuses_every_write() {
    let wrong = wrong_rows(
        |row| !row.writable,
        |row| {
            let mut bench = Bench::new();
            expect("a write", bench.write(row.index, row.sub, 1), Err(READ_ONLY))
        },
    );
    assert_none(&wrong);
}

#[test]
fn what_a_range_holds_is_taken_and_what_lies_beyond_is_refused_with_the_right_code() {
    let wrong = wrong_rows(
        |row| row.writable && row.limits.is_some(),
        |row| {
            let (low, high) = row.limits.unwrap_or_default();
            for value in [low, high] {
                expect(&format!("write {value}"), Bench::new().write(row.index, row.sub, value), Ok(()))?;
            }
            refused(row, low - 1, TOO_LOW)?;
            refused(row, high + 1, TOO_HIGH)
        },
    );
    assert_none(&wrong);
}

/// Refused with `code`, or as a value that is not in a list, and not stored.
fn refused(row: &ObjectRow, value: i64, code: Abort) -> Result<(), String> {
    let bits = row.size * 8;
    let (least, most) = if row.signed { (-(1_i64 << (bits - 1)), (1 << (bits - 1)) - 1) } else { (0, (1 << bits) - 1) };
    if !(least..=most).contains(&value) {
        return Ok(());
    }
    let mut bench = Bench::new();
    let before = bench.get(row.index, row.sub);
    let answer = bench.write(row.index, row.sub, value);
    if answer != Err(code) && answer != Err(INVALID_VALUE) {
        return Err(format!("write {value}: {answer:X?}, expected {code:08X}h"));
    }
    expect("value after it", bench.get(row.index, row.sub), before)
}

#[test]
fn a_value_between_the_listed_ones_is_refused() {
    // 6060h: no mode 2 (velocity mode), whatever 5.3.3 prints (docs/drives/zlim42c.md, Z036), and no torque.
    for mode in [2, 4, 5, 7, 8, 9, 10, -1] {
        assert_eq!(Bench::new().write(0x6060, 0, mode), Err(INVALID_VALUE), "mode {mode}");
    }
    for (index, value) in [(0x605A, 4), (0x605A, 8), (0x605D, 0), (0x605D, 4), (0x605B, 2), (0x605C, -1)] {
        assert_eq!(Bench::new().write(index, 0, value), Err(INVALID_VALUE), "{index:04X}h = {value}");
    }
}

#[test]
fn a_write_of_another_width_is_refused_and_changes_nothing() {
    let wrong = wrong_rows(
        |row| row.writable,
        |row| {
            let mut bench = Bench::new();
            let before = bench.get(row.index, row.sub);
            let [low, high] = row.index.to_le_bytes();
            for (size, command) in [(1, 0x2F), (2, 0x2B), (4, 0x23)] {
                if size == row.size {
                    continue;
                }
                let answer = bench.sdo(&[command, low, high, row.sub, 1, 0, 0, 0]).ok_or("no answer")?;
                let code = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
                let expected = if size > row.size { 0x0607_0012 } else { 0x0607_0013 };
                if answer[0] != 0x80 || (code != expected && code != 0x0607_0010) {
                    return Err(format!("{size} bytes: answered {answer:02X?}, expected abort {expected:08X}h"));
                }
            }
            expect("value after it", bench.get(row.index, row.sub), before)
        },
    );
    assert_none(&wrong);
}

#[test]
fn a_missing_object_and_a_missing_sub_index_are_told_apart() {
    let mut bench = Bench::new();
    let missing =
        [0x1003, 0x1006, 0x1007, 0x1015, 0x1016, 0x1010, 0x1011, 0x200D, 0x200F, 0x6071, 0x6077, 0x6087, 0x6502];
    for index in missing {
        assert_eq!(bench.read(index, 0), Err(NO_SUCH_OBJECT), "{index:04X}h");
    }
    let missing = [(0x1000, 1), (0x1018, 4), (0x1400, 6), (0x1A00, 5), (0x6099, 3)];
    let unused = (0x06..=0x0B).chain([0x0F, 0x10]).map(|sub| (0x2030, sub));
    for (index, sub) in missing.into_iter().chain(unused) {
        assert_eq!(bench.read(index, sub), Err(NO_SUCH_SUB_INDEX), "{index:04X}h:{sub:02X}");
    }
}

#[test]
fn what_is_live_reads_what_a_resting_drive_has() {
    let mut bench = Bench::new();
    let expected = [
        (0x1001, 0, 0..=0),
        (0x2000, 0, 1..=1),
        (0x2001, 0, 0..=0),
        (0x2002, 0, 0..=0),
        (0x2003, 0, 0..=0),
        (0x2004, 0, 0..=0),
        (0x2069, 0, 24..=24),
        (0x603F, 0, 0..=0),
        (0x6041, 0, 0x0270..=0x0270),
        (0x6061, 0, 0..=0),
        (0x6064, 0, 0..=0),
        (0x606C, 0, 0..=0),
    ];
    for (index, sub, range) in &expected {
        let value = bench.get(*index, *sub);
        assert!(range.contains(&value), "{index:04X}h:{sub:02X} reads {value}, expected {range:?}");
    }
    assert_eq!(bench.get(0x2088, 0), bench.get(0x100A, 0), "the software version in both places");
    let checked = |row: &ObjectRow| expected.iter().any(|(index, sub, _)| (*index, *sub) == (row.index, row.sub));
    let versions = [0x1009, 0x100A, 0x2088];
    let unchecked: Vec<_> =
        objects().into_iter().filter(|row| row.live && !checked(row) && !versions.contains(&row.index)).collect();
    assert!(unchecked.is_empty(), "{unchecked:?}");
}

// ---- store ----

/// Another legal value than the default; `None` where the drive then could not be asked any more.
fn other_value(row: &ObjectRow) -> Option<i64> {
    let default = row.default?;
    let mapped_velocity = if row.index < 0x1A00 { 0x60FF_0020 } else { 0x606C_0020 };
    match (row.index, row.sub) {
        // Another bit rate: see `network`.
        (0x2009, _) => None,
        // It does something and reads 0 again.
        (0x2010..=0x2012, _) => None,
        (0x1005, _) => Some(0x90),
        (0x1014, _) => Some(0x8000_0081),
        (0x1400..=0x1403 | 0x1800..=0x1803, 1) => Some(0x8000_0000 | default),
        (0x1400..=0x1403 | 0x1800..=0x1803, 2) => Some(0xFE),
        (0x1600..=0x1603 | 0x1A00..=0x1A03, 0) => Some(1 - default),
        (0x1600..=0x1603 | 0x1A00..=0x1A03, _) => Some(mapped_velocity),
        _ => match row.limits {
            Some((low, high)) => Some(if default == high { low } else { high }),
            None => Some(default + 1),
        },
    }
}

/// Writes the value the way the object wants it: mapping entries while sub-index 00 is 0.
fn write_other(bench: &mut Bench, row: &ObjectRow, value: i64) -> Result<(), String> {
    if matches!(row.index, 0x1600..=0x1603 | 0x1A00..=0x1A03) {
        expect("clear the mapping", bench.write(row.index, 0, 0), Ok(()))?;
        if row.sub == 0 && value == 1 {
            let object = if row.index < 0x1A00 { 0x60FF_0020 } else { 0x606C_0020 };
            expect("map", bench.write(row.index, 1, object), Ok(()))?;
        }
    }
    expect(&format!("write {value}"), bench.write(row.index, row.sub, value), Ok(()))?;
    expect("value read back", bench.get(row.index, row.sub), value)?;
    bench.let_store();
    Ok(())
}

fn storable(row: &ObjectRow) -> bool {
    row.writable && other_value(row).is_some()
}

#[test]
fn with_200ch_0_a_write_outlives_a_power_cycle_if_and_only_if_the_object_is_stored() {
    let wrong = wrong_rows(storable, |row| {
        let (other, default) = (other_value(row).unwrap_or_default(), row.default.unwrap_or_default());
        let kept = if row.stored { other } else { default };
        let mut bench = Bench::new();
        write_other(&mut bench, row, other)?;
        bench.power_cycle();
        expect("after a power cycle", bench.get(row.index, row.sub), kept)
    });
    assert_none(&wrong);
}

#[test]
fn with_200ch_1_nothing_is_kept_until_2010h_is_2_and_2010h_1_restores_it() {
    let wrong = wrong_rows(
        |row| storable(row) && row.stored,
        |row| {
            let (other, default) = (other_value(row).unwrap_or_default(), row.default.unwrap_or_default());
            let mut bench = Bench::new();
            bench.set(0x200C, 0, 1);
            write_other(&mut bench, row, other)?;
            bench.power_cycle();
            expect("200Ch = 1, after a power cycle", bench.get(row.index, row.sub), default)?;

            bench.set(0x200C, 0, 1);
            write_other(&mut bench, row, other)?;
            bench.set(0x2010, 0, 2);
            expect("2010h", bench.get(0x2010, 0), 0)?;
            bench.let_store();
            bench.power_cycle();
            expect("2010h = 2, after a power cycle", bench.get(row.index, row.sub), other)?;

            bench.set(0x2010, 0, 1);
            bench.let_store();
            bench.power_cycle();
            expect("2010h = 1, after a power cycle", bench.get(row.index, row.sub), default)
        },
    );
    assert_none(&wrong);
}

#[test]
fn clearing_the_position_reads_zero_again_and_zeroes_the_position() {
    let mut bench = Bench::new();
    bench.enable_in(1);
    bench.move_by(1000);
    bench.run_ms(1000);
    assert_eq!(bench.get(0x6064, 0), 1000);
    bench.set(0x2012, 0, 0);
    assert_eq!(bench.get(0x6064, 0), 1000, "0 is invalid");
    bench.set(0x2012, 0, 1);
    assert_eq!((bench.get(0x6064, 0), bench.get(0x2012, 0)), (0, 0));
    bench.run_ms(100);
    let report = bench.report();
    assert_eq!((report.position, report.rotor_position), (0, Some(0)), "the numbers move, not the shaft");
}
