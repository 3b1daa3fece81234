//! Why a PDO stays away, from how it is set up and what was heard (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38).

use std::fmt;
use std::time::Duration;

use canopen::pdo::{Direction, EventTrigger};
use canopen::{CobId, NmtState};

use super::config::PdoConfig;

/// What is known beside how the PDO is set up. What is not known is `None`.
#[derive(Clone, Copy, Debug)]
pub struct Situation {
    /// The node's NMT state.
    pub nmt: Option<NmtState>,
    /// What makes the model send event-driven TPDOs.
    pub event_trigger: EventTrigger,
    /// SYNC was heard.
    pub sync_heard: Option<bool>,
    /// A frame with the PDO's identifier was heard.
    pub heard: Option<bool>,
}

/// A reason why a PDO is not sent, or not taken over. Prints as a sentence without its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Silence {
    /// Bit 31 of its COB-ID is set.
    Off,
    /// Its mapping is empty.
    Empty,
    /// PDOs exist in the NMT state operational only.
    Nmt(&'static str),
    /// It waits for SYNC, and none was heard.
    NoSync,
    /// After SYNC, and only when something has changed.
    SyncAndChange,
    /// Only when a remote frame asks for it.
    OnRequest,
    /// A transmission type that the standard keeps for later.
    Reserved(u8),
    /// When a mapped value changes; its event timer is off.
    OnChange,
    /// It answers the RPDO of its number.
    AnswersRpdo,
    /// Its inhibit time holds it back for so long.
    Inhibited(Duration),
    /// An RPDO, and no node was heard sending it.
    NoSender,
}

/// A PDO that is held back for longer than this seems silent to a person.
const LONG: Duration = Duration::from_secs(1);

/// What keeps a PDO away, the first thing to fix first; empty if nothing is known that does.
pub fn why_silent(config: &PdoConfig, cob_id: CobId, situation: &Situation) -> Vec<Silence> {
    // Whatever else there is acts only once this has been fixed.
    if !cob_id.is_valid() {
        return vec![Silence::Off];
    }
    if config.bytes() == 0 {
        return vec![Silence::Empty];
    }
    let mut reasons = Vec::new();
    let mut add = |holds: bool, reason: Silence| {
        if holds {
            reasons.push(reason);
        }
    };
    match situation.nmt {
        Some(NmtState::PreOperational) => add(true, Silence::Nmt("pre-operational")),
        Some(NmtState::Stopped) => add(true, Silence::Nmt("stopped")),
        _ => {}
    }
    let by_sync = config.transmission.is_synchronous() || config.transmission.0 == 252;
    add(by_sync && situation.sync_heard == Some(false), Silence::NoSync);
    if config.pdo.direction == Direction::Rpdo {
        add(situation.heard == Some(false), Silence::NoSender);
        add(matches!(config.transmission.0, 241..=253), Silence::Reserved(config.transmission.0));
        return reasons;
    }
    match config.transmission.0 {
        0 => add(true, Silence::SyncAndChange),
        1..=240 => {}
        252 | 253 => add(true, Silence::OnRequest),
        254 | 255 => {
            let timer = config.event_time.is_some_and(|time| !time.is_zero());
            let answers = situation.event_trigger == EventTrigger::AnswersRpdo;
            add(answers, Silence::AnswersRpdo);
            add(!timer && !answers, Silence::OnChange);
        }
        reserved => add(true, Silence::Reserved(reserved)),
    }
    if let Some(time) = config.inhibit_time.filter(|time| *time >= LONG) {
        add(true, Silence::Inhibited(time));
    }
    reasons
}

impl Silence {
    /// True for what only makes it rare: it comes when its condition does.
    pub const fn is_condition(self) -> bool {
        matches!(self, Self::SyncAndChange | Self::OnRequest | Self::OnChange | Self::AnswersRpdo | Self::Inhibited(_))
    }
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("off: bit 31 of its COB-ID is set"),
            Self::Empty => f.write_str("nothing is mapped into it"),
            Self::Nmt(state) => write!(f, "the node is {state}, and PDOs are sent and taken in operational only"),
            Self::NoSync => f.write_str("it waits for SYNC, and none was heard"),
            Self::SyncAndChange => f.write_str("it comes after a SYNC, and only if a mapped value has changed"),
            Self::OnRequest => f.write_str("it comes only when a remote frame asks for it"),
            Self::Reserved(kind) => write!(f, "its transmission type {kind} means nothing by CiA 301"),
            Self::OnChange => f.write_str("it comes when a mapped value changes; its event timer is off"),
            Self::AnswersRpdo => f.write_str("it comes as the answer to the RPDO of its number"),
            Self::Inhibited(time) => write!(f, "its inhibit time holds it back for {time:?}"),
            Self::NoSender => f.write_str("no node was heard sending it"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::PdoMap;
    use crate::pdo::TransmissionType;
    use canopen::pdo::{MappingRecord, PdoId, PdoNumber};

    const WELL: Situation = Situation {
        nmt: Some(NmtState::Operational),
        event_trigger: EventTrigger::Change,
        sync_heard: Some(true),
        heard: Some(true),
    };

    fn pdo(direction: Direction, kind: u8) -> PdoConfig {
        let map = PdoMap(vec![MappingRecord::from_raw(0x6041_0010)]);
        PdoConfig::new(PdoId { direction, number: PdoNumber::FIRST }, map).transmission(TransmissionType(kind))
    }

    fn reasons(config: &PdoConfig, situation: &Situation) -> Vec<Silence> {
        why_silent(config, CobId::standard(0x184), situation)
    }

    #[test]
    fn a_pdo_that_comes_has_no_reason_to_stay_away() {
        assert_eq!(reasons(&pdo(Direction::Tpdo, 1), &WELL), []);
        assert_eq!(reasons(&pdo(Direction::Rpdo, 255), &WELL), []);
        let by_timer = pdo(Direction::Tpdo, 255).event_time(Duration::from_millis(100));
        assert_eq!(reasons(&by_timer, &WELL), []);
    }

    #[test]
    fn each_reason_is_found_where_it_holds_and_what_is_not_known_is_none() {
        let off = why_silent(&pdo(Direction::Tpdo, 1), CobId(0x8000_0184), &WELL);
        assert_eq!(off, [Silence::Off]);
        let mut empty = pdo(Direction::Tpdo, 1);
        empty.map.0.clear();
        assert_eq!(reasons(&empty, &WELL), [Silence::Empty]);
        let pre = Situation { nmt: Some(NmtState::PreOperational), ..WELL };
        assert_eq!(reasons(&pdo(Direction::Tpdo, 1), &pre), [Silence::Nmt("pre-operational")]);
        let quiet = Situation { sync_heard: Some(false), heard: Some(false), ..WELL };
        assert_eq!(reasons(&pdo(Direction::Tpdo, 240), &quiet), [Silence::NoSync]);
        assert_eq!(reasons(&pdo(Direction::Tpdo, 255), &quiet), [Silence::OnChange]);
        assert_eq!(reasons(&pdo(Direction::Rpdo, 1), &quiet), [Silence::NoSync, Silence::NoSender]);
        let unknown = Situation { nmt: None, sync_heard: None, heard: None, ..WELL };
        assert_eq!(reasons(&pdo(Direction::Rpdo, 1), &unknown), []);
        assert_eq!(reasons(&pdo(Direction::Tpdo, 0), &WELL), [Silence::SyncAndChange]);
        assert_eq!(reasons(&pdo(Direction::Tpdo, 253), &WELL), [Silence::OnRequest]);
        assert_eq!(reasons(&pdo(Direction::Tpdo, 245), &WELL), [Silence::Reserved(245)]);
        let answers = Situation { event_trigger: EventTrigger::AnswersRpdo, ..WELL };
        assert_eq!(reasons(&pdo(Direction::Tpdo, 255), &answers), [Silence::AnswersRpdo]);
        let held = pdo(Direction::Tpdo, 1).inhibit_time(Duration::from_secs(3));
        assert_eq!(reasons(&held, &WELL), [Silence::Inhibited(Duration::from_secs(3))]);
    }
}
