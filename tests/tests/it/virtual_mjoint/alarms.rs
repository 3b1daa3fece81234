//! Alarms from physics, their resets, and the outputs that report them.

use drives::mjoint::Model;

use crate::virtual_mjoint::bench::{Bench, MODELS};

fn output(bench: &mut Bench, name: &str) -> bool {
    bench.report().outputs.iter().find(|(found, _)| *found == name).expect("an output").1
}

#[test]
fn a_rotor_that_stays_locked_at_the_current_limit_raises_12h_after_its_seconds() {
    let mut bench = Bench::new();
    bench.set(0x261D, 3002).turn(300).run_ms(300).world("1 rotor lock").run_ms(300);
    let current = bench.report().current_a;
    assert!((current - 3.0).abs() < 0.1, "3000 mA without the ones digit: {current}");
    bench.run_ms(1400).reads(0x260E, 0);
    bench.run_ms(500).reads(0x260E, 0x12).shows(0xFFFF, 0x002F);
    bench.world("1 rotor free").run_ms(200);
    assert!(bench.report().current_a.abs() < 0.05 && bench.report().velocity_rpm.abs() < 1.0, "free, and off");
    bench.set(0x6040, 0x0080).reads(0x260E, 0).shows(0xFFFF, 0x0404);
}

#[test]
fn a_time_of_0_never_raises_12h() {
    let mut bench = Bench::new();
    bench
        .set(0x261D, 2000)
        .set(0x2618, 600)
        .turn(300)
        .run_ms(300)
        .world("1 rotor lock")
        .run_ms(12_000)
        .reads(0x260E, 0);
}

#[test]
fn an_output_that_stays_at_its_limit_raises_14h_and_2601h_resets_it() {
    let mut bench = Bench::new();
    // 10 % of 36 V / sqrt 3 in 0.44 ohm are under 5 A of amplitude: the current's limit of 10 A is not reached.
    bench.set(0x2618, 101).turn(300).run_ms(300).world("1 rotor lock").run_ms(700).reads(0x260E, 0);
    bench.until(1500, |bench| bench.get(0x260E) == 0x14);
    bench.shows(0xFFFF, 0x002F);
    bench.world("1 rotor free").set(0x2601, 0);
    assert_eq!(bench.get(0x260E), 0x14, "0 alone resets nothing");
    bench.set(0x2601, 1).reads(0x260E, 0);
    bench.run_ms(300);
    assert!((bench.report().velocity_rpm - 300.0).abs() < 10.0, "0Fh still stands: it runs again");
}

#[test]
fn as_delivered_a_locked_output_gives_14h_and_one_that_is_too_heavy_12h() {
    // Interface 3: 12h and 14h are both there to be seen. Locked, the current stays under the 10 A of 261Dh.
    for model in MODELS {
        let mut bench = Bench::of(1, model);
        bench.turn(300).run_ms(300).world("1 rotor lock").run_ms(1000);
        assert!(bench.report().current_a < 0.95 * 10.0, "{}: {} A", model.name, bench.report().current_a);
        bench.until(6000, |bench| bench.get(0x260E) != 0);
        assert_eq!(bench.get(0x260E), 0x14, "{}", model.name);
    }
    // 10 A are about 100 N·m: 800 kg·m² take 20 s of them up to 1400 r/min.
    let mut bench = Bench::new();
    bench.world("1 load inertia 800").set(0x261D, 10_002).turn(1400);
    bench.until(8000, |bench| bench.get(0x260E) != 0);
    bench.reads(0x260E, 0x12);
}

#[test]
fn without_an_alarm_in_2618h_the_output_of_a_stalled_motor_is_halved_after_3_s_and_back_when_it_turns() {
    let mut bench = Bench::new();
    bench.set(0x2618, 160).turn(300).run_ms(300).world("1 rotor lock").run_ms(2500);
    let whole = bench.report().current_a;
    // The motor swings on the gear before it stands.
    bench.run_ms(1500);
    let halved = bench.report().current_a;
    assert!((halved / whole - 0.5).abs() < 0.02, "{whole} A, then {halved} A");
    bench.run_ms(5000).reads(0x260E, 0);
    bench.world("1 rotor free").run_ms(500).turns_about(300.0, 10.0);
    bench.world("1 rotor lock").run_ms(1000);
    assert!((bench.report().current_a / whole - 1.0).abs() < 0.03);
}

#[test]
fn the_amperes_of_261dh_and_6078h_are_r_m_s_or_amplitudes_as_the_table_is_read() {
    for (choice, amplitude) in [("rms", 2.0_f64.sqrt()), ("amplitude", 1.0)] {
        let mut bench = Bench::choosing("J047", choice);
        bench.set(0x261D, 3500).set(0x2618, 600).turn(300).run_ms(300).world("1 rotor lock").run_ms(1000);
        assert!((bench.get(0x6078) - 7000).abs() < 100, "{choice}: 6078h in 1/2000 A of 261Dh");
        // On a phase of 0.44 ohm, 2613h in shares of the bus between two wires: sqrt(3) times the phase's amplitude, less
        // where the vector lies between two wires' axes.
        let volts = bench.get(0x2613) as f64 / 32_767.0 * 36.0;
        let most = 3.0_f64.sqrt() * 0.45 * 3.5 * amplitude;
        assert!((0.85 * most..most * 1.02).contains(&volts), "{choice}: {volts} of {most} V");
    }
}

#[test]
fn over_52_v_raise_15h_which_goes_with_a_reset_below() {
    let mut bench = Bench::new();
    bench.world("1 supply 51.5").run_ms(500).turn(300).run_ms(300).reads(0x260E, 0);
    bench.world("1 supply 53").run_ms(500).reads(0x260E, 0x15).shows(0xFFFF, 0x002F);
    bench.set(0x6040, 0x008F);
    assert_eq!(bench.get(0x260E), 0x15, "its cause is still there");
    bench.world("1 supply 36").run_ms(100);
    bench.set(0x260E, 5);
    assert_eq!(bench.get(0x260E), 0x15, "only 0 clears");
    bench.set(0x260E, 0).reads(0x260E, 0);
}

#[test]
fn a_heavy_load_that_is_braked_hard_raises_the_voltage_over_its_limit() {
    let mut bench = Bench::of(1, &Model::M4230E17B50);
    // 17 J at the output, of which the gear leaves two thirds and the winding at 4 A most; the bus holds 2.4 J up to 52 V.
    bench.world("1 load inertia 4").set(0x261D, 4005).set(0x6083, 3000).set(0x6060, 3).set(0x60FF, 1400);
    bench.set(0x6040, 0x0F).run_ms(1500);
    bench.set(0x6083, 60_000).set(0x60FF, 0).run_ms(500);
    assert_eq!(bench.get(0x260E), 0x15, "no discharge module is fitted");
}

#[test]
fn a_lost_battery_raises_10h_the_motor_goes_on_and_a_new_origin_clears_it() {
    let mut bench = Bench::new();
    bench.turn(300).run_ms(300).world("1 battery off").run_ms(100).reads(0x260E, 0x10).shows(0xFFFF, 0x043F);
    bench.set(0x6040, 0x008F).set(0x6040, 0x000F);
    assert_eq!(bench.get(0x260E), 0x10, "no reset");
    bench.turns_about(300.0, 10.0);
    bench.world("1 battery on").set(0x60FF, 0).run_ms(300);
    bench.set(0x260A, 60_006).set(0x260A, 60_016).run_ms(1).reads(0x260E, 0).reads(0x260A, 32_768).is_at(0, 5);
}

#[test]
fn the_alarm_output_is_normally_open_and_an_odd_ones_digit_of_60fb_makes_it_normally_closed() {
    // 5.04, 60FBh:01: even is normally open, odd normally closed.
    for (kp, healthy) in [(3000, false), (3001, true)] {
        let mut bench = Bench::new();
        bench.set((0x60FB, 1), kp).run_ms(5);
        assert_eq!(output(&mut bench, "WR"), healthy, "{kp}: conducts while healthy");
        bench.world("1 battery off").run_ms(5);
        assert_eq!(output(&mut bench, "WR"), !healthy, "{kp}: conducts in an alarm");
    }
}

/// Lengths of the darknesses and lights of an output, ms, over some time.
fn blinks(bench: &mut Bench, name: &str, ms: u32) -> Vec<(bool, u32)> {
    let mut blinks = vec![(output(bench, name), 0)];
    for _ in 0..ms {
        let now = output(bench.run_ms(1), name);
        match blinks.last_mut() {
            Some((level, length)) if *level == now => *length += 1,
            _ => blinks.push((now, 1)),
        }
    }
    blinks
}

/// Interface 3: as many long flashes as the code has tens, as many short ones as it has ones.
#[test]
fn the_red_light_flashes_the_alarms_code_and_the_green_one_flickers_without_the_battery() {
    for (line, code) in [("battery off", 0x10), ("supply 53", 0x15), ("rotor lock", 0x12), ("rotor lock", 0x14)] {
        let mut bench = Bench::new();
        bench.set(0x261D, if code == 0x12 { 2001 } else { 7000 }).set(0x2618, if code == 0x14 { 101 } else { 600 });
        bench.turn(300).run_ms(1000);
        assert!(output(&mut bench, "GREEN") && !output(&mut bench, "RED"));
        bench.world(&format!("1 {line}")).until(3000, |bench| bench.get(0x260E) == code);
        let seen = blinks(&mut bench, "RED", 20_000);
        // Rounds begin after the longest darkness.
        let pause = seen[1..].iter().filter(|(lit, _)| !lit).map(|(_, length)| *length).max().expect("it flashes");
        let rounds: Vec<String> = seen
            .split(|(lit, length)| !lit && *length == pause)
            .map(|round| {
                round.iter().filter(|(lit, _)| *lit).map(|(_, ms)| if *ms > 500 { 'L' } else { 's' }).collect()
            })
            .collect();
        let expected = "L".repeat(code as usize >> 4) + &"s".repeat(code as usize & 0xF);
        assert!(rounds.len() >= 4, "{rounds:?}");
        assert!(rounds[1..rounds.len() - 1].iter().all(|round| *round == expected), "{code:X}h: {rounds:?}");
        // 10 Hz.
        let flickers = blinks(&mut bench, "GREEN", 2700).len();
        assert!(if code == 0x10 { (51..=57).contains(&flickers) } else { flickers == 1 }, "{flickers}");
    }
}

#[test]
fn green_flashes_while_the_battery_is_charged_and_the_drivers_temperature_is_shown() {
    let mut bench = Bench::open();
    // 4 mA charge a hundredth of a mA·h in 9 s.
    bench.machine().assembly_mut().motor_mut().encoder.battery.charge_mah -= 0.01;
    let changes = |bench: &mut Bench| {
        let mut green = Vec::new();
        for _ in 0..4000 {
            bench.run_ms(1);
            green.push(bench.report().outputs.iter().any(|(name, level)| name == "GREEN" && level));
        }
        green.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    bench.run_ms(1000);
    let charging = changes(&mut bench);
    assert!((3..=12).contains(&charging), "slowly, that a person sees: {charging} in 4 s");
    bench.run_ms(5000);
    assert_eq!(changes(&mut bench), 0, "full");
    bench.machine().assembly_mut().motor_mut().rig.heat_sink.hold_c = Some(61.6);
    bench.run_ms(20).reads(0x2612, 62);
}
