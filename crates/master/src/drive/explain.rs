use std::time::Duration;

use cia402::ModeOfOperation;
use cia402::object::{CONTROLWORD, MODES_OF_OPERATION};
use devices::Description;
use devices::faults::FaultRow;

use super::conclude::{Interference, Trigger, conclude, place};
use super::handle::Drive;
use crate::error::{Error, Explanation, Fact};
use crate::explain::{Finding, Observed, Topic};
use crate::units::Volts;

/// How far back what another master has commanded may be why a drive does not do what it should.
pub(crate) const LATELY: Duration = Duration::from_secs(10);

/// How long a motion that does not get there is looked at before it is stopped: some thirty answers, and 100 ms between two looks at its speed.
const LOOK: Duration = Duration::from_millis(300);

/// The faults that a code of this model stands for.
pub fn faults_in(description: &Description, code: u16) -> Vec<&'static FaultRow> {
    let matches = |row: &&FaultRow| if description.faults.bit_field { row.code & code != 0 } else { row.code == code };
    description.faults.table.iter().filter(matches).collect()
}

/// The fault among these codes by which a drive does not see its shaft. Of an unknown model it is by CiA 402-2, table of error codes:
/// 7300h to 730Fh are its sensors.
pub(super) fn blinding(description: Option<&Description>, code: u16) -> Option<(&'static str, &'static str)> {
    match description {
        Some(description) => {
            let mut rows = faults_in(description, code).into_iter();
            rows.find(|row| row.hides_motion).map(|row| (row.name, row.remedy))
        }
        None => (code & 0xFFF0 == 0x7300).then_some(("a sensor of its shaft", "Look after its cable.")),
    }
}

impl Drive {
    /// Looks at everything that may explain why `intent` failed.
    pub(crate) async fn not_reached(&self, intent: &'static str, trigger: Trigger) -> Error {
        let mut facts = Vec::new();
        if let Trigger::Silent(error) = &trigger {
            facts.push(Fact::Failed(Box::new(error.clone())));
        } else {
            self.ask(&mut facts).await;
            if let Trigger::Late { .. } | Trigger::StillTurning(_) = trigger {
                facts.extend(self.rates_of_zero().await.into_iter().map(Fact::RateOfZero));
            }
        }
        self.recall(&mut facts);
        let (mut conclusion, mut advice) = conclude(&trigger, &facts, self.power_style(), self.place(CONTROLWORD));
        match self.hindrance(&trigger, &facts).await {
            Some(cause) => {
                if let Trigger::Elsewhere { at, target, unit, .. } = trigger {
                    conclusion = place(at, target, unit);
                }
                conclusion = format!("{conclusion}. {}; expected: {}", cause.found, cause.expected);
                advice = cause.remedy;
            }
            None if matches!(trigger, Trigger::Late { .. }) => {
                advice = format!("{advice}; ferrodrive explain {} shows more", self.node.id());
            }
            None => {}
        }
        Error::NotReached(Box::new(Explanation { node: self.node.id(), intent, facts, conclusion, advice }))
    }

    /// What the drive shows of why a motion does not get there. It is looked for before the caller's stop hides it.
    async fn hindrance(&self, trigger: &Trigger, facts: &[Fact]) -> Option<Finding> {
        // A rate of 0 has its own advice.
        if facts.iter().any(|fact| matches!(fact, Fact::RateOfZero(_))) {
            return None;
        }
        let is_known = match trigger {
            Trigger::Late { .. } => false,
            // Of a set-point that it does not take an input is a reason, and no set-point.
            Trigger::NoAcknowledge => true,
            // A drive that an input has stopped may set its target to 0 by itself: that was no other master then.
            Trigger::Elsewhere { by, .. } => !matches!(by, Interference::Unknown),
            _ => return None,
        };
        let network = self.node.network();
        let look = network.within(LOOK, Observed::of_shaft(self));
        let cause = look.await.and_then(|seen| seen.hindrance());
        cause.filter(|cause| !is_known || cause.topic == Topic::Terminals)
    }

    /// Turns silence of the drive into an explanation; hands everything else on.
    pub(super) async fn answered<T>(&self, intent: &'static str, result: Result<T, Error>) -> Result<T, Error> {
        match result {
            Err(error @ Error::NoAnswer { .. }) => {
                // A program that was held up has missed the answer itself.
                let lapse = self.node.network().lapse(self.node.id());
                Err(self.not_reached(intent, lapse.map_or(Trigger::Silent(error), Trigger::HeldUp)).await)
            }
            other => other,
        }
    }

    /// Facts that the drive is asked for. The first silence ends the asking.
    async fn ask(&self, facts: &mut Vec<Fact>) {
        match self.statusword().await {
            Ok(statusword) => facts.push(Fact::Statusword(statusword, self.power_state(statusword))),
            Err(error) => return facts.push(Fact::Failed(Box::new(error))),
        }
        if let Ok(payload) = self.node.upload(self.fault_code()).await {
            let code = payload.raw() as u16;
            facts.push(Fact::FaultCode(
                code,
                self.description.map(|description| faults_in(description, code)).unwrap_or_default(),
            ));
        }
        if let (Ok(wanted), Ok(shown)) = (self.node.read::<i8>(self.place(MODES_OF_OPERATION)).await, self.mode().await)
        {
            facts.push(Fact::Mode(ModeOfOperation(wanted), shown));
        }
        if let Some(voltage) = self.axis_description().and_then(|axis| axis.units.bus_voltage)
            && let Ok(volts) = self.read_quantity(voltage).await
        {
            facts.push(Fact::Supply(Volts(volts)));
        }
    }

    /// Facts that were seen on the bus.
    fn recall(&self, facts: &mut Vec<Fact>) {
        let now = self.node.network().now();
        let seen = self.node.facts();
        facts.extend(seen.probable_state(self.description).map(Fact::Nmt));
        facts.push(Fact::Heartbeat(seen.heartbeat_age(now)));
        facts.extend(seen.last_emcy().map(|(at, emcy)| {
            Fact::Emcy(
                now - *at,
                *emcy,
                self.description.and_then(|description| description.fault_reported_by(emcy.code)),
            )
        }));
        let write = seen.other_write.filter(|write| now - write.at <= LATELY);
        facts.extend(write.map(|write| Fact::OtherWrite(now - write.at, write.object, write.value)));
    }
}
