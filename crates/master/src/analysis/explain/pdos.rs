//! PDOs one by one: why one is silent, by [`why_silent`], and which of that is a finding.

use canopen::CobId;
use canopen::pdo::{Direction, EventTrigger, PdoId};

use super::finding::{Finding, Topic, warning};
use super::observed::Observed;
use super::overheard::HeardFrames;
use crate::pdo::{PdoConfig, Silence, Situation, why_silent};

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
    let used = seen.pdos.iter().filter(|(config, cob_id)| cob_id.is_valid() || !config.is_empty());
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
    let heard = heard(seen, cob_id);
    let is_tpdo = config.pdo.direction == Direction::Tpdo;
    if is_tpdo && heard.is_some() {
        return None;
    }
    let situation = Situation {
        nmt: seen.nmt,
        event_trigger: seen.description.map_or(EventTrigger::Change, |description| description.pdo.event_trigger),
        sync_heard: Some(seen.heard.sync().is_some()),
        heard: Some(heard.is_some()),
    };
    if let Some(silence) = why_silent(config, cob_id, &situation).first() {
        let (rule, remedy) = match silence {
            Silence::Nmt(_) => ("pdo_not_operational", format!("ferrodrive nmt {} start", seen.node)),
            Silence::NoSync => (
                "pdo_without_sync",
                "Have the master send SYNC (ferrodrive sync --every 10ms), or set its type to 255".to_owned(),
            ),
            // What it was set up to be.
            _ => ("", String::new()),
        };
        return Some(Reason { rule, is_finding: !rule.is_empty(), why: silence.to_string(), remedy });
    }
    if is_tpdo {
        return Some(unsent(config, seen));
    }
    let (shortest, mapped) = (usize::from(heard?.shortest), config.bytes());
    (shortest < mapped).then(|| Reason {
        rule: "pdo_too_short",
        is_finding: true,
        why: format!("a frame of {shortest} bytes came where {mapped} are mapped: it has no effect"),
        remedy: "Let its sender map the same objects as the node".to_owned(),
    })
}

/// Why a TPDO that nothing keeps away was not heard: listening was shorter than its period, or it had to come.
fn unsent(config: &PdoConfig, seen: &Observed) -> Reason {
    let listened = seen.heard.listened();
    let as_set_up = |why: String| Reason { rule: "", is_finding: false, why, remedy: String::new() };
    match (config.transmission.0, config.event_time, config.inhibit_time) {
        (every @ 2..=240, ..) => as_set_up(format!("it comes only after every {every}. SYNC")),
        (_, Some(event), _) if event >= listened => {
            as_set_up(format!("its event timer of {} ms is longer than was listened", event.as_millis()))
        }
        (.., Some(inhibit)) if inhibit >= listened => {
            as_set_up(format!("its inhibit time of {} ms is longer than was listened", inhibit.as_millis()))
        }
        // CiA 301, 7.3.2.2.1: PDOs exist in the state operational alone.
        _ if seen.nmt.is_none() => Reason {
            rule: "pdo_missing",
            is_finding: true,
            why:
                "it should have come in this time if the node is operational; without a heartbeat its NMT state is not \
                  known"
                    .to_owned(),
            remedy: format!("PDOs run in the NMT state operational only: ferrodrive nmt {} start", seen.node),
        },
        _ => Reason {
            rule: "pdo_missing",
            is_finding: true,
            why: "it should have come in this time".to_owned(),
            remedy: "Look at the NMT state and the errors of the bus: ferrodrive dump".to_owned(),
        },
    }
}
