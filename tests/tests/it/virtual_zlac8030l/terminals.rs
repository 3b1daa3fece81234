//! Inputs, outputs and what is read of the motor (2003h, 2004h, 2027h, 2028h, 2030h), and several faults at once.

use sim::Component;

use crate::virtual_zlac8030l::bench::Bench;

fn break_hall(bench: &mut Bench, broken: bool) {
    bench.set_fault(Component::Hall, broken).run_ms(50);
}

/// The maker's hardware manual V1.00: a level has to last for more than 10 ms (docs/drives/zlac8030l.md, L040).
#[test]
fn a_pulse_of_10_ms_at_an_input_is_not_seen_and_one_of_11_ms_is() {
    for (ms, seen) in [(1, 0), (10, 0), (11, 1)] {
        let mut bench = Bench::new();
        bench.set_input(0, true).run_ms(ms);
        let shown = bench.operate(|drive, now| {
            drive.set_input(0, false, now).expect("there is X0");
            drive.report().statusword.expect("it has power")
        });
        assert_eq!(shown >> 15, seen, "{ms} ms");
        bench.run_ms(2);
        assert_eq!(bench.get(0x2003), i64::from(seen), "{ms} ms, as long again as it was on");
    }
}

#[test]
fn the_hall_sensors_pass_their_six_states_in_one_electrical_turn_and_read_0_or_7_when_broken() {
    let mut bench = Bench::new();
    bench.enable_in(3).set(0x60FF, 10).run_ms(1000);
    // 10 r/min and 15 pole pairs: an electrical turn takes 0.4 s, a state 67 ms.
    let mut states = Vec::new();
    for _ in 0..80 {
        bench.run_ms(5);
        let state = bench.get(0x2028);
        if states.last() != Some(&state) {
            states.push(state);
        }
    }
    let mut seen = states.clone();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen, [1, 2, 3, 4, 5, 6]);
    assert!((6..=8).contains(&states.len()), "{states:?}");
    for pair in states.windows(2) {
        assert_eq!((pair[0] ^ pair[1]).count_ones(), 1, "one sensor changes at a time: {states:?}");
    }
    break_hall(&mut bench, true);
    assert!([0, 7].contains(&bench.get(0x2028)));
}

#[test]
fn two_faults_show_together_and_the_last_one_to_go_ends_the_fault() {
    let mut bench = Bench::new();
    bench.forget();
    break_hall(&mut bench, true);
    bench.set_fault(Component::Reference, true).run_ms(50).reads(0x603F, 0x0280).reads(0x1001, 0x81);
    break_hall(&mut bench, false);
    bench.set(0x6040, 0x80).reads(0x603F, 0x0080).shows(0xFF, 0x98);
    bench.set_fault(Component::Reference, false).run_ms(50);
    bench.set(0x6040, 0x00).set(0x6040, 0x80).reads(0x603F, 0).shows(0xFF, 0x70);
    let heard: Vec<_> = bench.heard().into_iter().filter(|frame| frame.starts_with("084#")).collect();
    assert_eq!(heard, ["084#0002810000000000", "084#8000810000000000", "084#0000000000000000"]);
}

#[test]
fn the_in_place_threshold_of_2002h_decides_on_bits_10_and_13() {
    for (threshold, in_place) in [(2, false), (200, true)] {
        let mut bench = Bench::new();
        bench.set(0x2002, threshold).enable_in(1).run_ms(100);
        // A push that the position loop gives way to by some tens of counts at first.
        bench.set_load_torque(3.0).run_ms(40);
        let statusword = bench.statusword();
        let off = bench.report().position.abs();
        assert!((3..200).contains(&off), "{off} counts off");
        assert_eq!(statusword & 0x2400, if in_place { 0x2400 } else { 0 }, "{statusword:04X}h");
    }
}
