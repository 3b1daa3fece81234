//! The data files of the ZLIM42-C agree with themselves, with CiA 301 and with CiA 402, before they judge a drive.

use std::collections::HashSet;

use ferrodrive_tests::zlim42c::{
    HomingResult, fault_code, figure, figures, homing_runs, homing_runs_by_prose, objects, power_states,
};

/// The step frequency in Hz that the drive can make (2.1).
const STEP_FREQUENCY_HZ: f64 = 200_000.0;

#[test]
fn the_first_rows_of_each_record_count_its_sub_indexes_or_more() {
    let objects = objects();
    for count in objects.iter().filter(|row| row.name == "Number of sub-indexes" && !row.writable) {
        let greatest = objects.iter().filter(|row| row.index == count.index).map(|row| i64::from(row.sub)).max();
        assert!(count.default >= greatest, "{count:?} has {greatest:?}");
    }
}

#[test]
fn the_motor_is_energised_from_switched_on() {
    let cells = power_states();
    for it in &cells {
        let energised = ["switched_on", "operation_enabled", "quick_stop_active"];
        assert_eq!(it.bit_13_after, energised.contains(&it.cell.state_after.as_str()), "{it:?}");
    }
}

#[test]
fn the_last_move_of_an_attained_run_is_the_latch_and_is_slow_and_ends_on_the_switch() {
    for runs in [homing_runs(), homing_runs_by_prose()] {
        for method in [17, 18, 24, 29] {
            assert!(runs.iter().filter(|it| it.row.method == method && it.row.result == "attained").count() >= 4);
        }
        for HomingResult { row, .. } in runs.iter().filter(|it| it.bit_8) {
            let (last, latch) = (row.moves.last().expect("a move"), row.latch.as_ref().expect("a latch"));
            assert_eq!(last.until, format!("{}_on", latch.switch));
            assert_eq!((last.direction, last.speed.as_str()), (latch.direction, "6099:02"));
            assert!(latch.rising, "5.3.6: it stops when the switch is found");
        }
    }
}

#[test]
fn the_paragraphs_search_in_the_other_direction_than_the_labels() {
    let first = |runs: Vec<HomingResult>| -> Vec<(u8, i32)> {
        let starts = ["between", "above_home", "below_home"];
        let at_rest = runs.iter().filter(|it| starts.contains(&&*it.row.start) && it.row.result == "attained");
        let mut first: Vec<_> = at_rest.map(|it| (it.row.method, it.row.moves[0].direction)).collect();
        first.dedup();
        first
    };
    assert_eq!(first(homing_runs()), [(17, -1), (18, 1), (24, 1), (29, -1)]);
    assert_eq!(first(homing_runs_by_prose()), [(17, 1), (18, -1), (24, -1), (29, 1)]);
}

#[test]
fn the_tables_of_settings_follow_from_each_other() {
    for step in 0..8 {
        let step = step.to_string();
        let (rms_a, peak_a) = (figure("current", &step, "rms"), figure("current", &step, "peak"));
        assert!((rms_a - peak_a / 2.0_f64.sqrt()).abs() < 0.011, "step {step}: {rms_a} A for {peak_a} A");
    }
    for step in 0..16 {
        let step = step.to_string();
        let pulses = figure("microstep", &step, "pulses_per_turn");
        let limit_rpm = (STEP_FREQUENCY_HZ * 60.0 / pulses).floor().min(3000.0);
        assert!((figure("microstep", &step, "speed_limit") - limit_rpm).abs() < 0.5, "step {step}");
    }
}

#[test]
fn the_fault_codes_are_one_hot() {
    let codes: HashSet<_> = figures().iter().filter(|it| it.table == "fault").map(fault_code).collect();
    assert_eq!(codes, HashSet::from([0xFF01, 0xFF02, 0xFF04, 0xFF08, 0xFF10]));
}
