//! Why a drive does not follow its set-points, asked by SDO as the intents ask it.

use cia402::PowerCommand;

use super::demand::Refusal;
use crate::drive::{Drive, Trigger};
use crate::error::Error;

const INTENT: &str = "follow its set-points cycle by cycle";

impl Drive {
    /// Asks the drive, by SDO, why it does not follow: the explanation that its intents give. `None` for a refusal that says
    /// everything itself.
    pub async fn explain_refusal(&self, refusal: Refusal) -> Option<Error> {
        let trigger = match refusal {
            Refusal::Fault(_) => Trigger::Fault,
            Refusal::LostOperation(_) => Trigger::LostOperation,
            Refusal::NotHeard => Trigger::Ignored(PowerCommand::EnableOperation),
            Refusal::OutOfLimits { asked, bound } => return self.check_effect(bound.object, asked).await.err(),
            _ => return None,
        };
        Some(self.not_reached(INTENT, trigger).await)
    }
}
