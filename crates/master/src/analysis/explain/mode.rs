//! The mode asked for (6060h) and the one that the drive is in (6061h).

use cia402::ModeOfOperation;
use cia402::object::MODES_OF_OPERATION;

use super::finding::{Finding, Topic, cause};
use super::observed::Observed;

const TOPIC: Topic = Topic::Mode;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    let (Some(shown), Some(wanted)) = (seen.mode, seen.axis_value(MODES_OF_OPERATION)) else { return };
    let (mode, display) = (seen.place(MODES_OF_OPERATION), seen.mode_object());
    let none = ModeOfOperation::NONE;
    let wanted = ModeOfOperation(i8::try_from(wanted).unwrap_or_default());
    if shown != wanted && mode != display {
        findings.push(cause(
            TOPIC,
            "mode_not_taken",
            [
                format!("{display} shows the mode {wanted} of {mode}"),
                format!("{display} shows {shown}"),
                "It acts on the set-points of the mode that it shows".to_owned(),
                "Stop the motor and write the mode again: some drives change it at standstill only".to_owned(),
            ],
        ));
    } else if shown == none && seen.is_enabled() {
        let modes = seen.axis.map_or(&[][..], |axis| axis.modes);
        let names: Vec<_> = modes.iter().filter(|mode| **mode != none).map(ToString::to_string).collect();
        findings.push(cause(
            TOPIC,
            "no_mode",
            [
                "A mode of operation".to_owned(),
                format!("{mode} is 0: no mode"),
                "Without a mode no set-point is acted on".to_owned(),
                match names.as_slice() {
                    [] => format!("Write the mode to {mode}"),
                    names => format!("Write the mode to {mode}; this drive has: {}", names.join(", ")),
                },
            ],
        ));
    }
}
