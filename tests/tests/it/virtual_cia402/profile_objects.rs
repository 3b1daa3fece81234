//! Objects of CiA 402-2 that say what a drive can do, and what its loops do.

use canopen::AbortCode;
use canopen::od::{Access, Entry};
use sim::VirtualDrive;

use crate::virtual_cia402::bench::{Bench, changed};

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
