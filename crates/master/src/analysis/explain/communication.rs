//! Does it answer, is it alive, which other masters access it, and what does it watch?

use std::time::Duration;

use canopen::pdo::Direction;
use canopen::{Mux, NmtState, NodeId};
use devices::HostWatch;

use super::finding::{Finding, Topic, cause, warning};
use super::observed::Observed;
use crate::core::Twins;

const TOPIC: Topic = Topic::Communication;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    findings.extend(silent(seen));
    if seen.silence.is_none() {
        findings.extend(two_devices(seen).or_else(|| heartbeat(seen)));
        findings.extend(other_master(seen));
        findings.extend(nmt_by_other(seen));
        findings.extend(no_block_transfer(seen));
        findings.extend(host_watch(seen));
    }
}

/// Nothing else can be found out about a node that does not answer.
fn silent(seen: &Observed) -> Option<Finding> {
    let (node, error) = (seen.node, seen.silence.as_ref()?);
    let heartbeats = seen.heard.heartbeats(node).map_or(0, |heard| heard.count);
    let (follows, remedy) = match (seen.nmt, heartbeats) {
        (Some(NmtState::Stopped), _) => (
            "A stopped node answers no SDO and takes no PDO (CiA 301, 7.3.2.2.4)".to_owned(),
            format!("Start it: ferrodrive nmt {node} start"),
        ),
        (_, 1..) => (
            format!("The node is alive ({heartbeats} heartbeats heard), but its SDO server does not answer"),
            "Check whether another program has an SDO transfer open with it; reset the node's communication \
             (ferrodrive nmt reset-communication), or switch it off and on"
                .to_owned(),
        ),
        _ => (
            "No node is there, its bit rate, node-ID or cable is wrong, or it is in the NMT state stopped and sends no \
             heartbeat"
                .to_owned(),
            format!(
                "Check its supply and cable, the termination (120 ohm at both ends), and who is there: ferrodrive scan; \
                 a node that is stopped answers after: ferrodrive nmt {node} start"
            ),
        ),
    };
    let expected = "It answers SDO requests".to_owned();
    Some(cause(TOPIC, "no_answer", [expected, error.to_string(), follows, remedy]))
}

/// What a device sends once comes twice.
fn two_devices(seen: &Observed) -> Option<Finding> {
    let twins = seen.twins?;
    let expected = match twins {
        Twins::Answers => "One answer to each SDO request (CiA 301, 7.2.4.3)",
        Twins::BootUps => "One boot-up message after a start (CiA 301, 7.2.8.3.3)",
        Twins::States(..) => "Heartbeats that say one state until a command changes it (CiA 301, 7.2.8.3.2)",
        Twins::Rhythm(..) => "One heartbeat each period (CiA 301, 7.2.8.3.2)",
    };
    let follows = format!("Two devices have the node-ID {}: both act on requests to either", seen.node);
    Some(warning(TOPIC, "node_twice", [expected.to_owned(), twins.to_string(), follows, TWO_DEVICES.to_owned()]))
}

/// What to do about two devices with one node-ID.
const TWO_DEVICES: &str =
    "Switch one off and give the other a node-ID of its own: ferrodrive lss scan, or its switches";

/// 1017h says how often one should come.
fn heartbeat(seen: &Observed) -> Option<Finding> {
    let (period, listened) = (seen.heartbeat_period()?, seen.heard.listened());
    let period_ms = period.as_millis() as u64;
    let heard = seen.heard.heartbeats(seen.node).map_or(0, |heard| heard.count);
    let most = listened.as_millis() as u64 / period_ms + 2;
    let expected = format!("A heartbeat every {period_ms} ms (1017h:00)");
    let found = format!("{heard} in {} ms", listened.as_millis());
    if heard == 0 && listened >= 2 * period {
        return Some(warning(
            TOPIC,
            "heartbeat_missing",
            [
                expected,
                found,
                "Masters that watch it take it for lost, and stop their motion".to_owned(),
                "Look for a crowded bus (ferrodrive dump) and for errors of the bus; reset the node".to_owned(),
            ],
        ));
    }
    // Twice what one device sends: two answer to one number.
    (heard > 2 * most).then(|| {
        warning(
            TOPIC,
            "node_twice",
            [
                expected,
                found,
                format!("Two devices send as node {}: both act on requests to either", seen.node),
                TWO_DEVICES.to_owned(),
            ],
        )
    })
}

/// Two clients at one SDO server take each other's answers (CiA 301, 7.2.4.3.1: one client for each channel).
fn other_master(seen: &Observed) -> Option<Finding> {
    let requests = seen.heard.requests(seen.node)?;
    Some(warning(
        TOPIC,
        "other_master",
        [
            "One SDO client for each node".to_owned(),
            format!("{} SDO requests of another program in {} ms", requests.count, seen.heard.listened().as_millis()),
            "That program and this one take each other's answers, and what one writes the other may overwrite"
                .to_owned(),
            "Let one of them do the work; while the other runs, look with commands that only listen: ferrodrive dump"
                .to_owned(),
        ],
    ))
}

/// CiA 301, 7.2.8.3.1: the command, then the node (0 for all).
fn nmt_by_other(seen: &Observed) -> Option<Finding> {
    let last = seen.heard.nmt()?;
    let [command, to, ..] = last.bits.to_le_bytes();
    let name = match command {
        1 => "start",
        2 => "stop",
        128 => "enter pre-operational",
        129 => "reset node",
        130 => "reset communication",
        _ => "an unknown command",
    };
    let quiet = command == 1 || (to != 0 && to != seen.node.raw());
    (!quiet).then(|| {
        warning(
            TOPIC,
            "nmt_by_other",
            [
                "NMT commands come from one master only".to_owned(),
                format!("{} NMT commands of another program; the last one was {name} to {}", last.count, all_or(to)),
                "PDOs end, or the node starts anew, in the middle of a motion".to_owned(),
                "Find the other NMT master (ferrodrive dump --service nmt) and let one of the two do it".to_owned(),
            ],
        )
    })
}

/// Block transfer is the device's choice (CiA 301, 7.2.4.2.9 and 7.2.4.2.13): it is reported where a long value was asked for in blocks.
fn no_block_transfer(seen: &Observed) -> Option<Finding> {
    let says = match seen.description {
        Some(model) if !model.sdo_block_transfer => format!("; the {} has none", model.name),
        _ => String::new(),
    };
    seen.refuses_blocks.then(|| {
        warning(
            TOPIC,
            "no_block_transfer",
            [
                "Long values are transferred in blocks (CiA 301, 7.2.4.2.9)".to_owned(),
                format!("It refused them with 0504 0001h{says}"),
                "They go in segments, each with an answer: twice the frames and more, and the motion waits as long".to_owned(),
                "Transfer programs and other long values while the machine stands; ask its maker for a firmware with block \
                 transfer if that takes too long"
                    .to_owned(),
            ],
        )
    })
}

fn all_or(node: u8) -> String {
    if node == 0 { "all nodes".to_owned() } else { format!("node {node}") }
}

/// A drive that watches its host stops when that falls silent.
fn host_watch(seen: &Observed) -> Option<Finding> {
    let listened = seen.heard.listened();
    match seen.description?.host_watch {
        HostWatch::Silence { time } => {
            let limit = Duration::from_millis(u64::try_from(seen.value(time)?).ok()?);
            let rpdos = seen.pdos.iter().filter(|(config, _)| config.pdo.direction == Direction::Rpdo);
            let ids = rpdos.filter_map(|(_, cob_id)| cob_id.can_id().as_standard());
            let silence = seen.heard.longest_silence(ids.chain([0x600 + u16::from(seen.node.raw())]));
            let fed = seen.talked_to.is_some_and(|ago| ago < limit);
            (seen.is_enabled() && !limit.is_zero() && silence >= limit && !fed).then(|| {
                cause(TOPIC, "host_silent", [
                    format!("A frame for it at least every {} ms ({})", limit.as_millis(), seen.named(time)),
                    format!("None for {} of the {} ms listened", silence.as_millis(), listened.as_millis()),
                    "It considers its host dead and stops".to_owned(),
                    "Send it something more often (an RPDO, a read of its statusword); what moves it with ferrodrive does \
                     so by itself"
                        .to_owned(),
                ])
            })
        }
        HostWatch::Heartbeat { consumer, .. } => heartbeat_of_host(seen, consumer),
        HostWatch::None => None,
    }
}

/// A drive at the fault of its watch. One whose motor has kept its power goes on with its last command at the next heartbeat, in
/// whatever mode that was given: a target of zero would be a place to go to in a position mode.
fn heartbeat_of_host(seen: &Observed, consumer: Mux) -> Option<Finding> {
    let entry = seen.value(consumer)?;
    let (host, limit_ms) = (NodeId::new((entry >> 16) as u8)?, entry & 0xFFFF);
    let (heard, node) = (seen.heard.heartbeats(host).map_or(0, |heard| heard.count), seen.node);
    let (follows, remedy) = if seen.is_live() {
        (
            "It considers its host dead and has stopped; with the next heartbeat it resumes what was commanded before",
            format!("End its old motion (ferrodrive quick-stop {node}), then restart the heartbeat of node {host}"),
        )
    } else {
        (
            "It considers its host dead and has stopped",
            format!("Restart the heartbeat of node {host}, then: ferrodrive reset {node}"),
        )
    };
    (seen.has_lost_host() && limit_ms > 0).then(|| {
        cause(
            TOPIC,
            "host_heartbeat_missing",
            [
                format!("A heartbeat of node {host} at least every {limit_ms} ms ({})", seen.named(consumer)),
                format!("{heard} of them in {} ms, and the fault of that watch", seen.heard.listened().as_millis()),
                follows.to_owned(),
                remedy,
            ],
        )
    })
}
