//! The power state machine of CiA 402 on the running drive: every state with every event, and the statuswords.

use crate::bench::Bench;
use crate::manual::{hex, integer, rows};
use crate::power_states::{PowerSubject, lead_where_the_table_says};

/// `power_state.csv`.
pub fn every_event_in_every_state_leads_where_the_table_says<S: PowerSubject>() {
    lead_where_the_table_says::<S>(&S::power_states(), S::ABOVE);
}

/// CiA 301, 7.2.8.3.1, and transitions 0 and 1.
pub fn a_drive_says_that_it_has_booted_and_is_in_switch_on_disabled<S: PowerSubject>() {
    Bench::<S>::new().hears(&["70n#00"]).shows(0xFFFF, S::BOOTED);
}

/// CiA 402-2, transitions 13 to 15, and CiA 301, 7.2.7: EMCY when it comes and when it has gone.
pub fn a_fault_is_told_and_goes_with_a_rising_bit_7_once_its_cause_is_gone<S: PowerSubject>() {
    let ((code, register), mut bench) = (S::BROKEN, Bench::<S>::in_state("switched_on"));
    bench.forget().break_down(true).shows(0xFF, S::FAULT).reads(0x603F, code.into()).reads(0x1001, register.into());
    bench.set(0x6040, 0x80).shows(0xFF, S::FAULT).break_down(false);
    // Bit 7 did not rise.
    bench.set(0x6040, 0x80).shows(0xFF, S::FAULT);
    bench.set(0x6040, 0x00).set(0x6040, 0x80).shows(0xFF, S::BOOTED & 0xFF).reads(0x603F, 0).reads(0x1001, 0);
    let emcy = format!("08n#{:04X}{register:02X}0000000000", code.swap_bytes());
    bench.hears_of("08n#", &[&emcy, "08n#0000000000000000"]);
}

/// `statusword_at_rest.csv`.
pub fn the_statusword_of_each_state_in_each_mode_at_rest_is_that_of_the_table<S: PowerSubject>() {
    let expected = rows(S::STATUSWORD_AT_REST, |row| {
        let mode = integer(row.get("mode")).expect("a mode");
        (row.get("state").to_owned(), mode, hex(row.get("mask")), hex(row.get("statusword")))
    });
    for (state, mode, mask, bits) in expected {
        let mut bench = Bench::<S>::new();
        bench.set(0x6060, mode).reach(&state);
        let statusword = bench.run_ms(50).statusword();
        assert_eq!(statusword & mask, bits, "{state}, mode {mode}: {statusword:04X}h, expected {bits:04X}h");
        bench.reads(0x6061, mode);
    }
}
