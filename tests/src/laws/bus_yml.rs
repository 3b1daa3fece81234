//! A `bus.yml`: any text is taken, or refused with a place; what is found has a place in it and says what to do; and a bus of few
//! nodes that is whole can be booted in virtual time.

use machine::check::{Checked, of_bus_yml, of_machine};
use tempfile::TempDir;

pub(super) const SAMPLES: &[&[u8]] = &[
    b"options: {heartbeat_multiplier: 3.0}\nmaster:\n  node_id: 127\n  sync_period: 20000\n  heartbeat_producer: 100\n  start_all_nodes: true\n\
      wheel:\n  node_id: 4\n  dcf: wheel.eds\n  driver: 'ros2_canopen::ProxyDriver'\n  heartbeat_producer: 200\n  mandatory: true\n\
      \x20 tpdo:\n    1: {enabled: true, cob_id: auto, transmission: 1, inhibit_time: 5, mapping: [{index: 0x6041, sub_index: 0}, {index: 0x6064}]}\n\
      \x20 rpdo: {1: {cob_id: 0x234, mapping: [{index: 0x6040}]}, 4: {enabled: false}}\n  sdo: [{index: 0x6083, sub_index: 0, value: 150}]\n",
    b"master: {node_id: 1, baudrate: 250}\ndefaults: {dcf: wheel.eds, boot: no, reset_communication: off}\nnodes:\n  a: {node_id: 2, revision_number: 7}\n\
      \x20 b: {node_id: 3, serial_number: 9, restore_configuration: 1, heartbeat_consumer: yes, guard_time: 100}\n",
    b"[[drive]]\nmodel = 'zlac8030l'\nnode = 4\nheartbeat = '200ms'\n[drive.pdos]\ntpdo1 = { objects = ['statusword'], type = 1 }\n",
];

/// A boot-up in virtual time is worth some ten thousand readings of a file.
const MOST_NODES: usize = 2;

thread_local! {
    /// A folder with the data sheet that the samples name.
    static FOLDER: TempDir = with_data_sheet();
}

pub(super) fn bus_yml(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for read in FOLDER.with(|folder| [of_bus_yml(&text, folder.path()), of_machine(&text, folder.path())]) {
        match read {
            Ok(mut checked) => {
                let whole = checked.intended.as_ref().is_ok_and(|intended| intended.nodes.len() <= MOST_NODES);
                if whole {
                    let _ = checked.predict();
                }
                assert_reported(&checked, &text);
            }
            Err(bad) => assert!(!bad.problems.is_empty() && bad.to_string().len() < 200_000),
        }
    }
}

fn assert_reported(checked: &Checked, text: &str) {
    // A carriage return alone ends a line too (YAML 1.2, 5.4).
    let lines = text.split(['\n', '\r']).count();
    for finding in &checked.findings {
        assert!((1..=lines + 1).contains(&finding.at.line) && finding.at.column > 0, "{finding:?}");
        assert!(!finding.what.is_empty() && !finding.next.is_empty(), "{finding:?}");
    }
    assert!(checked.findings.len() <= 1000, "a list too long to read");
}

/// Made once in a thread: a boundary is tried with many texts.
fn with_data_sheet() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let sheet = devices::model("zlac8030l").map(|model| eds::write(&eds::Sheet::of(model).eds()));
    std::fs::write(folder.path().join("wheel.eds"), sheet.unwrap_or_default()).expect("written");
    folder
}
