//! A machine file as the description of a bus: what its master will do, and the traps that no reader of one value alone sees.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

use can::Bitrate;
use canopen::object::PRODUCER_HEARTBEAT_TIME;
use canopen::pdo::{Direction, PdoNumber};
use canopen::{Mux, NodeId};
use devices::HostWatch;
use master::boot::{BootPlan, Expectation};

use super::finding::{Findings, Place, Reporter, Severity};
use super::generated::Planned;
use super::intended::{Intended, IntendedNode, MovedAt};
use super::predict::CYCLE;
use super::{Checked, CheckedNode};
use super::{base, groups, joints};
use crate::file::{Machine, pdo_id};
use words::document::reader::{self, Field, Parameters, Table};
use words::document::{BadFile, Problem};

/// Where the file describes a drive.
struct Places {
    node: Place,
    keys: BTreeMap<String, Place>,
    pdos: BTreeMap<(bool, PdoNumber), Place>,
}

/// Limits by CiA 402-2 that the key `limits` sets.
const LIMITS: [u16; 5] = [0x6072, 0x6073, 0x607D, 0x607F, 0x6080];

impl Places {
    /// Of what a write is about.
    fn of(&self, object: Mux) -> Place {
        let key = |key: &str| self.keys.get(key).copied();
        let start_up = key("start_up").unwrap_or(self.node);
        match object.index {
            0x1400..=0x1BFF => {
                let number = PdoNumber::new((object.index & 0x1FF) + 1);
                let place = number.and_then(|number| self.pdos.get(&(object.index >= 0x1800, number)).copied());
                place.unwrap_or(start_up)
            }
            _ if object == PRODUCER_HEARTBEAT_TIME => key("heartbeat").unwrap_or(start_up),
            index if LIMITS.contains(&index) => key("limits").unwrap_or(start_up),
            _ => start_up,
        }
    }
}

/// Checks the text of a machine file whose data sheets are in `folder`.
///
/// # Errors
/// Everything for which it cannot be used.
pub fn of_machine(text: &str, folder: &Path) -> Result<Checked, BadFile> {
    let machine = Machine::parse_in(text, folder)?;
    // What the world around the drives refuses is reported too.
    let mut world = machine.build()?;
    let all = |file: &Table<'_>| Ok::<_, Vec<Problem>>((places(file), periods(file), radii(file)));
    let (places, periods, radii) = reader::read(text, &Parameters::new(), "a machine file", all).unwrap_or_default();
    let mut found = Findings::default();
    let mut report = Reporter { found: &mut found, rule: "shape", node: None };
    let intended = intended(&machine, &places, &periods);
    for (node, place) in &intended.nodes {
        report.node = Some(*node);
        traps(*node, place, &mut report);
        bitrate(place, intended.bitrate, &mut report);
    }
    report.node = None;
    radii.iter().for_each(|radius| wheel_radius(*radius, &mut report));
    intended.moved.iter().for_each(|moved| interpolation(moved, &intended.nodes, &mut report));
    groups::limits(&machine, &intended.nodes, &periods, &mut report);
    // The place of the base is behind those of the groups.
    if let Some(at) = periods.last() {
        base::limits(&machine, &intended.nodes, *at, &mut report);
    }
    let units_of = |node: NodeId| places.get(&node.raw())?.keys.get("units").copied();
    joints::gears(&machine, (&intended.nodes, &mut world), units_of, &mut report);
    joints::weights(&machine, (&intended.nodes, &mut world), &mut report);
    let row = |(node, place): (&NodeId, &IntendedNode)| CheckedNode {
        name: place.name.clone(),
        node: Some(node.raw()),
        device: Some(place.description.title.to_owned()),
    };
    let nodes = intended.nodes.iter().map(row).collect();
    Ok(Checked { nodes, findings: found.into_sorted(), intended: Ok(intended), machine: Some(machine) })
}

fn located(field: &Field<'_>) -> Place {
    let at = field.problem("").locate(field.source_text());
    Place { line: at.line, column: at.column }
}

/// By node-ID. The file has been read without a complaint: what is not there has no place.
fn places(file: &Table<'_>) -> BTreeMap<u8, Places> {
    let drives = file.get("drive").and_then(|field| field.list("").ok()).unwrap_or_default();
    let of_drive = |field: &Field<'_>| {
        let table = field.table("a drive", "").ok()?;
        let node = table.get("node")?;
        let keys = table.fields().map(|field| (field.name().to_owned(), located(&field))).collect();
        let pdos = table.get("pdos").and_then(|pdos| pdos.table("the PDOs", "").ok());
        let pdos = pdos.iter().flat_map(|pdos| pdos.fields()).filter_map(|field| {
            let pdo = pdo_id(field.name()).ok()?;
            Some(((pdo.direction == Direction::Tpdo, pdo.number), located(&field)))
        });
        Some((node.whole("").ok()?, Places { node: located(&node), keys, pdos: pdos.collect() }))
    };
    drives.iter().filter_map(of_drive).collect()
}

/// Where each group and the base say their period, in the order of [`Machine::cycles`].
fn periods(file: &Table<'_>) -> Vec<Place> {
    let groups = file.get("group").and_then(|field| field.list("").ok()).unwrap_or_default();
    let of = |field: &Field<'_>| {
        let period = field.table("", "").ok().and_then(|table| table.get("period"));
        period.as_ref().map_or_else(|| located(field), located)
    };
    groups.iter().chain(&file.get("base")).map(of).collect()
}

/// Where bodies and the base say the radius of their wheels, and what it is in m.
fn radii(file: &Table<'_>) -> Vec<(Place, f64)> {
    let bodies = file.get("body").and_then(|field| field.list("").ok()).unwrap_or_default();
    let of = |field: &Field<'_>| {
        let radius = field.table("", "").ok()?.get("wheel_radius_m")?;
        Some((located(&radius), radius.number("").ok()?))
    };
    bodies.iter().chain(&file.get("base")).filter_map(of).collect()
}

/// A drive that has one bit rate is not on a bus of another.
fn bitrate(node: &IntendedNode, of_bus: Bitrate, report: &mut Reporter<'_>) {
    report.rule = "bitrate";
    let model = node.description;
    if let Some(only) = model.only_bitrate().filter(|only| *only != of_bus) {
        let what =
            format!("the {} has a bit rate of {only} alone ({}), and this bus has {of_bus}", model.title, model.manual);
        let next = format!("set `bitrate = \"{only}\"` at the top of the file, and the other drives to it");
        report.say(Severity::Warning, node.at, what, next);
    }
}

/// Radii of the wheels of vehicles, in m; one in another unit is outside.
const WHEELS: RangeInclusive<f64> = 0.005..=2.0;

fn wheel_radius((at, radius_m): (Place, f64), report: &mut Reporter<'_>) {
    report.rule = "wheel-radius";
    if !WHEELS.contains(&radius_m) {
        let what = format!("wheels of a radius of {radius_m} m: expected {} to {} m", WHEELS.start(), WHEELS.end());
        report.say(Severity::Note, at, what, "give `wheel_radius_m` in metres, such as 0.0865 for 86.5 mm");
    }
}

fn intended(machine: &Machine, places: &BTreeMap<u8, Places>, periods: &[Place]) -> Intended {
    let mut nodes = BTreeMap::new();
    let mut plan = BootPlan::new([]);
    for (node, model) in machine.models() {
        let of_node = places.get(&node.raw());
        let at = of_node.map_or(Place { line: 1, column: 1 }, |places| places.node);
        let configuration = machine.configuration(node);
        let write = |(object, bytes): &(Mux, Vec<u8>)| Planned {
            object: *object,
            bytes: bytes.clone(),
            at: of_node.map_or(at, |places| places.of(*object)),
        };
        let writes = configuration.iter().map(write).collect();
        plan.nodes.insert(node, Expectation { configuration: configuration.clone(), ..Expectation::of(model) });
        let (name, of_sheet) = (model.name.to_owned(), BTreeMap::new());
        nodes.insert(node, IntendedNode { name, at, description: model, writes, of_sheet });
    }
    let top = Place { line: 1, column: 1 };
    let places = periods.iter().copied().chain(std::iter::repeat(top));
    let mut moved: Vec<_> = machine.cycles().zip(places).map(|(cycle, at)| MovedAt { cycle, at }).collect();
    // The one that fills the bus most is what is predicted.
    let fullest = machine.fullest_cycle();
    moved.sort_by_key(|moved| Some(&moved.cycle) != fullest.as_ref());
    let first = moved.first();
    Intended {
        plan,
        nodes,
        bitrate: machine.bus_bitrate(),
        cycle: Some(first.map_or(CYCLE, |first| first.cycle.period)),
        host_heartbeat: None,
        at: first.map_or(top, |first| first.at),
        moved,
    }
}

/// See [`CyclePlan::uneven`](crate::file::CyclePlan::uneven).
fn interpolation(moved: &MovedAt, nodes: &BTreeMap<NodeId, IntendedNode>, report: &mut Reporter<'_>) {
    report.rule = "interpolation";
    for (node, said) in &moved.cycle.nodes {
        let axis = nodes.get(node).and_then(|node| node.description.first_axis());
        if let Some((what, own)) = axis.and_then(|axis| moved.cycle.uneven(axis, *said)) {
            report.node = Some(*node);
            report.say(Severity::Warning, moved.at, what, format!("set `period = \"{own:?}\"`"));
        }
    }
    report.node = None;
}

fn traps(node: NodeId, place: &IntendedNode, report: &mut Reporter<'_>) {
    let values = place.values();
    let number = |object: Mux| {
        let bytes = &values.get(&object)?.bytes;
        Some(bytes.iter().rev().take(8).fold(0_u64, |number, byte| number << 8 | u64::from(*byte)))
    };
    let title = place.description.title;
    report.rule = "node-id";
    if node == NodeId::MAX {
        let what = "127 is the node-ID under which a master sends its heartbeat: this node and the master share it";
        report.say(Severity::Warning, place.at, what, "give the drive another node-ID");
    }
    report.rule = "heartbeat";
    if number(PRODUCER_HEARTBEAT_TIME) == Some(0) {
        let what = "its heartbeat is switched off: its loss or restart goes unnoticed";
        report.say(
            Severity::Warning,
            place.place_of(Some(PRODUCER_HEARTBEAT_TIME)),
            what,
            "set `heartbeat`, from 100ms to 500ms",
        );
    }
    report.rule = "host-watch";
    match place.description.host_watch {
        HostWatch::None if place.description.first_axis().is_some() => {
            let what = format!("the {title} does not watch its host: when the master dies, it keeps moving");
            let next = "stop it by other means than the bus: an input, or its supply";
            report.say(Severity::Note, place.at, what, next);
        }
        HostWatch::Silence { time: object } | HostWatch::Heartbeat { consumer: object, .. }
            if number(object).is_some_and(|value| value & 0xFFFF == 0) =>
        {
            let what =
                format!("its watch over the host is switched off ({object}): when the master dies, it keeps moving");
            let next = format!("leave {object} out, or give it a time");
            report.say(Severity::Warning, place.place_of(Some(object)), what, next);
        }
        _ => {}
    }
    report.rule = "limits";
    let has = |index: u16| place.description.has_index(index);
    if has(0x607D) && !values.keys().any(|object| object.index == 0x607D) {
        let what = "no limits of its position are set (607Dh): it moves as far as commanded";
        report.say(
            Severity::Note,
            place.at,
            what,
            "add `limits = { position = [low, high] }` where the machine has ends",
        );
    }
}
