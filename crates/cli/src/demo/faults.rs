//! Chapter 8: every fault code, provoked, seen in 603Fh, the statusword and the EMCY message, and cleared.

use std::time::Duration;

use super::bench::Bench;
use super::expect::Expect;
use super::functions::{clear_fault, velocity_mode};
use crate::plot::EventKind;

/// How a fault is provoked: what is done to the machine, and what undoes it.
struct Provocation {
    code: u16,
    name: &'static str,
    cause: &'static str,
    cure: &'static str,
    /// The motor is to turn against the cause: a target velocity is given.
    turning: bool,
    /// How long it may take until the drive notices.
    patience: Duration,
}

const SOON: Duration = Duration::from_millis(500);

#[rustfmt::skip]
const PROVOCATIONS: [Provocation; 9] = [
    Provocation { code: 0x0001, name: "over-voltage", cause: "supply 85", cure: "supply 48", turning: false, patience: SOON },
    Provocation { code: 0x0002, name: "under-voltage", cause: "supply 12", cure: "supply 48", turning: false, patience: SOON },
    // Blocked at full torque: the overload time of 2016h = 3 s, and some.
    Provocation { code: 0x0008, name: "overload", cause: "rotor lock", cure: "rotor free", turning: true, patience: Duration::from_secs(30) },
    Provocation { code: 0x0080, name: "reference voltage", cause: "fault reference on", cure: "fault reference off", turning: false, patience: SOON },
    Provocation { code: 0x0100, name: "EEPROM", cause: "fault eeprom on", cure: "fault eeprom off", turning: false, patience: SOON },
    Provocation { code: 0x0200, name: "Hall", cause: "fault hall on", cure: "fault hall off", turning: false, patience: SOON },
    // 2013h as delivered: 80.0 °C.
    Provocation { code: 0x0400, name: "motor temperature", cause: "temperature motor 85", cure: "temperature motor auto", turning: false, patience: SOON },
    Provocation { code: 0x0800, name: "driver temperature", cause: "temperature driver 85", cure: "temperature driver auto", turning: false, patience: SOON },
    Provocation { code: 0x1000, name: "encoder", cause: "fault encoder on", cure: "fault encoder off", turning: true, patience: SOON },
];

/// Chapter 8, fault by fault.
pub(super) fn all(bench: &mut Bench) {
    bench.section("8", "fault codes");
    for provocation in &PROVOCATIONS {
        provoke(bench, provocation);
    }
}

fn provoke(bench: &mut Bench, fault: &Provocation) {
    velocity_mode(bench);
    if fault.turning {
        bench.ask("target 50 r/min", "23 FF 60 00 32 00 00 00", "60 FF 60 00 00 00 00 00");
    }
    let begin = bench.now();
    bench.step(format!("{} ({})", fault.name, fault.cause));
    bench.machine(fault.cause);
    // The EEPROM is noticed when it is used.
    if fault.code == 0x0100 {
        bench.read(0x2009, 0);
        bench.ask_more("2B 09 20 00 02 00 00 00", "60 09 20 00 00 00 00 00");
    }
    bench.run_until(fault.patience, |word| word & 0x08 != 0);
    bench.mark(fault.name, EventKind::Fault);
    bench.run(Duration::from_millis(20));
    let code = bench.read_f64(0x603F, 0);
    bench.expect("603Fh", Expect::Bits(fault.code.into()), "", code);
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3", Expect::Bits(0x8), "", f64::from(word & 0xF));
    let emcy = bench.heard_since(begin, 0x84);
    let seen = emcy
        .first()
        .map_or(f64::NAN, |(_, frame)| f64::from(u16::from_le_bytes([frame.padded()[0], frame.padded()[1]])));
    bench.expect("EMCY", Expect::Bits(fault.code.into()), "", seen);
    bench.machine(fault.cure);
    bench.run(Duration::from_millis(200));
    clear_fault(bench);
}
