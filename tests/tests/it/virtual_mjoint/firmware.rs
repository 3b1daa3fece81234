//! `firmware=1.66`: what the maker's EDS YZ_MOTOR_SN2 and its manual 1.66 have that the manual here does not.

use crate::virtual_mjoint::bench::Bench;

const NO_SUCH_OBJECT: u32 = 0x0602_0000;
const NO_SUCH_SUB_INDEX: u32 = 0x0609_0011;
const READ_ONLY: u32 = 0x0601_0002;

fn firmware_1_66() -> Bench {
    Bench::choosing("firmware", "1.66")
}

#[test]
fn tpdo_1_comes_by_itself_each_100_ms_and_the_others_once_they_have_a_time() {
    let mut bench = firmware_1_66();
    bench.reads((0x1800, 0), 5).reads((0x1800, 5), 100).reads((0x1801, 5), 0).forget().run_ms(2000);
    let times: Vec<_> =
        bench.heard_at().into_iter().filter(|(_, frame)| frame.standard_data_id() == Some(0x181)).collect();
    assert!((19..=21).contains(&times.len()), "{} in 2 s", times.len());
    assert!(
        times.windows(2).all(|two| (99_000_000..101_000_000).contains(&two[1].0.nanos_since(two[0].0))),
        "{times:?}"
    );
    let set = bench.sdo(&[0x2B, 0x02, 0x18, 5, 50, 0, 0, 0]).expect("an answer");
    assert_eq!(set[0], 0x60);
    bench.send("000#0101").forget().run_ms(1000);
    assert!((19..=21).contains(&bench.heard_of("381#").len()));
    bench.forget().send("301#A0860100E8030000").run_ms(10);
    assert_eq!(bench.heard_of("281#").len(), 1, "an RPDO is answered all the same");
}

#[test]
fn a_mapping_can_be_written_and_is_stored() {
    let mut bench = firmware_1_66();
    bench.map(0x1A01, &[0x6078_0010, 0x6041_0010]).save().power_cycle();
    bench.reads((0x1A01, 1), 0x6078_0010).forget().send("301#A0860100E8030000").run_ms(10);
    assert_eq!(bench.heard_of("281#")[0].len(), "281#00000000".len());
    bench.set(0x1600, 0).set((0x1600, 1), 0x60FF_0020).set(0x1600, 1).send("201#9CFFFFFF").reads(0x60FF, -100);
    Bench::new().refuses(0x1A01, 0, READ_ONLY);
}

#[test]
fn the_velocity_has_32_bits_and_what_the_manual_lets_be_written_is_read_only() {
    for (firmware, size, cycle, timer) in
        [("manual", 2, Err(NO_SUCH_OBJECT), Err(NO_SUCH_SUB_INDEX)), ("1.66", 4, Ok(vec![0; 4]), Ok(vec![100, 0]))]
    {
        let mut bench = Bench::choosing("firmware", firmware);
        bench.turn(-600).run_ms(1000);
        let bytes = bench.read(0x606C).expect("a velocity");
        let value = bytes.iter().rev().fold(-1_i64, |value, byte| value << 8 | i64::from(*byte));
        assert_eq!(bytes.len(), size, "{firmware}");
        assert!((value + 6000).abs() < 60, "{firmware}: {value}, of 0.1 r/min");
        assert_eq!((bench.read(0x1006), bench.read((0x1800, 5))), (cycle, timer), "{firmware}");
        let taken = if size == 2 { Ok(()) } else { Err(READ_ONLY) };
        assert_eq!((bench.write(0x260C, 0), bench.write(0x260E, 0)), (taken, taken), "{firmware}");
    }
}
