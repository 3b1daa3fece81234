//! Limits of a group's axes beside what their drives are set to: a group keeps to both, and a command to one drive to the drive's alone.

use std::collections::BTreeMap;

use canopen::od::DefaultValue;
use canopen::{Mux, NodeId};
use cia402::object::{MAX_MOTOR_SPEED, MAX_POSITION_LIMIT, MAX_PROFILE_VELOCITY};
use devices::{Quantity, Scale};
use master::drive::HeldBy;
use master::group::AxisSetup;
use master::units::Shown;

use super::finding::{Place, Reporter, Severity};
use super::intended::IntendedNode;
use crate::file::{AxisPlan, GroupPlan, Machine};

/// What the file says of each axis twice, or where a drive does less than its group. `at` are the places of the groups, in their order.
pub(super) fn limits(
    machine: &Machine,
    nodes: &BTreeMap<NodeId, IntendedNode>,
    at: &[Place],
    report: &mut Reporter<'_>,
) {
    let all =
        || machine.groups.iter().zip(at).flat_map(|(group, at)| group.axes.iter().map(move |axis| (group, axis, *at)));
    for (place, (group, axis, at)) in all().enumerate() {
        report.node = Some(axis.node);
        let Some(node) = nodes.get(&axis.node) else { continue };
        report.rule = "group-mode";
        other_mode(node, (group, axis), at, report);
        report.rule = "group-limits";
        too_fast(machine, node, (group, axis), at, report);
        alone(node, (group, axis), at, report);
        // Said once, at the later one.
        let earlier = all().take(place).find(|(_, other, _)| other.node == axis.node && other.limits != axis.limits);
        if let Some((other, ..)) = earlier {
            let what = format!("the groups '{}' and '{}' state other limits for it", other.name, group.name);
            report.say(
                Severity::Note,
                at,
                what,
                "state the same limits wherever its joint has the same ends and loads",
            );
        }
    }
    report.node = None;
}

/// A mode that the model does not have is refused when the group is opened.
fn other_mode(node: &IntendedNode, (group, axis): (&GroupPlan, &AxisPlan), at: Place, report: &mut Reporter<'_>) {
    let Some((mode, of)) = axis.mode.zip(node.description.first_axis()) else { return };
    if of.modes.contains(&mode) {
        return;
    }
    let what = format!(
        "the group '{}' moves it in the mode {mode}, which a {} does not have: the group is refused",
        group.name, node.description.name
    );
    let has =
        of.modes.iter().filter(|mode| AxisSetup::MODES.contains(mode)).map(ToString::to_string).collect::<Vec<_>>();
    let next = format!("leave its `mode` out, which takes the best that it has, or name one of: {}", has.join(", "));
    report.say(Severity::Error, at, what, next);
}

/// A speed beyond what the drive does is refused when the group is opened.
fn too_fast(
    machine: &Machine,
    node: &IntendedNode,
    (group, axis): (&GroupPlan, &AxisPlan),
    at: Place,
    report: &mut Reporter<'_>,
) {
    let Some((shaft_rpm, by)) = highest(node) else { return };
    let (stated_rpm, most_rpm) =
        (axis.limits.velocity_turns_s * 60.0, shaft_rpm / machine.gear(axis.node).ratio().abs());
    if stated_rpm <= most_rpm * (1.0 + 1e-9) {
        return;
    }
    let what = format!(
        "the group '{}' may move it at {} deg/s ({} r/min), and it does {} deg/s ({} r/min) at most by {by}: the group is refused",
        group.name,
        Shown(stated_rpm * 6.0),
        Shown(stated_rpm),
        Shown(most_rpm * 6.0),
        Shown(most_rpm)
    );
    let next =
        format!("lower its `velocity_deg_s` to {} or less, or raise the limit of the drive", Shown(most_rpm * 6.0));
    report.say(Severity::Warning, at, what, next);
}

/// The highest speed of its shaft in r/min by its objects as they will be or by its motor, and which of them: as a drive that is there
/// is asked for it.
pub(super) fn highest(node: &IntendedNode) -> Option<(f64, String)> {
    let model = node.description;
    let axis = model.first_axis()?;
    // 6080h is in r/min whatever the units of velocities are.
    let mut bounds = vec![(axis.object(MAX_MOTOR_SPEED), 1.0)];
    let mut least = axis.max_motor_rpm.map(|rpm| (rpm, HeldBy::Motor.to_string()));
    let mut lower = |rpm: f64, object: Mux| {
        if least.as_ref().is_none_or(|(least_rpm, _)| rpm < *least_rpm) {
            least = Some((rpm, object.to_string()));
        }
    };
    if let Some(Quantity { object, scale: Scale::Shaft(rpm) }) = axis.units.target_velocity
        && let Some(row) = model.row(object)
    {
        lower(row.limits_at(1).1 as f64 * rpm, object);
        bounds.push((axis.object(MAX_PROFILE_VELOCITY), rpm));
        bounds.extend(row.held_to.map(|held| (held.object, held.counts as f64 * rpm)));
    }
    for (object, rpm) in bounds {
        // Nothing could move within a limit of 0.
        if let Some(value) = value(node, object).filter(|value| *value > 0) {
            lower(value as f64 * rpm, object);
        }
    }
    least
}

/// What an object will have: what the file has written to it, else its value as delivered.
pub(super) fn value(node: &IntendedNode, object: Mux) -> Option<u64> {
    let row = node.description.row(object)?;
    match (node.values().get(&object), row.default) {
        (Some(written), _) => {
            Some(written.bytes.iter().rev().take(8).fold(0, |number, byte| number << 8 | u64::from(*byte)))
        }
        (None, DefaultValue::Value(value)) => u64::try_from(value).ok(),
        _ => None,
    }
}

/// Software limits that only the group knows of.
fn alone(node: &IntendedNode, (group, axis): (&GroupPlan, &AxisPlan), at: Place, report: &mut Reporter<'_>) {
    let Some(range) = &axis.limits.range_turns else { return };
    let own = node.description.first_axis().map(|axis| axis.object(MAX_POSITION_LIMIT));
    if own.is_some_and(|own| node.values().contains_key(&own)) {
        return;
    }
    let [low, high] = [range.start(), range.end()].map(|turns| Shown(turns * 360.0));
    let what = format!(
        "`range_deg = [{low}, {high}]` binds the group '{}' alone: `ferrodrive move {}` goes as far as commanded",
        group.name, axis.node
    );
    let next = match own.filter(|own| node.description.row(*own).is_some()) {
        Some(_) => "state the ends for the drive too: `limits = { position = [low, high] }` (607Dh)",
        None => "the drive has no software limits (607Dh): move it by its group",
    };
    report.say(Severity::Note, at, what, next);
}
