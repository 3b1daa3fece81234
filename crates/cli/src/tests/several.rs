//! `state all`, `enable all`, `disable all` and `reset all`.

use cia402::PowerState;

use super::virtual_bus::VirtualBus;

fn state(bench: &VirtualBus, node: u8) -> Option<PowerState> {
    bench.report(node).state
}

#[test]
fn every_drive_is_enabled_and_disabled_at_once() {
    let bench = VirtualBus::of(&["zlac8030l@4", "cia402@5", "m4230e17b50@6", "io401@7"]);
    let enabled = bench.json(&["enable", "all"]);
    let rows = enabled["nodes"].as_array().unwrap();
    // A device of inputs and outputs has no statusword.
    assert_eq!(rows.iter().map(|row| &row["node"]).collect::<Vec<_>>(), [4, 5, 6], "{enabled}");
    assert!(rows.iter().all(|row| row["state"]["state"] == "Operation enabled" && row["why"].is_null()), "{enabled}");
    assert_eq!([4, 5].map(|node| state(&bench, node)), [Some(PowerState::OperationEnabled); 2]);
    let shown = bench.done(&["state", "all"]).out;
    assert!([4, 5, 6].iter().all(|node| shown.contains(&format!("node {node}"))), "{shown}");
    bench.done(&["disable", "all"]);
    assert!([4, 5].iter().all(|node| state(&bench, *node) != Some(PowerState::OperationEnabled)));
}

#[test]
fn a_drive_whose_fault_stays_is_named_and_the_others_are_reset() {
    let bench =
        VirtualBus::of(&["zlac8030l@4", "zlac8030l@5"]).with(&["--model", "4=zlac8030l", "--model", "5=zlac8030l"]);
    bench.apply(4, "fault hall on");
    bench.apply(5, "fault hall on");
    bench.pass(std::time::Duration::from_millis(200));
    bench.apply(5, "fault hall off");
    assert_eq!([4, 5].map(|node| state(&bench, node)), [Some(PowerState::Fault); 2]);
    let ended = bench.run(&["--json", "reset", "all"]);
    let said = ended.json();
    assert_eq!(
        (ended.status, &said["ok"], &said["error"]["kind"]),
        (Some(1), &false.into(), &"not_all".into()),
        "{said}"
    );
    assert!(said["nodes"][0]["why"].as_str().is_some_and(|why| why.contains("Hall")), "{said}");
    assert_eq!(said["nodes"][1]["state"]["fault_code"], 0, "{said}");
    assert_eq!([4, 5].map(|node| state(&bench, node) == Some(PowerState::Fault)), [true, false]);
    bench.refused(&["reset", "all"], &["node 4: the fault was not reset", "ferrodrive explain 4"]);
    // A node of the machine that does not answer is not passed over.
    bench.apply(5, "cable cut");
    bench.pass(std::time::Duration::from_millis(50));
    bench.refused(&["disable", "all"], &["5", "may still have power"]);
}

#[test]
fn a_bus_without_a_drive_is_said() {
    let bench = VirtualBus::of(&["io401@7"]);
    bench.refused(&["enable", "all"], &["no drive answers"]);
}
