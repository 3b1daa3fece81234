//! Gains that a drive tries: those that it keeps, and those that it does not.

use std::time::Duration;

use canopen::Mux;
use host::capture::Restorer;
use host::tune::{Bounds, Excursion, Request, find, try_gains, tune};

use crate::tune::{PERIOD, gains, is_as_long_as_it_is_made, request, tried, values, wheel};

#[test]
fn a_position_loop_is_tried_on_the_drive_by_a_move_there_and_back() {
    let (mut world, drive) = wheel(&["load inertia 0.05", "load friction 0.2 viscous 0.01"]).world().unwrap();
    let profile = [0x6081, 0x6083, 0x6084, 0x6060].map(|index| Mux::new(index, 0));
    let before = values(&mut world, &drive, &profile);
    let (request, restorer) = (Request { apply: true, with_position: true, ..request() }, Restorer::of(&drive));
    let run = tune((&drive, &restorer), &request, &(), std::future::ready(false));
    let report = sim::block_on(&mut world, run).unwrap().unwrap();
    assert!(report.applied, "{report:?}");
    is_as_long_as_it_is_made(&report);
    assert_eq!(values(&mut world, &drive, &profile), before);
    assert!(restorer.is_done() && world.report(1).unwrap().velocity_rpm.abs() < 1.0);
}

/// Two hundred samples a second, as a page takes them, show a shaft up to 25 Hz, and little of how late it is: the same shaft gets the same
/// gains all the same, at whatever speed it was measured, and they are kept.
#[test]
fn gains_found_with_few_samples_are_the_same_at_each_speed_and_are_kept() {
    let gains = [100.0, 115.0, 125.0].map(|speed_rpm| {
        let (mut world, drive) = wheel(&["load inertia 0.05", "load friction 0.2 viscous 0.01"]).world().unwrap();
        let bounds = Bounds { speed_rpm, current_a: 15.0, ..Bounds::default() };
        let period = Duration::from_millis(5);
        let (request, restorer) =
            (Request { apply: true, period: Some(period), bounds, ..request() }, Restorer::of(&drive));
        let run = tune((&drive, &restorer), &request, &(), std::future::ready(false));
        let report = sim::block_on(&mut world, run).unwrap().unwrap();
        assert!(
            report.applied && report.after.crossover_hz < 25.0,
            "{speed_rpm}: {:?} {:?}",
            report.after,
            report.notes
        );
        report.gains[0].after
    });
    let [least, most] = [gains.iter().min().unwrap(), gains.iter().max().unwrap()];
    assert!(*least > 500 && *most as f64 / (*least as f64) < 1.2, "{gains:?}");
}

/// Gains for a margin of 40 degrees alone make the current swing by amperes at 1 r/min, where the counts of the encoder come one by one.
const OF_THE_MARGIN: [(Mux, i64); 3] =
    [(Mux::new(0x201D, 0), 3246), (Mux::new(0x201E, 0), 3591), (Mux::new(0x2018, 0), 250)];

#[test]
fn proposed_gains_do_not_swing_by_the_encoders_counts_and_that_is_said() {
    let plant = wheel(&["load inertia 0.05"]);
    let (mut world, drive) = plant.world().unwrap();
    let (request, restorer) = (request(), Restorer::of(&drive));
    let mut excursion = Excursion::default();
    let run = find((&drive, &restorer), &request, &mut excursion);
    let (report, proposed) = sim::block_on(&mut world, run).unwrap().unwrap();
    assert!(
        report.notes.iter().any(|note| note.contains("swing by") && note.contains("at a slow speed")),
        "{:?}",
        report.notes
    );
    let slow = (PERIOD, Bounds { speed_rpm: 1.0 / 0.75, ..Bounds::default() });
    let ripple_a = |values: &[(Mux, i64)]| tried(&plant, values, slow).step.ripple_a();
    // 2 % of 15 A on the twin, and some more on a plant that is not quite it.
    assert!(ripple_a(&proposed.values()) < 0.4);
    assert!(ripple_a(&OF_THE_MARGIN) > 1.0);
}

/// Those of the margin alone: see above. At the end of a move the shaft turns slowly.
#[test]
fn gains_with_which_a_move_takes_too_much_current_are_not_kept() {
    let (mut world, drive) = wheel(&["load inertia 0.05"]).world().unwrap();
    let before = gains(&mut world, &drive);
    let (request, restorer) = (Request { with_position: true, ..request() }, Restorer::of(&drive));
    let mut excursion = Excursion::default();
    let run = find((&drive, &restorer), &request, &mut excursion);
    let (report, mut proposed) = sim::block_on(&mut world, run).unwrap().unwrap();
    for (object, value) in OF_THE_MARGIN {
        proposed.gains.iter_mut().find(|gain| gain.object == object).unwrap().after = value;
    }
    let found = (report, proposed);
    let run = try_gains((&drive, &restorer), &request, found, &mut excursion, &(), std::future::ready(false));
    let failure = sim::block_on(&mut world, run).unwrap().unwrap_err();
    let text = failure.to_string();
    assert!(failure.kind == "current_bound" && text.contains("it was given its former gains back"), "{text}");
    assert!(failure.next.iter().any(|next| next.contains("--phase-margin 50")), "{failure:?}");
    assert_eq!(gains(&mut world, &drive), before);
    assert!(restorer.is_done() && world.report(1).unwrap().velocity_rpm.abs() < 1.0);
}

/// What is proposed for 15 A swings by more than what 8 A allow, which the drive shows where it turns slowly.
#[test]
fn gains_whose_current_swings_at_a_slow_speed_on_the_drive_are_not_kept() {
    let (mut world, drive) = wheel(&["load inertia 0.05"]).world().unwrap();
    let before = gains(&mut world, &drive);
    let (request, restorer, mut excursion) = (request(), Restorer::of(&drive), Excursion::default());
    let found = sim::block_on(&mut world, find((&drive, &restorer), &request, &mut excursion)).unwrap().unwrap();
    let request = Request { bounds: Bounds { current_a: 8.0, ..request.bounds }, ..request };
    let run = try_gains((&drive, &restorer), &request, found, &mut excursion, &(), std::future::ready(false));
    let report = sim::block_on(&mut world, run).unwrap().unwrap();
    let said =
        |note: &String| note.contains("at a slow speed with the new gains") && note.contains("former gains back");
    assert!(!report.applied && report.notes.iter().any(said), "{:?}", report.notes);
    assert_eq!(gains(&mut world, &drive), before);
}
