//! Every datagram that the manual prints, sent to one drive in the manual's order (5.3).

use ferrodrive_tests::zlim42c::datagrams;

use crate::virtual_zlim42c::bench::Bench;

#[test]
fn every_datagram_of_the_manual_is_answered_as_the_manual_prints_it() {
    let datagrams = datagrams();
    assert_eq!(datagrams.len(), 37);
    let mut bench = Bench::new();
    for (n, datagram) in datagrams.iter().enumerate() {
        let at = format!("datagram {}, section {}, {}", n + 1, datagram.section, datagram.meaning);
        match &datagram.request {
            Some((0x000, command)) => {
                let command: String = command.iter().map(|byte| format!("{byte:02X}")).collect();
                bench.send(&format!("000#{command}"));
            }
            Some((0x601, request)) => {
                let answer = bench.sdo(request).unwrap_or_else(|| panic!("{at}: no answer"));
                let expected: Vec<u8> = datagram.answer.iter().map(|byte| byte.expect("no byte is open")).collect();
                assert_eq!(answer[..], expected[..], "{at}");
            }
            other => panic!("{at}: unknown step {other:X?}"),
        }
        bench.run_ms(2);
    }
}

#[test]
fn the_example_of_the_position_mode_turns_0_8_of_a_turn() {
    // 5.3.4: 3200 pulses at 60 r/min with 4000 pulses a turn; 6041h as the tables of 5.3.2 and 5.3.4 have it.
    let mut bench = Bench::new();
    for datagram in datagrams().iter().filter(|datagram| datagram.section == "5.3.4") {
        if let Some((0x601, request)) = &datagram.request {
            bench.sdo(request).expect("an answer");
            bench.run_ms(2);
        }
    }
    bench.run_ms(1500);
    let report = bench.report();
    assert_eq!((report.position, report.rotor_position), (3200, Some(3200)));
    let turns = report.shaft_angle_rad / std::f64::consts::TAU;
    assert!((turns - 0.8).abs() < 1e-3, "{turns}");
    // Reached, bit 4 mirrored, acknowledged while bit 4 is up, energised, in position.
    bench.shows(0xFFFF, 0xBE37);
}
