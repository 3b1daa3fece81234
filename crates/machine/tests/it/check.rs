//! `check`: the bus of the handbook is clean, and each trap that was met with other masters is found where it stands.

use std::fmt::Write as _;
use std::path::Path;

use std::time::Duration;

use can::Bitrate;
use canopen::{Mux, NodeId};
use eds::Sheet;
use machine::check::{Checked, Finding, LiveNode, Place, Severity, of_bus_yml, of_machine};
use master::Network;
use sim::machine::{Order, order};
use sim::wire::WireEvent;
use sim::{World, block_on};
use tempfile::TempDir;
use words::models;

/// A folder with the data sheets of these models.
fn sheets(of: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for model in of {
        let description = models::resolve(model).unwrap();
        let sheet = eds::write(&Sheet::of(description).eds());
        std::fs::write(folder.path().join(format!("{model}.eds")), sheet).unwrap();
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
    let checked = of_bus_yml(yaml, sheets(&["zlac8030l"]).path()).unwrap();
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
    let folder = sheets(&[J, Z, L]);
    // Model, the lines that are right, the line that is not, the line of the finding, and its rule.
    let traps: [(&str, &[&str], &str, &str, Severity); 17] = [
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
        (Z, &[BEATS], "guard_time: 100", "node-guarding", Severity::Error),
        (Z, &[BEATS], "sdo: [{index: 0x2999, value: 1}]", "sdo-object", Severity::Error),
        (Z, &[BEATS], "sdo: [{index: 0x6041, value: 1}]", "sdo-object", Severity::Error),
        (Z, &[BEATS], "sdo: [{index: 0x6083, value: 0x100000000}]", "sdo-object", Severity::Error),
        (Z, &[BEATS], "sdo: [{index: 0x6083, value: -1}]", "sdo-object", Severity::Error),
    ];
    for (model, right, wrong, rule, severity) in traps {
        // Where a line that is missing is wrong too, it is replaced by the right one.
        let mended = match rule {
            "heartbeat" => Some(BEATS),
            "host-watch" => Some(CONSUMES),
            _ => None,
        };
        let clean = of_bus_yml(&bus(model, &[right, mended.as_slice()].concat()), folder.path()).unwrap();
        assert!(!rules(&clean).contains(&(rule, severity)), "{model} {right:?}: {:#?}", clean.findings);
        let lines = [right, &[wrong]].concat();
        let checked = of_bus_yml(&bus(model, &lines), folder.path()).unwrap();
        let found = checked.findings.iter().find(|finding| (finding.rule, finding.severity) == (rule, severity));
        let found = found.unwrap_or_else(|| panic!("{model} {wrong}: {:#?}", checked.findings));
        assert_eq!(found.at.line, 7 + lines.len(), "{wrong}: {found:?}");
        assert!(!found.next.is_empty(), "{found:?}");
    }
    // As delivered: RPDO4 of a joint goes out with each SYNC, and holds it at 0.
    let joint = |lines: &[&str]| of_bus_yml(&bus(J, lines), folder.path()).unwrap();
    assert!(rules(&joint(&[BEATS, CONSUMES])).contains(&("set-point-by-sync", Severity::Error)));
    assert!(!rules(&joint(&[BEATS, CONSUMES, NO_RPDO4])).contains(&("set-point-by-sync", Severity::Error)));
    assert!(rules(&joint(&[BEATS])).contains(&("host-watch", Severity::Error)), "a line that is missing is a trap too");
    // A master at the node-ID that a joint has as delivered.
    let at_1 = bus(J, &[BEATS, CONSUMES, NO_RPDO4]).replace("node_id: 127", "node_id: 1");
    let found = of_bus_yml(&at_1, folder.path()).unwrap();
    assert!(rules(&found).contains(&("node-id", Severity::Warning)), "{:#?}", found.findings);
    assert_eq!(NodeId::new(1), models::resolve(J).unwrap().node_id);
}

#[test]
fn what_is_not_a_bus_is_reported_with_its_line() {
    let folder = sheets(&["zlac8030l"]);
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
        let checked = of_bus_yml(text, folder.path()).unwrap();
        let found = checked.findings.iter().find(|finding| finding.rule == rule && finding.severity == Severity::Error);
        let found = found.unwrap_or_else(|| panic!("{text}: {:#?}", checked.findings));
        assert_eq!(found.at.line, line, "{text}: {found:?}");
    }
    // A sheet that is a folder.
    let folder_as_sheet = bus("zlac8030l", &[]).replace("zlac8030l.eds", ".");
    assert!(rules(&of_bus_yml(&folder_as_sheet, folder.path()).unwrap()).contains(&("data-sheet", Severity::Error)));
}

#[test]
fn hostile_files_are_refused_and_cost_little() {
    let folder = sheets(&[]);
    let mut bomb = "a0: &a0 [x, x, x, x, x, x, x, x]\n".to_owned();
    for level in 1..20 {
        let _ = writeln!(bomb, "a{level}: &a{level} [{}]", vec![format!("*a{}", level - 1); 8].join(", "));
    }
    for (text, part) in [
        (bomb, "alias"),
        ("[".repeat(100_000), "recursion"),
        ("a: {".repeat(100_000), ""),
        ("master:\n  node_id: [1\n".to_owned(), "expected"),
        ("master: {node_id: 1}\nmaster: {node_id: 2}\n".to_owned(), "uplicate"),
        ((0..1000).map(|depth| " ".repeat(depth) + "a:\n").collect(), "indented"),
        ("- ".repeat(100_000), "indented"),
        ("? ".repeat(100_000), "indented"),
        (String::new(), "empty"),
        ("a: 1\n---\nb: 2\n".to_owned(), "second document"),
    ] {
        let bad = of_bus_yml(&text, folder.path()).unwrap_err().to_string();
        assert!(bad.contains(part) && bad.len() < 1000, "{part}: {bad}");
    }
}

const J: &str = "m4230e17b50";
const Z: &str = "zlac8030l";

/// Rule, severity, line.
fn placed(checked: &Checked) -> Vec<(&str, Severity, usize)> {
    checked.findings.iter().map(|finding| (finding.rule, finding.severity, finding.at.line)).collect()
}

#[test]
fn the_bus_of_the_handbook_boots_in_virtual_time() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/handbook/ros2-canopen.md");
    let page = std::fs::read_to_string(page).unwrap();
    let yaml = page.split("```yaml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let mut checked = of_bus_yml(yaml, sheets(&[Z]).path()).unwrap();
    let predicted = checked.predict().unwrap();
    let wheel = &predicted.nodes[0];
    assert_eq!((wheel.node, wheel.letter, wheel.state.as_deref()), (4, None, Some("operational")));
    // 1017h is the one value of the file that the sheet does not have already.
    assert_eq!(wheel.writes, 1);
    assert!(!rules(&checked).iter().any(|(_, severity)| *severity == Severity::Error), "{:#?}", checked.findings);
    let sent = |frame: &str| predicted.frames.iter().find(|row| row.frame == frame).map(|row| row.every_us);
    assert_eq!((sent("SYNC"), sent("TPDO1")), (Some(20_000.0), None), "as delivered it sends no TPDO");
    let beats: Vec<_> = predicted.frames.iter().filter(|row| row.frame == "heartbeat").collect();
    assert_eq!(
        beats.iter().map(|row| (row.node, row.every_us)).collect::<Vec<_>>(),
        [(Some(4), 200_000.0), (Some(127), 100_000.0)]
    );
}

/// What `dcfgen` of Lely core 2.3 writes for such a node: its manual's order, off, parameters, mapping, on; 1016h before all.
#[test]
fn what_the_generator_writes_is_predicted_in_its_order() {
    let lines = [
        BEATS,
        CONSUMES,
        "tpdo: {1: {enabled: true, cob_id: auto, transmission: 1, mapping: [{index: 0x6041}, {index: 0x6064}]}, 2: {enabled: false}}",
        "rpdo: {1: {cob_id: 0x234, mapping: [{index: 0x6040}]}}",
        "sdo: [{index: 0x2000, value: 500}]",
    ];
    let checked = of_bus_yml(&bus("cia402", &lines), sheets(&["cia402"]).path()).unwrap();
    let intended = checked.intended.as_ref().unwrap();
    let node = intended.nodes.values().next().unwrap();
    let wrote: Vec<(String, Vec<u8>)> =
        node.writes.iter().map(|write| (write.object.to_string(), write.bytes.clone())).collect();
    let u32s = |value: u32| value.to_le_bytes().to_vec();
    let expected: Vec<(&str, Vec<u8>)> = vec![
        // Node 127, three heartbeats of 100 ms.
        ("1016h:01", u32s(127 << 16 | 300)),
        ("1017h:00", vec![200, 0]),
        ("1400h:01", u32s(0x8000_0234)),
        ("1600h:00", vec![0]),
        ("1600h:01", u32s(0x6040_0010)),
        ("1600h:00", vec![1]),
        ("1400h:01", u32s(0x234)),
        ("1800h:01", u32s(0x8000_0184)),
        ("1800h:02", vec![1]),
        ("1A00h:00", vec![0]),
        ("1A00h:01", u32s(0x6041_0010)),
        ("1A00h:02", u32s(0x6064_0020)),
        ("1A00h:00", vec![2]),
        ("1800h:01", u32s(0x184)),
        ("1801h:01", u32s(0x8000_0284)),
    ];
    let wrote: Vec<(&str, Vec<u8>)> = wrote.iter().map(|(object, bytes)| (object.as_str(), bytes.clone())).collect();
    assert_eq!(wrote, expected, "2000h, which the sheet does not have, is left out");
    assert_eq!(node.writes[3].at, Place { line: 11, column: 10 });
    // Mandatory is off, boot and reset are on, in the generator as here.
    let assignment = intended.plan.nodes.values().next().unwrap().assignment;
    assert_eq!(assignment.0, 0x05);
}

#[test]
fn what_a_drive_will_refuse_is_reported_at_its_line_with_the_letter() {
    let folder = sheets(&[J, Z]);
    let joint = [BEATS, CONSUMES, NO_RPDO4];
    // 2614h is the joint's save command, which takes 1 alone (its manual, 5.04).
    let refused = [joint.as_slice(), &["sdo: [{index: 0x2614, value: 99}]"]].concat();
    for (lines, boots) in [(refused.as_slice(), false), (&joint, true)] {
        let mut checked = of_bus_yml(&bus(J, lines), folder.path()).unwrap();
        let predicted = checked.predict().unwrap();
        let finding = checked.findings.iter().find(|finding| finding.rule == "boot");
        assert_eq!(finding.is_none(), boots, "{:#?}", checked.findings);
        // A joint starts by itself: L is how its boot-up ends.
        assert_eq!(predicted.nodes[0].letter, Some(if boots { 'L' } else { 'J' }));
        if let Some(finding) = finding {
            assert_eq!((finding.at.line, finding.severity, finding.node), (11, Severity::Error, Some(4)));
            assert!(finding.what.contains("2614h:00") && finding.what.contains("letter J"), "{finding:?}");
        }
    }
    // Another revision than the device says: N.
    let mut checked = of_bus_yml(&bus("cia402", &[BEATS, "revision_number: 7"]), sheets(&["cia402"]).path()).unwrap();
    assert_eq!(checked.predict().unwrap().nodes[0].letter, Some('N'));
    assert!(placed(&checked).contains(&("boot", Severity::Error, 5)), "{:#?}", checked.findings);
}

/// `examples/ros2_canopen`, as a user has it who follows its README.
#[test]
fn the_buses_of_the_examples_pass_and_boot() {
    let folder = sheets(&[Z, "cia402"]);
    for (file, nodes) in [("base.yml", &[4, 5][..]), ("servo.yml", &[3])] {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/ros2_canopen/").to_owned() + file;
        let mut checked = of_bus_yml(&std::fs::read_to_string(path).unwrap(), folder.path()).unwrap();
        let predicted = checked.predict().unwrap();
        let bad = checked.findings.iter().filter(|finding| finding.severity != Severity::Note);
        assert_eq!(bad.collect::<Vec<_>>(), [] as [&Finding; 0], "{file}");
        assert_eq!(predicted.nodes.iter().map(|node| node.node).collect::<Vec<_>>(), nodes, "{file}");
        assert!(predicted.nodes.iter().all(|node| node.letter.is_none()) && predicted.fits, "{file}: {predicted:#?}");
    }
}

#[test]
fn a_bus_that_is_too_full_or_has_no_sync_is_reported() {
    let folder = sheets(&[Z]);
    let tpdo = "tpdo: {1: {cob_id: auto, transmission: 1, mapping: [{index: 0x6041}, {index: 0x6064}]}}";
    let full = |period: &str, rate: &str| {
        let text =
            bus(Z, &[BEATS, tpdo]).replace("sync_period: 20000", &format!("sync_period: {period}\n  baudrate: {rate}"));
        let mut checked = of_bus_yml(&text, folder.path()).unwrap();
        let predicted = checked.predict().unwrap();
        (checked, predicted)
    };
    let (fine, predicted) = full("20000", "500");
    assert!(predicted.fits && predicted.load < 0.2, "{predicted:?}");
    assert!(!rules(&fine).iter().any(|(rule, _)| ["bus-load", "no-sync"].contains(rule)), "{:#?}", fine.findings);
    // SYNC, a TPDO of 6 bytes and one RPDO each ms are more than 150 bits at 125 kbit/s: 125 bits fit.
    let (crowded, predicted) = full("1000", "125");
    assert!(!predicted.fits && predicted.load > 1.0, "{}", predicted.load);
    assert!(placed(&crowded).contains(&("bus-load", Severity::Error, 3)), "{:#?}", crowded.findings);
    let (silent, _) = full("0", "500");
    assert!(placed(&silent).contains(&("no-sync", Severity::Warning, 10)), "{:#?}", silent.findings);
}

#[test]
fn two_pdos_of_one_identifier_are_reported() {
    let node = |name: &str, id: u8| {
        format!(
            "{name}:\n  node_id: {id}\n  dcf: {Z}.eds\n  {BEATS}\n  tpdo: {{1: {{cob_id: 0x184, mapping: [{{index: 0x6041}}]}}}}\n"
        )
    };
    let text = format!(
        "master: {{node_id: 127, sync_period: 20000, heartbeat_producer: 100}}\n{}{}",
        node("a", 4),
        node("b", 5)
    );
    let mut checked = of_bus_yml(&text, sheets(&[Z]).path()).unwrap();
    checked.predict().unwrap();
    assert!(placed(&checked).contains(&("shared-cob-id", Severity::Error, 11)), "{:#?}", checked.findings);
}

#[test]
fn what_cannot_be_predicted_is_reported_with_the_reason() {
    let mut checked = of_bus_yml(&bus("nothing", &[BEATS]), sheets(&[]).path()).unwrap();
    assert!(checked.predict().is_none());
    let finding = checked.findings.iter().find(|finding| finding.rule == "prediction").unwrap();
    assert!(finding.what.contains("no data sheet"), "{finding:?}");
    // Of a file that is something else one complaint is enough.
    let mut other = of_bus_yml("services:\n  web:\n    image: a\n", sheets(&[]).path()).unwrap();
    assert!(other.predict().is_none());
    assert_eq!(rules(&other), [("shape", Severity::Error)]);
}

/// A live bus: these models at these nodes, switched on for a second. What `during` does is done to it before it is asked.
fn asked(
    checked: &mut Checked,
    drives: &[(&str, u8)],
    during: impl AsyncFnOnce(&Network),
) -> (Vec<LiveNode>, Vec<String>) {
    let (mut world, network) = (World::new(Bitrate::K500, 3), Network::new());
    world.add_station(network.clone());
    for (model, node) in drives {
        let (model, id) = (models::resolve(model).unwrap(), NodeId::new(*node).unwrap());
        world.add_drive(*node, order(model, &Order::new(model, id, Bitrate::K500)).unwrap()).unwrap();
    }
    world.run_for(Duration::from_secs(1));
    block_on(&mut world, during(&network)).unwrap();
    while world.log_mut().pull().is_some() {}
    let live = block_on(&mut world, checked.ask(&network, |node| network.node(node))).unwrap();
    let frames = std::iter::from_fn(|| world.log_mut().pull());
    let sent = frames.filter_map(|event| match event {
        WireEvent::Frame { frame, .. } => Some(frame.to_string()),
        _ => None,
    });
    (live, sent.collect())
}

#[test]
fn live_drives_are_only_read() {
    let lines = [BEATS, "sdo: [{index: 0x6083, value: 150}]"];
    let mut checked = of_bus_yml(&bus(Z, &lines), sheets(&[Z]).path()).unwrap();
    let (live, frames) = asked(&mut checked, &[(Z, 4)], async |_| ());
    assert!(live[0].answers && live[0].compared > 10, "{live:?}");
    // The identity of both ZLTECH drives (their manuals, 1018h).
    assert_eq!(
        (live[0].vendor_id, live[0].product_code, live[0].device_type),
        (Some(0x100), Some(1), Some(0x0004_0192))
    );
    // An UNSIGNED16 there ("ZLAC8030L quick start guide V1.00", object table), and a VISIBLE_STRING in CiA 301.
    assert!(live[0].software.as_ref().is_some_and(|version| version.parse::<u16>().is_ok()), "{live:?}");
    let asked: Vec<_> = frames.iter().filter(|frame| frame.starts_with("604#")).collect();
    // CiA 301, 7.2.4.3.5: an initiate upload, or a segment of one (60h, 70h); nothing else but answers and heartbeats.
    let reads = |frame: &&String| ["604#40", "604#60", "604#70"].iter().any(|read| frame.starts_with(read));
    assert!(asked.len() > 20 && asked.iter().all(reads), "{asked:?}");
    assert!(frames.iter().all(|frame| ["604#", "584#", "704#"].iter().any(|id| frame.starts_with(id))), "{frames:?}");
    // 6083h is 100 ms as delivered, and the heartbeat 0 or other than 200: the file writes both.
    let differ: Vec<_> = live[0].deviations.iter().map(|deviation| deviation.object.as_str()).collect();
    assert_eq!(differ, ["1017h:00", "6083h:00"]);
    assert!(placed(&checked).contains(&("live-value", Severity::Note, 9)), "{:#?}", checked.findings);
    assert!(!rules(&checked).iter().any(|(rule, _)| *rule == "live-sheet"), "{:#?}", checked.findings);
    // A note is not a warning: the boot-up writes what differs.
    assert_eq!(checked.count(Severity::Error), 0, "{:#?}", checked.findings);
}

#[test]
fn drives_that_differ_from_the_file_are_reported() {
    let clean = || of_bus_yml(&bus(Z, &[BEATS]), sheets(&[Z]).path()).unwrap();
    // No node there, and one that the file does not have.
    let mut checked = clean();
    let (live, _) = asked(&mut checked, &[(J, 9)], async |_| ());
    assert!(!live[0].answers);
    assert!(placed(&checked).contains(&("live-silent", Severity::Error, 5)), "{:#?}", checked.findings);
    assert!(rules(&checked).contains(&("live-stranger", Severity::Warning)), "{:#?}", checked.findings);
    // Another device at the node.
    let mut checked = clean();
    let (live, _) = asked(&mut checked, &[("cia402", 4)], async |_| ());
    assert_eq!(live[0].product_code, Some(402));
    let finding = checked.findings.iter().find(|finding| finding.rule == "live-identity").unwrap();
    assert!(finding.severity == Severity::Error && finding.what.contains("to be 40192h"), "{finding:?}");
    // A PDO that is not as the sheet says: the generator would leave it so.
    let mut checked = clean();
    let change = async |network: &Network| {
        let node = network.node(NodeId::new(4).unwrap());
        node.write(Mux::new(0x1800, 2), 7_u8).await.unwrap();
    };
    asked(&mut checked, &[(Z, 4)], change);
    let finding = checked.findings.iter().find(|finding| finding.rule == "live-sheet").unwrap();
    assert!(finding.severity == Severity::Warning && finding.what.contains("1800h:02 has 7h"), "{finding:?}");
}

const DRIVE: &str = "[[drive]]\nmodel = \"zlac8030l\"\nnode = 4\n";

#[test]
fn a_machine_file_is_predicted_with_its_own_writes() {
    let text =
        format!("{DRIVE}heartbeat = \"200ms\"\npdos = {{ tpdo1 = {{ objects = [\"statusword\"], type = 1 }} }}\n");
    let mut checked = of_machine(&text, Path::new("")).unwrap();
    let predicted = checked.predict().unwrap();
    assert_eq!((predicted.nodes[0].letter, predicted.nodes[0].state.as_deref()), (None, Some("operational")));
    let tpdo = predicted.frames.iter().find(|row| row.frame == "TPDO1").unwrap();
    assert_eq!(
        (tpdo.id.as_str(), tpdo.bytes, tpdo.carries.as_slice()),
        ("184", 2, ["statusword".to_owned()].as_slice())
    );
    assert!(checked.findings.is_empty(), "{:#?}", checked.findings);
}

/// CiA 302-2, figure 4, letter L: a node that is operational before is left as it is.
#[test]
fn no_write_is_predicted_for_a_node_that_a_boot_up_leaves_as_it_is() {
    let both = format!("{DRIVE}heartbeat = '200ms'\n[[drive]]\nmodel = '{J}'\nnode = 1\nheartbeat = '200ms'\n");
    let mut checked = of_machine(&both, Path::new("")).unwrap();
    let predicted = checked.predict().unwrap();
    let of = |node: u8| predicted.nodes.iter().find(|row| row.node == node).map(|row| (row.letter, row.writes));
    assert_eq!((of(1), of(4)), (Some((Some('L'), 0)), Some((None, 1))));
}

#[test]
fn each_trap_of_a_machine_file_is_at_its_line() {
    for (line, rule, severity, at) in [
        ("heartbeat = \"0ms\"", "heartbeat", Severity::Warning, 4),
        ("start_up = { 2000 = 0 }", "host-watch", Severity::Warning, 4),
        ("pdos = { tpdo1 = { objects = [\"606C\"], type = 255, inhibit = \"0ms\" } }", "unbounded", Severity::Note, 4),
    ] {
        let mut right = of_machine(DRIVE, Path::new("")).unwrap();
        right.predict().unwrap();
        assert!(!rules(&right).contains(&(rule, severity)), "{:#?}", right.findings);
        let mut wrong = of_machine(&format!("{DRIVE}{line}\n"), Path::new("")).unwrap();
        wrong.predict().unwrap();
        assert!(placed(&wrong).contains(&(rule, severity, at)), "{line}: {:#?}", wrong.findings);
    }
    let of = |text: &str| of_machine(text, Path::new("")).unwrap();
    assert!(placed(&of("[[drive]]\nmodel = 'zlim42c'\nnode = 127\n")).contains(&("node-id", Severity::Warning, 3)));
    assert!(placed(&of("[[drive]]\nmodel = 'zlim42c'\nnode = 2\n")).contains(&("host-watch", Severity::Note, 3)));
    let servo = "[[drive]]\nmodel = 'cia402'\nnode = 2\n";
    assert!(placed(&of(servo)).contains(&("limits", Severity::Note, 3)));
    let limited = format!("{servo}limits = {{ position = [-5000, 5000] }}\n");
    assert!(!placed(&of(&limited)).iter().any(|found| found.0 == "limits"), "{:#?}", of(&limited).findings);
}

/// The key `shaft` (docs/machine-file.md): the node whose motor shaft an encoder sits on.
#[test]
fn an_encoder_on_a_shaft_is_checked_and_one_on_no_shaft_is_refused_at_its_line() {
    let servo = "[[drive]]\nmodel = 'cia402'\nnode = 5\n";
    let of = |shaft: &str| {
        let text = format!("{servo}[[drive]]\nmodel = 'encoder406'\nnode = 6\nshaft = {shaft}\n");
        of_machine(&text, Path::new(""))
    };
    let checked = of("5").unwrap();
    let nodes: Vec<_> = checked.nodes.iter().map(|node| node.node).collect();
    assert_eq!(nodes, [Some(5), Some(6)]);
    assert!(checked.findings.iter().all(|finding| finding.node != Some(6)), "{:#?}", checked.findings);
    for (shaft, reason) in
        [("9", "no drive 9"), ("6", "no shaft"), ("'5.2'", "axis"), ("0", "node whose shaft it sits on")]
    {
        let refused = of(shaft).map(|_| ()).unwrap_err().to_string();
        assert!(refused.contains("line 7, column 9") && refused.contains(reason), "{shaft}: {refused}");
    }
}

#[test]
fn a_joint_that_interpolates_over_its_own_time_wants_that_cycle() {
    let group = |mode: &str, period: &str| {
        let axis = "velocity_deg_s = 60\nacceleration_deg_s2 = 60\njerk_deg_s3 = 600\nfollowing_error_deg = 5\n";
        let text = format!(
            "[[drive]]\nmodel = \"m4230e17b50\"\nnode = 1\n[[group]]\nname = \"arm\"\nperiod = \"{period}\"\n[[group.axis]]\nnode = 1\n\
             {mode}{axis}"
        );
        of_machine(&text, Path::new("")).unwrap().findings
    };
    let about = |findings: Vec<Finding>| findings.into_iter().find(|finding| finding.rule == "interpolation");
    // M Robot Joint Motor CanOpen Manual, 5.10.3: an interpolation cycle each 2 ms.
    for mode in ["mode = \"ip\"\n", ""] {
        let found = about(group(mode, "10ms")).expect("it stands four fifths of the time");
        assert_eq!((found.severity, found.node, found.at.line), (Severity::Warning, Some(1), 6));
        assert_eq!(found.next, "set `period = \"2ms\"`");
        assert_eq!(about(group(mode, "2ms")), None);
    }
    assert_eq!(about(group("mode = \"pv\"\n", "10ms")), None, "by speeds it does not interpolate");
}
