//! What is asked of every row of a manual's object table on a running drive: width, default, access, range and store.
//!
//! Each function is a scenario; it asks all rows that it is about, each at a fresh [`Bench`], and fails with the
//! list of those that answer otherwise. What a drive's manual says of single objects is in its `refused.csv` and `at_rest.csv`.

use std::time::Duration;

use can::{CanId, Frame};

use crate::bench::{Abort, Bench, BenchSubject};
use crate::manual::{ObjectRow, hex, integer, rows};

/// Abort codes of CiA 301, 7.2.4.3.17.
pub const READ_ONLY: Abort = 0x0601_0002;
/// The length does not match.
pub const WRONG_LENGTH: Abort = 0x0607_0010;
/// The length does not match: too long.
pub const TOO_LONG: Abort = 0x0607_0012;
/// The length does not match: too short.
pub const TOO_SHORT: Abort = 0x0607_0013;
/// Not among the values of the object.
pub const INVALID_VALUE: Abort = 0x0609_0030;
/// Above the range.
pub const TOO_HIGH: Abort = 0x0609_0031;
/// Below the range.
pub const TOO_LOW: Abort = 0x0609_0032;

/// How a drive keeps its objects over a power cycle.
#[derive(Debug)]
pub struct Memory {
    /// 0: a write is stored at once; 1: only on command.
    pub switch: u16,
    /// 2 stores all objects, 1 restores the defaults.
    pub command: u16,
    /// Writable objects that cannot be asked: commands that read 0 again, and those with which the bus loses the drive.
    pub without: &'static [u16],
    /// The object that gives the drive another node after its next start.
    pub node_id: Option<u16>,
    /// Two stored objects, each with its default and another value.
    pub two: [(u16, i64, i64); 2],
    /// `eds_defaults.csv`.
    pub eds: &'static str,
}

/// A drive that stores each write, or all on command.
pub trait KeepingSubject: BenchSubject {
    /// How.
    const MEMORY: Memory;
}

/// Every row is read with its width, and with its default unless it is a measurement.
pub fn are_read_with_their_width_and_default<S: BenchSubject>() {
    assert_rows::<S>(
        |_| true,
        |row| {
            let mut bench = Bench::<S>::new();
            let width = bench.read((row.index, row.sub)).map(|bytes| bytes.len());
            expect("bytes on the wire", width, Ok(row.size))?;
            match row.default {
                Some(default) if !row.live => expect("default", bench.get((row.index, row.sub)), default),
                _ => Ok(()),
            }
        },
    );
}

/// What is read-only refuses a write.
pub fn refuse_writes_where_they_are_read_only<S: BenchSubject>() {
    assert_rows::<S>(
        |row| !row.writable,
        |row| expect("a write", Bench::<S>::new().write((row.index, row.sub), 1), Err(READ_ONLY)),
    );
}

/// Both ends of a range are taken, and what lies beyond is refused with the code for it and not stored.
pub fn take_their_range_and_refuse_what_lies_beyond<S: BenchSubject>() {
    assert_rows::<S>(
        |row| row.writable && row.limits.is_some(),
        |row| {
            let (low, high) = row.limits.unwrap_or_default();
            for value in [low, high] {
                expect(&format!("write {value}"), Bench::<S>::new().write((row.index, row.sub), value), Ok(()))?;
            }
            refused::<S>(row, low - 1, TOO_LOW)?;
            refused::<S>(row, high + 1, TOO_HIGH)
        },
    );
}

/// Refused with `code`, or as a value that is not in a list, and not stored.
fn refused<S: BenchSubject>(row: &ObjectRow, value: i64, code: Abort) -> Result<(), String> {
    if !row.type_range().contains(&value) {
        return Ok(());
    }
    let mut bench = Bench::<S>::new();
    let before = bench.get((row.index, row.sub));
    let answer = bench.write((row.index, row.sub), value);
    if answer != Err(code) && answer != Err(INVALID_VALUE) {
        return Err(format!("write {value}: {answer:X?}, expected {code:08X}h"));
    }
    expect("value after it", bench.get((row.index, row.sub)), before)
}

/// `refused.csv`: objects and sub-indexes that the manual does not have are distinguished, and so are values that lie between
/// the listed ones. An empty value is a read.
pub fn refuse_what_the_manual_does_not_have<S: BenchSubject>() {
    for (index, sub, value, abort) in rows(S::REFUSED, |row| {
        let abort = u32::from_str_radix(row.get("abort"), 16).expect("an abort code");
        (hex(row.get("index")), hex(row.get("sub")) as u8, integer(row.get("value")), abort)
    }) {
        let mut bench = Bench::<S>::new();
        let answer = match value {
            Some(value) => bench.write((index, sub), value),
            None => bench.read((index, sub)).map(|_| ()),
        };
        assert_eq!(answer, Err(abort), "{index:04X}h:{sub:02X} {value:?}: {answer:08X?}, expected {abort:08X}h");
    }
}

/// A write of another width is refused with the code for it and changes nothing.
pub fn refuse_another_width<S: BenchSubject>() {
    assert_rows::<S>(
        |row| row.writable,
        |row| {
            let mut bench = Bench::<S>::new();
            let before = bench.get((row.index, row.sub));
            let [low, high] = row.index.to_le_bytes();
            for (size, command) in [(1, 0x2F), (2, 0x2B), (4, 0x23)] {
                if size == row.size {
                    continue;
                }
                let answer = bench.sdo(&[command, low, high, row.sub, 1, 0, 0, 0]).ok_or("no answer")?;
                let code = u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]);
                let expected = if size > row.size { TOO_LONG } else { TOO_SHORT };
                if answer[0] != 0x80 || (code != expected && code != WRONG_LENGTH) {
                    return Err(format!("{size} bytes: answered {answer:02X?}, expected abort {expected:08X}h"));
                }
            }
            expect("value after it", bench.get((row.index, row.sub)), before)
        },
    );
}

/// `at_rest.csv`: what every measurement and state reads at a drive that has just booted and rests.
pub fn read_at_rest_what_a_resting_drive_has<S: BenchSubject>() {
    let expected = rows(S::AT_REST, |row| {
        let bound = |name| integer(row.get(name)).expect("a number");
        ((hex(row.get("index")), hex(row.get("sub")) as u8), bound("low")..=bound("high"))
    });
    let mut bench = Bench::<S>::new();
    for ((index, sub), range) in &expected {
        let value = bench.get((*index, *sub));
        assert!(range.contains(&value), "{index:04X}h:{sub:02X} reads {value}, expected {range:?}");
    }
    let unexpected = |row: &&ObjectRow| row.live && !expected.iter().any(|(key, _)| *key == row.key());
    let untold: Vec<_> = S::rows().all().iter().filter(unexpected).collect();
    assert!(untold.is_empty(), "{untold:?}");
}

/// `eds_defaults.csv`: where the maker's EDS has another default than the manual, a drive that is delivered by the EDS has
/// it after power-on and after a restore. What is written to is stored or not as with the manual's values.
pub fn have_the_factory_values_of_the_eds_where_that_is_chosen<S: KeepingSubject>() {
    let different = rows(S::MEMORY.eds, |row| {
        let default = integer(row.get("default")).expect("a default");
        ((hex(row.get("index")), hex(row.get("sub")) as u8), default)
    });
    let mut bench = Bench::<S>::choosing("defaults", "eds");
    for (object, given) in &different {
        let printed = S::rows().find(object.0, object.1).and_then(|row| row.default);
        assert_ne!(printed, Some(*given), "{object:X?} of the manual");
        bench.reads(*object, *given);
    }
    bench.set((0x1800, 3), 7).set(0x60FF, 7).set(S::MEMORY.command, 2).let_store().power_cycle();
    bench.reads((0x1800, 3), 7).reads(0x60FF, 120).set(S::MEMORY.command, 1).let_store().power_cycle();
    for (object, given) in different {
        bench.reads(object, given);
    }
}

/// With the memory's switch at 0, a write outlives a power cycle if and only if the object is stored.
pub fn outlive_a_power_cycle_if_and_only_if_stored<S: KeepingSubject>() {
    let memory = &S::MEMORY;
    assert_rows::<S>(
        |row| memory.other_value::<S>(row).is_some(),
        |row| {
            let (other, default) = memory.values::<S>(row);
            let kept = if row.stored { other } else { default };
            let mut bench = Bench::<S>::new();
            write_other(&mut bench, row, other)?;
            memory.restart(&mut bench, row, kept);
            expect("after a power cycle", bench.get((row.index, row.sub)), kept)
        },
    );
}

/// With the memory's switch at 1, nothing is kept until the command stores it, and the command for it restores it.
pub fn are_kept_and_restored_only_on_command<S: KeepingSubject>() {
    let memory = &S::MEMORY;
    assert_rows::<S>(
        |row| row.stored && memory.other_value::<S>(row).is_some(),
        |row| {
            let (other, default) = memory.values::<S>(row);
            let mut bench = Bench::<S>::new();
            bench.set(memory.switch, 1);
            write_other(&mut bench, row, other)?;
            memory.restart(&mut bench, row, default);
            expect("not stored, after a power cycle", bench.get((row.index, row.sub)), default)?;

            bench.set(memory.switch, 1);
            write_other(&mut bench, row, other)?;
            bench.set(memory.command, 2);
            expect("the command", bench.get(memory.command), 0)?;
            bench.let_store();
            memory.restart(&mut bench, row, other);
            expect("stored, after a power cycle", bench.get((row.index, row.sub)), other)?;

            bench.set(memory.command, 1).let_store();
            memory.restart(&mut bench, row, default);
            expect("restored, after a power cycle", bench.get((row.index, row.sub)), default)
        },
    );
}

/// Power that goes at any moment of a save, or of a restore of what was saved, leaves the old values of two objects or the
/// new ones, both of them, and no fault.
pub fn are_saved_together_or_not_at_all<S: KeepingSubject>() {
    let (memory, objects) = (&S::MEMORY, &S::MEMORY.two);
    let (delivered, other): (Vec<i64>, Vec<i64>) = objects.iter().map(|(_, old, new)| (*old, *new)).unzip();
    let [low, high] = memory.command.to_le_bytes();
    for (command, old, new) in [(2, &delivered, &other), (1, &other, &delivered)] {
        let (mut olds, mut news) = (0, 0);
        for delay_us in (0..3000).step_by(50) {
            let mut bench = Bench::<S>::new();
            bench.set(memory.switch, 1);
            for (index, _, value) in objects {
                bench.set(*index, *value);
            }
            if command == 1 {
                bench.set(memory.command, 2).let_store();
            }
            let order =
                Frame::full(CanId::standard(0x600 + u16::from(S::NODE)), [0x2B, low, high, 0, command, 0, 0, 0]);
            bench.world.send(bench.host, order).expect("room at the host");
            bench.run(Duration::from_micros(delay_us)).power_cycle();
            let kept: Vec<_> = objects.iter().map(|(index, ..)| bench.get(*index)).collect();
            assert!(kept == *old || kept == *new, "{command}, off after {delay_us} us: {kept:?}");
            assert_eq!(bench.get(0x603F), 0, "{command}, off after {delay_us} us");
            (olds, news) = if kept == *old { (olds + 1, news) } else { (olds, news + 1) };
        }
        // A host repeats a command that was not accepted, so that a restore comes late rather than never.
        assert!((olds > 0 || command == 1) && news > 0, "both happen: {olds} and {news}");
    }
}

impl Memory {
    /// Another legal value of a writable object than the default; `None` where the drive could not be asked any more.
    fn other_value<S: BenchSubject>(&self, row: &ObjectRow) -> Option<i64> {
        let default = row.default?;
        if !row.writable || self.without.contains(&row.index) {
            return None;
        }
        Some(match (row.index, row.sub) {
            (0x1005, _) => 0x90,
            (0x1014, _) => 0x8000_0080 + i64::from(S::NODE),
            (0x1400..=0x1403 | 0x1800..=0x1803, 1) => 0x8000_0000 | default,
            (0x1400..=0x1403 | 0x1800..=0x1803, 2) => 0xFE,
            (0x1600..=0x1603 | 0x1A00..=0x1A03, 0) => 1 - default,
            (0x1600..=0x1603 | 0x1A00..=0x1A03, _) => velocity_mapping(row),
            _ => row.other_value()?,
        })
    }

    /// That value, and the default.
    fn values<S: BenchSubject>(&self, row: &ObjectRow) -> (i64, i64) {
        (self.other_value::<S>(row).unwrap_or_default(), row.default.unwrap_or_default())
    }

    /// Off and on; the host follows to the node that the drive has with `kept` in the row.
    fn restart<S: BenchSubject>(&self, bench: &mut Bench<S>, row: &ObjectRow, kept: i64) {
        bench.power_cycle();
        let moves = self.node_id == Some(row.index);
        bench.node = if moves { u8::try_from(kept).expect("a node") } else { S::NODE };
    }
}

/// The velocity, whole: the target in a receive PDO, the actual value in a transmit PDO.
fn velocity_mapping(row: &ObjectRow) -> i64 {
    if row.index < 0x1A00 { 0x60FF_0020 } else { 0x606C_0020 }
}

/// Writes the value the way the object wants it: mapping entries while sub-index 00 is 0.
fn write_other<S: BenchSubject>(bench: &mut Bench<S>, row: &ObjectRow, value: i64) -> Result<(), String> {
    if matches!(row.index, 0x1600..=0x1603 | 0x1A00..=0x1A03) {
        expect("clear the mapping", bench.write(row.index, 0), Ok(()))?;
        if row.sub == 0 && value == 1 {
            expect("map", bench.write((row.index, 1), velocity_mapping(row)), Ok(()))?;
        }
    }
    expect(&format!("write {value}"), bench.write((row.index, row.sub), value), Ok(()))?;
    expect("value read back", bench.get((row.index, row.sub)), value)?;
    bench.let_store();
    Ok(())
}

/// Asserts that `check` finds nothing wrong with any row that `of` picks, and that it picks some.
fn assert_rows<S: BenchSubject>(of: impl Fn(&ObjectRow) -> bool, check: impl Fn(&ObjectRow) -> Result<(), String>) {
    let rows: Vec<_> = S::rows().all().iter().filter(|row| of(row)).collect();
    assert!(!rows.is_empty());
    let at = |row: &ObjectRow, text| format!("{:04X}h:{:02X} {}: {text}", row.index, row.sub, row.name);
    let wrong: Vec<_> = rows.iter().filter_map(|row| check(row).err().map(|text| at(row, text))).collect();
    assert!(wrong.is_empty(), "{} rows:\n{}", wrong.len(), wrong.join("\n"));
}

fn expect<T: PartialEq + std::fmt::Debug>(what: &str, actual: T, expected: T) -> Result<(), String> {
    if actual == expected { Ok(()) } else { Err(format!("{what}: {actual:X?}, expected {expected:X?}")) }
}
