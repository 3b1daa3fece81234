//! A state that is taken back, as a value and as bytes, goes on as if nothing had happened.

use ferrodrive_fmu::config::TxClock;
use ferrodrive_fmu::instance::Instance;
use ferrodrive_fmu::operation::Operation;
use ferrodrive_fmu::state::SavedState;
use ferrodrive_fmu::variable::Value;

use crate::importer::{bus, drive, instance};

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
    let state = SavedState::of(&drive);
    let bytes = state.bytes();
    let begin = step;
    drive.set(10, Value::Float64(1.5)).unwrap();
    run(&mut drive, &mut step, 600);
    let expected = seen(&mut drive);
    let Value::Float64(velocity) = drive.get(201).unwrap() else { panic!() };
    assert!(velocity.abs() > 5.0, "60 r/min are 6.28 rad/s, not {velocity}");

    let mut other = Instance::of(drive_config(), ".".as_ref(), false).unwrap();
    let read = SavedState::from_bytes(&bytes, &other).unwrap();
    for taken in [&state, &read] {
        taken.restore(&mut other);
        let mut step = begin;
        other.set(10, Value::Float64(1.5)).unwrap();
        run(&mut other, &mut step, 600);
        assert_eq!(seen(&mut other), expected);
    }
    assert_eq!(read.bytes(), bytes);
}

fn drive_config() -> ferrodrive_fmu::config::Config {
    drive("zlac8030l@4,timing=ideal", TxClock::Triggered)
}

#[test]
fn bytes_that_are_torn_or_of_another_fmu_are_refused() {
    let drive = instance(drive_config());
    let bytes = SavedState::of(&drive).bytes();
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
    let saved = SavedState::from_bytes(&SavedState::of(&bus).bytes(), &bus).unwrap();
    saved.restore(&mut bus);
    bus.step(1e-4, 9e-4).unwrap();
    assert_eq!(bus.get(10).unwrap(), Value::UInt64(1));
}
