//! The services of CiA 301 over the objects of the description.

use canopen::od::{Access, DefaultValue};
use canopen::{AbortCode, Mux};
use devices::servo::CIA402;
use devices::variant::Preset;
use sim::VirtualDrive;

use crate::virtual_cia402::bench::{Bench, TURN};

const SAVE: i64 = 0x6576_6173;
const LOAD: i64 = 0x6461_6F6C;

/// What a running drive measures, or what a service shows instead of a value as delivered.
fn is_live(mux: Mux) -> bool {
    matches!(mux.index, 0x6041 | 0x6061..=0x6064 | 0x606B | 0x606C | 0x6074 | 0x6077..=0x6079 | 0x60F4 | 0x60FC | 0x60FD)
}

/// CiA 301, 7.2.4.3.9 to 7.2.4.3.16: 607Ah, whose four bytes are one segment, and its checksum.
#[test]
fn an_object_is_written_and_read_in_blocks() {
    let mut bench = Bench::new();
    let checksum = canopen::sdo::block::checksum(0, &[0x10, 0x27, 0, 0]).to_le_bytes();
    bench.frame("605#C67A600004000000");
    bench.frame("605#8110270000000000");
    bench.frame(&format!("605#CD{:02X}{:02X}0000000000", checksum[0], checksum[1]));
    assert_eq!(bench.take_answers(), ["585#A47A60007F000000", "585#A2017F0000000000", "585#A100000000000000"]);
    assert_eq!(bench.read(0x607A, 0), 10_000);
    bench.frame("605#A47A60007F000000");
    bench.frame("605#A300000000000000");
    bench.frame("605#A2017F0000000000");
    let end = format!("585#CD{:02X}{:02X}0000000000", checksum[0], checksum[1]);
    assert_eq!(bench.take_answers(), ["585#C67A600004000000", "585#8110270000000000", &end]);
}

#[test]
fn every_object_answers_as_it_is_delivered() {
    let mut bench = Bench::new();
    let mut read = 0;
    for row in CIA402.dictionary.rows() {
        let mux = row.mux();
        if row.data_type.bits() == 0 || is_live(mux) {
            continue;
        }
        let expected = match row.default {
            DefaultValue::Value(value) => value,
            DefaultValue::NodeIdPlus(base) => i64::from(base) + 5,
            _ => continue,
        };
        let answer = if row.access == Access::WriteOnly { Err(AbortCode::WRITE_ONLY) } else { Ok(expected) };
        assert_eq!(bench.try_read(mux.index, mux.sub_index), answer, "{mux} {}", row.name);
        let same = bench.write(mux.index, mux.sub_index, expected);
        let writable = !matches!(mux.index, 0x1010 | 0x1011 | 0x1400..=0x1BFF);
        if matches!(row.access, Access::ReadOnly | Access::Const) {
            assert_eq!(same, Err(AbortCode::READ_ONLY), "{mux}");
        } else if writable {
            assert_eq!(same, Ok(()), "{mux} {}", row.name);
        }
        read += 1;
    }
    assert!(read > 200, "{read}");
}

#[test]
fn parameters_are_stored_by_group_and_come_back() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x1010, 1), 1, "stores on command");
    bench.set(&[(0x6072, 0, 1500), (0x1017, 0, 100)]);
    assert_eq!(bench.write(0x1010, 1, 0x1234), Err(AbortCode::CANNOT_TRANSFER));
    let before = bench.machine.nvm_generation();
    bench.set(&[(0x1010, 3, SAVE)]);
    assert_eq!(bench.machine.nvm_generation(), before + 1);
    cycle(&mut bench);
    assert_eq!((bench.read(0x6072, 0), bench.read(0x1017, 0)), (1500, 0), "only the profile's group");
    bench.set(&[(0x1017, 0, 100), (0x1010, 1, SAVE)]);
    cycle(&mut bench);
    assert_eq!((bench.read(0x6072, 0), bench.read(0x1017, 0)), (1500, 100));
    bench.set(&[(0x1011, 1, LOAD)]);
    assert_eq!(bench.read(0x6072, 0), 1500, "from the next reset on");
    bench.frame("000#8105");
    bench.run_ms(5);
    assert_eq!((bench.read(0x6072, 0), bench.read(0x1017, 0)), (3000, 0));
}

/// The supply off and on.
fn cycle(bench: &mut Bench) {
    bench.machine.cut_power(bench.now);
    bench.run_ms(100);
    bench.machine.set_power(true, bench.now);
    bench.run_ms(300);
}

#[test]
fn reset_communication_leaves_parameters_alone_and_with_6007h_0_the_motor_too() {
    let mut bench = Bench::new();
    bench.enable(3);
    bench.set(&[
        (0x60FF, 0, 5 * crate::virtual_cia402::bench::TURN),
        (0x1017, 0, 50),
        (0x6072, 0, 2000),
        (0x6007, 0, 0),
    ]);
    bench.run_ms(300);
    bench.frame("000#8205");
    bench.run_ms(20);
    assert!((bench.rpm() - 300.0).abs() < 6.0, "{}", bench.rpm());
    assert_eq!((bench.read(0x1017, 0), bench.read(0x6072, 0)), (0, 2000));
}

#[test]
fn errors_are_kept_latest_first_and_forgotten_by_0() {
    let mut bench = Bench::new();
    bench.set(&[(0x1016, 1, 0x0001_0032)]);
    for _ in 0..2 {
        bench.frame("701#05");
        bench.run_ms(100);
        bench.frame("701#05");
        bench.control(0x00);
        bench.control(0x80);
        bench.run_ms(10);
    }
    assert_eq!(bench.emcy(), [0x8130, 0, 0x8130, 0]);
    assert_eq!((bench.read(0x1003, 0), bench.read(0x1003, 1), bench.read(0x1003, 2)), (2, 0x8130, 0x8130));
    assert_eq!(bench.write(0x1003, 0, 1), Err(AbortCode::INVALID_VALUE));
    bench.set(&[(0x1003, 0, 0)]);
    assert_eq!((bench.read(0x1003, 0), bench.read(0x1003, 1)), (0, 0));
}

#[test]
fn pdos_are_mapped_as_the_standard_has_them() {
    let mut bench = Bench::new();
    bench.sent.clear();
    bench.frame("205#0600");
    bench.run_ms(2);
    let heard: Vec<_> = bench.sent.iter().map(ToString::to_string).collect();
    // TPDO1: statusword; TPDO2: statusword and mode.
    assert!(heard.contains(&"185#3106".to_string()) && heard.contains(&"285#310600".to_string()), "{heard:?}");
    bench.sent.clear();
    bench.sync();
    bench.run_ms(2);
    let heard: Vec<_> = bench.sent.iter().map(ToString::to_string).collect();
    assert!(heard.iter().any(|frame| frame.starts_with("385#3106") && frame.len() == 4 + 12), "{heard:?}");
    assert!(heard.iter().any(|frame| frame.starts_with("485#3106") && frame.len() == 4 + 12), "{heard:?}");
    bench.frame("305#060003");
    bench.run_ms(2);
    assert_eq!(bench.read(0x6061, 0), 3, "RPDO2 carries the mode");
    bench.frame("505#060000000200");
    assert_eq!(bench.read(0x60FF, 0), 0x0002_0000, "RPDO4 the target velocity");
}

#[test]
fn a_position_that_always_changes_is_sent_once_a_millisecond_without_an_inhibit_time() {
    let mut bench = Bench::new();
    // TPDO3 carries statusword and position.
    bench.set(&[(0x1802, 1, 0xC000_0385), (0x1802, 2, 255), (0x1802, 3, 0), (0x1802, 1, 0x385)]);
    bench.enable(3);
    bench.set(&[(0x60FF, 0, 5 * TURN)]);
    bench.run_ms(200);
    bench.sent.clear();
    bench.run_ms(1000);
    let count = bench.sent.iter().filter(|frame| frame.id().raw() == 0x385).count();
    assert!((999..=1001).contains(&count), "{count}");
}

#[test]
fn what_its_maker_writes_of_one_device_is_ordered_with_it_and_stays() {
    let numbers = [(0x1000, 0, 0x0402_0192), (0x1018, 1, 0x5A), (0x1018, 3, 0xFFFF_FFFF), (0x6502, 0, 0x25)];
    let presets: Vec<_> = numbers.iter().map(|(index, sub, value)| Preset::new(*index, *sub, *value)).collect();
    let mut bench = Bench::ordered(&CIA402, &presets).unwrap();
    for _ in 0..2 {
        assert!(numbers.iter().all(|(index, sub, value)| bench.read(*index, *sub) == *value));
        // pp, pv and hm are there, and nothing else.
        let taken = [1, 3, 4, 6, 7, 8].map(|mode| bench.write(0x6060, 0, mode).is_ok());
        assert_eq!(taken, [true, true, false, true, false, false]);
        bench.set(&[(0x1010, 1, 0x6576_6173), (0x1011, 1, 0x6461_6F6C)]);
        cycle(&mut bench);
    }
    let refused =
        |index, value| Bench::ordered(&CIA402, &[Preset::new(index, 0, value)]).map(drop).unwrap_err().to_string();
    assert!(refused(0x6041, 1).contains("the drive does not store it"), "{}", refused(0x6041, 1));
    assert!(refused(0x1000, 1 << 32).contains("would be refused"), "{}", refused(0x1000, 1 << 32));
    assert!(refused(0x5FFF, 1).contains("no such object"));
}

#[test]
fn each_of_eight_nodes_is_watched_once() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x1016, 0), 8);
    for sub in 1..=8 {
        bench.set(&[(0x1016, sub, i64::from(sub) << 16 | 100)]);
        let again = bench.write(0x1016, sub % 8 + 1, i64::from(sub) << 16 | 100);
        assert_eq!(again, Err(AbortCode::PARAMETER_INCOMPATIBLE), "node {sub} in two entries");
    }
    // The eighth is missed as the first would be.
    bench.frame("708#05");
    bench.run_ms(150);
    assert_eq!(bench.emcy(), [0x8130]);
}

#[test]
fn an_rpdo_that_is_too_short_is_reported() {
    let mut bench = Bench::new();
    bench.frame("405#0600");
    bench.run_ms(2);
    assert_eq!(bench.emcy(), [0x8210]);
    assert_eq!(bench.read(0x1003, 1), 0x8210);
}

#[test]
fn what_is_mounted_wrong_or_missing_is_a_fault_with_its_code() {
    for (component, code) in [(sim::Component::Encoder, 0x7305), (sim::Component::Eeprom, 0x5530)] {
        let mut bench = Bench::new();
        bench.machine.set_fault(component, true, bench.now).unwrap();
        bench.run_ms(50);
        assert_eq!((bench.read(0x603F, 0), bench.status() & 0x4F), (code, 0x08));
    }
    for (supply_v, code) in [(100.0, 0x3220), (420.0, 0x3210)] {
        let mut bench = Bench::new();
        bench.machine.set_supply(supply_v, bench.now).unwrap();
        bench.run_ms(2000);
        assert_eq!(bench.read(0x603F, 0), code, "{supply_v} V, {} mV", bench.read(0x6079, 0));
    }
    for (sensor, code) in [(sim::TemperatureSensor::Motor, 0x4310), (sim::TemperatureSensor::Driver, 0x4210)] {
        let mut bench = Bench::new();
        bench.machine.hold_temperature(sensor, Some(140.0), bench.now).unwrap();
        bench.run_ms(50);
        assert_eq!(bench.read(0x603F, 0), code);
    }
}
