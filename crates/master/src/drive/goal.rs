//! What a supervised motion waits for, and how the drive is looked at meanwhile.

use std::time::Duration;

use cia402::{PowerState, Statusword};
use devices::{HomingRules, Quantity};

use super::conclude::Trigger;
use super::handle::{Drive, POLL, POSITION_ACTUAL};
use super::power::STANDSTILL_RPM;
use crate::error::Error;

/// What counts as reached.
#[derive(Clone, Copy, Debug)]
pub(super) enum Goal {
    /// A speed, by the actual velocity.
    Speed { quantity: Quantity, target_rpm: f64, band_rpm: f64 },
    /// A position, by statusword bit 10. The bit is believed where the shaft is near the target, and everywhere once
    /// it was seen clear: one left over from the move before says reached while the shaft is elsewhere.
    Position { target: i64, band: f64, seen_clear: bool },
    /// The home position, by the model's bits of the statusword. They are believed some time after the start: until
    /// then they may be those of the run before.
    Home { rules: HomingRules, method: i8, looks: u8 },
}

/// How long a shaft may swing about its target before that is taken for its rest.
const SETTLE_TIME: Duration = Duration::from_millis(200);

/// How often the drive is looked at before its verdict on homing is believed: 50 ms, many cycles of any drive.
const LOOKS_BEFORE_VERDICT: u8 = 5;

impl Goal {
    /// Whether it is reached, and where the drive is.
    async fn look(
        &mut self,
        drive: &Drive,
        intent: &'static str,
        statusword: Statusword,
    ) -> Result<(bool, f64), Error> {
        match self {
            Self::Home { rules, method, looks } => {
                *looks = looks.saturating_add(1);
                let settled = *looks > LOOKS_BEFORE_VERDICT;
                if settled && rules.failed.matches(statusword) {
                    return Err(drive.not_reached(intent, Trigger::HomingFailed(*method)).await);
                }
                let at = drive.read_number(drive.place(POSITION_ACTUAL)).await?;
                Ok((settled && rules.attained.matches(statusword), at as f64))
            }
            Self::Speed { quantity, target_rpm, band_rpm } => {
                let speed = drive.read_quantity(*quantity).await?;
                Ok(((speed - *target_rpm).abs() <= *band_rpm, speed))
            }
            Self::Position { target, band, seen_clear } => {
                let at = drive.read_number(drive.place(POSITION_ACTUAL)).await?;
                let reached = statusword.has(Statusword::TARGET_REACHED);
                let near = at.abs_diff(*target) as f64 <= *band;
                let believed = near || *seen_clear;
                *seen_clear |= !reached;
                Ok((reached && believed, at as f64))
            }
        }
    }

    fn late(&self, at: f64, waited: Duration) -> Trigger {
        let (target, unit) = match self {
            Self::Home { .. } => return Trigger::NotHome { at, waited },
            Self::Speed { target_rpm, .. } => (*target_rpm, "r/min"),
            Self::Position { target, .. } => (*target as f64, "counts"),
        };
        Trigger::Late { at, target, unit, waited }
    }
}

impl Drive {
    /// Polls the drive until the goal is reached; gives how long it took.
    pub(super) async fn watch(&self, intent: &'static str, mut goal: Goal, limit: Duration) -> Result<Duration, Error> {
        let network = self.node.network();
        let began = network.now();
        loop {
            let statusword = self.still_enabled(intent).await?;
            let (reached, at) = self.answered(intent, goal.look(self, intent, statusword).await).await?;
            let waited = network.now() - began;
            if reached {
                return Ok(waited);
            }
            if waited >= limit {
                return Err(self.not_reached(intent, goal.late(at, waited)).await);
            }
            network.sleep(POLL).await;
        }
    }

    /// Waits until a shaft that has reached its target stands there. Bit 10 comes when the shaft is in its window, which it may
    /// enter while it still turns, and 606Ch is a mean of what was. A shaft that swings on is at its target all the same.
    pub(super) async fn settle(&self, intent: &'static str) -> Result<(), Error> {
        let Some(velocity) = self.motion(intent)?.units.actual_velocity else { return Ok(()) };
        let mut waited = Duration::ZERO;
        while waited < SETTLE_TIME {
            self.still_enabled(intent).await?;
            let speed = self.answered(intent, self.read_quantity(velocity).await).await?;
            if speed.abs() < self.gear.at_output(STANDSTILL_RPM) {
                break;
            }
            self.wait_poll(&mut waited).await;
        }
        Ok(())
    }

    /// The statusword, if the drive still follows set-points.
    pub(super) async fn still_enabled(&self, intent: &'static str) -> Result<Statusword, Error> {
        let statusword = self.answered(intent, self.statusword().await).await?;
        match self.power_state(statusword) {
            Some(PowerState::OperationEnabled) => Ok(statusword),
            Some(PowerState::Fault | PowerState::FaultReactionActive) => {
                Err(self.not_reached(intent, Trigger::Fault).await)
            }
            _ => Err(self.not_reached(intent, Trigger::LostOperation).await),
        }
    }
}
