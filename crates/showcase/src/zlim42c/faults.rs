//! 3.4 and 603Fh: every fault, provoked, seen in 603Fh, 1001h, the statusword, the EMCY message and the red light, and
//! reset both ways.

use super::steps::enable_in;
use crate::bench::Bench;
use crate::expect::Expect;
use crate::lights::red_flashes;
use plot::EventKind;

/// 1014h: 80h + node-ID.
const EMCY: u16 = 0x81;

/// A fault and how it is provoked.
struct Fault {
    code: u16,
    name: &'static str,
    /// What is done to the machine.
    cause: &'static str,
    /// What undoes it.
    cure: &'static str,
    /// 1001h (CiA 301: generic, current, voltage, maker's).
    register: u8,
    /// Flashes of the red light (3.4), where they are printed.
    flashes: Option<usize>,
}

#[rustfmt::skip]
const FAULTS: [Fault; 6] = [
    // "Over-voltage protection 40 VDC" (2.1).
    Fault { code: 0xFF01, name: "over-voltage", cause: "supply 42", cure: "supply 24", register: 0x05, flashes: Some(1) },
    // "Phases shorted", and "the supply's current is too large" (3.4).
    Fault { code: 0xFF02, name: "over-current", cause: "fault short on", cure: "fault short off", register: 0x03, flashes: Some(2) },
    Fault { code: 0xFF02, name: "bus current", cause: "fault bridge on", cure: "fault bridge off", register: 0x03, flashes: Some(5) },
    Fault { code: 0xFF04, name: "phase loss", cause: "fault phase on", cure: "fault phase off", register: 0x81, flashes: Some(3) },
    Fault { code: 0xFF08, name: "reference", cause: "fault reference on", cure: "fault reference off", register: 0x81, flashes: Some(4) },
    Fault { code: 0xFF10, name: "EEPROM", cause: "fault eeprom on", cure: "fault eeprom off", register: 0x81, flashes: None },
];

/// 603Fh, fault by fault, reset by bit 7 and by 2011h; the light in the first round.
pub(super) fn all(bench: &mut Bench) {
    bench.section("603Fh", "faults");
    for fault in &FAULTS {
        provoke(bench, fault, true);
        reset(bench, fault, false);
    }
    for fault in &FAULTS {
        provoke(bench, fault, false);
        reset(bench, fault, true);
    }
}

fn provoke(bench: &mut Bench, fault: &Fault, watch_light: bool) {
    bench.write("target speed 0", 0x60FF, 0, 0);
    enable_in(bench, 3);
    let begin = bench.now();
    bench.write("target speed 30 r/min", 0x60FF, 0, 30);
    bench.run_ms(100);
    bench.step(format!("{}: {}", fault.name, fault.cause));
    bench.machine(fault.cause);
    bench.run_ms(200);
    bench.expect_object(0x603F, 0, Expect::Bits(fault.code.into()), "");
    bench.expect_object(0x1001, 0, Expect::Bits(fault.register.into()), "");
    // Bits 3 and 7, and bit 13 for a free motor.
    bench.expect_status("6041h bits 0-3, 7, 13", 0x208F, 0x0088);
    expect_emcy(bench, begin, fault.code);
    if watch_light {
        bench.mark(fault.name, EventKind::Fault);
        if let Some(flashes) = fault.flashes {
            let seen = red_flashes(bench).len();
            bench.expect("red flashes", Expect::Near(flashes as f64, 0.0), "", seen as f64);
        }
    }
}

fn reset(bench: &mut Bench, fault: &Fault, by_2011h: bool) {
    bench.machine(fault.cure);
    bench.run_ms(300);
    bench.write("controlword 00h", 0x6040, 0, 0);
    let begin = bench.now();
    if by_2011h {
        bench.write("fault reset (2011h = 1)", 0x2011, 0, 1);
    } else {
        bench.ask("fault reset (bit 7)", "2B 40 60 00 80 00 00 00", "60 40 60 00 00 00 00 00");
    }
    bench.run_ms(20);
    bench.expect_object(0x603F, 0, Expect::Bits(0), "");
    bench.expect_status("switch on disabled", 0x4F, 0x40);
    expect_emcy(bench, begin, 0);
}

fn expect_emcy(bench: &mut Bench, begin: can::Instant, code: u16) {
    let emcy = bench.heard_since(begin, EMCY).first().map(|(_, frame)| *frame.padded());
    let seen = emcy.map_or(f64::NAN, |data| f64::from(u16::from_le_bytes([data[0], data[1]])));
    bench.expect("EMCY", Expect::Bits(code.into()), "", seen);
}
