//! The way to Operation enabled (CiA 402-2, 8.2), or what replaces it.

use canopen::pdo::Direction;
use cia402::object::CONTROLWORD;
use cia402::{Controlword, PowerCommand, PowerEvent, PowerState, Statusword, next_command, transition};
use devices::PowerStyle;
use devices::faults::FaultRow;

use super::finding::{Finding, Topic, cause, warning};
use super::observed::Observed;
use crate::pdo::PdoConfig;

const TOPIC: Topic = Topic::Power;

pub(super) fn look(seen: &Observed, findings: &mut Vec<Finding>) {
    let Some(statusword) = seen.statusword else { return };
    let Some(state) = seen.power else {
        findings.push(no_state(statusword));
        return;
    };
    let faulted = matches!(state, PowerState::Fault | PowerState::FaultReactionActive);
    if faulted || seen.style.is_faulted(statusword) {
        findings.push(fault(seen));
    }
    if state == PowerState::OperationEnabled {
        return;
    }
    let sent = sent_by_rpdo(seen);
    findings.extend(sent.as_ref().and_then(|sent| rpdo_not_taken(seen, sent)));
    let by_rpdo = sent.and_then(|sent| by_rpdo(seen, &sent, state));
    findings.extend(by_rpdo.or_else(|| not_enabled(seen, state, statusword)));
    findings.extend(no_voltage(seen, state, statusword));
}

fn no_state(statusword: Statusword) -> Finding {
    cause(
        TOPIC,
        "no_power_state",
        [
            "A statusword with one of the states of CiA 402".to_owned(),
            statusword.to_string(),
            "What is written to 6040h may mean something else to it".to_owned(),
            "Check which device the node is: ferrodrive scan, ferrodrive read NODE 1000 1018:*".to_owned(),
        ],
    )
}

fn fault(seen: &Observed) -> Finding {
    let (code, rows) = seen.fault.as_ref().map_or((0, &[][..]), |(code, rows)| (*code, rows.as_slice()));
    let join = |part: fn(&FaultRow) -> &'static str| rows.iter().map(|row| part(row)).collect::<Vec<_>>().join(" ");
    let found = match (code, rows.is_empty()) {
        (0, _) => "A fault, and no fault code".to_owned(),
        (_, true) => format!("Fault code {code:04X}h, which no table here explains"),
        _ => format!("Fault code {code:04X}h: {}", join(|row| row.name)),
    };
    // The row's own remedy, to send the heartbeat again, would set an old motion going.
    let remedy = if seen.has_lost_host() && seen.is_live() {
        format!("End its old motion: ferrodrive quick-stop {}.", seen.node)
    } else if rows.is_empty() {
        "Look the code up in the drive's manual and remove the cause".to_owned()
    } else {
        join(|row| row.remedy)
    };
    cause(
        TOPIC,
        "fault",
        [
            "No fault".to_owned(),
            found,
            if seen.is_live() {
                "The motor has power all the same, and holds its shaft or turns it; the fault is reset when its cause is gone"
            } else {
                "The motor has no power until the fault is reset, which takes its cause to be gone first"
            }
            .to_owned(),
            format!("{remedy} Then: ferrodrive reset {}", seen.node),
        ],
    )
}

/// The controlwords that lead on from here, `06h, 07h, 0Fh`.
fn path(style: PowerStyle, mut state: PowerState) -> String {
    if style != PowerStyle::Cia402 {
        return "0Fh".to_owned();
    }
    let mut words = Vec::new();
    while let Some(command) = next_command(state).filter(|_| words.len() < PowerState::ALL.len()) {
        words.push(format!("{:02X}h", command.controlword().0));
        let Some(arrow) = transition(state, PowerEvent::Command(command)) else { break };
        state = arrow.to;
    }
    words.join(", ")
}

/// The bits that a controlword lacks of "enable operation": `bits 0, 3`.
fn missing_bits(controlword: Controlword) -> String {
    let missing = PowerCommand::EnableOperation.controlword().0 & !controlword.0;
    let bits = (0..16).filter(|bit| missing & (1 << bit) != 0).map(|bit| bit.to_string());
    match bits.collect::<Vec<_>>().as_slice() {
        [] => "no bit is missing".to_owned(),
        [bit] => format!("bit {bit} is missing"),
        bits => format!("bits {} are missing", bits.join(", ")),
    }
}

/// The controlword that others send by a valid RPDO, and in which frames.
struct ControlwordRpdo<'a> {
    controlword: Controlword,
    config: &'a PdoConfig,
    id: u16,
    count: u64,
}

fn sent_by_rpdo(seen: &Observed) -> Option<ControlwordRpdo<'_>> {
    let object = seen.place(CONTROLWORD);
    let mut rpdos =
        seen.pdos.iter().filter(|(config, cob_id)| config.pdo.direction == Direction::Rpdo && cob_id.is_valid());
    rpdos.find_map(|(config, cob_id)| {
        let bits = config.map.find(object)?;
        let id = cob_id.can_id().as_standard()?;
        let heard = seen.heard.under(id)?;
        Some(ControlwordRpdo {
            controlword: Controlword((heard.bits >> bits.start) as u16),
            config,
            id,
            count: heard.count,
        })
    })
}

/// What is written by SDO lasts until the next frame of an RPDO with the controlword. Frames of which the drive has nothing in 6040h
/// are not a cause.
fn by_rpdo(seen: &Observed, sent: &ControlwordRpdo<'_>, state: PowerState) -> Option<Finding> {
    let ControlwordRpdo { controlword, config, id, count } = *sent;
    let acts = seen.controlword().is_none_or(|has| has == controlword);
    (acts && controlword.command() != PowerCommand::EnableOperation).then(|| {
        cause(
            TOPIC,
            "controlword_by_rpdo",
            [
                format!("Operation enabled: from here the controlwords {}", path(seen.style, state)),
                format!(
                    "{}. Others send {} ({id:03X}h) with the controlword {controlword}; the last of {count}; {}",
                    state.name(),
                    config.pdo,
                    missing_bits(controlword)
                ),
                "Each of these frames overwrites what is written to 6040h by SDO".to_owned(),
                format!(
                    "Have the program that sends {} enable the drive, or end it, or take 6040h out of the mapping",
                    config.pdo
                ),
            ],
        )
    })
}

/// CiA 301, 7.3.2.2.2: a node takes no PDO before it is operational. Where its state is heard, the PDOs are explained by it; a node
/// that sends no heartbeat and no PDO does not show it.
fn rpdo_not_taken(seen: &Observed, sent: &ControlwordRpdo<'_>) -> Option<Finding> {
    let has = seen.controlword()?;
    let is_operational = seen.pdos.iter().any(|(config, cob_id)| {
        let id = cob_id.can_id().as_standard();
        config.pdo.direction == Direction::Tpdo && id.is_some_and(|id| seen.heard.under(id).is_some())
    });
    let ControlwordRpdo { controlword, config, id, count } = *sent;
    (seen.nmt.is_none() && !is_operational && has != controlword).then(|| {
        cause(
            TOPIC,
            "rpdo_not_taken",
            [
                format!("6040h has what {} brings it", config.pdo),
                format!(
                    "Controlword {has}, where others send {} ({id:03X}h) with {controlword}; the last of {count}",
                    config.pdo
                ),
                "It may be pre-operational: then it takes no PDO (CiA 301, 7.3.2.2.2). Its NMT state is not known, as it sends no \
                 heartbeat (1017h)"
                    .to_owned(),
                format!("ferrodrive nmt {} start", seen.node),
            ],
        )
    })
}

fn not_enabled(seen: &Observed, state: PowerState, statusword: Statusword) -> Option<Finding> {
    let controlword = seen.controlword()?;
    let command = controlword.command();
    let found = format!("{}, controlword {controlword}: {}", state.name(), missing_bits(controlword));
    let expected = format!("Operation enabled: from here the controlwords {}", path(seen.style, state));
    let node = seen.node;
    let enable = format!("ferrodrive enable {node}");
    let leads_on = next_command(state).is_some_and(|next| next == command);
    let (rule, follows, remedy) = match state {
        // The fault has been reported.
        PowerState::Fault | PowerState::FaultReactionActive => {
            let stuck = state == PowerState::Fault && controlword.has(Controlword::FAULT_RESET);
            return stuck.then(|| reset_bit_left_set(seen, controlword));
        }
        PowerState::NotReadyToSwitchOn => (
            "not_ready",
            "It is busy with its start or self-test and takes no controlword yet",
            "Wait; if it persists, check the supply".to_owned(),
        ),
        PowerState::QuickStopActive if !controlword.has(Controlword::QUICK_STOP) => (
            "quick_stop",
            "The controlword asks for a quick stop (bit 2 is 0), and the drive holds it",
            format!("When it is safe: {enable}"),
        ),
        PowerState::QuickStopActive => (
            "quick_stop",
            "A quick stop came from elsewhere: an emergency stop input, a limit switch, or a lost connection (6007h)",
            format!("Release the input; then: {enable}"),
        ),
        PowerState::SwitchOnDisabled
            if command == PowerCommand::EnableOperation && seen.style == PowerStyle::Cia402 =>
        {
            (
                "enabled_without_steps",
                "From Switch on disabled only shutdown (06h) leads on: 0Fh alone does nothing (CiA 402-2, transition 2)",
                format!("Write the steps one after the other, each when the statusword shows the one before: {enable}"),
            )
        }
        _ if leads_on || command == PowerCommand::EnableOperation => (
            "controlword_ignored",
            "The controlword leads on from here and the drive has not followed it",
            format!("Look at {}; then: {enable}", suspects(seen.style, statusword)),
        ),
        _ => ("not_enabled", "It follows no set-point in this state", enable),
    };
    Some(cause(TOPIC, rule, [expected, found, follows.to_owned(), remedy]))
}

fn suspects(style: PowerStyle, statusword: Statusword) -> &'static str {
    if style == PowerStyle::Cia402 && !statusword.has(Statusword::REMOTE) {
        "why it does not listen (statusword bit 9, remote, is 0): another command source, local operation"
    } else {
        "its enable input, its motor supply, and whether others write 6040h"
    }
}

fn reset_bit_left_set(seen: &Observed, controlword: Controlword) -> Finding {
    cause(
        TOPIC,
        "reset_bit_left_set",
        [
            "A rising edge of controlword bit 7 (CiA 402-2, transition 15)".to_owned(),
            format!("Controlword {controlword}, in which bit 7 stands at 1"),
            "A bit that stays set resets nothing: the next edge needs a 0 first".to_owned(),
            format!("Write 0, then 80h; or: ferrodrive reset {}", seen.node),
        ],
    )
}

/// Statusword bit 4 (CiA 402-2, 8.4.2).
fn no_voltage(seen: &Observed, state: PowerState, statusword: Statusword) -> Option<Finding> {
    let powered = matches!(state, PowerState::SwitchedOn | PowerState::QuickStopActive);
    let missing = seen.style == PowerStyle::Cia402 && powered && !statusword.has(Statusword::VOLTAGE_ENABLED);
    missing.then(|| {
        let measured = seen.supply_v.map_or_else(String::new, |volts| format!(", {volts:.1} V measured"));
        warning(
            TOPIC,
            "no_voltage",
            [
                "Statusword bit 4 (voltage enabled) is 1".to_owned(),
                format!("Bit 4 is 0{measured}"),
                "The power stage has no supply: the motor gets no current".to_owned(),
                "Look at the motor supply, its fuse and contactor, and at safe torque off".to_owned(),
            ],
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_to_operation_enabled_is_that_of_the_standard() {
        // CiA 402-2, table 9: transitions 2, 3, 4, and 15 before them.
        let cia402 = |state| path(PowerStyle::Cia402, state);
        assert_eq!(cia402(PowerState::SwitchOnDisabled), "06h, 07h, 0Fh");
        assert_eq!(cia402(PowerState::Fault), "80h, 06h, 07h, 0Fh");
        assert_eq!(cia402(PowerState::QuickStopActive), "0Fh");
        assert_eq!(cia402(PowerState::OperationEnabled), "");
        assert_eq!(missing_bits(Controlword(0x06)), "bits 0, 3 are missing");
        assert_eq!(missing_bits(Controlword(0x07)), "bit 3 is missing");
    }
}
