//! LSS 51 to 57: layer setting services (CiA 305) of a device that has a node-ID. CiA's tool has no cases for them.
//!
//! The device is selected by its own four numbers, so that others on the bus stay out of it. Node-ID and bit rate stay.

use can::Frame;
use canopen::connection_set::{LSS_MASTER, LSS_SLAVE};
use canopen::{Mux, NmtCommand};

use crate::bench::{Bench, SILENCE, hex, ms, silent};
use crate::case::{Case, Need, case};
use crate::finding::{Finding, Verdict, fail, not_applicable};

#[rustfmt::skip]
pub(crate) const CASES: &[Case] = &[
    case!("LSS 51", "Selected by its four numbers, and by no others", "CiA 305, 6.2.2", [Need::Lss], [], selected),
    case!("LSS 52", "Inquiry of the four numbers", "CiA 305, 6.4.1", [Need::Lss], [], inquired),
    case!("LSS 53", "Inquiry of the node-ID", "CiA 305, 6.4.2", [Need::Lss], [], inquired_node_id),
    case!("LSS 54", "Refuse node-ID 0 and 128", "CiA 305, 6.3.1", [Need::Lss], [], refused_node_ids),
    case!("LSS 55", "Refuse an unknown bit rate", "CiA 305, 6.3.2", [Need::Lss], [], refused_bit_rate),
    case!("LSS 56", "Identify within bounds, and not outside", "CiA 305, 6.5.1", [Need::Lss], [], identified),
    case!("LSS 57", "Nothing is answered in the waiting state", "CiA 305, 5.2", [Need::Lss], [], waiting),
];

/// Four numbers of 1018h; one that is not there counts as 0.
async fn address(bench: &mut Bench) -> Result<[u32; 4], Finding> {
    let mut numbers = [0; 4];
    for (number, sub_index) in numbers.iter_mut().zip(1..) {
        if bench.subject.row(0x1018, sub_index).is_some() {
            *number = bench.number(Mux::new(0x1018, sub_index)).await? as u32;
        }
    }
    Ok(numbers)
}

async fn ask(bench: &mut Bench, command: u8, rest: [u8; 7]) -> Option<[u8; 8]> {
    let [a, b, c, d, e, f, g] = rest;
    bench.watch(LSS_SLAVE);
    bench.absorb();
    bench.send(Frame::full(LSS_MASTER, [command, a, b, c, d, e, f, g]));
    let heard = bench.wait_for(SILENCE, |frame| frame.id() == LSS_SLAVE).await;
    heard.map(|passed| *passed.frame.padded())
}

/// Switch state global to waiting: the state in which each case begins and ends.
async fn wait(bench: &mut Bench) {
    bench.send(Frame::full(LSS_MASTER, [0x04, 0, 0, 0, 0, 0, 0, 0]));
    bench.pause(ms(20)).await;
}

async fn select(bench: &mut Bench, numbers: [u32; 4]) -> Option<[u8; 8]> {
    let mut last = None;
    for (command, number) in (0x40..).zip(numbers) {
        let [a, b, c, d] = number.to_le_bytes();
        last = ask(bench, command, [a, b, c, d, 0, 0, 0]).await;
    }
    last
}

/// In the configuration state.
async fn configured(bench: &mut Bench) -> Result<[u32; 4], Finding> {
    bench.nmt(NmtCommand::EnterPreOperational).await;
    wait(bench).await;
    let numbers = address(bench).await?;
    match select(bench, numbers).await {
        Some([0x44, ..]) => Ok(numbers),
        Some(other) => fail!("the fourth number is answered with {}", hex(&other)),
        None => silent("the answer to the fourth number of the address", SILENCE),
    }
}

async fn selected(bench: &mut Bench) -> Verdict {
    let numbers = configured(bench).await?;
    wait(bench).await;
    for place in 0..4 {
        let mut other = numbers;
        other[place] ^= 1;
        if let Some(answer) = select(bench, other).await {
            fail!("selected with another number {}: {}", place + 1, hex(&answer));
        }
        wait(bench).await;
    }
    Ok("by its own numbers only".into())
}

async fn inquired(bench: &mut Bench) -> Verdict {
    let numbers = configured(bench).await?;
    let mut judged = Ok("the numbers of 1018h".to_owned());
    for (command, number) in (0x5A..=0x5D).zip(numbers) {
        let answer = ask(bench, command, [0; 7]).await;
        let [a, b, c, d] = number.to_le_bytes();
        if answer.is_none_or(|answer| answer[..5] != [command, a, b, c, d]) {
            let answer = answer.map_or("nothing".to_owned(), |answer| hex(&answer));
            judged = Err(Finding::Fail(format!(
                "the inquiry {command:02X}h is answered with {answer}; expected {number:08X}h"
            )));
            break;
        }
    }
    wait(bench).await;
    judged
}

async fn inquired_node_id(bench: &mut Bench) -> Verdict {
    configured(bench).await?;
    let answer = ask(bench, 0x5E, [0; 7]).await;
    wait(bench).await;
    match answer {
        Some([0x5E, node, ..]) if node == bench.node().raw() => Ok(format!("{node}")),
        Some(other) => fail!("the inquiry of the node-ID is answered with {}", hex(&other)),
        None => silent("the answer to the inquiry of the node-ID", SILENCE),
    }
}

async fn refused_node_ids(bench: &mut Bench) -> Verdict {
    configured(bench).await?;
    let mut judged = Ok("error code 1".to_owned());
    for node in [0, 128] {
        match ask(bench, 0x11, [node, 0, 0, 0, 0, 0, 0]).await {
            Some([0x11, 1 | 0xFF, ..]) => {}
            Some(other) => judged = Err(Finding::Fail(format!("node-ID {node} is answered with {}", hex(&other)))),
            None => judged = silent(&format!("the answer to node-ID {node}"), SILENCE),
        }
    }
    // Whatever it took: the node-ID that it has.
    let node = bench.node().raw();
    ask(bench, 0x11, [node, 0, 0, 0, 0, 0, 0]).await;
    wait(bench).await;
    judged
}

async fn refused_bit_rate(bench: &mut Bench) -> Verdict {
    configured(bench).await?;
    // Table 0 has no entry 5.
    let answer = ask(bench, 0x13, [0, 5, 0, 0, 0, 0, 0]).await;
    wait(bench).await;
    match answer {
        Some([0x13, 1 | 0xFF, ..]) => Ok("error code 1".into()),
        Some(other) => fail!("bit rate 5 of table 0 is answered with {}", hex(&other)),
        None => silent("the answer to bit rate 5 of table 0", SILENCE),
    }
}

async fn identified(bench: &mut Bench) -> Verdict {
    wait(bench).await;
    let numbers = address(bench).await?;
    let [vendor, product, revision, serial] = numbers;
    let inside = [vendor, product, revision, revision, serial, serial];
    let outside = [vendor, product ^ 1, revision, revision, serial, serial];
    for (bounds, expected) in [(inside, true), (outside, false)] {
        let mut answer = None;
        for (command, number) in (0x46..).zip(bounds) {
            let [a, b, c, d] = number.to_le_bytes();
            answer = ask(bench, command, [a, b, c, d, 0, 0, 0]).await;
        }
        match (matches!(answer, Some([0x4F, ..])), expected) {
            (false, true) => not_applicable!("the device does not answer the identification of remote slaves"),
            (true, false) => fail!("another product code is answered"),
            _ => {}
        }
    }
    Ok("its own numbers are answered, another product code is not".into())
}

async fn waiting(bench: &mut Bench) -> Verdict {
    wait(bench).await;
    for command in [0x11, 0x13, 0x17, 0x5A, 0x5E] {
        if let Some(answer) = ask(bench, command, [0; 7]).await {
            fail!("{command:02X}h is answered in the waiting state: {}", hex(&answer));
        }
    }
    Ok("five requests, no answer".into())
}
