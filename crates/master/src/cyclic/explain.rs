//! Why a drive does not follow its set-points, asked by SDO as the intents ask it.

use cia402::PowerCommand;

use super::demand::Refusal;
use crate::drive::{ANSWER, Drive, Trigger};
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
            Refusal::OutOfLimits { asked, bound } => return self.check_effect(bound.object, asked).await.err(),
            _ => return None,
        };
        Some(self.not_reached(INTENT, trigger).await)
    }
}
