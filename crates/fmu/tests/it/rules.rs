//! Which call is taken in which mode, and what a call of no sense is answered with.

use std::collections::BTreeSet;

use ferrodrive_fmu::config::TxClock;
use ferrodrive_fmu::instance::{Instance, Interval, Mode};
use ferrodrive_fmu::operation::{BusError, ErrorCode, NodeStatus, Operation, operations};
use ferrodrive_fmu::unit::Unit;
use ferrodrive_fmu::variable::Value;
use ferrodrive_fmu::xml;

use crate::importer::{binary, bus, drive, instance};

fn refusal<T>(called: Result<T, ferrodrive_fmu::call::CallError>) -> String {
    called.err().map(|error| error.to_string()).unwrap_or_default()
}

/// A drive without event mode, at the begin of its time.
fn stepping(spec: &str) -> Instance {
    let mut instance = Instance::of(drive(spec, TxClock::Triggered), ".".as_ref(), false).unwrap();
    instance.enter_initialization(0.0).unwrap();
    instance.exit_initialization().unwrap();
    instance
}

#[test]
fn time_does_not_go_back_and_steps_are_forward() {
    let mut drive = stepping("zlac8030l@4");
    drive.step(0.0, 1e-3).unwrap();
    assert!(refusal(drive.step(0.0, 1e-3)).contains("time stands at 0.001 s"));
    for step in [-1e-3, f64::NAN, f64::INFINITY, 1e300] {
        assert!(refusal(drive.step(1e-3, step)).contains("expected a time of 0 or more"), "{step}");
    }
    assert!(refusal(drive.step(f64::NAN, 1e-3)).contains("not possible"));
    drive.step(1e-3, 1e-3).unwrap();
    assert_eq!(drive.get(0).unwrap(), Value::Float64(2e-3));
}

#[test]
fn a_call_in_another_mode_is_refused_with_what_is_expected() {
    let mut made = Instance::of(drive("zlac8030l@4", TxClock::Countdown), ".".as_ref(), false).unwrap();
    assert!(refusal(made.step(0.0, 1e-3)).contains("expected [Step]"));
    assert!(refusal(made.exit_initialization()).contains("expected [Initialization]"));
    made.enter_initialization(0.0).unwrap();
    made.exit_initialization().unwrap();
    assert_eq!(made.mode(), Mode::Step);
    assert!(refusal(made.enter_event()).contains("eventModeUsed = false"));
    made.terminate().unwrap();
    assert!(refusal(made.set(2, Value::Binary(vec![0]))).contains("the simulation is over"));
    assert!(refusal(made.step(0.0, 1e-3)).contains("Terminated"));
    made.reset().unwrap();
    assert_eq!(made.mode(), Mode::Instantiated);
}

#[test]
fn variables_are_set_by_their_type_role_and_time() {
    let mut drive = stepping("zlac8030l@4");
    assert!(refusal(drive.set(10, Value::Int64(1))).contains("load_torque is a Float64, not a Int64"));
    assert!(refusal(drive.set(10, Value::Float64(f64::NAN))).contains("load_torque cannot be NaN"));
    assert!(refusal(drive.set(10, Value::Float64(1e9))).contains("load_torque: "));
    assert!(refusal(drive.set(200, Value::Float64(1.0))).contains("angle is an output"));
    assert!(refusal(drive.set(6, Value::UInt64(7))).contains("seed is a parameter"));
    assert!(refusal(drive.set(99, Value::Float64(1.0))).contains("variable 99 does not exist"));
    drive.set(10, Value::Float64(2.0)).unwrap();
    drive.set(100, Value::Boolean(true)).unwrap();
    // What was refused is not what an input has from then on.
    assert_eq!(drive.get(10).unwrap(), Value::Float64(2.0));
    assert!(refusal(drive.set(10, Value::Float64(1e9))).contains("load_torque: "));
    assert_eq!((drive.get(10).unwrap(), drive.get(100).unwrap()), (Value::Float64(2.0), Value::Boolean(true)));
}

#[test]
fn every_variable_of_the_description_can_be_read_and_inputs_hold_their_start() {
    for config in [
        drive("zlac8030l@4", TxClock::Countdown),
        drive("m8025e25b80@7", TxClock::Countdown),
        drive("zlim42c@15", TxClock::Countdown),
        drive("cia402@2", TxClock::Countdown),
        bus(3, TxClock::Countdown),
    ] {
        let mut instance = instance(config);
        for variable in instance.variables().to_vec() {
            let value = instance.get(variable.reference).unwrap();
            assert_eq!(value.type_name(), variable.value.type_name(), "{}", variable.name);
            assert_eq!(value, variable.value, "{}", variable.name);
        }
        instance.exit_initialization().unwrap();
    }
}

/// The drive is a node like another: no power, no part in the bus; then its bit rate, and its boot-up.
#[test]
fn a_drive_says_when_it_joins_the_bus() {
    let mut drive = instance(drive("zlac8030l@4,timing=ideal", TxClock::Triggered));
    drive.exit_initialization().unwrap();
    let mut said: Vec<Operation> = operations(&binary(&mut drive, 4)).map(Result::unwrap).collect();
    for step in 0..1_500 {
        drive.update().unwrap();
        drive.enter_step().unwrap();
        drive.step(f64::from(step) * 1e-3, 1e-3).unwrap();
        said.extend(operations(&binary(&mut drive, 4)).map(Result::unwrap));
        drive.enter_event().unwrap();
    }
    let expected = [
        Operation::Baudrate(500_000),
        Operation::Status(NodeStatus::BusOff),
        Operation::Baudrate(500_000),
        Operation::Status(NodeStatus::Active),
        Operation::Transmit("704#00".parse().unwrap()),
    ];
    assert_eq!(said, expected);
}

/// An event is needed when something is due at the end of a step, and never where event mode was not asked for.
#[test]
fn a_step_needs_an_event_when_something_is_due_at_its_end() {
    for (clock, has_events) in [
        (TxClock::Countdown, true),
        (TxClock::Triggered, true),
        (TxClock::Countdown, false),
        (TxClock::Triggered, false),
    ] {
        let mut drive = Instance::of(drive("zlac8030l@4", clock), ".".as_ref(), has_events).unwrap();
        drive.enter_initialization(0.0).unwrap();
        drive.exit_initialization().unwrap();
        if has_events && clock == TxClock::Countdown {
            drive.set_clock(3, true).unwrap();
        }
        let (mut needed, mut has_sent) = (0, false);
        for step in 0..1_500 {
            if has_events {
                drive.update().unwrap();
                drive.enter_step().unwrap();
            }
            let needs_event = drive.step(f64::from(step) * 1e-3, 1e-3).unwrap().needs_event;
            needed += u32::from(needs_event);

            if has_events {
                drive.enter_event().unwrap();
            }
            if has_events && clock == TxClock::Countdown {
                assert_eq!(drive.interval(3).unwrap() == Interval::In(0), needs_event, "step {step}");
                if needs_event {
                    drive.set_clock(3, true).unwrap();
                }
            }
            has_sent |= !binary(&mut drive, 4).is_empty();
        }
        assert!(has_sent, "{clock:?}, event mode {has_events}");
        assert_eq!(needed > 0, has_events, "{clock:?}, event mode {has_events}");
    }
}

/// A sum of many steps is not a product: a nanosecond is let pass; a time before the start is not.
#[test]
fn a_step_may_begin_a_nanosecond_beside_where_time_stands() {
    let mut drive = Instance::of(drive("zlac8030l@4", TxClock::Triggered), ".".as_ref(), false).unwrap();
    drive.enter_initialization(5.0).unwrap();
    drive.exit_initialization().unwrap();
    assert!(refusal(drive.step(4.0, 1e-3)).contains("time stands at 5 s"));
    drive.step(5.0, 1e-3).unwrap();
    drive.step(5.001 + 1e-9, 1e-3).unwrap();
    assert!(refusal(drive.step(5.002 + 4e-9, 1e-3)).contains("time stands at 5.002"));
}

/// One variable in several terminals is forbidden (fmi-ls-bus, "Bus Terminal").
#[test]
fn each_terminal_of_a_bus_has_variables_of_its_own() {
    let config = bus(3, TxClock::Countdown);
    let unit = Unit::new(&config, ".".as_ref()).unwrap();
    let (terminals, model) = (xml::terminals_and_icons(&unit), xml::model_description(&config, ".".as_ref(), &unit));
    let names: Vec<_> = terminals.split("variableName=\"").skip(1).map(|it| it.split('"').next().unwrap()).collect();
    assert_eq!(names.len(), 15);
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), 15, "{names:?}");
    for name in names {
        assert_eq!(model.matches(&format!(" name=\"{name}\"")).count(), 1, "{name}");
    }
}

#[test]
fn a_countdown_is_what_its_importer_may_wait_for() {
    let mut drive = instance(drive("zlac8030l@4,timing=ideal", TxClock::Countdown));
    drive.exit_initialization().unwrap();
    // That it takes no part yet is there to be sent.
    assert_eq!(drive.interval(3).unwrap(), Interval::In(0));
    drive.set_clock(3, true).unwrap();
    assert!(!binary(&mut drive, 4).is_empty());
    drive.update().unwrap();
    let Interval::In(nanos) = drive.interval(3).unwrap() else { panic!() };
    assert!(nanos > 0);
    assert_eq!(drive.interval(3).unwrap(), Interval::In(nanos));
    assert!(refusal(drive.interval(1)).contains("not a countdown"));
}

fn written(all: &[Operation]) -> Vec<u8> {
    let mut bytes = Vec::new();
    all.iter().for_each(|operation| operation.write(&mut bytes));
    bytes
}

/// 12 errors of a sender are 96 (error passive at 128 and above), 4 more are 128; each frame that is sent takes 1 off (ISO 11898-1).
#[test]
fn a_node_says_when_its_counters_have_fallen_again() {
    let mut drive = instance(drive("zlac8030l@4,timing=ideal", TxClock::Triggered));
    drive.set(5, Value::Boolean(true)).unwrap();
    drive.exit_initialization().unwrap();
    let boot_up = 0x704;
    let error = BusError { id: boot_up, code: ErrorCode::Bit, is_primary: true, is_sender: true };
    let mut statuses = Vec::new();
    for operation in std::iter::repeat_n(Operation::BusError(error), 16).chain([Operation::Confirm(boot_up)]) {
        drive.set(2, Value::Binary(written(&[operation]))).unwrap();
        drive.update().unwrap();
        let said = operations(&binary(&mut drive, 4)).map(Result::unwrap).collect::<Vec<_>>();
        statuses.push(said);
    }
    assert!(statuses[..15].iter().all(Vec::is_empty), "{statuses:?}");
    assert_eq!(statuses[15], [Operation::Status(NodeStatus::Passive)]);
    assert_eq!(statuses[16], [Operation::Status(NodeStatus::Active)]);
}

/// A node that has failed once and then switches off takes no part: the other's frame has no acknowledgement.
#[test]
fn a_node_that_is_off_by_choice_takes_no_part_though_it_has_had_errors() {
    let mut bus = instance(bus(2, TxClock::Triggered));
    bus.exit_initialization().unwrap();
    let frame = |text: &str| Operation::Transmit(text.parse().unwrap());
    let off = Operation::Status(NodeStatus::BusOff);
    // Alone: its frame is not acknowledged, which counts.
    bus.set(1006, Value::Binary(written(std::slice::from_ref(&off)))).unwrap();
    bus.set(1001, Value::Binary(written(&[frame("123#")]))).unwrap();
    let mut step = 0;
    let mut run = |bus: &mut Instance| {
        bus.update().unwrap();
        bus.enter_step().unwrap();
        bus.step(f64::from(step) * 1e-3, 1e-3).unwrap();
        bus.enter_event().unwrap();
        step += 1;
        (bus.get(10).unwrap(), bus.get(11).unwrap())
    };
    let (frames, Value::UInt64(errors)) = run(&mut bus) else { panic!() };
    assert_eq!(frames, Value::UInt64(0));
    assert!(errors > 0);
    // The second joins, and the frame gets through; the first switches off, with errors in its counter.
    bus.set(1006, Value::Binary(written(&[Operation::Status(NodeStatus::Active)]))).unwrap();
    run(&mut bus);
    let (frames, before) = run(&mut bus);
    assert_eq!(frames, Value::UInt64(1));
    bus.set(1001, Value::Binary(written(&[off]))).unwrap();
    bus.set(1006, Value::Binary(written(&[frame("124#")]))).unwrap();
    let (frames, after) = run(&mut bus);
    assert_eq!(frames, Value::UInt64(1));
    assert_ne!(before, after, "its frame is not acknowledged");
}

/// The folder of the resources may have any name; what is in the file decides the token.
#[test]
fn a_drive_of_a_file_is_found_below_a_path_with_commas() {
    let scratch = tempfile::Builder::new().prefix("an, fmu@4, ").tempdir().unwrap();
    let folder = scratch.path();
    let eds = |of: &str| {
        let unit = Unit::new(&drive(of, TxClock::Countdown), folder);
        unit.err().map(|error| error.to_string()).unwrap_or_default()
    };
    let refusal = eds("it.eds@5,timing=ideal");
    assert!(refusal.contains("it.eds") && !refusal.contains("is not an option"), "{refusal}");
    let config = drive("it.eds@5", TxClock::Countdown);
    std::fs::write(folder.join("it.eds"), "[FileInfo]\n").unwrap();
    let token = xml::token(&config, folder);
    std::fs::write(folder.join("it.eds"), "[FileInfo]\n\n").unwrap();
    assert_ne!(xml::token(&config, folder), token);
}
