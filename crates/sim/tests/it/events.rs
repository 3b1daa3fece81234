//! What happens in a world is reported: once, in order, with node, cause and remedy, and without changing the run.

use std::time::Duration;

use can::{Bitrate, Instant};
use canopen::NmtState;
use cia402::PowerState;
use sim::events::{Event, EventKind, KINDS, MAX_WAITING, PowerPhase};
use sim::machine::zlac8030l;
use sim::stimulus::{Place, Stimulus};
use sim::wire::{ErrorCause, ErrorState};
use sim::{StationId, World};

/// A ZLAC8030L at node 4 that has booted, and an adapter.
fn world() -> (World, StationId) {
    let mut world = World::new(Bitrate::K500, 1);
    let probe = world.add_probe();
    world.watch(true);
    world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
    (world, probe)
}

fn events(world: &mut World) -> Vec<Event> {
    std::iter::from_fn(|| world.poll_event()).collect()
}

fn kinds(world: &mut World) -> Vec<EventKind> {
    events(world).into_iter().map(|event| event.kind).collect()
}

fn send(world: &mut World, probe: StationId, frames: &[&str]) {
    for frame in frames {
        world.send(probe, frame.parse().unwrap()).unwrap();
        world.run_for(Duration::from_millis(5));
    }
}

fn apply(world: &mut World, words: &str) {
    let stimulus: Stimulus = words.parse().unwrap();
    world.apply(Place::node(4), &stimulus).unwrap().unwrap();
}

/// Controlwords 6, 7 and 15: transitions 2, 3 and 4 of CiA 402-2, table 31.
const ENABLE: [&str; 3] = ["604#2B40600006000000", "604#2B40600007000000", "604#2B4060000F000000"];

#[test]
fn a_drive_that_boots_reports_power_nmt_state_and_the_boot_up_message() {
    let (mut world, _) = world();
    world.run_for(Duration::from_secs(1));
    let events = events(&mut world);
    let kinds: Vec<_> = events.iter().map(|event| event.kind.clone()).collect();
    let nmt = EventKind::Nmt { from: None, to: NmtState::PreOperational };
    assert_eq!(kinds[..2], [EventKind::Power(PowerPhase::On), nmt], "{kinds:?}");
    // Boot-up is a frame of one byte: 55 bits without stuff bits, at 2 us each, and there are stuff bits.
    let boot = events.iter().find(|event| event.kind == EventKind::Boot).unwrap();
    assert!((Instant::from_nanos(110_000)..Instant::from_millis(2)).contains(&boot.at), "{boot:?}");
    assert_eq!(boot.place, Some(Place::node(4)));
    assert!(events.is_sorted_by_key(|event| event.at));
}

#[test]
fn each_step_of_the_power_state_machine_is_reported_where_it_comes_from() {
    let (mut world, probe) = world();
    world.run_for(Duration::from_secs(1));
    events(&mut world);
    send(&mut world, probe, &ENABLE);
    let steps: Vec<_> = kinds(&mut world)
        .into_iter()
        .filter_map(|kind| match kind {
            EventKind::State { from, to } => Some((from.unwrap(), to)),
            _ => None,
        })
        .collect();
    use PowerState::{OperationEnabled, ReadyToSwitchOn, SwitchOnDisabled, SwitchedOn};
    let expected = [(SwitchOnDisabled, ReadyToSwitchOn), (ReadyToSwitchOn, SwitchedOn), (SwitchedOn, OperationEnabled)];
    assert_eq!(steps, expected);
}

#[test]
fn a_fault_is_reported_with_its_remedy_and_its_emcy_and_its_end() {
    let (mut world, probe) = world();
    world.run_for(Duration::from_secs(1));
    send(&mut world, probe, &ENABLE);
    events(&mut world);
    world.act_as(Some("test".into()));
    // "ZLAC8030L quick start guide V1.00", chapter 8: 0001h is over-voltage, and its supply is 24 to 48 V.
    apply(&mut world, "supply 80");
    world.run_for(Duration::from_millis(500));
    let reported = events(&mut world);
    let stimulus = EventKind::Stimulus { words: "supply 80".into(), by: Some("test".into()) };
    assert_eq!(reported[0].kind, stimulus);
    let fault = reported.iter().find(|event| matches!(event.kind, EventKind::Fault { code: 1, .. })).expect("a fault");
    assert!(fault.remedy().is_some_and(|remedy| !remedy.is_empty()), "{fault:?}");
    assert!(fault.to_string().starts_with("node 4: fault 0001h, "), "{fault}");
    let emcy = reported.iter().find(|event| event.kind.name() == "emcy").expect("an EMCY message");
    assert_eq!((emcy.remedy(), emcy.place), (fault.remedy(), fault.place));
    assert!(reported.iter().any(|event| matches!(event.kind, EventKind::State { to: PowerState::Fault, .. })));
    apply(&mut world, "supply 48");
    world.run_for(Duration::from_secs(1));
    send(&mut world, probe, &["604#2B40600080000000"]);
    assert!(kinds(&mut world).iter().any(|kind| matches!(kind, EventKind::FaultReset { code: 1, .. })));
}

#[test]
fn arriving_storing_and_dying_are_reported() {
    let (mut world, probe) = world();
    world.run_for(Duration::from_secs(1));
    // Profile velocity, 60 r/min.
    send(&mut world, probe, &["604#2F60600003000000"]);
    send(&mut world, probe, &ENABLE);
    send(&mut world, probe, &["604#23FF60003C000000"]);
    events(&mut world);
    world.run_for(Duration::from_secs(2));
    let reported = events(&mut world);
    // Held by a controller the speed leaves the window now and then; each return is an arrival.
    assert!(reported.iter().any(|event| event.kind == EventKind::TargetReached), "{reported:?}");
    send(&mut world, probe, &["604#2B002000BC020000"]);
    world.run_for(Duration::from_millis(500));
    let reported = kinds(&mut world);
    let begun = reported.iter().position(|kind| *kind == EventKind::StoreBegun);
    let done = reported.iter().position(|kind| matches!(kind, EventKind::StoreDone { .. }));
    assert!(done.is_some() && begun.is_none_or(|begun| Some(begun) < done), "{reported:?}");
    world.cut_power(4).unwrap();
    assert_eq!(kinds(&mut world), [EventKind::Power(PowerPhase::Off)]);
}

#[test]
fn a_drive_alone_on_its_bus_becomes_error_passive_and_attempts_are_reported_ever_more_rarely() {
    let mut world = World::new(Bitrate::K500, 1);
    world.watch(true);
    world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
    world.run_for(Duration::from_secs(1));
    let reported = kinds(&mut world);
    let attempts: Vec<u64> = reported
        .iter()
        .filter_map(|kind| match kind {
            EventKind::BusError { cause: ErrorCause::NotAcknowledged, attempt, .. } => Some(*attempt),
            _ => None,
        })
        .collect();
    assert!(attempts.len() > 10 && attempts.iter().enumerate().all(|(n, attempt)| *attempt == 1 << n), "{attempts:?}");
    // Fault confinement, rule 3 and its exception 1: 8 for each attempt, 16 attempts make 128, which is passive; alone a
    // node never goes bus-off.
    let states: Vec<_> = reported.iter().filter(|kind| matches!(kind, EventKind::BusState { .. })).collect();
    let passive = EventKind::BusState { from: ErrorState::ErrorActive, to: ErrorState::ErrorPassive };
    assert_eq!(states, [&passive]);
}

#[test]
fn bus_off_and_the_way_back_are_reported() {
    let (mut world, _) = world();
    world.run_for(Duration::from_secs(1));
    events(&mut world);
    apply(&mut world, "bus corrupt 1");
    // Something has to be sent to fail: a boot-up message.
    apply(&mut world, "power cut");
    apply(&mut world, "power on");
    world.run_for(Duration::from_millis(100));
    let reported = kinds(&mut world);
    let to = |state| reported.iter().position(|kind| matches!(kind, EventKind::BusState { to, .. } if *to == state));
    assert!(to(ErrorState::ErrorPassive) < to(ErrorState::BusOff) && to(ErrorState::BusOff).is_some(), "{reported:?}");
    apply(&mut world, "bus corrupt 0");
    world.run_for(Duration::from_secs(2));
    let reported = kinds(&mut world);
    let back = EventKind::BusState { from: ErrorState::BusOff, to: ErrorState::ErrorActive };
    assert!(reported.contains(&back), "{reported:?}");
}

#[test]
fn a_watched_run_is_the_same_run() {
    let digest = |watched: bool| {
        let mut world = World::new(Bitrate::K500, 7);
        let probe = world.add_probe();
        world.watch(watched);
        world.add_drive(4, Box::new(zlac8030l(4, 1))).unwrap();
        world.run_for(Duration::from_secs(1));
        send(&mut world, probe, &["604#2F60600003000000"]);
        send(&mut world, probe, &ENABLE);
        send(&mut world, probe, &["604#23FF60003C000000"]);
        apply(&mut world, "load torque 1");
        world.run_for(Duration::from_millis(777));
        let many = events(&mut world).len();
        assert_eq!(many > 0, watched);
        world.digest()
    };
    assert_eq!(digest(true), digest(false));
}

#[test]
fn what_is_not_pulled_is_bounded_and_counted() {
    let (mut world, _) = world();
    world.run_for(Duration::from_secs(1));
    events(&mut world);
    for _ in 0..MAX_WAITING + 5 {
        world.tell(None, EventKind::Behind(Duration::from_millis(100)));
    }
    let reported = kinds(&mut world);
    assert_eq!((reported.len(), &reported[0]), (MAX_WAITING + 1, &EventKind::Missed(5)));
    world.watch(false);
    world.tell(None, EventKind::Boot);
    assert_eq!(world.poll_event(), None);
}

#[test]
fn kinds_have_names_of_their_own() {
    let mut names: Vec<_> = KINDS.iter().map(|(name, _)| name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), KINDS.len());
    assert_eq!(EventKind::Missed(1).name(), "missed");
    assert_eq!(EventKind::TargetReached.name(), "target_reached");
}

/// 202Eh:02 = 1000 W lets the drive load the resistor of 100 W with all of its 72²/5 W. It warms to ten times what its rated power
/// does, with 30 s, and burns at twice that: after -30 s ln(1 - 0.2 * 5 * 100 / 72²).
#[test]
fn a_bleeder_that_burns_out_is_reported_shown_as_damage_and_mended() {
    let (mut world, probe) = world();
    world.run_for(Duration::from_millis(20));
    // 202Eh:05 = 1, :02 = 1000.
    send(&mut world, probe, &["604#2B2E200501000000", "604#2B2E2002E8030000"]);
    events(&mut world);
    let damage = |world: &mut World| world.with_drive(4, |drive, _| drive.report().damage).unwrap();
    assert_eq!(damage(&mut world), None);
    apply(&mut world, "supply 72");
    let expected_s = -30.0 * f64::ln(1.0 - 2.0 * 5.0 * 100.0 / (72.0 * 72.0));
    world.run_for(Duration::from_secs_f64(0.95 * expected_s));
    assert_eq!(damage(&mut world), None);
    world.run_for(Duration::from_secs_f64(0.1 * expected_s));
    let burnt = damage(&mut world).expect("the bleeder is burnt");
    assert!(burnt.contains("bleeder") && burnt.contains("'fault bleeder off'"), "{burnt}");
    let reported: Vec<_> =
        events(&mut world).into_iter().filter(|event| event.kind == EventKind::Damage(burnt)).collect();
    assert!(reported.len() == 1 && reported[0].place == Some(Place::node(4)), "{reported:?}");
    apply(&mut world, "supply 48");
    apply(&mut world, "fault bleeder off");
    assert_eq!(damage(&mut world), None);
    apply(&mut world, "fault bleeder on");
    assert_eq!(damage(&mut world), Some(burnt));
}
