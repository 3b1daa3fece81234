//! 5.10.3: three joints led by RPDO4 and SYNC each 2 ms: first the printed datagrams, then a path. How far apart the axes
//! start is measured at the shafts, with the joints' own 2 ms (261Ch = 0, as delivered) and with those of SYNC (261Ch = 1).

use std::f64::consts::TAU;
use std::time::Duration;

use can::{CanId, Frame, Instant};
use canopen::NodeId;
use cia402::ModeOfOperation;
use drives::Firmware;
use drives::mjoint::MJoint;
use master::cyclic::{CyclicDrive, CyclicOptions, Demand, Refusal};
use master::units::Angle;
use master::{Drive, Network, join_all};

use crate::bench::{Bench, Start};
use crate::expect::Expect;
use plot::EventKind;

/// "The above procedure is performed every 2 ms".
const CYCLE: Duration = Duration::from_millis(2);

/// Longest time that opening the joints, or waiting for a SYNC, may take.
const LIMIT: Duration = Duration::from_secs(5);

/// Counts in a turn of the motor: 15 bits (parameter tables).
const COUNTS_PER_TURN: f64 = 32_768.0;

/// How near to a target the motor comes to rest, counts: a third of a degree of the motor's shaft.
const IN_PLACE_COUNTS: f64 = 30.0;

/// How far a shaft turns until it counts as started.
const STARTED_COUNTS: f64 = 2.0;

const NODES: [u8; 3] = [1, 2, 3];

/// The path of each axis: turns of the swing and swings a second. All have the same largest speed.
const SWINGS: [(f64, f64); 3] = [(4.0, 0.5), (2.0, 1.0), (4.0 / 3.0, 1.5)];
const PATH_S: f64 = 2.0;

/// Whose 2 ms lead from point to point.
#[derive(Clone, Copy)]
enum TimeBase {
    /// The joint's own, as delivered.
    Own,
    /// Those of SYNC.
    Sync,
}

impl TimeBase {
    const fn setting(self) -> &'static str {
        match self {
            Self::Own => "261Ch = 0",
            Self::Sync => "261Ch = 1",
        }
    }
}

/// 5.10.3.
pub(crate) fn three_joints(bench: &mut Bench) {
    bench.section("5.10.3", "start of three axes");
    prepare(bench);
    let without = start(bench, 50_000, TimeBase::Own);
    for node in NODES {
        bench.talk_to(node);
        bench.write(format!("node {node}: synchronised (261Ch = 1)"), 0x261C, 0, 1);
        // Whatever the loops still push against after the last move is gone with the power.
        bench.write(format!("node {node}: power off the motor"), 0x6040, 0, 0);
        bench.write(format!("node {node}: enable"), 0x6040, 0, 0x0F);
    }
    bench.run_ms(20);
    let with = start(bench, 0, TimeBase::Sync);
    bench.step("SYNC as the clock brings the axes together");
    bench.expect("spread", Expect::AtMost(without.max(1.0)), "µs", with);
    bench.section("5.10.3", "path, a point each 2 ms");
    path(bench);
    for node in NODES {
        bench.talk_to(node);
        bench.write(format!("node {node}: power off the motor"), 0x6040, 0, 0);
    }
}

/// Mode 7, enabled. The joints are powered at different times, as real ones are: their rhythms differ.
fn prepare(bench: &mut Bench) {
    bench.run_ms(20);
    for node in NODES {
        bench.talk_to(node);
        bench.machine(&format!("{node} power cut"));
        bench.run(Duration::from_micros(1_730 * u64::from(node)));
        bench.machine(&format!("{node} power on"));
        bench.run_ms(20);
    }
    for node in NODES {
        bench.talk_to(node);
        bench.write(format!("node {node}: mode 7, interpolation"), 0x6060, 0, 7);
        bench.write(format!("node {node}: enable"), 0x6040, 0, 0x0F);
    }
    bench.run_ms(20);
}

/// The printed procedure: a target for each, and SYNC. The spread of the start in µs.
fn start(bench: &mut Bench, target: i32, time_base: TimeBase) -> f64 {
    let setting = time_base.setting();
    let data = target.to_le_bytes().map(|byte| format!("{byte:02X}")).concat();
    let before = NODES.map(|node| shaft_counts(bench, node));
    for node in NODES {
        bench.talk_to(node);
        let (request, reply) = (format!("50{node}#{data}"), format!("48{node}#........3704"));
        bench.exchange(format!("node {node}: target {target}"), &request, &reply);
    }
    bench.run_ms(3);
    for (node, before) in NODES.into_iter().zip(before) {
        let waits = shaft_counts(bench, node) - before;
        bench.expect(&format!("node {node} waits"), Expect::Near(0.0, STARTED_COUNTS), "counts", waits);
    }
    bench.step(format!("SYNC, {setting}: all three start"));
    bench.transmit(Frame::new(CanId::standard(0x80), &[]));
    bench.mark(format!("SYNC, {setting}"), EventKind::Note);
    let recorded = watch(bench, setting);
    let spread_us = recorded.spread_us();
    bench.asked("080#");
    let period_us = MJoint::CONTROL_PERIOD_NS as f64 / 1e3;
    let most_us = match time_base {
        // Each joint goes on at its own next 2 ms.
        TimeBase::Own => CYCLE.as_micros() as f64 + period_us,
        TimeBase::Sync => period_us,
    };
    bench.moved(format!("started {spread_us:.0} µs apart"));
    bench.expect("spread of the start", Expect::AtMost(most_us), "µs", spread_us);
    bench.starts(recorded);
    bench.run_ms(900);
    for node in NODES {
        bench.talk_to(node);
        bench.step(format!("node {node} arrives"));
        bench.expect_object(0x6064, 0, Expect::Near(target.into(), IN_PLACE_COUNTS), "counts");
        bench.expect_status("status word", 0xFFFF, 0x0437);
    }
    spread_us
}

/// The shafts in the first milliseconds from now on.
fn watch(bench: &mut Bench, setting: &'static str) -> Start {
    const LOOK: Duration = Duration::from_micros(5);
    const LOOKS: u32 = 800;
    let rest = NODES.map(|node| shaft_counts(bench, node));
    let mut axes = vec![Vec::new(); NODES.len()];
    for look in 0..LOOKS {
        for (axis, (node, rest)) in axes.iter_mut().zip(NODES.into_iter().zip(rest)) {
            axis.push((f64::from(look) * LOOK.as_secs_f64() * 1e6, shaft_counts(bench, node) - rest));
        }
        bench.run_silently(LOOK);
    }
    Start { setting, started_counts: STARTED_COUNTS, axes }
}

/// A path of 2 s, point by point, by the master's process data; all axes come back to 0 at its end.
fn path(bench: &mut Bench) {
    bench.step("1000 cycles of RPDO4 to three joints and SYNC");
    bench.mark("path", EventKind::Note);
    let cycles = (PATH_S / CYCLE.as_secs_f64()) as u32;
    match lead(bench, cycles) {
        Ok((slowest_ms, farthest)) => {
            bench.asked("50n#pppppppp, 080#");
            bench.answered_with("48n#ppppppppssss");
            bench.expect("all answered within", Expect::AtMost(2.0), "ms", slowest_ms);
            // Two cycles at the path's largest speed: one is the interpolation, the loops may take another.
            let (turns, hz) = SWINGS[0];
            let most = turns * TAU / 2.0 * hz * COUNTS_PER_TURN * 2.0 * CYCLE.as_secs_f64();
            bench.expect("off the path", Expect::AtMost(most.round()), "counts", farthest);
        }
        Err(trouble) => bench.compare("a path to its end", trouble, false),
    }
    bench.run_ms(100);
    for node in NODES {
        bench.talk_to(node);
        bench.expect_object(0x6064, 0, Expect::Near(0.0, IN_PLACE_COUNTS), "counts");
    }
}

/// Gives each joint a point of its path in each cycle: the longest time to the last answer in ms, and how far a joint was
/// from where it had been sent, in counts.
fn lead(bench: &mut Bench, cycles: u32) -> Result<(f64, f64), String> {
    let network = Network::new();
    bench.world().add_station(network.clone());
    let joint = bench.model();
    let nodes = NODES.map(|node| network.node(NodeId::new(node).unwrap_or(NodeId::MIN)));
    // The steps before and after send no heartbeat: joints that had heard one would stop without the next.
    let options = CyclicOptions { guard: None, ..CyclicOptions::default() };
    let open = join_all(nodes.map(|node| async move {
        Drive::new(node, joint).cyclic(ModeOfOperation::INTERPOLATED_POSITION, options).await
    }));
    let opened = sim::block_on_for(bench.world(), LIMIT, open).map_err(|error| error.to_string())?;
    let opened: Result<Vec<_>, _> = opened.into_iter().collect();
    let mut joints = opened.map_err(|error| error.to_string())?;
    network.sync(Some(CYCLE));
    // In the first cycle no joint has answered yet.
    for _ in 0..3 {
        next_cycle(bench, &network)?;
        step(&network, &mut joints, [Demand::Hold; 3]);
    }
    let (mut slowest_ms, mut farthest) = (0f64, 0f64);
    // What was asked for in the last two cycles: a SYNC leads there, the next one finds it reached.
    let mut asked: [Option<[f64; 3]>; 2] = [None; 2];
    let mut begin = None;
    for cycle in 0..=cycles {
        let next = next_cycle(bench, &network)?;
        if let Some(begin) = begin.replace(next) {
            slowest_ms = slowest_ms.max(answered_after_ms(bench, begin));
        }
        for (node, there) in NODES.into_iter().zip(asked[0].into_iter().flatten()) {
            farthest = farthest.max((bench.report_of(node).position as f64 - there).abs());
        }
        let time_s = f64::from(cycle) * CYCLE.as_secs_f64();
        let points = SWINGS.map(|swing| (place_turns(swing, time_s) * COUNTS_PER_TURN).round());
        let demands = points.map(|point| Demand::Position(Angle::Counts(point as i64)));
        if let Some(refusal) = step(&network, &mut joints, demands) {
            return Err(refusal.to_string());
        }
        asked = [asked[1], Some(points)];
    }
    network.sync(None);
    Ok((slowest_ms, farthest))
}

/// When the next cycle begins.
fn next_cycle(bench: &mut Bench, network: &Network) -> Result<Instant, String> {
    let next = sim::block_on_for(bench.world(), LIMIT, network.next_sync()).map_err(|error| error.to_string())?;
    bench.run_silently(Duration::ZERO);
    next.map(|cycle| cycle.at).map_err(|error| error.to_string())
}

/// One step of each joint; the first refusal.
fn step(network: &Network, joints: &mut [CyclicDrive], demands: [Demand; 3]) -> Option<Refusal> {
    network.exchange(|io| {
        let steps = joints.iter_mut().zip(demands);
        steps.fold(None, |refusal, (joint, demand)| refusal.or(joint.step(io, demand).refused))
    })
}

/// A swing from 0 and back, at rest at both ends.
fn place_turns((turns, hz): (f64, f64), time_s: f64) -> f64 {
    turns / 2.0 * (1.0 - (TAU * hz * time_s).cos())
}

/// When the last TPDO4 of this cycle came, ms after its start; infinite if one is missing.
fn answered_after_ms(bench: &Bench, begin: Instant) -> f64 {
    let times = NODES.map(|node| bench.heard_after(begin, 0x480 + u16::from(node)));
    times.into_iter().fold(0.0, |most, at| at.map_or(f64::INFINITY, |at| most.max((at - begin).as_secs_f64() * 1e3)))
}

fn shaft_counts(bench: &mut Bench, node: u8) -> f64 {
    bench.report_of(node).shaft_angle_rad / TAU * COUNTS_PER_TURN
}
