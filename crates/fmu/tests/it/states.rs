//! A state that is taken back, as a value and as bytes, goes on as if nothing had happened.

use ferrodrive_fmu::config::TxClock;
use ferrodrive_fmu::instance::{Instance, Interval, Mode};
use ferrodrive_fmu::operation::Operation;
use ferrodrive_fmu::state::SavedState;
use ferrodrive_fmu::unit::Action;
use ferrodrive_fmu::variable::Value;

use crate::importer::{binary, bus, drive, instance};

fn turning() -> (Instance, u32) {
    let mut drive = Instance::of(drive("zlac8030l@4,timing=ideal", TxClock::Triggered), ".".as_ref(), false).unwrap();
    drive.enter_initialization(0.0).unwrap();
    drive.set(6, Value::UInt64(3)).unwrap();
    drive.exit_initialization().unwrap();
    let mut step = 0;
    run(&mut drive, &mut step, 600);
    for text in [
        "604#2F60600003000000",
        "604#2B40600006000000",
        "604#2B40600007000000",
        "604#2B4060000F000000",
        "604#23FF60003C000000",
    ] {
        let mut bytes = Vec::new();
        Operation::Transmit(text.parse().unwrap()).write(&mut bytes);
        drive.set(2, Value::Binary(bytes)).unwrap();
        run(&mut drive, &mut step, 5);
    }
    (drive, step)
}

fn run(drive: &mut Instance, step: &mut u32, steps: u32) {
    for _ in 0..steps {
        drive.step(f64::from(*step) * 1e-3, 1e-3).unwrap();
        *step += 1;
    }
}

fn seen(drive: &mut Instance) -> Vec<Value> {
    let variables = drive.variables().to_vec();
    variables.iter().map(|variable| drive.get(variable.reference).unwrap()).collect()
}

#[test]
fn a_drive_goes_on_from_its_state_and_from_its_bytes() {
    let (mut drive, mut step) = turning();
    let state = SavedState::of(&drive).unwrap();
    let bytes = state.bytes().unwrap();
    let begin = step;
    drive.set(10, Value::Float64(1.5)).unwrap();
    run(&mut drive, &mut step, 600);
    let expected = seen(&mut drive);
    let Value::Float64(velocity) = drive.get(201).unwrap() else { panic!() };
    assert!(velocity.abs() > 5.0, "60 r/min are 6.28 rad/s, not {velocity}");

    let mut other = Instance::of(drive_config(), ".".as_ref(), false).unwrap();
    let read = SavedState::from_bytes(&bytes, &other).unwrap();
    for taken in [&state, &read] {
        taken.restore(&mut other).unwrap();
        let mut step = begin;
        other.set(10, Value::Float64(1.5)).unwrap();
        run(&mut other, &mut step, 600);
        assert_eq!(seen(&mut other), expected);
    }
    assert_eq!(read.bytes().unwrap(), bytes);
}

fn drive_config() -> ferrodrive_fmu::config::Config {
    drive("zlac8030l@4,timing=ideal", TxClock::Triggered)
}

#[test]
fn bytes_that_are_torn_or_of_another_fmu_are_refused() {
    let drive = instance(drive_config());
    let bytes = SavedState::of(&drive).unwrap().bytes().unwrap();
    for place in 0..bytes.len() {
        let mut torn = bytes.clone();
        torn[place] ^= 1;
        assert!(SavedState::from_bytes(&torn, &drive).is_err(), "byte {place}");
        assert!(SavedState::from_bytes(&bytes[..place], &drive).is_err(), "{place} bytes");
    }
    let bus = instance(bus(2, TxClock::Triggered));
    let refusal = SavedState::from_bytes(&bytes, &bus).err().unwrap().to_string();
    assert!(refusal.contains("it is of ferrodrive-"), "{refusal}");
}

/// What is written of a state: token, actions, and ports, mode, start and time.
type Written = (String, Vec<Action>, (Vec<(Option<Vec<u8>>, Vec<u8>, bool)>, Mode, f64, u64));

/// What is changed of it.
type Change<'a> = &'a dyn Fn(&mut Written);

/// The bytes of a state in which something was changed, with the right check sum.
fn forged(bytes: &[u8], change: impl FnOnce(&mut Written)) -> Vec<u8> {
    let mut written: Written = rmp_serde::from_slice(&bytes[4..]).unwrap();
    change(&mut written);
    let body = rmp_serde::to_vec(&written).unwrap();
    [crc32fast::hash(&body).to_le_bytes().as_slice(), &body].concat()
}

/// Also with the right check sum: what cannot have been done to an instance is refused, and says what.
#[test]
fn bytes_of_what_cannot_have_been_are_refused() {
    let (drive, _) = turning();
    let bytes = SavedState::of(&drive).unwrap().bytes().unwrap();
    let refusal = |change: Change<'_>| {
        let refused = SavedState::from_bytes(&forged(&bytes, change), &drive).err();
        refused.map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(refusal(&|_| ()), "");
    let set = |reference, value: Value| move |it: &mut Written| it.1.push(Action::Set(reference, value.clone()));
    let nan = Value::Float64(f64::NAN);
    let cases: [(Change<'_>, &str); 14] = [
        (&|it| it.1.push(Action::Begin), "its time begins twice"),
        (&|it| it.1.retain(|action| *action != Action::Begin), "time passes before it begins"),
        (&|it| it.1.insert(0, Action::Serve), "time passes before it begins"),
        (&|it| it.1.push(Action::Advance(1)), "its time goes from 625000000 ns to 1 ns"),
        (&|it| it.1.push(Action::Advance(u64::MAX)), "its time goes from 625000000 ns to 18446744073709551615 ns"),
        (&|it| it.2.3 += 1, "it stands at 625000001 ns; what was done ends at 625000000 ns"),
        (&|it| it.2.1 = Mode::Initialization, "in the mode Initialization"),
        (&|it| it.2.2 = f64::NAN, "start time"),
        (&|it| it.2.0.clear(), "networks"),
        (&set(10, nan), "load_torque cannot be NaN"),
        (&set(10, Value::Float64(1e9)), "load_torque: "),
        (&set(10, Value::UInt64(1)), "load_torque is a Float64, not a UInt64"),
        (&set(6, Value::UInt64(4)), "seed is a parameter"),
        (&set(2, Value::Binary(Vec::new())), "variable 2 is not set by itself"),
    ];
    for (change, expected) in cases {
        let refusal = refusal(change);
        assert!(
            refusal.starts_with("not a state of this FMU: ") && refusal.contains(expected),
            "{expected}: {refusal}"
        );
    }
}

#[test]
fn a_bus_goes_on_from_its_bytes() {
    let mut bus = instance(bus(2, TxClock::Triggered));
    bus.exit_initialization().unwrap();
    let mut bytes = Vec::new();
    Operation::Transmit("123#0011223344556677".parse().unwrap()).write(&mut bytes);
    bus.set(1001, Value::Binary(bytes)).unwrap();
    bus.update().unwrap();
    bus.enter_step().unwrap();
    // In the middle of the frame, which begins when 11 recessive bits have passed.
    bus.step(0.0, 1e-4).unwrap();
    let saved = SavedState::from_bytes(&SavedState::of(&bus).unwrap().bytes().unwrap(), &bus).unwrap();
    // It has gone on, so that a state that is not taken back is seen: time would not stand at its begin.
    for _ in 0..2 {
        bus.step(1e-4, 9e-4).unwrap();
        assert_eq!(bus.get(10).unwrap(), Value::UInt64(1));
        saved.restore(&mut bus).unwrap();
        assert_eq!(bus.get(10).unwrap(), Value::UInt64(0));
        assert_eq!(bus.get(0).unwrap(), Value::Float64(1e-4));
    }
}

/// A step that does not fit the drive's own deadlines.
const ODD_S: f64 = 3e-4;

/// What it sent and when it was due next, in odd steps; with `reads`, it is looked at in each.
fn booting(drive: &mut Instance, steps: std::ops::Range<u32>, reads: bool) -> Vec<(Vec<u8>, Interval)> {
    let step = |step| {
        drive.enter_step().unwrap();
        drive.step(f64::from(step) * ODD_S, ODD_S).unwrap();
        drive.enter_event().unwrap();
        if reads {
            drive.get(208).unwrap();
        }
        let due = drive.interval(3).unwrap();
        if due == Interval::In(0) {
            drive.set_clock(3, true).unwrap();
        }
        let sent = binary(drive, 4);
        drive.update().unwrap();
        (sent, due)
    };
    steps.map(step).collect()
}

/// A read moves on when the drive finds that it has booted: that is part of what its bytes are of.
#[test]
fn a_drive_that_is_read_while_it_boots_goes_on_from_its_bytes() {
    let begun = || {
        let mut drive = instance(drive("zlac8030l@4", TxClock::Countdown));
        drive.exit_initialization().unwrap();
        drive.set_clock(3, true).unwrap();
        drive
    };
    let sent = booting(&mut begun(), 0..5_000, true);
    let booted = sent.iter().position(|(sent, _)| !sent.is_empty()).unwrap() as u32;
    let mut first = begun();
    booting(&mut first, 0..booted - 1, true);
    for until in booted - 1..booted + 3 {
        let mut other = begun();
        SavedState::from_bytes(&SavedState::of(&first).unwrap().bytes().unwrap(), &other)
            .unwrap()
            .restore(&mut other)
            .unwrap();
        assert_eq!(other.interval(3), first.interval(3), "{until}");
        let end = booted + 100;
        let mut going = first.copy().unwrap();
        assert_eq!(booting(&mut other, until..end, false), booting(&mut going, until..end, false), "{until}");
        assert_eq!(seen(&mut other), seen(&mut going), "{until}");
        booting(&mut first, until..until + 1, true);
    }
}

/// Steps, and inputs that are set to what they are, leave nothing behind; a state from bytes is still the same.
#[test]
fn a_state_does_not_grow_with_steps_and_with_inputs_that_stay() {
    let (mut drive, mut step) = turning();
    let size = SavedState::of(&drive).unwrap().bytes().unwrap().len();
    for _ in 0..2_000 {
        drive.set(10, Value::Float64(0.0)).unwrap();
        drive.set(100, Value::Boolean(false)).unwrap();
        run(&mut drive, &mut step, 1);
        drive.get(208).unwrap();
    }
    let grown = SavedState::of(&drive).unwrap().bytes().unwrap();
    assert!(grown.len() < size + 500, "{size} bytes have become {}", grown.len());
    let mut other = instance(drive_config());
    SavedState::from_bytes(&grown, &other).unwrap().restore(&mut other).unwrap();
    assert_eq!(seen(&mut other), seen(&mut drive));
    let mut begin = step;
    run(&mut drive, &mut step, 300);
    run(&mut other, &mut begin, 300);
    assert_eq!(seen(&mut other), seen(&mut drive));
}

/// A step of no time after what is due was done: what it has to send then is in its bytes.
#[test]
fn a_step_of_no_time_takes_nothing_away() {
    let mut drive = instance(drive("zlac8030l@4", TxClock::Countdown));
    drive.exit_initialization().unwrap();
    drive.set_clock(3, true).unwrap();
    let mut now_ns = 0;
    let take = |drive: &mut Instance| {
        drive.set_clock(3, true).unwrap();
        binary(drive, 4)
    };
    // From deadline to deadline, until one has it say that it has booted.
    loop {
        drive.update().unwrap();
        let mut ahead = drive.copy().unwrap();
        let Interval::In(nanos) = drive.interval(3).unwrap() else { panic!() };
        if nanos == 0 && !take(&mut ahead).is_empty() {
            break;
        }
        drive.enter_step().unwrap();
        drive.step(now_ns as f64 / 1e9, nanos as f64 / 1e9).unwrap();
        drive.enter_event().unwrap();
        now_ns += nanos;
    }
    drive.enter_step().unwrap();
    drive.step(now_ns as f64 / 1e9, 0.0).unwrap();
    drive.enter_event().unwrap();
    let mut other = drive.copy().unwrap();
    SavedState::from_bytes(&SavedState::of(&drive).unwrap().bytes().unwrap(), &drive)
        .unwrap()
        .restore(&mut other)
        .unwrap();
    let sent = take(&mut drive);
    assert!(!sent.is_empty());
    assert_eq!(take(&mut other), sent);
}
