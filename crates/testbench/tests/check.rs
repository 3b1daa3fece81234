//! `check`: the bus of the handbook is clean, and each trap that was met with other masters is found where it stands.

use std::fmt::Write as _;
use std::path::PathBuf;

use canopen::NodeId;
use eds::Sheet;
use testbench::check::{Checked, Finding, Severity, of_bus_yml};
use testbench::models;

/// A folder with the data sheets of these models.
fn sheets(name: &str, of: &[&str]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("ferrodrive-check-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for model in of {
        let description = models::resolve(model).unwrap();
        let sheet = eds::write(&Sheet::of(description).eds());
        std::fs::write(folder.join(format!("{model}.eds")), sheet).unwrap();
    }
    folder
}

fn rules(checked: &Checked) -> Vec<(&str, Severity)> {
    checked.findings.iter().map(|finding| (finding.rule, finding.severity)).collect()
}

/// A bus with one node, at 4, that has these lines.
fn bus(model: &str, lines: &[&str]) -> String {
    let mut text = "master:\n  node_id: 127\n  sync_period: 20000\n  heartbeat_producer: 100\n".to_owned();
    let _ = write!(text, "drive:\n  node_id: 4\n  dcf: {model}.eds\n");
    lines.iter().for_each(|line| text += &format!("  {line}\n"));
    text
}

const BEATS: &str = "heartbeat_producer: 200";
const CONSUMES: &str = "heartbeat_consumer: true";
const NO_RPDO4: &str = "rpdo: {4: {enabled: false}}";
const DRIVER_402: &str = "driver: 'ros2_canopen::Cia402Driver'";

#[test]
fn the_bus_of_the_handbook_has_no_error_and_no_warning() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/handbook/ros2-canopen.md");
    let page = std::fs::read_to_string(page).unwrap();
    let yaml = page.split("```yaml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let checked = of_bus_yml(yaml, &sheets("page", &["zlac8030l"])).unwrap();
    let bad: Vec<&Finding> = checked.findings.iter().filter(|finding| finding.severity != Severity::Note).collect();
    assert!(bad.is_empty(), "{bad:#?}");
    assert_eq!((checked.nodes[0].node, checked.nodes[0].name.as_str()), (Some(4), "wheel"));
    assert!(checked.nodes[0].device.as_ref().unwrap().contains("ZLAC8030L"));
}

/// What was met with Lely's master, its generator and ros2_canopen's CiA 402 driver.
#[test]
fn each_trap_is_found_at_its_line_and_is_gone_without_it() {
    const J: &str = "m4230e17b50";
    const Z: &str = "zlac8030l";
    const L: &str = "zlim42c";
    let folder = sheets("traps", &[J, Z, L]);
    // Model, the lines that are right, the line that is not, the line of the finding, and its rule.
    let traps: [(&str, &[&str], &str, &str, Severity); 12] = [
        (Z, &[], "heartbeat_producer: 1000", "heartbeat", Severity::Warning),
        (Z, &[], "heartbeat_producer: 0", "heartbeat", Severity::Warning),
        (Z, &[BEATS], "boot_timeout_ms: 1000", "boot-timeout", Severity::Error),
        (J, &[BEATS, NO_RPDO4], "heartbeat_consumer: false", "host-watch", Severity::Error),
        (Z, &[BEATS], DRIVER_402, "supported-modes", Severity::Error),
        (L, &[BEATS], DRIVER_402, "supported-modes", Severity::Error),
        (J, &[BEATS, CONSUMES, NO_RPDO4], DRIVER_402, "cia402-driver", Severity::Error),
        (
            J,
            &[BEATS, CONSUMES, NO_RPDO4],
            "tpdo: {1: {mapping: [{index: 0x6041, sub_index: 0}]}}",
            "fixed-mapping",
            Severity::Error,
        ),
        (
            Z,
            &[BEATS],
            "tpdo: {1: {enabled: true, transmission: 255, mapping: [{index: 0x606C, sub_index: 0}]}}",
            "flood",
            Severity::Warning,
        ),
        (Z, &[BEATS], "sdo: [{index: 0x100C, sub_index: 0, value: 100}]", "node-guarding", Severity::Error),
        (Z, &[BEATS], "tpdo: {9: {enabled: true}}", "pdo-number", Severity::Error),
        (Z, &[BEATS], "heartbeat_multiplyer: 3", "shape", Severity::Warning),
    ];
    for (model, right, wrong, rule, severity) in traps {
        // Where a line that is missing is wrong too, the right one stands in its place.
        let mended = match rule {
            "heartbeat" => Some(BEATS),
            "host-watch" => Some(CONSUMES),
            _ => None,
        };
        let clean = of_bus_yml(&bus(model, &[right, mended.as_slice()].concat()), &folder).unwrap();
        assert!(!rules(&clean).contains(&(rule, severity)), "{model} {right:?}: {:#?}", clean.findings);
        let lines = [right, &[wrong]].concat();
        let checked = of_bus_yml(&bus(model, &lines), &folder).unwrap();
        let found = checked.findings.iter().find(|finding| (finding.rule, finding.severity) == (rule, severity));
        let found = found.unwrap_or_else(|| panic!("{model} {wrong}: {:#?}", checked.findings));
        assert_eq!(found.at.line, 7 + lines.len(), "{wrong}: {found:?}");
        assert!(!found.next.is_empty(), "{found:?}");
    }
    // As delivered: RPDO4 of a joint goes out with each SYNC, and holds it at 0.
    let joint = |lines: &[&str]| of_bus_yml(&bus(J, lines), &folder).unwrap();
    assert!(rules(&joint(&[BEATS, CONSUMES])).contains(&("set-point-by-sync", Severity::Error)));
    assert!(!rules(&joint(&[BEATS, CONSUMES, NO_RPDO4])).contains(&("set-point-by-sync", Severity::Error)));
    assert!(rules(&joint(&[BEATS])).contains(&("host-watch", Severity::Error)), "a line that is missing is a trap too");
    // A master at the node-ID that a joint has as delivered.
    let at_1 = bus(J, &[BEATS, CONSUMES, NO_RPDO4]).replace("node_id: 127", "node_id: 1");
    let found = of_bus_yml(&at_1, &folder).unwrap();
    assert!(rules(&found).contains(&("node-id", Severity::Warning)), "{:#?}", found.findings);
    assert_eq!(NodeId::new(1), models::resolve(J).unwrap().node_id);
}

#[test]
fn what_is_no_bus_is_told_with_its_line() {
    let folder = sheets("shapes", &["zlac8030l"]);
    let twice = bus("zlac8030l", &[BEATS]) + "other:\n  node_id: 4\n  dcf: zlac8030l.eds\n  heartbeat_producer: 200\n";
    let no_sheet = bus("nothing", &[BEATS]);
    let no_number = bus("zlac8030l", &["heartbeat_producer: soon"]);
    for (text, rule, line) in [
        (twice.as_str(), "node-id", 10),
        (no_sheet.as_str(), "data-sheet", 7),
        (no_number.as_str(), "shape", 8),
        ("drive:\n  node_id: 4\n", "shape", 1),
        ("master:\n  node_id: 200\ndrive: 5\n", "node-id", 2),
        ("- a\n- b\n", "shape", 1),
    ] {
        let checked = of_bus_yml(text, &folder).unwrap();
        let found = checked.findings.iter().find(|finding| finding.rule == rule && finding.severity == Severity::Error);
        let found = found.unwrap_or_else(|| panic!("{text}: {:#?}", checked.findings));
        assert_eq!(found.at.line, line, "{text}: {found:?}");
    }
    // A sheet that is no file but a folder.
    let folder_as_sheet = bus("zlac8030l", &[]).replace("zlac8030l.eds", ".");
    assert!(rules(&of_bus_yml(&folder_as_sheet, &folder).unwrap()).contains(&("data-sheet", Severity::Error)));
}

#[test]
fn hostile_files_are_refused_and_cost_little() {
    let folder = sheets("hostile", &[]);
    let mut bomb = "a0: &a0 [x, x, x, x, x, x, x, x]\n".to_owned();
    for level in 1..20 {
        let _ = writeln!(bomb, "a{level}: &a{level} [{}]", vec![format!("*a{}", level - 1); 8].join(", "));
    }
    let nested: String = (0..1000).map(|depth| " ".repeat(depth) + "a:\n").collect();
    for (text, part) in [
        (bomb, "alias"),
        ("[".repeat(100_000), "recursion"),
        ("a: {".repeat(100_000), ""),
        ("master:\n  node_id: [1\n".to_owned(), "expected"),
        ("master: {node_id: 1}\nmaster: {node_id: 2}\n".to_owned(), "uplicate"),
        (String::new(), "empty"),
        ("a: 1\n---\nb: 2\n".to_owned(), "second document"),
    ] {
        let bad = of_bus_yml(&text, &folder).unwrap_err().to_string();
        assert!(bad.contains(part) && bad.len() < 1000, "{part}: {bad}");
    }
    // Depth alone is no error of YAML; it has no master.
    if let Ok(checked) = of_bus_yml(&nested, &folder) {
        assert!(rules(&checked).contains(&("shape", Severity::Error)));
    }
}
