//! The help of a page on `?`: the text of an object, a state, a bit, a mode or a fault, and its source.
//!
//! Terms of the model come from its description with the section of the manual, all others from the glossary.

pub(crate) mod glossary;

use canopen::NodeId;
use devices::Description;
use serde_json::{Value, json};
use words::object::object;

use crate::answer::Answer;
use crate::command::Topic;
use crate::parameters::object_rows::row_json;
use crate::parameters::transactions::Refusal;
use crate::state::Host;
use crate::work::{Asked, send};
use glossary::Word;

impl Host {
    /// Explains a term.
    pub(crate) fn help(&self, node: Option<NodeId>, topic: Topic, name: &str, (seq, answer): Asked) {
        let known = node.and_then(|node| self.nodes.get(&node));
        let model = known.and_then(|known| known.drive.as_ref()).and_then(master::Drive::description);
        let shown = explain(node, model, topic, name);
        send(
            answer,
            match shown {
                Ok(shown) => Answer::known(seq, shown),
                Err((kind, text)) => Answer::failed(Some(seq), kind, text),
            },
        );
    }
}

/// `name` as the page shows it.
fn explain(
    node: Option<NodeId>,
    model: Option<&'static Description>,
    topic: Topic,
    name: &str,
) -> Result<Value, Refusal> {
    let words: &[Word] = match topic {
        Topic::State => &glossary::STATES,
        Topic::StatusBit => &glossary::STATUS_BITS,
        Topic::ControlBit => &glossary::CONTROL_BITS,
        Topic::Mode => &glossary::MODES,
        Topic::Nmt => &glossary::NMT,
        Topic::Service => &glossary::SERVICES,
        Topic::Object | Topic::Fault => &[],
    };
    let of_model = match (topic, model) {
        (Topic::Object, Some(model)) => of_object(node, model, name)?,
        (Topic::Fault, Some(model)) => of_fault(model, name),
        (Topic::StatusBit, Some(model)) => of_own_bit(model, name),
        _ => None,
    };
    let homing: &[Word] = if topic == Topic::StatusBit { &glossary::HOMING_BITS } else { &[] };
    let of_words = words.iter().chain(homing).find(|word| word.name == name);
    let of_words = of_words.map(|word| json!({ "title": word.name, "text": word.text, "source": word.source }));
    of_model.or(of_words).ok_or_else(|| ("unknown_word", format!("no help for '{name}'")))
}

fn of_object(node: Option<NodeId>, model: &'static Description, name: &str) -> Result<Option<Value>, Refusal> {
    let found = object(name).and_then(|object| object.resolve(Some(model.dictionary)));
    let (mux, row) = found.map_err(|why| ("unknown_object", why))?;
    let (Some(row), Some(node)) = (row, node) else { return Ok(None) };
    let mut shown = row_json(model, row, node);
    shown["text"] = json!(if row.description.is_empty() { row.title } else { row.description });
    shown["title"] = json!(format!("{mux} {}", row.name));
    shown["source"] = json!(source(model, model.section(row.index)));
    Ok(Some(shown))
}

fn of_fault(model: &Description, name: &str) -> Option<Value> {
    let row = model.faults.table.iter().find(|row| row.name == name)?;
    let source = source(model, Some(model.faults.section));
    Some(json!({
        "title": format!("{} ({:04X}h)", row.name, row.code),
        "text": row.remedy,
        "source": source,
    }))
}

/// A bit of the model's own table.
fn of_own_bit(model: &Description, name: &str) -> Option<Value> {
    let bits = model.first_axis()?.statusword_bits;
    let (mask, name) = bits.iter().find(|(_, own)| *own == name)?;
    let places: Vec<_> = (0..16).filter(|bit| mask >> bit & 1 == 1).map(|bit: u16| bit.to_string()).collect();
    let many = if places.len() == 1 { "Bit" } else { "Bits" };
    let meaning = glossary::HOMING_BITS.iter().find(|word| word.name == *name).map_or("", |word| word.text);
    let text = format!("{many} {} of this model's statusword (6041h): {name}. {meaning}", places.join(" and "));
    let source = source(model, model.section(0x6041));
    Some(json!({ "title": name, "text": text.trim(), "source": source }))
}

fn source(model: &Description, section: Option<&str>) -> String {
    match section {
        Some(section) if !section.is_empty() => format!("{}, {section}", model.manual),
        _ => model.manual.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use cia402::{ModeOfOperation, PowerState};

    use super::*;

    fn shown(model: &str, topic: Topic, name: &str) -> Value {
        let model = devices::model(model).expect("a model");
        explain(NodeId::new(1), Some(model), topic, name).unwrap_or_else(|why| panic!("{name}: {why:?}"))
    }

    #[test]
    fn every_object_fault_and_bit_of_every_model_has_a_text_and_a_source() {
        for model in devices::all().iter() {
            for row in model.dictionary.rows() {
                let shown = shown(model.name, Topic::Object, &row.mux().to_string());
                let source = shown["source"].as_str().expect("a text");
                assert!(
                    source.starts_with(model.manual) && source.len() > model.manual.len(),
                    "{}: {shown}",
                    model.name
                );
                assert_ne!(shown["text"], "", "{}: {shown}", model.name);
            }
            for row in model.faults.table {
                let shown = shown(model.name, Topic::Fault, row.name);
                assert_eq!(shown["text"], row.remedy);
                assert!(shown["source"].as_str().expect("a text").ends_with(model.faults.section), "{shown}");
            }
            for (_, name) in model.axes.iter().flat_map(|axis| axis.statusword_bits) {
                assert!(shown(model.name, Topic::StatusBit, name)["text"].as_str().expect("a text").contains("6041h"));
            }
        }
    }

    #[test]
    fn every_state_and_mode_has_a_text() {
        for state in PowerState::ALL {
            assert_eq!(shown("zlac8030l", Topic::State, state.name())["source"], "CiA 402-2, 8.2");
        }
        for mode in (0..=10).filter_map(|mode| ModeOfOperation(mode).name()) {
            shown("zlac8030l", Topic::Mode, mode);
        }
        for word in glossary::SERVICES {
            assert_eq!(shown("zlac8030l", Topic::Service, word.name)["source"], word.source);
        }
        for state in ["initialising", "pre-operational", "operational", "stopped"] {
            shown("zlac8030l", Topic::Nmt, state);
        }
    }

    /// Of a drive of the standard, in every mode.
    #[test]
    fn every_bit_that_can_be_shown_has_a_text() {
        for (_, name) in crate::snapshot::CONTROL_BITS {
            shown("zlac8030l", Topic::ControlBit, name);
        }
        for mode in 0..=10 {
            for power in PowerState::ALL {
                for name in shows_all(ModeOfOperation(mode), power).statusword_words() {
                    shown("zlac8030l", Topic::StatusBit, name);
                }
            }
        }
    }

    /// A drive of the standard with all bits set.
    fn shows_all(mode: ModeOfOperation, power: PowerState) -> master::drive::DriveState {
        master::drive::DriveState {
            statusword: cia402::Statusword(0xFFFF),
            power: Some(power),
            style: devices::PowerStyle::Cia402,
            own_bits: &[],
            mode: Some(mode),
            fault_code: Some(0),
            faults: Vec::new(),
            position: None,
            angle: None,
            velocity: None,
            current: None,
            supply: None,
            motor_temperature: None,
            driver_temperature: None,
            nmt: None,
            heartbeat_age: None,
        }
    }
}
