//! Where the two ZL drives look alike and are not: each trap that a host can fall into, on the running drives.
//!
//! `docs/drives/zlac8030l.md` and `docs/drives/zlim42c.md` have the readings. What the master and the command line do about
//! a node whose model is not known stands with their own tests.

use std::time::Duration;

use devices::{AxisDescription, CountsPerTurn, Description, Scale, all, model};
use ferrodrive_tests::bench::{zlac8030l, zlim42c};

type Servo = zlac8030l::Bench;
type Stepper = zlim42c::Bench;

const INVALID_VALUE: u32 = 0x0609_0030;
const NO_SUCH_OBJECT: u32 = 0x0602_0000;

fn profiles() -> [&'static Description; 2] {
    ["zlac8030l", "zlim42c"].map(|name| model(name).expect("a model"))
}

fn axes() -> [&'static AxisDescription; 2] {
    profiles().map(|profile| profile.first_axis().expect("an axis"))
}

#[test]
fn both_zl_drives_say_the_same_identity_and_only_their_objects_tell_them_apart() {
    let (mut servo, mut stepper) = (Servo::new(), Stepper::new());
    for (sub, expected) in [(0, 3), (1, 0x100), (2, 1), (3, 0)] {
        assert_eq!((servo.get((0x1018, sub)), stepper.get((0x1018, sub))), (expected, expected), "1018h:{sub:02X}");
    }
    assert_eq!((servo.get(0x1000), stepper.get(0x1000)), (0x0004_0192, 0x0004_0192));
    // The bus voltage: 2029h in 0.01 V, 2069h in 1 V.
    assert_eq!((servo.get(0x2029), stepper.read(0x2029)), (4800, Err(NO_SUCH_OBJECT)));
    assert_eq!((servo.read(0x2069), stepper.get(0x2069)), (Err(NO_SUCH_OBJECT), 24));
    for profile in profiles() {
        assert!(profile.departures(all()).any(|departure| departure.key() == "identity_shared"), "{}", profile.name);
    }
}

#[test]
fn the_save_bytes_of_the_zlac8030l_set_250_kbit_s_on_the_zlim42_c_and_those_of_the_zlim42_c_are_refused_by_the_zlac8030l()
 {
    let save_of_the_servo = [0x2B, 0x09, 0x20, 0x00, 0x02, 0x00, 0x00, 0x00];
    let done = Some([0x60, 0x09, 0x20, 0x00, 0, 0, 0, 0]);
    let (mut servo, mut stepper) = (Servo::new(), Stepper::new());
    assert_eq!((servo.sdo(&save_of_the_servo), stepper.sdo(&save_of_the_servo)), (done, done), "nothing warns");
    assert_eq!((servo.get(0x2009), stepper.get(0x2009)), (0, 2));
    stepper.let_store().power_cycle();
    let rate = stepper.operate(|drive, _| drive.bitrate()).expect("it has power");
    assert_eq!(rate.bits_per_second(), 250_000);
    assert_eq!(stepper.sdo(&[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]), None, "lost to a bus of 500 kbit/s");
    // 2010h = 2 saves a stepper; a servo has there whether writes are stored.
    assert!(servo.write(0x2010, 2).is_err());
    let saves = profiles().map(|profile| profile.storage.save.expect("a store"));
    let saves = saves.map(|save| (save.object.to_string(), save.value));
    assert_eq!(saves, [("2009h:00".to_owned(), 2), ("2010h:00".to_owned(), 2)]);
}

#[test]
fn object_606ch_counts_0_1_r_min_on_the_zlac8030l_and_1_r_min_on_the_zlim42_c() {
    let (mut servo, mut stepper) = (Servo::new(), Stepper::new());
    servo.enable_in(3);
    stepper.enable_in(3);
    servo.set(0x60FF, 60);
    stepper.set(0x60FF, 60);
    servo.run(Duration::from_secs(3));
    stepper.run(Duration::from_secs(3));
    let (tenths, whole) = (servo.get(0x606C), stepper.get(0x606C));
    assert!((590..=610).contains(&tenths) && whole == 60, "{tenths} and {whole} for 60 r/min");
    let scales = axes().map(|axis| axis.units.actual_velocity.map(|velocity| velocity.scale));
    assert_eq!(scales, [Some(Scale::PerCount(0.1)), Some(Scale::PerCount(1.0))]);
}

#[test]
fn torque_mode_is_4_and_6_is_homing_where_there_is_one() {
    let (mut servo, mut stepper) = (Servo::new(), Stepper::new());
    assert_eq!((servo.write(0x6060, 4), servo.write(0x6060, 6)), (Ok(()), Err(INVALID_VALUE)));
    assert_eq!((stepper.write(0x6060, 4), stepper.write(0x6060, 6)), (Err(INVALID_VALUE), Ok(())));
    servo.run_ms(5);
    stepper.run_ms(5);
    assert_eq!((servo.get(0x6061), stepper.get(0x6061)), (4, 6));
    assert_eq!(stepper.read(0x6071), Err(NO_SUCH_OBJECT), "no torque to be commanded");
}

#[test]
fn velocity_mode_is_3_and_2_is_refused_whatever_5_3_3_of_the_zlim42_c_prints() {
    let (mut servo, mut stepper) = (Servo::new(), Stepper::new());
    assert_eq!((servo.write(0x6060, 2), stepper.write(0x6060, 2)), (Err(INVALID_VALUE), Err(INVALID_VALUE)));
    assert_eq!((servo.write(0x6060, 3), stepper.write(0x6060, 3)), (Ok(()), Ok(())));
    servo.run_ms(5);
    stepper.run_ms(5);
    assert_eq!((servo.get(0x6061), stepper.get(0x6061)), (3, 3));
}

#[test]
fn the_numbers_that_both_have_among_2000h_to_2012h_mean_other_things() {
    // Watchdog and node, direction and motor state, clearing and current, start speed and node, save and bit rate, storing
    // of writes and save, Hall offset and fault reset, overload and clearing.
    let [servo, stepper] = profiles();
    for index in [0x2000, 0x2001, 0x2005, 0x2008, 0x2009, 0x2010, 0x2011, 0x2012] {
        let row = |profile: &Description| {
            let slot = profile.dictionary.find(canopen::Mux::new(index, 0)).unwrap_or_else(|_| panic!("{index:04X}h"));
            profile.dictionary.row(slot).name
        };
        assert_ne!(row(servo), row(stepper), "{index:04X}h");
    }
}

#[test]
fn a_turn_has_4096_counts_on_the_zlac8030l_and_what_2006h_says_on_the_zlim42_c() {
    let [servo, stepper] = axes().map(|axis| axis.units.counts_per_turn);
    assert!(!matches!(servo, CountsPerTurn::Table { .. }) && matches!(stepper, CountsPerTurn::Table { .. }));
    let mut bench = Stepper::new();
    // 2006h = 4 is 3200 pulses a turn.
    bench.set(0x2006, 4).enable_in(1).move_by(3200).run_ms(1500);
    let turns = bench.report().shaft_angle_rad / std::f64::consts::TAU;
    assert!((turns - 1.0).abs() < 1e-3, "{turns}");
}
