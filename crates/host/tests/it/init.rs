//! `init`: the machine file of a bus says what was found, and no more; what it says holds for a machine made of it.

use std::path::Path;
use std::time::Duration;

use can::Bitrate;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::{Mux, NodeId};
use host::network::init::{InitNode, InitReport};
use host::network::scan::ScannedNode;
use machine::check::{Severity, of_machine};
use machine::file::Machine;
use master::Network;
use serde_json::Value;
use sim::machine::{Order, order};
use sim::wire::WireEvent;
use sim::{World, block_on};
use words::models::{self, Description, how_to_say};

const TIMEOUT: Duration = Duration::from_millis(100);

/// One of each kind, two joints, and both steppers, which answer alike.
const DRIVES: [(&str, u8); 6] =
    [("m4230e17b50", 1), ("zlim42c", 2), ("m8025e25b80", 3), ("zlac8030l", 4), ("zlim42c-82", 5), ("cia402", 9)];

fn node(id: u8) -> NodeId {
    NodeId::new(id).unwrap()
}

fn model(name: &str) -> &'static Description {
    models::resolve(name).unwrap()
}

fn bench(drives: &[(&str, u8)]) -> (World, Network) {
    let mut world = World::new(Bitrate::K250, 1);
    let network = Network::new();
    world.add_station(network.clone());
    for (name, id) in drives {
        let order = order(model(name), &Order::new(model(name), node(*id), Bitrate::K250)).unwrap();
        world.add_drive(*id, order).unwrap();
    }
    world.run_for(Duration::from_secs(2));
    (world, network)
}

/// What a scan shows, and the rows of the file, where these models are said.
async fn look(network: &Network, said: &[(&str, u8)]) -> (Vec<Value>, Vec<InitNode>) {
    let (mut scanned, mut rows) = (Vec::new(), Vec::new());
    for found in network.scan(TIMEOUT, |_| {}).await {
        let known = said.iter().find(|(_, id)| *id == found.node.raw()).map(|(name, _)| model(name));
        scanned.push(serde_json::to_value(ScannedNode::new(known, &found, how_to_say)).unwrap());
        rows.push(InitNode::found(network, known, &found).await);
    }
    (scanned, rows)
}

fn nodes_of(toml: &str) -> Vec<(u8, &'static str)> {
    let machine = Machine::parse(toml).unwrap_or_else(|bad| panic!("{bad}\n{toml}"));
    machine.models().map(|(node, model)| (node.raw(), model.name)).collect()
}

/// The file with all its examples in force.
fn with_examples(toml: &str) -> String {
    let line = |line: &str| match line.strip_prefix('#') {
        Some(code) if !code.starts_with(' ') => format!("{code}\n"),
        _ => format!("{line}\n"),
    };
    toml.lines().map(line).collect()
}

/// A joint starts operational, and is configured by a boot-up with a reset alone (CiA 302-2, figure 4, letter L).
#[test]
fn a_heartbeat_that_a_boot_up_would_leave_is_set_by_one_with_a_reset() {
    let (mut world, network) = bench(&DRIVES);
    let (_, rows) = block_on(&mut world, look(&network, &DRIVES)).unwrap();
    let toml = InitReport::new(rows, None).toml;
    let of = |name: &str| toml.split("[[drive]]").find(|drive| drive.contains(&format!("\"{name}\""))).unwrap();
    for (name, _) in DRIVES {
        let starts_by_itself = model(name).nmt.start_state == canopen::NmtState::Operational;
        assert_eq!(of(name).contains("`boot --reset` sets"), starts_by_itself, "{}", of(name));
    }
    assert!(
        of("m4230e17b50").contains("`boot --reset` sets it") && of("zlac8030l").contains("`boot` sets one"),
        "{toml}"
    );
}

#[test]
fn what_cannot_be_known_is_a_guess_with_its_evidence_or_commented_out_with_the_alternatives() {
    let (mut world, network) = bench(&DRIVES);
    let (_, rows) = block_on(&mut world, look(&network, &[])).unwrap();
    let report = InitReport::new(rows, Some(Bitrate::K250));
    // The joints have the same objects, all four; a ZLIM42-C and a ZLAC8030L have objects of their own.
    assert_eq!(nodes_of(&report.toml), [(2, "zlim42c"), (4, "zlac8030l"), (5, "zlim42c"), (9, "cia402")]);
    let row = |id: u8| report.nodes.iter().find(|row| row.node == id).unwrap();
    assert!(row(4).evidence.is_some() && !row(4).certain && row(9).certain);
    assert!(report.toml.contains(row(4).evidence.as_deref().unwrap()), "{}", report.toml);
    assert_eq!(row(5).models, ["zlim42c", "zlim42c-82"]);
    assert!(report.toml.contains("model = \"zlim42c\"  # or zlim42c-82\nnode = 5\n"), "{}", report.toml);
    let joints = "#[[drive]]\n#model = \"m4230e17b50\"  # or m4230e17b80, m8025e25b50, m8025e25b80\n#node = 3\n";
    assert!(report.toml.contains(joints), "{}", report.toml);
    let failure = report.failure().expect("two drives are not in use");
    assert_eq!((failure.kind, failure.because.len(), report.ok), ("unknown_model", 2, false));
    assert!(failure.next[0].contains("--model 1=m4230e17b50"), "{failure}");
}

#[test]
fn a_machine_made_of_the_file_is_scanned_as_the_bus_was_and_the_file_passes_its_check() {
    let (mut world, network) = bench(&DRIVES);
    // Stored by an earlier master.
    let slow = network.node(node(4));
    block_on(&mut world, slow.write(PRODUCER_HEARTBEAT_TIME, 200_u16)).unwrap().unwrap();
    let (scanned, rows) = block_on(&mut world, look(&network, &DRIVES)).unwrap();
    assert!(rows.iter().all(|row| row.certain), "{rows:?}");
    let report = InitReport::new(rows, Some(Bitrate::K250));
    assert!(report.ok && report.failure().is_none());
    let checked = of_machine(&report.toml, Path::new("")).unwrap_or_else(|bad| panic!("{bad}"));
    let wrong: Vec<_> = checked.findings.iter().filter(|found| found.severity == Severity::Error).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let machine = Machine::parse(&report.toml).unwrap();
    assert_eq!(machine.bitrate, Some(Bitrate::K250));
    let mut again = machine.build().unwrap();
    let network = Network::new();
    again.add_station(network.clone());
    again.run_for(Duration::from_secs(2));
    let (scanned_again, _) = block_on(&mut again, look(&network, &DRIVES)).unwrap();
    assert_eq!(scanned_again, scanned);
    assert!(scanned.iter().any(|row| row["heartbeat_ms"] == 200), "{scanned:?}");
}

#[test]
fn every_example_of_the_file_is_one_that_may_be_used() {
    let (mut world, network) = bench(&DRIVES);
    let (_, rows) = block_on(&mut world, look(&network, &DRIVES)).unwrap();
    for bitrate in [Some(Bitrate::K250), None] {
        let all = with_examples(&InitReport::new(rows.clone(), bitrate).toml);
        let machine = Machine::parse(&all).unwrap_or_else(|bad| panic!("{bad}\n{all}"));
        machine.build().unwrap_or_else(|bad| panic!("{bad}\n{all}"));
        assert_eq!((machine.groups.len(), machine.base.is_some(), machine.bitrate.is_some()), (1, true, true));
        for key in ["units", "load", "heartbeat", "limits", "start_up"] {
            assert!(all.contains(&format!("\n{key} = ")), "{key}: {all}");
        }
    }
    // Drives that are commented out come into force in the same way.
    let (_, open) = block_on(&mut world, look(&network, &[])).unwrap();
    let all = with_examples(&InitReport::new(open, None).toml);
    assert_eq!(nodes_of(&all).len(), DRIVES.len());
}

#[test]
fn a_drive_is_only_read() {
    let (mut world, network) = bench(&DRIVES);
    while world.log_mut().pull().is_some() {}
    block_on(&mut world, look(&network, &[])).unwrap();
    let mut requests = 0;
    while let Some(event) = world.log_mut().pull() {
        let WireEvent::Frame { frame, .. } = event else { continue };
        let id = frame.id().raw();
        if (0x600..0x680).contains(&id) {
            // CiA 301, 7.2.4.3: client command specifiers 1 and 0 are of a download.
            assert!(frame.data()[0] >> 5 >= 2, "{frame}");
            requests += 1;
        } else {
            assert_ne!(id, 0, "{frame}: an NMT command");
        }
    }
    assert!(requests > 127, "{requests}");
}

#[test]
fn a_model_that_is_chosen_takes_the_place_of_the_guess() {
    let (mut world, network) = bench(&DRIVES);
    let (_, rows) = block_on(&mut world, look(&network, &[])).unwrap();
    let chosen = |id: u8, name: &str| rows.iter().find(|row| row.node == id).unwrap().clone().chosen(name);
    let stepper = chosen(5, "zlim42c-82");
    assert_eq!((stepper.model.as_deref(), stepper.certain, stepper.remark), (Some("zlim42c-82"), true, None));
    // A model that its objects contradict is not taken.
    assert_eq!(chosen(4, "zlim42c").model.as_deref(), Some("zlac8030l"));
    assert_eq!(chosen(1, "cia402").model, None);
}

#[test]
fn what_makes_a_model_another_edition_stands_in_the_options() {
    let (mut world, network) = bench(&[("zlac8030l,firmware=2.01", 4)]);
    let said = [("zlac8030l,firmware=2.01", 4)];
    let (_, rows) = block_on(&mut world, look(&network, &said)).unwrap();
    let report = InitReport::new(rows, None);
    let machine = Machine::parse(&report.toml).unwrap();
    let (_, model) = machine.models().next().unwrap();
    assert!(model.row(Mux::new(0x202F, 6)).is_some(), "{}", report.toml);
}
