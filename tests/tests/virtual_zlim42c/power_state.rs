//! The power state machine on the running drive: every state with every event of the table, and the statuswords.
//!
//! Two states cannot be seen from the bus. Not ready to switch on ends before the boot-up message goes out. Fault
//! reaction active takes no time: the manual names no fault reaction ramp, so the power stage goes off at once and
//! transition 14 follows 13 in the same control period.

use ferrodrive_tests::manual::PowerCell;
use ferrodrive_tests::zlim42c::{EnergisedCell, power_states};
use sim::Component;

use crate::bench::Bench;

/// The motor is energised.
const ENERGISED: u16 = 1 << 13;

const UNSEEN: [&str; 2] = ["not_ready_to_switch_on", "fault_reaction_active"];

#[test]
fn every_event_in_every_state_leads_where_the_table_says() {
    let cells: Vec<_> = power_states().into_iter().filter(|it| !UNSEEN.contains(&&*it.cell.state)).collect();
    assert_eq!(cells.len(), 66);
    let differences: Vec<_> = cells.iter().filter_map(difference).collect();
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

fn difference(EnergisedCell { cell, bit_13_after }: &EnergisedCell) -> Option<String> {
    let mut bench = in_state(&cell.state);
    cause(&mut bench, cell);
    let statusword = bench.statusword();
    let (low_byte, energised) = (statusword & 0xFF, statusword & ENERGISED != 0);
    let expected = match &*cell.state_after {
        // Seen one transition later: Fault.
        "fault_reaction_active" => 0x98,
        _ => u16::from(cell.low_byte_after),
    };
    (low_byte != expected || energised != *bit_13_after).then(|| {
        let (from, on) = (&cell.state, &cell.event);
        format!("{from} on {on}: {statusword:04X}h, expected low byte {expected:02X}h, bit 13 {bit_13_after}")
    })
}

/// A drive without a mode, standing, in a state.
fn in_state(state: &str) -> Bench {
    let mut bench = Bench::new();
    reach(&mut bench, state);
    bench
}

/// From switch on disabled to a state.
fn reach(bench: &mut Bench, state: &str) {
    let controlwords: &[i64] = match state {
        "switch_on_disabled" | "fault" => &[],
        "ready_to_switch_on" => &[0x06],
        "switched_on" => &[0x06, 0x07],
        "operation_enabled" => &[0x06, 0x07, 0x0F],
        "quick_stop_active" => &[0x06, 0x07, 0x0F, 0x02],
        other => panic!("no way to {other}"),
    };
    for controlword in controlwords {
        bench.set(0x6040, 0, *controlword);
    }
    if state == "fault" {
        reference_fault(bench, true);
        reference_fault(bench, false);
    }
}

fn cause(bench: &mut Bench, cell: &PowerCell) {
    match (cell.controlword, &*cell.event) {
        (Some(controlword), _) => {
            bench.set(0x6040, 0, 0x00FF & i64::from(controlword));
            bench.run_ms(10);
        }
        (None, "fault_occurs") => reference_fault(bench, true),
        // Ends of what the drive does by itself: there is nothing of the kind under way, time passes.
        (None, _) => bench.run_ms(1000),
    }
}

fn reference_fault(bench: &mut Bench, broken: bool) {
    bench.operate(|drive, now| drive.set_fault(Component::Reference, broken, now)).expect("there is a reference");
    bench.run_ms(50);
}

#[test]
fn the_drive_says_that_it_has_booted_and_is_in_switch_on_disabled() {
    let mut bench = Bench::new();
    assert_eq!(bench.heard(), ["701#00"]);
    assert_eq!(bench.statusword() & 0x6F, 0x60);
}

#[test]
fn the_statusword_of_each_state_is_that_of_the_readings() {
    // docs/drives/zlim42c.md, 5.3.1 and 5.3.2, without a mode. In quick stop active bit 10 tells that the motor stands.
    let patterns = [
        ("switch_on_disabled", 0x0270),
        ("ready_to_switch_on", 0x0231),
        ("switched_on", 0x2233),
        ("operation_enabled", 0x2237),
        ("quick_stop_active", 0x2217),
        ("fault", 0x0298),
    ];
    for (state, pattern) in patterns {
        let mut bench = in_state(state);
        bench.run_ms(50);
        assert_eq!(format!("{:04X}", bench.statusword()), format!("{pattern:04X}"), "{state}");
    }
}

#[test]
fn the_motor_carries_current_from_switched_on_and_when_locked() {
    for (state, locked, live) in [
        ("switch_on_disabled", 0, false),
        ("ready_to_switch_on", 0, false),
        ("switched_on", 0, true),
        ("operation_enabled", 0, true),
        ("quick_stop_active", 0, true),
        ("switch_on_disabled", 1, true),
        ("ready_to_switch_on", 1, true),
        ("fault", 1, false),
    ] {
        let mut bench = Bench::new();
        bench.set(0x200B, 0, locked);
        reach(&mut bench, state);
        bench.run_ms(50);
        let current_a = bench.report().current_a;
        assert_eq!(current_a > 0.5, live, "{state}, 200Bh = {locked}: {current_a} A");
        assert_eq!(bench.statusword() & ENERGISED != 0, live, "{state}, 200Bh = {locked}");
    }
}

#[test]
fn bit_11_mirrors_bit_4_of_the_controlword_in_every_state() {
    let mut bench = Bench::new();
    for (controlword, bit_11) in [(0x10, true), (0x06, false), (0x16, true), (0x0F, false), (0x1F, true)] {
        bench.set(0x6040, 0, controlword);
        assert_eq!(bench.statusword() & 1 << 11 != 0, bit_11, "{controlword:02X}h");
    }
}
