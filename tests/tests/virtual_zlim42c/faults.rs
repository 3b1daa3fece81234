//! Faults: code, register, EMCY, light, reset.

use ferrodrive_tests::zlim42c::figure;
use sim::Component;

use crate::bench::Bench;

/// A way to break something, and its code.
#[derive(Clone, Copy, Debug)]
enum Cause {
    OverVoltage,
    Broken(Component),
}

/// Cause, code, what the table of lights calls it, error register.
const CAUSES: [(Cause, u16, &str, u8); 4] = [
    (Cause::OverVoltage, 0xFF01, "over_voltage", 0x05),
    (Cause::Broken(Component::Phase), 0xFF04, "phase_loss", 0x81),
    (Cause::Broken(Component::Reference), 0xFF08, "internal_reference", 0x81),
    (Cause::Broken(Component::Eeprom), 0xFF10, "eeprom", 0x81),
];

fn set(bench: &mut Bench, cause: Cause, present: bool) {
    bench
        .operate(|drive, now| match cause {
            Cause::OverVoltage => drive.set_supply(if present { 42.0 } else { 24.0 }, now),
            Cause::Broken(component) => drive.set_fault(component, present, now),
        })
        .expect("the drive has it");
    bench.run_ms(100);
}

/// Enabled, and broken.
fn faulty(cause: Cause) -> Bench {
    let mut bench = Bench::open();
    bench.enable_in(3);
    bench.heard();
    set(&mut bench, cause, true);
    bench
}

#[test]
fn each_fault_frees_the_motor_and_is_told_by_603fh_1001h_and_emcy() {
    for (cause, code, _, register) in CAUSES {
        let mut bench = faulty(cause);
        assert_eq!(bench.statusword() & 0x20FF, 0x0098, "{cause:?}: bit 13 off");
        assert_eq!((bench.get(0x603F, 0), bench.get(0x1001, 0)), (i64::from(code), i64::from(register)), "{cause:?}");
        let [low, high] = code.to_le_bytes();
        let told: Vec<_> = bench.heard().into_iter().filter(|frame| frame.starts_with("081#")).collect();
        assert_eq!(told, [format!("081#{low:02X}{high:02X}{register:02X}0000000000")]);
        assert_eq!(bench.report().current_a, 0.0);
    }
}

#[test]
fn a_rising_bit_7_or_2011h_resets_a_fault_whose_cause_is_gone() {
    for (cause, ..) in CAUSES {
        for by_2011h in [false, true] {
            let mut bench = faulty(cause);
            let reset = |bench: &mut Bench| {
                if by_2011h {
                    bench.set(0x2011, 0, 1);
                    assert_eq!(bench.get(0x2011, 0), 0);
                } else {
                    bench.set(0x6040, 0, 0x00);
                    bench.set(0x6040, 0, 0x80);
                }
                bench.statusword() & 0xFF
            };
            // A free motor cannot tell whether its wire is back: that fault alone comes again only with the current.
            let unseen = matches!(cause, Cause::Broken(Component::Phase));
            assert_eq!(reset(&mut bench), if unseen { 0x70 } else { 0x98 }, "{cause:?} is still there");
            set(&mut bench, cause, false);
            assert_eq!(reset(&mut bench), 0x70, "{cause:?}");
            assert_eq!((bench.get(0x603F, 0), bench.get(0x1001, 0)), (0, 0));
            assert!(bench.heard().contains(&"081#0000000000000000".to_owned()));
        }
    }
}

#[test]
fn the_red_light_flashes_as_often_as_the_manual_counts() {
    for (cause, code, name, _) in CAUSES {
        if matches!(cause, Cause::Broken(Component::Eeprom)) {
            continue;
        }
        let mut bench = faulty(cause);
        // Two pauses and what lies between: count the flashes between two long dark times.
        let (mut flashes, mut counts, mut dark_ms, mut was_on) = (0, Vec::new(), 0, false);
        for _ in 0..8000 {
            bench.run_ms(1);
            let led = bench.machine().assembly().actuation().led;
            assert!(led.green);
            flashes += u32::from(led.red && !was_on);
            dark_ms = if led.red { 0 } else { dark_ms + 1 };
            if dark_ms == 800 {
                counts.push(std::mem::take(&mut flashes));
            }
            was_on = led.red;
        }
        let expected = figure("fault", &format!("{code:04X}"), name) as u32;
        assert!(counts.len() >= 3 && counts[1..].iter().all(|count| *count == expected), "{cause:?}: {counts:?}");
    }
}

#[test]
fn a_lost_phase_is_noticed_whichever_way_the_vector_points_once_it_moves() {
    // Half an electrical turn is 40 pulses; a vector across the lost phase needs no current there until it turns.
    for pulses in [20, 60] {
        let mut bench = Bench::new();
        bench.enable_in(1);
        bench.move_by(pulses);
        bench.run_ms(200);
        set(&mut bench, Cause::Broken(Component::Phase), true);
        assert_eq!(bench.get(0x603F, 0), 0, "{pulses}: the vector points across phase A");
        bench.set(0x6040, 0, 0x0F);
        bench.move_by(30);
        bench.run_ms(200);
        assert_eq!(bench.get(0x603F, 0), 0xFF04, "{pulses}");
    }
}

#[test]
fn a_broken_eeprom_keeps_the_old_values_and_a_mended_one_goes_on() {
    let mut bench = faulty(Cause::Broken(Component::Eeprom));
    bench.set(0x2005, 0, 5);
    bench.let_store();
    bench.power_cycle();
    assert_eq!(bench.get(0x2005, 0), 3);
    set(&mut bench, Cause::Broken(Component::Eeprom), false);
    bench.set(0x2011, 0, 1);
    bench.set(0x2005, 0, 5);
    bench.let_store();
    bench.power_cycle();
    assert_eq!(bench.get(0x2005, 0), 5);
}

#[test]
fn what_a_model_does_not_have_cannot_break() {
    let mut bench = Bench::new();
    for component in [Component::Hall, Component::Encoder] {
        assert!(bench.operate(|drive, now| drive.set_fault(component, true, now)).is_err());
    }
}
