//! Objects of CiA 402-2 that say what a drive can do, and what its loops do.

use canopen::AbortCode;
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
        (0x6098, 0) => canopen::od::Entry { limits: None, ..row },
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
