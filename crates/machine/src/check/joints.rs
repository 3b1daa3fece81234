//! Drives with a gear: the ratio by which a master counts beside the one that is there; and the weight of an arm that they hold.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::RangeInclusive;

use canopen::NodeId;
use master::units::Shown;
use plant::coupled::ArmModel;
use sim::{AxisId, CoupledShaft, MotorData, World};

use super::finding::{Place, Reporter, Severity};
use super::intended::IntendedNode;
use crate::file::Machine;

/// The part of a ratio by which two of them may differ and be the same.
const SAME: f64 = 1e-3;

/// The ratio of each drive, where the file states one, beside the gear that it has inside and the one that its load has. `units_of` is
/// where the file has a drive's `units`.
pub(super) fn gears(
    machine: &Machine,
    (nodes, world): (&BTreeMap<NodeId, IntendedNode>, &mut World),
    units_of: impl Fn(NodeId) -> Option<Place>,
    report: &mut Reporter<'_>,
) {
    report.rule = "gear-ratio";
    for (node, planned) in nodes {
        let Some(inside) = reducer(world, *node).map(|motor| motor.0) else { continue };
        let (behind, stated) = (machine.load_gear(*node), machine.gear(*node).ratio().abs());
        report.node = Some(*node);
        let there = inside * behind;
        let name = planned.description.title;
        match units_of(*node) {
            Some(at) if (stated / there - 1.0).abs() > SAME => {
                let and = if behind == 1.0 { String::new() } else { format!(" and its load one of {}", Shown(behind)) };
                let what = format!(
                    "`gear_ratio` is {}, and the {name} has a reducer of {} inside{and}: an angle of 90 deg would be one of {} deg",
                    Shown(stated),
                    Shown(inside),
                    Shown(90.0 * stated / there),
                );
                let next = format!("set `units = {{ gear_ratio = {} }}`, times what stands behind it", Shown(there));
                report.say(Severity::Warning, at, what, next);
            }
            None if machine.groups.iter().any(|group| group.axes.iter().any(|axis| axis.node == *node)) => {
                let what = format!(
                    "angles of its group are those of its motor: the {name} has a reducer of {}",
                    Shown(inside)
                );
                report.say(
                    Severity::Note,
                    planned.at,
                    what,
                    format!("set `units = {{ gear_ratio = {} }}`", Shown(there)),
                );
            }
            _ => {}
        }
    }
    report.node = None;
}

/// The ratio of the reducer that a drive has inside, and its torques at the output in N·m: all the time, for moments.
fn reducer(world: &mut World, node: NodeId) -> Option<(f64, f64, f64)> {
    let of = |motor: MotorData| motor.gear.map(|gear| (gear.ratio, gear.rated_nm, gear.peak_nm));
    world.with_drive(node.raw(), |drive, _| drive.motor(AxisId::FIRST).and_then(of)).ok().flatten()
}

/// Gravity on each joint of the simulated arms in the worst pose, beside what its reducer bears.
pub(super) fn weights(
    machine: &Machine,
    (nodes, world): (&BTreeMap<NodeId, IntendedNode>, &mut World),
    report: &mut Reporter<'_>,
) {
    report.rule = "arm-load";
    for (name, arm, shafts) in machine.arms() {
        let ways: Vec<_> =
            shafts.iter().zip(arm.links()).map(|(shaft, link)| way(machine, world, shaft, link.first_rad)).collect();
        for (joint, shaft) in shafts.iter().enumerate() {
            let Some(node) = NodeId::new(shaft.place.node) else { continue };
            let (Some(planned), Some((_, rated_nm, peak_nm))) = (nodes.get(&node), reducer(world, node)) else {
                continue;
            };
            let (pose, joint_nm) = worst_pose(arm, joint, &ways);
            let needed_nm = joint_nm * shaft.turns.abs();
            if needed_nm <= rated_nm {
                continue;
            }
            report.node = Some(node);
            let angles = pose.iter().map(|angle| Shown(angle.to_degrees().round()).to_string()).collect::<Vec<_>>();
            let what = format!(
                "gravity alone asks up to {} N·m of it in the body '{name}' (angles {} deg), and the {} gives {} N·m all the time and {} N·m \
                 for moments: {}",
                Shown((needed_nm * 10.0).round() / 10.0),
                angles.join(", "),
                planned.description.title,
                Shown(rated_nm),
                Shown(peak_nm),
                if needed_nm > peak_nm { "it cannot hold the arm there" } else { "it gets too hot there" },
            );
            let next = "make the links or the payload lighter, take a stronger joint, or keep the arm from that pose (`range_deg` of a group)";
            report.say(Severity::Warning, planned.at, what, next);
        }
    }
    report.node = None;
}

/// The angles in rad that a joint may have: those of a group that moves its drive, or all.
fn way(machine: &Machine, world: &mut World, shaft: &CoupledShaft, first_rad: f64) -> RangeInclusive<f64> {
    let axes = machine.groups.iter().flat_map(|group| &group.axes);
    let range = axes.filter(|axis| axis.node.raw() == shaft.place.node).find_map(|axis| {
        let range = axis.limits.range_turns.as_ref()?;
        // Turns of the joint for one turn as the group counts.
        let inside = reducer(world, axis.node).map_or(1.0, |(ratio, ..)| ratio);
        let turns = shaft.turns * machine.gear(axis.node).ratio().abs() / inside;
        let ends = [range.start(), range.end()].map(|end| first_rad + end * turns * TAU);
        Some(ends[0].min(ends[1])..=ends[0].max(ends[1]))
    });
    range.filter(|range| range.end() - range.start() < TAU).unwrap_or(first_rad - PI..=first_rad + PI)
}

/// Where gravity asks most of a joint, and how much that is, N·m.
///
/// Its torque is a sine of each angle alone, so that the best angle with the others as they are is known; one after the other, until
/// nothing is gained. From several poses, since a pose may be the best of its neighbours only.
fn worst_pose(arm: &ArmModel, joint: usize, ways: &[RangeInclusive<f64>]) -> (Vec<f64>, f64) {
    let torque_nm = |pose: &[f64]| {
        let mut data = arm.at_rest();
        data.angle_rad[..pose.len()].copy_from_slice(pose);
        arm.gravity_torque_nm(&data)[joint]
    };
    let begin = |start: u32, (place, way): (usize, &RangeInclusive<f64>)| {
        let middle = 0.5 * (way.start() + way.end());
        if start >> place & 1 == 0 { middle } else { (middle + FRAC_PI_2).min(*way.end()) }
    };
    let mut worst = (Vec::new(), -1.0);
    for sign in [1.0, -1.0] {
        for start in 0..1_u32 << ways.len() {
            let pose = ways.iter().enumerate().map(|way| begin(start, way)).collect();
            let found = climbed(pose, ways, |pose| sign * torque_nm(pose));
            if found.1 > worst.1 {
                worst = found;
            }
        }
    }
    worst
}

/// The pose from here up to where no angle alone gains anything, and the value there.
fn climbed(mut pose: Vec<f64>, ways: &[RangeInclusive<f64>], value: impl Fn(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let mut found = value(&pose);
    loop {
        for (place, way) in ways.iter().enumerate() {
            let mut at = |angle: f64| {
                pose[place] = angle;
                value(&pose)
            };
            pose[place] = highest_of_sine(&mut at, way);
        }
        let now = value(&pose);
        let gains = now > found + 1e-9;
        if !gains {
            return (pose, now);
        }
        found = now;
    }
}

/// Where `a cos x + b sin x + c` is highest on a way.
fn highest_of_sine(value: &mut impl FnMut(f64) -> f64, way: &RangeInclusive<f64>) -> f64 {
    let [at_0, at_quarter, at_half] = [0.0, FRAC_PI_2, PI].map(&mut *value);
    let (cosine, middle) = (0.5 * (at_0 - at_half), 0.5 * (at_0 + at_half));
    let top = (at_quarter - middle).atan2(cosine);
    // The top that is next behind the begin of the way.
    let top = way.start() + (top - way.start()).rem_euclid(TAU);
    [*way.end(), top]
        .into_iter()
        .filter(|angle| way.contains(angle))
        .fold(*way.start(), |best, angle| if value(angle) > value(best) { angle } else { best })
}
