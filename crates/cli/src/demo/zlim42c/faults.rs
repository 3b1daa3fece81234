//! 3.4 and 603Fh: every fault, provoked, seen in 603Fh, 1001h, the statusword and the EMCY message, and reset both ways.

use super::enable_in;
use crate::demo::bench::Bench;
use crate::demo::expect::Expect;
use crate::plot::EventKind;

/// 1014h: 80h + node-ID.
const EMCY: u16 = 0x81;

/// Code, name, what is done to the machine and what undoes it, error register (CiA 301, 1001h: generic, current,
/// voltage, maker's).
#[rustfmt::skip]
const FAULTS: [(u16, &str, &str, &str, u8); 6] = [
    // "Over-voltage protection 40 VDC" (2.1).
    (0xFF01, "over-voltage", "supply 42", "supply 24", 0x05),
    // "Phases shorted", and "the supply's current is too large" (3.4).
    (0xFF02, "over-current", "fault short on", "fault short off", 0x03),
    (0xFF02, "bus current", "fault bridge on", "fault bridge off", 0x03),
    (0xFF04, "phase loss", "fault phase on", "fault phase off", 0x81),
    (0xFF08, "reference", "fault reference on", "fault reference off", 0x81),
    (0xFF10, "EEPROM", "fault eeprom on", "fault eeprom off", 0x81),
];

/// 603Fh, fault by fault, reset by bit 7 and by 2011h.
pub(super) fn all(bench: &mut Bench) {
    bench.section("603Fh", "faults");
    for by_2011h in [false, true] {
        for (code, name, cause, cure, register) in FAULTS {
            bench.write("target speed 0", 0x60FF, 0, 0);
            enable_in(bench, 3);
            let begin = bench.now();
            bench.write("target speed 30 r/min", 0x60FF, 0, 30);
            bench.run_ms(100);
            bench.step(format!("{name}: {cause}"));
            bench.machine(cause);
            bench.run_ms(200);
            if !by_2011h {
                bench.mark(name, EventKind::Fault);
            }
            bench.expect_object(0x603F, 0, Expect::Bits(code.into()), "");
            bench.expect_object(0x1001, 0, Expect::Bits(register.into()), "");
            // Bits 3 and 7, and bit 13 for a free motor.
            bench.expect_status("6041h bits 0-3, 7, 13", 0x208F, 0x0088);
            expect_emcy(bench, begin, code);
            bench.machine(cure);
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
    }
}

fn expect_emcy(bench: &mut Bench, begin: can::Instant, code: u16) {
    let emcy = bench.heard_since(begin, EMCY).first().map(|(_, frame)| *frame.padded());
    let seen = emcy.map_or(f64::NAN, |data| f64::from(u16::from_le_bytes([data[0], data[1]])));
    bench.expect("EMCY", Expect::Bits(code.into()), "", seen);
}
