//! PDOs one by one: why one is silent (CiA 301, 7.5.2.35 to 7.5.2.38).

use std::time::Duration;

use canopen::pdo::{Direction, PdoId};
use canopen::{CobId, NmtState};

use super::overheard::HeardFrames;
use super::{Finding, Observed, Topic, warning};
use crate::pdo::{PdoConfig, TransmissionType};

const TOPIC: Topic = Topic::Pdo;

/// A PDO and what was heard of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PdoSeen {
    /// Which one.
    pub pdo: PdoId,
    /// Its identifier.
    pub id: u32,
    /// It is switched on (bit 31 of its COB-ID is 0).
    pub valid: bool,
    /// How many frames of it came.
    pub heard: u64,
    /// Why none came, or why those that came have no effect; `None` where all is well.
    pub silent: Option<String>,
}

/// Why a PDO is silent: its rule, whether it is a finding or as it was set up, and the sentence.
struct Reason {
    rule: &'static str,
    is_finding: bool,
    why: String,
    remedy: String,
}

/// The PDOs that are mapped or switched on.
pub(super) fn seen(seen: &Observed) -> Vec<PdoSeen> {
    let used = seen.pdos.iter().filter(|(config, cob_id)| cob_id.is_valid() || !config.map.0.is_empty());
    used.map(|(config, cob_id)| PdoSeen {
        pdo: config.pdo,
        id: cob_id.can_id().raw(),
        valid: cob_id.is_valid(),
        heard: heard(seen, *cob_id).map_or(0, |heard| heard.count),
        silent: reason(seen, config, *cob_id).map(|reason| reason.why),
    })
    .collect()
}

/// One finding for each rule, with all PDOs that it is about: one missing SYNC silences several.
pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    let first = findings.len();
    for (config, cob_id) in &seen.pdos {
        let Some(reason) = reason(seen, config, *cob_id).filter(|reason| reason.is_finding) else { continue };
        let count = heard(seen, *cob_id).map_or(0, |heard| heard.count);
        let name = format!("{} ({:03X}h): {count}", config.pdo, cob_id.can_id().raw());
        if let Some(known) = findings[first..].iter_mut().find(|finding| finding.rule == reason.rule) {
            known.found.push_str(", ");
            known.found.push_str(&name);
            continue;
        }
        let expected = "The PDO is exchanged, and acted on".to_owned();
        let found = format!("Frames in {} ms: {name}", seen.heard.listened().as_millis());
        findings.push(warning(TOPIC, reason.rule, [expected, found, reason.why, reason.remedy]));
    }
}

fn heard(seen: &Observed, cob_id: CobId) -> Option<&HeardFrames> {
    seen.heard.under(cob_id.can_id().as_standard()?)
}

fn reason(seen: &Observed, config: &PdoConfig, cob_id: CobId) -> Option<Reason> {
    let node = seen.node;
    let heard = heard(seen, cob_id);
    let as_set_up = |why: String| Some(Reason { rule: "", is_finding: false, why, remedy: String::new() });
    let finding = |rule, why: String, remedy: String| Some(Reason { rule, is_finding: true, why, remedy });
    if !cob_id.is_valid() {
        return as_set_up(format!("It is switched off: bit 31 of {:04X}h:01 is 1", config.pdo.parameter_index()));
    }
    if config.map.0.is_empty() {
        return as_set_up(format!("It carries nothing: {:04X}h:00 is 0", config.pdo.mapping_index()));
    }
    if let Some(state @ (NmtState::PreOperational | NmtState::Stopped)) = seen.nmt {
        let why = format!("The node is {state}: PDOs are exchanged in operational only");
        return finding("pdo_not_operational", why, format!("ferrodrive nmt {node} start"));
    }
    if config.transmission.is_synchronous() && seen.heard.sync().is_none() {
        let why = "Its type (0 to 240) makes it wait for SYNC, and none was heard".to_owned();
        let remedy = "Have the master send SYNC (ferrodrive sync --every 10ms), or set its type to 255".to_owned();
        return finding("pdo_without_sync", why, remedy);
    }
    match (config.pdo.direction, heard) {
        (Direction::Tpdo, Some(_)) => None,
        (Direction::Tpdo, None) => unsent(config, seen.heard.listened()).map_or_else(
            || {
                let why = "It should have come in this time".to_owned();
                let remedy = "Look at the NMT state and the errors of the bus: ferrodrive dump".to_owned();
                finding("pdo_missing", why, remedy)
            },
            as_set_up,
        ),
        (Direction::Rpdo, None) => as_set_up("Nobody sends it".to_owned()),
        (Direction::Rpdo, Some(heard)) if usize::from(heard.shortest) < config.map.bytes() => finding(
            "pdo_too_short",
            format!(
                "A frame of {} bytes came where {} are mapped: it has no effect",
                heard.shortest,
                config.map.bytes()
            ),
            "Let its sender map the same objects as the node".to_owned(),
        ),
        (Direction::Rpdo, Some(_)) => None,
    }
}

/// Why a TPDO that could be sent was not; `None` if it had to come.
fn unsent(config: &PdoConfig, listened: Duration) -> Option<String> {
    let ms = |time: Duration| time.as_millis();
    let event = config.event_time.filter(|time| !time.is_zero());
    match config.transmission {
        TransmissionType(0) => Some("Its type is 0: after SYNC, and only when its values have changed".to_owned()),
        TransmissionType(every @ 2..=240) => Some(format!("Its type is {every}: only after every {every}. SYNC")),
        TransmissionType::SYNC_RTR | TransmissionType::EVENT_RTR => {
            Some("It waits for a remote frame, and nobody asks".to_owned())
        }
        kind if kind.0 >= 254 => match (event, config.inhibit_time) {
            (_, Some(inhibit)) if inhibit >= listened => {
                Some(format!("Its inhibit time of {} ms is longer than was listened", ms(inhibit)))
            }
            (None, _) => {
                Some("It is sent on a change of its values, and has no event timer: nothing has changed".to_owned())
            }
            (Some(event), _) if event >= listened => {
                Some(format!("Its event timer of {} ms is longer than was listened", ms(event)))
            }
            _ => None,
        },
        TransmissionType(1) => None,
        TransmissionType(reserved) => Some(format!("Its type {reserved} is reserved")),
    }
}
