//! Where the two ZL drives look alike and are not: what a host may fall over, and what their descriptions say of it.
//!
//! `docs/drives/zlac8030l.md` and `docs/drives/zlim42c.md` have the readings. That the running drives are so is asked row by
//! row (`refused.csv`, the object tables) and in `every_drive`. What the master and the command line do about a node whose
//! model is not known stands with their own tests.

use devices::{AxisDescription, CountsPerTurn, Description, Scale, all, model};
use ferrodrive_tests::bench::{zlac8030l, zlim42c};

fn profiles() -> [&'static Description; 2] {
    ["zlac8030l", "zlim42c"].map(|name| model(name).expect("a model"))
}

fn axes() -> [&'static AxisDescription; 2] {
    profiles().map(|profile| profile.first_axis().expect("an axis"))
}

#[test]
fn both_zl_drives_say_the_same_identity_and_their_descriptions_state_it() {
    let (mut servo, mut stepper) = (zlac8030l::Bench::new(), zlim42c::Bench::new());
    for (object, expected) in [((0x1018, 1), 0x100), ((0x1018, 2), 1), ((0x1018, 3), 0), ((0x1000, 0), 0x0004_0192)] {
        servo.reads(object, expected);
        stepper.reads(object, expected);
    }
    for profile in profiles() {
        assert!(profile.departures(all()).any(|departure| departure.key() == "identity_shared"), "{}", profile.name);
    }
}

#[test]
fn the_save_bytes_of_the_zlac8030l_set_250_kbit_s_on_the_zlim42_c_and_those_of_the_zlim42_c_are_refused_by_the_zlac8030l()
 {
    let save_of_the_servo = [0x2B, 0x09, 0x20, 0x00, 0x02, 0x00, 0x00, 0x00];
    let done = [0x60, 0x09, 0x20, 0x00, 0, 0, 0, 0];
    let (mut servo, mut stepper) = (zlac8030l::Bench::new(), zlim42c::Bench::new());
    servo.answers(save_of_the_servo, done).reads(0x2009, 0);
    // Nothing warns. Here it is the bit rate (5.4), and 200Ch = 0 stores it.
    stepper.answers(save_of_the_servo, done).reads(0x2009, 2).let_store().power_cycle();
    assert_eq!(stepper.operate(|drive, _| drive.bitrate()), Some(can::Bitrate::K250));
    stepper.is_silent();
    // 2010h = 2 saves a stepper; a servo has there whether writes are stored.
    assert!(servo.write(0x2010, 2).is_err());
    let saves = profiles().map(|profile| profile.storage.save.expect("a store"));
    let saves = saves.map(|save| (save.object.to_string(), save.value));
    assert_eq!(saves, [("2009h:00".to_owned(), 2), ("2010h:00".to_owned(), 2)]);
}

#[test]
fn the_units_of_speed_and_position_are_the_drives_own() {
    let scales = axes().map(|axis| axis.units.actual_velocity.map(|velocity| velocity.scale));
    assert_eq!(scales, [Some(Scale::Shaft(0.1)), Some(Scale::Shaft(1.0))]);
    let [servo, stepper] = axes().map(|axis| axis.units.counts_per_turn);
    assert!(!matches!(servo, CountsPerTurn::Table { .. }) && matches!(stepper, CountsPerTurn::Table { .. }));
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
