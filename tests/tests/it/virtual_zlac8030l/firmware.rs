//! `firmware=2.01`: what the maker's CANopen guide V2.01 of 2024 has that the manual V1.00 does not.

use crate::virtual_zlac8030l::bench::Bench;

const SPEED_SETTING: i64 = 0x2000;

fn in_velocity_mode(firmware: &str) -> Bench {
    let mut bench = Bench::choosing("firmware", firmware);
    bench.set(0x200A, 100).enable_in(3);
    bench
}

/// 603Fh, bit 2000h: a speed is given above the rated one.
#[test]
fn firmware_2_01_takes_a_target_above_the_maximum_speed_for_a_fault_and_1_00_limits_it() {
    for (firmware, code) in [("1.00", 0), ("2.01", SPEED_SETTING)] {
        for target in [101, -101] {
            let mut bench = in_velocity_mode(firmware);
            bench.set(0x60FF, 100).run_ms(800).turns_at(99.0, 101.0);
            bench.forget().set(0x60FF, target).run_ms(5);
            assert_eq!(bench.get(0x603F), code, "{firmware}: {target}");
            let heard = bench.heard_of("084#");
            assert_eq!(heard, if code == 0 { vec![] } else { vec!["084#0020210000000000"] }, "generic and profile");
        }
    }
}

#[test]
fn the_fault_of_firmware_2_01_is_reset_once_the_target_is_within_the_maximum() {
    let mut bench = in_velocity_mode("2.01");
    bench.set(0x60FF, 200).run_ms(5);
    bench.set(0x6040, 0x80);
    assert_eq!((bench.get(0x603F), bench.statusword() & 0x6F), (SPEED_SETTING, 0x08), "the cause is still there");
    bench.set(0x60FF, 50).run_ms(5);
    bench.set(0x6040, 0x00).set(0x6040, 0x80).reads(0x603F, 0).shows(0x6F, 0x60);
}

#[test]
fn the_version_is_that_of_the_firmware_and_202f_06_is_there_with_2_01_only() {
    for (firmware, version, count) in [("1.00", 0x0100, 5), ("2.01", 0x0201, 6)] {
        let mut bench = Bench::choosing("firmware", firmware);
        bench.reads(0x100A, version).reads(0x2025, version).reads((0x202F, 0), count);
        let written = bench.sdo(&[0x2B, 0x2F, 0x20, 6, 7, 0, 0, 0]).expect("an answer");
        bench.let_store().power_cycle();
        let read = bench.read((0x202F, 6));
        let expected = if count == 6 { (0x60, Ok(vec![7, 0])) } else { (0x80, Err(0x0609_0011)) };
        assert_eq!((written[0], read), expected, "{firmware}");
        bench.reads((0x202F, 5), 1).reads((0x2030, 0), 16);
    }
}
