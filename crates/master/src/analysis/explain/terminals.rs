//! What stops a motor from outside the bus, where objects show it: an emergency stop, limit switches, a brake that is set.
//! The description says which input that is, by its name in the manual.

use cia402::object::{POSITION_ACTUAL_VALUE, TARGET_POSITION};
use devices::{BrakeOutput, Input, InputSignal, Meaning, Terminals};

use super::finding::{Finding, Topic, Weight, cause, warning};
use super::observed::Observed;
use cia402::ModeOfOperation;

const TOPIC: Topic = Topic::Terminals;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    let Some(terminals) = seen.axis.map(|axis| axis.terminals) else { return };
    for input in terminals.inputs {
        match signal(seen, input) {
            Some(InputSignal::EmergencyStop) => findings.push(emergency_stop(seen, input)),
            Some(InputSignal::PositiveLimit) => findings.extend(limit_switch(seen, input, true)),
            Some(InputSignal::NegativeLimit) => findings.extend(limit_switch(seen, input, false)),
            // It keeps nothing from moving.
            Some(InputSignal::Home) | None => {}
        }
    }
    findings.extend(terminals.brake.as_ref().and_then(|brake| brake_set(seen, brake)));
}

/// What an input says, if it is active.
fn signal(seen: &Observed, input: &Input) -> Option<InputSignal> {
    let terminals = seen.axis?.terminals;
    let levels = seen.axis_value(terminals.levels?)?;
    let reversed = terminals.polarity.and_then(|polarity| seen.axis_value(polarity)).unwrap_or(0);
    let is_active = Terminals::is_active(input, levels, reversed);
    let function = match input.meaning {
        Meaning::Chosen { function, .. } => seen.axis_value(function),
        Meaning::Fixed(_) => None,
    };
    input.meaning.signal(function).filter(|_| is_active)
}

/// `2003h:00 input_status has bit 0 = 1, and 2030h:02 input_x0_function is 9 (emergency stop)`.
fn found(seen: &Observed, input: &Input, signal: InputSignal) -> String {
    let levels = seen.axis.and_then(|axis| axis.terminals.levels).map(|levels| seen.place(levels));
    let level = levels.and_then(|levels| seen.value(levels)).unwrap_or(0) >> input.bit & 1;
    let shown =
        levels.map_or_else(String::new, |levels| format!("{} has bit {} = {level}", seen.named(levels), input.bit));
    match input.meaning {
        Meaning::Fixed(_) => shown,
        Meaning::Chosen { function, .. } => {
            let function = seen.place(function);
            let value = seen.value(function).unwrap_or(0);
            format!("{shown}, and {} is {value} ({})", seen.named(function), signal.name())
        }
    }
}

fn emergency_stop(seen: &Observed, input: &Input) -> Finding {
    let signal = InputSignal::EmergencyStop;
    cause(
        TOPIC,
        "emergency_stop",
        [
            format!("The input {} ({}) is not active", input.name, signal.name()),
            found(seen, input, signal),
            "The drive stops its motor, or leaves it without power, as long as this lasts".to_owned(),
            format!(
                "When it is safe, release the emergency stop and look at the wire of {}; then write the targets again",
                input.name
            ),
        ],
    )
}

/// Only of an enabled shaft that stands, and does not look for its reference: then a switch may be met.
fn limit_switch(seen: &Observed, input: &Input, positive: bool) -> Option<Finding> {
    let mode = seen.mode.filter(|mode| *mode != ModeOfOperation::HOMING)?;
    if !seen.is_enabled() || seen.turns() {
        return None;
    }
    let heading = match mode {
        ModeOfOperation::PROFILE_POSITION | ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION => {
            seen.axis_value(TARGET_POSITION)?.saturating_sub(seen.axis_value(POSITION_ACTUAL_VALUE)?).signum() as f64
        }
        _ => seen.target_rpm.unwrap_or(0.0),
    };
    let blocks = if positive { heading > 0.0 } else { heading < 0.0 };
    let signal = if positive { InputSignal::PositiveLimit } else { InputSignal::NegativeLimit };
    let texts = [
        format!("The input {} ({}) is not active", input.name, signal.name()),
        found(seen, input, signal),
        format!("The shaft does not turn in the {} direction", if positive { "positive" } else { "negative" }),
        "Move away from the switch the other way; if the shaft is not there, look at the switch, its wire and its polarity"
            .to_owned(),
    ];
    let weight = if blocks { Weight::Cause } else { Weight::Warning };
    Some(Finding { weight, ..warning(TOPIC, "limit_switch", texts) })
}

/// The host has the brake set while the motor is to turn.
fn brake_set(seen: &Observed, brake: &BrakeOutput) -> Option<Finding> {
    let bit = |mux| Some(seen.axis_value(mux)? >> brake.bit & 1 == 1);
    let has_say = brake.mask.is_none_or(|mask| bit(mask) == Some(true));
    if !(seen.is_enabled() && !seen.turns() && has_say && bit(brake.object)?) {
        return None;
    }
    let object = seen.place(brake.object);
    Some(cause(
        TOPIC,
        "brake_set",
        [
            format!(
                "The brake is released before the motor is to turn: {} has bit {} = 0",
                seen.named(object),
                brake.bit
            ),
            format!("Bit {} is 1: the output of the brake ({}) holds the shaft", brake.bit, brake.name),
            "The motor works against its own brake, with a high current and no motion".to_owned(),
            format!("Write {object} with bit {} = 0, then move; set it again when the motor stands", brake.bit),
        ],
    ))
}
