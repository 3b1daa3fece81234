//! PDOs as sent to a page: the configuration of each, why it is not sent, and what may be changed.

use std::time::Duration;

use canopen::od::Entry;
use canopen::pdo::{Direction, EventTrigger, PdoId};
use canopen::{CobId, Mux};
use devices::Description;
use master::pdo::{PdoConfig, Silence, TimerUnits, TransmissionType, most_objects};
use serde_json::{Value, json};

/// The configuration of a PDO, and what may be changed; nothing where the model is unknown.
pub(crate) fn pdo_json(
    model: Option<&'static Description>,
    config: &PdoConfig,
    cob_id: CobId,
    silent: &[Silence],
) -> Value {
    let mut shown = config_json(model, config, cob_id, silent);
    let takes = match model {
        Some(model) => takes(model, config.pdo),
        None => Value::Null,
    };
    shown["manual"] = json!(model.and_then(|model| manual_name(model, config.pdo)));
    shown["takes"] = takes;
    shown
}

/// The present or planned configuration of a PDO.
pub(crate) fn config_json(
    model: Option<&'static Description>,
    config: &PdoConfig,
    cob_id: CobId,
    silent: &[Silence],
) -> Value {
    let objects = config.map.0.iter().map(|record| {
        let name = match model {
            Some(model) => match model.pdo.mapping.dummy(record.mux) {
                Some(skipped) => Some(skipped.name()),
                None => model.row(record.mux).map(|row| row.name),
            },
            None => master::decode::common_name(record.mux),
        };
        json!({ "object": record.mux.to_string(), "name": name, "bits": record.bits })
    });
    let ms = |time: Option<Duration>| time.map(|time| time.as_secs_f64() * 1e3);
    json!({
        "pdo": config.pdo.to_string(),
        "id": cob_id.can_id().raw(),
        "valid": cob_id.is_valid(),
        "transmission": config.transmission.0,
        "when": config.when(),
        "inhibit_ms": ms(config.inhibit_time),
        "event_ms": ms(config.event_time),
        "objects": objects.collect::<Vec<_>>(),
        "bits": config.map.bits(),
        "silent": silent.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

/// Its name in the manual, where that counts otherwise than CiA 301.
fn manual_name(model: &Description, pdo: PdoId) -> Option<String> {
    let first = model.pdo.first_in_manual;
    (first != 1).then(|| format!("{}{}", pdo.direction, pdo.number.position() + usize::from(first)))
}

/// What may be changed, with the reason where it may not.
fn takes(model: &'static Description, pdo: PdoId) -> Value {
    let row = |sub_index: u8| model.row(Mux::new(pdo.parameter_index(), sub_index));
    let units = TimerUnits::of(model);
    json!({
        "mapping": mapping_refusal(model, pdo),
        "objects": most_objects(model, pdo),
        "id": refusal(model, row(1), "its COB-ID"),
        "type": refusal(model, row(2), "its transmission type"),
        "types": row(2).map_or_else(Vec::new, |row| types(model, pdo.direction, row)),
        "inhibit": time(model, row(3), "an inhibit time", units.inhibit),
        "event": time(model, row(5), "an event timer", units.event),
    })
}

fn mapping_refusal(model: &Description, pdo: PdoId) -> Option<String> {
    if model.pdo.fixed_mapping {
        return Some(format!("its mapping is fixed{}", source(model, pdo.mapping_index())));
    }
    refusal(model, model.row(Mux::new(pdo.mapping_index(), 0)), "its mapping")
}

/// Why an object is not written; `None` if it may be.
fn refusal(model: &Description, row: Option<&Entry>, what: &str) -> Option<String> {
    match row {
        None => Some(format!("a {} does not have {what}", model.name)),
        Some(row) if !row.access.is_writable() => Some(format!("{what} is read-only{}", source(model, row.index))),
        Some(_) => None,
    }
}

fn source(model: &Description, index: u16) -> String {
    model.section(index).map_or_else(String::new, |section| format!(" ({}, {section})", model.manual))
}

fn time(model: &Description, row: Option<&Entry>, what: &str, unit: Duration) -> Value {
    let most = row.map_or(0, |row| row.limits_at(1).1.clamp(0, u16::MAX.into()) as u32);
    json!({
        "why_not": refusal(model, row, what),
        "step_ms": unit.as_secs_f64() * 1e3,
        "most_ms": (unit * most).as_secs_f64() * 1e3,
    })
}

/// Types with one meaning, ends included. Source: CiA 301, tables 66 and 71; those between are reserved.
const TPDO_TYPES: [(u8, u8); 7] = [(0, 0), (1, 1), (2, 240), (252, 252), (253, 253), (254, 254), (255, 255)];
const RPDO_TYPES: [(u8, u8); 3] = [(0, 240), (254, 254), (255, 255)];

fn types(model: &'static Description, direction: Direction, row: &Entry) -> Vec<Value> {
    let types = if direction == Direction::Tpdo { &TPDO_TYPES[..] } else { &RPDO_TYPES[..] };
    let one = |(from, to): &(u8, u8)| {
        let taken: Vec<u8> = (*from..=*to).filter(|value| row.check_value((*value).into()).is_ok()).collect();
        let why_not = || format!("the {} accepts {}{}", model.name, allowed(row), source(model, row.index));
        json!({
            "from": taken.first().unwrap_or(from),
            "to": taken.last().unwrap_or(to),
            "words": words(model, direction, *from, *to),
            "why_not": taken.is_empty().then(why_not),
        })
    };
    types.iter().map(one).collect()
}

fn words(model: &Description, direction: Direction, from: u8, to: u8) -> String {
    match (direction, model.pdo.event_trigger, from) {
        (Direction::Tpdo, _, 2) if to > 2 => "after every n-th SYNC".to_owned(),
        (Direction::Tpdo, EventTrigger::AnswersRpdo, 254 | 255) => "as the answer to the RPDO of its number".to_owned(),
        (Direction::Tpdo, EventTrigger::ChangeOr255ByTimer, 255) => {
            "by its event timer, or on change if that is 0".to_owned()
        }
        (Direction::Tpdo, _, 254 | 255) => "on change, and by its event timer".to_owned(),
        _ => {
            let number = canopen::pdo::PdoNumber::FIRST;
            let config = PdoConfig::new(PdoId { direction, number }, master::core::PdoMap::default());
            config.transmission(TransmissionType(from)).when()
        }
    }
}

fn allowed(row: &Entry) -> String {
    if row.values.is_empty() {
        let (low, high) = row.limits_at(1);
        return format!("{low} to {high}");
    }
    row.values.iter().map(|(value, _)| value.to_string()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use canopen::pdo::PdoNumber;

    const TPDO1: PdoId = PdoId { direction: Direction::Tpdo, number: PdoNumber::FIRST };

    /// M4230E17B50 and its siblings, 5.08: the mapping is fixed, and transmission types are those of its list.
    #[test]
    fn settings_that_a_manual_forbids_have_a_reason() {
        let joint = devices::model("m4230e17b50").expect("a model");
        let takes = takes(joint, TPDO1);
        let mapping = takes["mapping"].as_str().expect("a reason");
        assert!(mapping.contains("its mapping is fixed") && mapping.contains("5.08.3"), "{mapping}");
        assert_eq!(takes["event"]["why_not"], "a m4230e17b50 does not have an event timer");
        assert_eq!(manual_name(joint, TPDO1), None, "it counts from 1");
        let zltech = devices::model("zlim42c").expect("a model");
        assert_eq!(manual_name(zltech, TPDO1).as_deref(), Some("TPDO0"));
    }
}
