//! Frames that other masters and tools send and that the manuals do not speak of, asked of the running drives: RPDOs of a
//! wrong length and remote frames. `docs/drives` has the readings.

use devices::model;
use ferrodrive_tests::bench::{Bench, Subject, mjoint, zlac8030l, zlim42c};

/// A drive in operational.
fn operational<S: Subject>() -> Bench<S> {
    let mut bench = Bench::new();
    bench.send(&format!("000#01{:02X}", S::NODE)).run_ms(50);
    bench.heard();
    bench
}

/// The frame on the identifier `base` + node-ID.
fn of<S: Subject>(base: u16, data: &str) -> String {
    format!("{:03X}#{data}", base + u16::from(S::NODE))
}

/// CiA 301, 7.2.7.1 and table 26: 8210h when the error begins, 0000h when it ends; bit 4 of 1001h between.
fn tells_a_short_rpdo<S: Subject>() {
    let mut bench = operational::<S>();
    for _ in 0..3 {
        bench.send(&of::<S>(0x200, "06"));
    }
    bench.run_ms(10);
    assert_eq!(bench.heard_of(&of::<S>(0x080, "")), [of::<S>(0x080, "1082110000000000")], "told once");
    assert_eq!((bench.get(0x1001), bench.get(0x6040), bench.get(0x603F)), (0b1_0001, 0, 0));
    for _ in 0..3 {
        bench.send(&of::<S>(0x200, "0600"));
    }
    bench.run_ms(10);
    assert_eq!(bench.heard_of(&of::<S>(0x080, "")), [of::<S>(0x080, "0000000000000000")]);
    assert_eq!((bench.get(0x1001), bench.get(0x6040), bench.statusword() & 0x6F), (0, 6, 0x21));
}

/// The mapped bytes count, as CiA 301 has it; 8220h is a choice, and none is made of it.
fn takes_a_long_rpdo<S: Subject>(mapped: &str) -> Bench<S> {
    let mut bench = operational::<S>();
    bench.send(&of::<S>(0x200, &format!("{mapped:A<16}"))).run_ms(10);
    assert_eq!(bench.heard_of(&of::<S>(0x080, "")), [""; 0]);
    bench.reads(0x1001, 0);
    bench
}

#[test]
fn a_zl_drive_tells_8210h_of_an_rpdo_that_is_too_short_and_uses_nothing_of_it() {
    tells_a_short_rpdo::<zlac8030l::Zlac8030l>();
    tells_a_short_rpdo::<zlim42c::Zlim42c>();
}

#[test]
fn a_joint_discards_an_rpdo_that_is_too_short_without_an_emcy_or_an_answer() {
    let mut bench = operational::<mjoint::MJoint>();
    // RPDO1: controlword, mode, position; without the last byte.
    bench.send("201#0F0003000000").run_ms(10);
    assert_eq!(bench.heard_of("081#"), [""; 0]);
    assert_eq!((bench.get(0x1001), bench.get(0x6040)), (0, 0));
    assert_eq!(bench.heard_of("181#"), [""; 0]);
    bench.send("201#0F000300000000").run_ms(10);
    assert_eq!((bench.get(0x6040), bench.heard_of("181#").len()), (0x0F, 1));
}

#[test]
fn every_drive_uses_the_mapped_bytes_of_an_rpdo_that_is_too_long_and_tells_nothing() {
    assert_eq!(takes_a_long_rpdo::<zlac8030l::Zlac8030l>("0600").get(0x6040), 6);
    assert_eq!(takes_a_long_rpdo::<zlim42c::Zlim42c>("0600").get(0x6040), 6);
    let mut joint = takes_a_long_rpdo::<mjoint::MJoint>("0F000300000000");
    assert_eq!((joint.get(0x6040), joint.get(0x6060)), (0x0F, 3));
}

#[test]
fn what_is_told_of_a_short_rpdo_stands_in_the_profile_that_masters_read() {
    let told = |name| model(name).and_then(|model| model.pdo.short_rpdo).map(|code| code.0);
    assert_eq!(["zlac8030l", "zlim42c", "m4230e17b50"].map(told), [Some(0x8210), Some(0x8210), None]);
}

/// Bit 30 of a TPDO's COB-ID is 0: CiA 301, table 69 reads that as "RTR allowed". CiA says elsewhere (application note 802)
/// that remote frames should not be used, and these drives do not hear them.
fn ignores_remote_frames<S: Subject>() {
    let mut bench = operational::<S>();
    for number in 0..4 {
        let cob_id = bench.get((0x1800 + number, 1)) as u32;
        assert_eq!(cob_id >> 30 & 1, 0, "TPDO{number}");
        for raw in [252, 253] {
            assert_eq!(bench.write((0x1800 + number, 2), raw), Err(0x0609_0030), "TPDO{number}: type {raw}");
        }
    }
    bench.set(0x1017, 0).run_ms(50);
    bench.heard();
    // TPDO 1 to 4, node guarding, SDO, RPDO 1, EMCY; SYNC and NMT.
    for base in [0x180, 0x280, 0x380, 0x480, 0x700, 0x580, 0x600, 0x200, 0x080] {
        bench.send(&of::<S>(base, "R"));
    }
    bench.send("080#R").send("000#R").run_ms(200);
    assert_eq!(bench.heard(), [""; 0]);
    bench.reads(0x1001, 0);
}

#[test]
fn no_drive_answers_a_remote_frame_though_its_cob_ids_say_that_rtr_is_allowed() {
    ignores_remote_frames::<zlac8030l::Zlac8030l>();
    ignores_remote_frames::<zlim42c::Zlim42c>();
    ignores_remote_frames::<mjoint::MJoint>();
}
