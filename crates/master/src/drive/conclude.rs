//! From facts to a conclusion: the one place that decides what an explanation says.

use std::time::Duration;

use canopen::{Mux, NmtState};
use cia402::{Controlword, ModeOfOperation, PowerCommand, PowerState};
use devices::PowerStyle;
use devices::faults::FaultRow;

use crate::error::{Error, Fact};
use crate::units::Shown;

/// What made the explanation necessary.
#[derive(Clone, Debug)]
pub(crate) enum Trigger {
    /// It is at fault.
    Fault,
    /// The state machine does not go on where it should without a command.
    Waiting,
    /// A command had no effect.
    Ignored(PowerCommand),
    /// 6061h does not follow 6060h.
    Mode(ModeOfOperation),
    /// The shaft does not come to rest; speed in r/min.
    StillTurning(f64),
    /// The sensor of its shaft is at fault, with this name, so that its speed reading is invalid; and what to do about that.
    Unseen { sensor: &'static str, remedy: &'static str },
    /// Operation ended in the middle of a motion.
    LostOperation,
    /// The set-point was not acknowledged (bit 12).
    NoAcknowledge,
    /// The speed of position moves, in this object, is 0.
    NoProfileVelocity(Mux),
    /// By the speed of position moves, in this object, the move may take this long.
    TooSlow { object: Mux, rpm: f64, limit: Duration },
    /// At this speed the way alone takes longer than the time that was given.
    TooShort { object: Mux, rpm: f64, needed: Duration, within: Duration },
    /// The target was not reached in the time it should take: where it is, where it should be, in `unit`.
    Late { at: f64, target: f64, unit: &'static str, waited: Duration },
    /// The shaft rests away from its target, or turns at another speed; `target` was asked for, in `unit`.
    Elsewhere { at: f64, target: f64, unit: &'static str, by: Interference },
    /// This program was held up for longer than the drive's watch over its host allows.
    HeldUp(Duration),
    /// Homing has not ended in the time given to it; position in counts.
    NotHome { at: f64, waited: Duration },
    /// Homing ended without a home position.
    HomingFailed(i8),
    /// It does not follow, and its node or its objects were commanded otherwise.
    Overruled,
    /// It stopped answering.
    Silent(Error),
}

/// Who or what has stopped a motion, as far as the drive's objects show.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Interference {
    /// The halt bit of the controlword is set.
    Halted,
    /// The target is another one than what was sent.
    Retargeted { object: Mux, now: i64, sent: i64 },
    /// Nothing shows it.
    Unknown,
}

/// What follows from the facts, and what to do; `controlword` is that of the axis.
pub(super) fn conclude(trigger: &Trigger, facts: &[Fact], style: PowerStyle, controlword: Mux) -> (String, String) {
    let seen = facts.iter().find_map(|fact| if let Fact::Statusword(_, state) = fact { Some(*state) } else { None });
    let state = seen.flatten();
    let faults = facts.iter().find_map(|fact| match fact {
        Fact::FaultCode(code, rows) if *code != 0 => Some((*code, rows.as_slice())),
        _ => None,
    });
    match trigger {
        Trigger::Silent(error) => return silent(error),
        Trigger::HeldUp(time) => return held_up(*time),
        Trigger::Unseen { sensor, remedy } => return unseen(sensor, remedy),
        _ => {}
    }
    // A drive without the state machine has alarms that stop it and leave it enabled.
    let at_fault = matches!(state, Some(PowerState::Fault | PowerState::FaultReactionActive));
    if let Some((code, rows)) = faults.filter(|_| at_fault || style != PowerStyle::Cia402) {
        return faulted(code, rows);
    }
    let by = overruled(trigger, facts, controlword);
    match (trigger, state) {
        (_, Some(PowerState::Fault | PowerState::FaultReactionActive)) => text(
            "The drive is at fault and gives no fault code",
            "Look at its display or error history, remove the cause, then reset the fault",
        ),
        (Trigger::LostOperation, Some(PowerState::QuickStopActive)) => (
            match by {
                Some(by) => format!("A quick stop came in the middle of the motion: {by}"),
                None => "A quick stop came in the middle of the motion, from another master or an emergency stop input"
                    .into(),
            },
            "Find out what asked for it; when it is safe, enable the drive again to release the quick stop".to_owned(),
        ),
        (Trigger::LostOperation, Some(state)) => {
            let left =
                format!("The drive left Operation enabled in the middle of the motion and is in {}", state.name());
            (
                by.map_or(left.clone(), |by| format!("{left}: {by}")),
                "Find out who else commands it (another master, an RPDO, the enable input), or whether its supply dipped"
                    .to_owned(),
            )
        }
        (Trigger::Overruled, Some(_)) => (
            format!("It was commanded otherwise: {}", by.as_deref().unwrap_or("by another master")),
            "Find out who else commands it: another master, a PLC, a pendant. When it is safe, start the motion again"
                .to_owned(),
        ),
        (_, None) if seen.is_some() => text(
            "Its statusword shows none of the states of CiA 402",
            "Check that the node is the drive model that it is taken for",
        ),
        _ => without_ramp(by_trigger(trigger, style), facts),
    }
}

/// Who commands it otherwise, as far as that was seen on the bus.
fn overruled(trigger: &Trigger, facts: &[Fact], controlword: Mux) -> Option<String> {
    let is_overruled = matches!(trigger, Trigger::Overruled);
    let of = |fact: &Fact| match fact {
        // Other motions need no operational node.
        Fact::Nmt(state) if is_overruled && *state != NmtState::Operational => {
            Some(format!("an NMT command has taken its node to {state}, where no PDO comes or goes"))
        }
        // One that keeps it enabled stops nothing.
        Fact::OtherWrite(_, object, Some(value)) if *object == controlword && value & (0x0F | HALT) == 0x0F => None,
        Fact::OtherWrite(age, object, value) if is_overruled || *object == controlword => {
            let value = value.map_or(String::new(), |value| format!(" {value:X}h"));
            Some(format!("another master wrote{value} to {object} {:.1} s before", age.as_secs_f64()))
        }
        _ => None,
    };
    facts.iter().find_map(of)
}

/// Bit 8 of a controlword.
const HALT: u32 = Controlword::HALT as u32;

/// Adds what there is to do where a rate of 0 may be why the speed does not change.
fn without_ramp((conclusion, advice): (String, String), facts: &[Fact]) -> (String, String) {
    let zero = facts.iter().find_map(|fact| if let Fact::RateOfZero(object) = fact { Some(object) } else { None });
    let Some(object) = zero else { return (conclusion, advice) };
    let first =
        format!("Write the permitted rate of change of its speed to {object}: many drives do not move while it is 0");
    (conclusion, format!("{first}. {advice}"))
}

/// What to do about a shaft that does not come to rest. The quick stop option belongs to the state machine.
const fn still_turning(style: PowerStyle) -> &'static str {
    match style {
        PowerStyle::Cia402 => {
            "Something may be driving the shaft, as a load that pulls does without power: check the load, its brake, the ramp times and, \
             where the drive has it, the quick stop option 605Ah"
        }
        PowerStyle::EchoesControlword { .. } => {
            "Something may be driving the shaft, as a load that pulls does without power: check the load, its brake and the ramp times"
        }
    }
}

/// For a drive that answers, is in a known state and not at fault.
fn by_trigger(trigger: &Trigger, style: PowerStyle) -> (String, String) {
    match trigger {
        Trigger::Waiting => text(
            "The drive is busy with its self-test or fault reaction and does not get ready",
            "Wait for its self-test or fault reaction to end; check its supply; switch it off and on if it persists",
        ),
        Trigger::Ignored(command) => (
            format!("The drive took the controlword {} and did not act on it", command.controlword()),
            match style {
                PowerStyle::Cia402 => {
                    "Check that statusword bit 9 (remote) is set, that no other master writes 6040h, and its enable \
                     input and motor supply"
                }
                PowerStyle::EchoesControlword { .. } => {
                    "Check that no other master writes 6040h, that its output is enabled, and its motor supply"
                }
            }
            .to_owned(),
        ),
        Trigger::Mode(mode) => (
            format!("The drive accepted mode {mode} in 6060h and does not show it in 6061h"),
            "Stop the motor and try again: some drives change their mode at standstill only".to_owned(),
        ),
        Trigger::StillTurning(speed) => (
            format!("The shaft still turns at {speed:.1} r/min after the time that the drive's ramps should take"),
            still_turning(style).to_owned(),
        ),
        Trigger::NoAcknowledge => text(
            "The drive did not acknowledge the set-point (statusword bit 12)",
            "A limit switch or an emergency stop input may be active, or an earlier set-point be waiting to be run: ferrodrive explain \
             names an input; move away from a limit the other way, or stop the drive, then move again",
        ),
        Trigger::NoProfileVelocity(object) => no_profile_velocity(object),
        Trigger::TooSlow { object, rpm, limit } => too_slow(object, *rpm, *limit),
        Trigger::TooShort { object, rpm, needed, within } => (
            format!(
                "At its profile velocity ({object}) of {} r/min the way takes {:.1} s, and {} s were given. Nothing has moved",
                Shown(*rpm),
                needed.as_secs_f64(),
                Shown(within.as_secs_f64())
            ),
            "Give more time (--within), or a higher speed (--profile-velocity)".to_owned(),
        ),
        Trigger::NotHome { at, waited } => (
            format!("After {:.1} s it is at {at:.0} counts and still looks for its reference", waited.as_secs_f64()),
            "Check that the method's switch is wired, that its input is set to that function, and which way the method \
             looks for it; a long way takes a longer time limit"
                .to_owned(),
        ),
        Trigger::HomingFailed(method) => (
            format!("The drive ended homing with method {method} and has not found its reference"),
            "Check that the method's switch is wired, that its input is set to that function, and that it lies in the \
             direction in which the method looks for it"
                .to_owned(),
        ),
        Trigger::Late { at, target, unit, waited } => late(*at, *target, unit, *waited),
        Trigger::Elsewhere { at, target, unit, by } => elsewhere(*at, *target, unit, by),
        Trigger::Unseen { sensor, remedy } => unseen(sensor, remedy),
        Trigger::Fault
        | Trigger::LostOperation
        | Trigger::Overruled
        | Trigger::HeldUp(_)
        | Trigger::Silent(_) => text(
            "The drive is no longer where it was a moment ago",
            "Read its state again: it changes while it is read",
        ),
    }
}

fn no_profile_velocity(object: &Mux) -> (String, String) {
    (
        format!("Its profile velocity ({object}) is 0: it would never get there. Nothing has moved"),
        format!("Write the speed of position moves to {object}, or give one with the move (--profile-velocity)"),
    )
}

fn too_slow(object: &Mux, rpm: f64, limit: Duration) -> (String, String) {
    let hours = limit.as_secs_f64() / 3600.0;
    (
        format!(
            "At its profile velocity ({object}) of {} r/min this may take {hours:.1} h. Nothing has moved",
            Shown(rpm)
        ),
        format!(
            "Write a higher speed to {object}, or give one with the move (--profile-velocity); if it is meant, give a time limit \
             (--within)"
        ),
    )
}

fn late(at: f64, target: f64, unit: &str, waited: Duration) -> (String, String) {
    (
        format!(
            "After {:.1} s it is at {} {unit} where {} {unit} was asked for, and reports no fault",
            waited.as_secs_f64(),
            Shown(at),
            Shown(target)
        ),
        match unit {
            "r/min" => {
                "The load may be too heavy, the motor blocked, or its supply too low for this speed: look at its current and \
                 voltage; check its speed limit, current limit and ramp times"
            }
            _ => {
                "The load may be too heavy or the motor blocked: look at its current; check its speed limit, current limit \
                 and ramp times"
            }
        }
        .to_owned(),
    )
}

fn held_up(time: Duration) -> (String, String) {
    (
        format!(
            "This program did not run for {:.1} s (stopped, or the machine asleep), longer than the drive's watch over its host \
             allows: the drive has stopped by itself, and is not set going again",
            time.as_secs_f64()
        ),
        "Check where it stands, then start the motion again".to_owned(),
    )
}

fn unseen(sensor: &str, remedy: &str) -> (String, String) {
    (
        format!(
            "The drive is at fault ({sensor}) and has taken the power off its motor. It does not see its shaft, which may coast on"
        ),
        format!("See for yourself that it stands, or use the emergency stop. {remedy}"),
    )
}

/// Where it is, in place of where it should be.
pub(super) fn place(at: f64, target: f64, unit: &str) -> String {
    format!("It is at {} {unit} where {} {unit} was asked for", Shown(at), Shown(target))
}

fn elsewhere(at: f64, target: f64, unit: &str, by: &Interference) -> (String, String) {
    let place = place(at, target, unit);
    let find = "Find out who else commands it: another master, a PLC, a pendant, an RPDO. When it is safe, start the motion again";
    match by {
        Interference::Halted => (format!("{place}: another master has halted it (bit 8 of 6040h)"), find.to_owned()),
        Interference::Retargeted { object, now, sent } => {
            (format!("{place}: {object} is {now}, and {sent} was sent: another master gave it another target"), find.to_owned())
        }
        Interference::Unknown => (
            format!("{place}, though it is enabled, is not halted and has its target"),
            "Its load, a limit of its speed or current, or its own watch over its host may keep it: ferrodrive explain says \
             what the drive shows"
                .to_owned(),
        ),
    }
}

fn faulted(code: u16, rows: &[&'static FaultRow]) -> (String, String) {
    if rows.is_empty() {
        return (
            format!("The drive is at fault with code {code:04X}h, which no fault table here explains"),
            "Look the code up in the drive's manual, remove the cause, then reset the fault".to_owned(),
        );
    }
    let join = |part: fn(&FaultRow) -> &'static str, separator| {
        rows.iter().map(|row| part(row)).collect::<Vec<_>>().join(separator)
    };
    (
        format!("The drive is at fault: {}", join(|row| row.name, " and ")),
        format!("{} Then reset the fault and enable again", join(|row| row.remedy, " ")),
    )
}

fn silent(error: &Error) -> (String, String) {
    let Error::NoAnswer { hints, .. } = error else {
        return text("The drive stopped answering", "Check its supply and its cable");
    };
    if hints.silent_for.is_none() {
        return ("The drive does not answer".to_owned(), hints.to_string());
    }
    (
        "The drive stopped answering. Whether it still moves is not known: a drive with a watch over its \
         host stops by itself"
            .to_owned(),
        format!("If it moves and must not, use the emergency stop. {hints}"),
    )
}

fn text(conclusion: &str, advice: &str) -> (String, String) {
    (conclusion.to_owned(), advice.to_owned())
}
