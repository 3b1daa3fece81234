//! 5.3.1 to 5.3.3: the state machine, the initialisation after power-on, and the modes.

use crate::bench::Bench;
use crate::datagram::frame;
use crate::expect::Expect;

/// 5.3.2: bit 13 shows that the motor is energised.
const ENERGISED: u16 = 1 << 13;

/// 5.3.2: the example after power-on, with the low nibble and whether the motor is free.
pub(super) fn initialisation(bench: &mut Bench) {
    bench.section("5.3.2", "initialise");
    bench.step("NMT start");
    bench.send(frame("000 01 00"));
    let steps = [
        ("step 0: 00h, motor free", "2B 40 60 00 00 00 00 00", 0x0),
        ("step 1: 06h, motor free", "2B 40 60 00 06 00 00 00", 0x1),
        ("step 2: 07h, motor energised", "2B 40 60 00 07 00 00 00", 0x2003),
        ("step 3: 0Fh, motor energised", "2B 40 60 00 0F 00 00 00", 0x2007),
    ];
    for (step, request, bits) in steps {
        bench.ask(step, request, "60 40 60 00 00 00 00 00");
        bench.run_ms(50);
        bench.expect_status("6041h bits 0-3, 13", ENERGISED | 0xF, bits);
        // 2005h = 3: 1.2 A peak, or half of it at rest (2007h = 0).
        let current = bench.report().current_a;
        let least = if bits & ENERGISED == 0 { Expect::Near(0.0, 0.02) } else { Expect::AtLeast(0.55) };
        bench.expect("current", least, "A", current);
    }
}

/// 5.3.1: the commands of the controlword's table and the states of the statusword's table.
pub(super) fn state_machine(bench: &mut Bench) {
    bench.section("5.3.1", "state machine");
    // Name, controlword, state, mask and bits of the table.
    let rows = [
        ("disable operation (5)", 0x07, "switched on", 0x6F, 0x23),
        ("enable operation (4)", 0x0F, "operation enabled", 0x6F, 0x27),
        ("shutdown (8)", 0x06, "ready to switch on", 0x6F, 0x21),
        ("switch on + enable (3+4)", 0x0F, "operation enabled", 0x6F, 0x27),
        ("disable voltage (9)", 0x00, "switch on disabled", 0x4F, 0x40),
        ("shutdown (2)", 0x06, "ready to switch on", 0x6F, 0x21),
        ("switch on (3)", 0x07, "switched on", 0x6F, 0x23),
        ("shutdown (6)", 0x06, "ready to switch on", 0x6F, 0x21),
        ("quick stop (7)", 0x02, "switch on disabled", 0x4F, 0x40),
        ("shutdown (2)", 0x06, "ready to switch on", 0x6F, 0x21),
        ("switch on + enable (3+4)", 0x0F, "operation enabled", 0x6F, 0x27),
        ("quick stop (11)", 0x02, "quick stop active", 0x6F, 0x07),
        ("enable operation (16)", 0x0F, "operation enabled", 0x6F, 0x27),
        ("quick stop (11)", 0x02, "quick stop active", 0x6F, 0x07),
        ("disable voltage (12)", 0x00, "switch on disabled", 0x4F, 0x40),
    ];
    for (command, controlword, state, mask, bits) in rows {
        bench.ask(command, &format!("2B 40 60 00 {controlword:02X} 00 00 00"), "60 40 60 00 00 00 00 00");
        bench.run_ms(20);
        bench.expect_status(state, mask, bits);
    }
}

/// 5.3.3: 6060h sets the mode, 6061h shows it. The table's 2 for velocity is a misprint for 3.
pub(super) fn modes(bench: &mut Bench) {
    bench.section("5.3.3", "modes");
    for (mode, name) in [(1, "position"), (3, "velocity"), (6, "homing")] {
        bench.ask(
            format!("mode {mode}: {name}"),
            &format!("2F 60 60 00 {mode:02X} 00 00 00"),
            "60 60 60 00 00 00 00 00",
        );
        bench.run_ms(5);
        bench.expect_object(0x6061, 0, Expect::Near(mode.into(), 0.0), "");
    }
    bench.ask("mode 2", "2F 60 60 00 02 00 00 00", "80 60 60 00 30 00 09 06");
}
