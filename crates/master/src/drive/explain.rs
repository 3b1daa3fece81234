use core::fmt;
use std::time::Duration;

use canopen::emcy::Emcy;
use canopen::{NmtState, NodeId};
use cia402::{ModeOfOperation, PowerCommand, PowerState, Statusword};
use devices::Description;
use devices::faults::FaultRow;

use super::conclude::conclude;
use super::{Drive, ERROR_CODE, MODE};
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
    /// 6041h, and the state that it shows.
    Statusword(Statusword, Option<PowerState>),
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
    /// Homing has not ended in the time given to it; position in counts.
    NotHome { at: f64, waited: Duration },
    /// Homing ended without a home position.
    HomingFailed(i8),
    /// It stopped answering.
    Silent(Error),
}

/// The faults that a code of this model stands for.
pub fn faults_in(profile: &Description, code: u16) -> Vec<&'static FaultRow> {
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
        let (conclusion, advice) = conclude(&trigger, &facts, self.power_style());
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
            Ok(statusword) => facts.push(Fact::Statusword(statusword, self.power_state(statusword))),
            Err(error) => return facts.push(Fact::Failed(Box::new(error))),
        }
        let code = self.profile.map_or(ERROR_CODE, |profile| profile.faults.code);
        if let Ok(payload) = self.node.upload(code).await {
            let code = payload.raw() as u16;
            facts.push(Fact::FaultCode(code, self.profile.map(|profile| faults_in(profile, code)).unwrap_or_default()));
        }
        if let (Ok(wanted), Ok(shown)) = (self.node.read::<i8>(MODE).await, self.mode().await) {
            facts.push(Fact::Mode(ModeOfOperation(wanted), shown));
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
        facts.extend(seen.probable_state(self.profile).map(Fact::Nmt));
        facts.push(Fact::Heartbeat(seen.heartbeat_age(now)));
        facts.extend(seen.last_emcy().map(|(at, emcy)| {
            Fact::Emcy(now - *at, *emcy, self.profile.and_then(|profile| profile.fault_told_by(emcy.code)))
        }));
    }
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
            Self::Statusword(word, Some(state)) => write!(f, "statusword {:04X}h ({})", word.0, state.name()),
            Self::Statusword(word, None) => write!(f, "statusword {word}"),
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
            Self::Emcy(age, emcy, None) => write!(f, "EMCY {} {:.1} s ago", emcy.code, age.as_secs_f64()),
            Self::Failed(error) => write!(f, "{error}"),
        }
    }
}
