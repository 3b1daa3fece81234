use core::fmt;
use std::time::Duration;

use canopen::emcy::Emcy;
use canopen::{NmtState, NodeId};
use cia402::{ModeOfOperation, PowerCommand, PowerState, Statusword};
use drives::engine::faults::FaultRow;
use drives::profile::DriveProfile;

use super::{Drive, ERROR_CODE, MODE, MODE_DISPLAY};
use crate::decode::emcy_words;
use crate::error::Error;
use crate::units::Volts;

/// Why a drive is not where it was meant to be: what was seen, what follows from it, what to do.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// The drive.
    pub node: NodeId,
    /// What was wanted, as in "could not enable it".
    pub intent: &'static str,
    /// What was seen, in the order it was asked for.
    pub facts: Vec<Fact>,
    /// What follows.
    pub conclusion: String,
    /// What to do.
    pub advice: String,
}

/// One thing seen.
#[derive(Clone, Debug)]
pub enum Fact {
    /// 6041h.
    Statusword(Statusword),
    /// The model's fault code, with what its bits mean.
    FaultCode(u16, Vec<&'static FaultRow>),
    /// 6060h and 6061h.
    Mode(ModeOfOperation, ModeOfOperation),
    /// Supply voltage at the drive.
    Supply(Volts),
    /// State by its last heartbeat or the NMT command sent since.
    Nmt(NmtState),
    /// Age of its last heartbeat; `None` if none ever came.
    Heartbeat(Option<Duration>),
    /// Its last emergency message, how long ago it came, and what it means on this model.
    Emcy(Duration, Emcy, Option<&'static FaultRow>),
    /// A request that failed while looking.
    Failed(Box<Error>),
}

/// What made the explanation necessary.
#[derive(Clone, Debug)]
pub(super) enum Trigger {
    /// It is at fault.
    Fault,
    /// The state machine does not move by itself where it should.
    Waiting,
    /// A command had no effect.
    Ignored(PowerCommand),
    /// 6061h does not follow 6060h.
    Mode(ModeOfOperation),
    /// The shaft does not come to rest; speed in r/min.
    StillTurning(f64),
    /// Operation ended in the middle of a motion.
    LostOperation,
    /// The set-point was not acknowledged (bit 12).
    NoAcknowledge,
    /// The target was not reached in the time it should take: where it is, where it should be, in `unit`.
    Late { at: f64, target: f64, unit: &'static str, waited: Duration },
    /// It stopped answering.
    Silent(Error),
}

/// The faults that a code of this model stands for.
pub fn faults_in(profile: &DriveProfile, code: u16) -> Vec<&'static FaultRow> {
    let matches = |row: &&FaultRow| if profile.faults.bit_field { row.code & code != 0 } else { row.code == code };
    profile.faults.table.iter().filter(matches).collect()
}

impl Drive {
    /// Looks at everything that may explain why `intent` failed.
    pub(super) async fn not_reached(&self, intent: &'static str, trigger: Trigger) -> Error {
        let mut facts = Vec::new();
        if let Trigger::Silent(error) = &trigger {
            facts.push(Fact::Failed(Box::new(error.clone())));
        } else {
            self.ask(&mut facts).await;
        }
        self.recall(&mut facts);
        let (conclusion, advice) = conclude(&trigger, &facts);
        Error::NotReached(Box::new(Explanation { node: self.node.id(), intent, facts, conclusion, advice }))
    }

    /// Turns silence of the drive into an explanation; hands everything else on.
    pub(super) async fn answered<T>(&self, intent: &'static str, result: Result<T, Error>) -> Result<T, Error> {
        match result {
            Err(error @ Error::NoAnswer { .. }) => Err(self.not_reached(intent, Trigger::Silent(error)).await),
            other => other,
        }
    }

    /// Facts that the drive is asked for. The first silence ends the asking.
    async fn ask(&self, facts: &mut Vec<Fact>) {
        match self.statusword().await {
            Ok(statusword) => facts.push(Fact::Statusword(statusword)),
            Err(error) => return facts.push(Fact::Failed(Box::new(error))),
        }
        let code = self.profile.map_or(ERROR_CODE, |profile| profile.faults.code);
        if let Ok(payload) = self.node.upload(code).await {
            let code = payload.raw() as u16;
            facts.push(Fact::FaultCode(code, self.profile.map(|profile| faults_in(profile, code)).unwrap_or_default()));
        }
        let (wanted, shown) = (self.node.read::<i8>(MODE).await, self.node.read::<i8>(MODE_DISPLAY).await);
        if let (Ok(wanted), Ok(shown)) = (wanted, shown) {
            facts.push(Fact::Mode(ModeOfOperation(wanted), ModeOfOperation(shown)));
        }
        if let Some(voltage) = self.profile.and_then(|profile| profile.units.bus_voltage)
            && let Ok(volts) = self.read_quantity(voltage).await
        {
            facts.push(Fact::Supply(Volts(volts)));
        }
    }

    /// Facts that were seen on the bus.
    fn recall(&self, facts: &mut Vec<Fact>) {
        let now = self.node.network().now();
        let seen = self.node.facts();
        facts.extend(seen.probable_state().map(Fact::Nmt));
        facts.push(Fact::Heartbeat(seen.heartbeat_age(now)));
        facts.extend(seen.last_emcy().map(|(at, emcy)| {
            let rows = self.profile.map_or(&[][..], |profile| profile.faults.table);
            Fact::Emcy(now - *at, *emcy, rows.iter().find(|row| row.emcy == emcy.code))
        }));
    }
}

fn conclude(trigger: &Trigger, facts: &[Fact]) -> (String, String) {
    let statusword = facts.iter().find_map(|fact| if let Fact::Statusword(word) = fact { Some(*word) } else { None });
    let state = statusword.and_then(Statusword::state);
    let faults = facts.iter().find_map(|fact| match fact {
        Fact::FaultCode(code, rows) if *code != 0 => Some((*code, rows.as_slice())),
        _ => None,
    });
    if let Trigger::Silent(error) = trigger {
        return silent(error);
    }
    if let (Some(PowerState::Fault | PowerState::FaultReactionActive), Some((code, rows))) = (state, faults) {
        return faulted(code, rows);
    }
    match (trigger, state) {
        (_, Some(PowerState::Fault | PowerState::FaultReactionActive)) => text(
            "The drive is at fault and gives no fault code",
            "Look at its display or error history, remove the cause, then reset the fault",
        ),
        (Trigger::LostOperation, Some(PowerState::QuickStopActive)) => text(
            "A quick stop came in the middle of the motion, from another master or an emergency stop input",
            "Find out what asked for it; when it is safe, enable the drive again to release the quick stop",
        ),
        (Trigger::LostOperation, Some(state)) => (
            format!("The drive left Operation enabled in the middle of the motion and is in {}", state.name()),
            "Find out who else commands it (another master, an RPDO, the enable input), or whether its supply dipped"
                .to_owned(),
        ),
        (_, None) if statusword.is_some() => text(
            "Its statusword shows none of the states of CiA 402",
            "Check that the node is the drive model that it is taken for",
        ),
        (Trigger::Waiting, _) => text(
            "The drive is busy with itself and does not get ready",
            "Wait for its self-test or fault reaction to end; check its supply; switch it off and on if it persists",
        ),
        (Trigger::Ignored(command), _) => (
            format!("The drive took the controlword {} and did not act on it", command.controlword()),
            "Check that statusword bit 9 (remote) is set, that no other master writes 6040h, and its enable input and \
             motor supply"
                .to_owned(),
        ),
        (Trigger::Mode(mode), _) => (
            format!("The drive accepted mode {mode} in 6060h and does not show it in 6061h"),
            "Stop the motor and try again: some drives change their mode at standstill only".to_owned(),
        ),
        (Trigger::StillTurning(speed), _) => (
            format!("The shaft still turns at {speed:.1} r/min after the time that the drive's ramps should take"),
            "Something may be driving the shaft: check the load, the ramp times and the quick stop option 605Ah".to_owned(),
        ),
        (Trigger::NoAcknowledge, _) => text(
            "The drive did not acknowledge the set-point (statusword bit 12)",
            "An earlier set-point may still be waiting to be run: stop the drive, then move again",
        ),
        (Trigger::Late { at, target, unit, waited }, _) => (
            format!(
                "After {:.1} s it is at {at:.1} {unit} where {target:.1} {unit} was asked for, and reports no fault",
                waited.as_secs_f64()
            ),
            "The load may be too heavy or the motor blocked: look at its current; check its speed limit, current limit \
             and ramp times"
                .to_owned(),
        ),
        (Trigger::Fault | Trigger::LostOperation | Trigger::Silent(_), _) => text(
            "The drive is no longer where it was a moment ago",
            "Read its state again: it changes while being looked at",
        ),
    }
}

fn faulted(code: u16, rows: &[&'static FaultRow]) -> (String, String) {
    if rows.is_empty() {
        return (
            format!("The drive is at fault with code {code:04X}h, which its fault table does not list"),
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
    let hints = if let Error::NoAnswer { hints, .. } = error { hints.to_string() } else { String::new() };
    (
        "The drive stopped answering. Whether it still moves cannot be told from here: a drive with a watch over its \
         host stops by itself"
            .to_owned(),
        format!("If it moves and must not, use the emergency stop. {hints}"),
    )
}

fn text(conclusion: &str, advice: &str) -> (String, String) {
    (conclusion.to_owned(), advice.to_owned())
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "node {}: could not {}. {}.", self.node, self.intent, self.conclusion)?;
        f.write_str("  Seen: ")?;
        for (position, fact) in self.facts.iter().enumerate() {
            write!(f, "{}{fact}", if position == 0 { "" } else { "; " })?;
        }
        write!(f, ".\n  Do: {}.", self.advice.trim_end_matches('.'))
    }
}

impl fmt::Display for Fact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Statusword(word) => write!(f, "statusword {word}"),
            Self::FaultCode(0, _) => f.write_str("no fault code"),
            Self::FaultCode(code, rows) => {
                write!(f, "fault code {code:04X}h")?;
                rows.iter().try_for_each(|row| write!(f, ", {}", row.name))
            }
            Self::Mode(wanted, shown) if wanted == shown => write!(f, "mode {shown}"),
            Self::Mode(wanted, shown) => write!(f, "mode {shown}, asked for {wanted}"),
            Self::Supply(volts) => write!(f, "supply {volts}"),
            Self::Nmt(state) => write!(f, "NMT state {state}"),
            Self::Heartbeat(None) => f.write_str("no heartbeat or boot-up seen"),
            Self::Heartbeat(Some(age)) => write!(f, "last heartbeat or boot-up {:.1} s ago", age.as_secs_f64()),
            Self::Emcy(age, emcy, Some(row)) => {
                write!(f, "EMCY {:04X}h ({}) {:.1} s ago", emcy.code.0, row.name, age.as_secs_f64())
            }
            Self::Emcy(age, emcy, None) => write!(f, "EMCY {} {:.1} s ago", emcy_words(emcy.code), age.as_secs_f64()),
            Self::Failed(error) => write!(f, "{error}"),
        }
    }
}
