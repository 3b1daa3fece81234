//! A base of a machine file, held against what its drives do and against the body that they move where it is simulated.

use std::collections::BTreeMap;

use canopen::NodeId;
use devices::{Quantity, Scale};
use master::units::Shown;

use super::finding::{Place, Reporter, Severity};
use super::groups::{highest, value};
use super::intended::IntendedNode;
use crate::file::{BasePlan, Machine};

/// What the file says twice of its base in two ways, and where a drive does less, or does it less finely, than the base says.
pub(super) fn limits(machine: &Machine, nodes: &BTreeMap<NodeId, IntendedNode>, at: Place, report: &mut Reporter<'_>) {
    let Some(base) = &machine.base else { return };
    for (wheel, turns) in base.wheels {
        let Some(node) = nodes.get(&wheel) else { continue };
        report.node = Some(wheel);
        // Turns of the shaft in a minute for 1 m/s over the ground.
        let rpm_per_m_s = base.geometry.turns_per_m() * turns.abs() * 60.0 * machine.gear(wheel).ratio().abs();
        report.rule = "base-limits";
        too_fast(node, base, rpm_per_m_s, at, report);
        report.rule = "base-steps";
        coarse(node, base, rpm_per_m_s, at, report);
    }
    report.node = None;
    report.rule = "base-body";
    other_body(machine, base, at, report);
}

/// A wheel faster than its drive is refused when the base is opened.
fn too_fast(node: &IntendedNode, base: &BasePlan, rpm_per_m_s: f64, at: Place, report: &mut Reporter<'_>) {
    let needed_rpm = base.limits.wheel_m_s * rpm_per_m_s;
    let Some((most_rpm, by)) = highest(node).filter(|(most_rpm, _)| needed_rpm > most_rpm * (1.0 + 1e-9)) else {
        return;
    };
    let most_m_s = Shown(most_rpm / rpm_per_m_s);
    let what = format!(
        "`wheel_m_s = {}` needs {} r/min of the drive, and it does {} r/min ({most_m_s} m/s) at most by {by}: the base is refused",
        Shown(base.limits.wheel_m_s),
        Shown(needed_rpm),
        Shown(most_rpm),
    );
    let next = format!("lower `wheel_m_s` to {most_m_s} or less, or raise the limit of the drive");
    report.say(Severity::Warning, at, what, next);
}

/// The share of a wheel's highest speed from which on rounding is said.
const FINE: f64 = 1e-3;

/// A set-point has whole counts: what a twist asks of a wheel is rounded to them.
fn coarse(node: &IntendedNode, base: &BasePlan, rpm_per_m_s: f64, at: Place, report: &mut Reporter<'_>) {
    let Some(axis) = node.description.first_axis() else { return };
    let Some(Quantity { object, scale: Scale::Shaft(rpm) }) = axis.units.target_velocity else { return };
    let Some(row) = node.description.row(object) else { return };
    let finer = row.resolution.map(|by| (by, value(node, by).unwrap_or(1).max(1)));
    let step_m_s = rpm / finer.map_or(1.0, |(_, counts)| counts as f64) / rpm_per_m_s;
    if step_m_s / 2.0 < FINE * base.limits.wheel_m_s {
        return;
    }
    let what = format!(
        "a count of {object} is {} m/s of the wheel, and speeds go in whole counts: a twist is driven with up to {} m/s and {} rad/s of \
         difference, and turns by as much more or less",
        Shown(step_m_s),
        Shown(step_m_s / 2.0),
        Shown(step_m_s / base.geometry.wheel_base_m),
    );
    let next = match finer.and_then(|(by, counts)| Some((by, counts, node.description.row(by)?.limits_at(1).1))) {
        Some((by, counts, most)) if (counts as i64) < most => {
            format!("write {most} to {by} (`start_up`): its counts are then that many times as fine")
        }
        _ => "go by the pose that the base reports, which is by the positions of the wheels".to_owned(),
    };
    report.say(Severity::Note, at, what, next);
}

/// What a base drives by and what is simulated are two tables: other lengths or another wheel on the left is another motion.
fn other_body(machine: &Machine, base: &BasePlan, at: Place, report: &mut Reporter<'_>) {
    let nodes = base.wheels.map(|(node, _)| node.raw());
    let of_these = |wheels: &[(u8, f64); 2]| wheels.iter().all(|(node, _)| nodes.contains(node));
    let Some((name, model, wheels)) = machine.differential_drives().find(|(_, _, wheels)| of_these(wheels)) else {
        return;
    };
    let lengths = [
        ("wheel_base_m", base.geometry.wheel_base_m, model.wheel_base_m),
        ("wheel_radius_m", base.geometry.wheel_radius_m, model.wheel_radius_m),
    ];
    for (key, of_base, of_body) in lengths {
        if (of_base - of_body).abs() > 1e-9 {
            let what = format!(
                "`{key}` is {} in [base] and {} in the body '{name}': the base is driven, and its pose computed, by the first, and \
                 what is simulated moves by the second",
                Shown(of_base),
                Shown(of_body)
            );
            let next = "give both the same, unless the difference is what you want to see";
            report.say(Severity::Warning, at, what, next);
        }
    }
    if wheels.map(|(node, _)| node) != nodes {
        let what =
            format!("the left wheel of [base] is the right one of the body '{name}': it turns the other way round");
        report.say(
            Severity::Warning,
            at,
            what,
            "name the drives in one order, the left one first, in `wheels` and `drives`",
        );
        return;
    }
    for ((node, of_base), (_, of_body)) in base.wheels.iter().zip(wheels) {
        let each = of_base * of_body;
        if (each - 1.0).abs() > 1e-9 {
            report.node = Some(*node);
            let what = format!(
                "`turns` says {} turns of the drive for one of the wheel forward in [base], and {} turns of the wheel for one of the drive \
                 in the body '{name}': by both, a wheel that is to go 1 m goes {} m",
                Shown(*of_base),
                Shown(of_body),
                Shown(each)
            );
            report.say(Severity::Warning, at, what, "let one be 1 divided by the other, with the same sign");
        }
    }
    report.node = None;
}
