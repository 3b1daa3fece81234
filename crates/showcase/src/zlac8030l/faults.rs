//! Chapter 8: every fault code, provoked, seen in 603Fh, the statusword and the EMCY message, and cleared.

use std::time::Duration;

use super::as_delivered::NODE;
use super::functions::{clear_fault, velocity_mode};
use super::position::position_mode;
use crate::bench::Bench;
use crate::expect::Expect;
use plot::EventKind;

/// 1014h: 80h + node-ID.
const EMCY: u16 = 0x80 + NODE as u16;

/// How a fault is provoked.
struct Provocation {
    code: u16,
    name: &'static str,
    /// What is done to the machine.
    cause: &'static str,
    /// What undoes it.
    cure: &'static str,
    /// What the drive is asked to do, so that it notices.
    motion: Motion,
    /// How long it may take until it notices.
    patience: Duration,
}

#[derive(Clone, Copy, PartialEq)]
enum Motion {
    /// Enabled, holding still.
    Still,
    /// Turning at 50 r/min before the cause.
    Turning,
    /// Asked for 50 r/min after the cause.
    Starting,
    /// Asked for a move of 32000 counts after the cause.
    Moving,
}

use Motion::{Moving, Starting, Still, Turning};

/// The drive's capacitors take this long to go back from an over-voltage, with what the drive itself consumes.
const CURED: Duration = Duration::from_millis(1_500);

/// The capacitors hold the voltage for a while.
const DISCHARGE: Duration = Duration::from_secs(5);

const SOON: Duration = Duration::from_millis(500);

/// Twice the rated current is borne for 2016h = 3 s (chapter 9).
const OVERLOAD: Duration = Duration::from_secs(9);

#[rustfmt::skip]
const PROVOCATIONS: [Provocation; 11] = [
    Provocation { code: 0x0001, name: "over-voltage", cause: "supply 85", cure: "supply 48", motion: Still, patience: SOON },
    Provocation { code: 0x0002, name: "under-voltage", cause: "supply 12", cure: "supply 48", motion: Still, patience: DISCHARGE },
    // "Motor power cable is loose."
    Provocation { code: 0x0004, name: "over-current", cause: "fault phase on", cure: "fault phase off", motion: Starting, patience: SOON },
    // "Motor is stall": the drive pushes with 2015h, twice 2014h.
    Provocation { code: 0x0008, name: "overload", cause: "rotor lock", cure: "rotor free", motion: Starting, patience: OVERLOAD },
    // "Motor is stall": the deviation grows beyond 2017h = 4090 counts.
    Provocation { code: 0x0020, name: "tolerance", cause: "rotor lock", cure: "rotor free", motion: Moving, patience: OVERLOAD },
    Provocation { code: 0x0080, name: "reference", cause: "fault reference on", cure: "fault reference off", motion: Still, patience: SOON },
    Provocation { code: 0x0100, name: "EEPROM", cause: "fault eeprom on", cure: "fault eeprom off", motion: Still, patience: SOON },
    Provocation { code: 0x0200, name: "Hall", cause: "fault hall on", cure: "fault hall off", motion: Still, patience: SOON },
    // 2013h = 80.0 °C.
    Provocation { code: 0x0400, name: "motor temp.", cause: "temperature motor 85", cure: "temperature motor 40", motion: Still, patience: SOON },
    Provocation { code: 0x0800, name: "driver temp.", cause: "temperature driver 85", cure: "temperature driver 40", motion: Still, patience: SOON },
    Provocation { code: 0x1000, name: "encoder", cause: "fault encoder on", cure: "fault encoder off", motion: Turning, patience: SOON },
];

/// Chapter 8, fault by fault.
pub(super) fn all(bench: &mut Bench) {
    bench.section("8", "fault codes");
    bench.ask("rated current 2 A (2014h)", "2B 14 20 00 14 00 00 00", "60 14 20 00 00 00 00 00");
    bench.ask("maximum current 4 A (2015h)", "2B 15 20 00 28 00 00 00", "60 15 20 00 00 00 00 00");
    for provocation in &PROVOCATIONS {
        provoke(bench, provocation);
    }
}

fn provoke(bench: &mut Bench, fault: &Provocation) {
    if fault.motion == Moving {
        position_mode(bench);
    } else {
        velocity_mode(bench);
    }
    if fault.motion == Turning {
        ask_for_50(bench);
        bench.run(Duration::from_millis(700));
    }
    let begin = bench.now();
    bench.step(format!("{}: {}", fault.name, fault.cause));
    bench.machine(fault.cause);
    match fault.motion {
        Starting => bench.send_sdo("23 FF 60 00 32 00 00 00"),
        Moving => {
            bench.send_sdo("23 7A 60 00 00 7D 00 00");
            bench.send_sdo("2B 40 60 00 5F 00 00 00");
        }
        Still | Turning => {}
    }
    bench.run_until(fault.patience, |word| word & 0x08 != 0);
    bench.mark(fault.name, EventKind::Fault);
    bench.run(Duration::from_millis(20));
    let code = bench.read_f64(0x603F, 0);
    bench.expect("603Fh", Expect::Bits(fault.code.into()), "", code);
    let word = bench.statusword().unwrap_or_default();
    bench.expect("6041h bits 0-3", Expect::Bits(0x8), "", f64::from(word & 0xF));
    let emcy = bench.heard_since(begin, EMCY).first().map(|(_, frame)| *frame.padded());
    let seen = emcy.map_or(f64::NAN, |data| f64::from(u16::from_le_bytes([data[0], data[1]])));
    bench.expect("EMCY", Expect::Bits(fault.code.into()), "", seen);
    bench.machine(fault.cure);
    bench.run(CURED);
    clear_fault(bench);
}

fn ask_for_50(bench: &mut Bench) {
    bench.ask("target 50 r/min", "23 FF 60 00 32 00 00 00", "60 FF 60 00 00 00 00 00");
}
