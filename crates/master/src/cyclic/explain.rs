//! Why a drive does not follow its set-points, asked by SDO as the intents ask it.

use canopen::{NmtCommand, NmtState};
use cia402::PowerCommand;

use super::demand::Refusal;
use crate::core::CycleLoss;
use crate::drive::{ANSWER, Drive, LATELY, Trigger};
use crate::error::Error;

const INTENT: &str = "follow its set-points cycle by cycle";

impl Drive {
    /// Asks the drive, by SDO, why it does not follow: the explanation that its intents give. `None` for a refusal that says
    /// everything itself.
    pub async fn explain_refusal(&self, refusal: Refusal) -> Option<Error> {
        let trigger = match refusal {
            Refusal::Fault(_) => Trigger::Fault,
            Refusal::LostOperation(_) => Trigger::LostOperation,
            Refusal::NotHeard => {
                // It may be dead, and others wait to be stopped.
                let drive = self.asked_within(ANSWER);
                return Some(drive.not_reached(INTENT, Trigger::Ignored(PowerCommand::EnableOperation)).await);
            }
            Refusal::Stopped(CycleLoss::Silent(_)) => return self.explain_overruled().await,
            Refusal::OutOfLimits { asked, bound } => return self.check_effect(bound.object, asked).await.err(),
            _ => return None,
        };
        Some(self.not_reached(INTENT, trigger).await)
    }

    /// What stopped a group or a base by this drive: what it refused, or, of a shaft that only lags, what another master commanded.
    pub(crate) async fn explain_stop(self, refusal: Option<Refusal>) -> Option<Error> {
        match refusal {
            Some(refusal) => self.explain_refusal(refusal).await,
            None => self.explain_overruled().await,
        }
    }

    /// What another master was seen to command, where that may be why a shaft does not follow or a TPDO stays away: another NMT state, or
    /// a value of an object of the device profile. `None` where nothing of it was seen.
    pub async fn explain_overruled(&self) -> Option<Error> {
        let (seen, now) = (self.node().facts(), self.node().network().now());
        let state = seen.probable_state(self.description());
        // This program's own commands are among these.
        let is_commanded =
            seen.nmt_sent.is_some_and(|(at, command)| command != NmtCommand::Start && now - at <= LATELY);
        let is_away = is_commanded && state.is_some_and(|state| state != NmtState::Operational);
        let is_written = seen.other_write.is_some_and(|write| now - write.at <= LATELY);
        if !is_away && !is_written {
            return None;
        }
        Some(self.asked_within(ANSWER).not_reached(INTENT, Trigger::Overruled).await)
    }
}
