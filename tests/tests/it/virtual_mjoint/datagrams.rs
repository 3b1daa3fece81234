//! Every datagram that the manual prints, in its order (5.06 to 5.11). Each chapter begins with a joint just switched on.

use can::{CanId, Frame};
use drives::mjoint::Model;
use ferrodrive_tests::mjoint::datagrams;

use crate::virtual_mjoint::bench::Bench;

#[test]
fn every_datagram_of_the_manual_is_answered_as_the_manual_prints_it() {
    let datagrams = datagrams();
    assert_eq!(datagrams.len(), 41);
    let mut bench = Bench::of(3, &Model::M4230E17B50);
    let mut section = String::new();
    for (n, datagram) in datagrams.iter().enumerate() {
        if datagram.section != section {
            section.clone_from(&datagram.section);
            bench = begin(&section);
        }
        let at = format!("datagram {}, section {section}, {}", n + 1, datagram.meaning);
        match &datagram.request {
            Some((0x080, _)) => sync(&mut bench, &at),
            Some((id, data)) => {
                // Whatever the datagram before has begun is over by then.
                bench.run_ms(1000);
                // 581 answers 601, and 181 answers 201.
                let answer = bench.ask(Frame::new(CanId::standard(*id), data), id - 0x080);
                let answer = answer.unwrap_or_else(|| panic!("{at}: no answer"));
                let agrees = answer.data().len() == datagram.answer.len()
                    && datagram.answer.iter().zip(answer.data()).all(|(known, byte)| known.is_none_or(|k| k == *byte));
                assert!(agrees, "{at}: answered {answer}, expected {:02X?}", datagram.answer);
                let printed = &datagram.response.as_ref().expect("a printed answer").1;
                compare_value(*id, answer.data(), printed, &at);
            }
            None => heartbeat(&mut bench, datagram.response.as_ref().expect("a heartbeat").1[0], &at),
        }
    }
}

/// What the manual takes for granted where a chapter begins.
fn begin(section: &str) -> Bench {
    let mut bench = Bench::of(3, &Model::M4230E17B50);
    match section {
        // A switch that is reached between the third and the fourth datagram: 100 r/min are 54613 counts/s.
        "5.09" => drop(bench.world_answer("1 switch DIR min -80000")),
        "5.10.3" => {
            for node in 1..=3 {
                bench.write_to(node, 0x6040, 0x0F).expect("enabled");
            }
        }
        _ => {}
    }
    bench
}

/// The values that the manual's own machine happened to show, where they follow from what was asked.
fn compare_value(id: u16, answer: &[u8], printed: &[u8], at: &str) {
    let number = |bytes: &[u8]| i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let reached = printed.ends_with(&[0x37, 0x04]);
    match id {
        0x301 if reached => assert!((number(answer) - number(printed)).abs() <= 30, "{at}: {}", number(answer)),
        0x401 => assert!((number(answer) - number(printed)).abs() <= 5, "{at}: {}", number(answer)),
        _ => {}
    }
}

/// All that waits for SYNC moves with it.
fn sync(bench: &mut Bench, at: &str) {
    let before: Vec<i64> = (1..=3).map(|node| bench.get_from(node, 0x6064)).collect();
    bench.send("080#").run_ms(1000);
    let moved: Vec<bool> = (1..=3).zip(before).map(|(node, before)| bench.get_from(node, 0x6064) != before).collect();
    // 5.08.4 prints the signal alone; nothing waits there.
    let waits = at.contains("5.10.3");
    assert_eq!(moved, [waits; 3], "{at}");
}

fn heartbeat(bench: &mut Bench, state: u8, at: &str) {
    if state == 0x04 {
        bench.world("1 battery off");
    }
    bench.run_ms(10);
    bench.forget().run_ms(1010);
    let expected = format!("701#{state:02X}");
    assert_eq!(bench.heard().iter().filter(|frame| **frame == expected).count(), 1, "{at}");
}
