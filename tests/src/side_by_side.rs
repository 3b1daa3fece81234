//! A drive's tables and the data read from its manual, laid side by side. Two people made the two.
//!
//! Each public function is the body of one test and fails with the list of what differs.

use canopen::od::{Access, DefaultValue, Dictionary, Entry, Fixed, Table};
use canopen::{Mux, NodeId};
use cia402::{Controlword, PowerEvent, PowerState, Statusword, transition};
use devices::Description;

use crate::manual::{ObjectRow, PowerCell};

/// The drive has exactly the objects of the manual, in its order.
pub fn objects_are_the_manuals(table: &'static Table, rows: &[ObjectRow]) {
    let ours: Vec<Mux> = table.rows().iter().map(Entry::mux).collect();
    let manual: Vec<Mux> = rows.iter().map(|row| Mux::new(row.index, row.sub)).collect();
    let only_in = |these: &[Mux], those: &[Mux]| -> Vec<String> {
        these.iter().filter(|object| !those.contains(object)).map(Mux::to_string).collect()
    };
    assert_eq!(only_in(&manual, &ours), [""; 0], "in the manual's data only: a row of the drive's table is missing");
    assert_eq!(only_in(&ours, &manual), [""; 0], "in the drive's table only: a line of objects.csv is missing");
    assert_eq!(ours, manual, "the same objects, in another order");
}

/// Every object agrees with the manual in every column, at this node.
pub fn columns_are_the_manuals<const N: usize>(table: &'static Table, rows: &[ObjectRow], node: NodeId) {
    let ours = |row: &ObjectRow| Some(table.row(table.find(Mux::new(row.index, row.sub)).ok()?));
    let pairs: Vec<_> = rows.iter().filter_map(|row| Some((ours(row)?, row))).collect();
    assert!(!pairs.is_empty(), "no object is in both");
    let found = pairs.into_iter().flat_map(|(ours, row)| differences::<N>(table, node, ours, row));
    let differences: Vec<String> = found.collect();
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}

/// Each object names the section of the manual that has it.
pub fn sections_are_the_manuals(model: &Description, rows: &[ObjectRow]) {
    let found =
        |row: &ObjectRow| model.section(row.index).map(|section| section.trim_start_matches("chapter ").to_owned());
    let differs: Vec<_> = rows.iter().filter(|row| found(row).as_ref() != Some(&row.section)).collect();
    assert!(!rows.is_empty() && differs.is_empty(), "{}: {differs:#?}", model.name);
}

fn differences<const N: usize>(table: &'static Table, node: NodeId, ours: &Entry, row: &ObjectRow) -> Vec<String> {
    let default = match ours.default {
        DefaultValue::Value(value) => Some(value),
        DefaultValue::NodeIdPlus(base) => Some(i64::from(base) + i64::from(node.raw())),
        _ => None,
    };
    let pairs = [
        ("size", ours.data_type.size().to_string(), row.size.to_string()),
        ("signed", ours.data_type.is_signed().to_string(), row.signed.to_string()),
        ("writable", ours.access.is_writable().to_string(), row.writable.to_string()),
        ("readable", (ours.access != Access::WriteOnly).to_string(), true.to_string()),
        ("stored", ours.stored.to_string(), row.stored.to_string()),
        ("mappable", ours.pdo.is_allowed().to_string(), row.pdo_mappable.to_string()),
        // A measurement's default is what the drive puts there, not a figure of the manual.
        ("default", shown(default, row), shown(row.default, row)),
    ];
    let at = format!("{:04X}h:{:02X} {}", row.index, row.sub, row.name);
    let differs = pairs.iter().filter(|(_, ours, manual)| ours != manual);
    let mut found: Vec<String> = differs.map(|(what, a, b)| format!("{at}: {what}: drive {a}, manual {b}")).collect();
    found.extend(limit_differences::<N>(table, node, ours, row).iter().map(|text| format!("{at}: {text}")));
    found
}

fn shown(default: Option<i64>, row: &ObjectRow) -> String {
    if row.live || row.default.is_none() { String::new() } else { format!("{default:?}") }
}

/// With all other objects at their defaults, the bounds are taken and what lies beyond is refused. Whether by limits, by
/// a list of values or by a check is the drive's business.
fn limit_differences<const N: usize>(
    table: &'static Table,
    node: NodeId,
    ours: &Entry,
    row: &ObjectRow,
) -> Vec<String> {
    if !row.writable {
        return Vec::new();
    }
    let dictionary: Dictionary<Fixed<N>> = Dictionary::new(table, node);
    let slot = table.find(ours.mux()).expect("a row of the table");
    let (least, most) = ours.data_type.range();
    let (low, high) = row.limits.unwrap_or((least, most));
    let cases = [(low, true), (high, true), (low - 1, false), (high + 1, false)];
    let possible = cases.into_iter().filter(|(value, _)| (least..=most).contains(value));
    let differs =
        |&(value, taken): &(i64, bool)| dictionary.check_write(slot, ours.data_type.raw(value)).is_ok() != taken;
    possible
        .filter(differs)
        .map(|(value, taken)| format!("{value} should be {}", if taken { "taken" } else { "refused" }))
        .collect()
}

/// The power state machine goes where the table of states and events says.
pub fn transitions_are_the_manuals(cells: &[PowerCell]) {
    let mut differences = Vec::new();
    for cell in cells {
        let Some(event) = event(cell) else { continue };
        let after = settle(state(&cell.state), event);
        if after != state(&cell.state_after) {
            differences.push(format!("{} on {}: {after:?}, table {}", cell.state, cell.event, cell.state_after));
        }
    }
    assert!(differences.is_empty(), "{}", differences.join("\n"));
}

/// The bits of the statusword in each state are those of the table.
pub fn state_bits_are_the_manuals(cells: &[PowerCell]) {
    const STATE_BITS: u16 = 0x6F;
    for cell in cells {
        let state = state(&cell.state_after);
        let expected = u16::from(cell.low_byte_after);
        assert_eq!(Statusword(expected).state(), Some(state), "{cell:?}");
        assert_eq!(state.statusword_bits() & STATE_BITS & !0x20, expected & STATE_BITS & !0x20, "{cell:?}");
    }
}

/// Takes transitions until the event has none: "enable operation" passes through Switched on.
fn settle(mut state: PowerState, event: PowerEvent) -> PowerState {
    let automatic = |state| state == PowerState::SwitchedOn;
    if let Some(step) = transition(state, event) {
        state = step.to;
        if automatic(state) && step.from == PowerState::ReadyToSwitchOn {
            state = transition(state, event).map_or(state, |step| step.to);
        }
    }
    state
}

/// The event of a cell; `None` for the ends of ramps, which the drive turns into the command that waits for them.
fn event(cell: &PowerCell) -> Option<PowerEvent> {
    if let Some(controlword) = cell.controlword {
        return Some(PowerEvent::Command(Controlword(controlword).command()));
    }
    match cell.event.as_str() {
        "self_test_done" => Some(PowerEvent::SelfTestDone),
        "fault_occurs" => Some(PowerEvent::FaultOccurred),
        "fault_reaction_done" => Some(PowerEvent::FaultReactionDone),
        "ramp_done" | "quick_stop_ramp_done" => None,
        other => panic!("unknown event {other}"),
    }
}

fn state(name: &str) -> PowerState {
    let snake = |state: &PowerState| state.name().to_lowercase().replace(' ', "_") == name;
    PowerState::ALL.into_iter().find(snake).unwrap_or_else(|| panic!("unknown state {name}"))
}
