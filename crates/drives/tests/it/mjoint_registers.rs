//! The M joint's registers over RS485 against its objects over SDO ("M Robot Joint Motor CanOpen Manual", 5.04).

use crate::bench::Bench;
use crate::bench::joint::Joint;
use canopen::{AbortCode, Mux};
use drives::RegisterError;
use drives::mjoint::objects::TABLE;
use drives::mjoint::objects::modbus::{REGISTERS, Register, find};

/// Addresses of the manual's table that the tests write by name.
const MODBUS_ENABLE: u16 = 0x00;
const PROFILE_VELOCITY: u16 = 0x02;
const INCREMENTAL_POSITION: u16 = 0x0E;
const STATUSWORD: u16 = 0x24;
const POSITION: u16 = 0x18;
const TARGET_POSITION: u16 = 0x1C;
const TARGET_VELOCITY: u16 = 0x1E;
const CONTROLWORD: u16 = 0x23;
const MODE: u16 = 0x25;

fn read(bench: &Bench<Joint>, register: &Register) -> i64 {
    let mut words = [0; 2];
    let words = &mut words[..usize::from(register.words)];
    bench.drive.read_registers(register.address, words).unwrap();
    match *words {
        [low, high] => i64::from(u32::from(high) << 16 | u32::from(low)),
        [word] => i64::from(word),
        _ => unreachable!("registers have one or two words"),
    }
}

/// What the words of a register show of an object's value.
fn shown(register: &Register, value: i64) -> i64 {
    value & if register.words == 2 { 0xFFFF_FFFF } else { 0xFFFF }
}

fn words_of(register: &Register, value: i64) -> Vec<u16> {
    (0..register.words).map(|word| (value >> (16 * word)) as u16).collect()
}

fn row(register: &Register) -> &'static canopen::od::Entry {
    TABLE.row(TABLE.find(register.object).unwrap())
}

#[test]
fn every_address_of_the_table_reads_what_sdo_reads() {
    let mut bench = Bench::<Joint>::new();
    bench.run_ms(50);
    for register in &REGISTERS {
        let over_sdo = bench.read(register.object.index, register.object.sub_index);
        assert_eq!(read(&bench, register), shown(register, over_sdo), "{:02X}h", register.address);
    }
    // All at once gives the same words.
    let mut all = [0; 0x27];
    bench.drive.read_registers(0, &mut all).unwrap();
    for register in &REGISTERS {
        let from = usize::from(register.address);
        let words = words_of(register, read(&bench, register));
        assert_eq!(all[from..from + words.len()], words, "{from:02X}h");
    }
}

#[test]
fn every_written_value_is_taken_or_refused_as_over_sdo() {
    for register in &REGISTERS {
        let Mux { index, sub_index } = register.object;
        let type_range = row(register).data_type.range();
        let limits = row(register).integer_limits().unwrap_or(type_range);
        let edges =
            [limits.0, limits.1, type_range.0, type_range.1].into_iter().flat_map(|edge| [edge - 1, edge, edge + 1]);
        for value in edges.chain([0, 1, 2, 3, 17, -1]).filter(|value| (type_range.0..=type_range.1).contains(value)) {
            let (mut by_sdo, mut by_register) = (Bench::<Joint>::new(), Bench::<Joint>::new());
            by_sdo.write(0x2600, 0, 1);
            by_register.write(0x2600, 0, 1);
            let expected = by_sdo.try_write(index, sub_index, value);
            let written = by_register.drive.write_registers(register.address, &words_of(register, value));
            let as_abort = written.map_err(|error| match error {
                RegisterError::ReadOnly => AbortCode::READ_ONLY.0,
                RegisterError::BadValue(code) => code.0,
                RegisterError::Forbidden => panic!("2600h is 1"),
                RegisterError::NoSuchAddress => panic!("{:02X}h is in the table", register.address),
            });
            assert_eq!(as_abort, expected, "{value} to {:02X}h", register.address);
            for other in &REGISTERS {
                let same = read(&by_register, other) == read(&by_sdo, other);
                assert!(same, "{value} to {:02X}h: {:02X}h differs", register.address, other.address);
            }
        }
    }
}

#[test]
fn a_move_by_registers_is_the_move_by_sdo() {
    let (mut by_sdo, mut by_register) = (Bench::<Joint>::new(), Bench::<Joint>::new());
    for (index, value) in [(0x2600, 1), (0x6060, 1), (0x6081, 300), (0x6040, 0x0E), (0x607A, -40_000), (0x6040, 0x1E)] {
        by_sdo.write(index, 0, value);
    }
    let drive = &mut by_register.drive;
    drive.write_registers(MODBUS_ENABLE, &[1]).unwrap();
    drive.write_registers(MODE, &[1]).unwrap();
    drive.write_registers(PROFILE_VELOCITY, &[300, 0]).unwrap();
    drive.write_registers(CONTROLWORD, &[0x0E]).unwrap();
    drive.write_registers(TARGET_POSITION, &[(-40_000_i32) as u16, 0xFFFF]).unwrap();
    drive.write_registers(CONTROLWORD, &[0x1E]).unwrap();
    for _ in 0..200 {
        by_sdo.run_ms(10);
        by_register.run_ms(10);
        assert_eq!(by_sdo.shaft(), by_register.shaft());
    }
    let mut position = [0; 2];
    by_register.drive.read_registers(POSITION, &mut position).unwrap();
    let position = (u32::from(position[1]) << 16 | u32::from(position[0])) as i32;
    assert!((position + 40_000).abs() <= 50, "{position}");
    let mut statusword = [0];
    by_register.drive.read_registers(STATUSWORD, &mut statusword).unwrap();
    assert_ne!(statusword[0] & 1 << 10, 0, "target reached: {:04X}h", statusword[0]);
}

#[test]
fn two_words_of_a_move_act_once_and_one_word_acts_with_the_present_other_half() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    bench.write(0x6040, 0, 0x0E);
    bench.drive.write_registers(INCREMENTAL_POSITION, &[0x86A0, 0x0001]).unwrap();
    bench.run_s(4.0);
    assert!((bench.shaft() - 100_000).abs() <= 50, "one relative move of 100,000 counts: {}", bench.shaft());
    // The high half is still 1: 65536 + 1000.
    bench.drive.write_registers(INCREMENTAL_POSITION, &[1000]).unwrap();
    bench.run_s(4.0);
    assert!((bench.shaft() - 166_536).abs() <= 50, "{}", bench.shaft());
}

#[test]
fn half_of_a_value_is_checked_as_the_whole_value() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    bench.write(0x60FF, 0, 100);
    // 100 with the high half FFFFh is -65436 r/min.
    let refused = bench.drive.write_registers(TARGET_VELOCITY + 1, &[0xFFFF]);
    assert_eq!(refused, Err(RegisterError::BadValue(AbortCode::VALUE_TOO_LOW)));
    bench.drive.write_registers(TARGET_VELOCITY, &[2000]).unwrap();
    assert_eq!(bench.read(0x60FF, 0), 2000);
    let mut high = [7];
    bench.drive.read_registers(TARGET_VELOCITY + 1, &mut high).unwrap();
    assert_eq!(high, [0]);
}

#[test]
fn a_refused_word_leaves_the_words_before_it_unwritten() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    // 60F9h:01 takes 0 to 10000 at 07h, 60F9h:02 only 2 to 2000 at 08h.
    let before = bench.read(0x60F9, 1);
    let refused = bench.drive.write_registers(0x07, &[1234, 1]);
    assert_eq!(refused, Err(RegisterError::BadValue(AbortCode::VALUE_TOO_LOW)));
    // 10h can be written, 11h (the actual current) not.
    assert_eq!(bench.drive.write_registers(0x0F, &[0, 0, 0]), Err(RegisterError::ReadOnly));
    assert_eq!(bench.drive.write_registers(0x26, &[18, 0]), Err(RegisterError::NoSuchAddress));
    assert_eq!((bench.read(0x60F9, 1), bench.read(0x260C, 0), bench.read(0x6098, 0)), (before, 0, 17));
}

#[test]
fn addresses_outside_the_table_are_refused() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    let mut words = [0; 3];
    for address in [0x27, 0x100, 0x2600, 0xFFFE, 0xFFFF] {
        assert_eq!(find(address), None);
        assert_eq!(bench.drive.read_registers(address, &mut words), Err(RegisterError::NoSuchAddress));
        assert_eq!(bench.drive.write_registers(address, &[0; 3]), Err(RegisterError::NoSuchAddress));
    }
    assert_eq!(bench.drive.read_registers(0x25, &mut words), Err(RegisterError::NoSuchAddress));
}

#[test]
fn a_word_that_does_not_fit_into_eight_bits_is_refused() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    for (word, expected) in [
        (0x0103, Err(RegisterError::BadValue(AbortCode::VALUE_TOO_HIGH))),
        (0xFF03, Err(RegisterError::BadValue(AbortCode::VALUE_TOO_LOW))),
        (0x0003, Ok(())),
    ] {
        assert_eq!(bench.drive.write_registers(MODE, &[word]), expected, "{word:04X}h");
    }
    assert_eq!(bench.read(0x6060, 0), 3);
}

#[test]
fn it_has_no_address_without_power() {
    let mut bench = Bench::<Joint>::new();
    bench.write(0x2600, 0, 1);
    assert_eq!(bench.drive.modbus_address(), Some(1));
    // 2615h counts from the next power-on, when it was saved.
    bench.drive.write_registers(0x17, &[9]).unwrap();
    bench.drive.write_registers(0x16, &[1]).unwrap();
    bench.run_ms(5);
    let mut saved = [0];
    bench.drive.read_registers(0x16, &mut saved).unwrap();
    assert_eq!((saved, bench.drive.modbus_address()), ([2], Some(1)));
    bench.power_off();
    assert_eq!(bench.drive.modbus_address(), None);
    bench.node = 9;
    bench.power_on();
    assert_eq!(bench.drive.modbus_address(), Some(9));
}

#[test]
fn with_2600h_0_only_2600h_itself_is_written() {
    // 5.04: "0: modbus forbid".
    let mut bench = Bench::<Joint>::new();
    assert_eq!(bench.drive.write_registers(TARGET_VELOCITY, &[100, 0]), Err(RegisterError::Forbidden));
    assert_eq!(bench.drive.write_registers(MODBUS_ENABLE, &[0, 0]), Err(RegisterError::Forbidden));
    assert_eq!(bench.read(0x60FF, 0), 0);
    let mut word = [9];
    bench.drive.read_registers(MODBUS_ENABLE, &mut word).unwrap();
    assert_eq!(word, [0], "reading is not forbidden");
    bench.drive.write_registers(MODBUS_ENABLE, &[1]).unwrap();
    bench.drive.write_registers(TARGET_VELOCITY, &[100, 0]).unwrap();
    assert_eq!(bench.read(0x60FF, 0), 100);
    bench.drive.write_registers(MODBUS_ENABLE, &[0]).unwrap();
    assert_eq!(bench.drive.write_registers(TARGET_VELOCITY, &[0, 0]), Err(RegisterError::Forbidden));
    // Together with what follows it.
    bench.drive.write_registers(MODBUS_ENABLE, &[1, 1]).unwrap();
    assert_eq!(bench.read(0x2600, 0), 1);
}
