//! Mutated operations: an answer by the standard, and no panic.

use ferrodrive_fmu::config::TxClock;
use ferrodrive_fmu::operation::{Operation, operations};
use ferrodrive_fmu::variable::Value;
use proptest::prelude::*;
use proptest::strategy::ValueTree;

use crate::importer::{binary, bus, drive, instance};

fn any_bytes() -> impl Strategy<Value = Vec<u8>> {
    let frame =
        (any::<u32>(), any::<bool>(), proptest::collection::vec(any::<u8>(), 0..12)).prop_map(|(id, wide, data)| {
            let mut bytes = vec![0x10, 0, 0, 0, 16 + data.len() as u8, 0, 0, 0];
            bytes.extend(id.to_le_bytes());
            bytes.extend([wide.into(), 0, data.len() as u8, 0]);
            bytes.extend(data);
            bytes
        });
    let setting = (
        prop_oneof![Just(0x20u8), Just(0x30), Just(0x31), Just(0x40), Just(0x41), Just(0x42), any::<u8>()],
        proptest::collection::vec(any::<u8>(), 0..8),
    )
        .prop_map(|(code, content)| {
            let mut bytes = vec![code, 0, 0, 0, 8 + content.len() as u8, 0, 0, 0];
            bytes.extend(content);
            bytes
        });
    let one = prop_oneof![frame, setting, proptest::collection::vec(any::<u8>(), 0..40)];
    let several = proptest::collection::vec(one, 1..4).prop_map(|all| all.concat());
    (several, proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..3)).prop_map(
        |(mut bytes, changes)| {
            if !bytes.is_empty() {
                changes.into_iter().for_each(|(place, value)| {
                    let place = place.index(bytes.len());
                    bytes[place] = value;
                });
            }
            bytes
        },
    )
}

/// 10,000 mutated buffers, each to a drive and a bus: what comes out of a drive and of a bus are whole operations, whatever comes in.
#[test]
fn ten_thousand_buffers_are_taken_or_answered_with_a_format_error() {
    let mut drive = instance(drive("zlac8030l@4,timing=ideal", TxClock::Triggered));
    let mut bus = instance(bus(3, TxClock::Triggered));
    drive.exit_initialization().unwrap();
    bus.exit_initialization().unwrap();
    let mut time = 0.0;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let strategy = any_bytes();
    for case in 0..10_000 {
        let bytes = strategy.new_tree(&mut runner).unwrap().current();
        drive.set(2, Value::Binary(bytes.clone())).unwrap();
        bus.set(1001 + 5 * (case % 3), Value::Binary(bytes.clone())).unwrap();
        let wrong = operations(&bytes).filter(Result::is_err).count();
        for instance in [&mut drive, &mut bus] {
            instance.update().unwrap();
        }
        let answered = answers(&binary(&mut drive, 4));
        assert_eq!(answered, wrong, "{bytes:02X?}");
        assert!(answers(&binary(&mut bus, 1003 + 5 * (case % 3))) >= wrong, "{bytes:02X?}");
        for instance in [&mut drive, &mut bus] {
            instance.enter_step().unwrap();
            instance.step(time, 2e-3).unwrap();
            instance.enter_event().unwrap();
        }
        assert!(operations(&binary(&mut drive, 4)).all(|operation| operation.is_ok()));
        time = f64::from(case + 1) * 2e-3;
    }
}

/// How many format errors are among these operations, which are whole.
fn answers(bytes: &[u8]) -> usize {
    operations(bytes).filter(|operation| matches!(operation.as_ref().unwrap(), Operation::FormatError(_))).count()
}
