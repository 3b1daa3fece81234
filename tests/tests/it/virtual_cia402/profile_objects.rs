//! Objects of CiA 402-2 that say what a drive can do, and what its loops do.

use canopen::od::{Access, DataType, Entry};
use canopen::{AbortCode, Mux};
use devices::Description;
use devices::servo::CIA402;
use drives::servo::acts_on;
use sim::VirtualDrive;

use crate::virtual_cia402::bench::{Bench, TURN, changed, of_rows};

#[test]
fn supported_homing_methods_are_those_that_are_taken() {
    let mut bench = Bench::new();
    let count = bench.read(0x60E3, 0);
    let listed: Vec<i64> = (1..=count).map(|sub| bench.read(0x60E3, sub as u8)).collect();
    let taken: Vec<i64> = (-128..=127).filter(|method| bench.write(0x6098, 0, *method).is_ok()).collect();
    assert_eq!(taken, [&[0][..], &listed[..]].concat(), "0 chooses none");
}

#[test]
fn a_method_that_a_file_does_not_list_or_that_does_not_run_is_refused() {
    // 17, and a maker's own.
    let few = changed(|row| match (row.index, row.sub_index) {
        (0x60E3, 0) => row.default(2),
        (0x60E3, 1) => row.default(17),
        (0x60E3, 2) => row.default(-3),
        (0x6098, 0) => Entry { limits: None, ..row },
        _ => row,
    });
    let mut bench = Bench::of(few);
    assert_eq!([0, 17].map(|method| bench.write(0x6098, 0, method)), [Ok(()); 2]);
    for method in [1, 18, 37, -3, 15] {
        assert_eq!(bench.write(0x6098, 0, method), Err(AbortCode::INVALID_VALUE), "{method}");
    }
    assert_eq!(bench.read(0x6098, 0), 17);
    // A list that says nothing leaves all that run.
    let open = changed(|row| if row.index == 0x60E3 { row.default(0) } else { row });
    assert_eq!(Bench::of(open).write(0x6098, 0, 18), Ok(()));
}

#[test]
fn control_effort_is_what_the_position_loop_asks_for() {
    let mut bench = Bench::new();
    bench.enable(8);
    bench.machine.set_rotor_locked(true, bench.now).unwrap();
    let target = bench.position() + 1000;
    bench.set(&[(0x607A, 0, target)]);
    bench.run_ms(20);
    // A proportional loop of 60 1/s (`drives/src/servo/motor.rs`): 1000 increments off, at rest.
    let error = bench.read(0x60F4, 0);
    assert!((error - 1000).abs() <= 2, "{error}");
    assert_eq!(bench.read(0x60FA, 0), 60 * error);
    bench.set(&[(0x6060, 0, 3)]);
    bench.run_ms(20);
    assert_eq!((bench.read(0x6061, 0), bench.read(0x60FA, 0)), (3, 0), "no position is controlled");
}

/// CiA 402-2, 67FEh: the version of the profile, which a host can only read.
#[test]
fn the_version_of_the_profile_is_read_and_not_written() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(0x67FE, 0), 4 << 16, "4.0");
    assert_eq!(bench.write(0x67FE, 0, 0), Err(AbortCode::READ_ONLY));
    assert_eq!(bench.read(0x67FE, 0), 4 << 16);
}

/// CiA 402-2, tables 33 to 44: negative codes are makers', the others that are not listed reserved.
#[test]
fn reserved_option_codes_are_refused_and_the_one_that_a_file_delivers_is_taken() {
    // As a file has them: without lists of values, one with a code of its maker.
    let file = changed(|row| match row.index {
        0x605A => Entry { values: &[], ..row.default(-1) },
        0x605B..=0x605E => Entry { values: &[], ..row },
        _ => row,
    });
    let mut bench = Bench::of(file);
    assert_eq!(bench.write(0x605A, 0, -1), Ok(()));
    for (index, codes) in [(0x605A, 0..=8), (0x605B, 0..=1), (0x605C, 0..=1), (0x605D, 1..=4), (0x605E, 0..=4)] {
        let last = *codes.end();
        for code in codes.clone() {
            assert_eq!((bench.write(index, 0, code), bench.read(index, 0)), (Ok(()), code), "{index:04X}h");
        }
        for code in (-3..=12).chain([-0x8000, 0x7FFF]).filter(|code| !codes.contains(code)) {
            assert_eq!(bench.write(index, 0, code), Err(AbortCode::INVALID_VALUE), "{index:04X}h = {code}");
        }
        assert_eq!(bench.read(index, 0), last, "nothing of it was stored in {index:04X}h");
    }
}

#[test]
fn a_fraction_takes_no_0_but_the_one_that_a_file_delivers() {
    let file = changed(|row| match row.index {
        0x608F | 0x6091 | 0x6092 if row.sub_index > 0 => {
            Entry { limits: None, access: Access::ReadWrite, ..row.default(i64::from(row.index != 0x608F)) }
        }
        _ => row,
    });
    let mut bench = Bench::of(file);
    for index in [0x608F, 0x6091, 0x6092] {
        for sub in [1, 2] {
            let as_delivered = if index == 0x608F { Ok(()) } else { Err(AbortCode::VALUE_TOO_LOW) };
            assert_eq!(bench.write(index, sub, 0), as_delivered, "{index:04X}h:{sub:02X}");
            assert_eq!(bench.write(index, sub, 3), Ok(()));
            assert_eq!(bench.write(index, sub, 0), Err(AbortCode::VALUE_TOO_LOW), "{index:04X}h:{sub:02X}");
            assert_eq!(bench.read(index, sub), 3);
        }
    }
}

fn entry(index: u16, sub: u8, data_type: DataType) -> Entry {
    Entry::new(index, sub, data_type, Access::ReadWrite, "", "")
}

/// The standard's servo with these objects in place of its own.
fn cia402_with(further: &[Entry]) -> &'static Description {
    let are_further = |row: &Entry| further.iter().any(|other| other.mux() == row.mux());
    let own = CIA402.dictionary.rows().iter().copied().filter(|row| !are_further(row));
    of_rows(own.chain(further.iter().copied()).collect())
}

#[test]
fn a_servo_by_its_file_takes_no_change_of_what_it_does_not_act_on() {
    let further = [
        entry(0x606A, 0, DataType::Integer16).default(-1),
        entry(0x60F2, 0, DataType::Unsigned16).default(2),
        entry(0x6402, 0, DataType::Unsigned16).default(10),
    ];
    let mut bench = Bench::of(cia402_with(&further));
    for (index, own) in [(0x606A, -1), (0x60F2, 2), (0x6402, 10)] {
        assert_eq!(bench.write(index, 0, own), Ok(()), "{index:04X}h has it");
        assert_eq!(bench.write(index, 0, 77), Err(AbortCode::READ_ONLY), "{index:04X}h");
        assert_eq!(bench.read(index, 0), own);
    }
}

/// Gains and motor data of makers go through, as the lists with which their drives are started write them, also of a second axis, and a
/// move is the same with them: no loop uses them. The last one is an object of the maker's own part.
#[test]
fn what_the_profile_leaves_to_makers_is_stored_and_changes_no_motion() {
    let places =
        [(0x60F6, 1), (0x60F7, 1), (0x60F9, 2), (0x60FB, 5), (0x6410, 3), (0x6510, 2), (0x68F9, 1), (0x2100, 0)];
    let further: Vec<Entry> = places
        .iter()
        .map(|&(index, sub)| entry(index, sub, DataType::Unsigned16).default(500).range(1, 1000))
        .collect();
    let moved = |bench: &mut Bench| {
        bench.enable(1);
        bench.set(&[(0x607A, 0, TURN), (0x6040, 0, 0x1F)]);
        let mut after_10_ms = || {
            bench.run_ms(10);
            bench.position()
        };
        (0..100).map(|_| after_10_ms()).collect::<Vec<_>>()
    };
    let mut untouched = Bench::of(cia402_with(&further));
    let mut bench = Bench::of(cia402_with(&further));
    for (index, sub) in places {
        assert_eq!((bench.write(index, sub, 77), bench.read(index, sub)), (Ok(()), 77), "{index:04X}h:{sub:02X}");
        assert_eq!(bench.write(index, sub, 1001), Err(AbortCode::VALUE_TOO_HIGH), "{index:04X}h:{sub:02X}");
    }
    let positions = moved(&mut bench);
    assert!(positions[0] < TURN / 2 && (positions[99] - TURN).abs() < 100, "{positions:?}");
    assert_eq!(positions, moved(&mut untouched));
}

/// Objects that masters write as they set a drive up, whatever its maker (Lely, ros2_canopen, makers' start-up lists).
#[test]
fn what_start_ups_write_is_acted_on() {
    let by_sub_index = [
        (0x607B, 1..=2),
        (0x607D, 1..=2),
        (0x608F, 1..=2),
        (0x6091, 1..=2),
        (0x6092, 1..=2),
        (0x6099, 1..=2),
        (0x60A4, 1..=4),
        (0x60C1, 1..=1),
        (0x60C2, 1..=2),
        (0x60FE, 1..=2),
    ];
    let plain = [
        0x6007, 0x6040, 0x6042, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6060, 0x6065, 0x6066, 0x6067, 0x6068, 0x606D,
        0x606E, 0x606F, 0x6070, 0x6071, 0x6072, 0x6073, 0x6075, 0x6076, 0x607A, 0x607C, 0x607E, 0x607F, 0x6080, 0x6081,
        0x6082, 0x6083, 0x6084, 0x6085, 0x6086, 0x6087, 0x6098, 0x609A, 0x60B0, 0x60B1, 0x60B2, 0x60B8, 0x60C0, 0x60C5,
        0x60C6, 0x60E0, 0x60E1, 0x60FF,
    ];
    let records = by_sub_index.into_iter().flat_map(|(index, subs)| subs.map(move |sub| Mux::new(index, sub)));
    for mux in records.chain(plain.map(|index| Mux::new(index, 0))) {
        assert!(acts_on(&CIA402, mux), "{mux}");
    }
}
