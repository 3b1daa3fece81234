//! What a supervised motion waits for, and how the drive is looked at meanwhile.

use std::time::Duration;

use canopen::Mux;
use cia402::object::{CONTROLWORD, POSITION_ACTUAL_VALUE};
use cia402::{Controlword, PowerState, Statusword};
use devices::{HomingRules, Quantity};

use super::conclude::{Interference, Trigger};
use super::handle::{Drive, POLL};
use crate::error::Error;
use crate::units::Rpm;

/// How near to the target bit 10 (target reached) is believed, in turns of the shaft.
pub(crate) const REACHED_TURNS: f64 = 0.01;

/// What counts as reached.
#[derive(Clone, Copy, Debug)]
pub(super) enum Goal {
    /// A speed, by the actual velocity.
    Speed(Held),
    /// A position. Statusword bit 10 is believed where the shaft is near the target only: it is left over from the move before,
    /// and a drive sets it when a halt has brought it to rest anywhere (CiA 402-2, 8.4.2).
    Position { target: i64, band: f64, sent: Sent },
    /// The home position, by the model's bits of the statusword. They are believed some time after the start: until
    /// then they may be those of the run before.
    Home { rules: HomingRules, method: i8, looks: u8 },
}

/// A target as it was sent, to be compared with what the drive has later.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sent {
    pub(super) object: Mux,
    pub(super) raw: i64,
}

/// A speed that a drive is to have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) quantity: Quantity,
    pub(super) target_rpm: f64,
    pub(super) band_rpm: f64,
    pub(super) sent: Sent,
}

/// What one look has found.
#[derive(Clone, Copy, Debug)]
struct SpeedLook {
    reached: bool,
    at: f64,
    /// Neither reached, nor nearer than at the look before.
    rests: bool,
}

/// How long a shaft may swing about its target before that is taken for its rest.
const SETTLE_TIME: Duration = Duration::from_millis(200);

/// How often the drive is looked at before its verdict on homing is believed: 50 ms, many cycles of any drive.
const LOOKS_BEFORE_VERDICT: u8 = 5;

/// Looks in a row at a shaft that rests, or is not as fast as it should be, after which the cause of the stop is looked
/// for.
const LOOKS_AT_REST: u32 = 20;

/// What a shaft that is stopped may move by from one look to the next, in turns.
const REST_TURNS: f64 = 1e-4;

impl Goal {
    /// Whether it is reached, and where the drive is.
    async fn look(
        &mut self,
        drive: &Drive,
        intent: &'static str,
        statusword: Statusword,
        before: Option<f64>,
    ) -> Result<SpeedLook, Error> {
        match self {
            Self::Home { rules, method, looks } => {
                *looks = looks.saturating_add(1);
                let settled = *looks > LOOKS_BEFORE_VERDICT;
                if settled && rules.failed.matches(statusword) {
                    return Err(drive.not_reached(intent, Trigger::HomingFailed(*method)).await);
                }
                let at = drive.read_number(drive.place(POSITION_ACTUAL_VALUE)).await?;
                Ok(SpeedLook { reached: settled && rules.attained.matches(statusword), at: at as f64, rests: false })
            }
            Self::Speed(held) => {
                let at = drive.read_quantity(held.quantity).await?;
                let reached = (at - held.target_rpm).abs() <= held.band_rpm;
                Ok(SpeedLook { reached, at, rests: !reached && drive.stands_at(Rpm(at)) })
            }
            Self::Position { target, band, .. } => {
                let position = drive.read_number(drive.place(POSITION_ACTUAL_VALUE)).await?;
                let near = position.abs_diff(*target) as f64 <= *band;
                let at = position as f64;
                let least = (*band / REACHED_TURNS * REST_TURNS).max(1.0);
                let rests = !near && before.is_some_and(|before| (at - before).abs() <= least);
                Ok(SpeedLook { reached: near && statusword.has(Statusword::TARGET_REACHED), at, rests })
            }
        }
    }

    fn late(&self, at: f64, waited: Duration) -> Trigger {
        match self.target() {
            None => Trigger::NotHome { at, waited },
            Some((target, unit, _)) => Trigger::Late { at, target, unit, waited },
        }
    }

    /// What was asked for, its unit, and what was sent for it.
    const fn target(&self) -> Option<(f64, &'static str, Sent)> {
        match self {
            Self::Home { .. } => None,
            Self::Speed(held) => Some((held.target_rpm, "r/min", held.sent)),
            Self::Position { target, sent, .. } => Some((*target as f64, "counts", *sent)),
        }
    }
}

impl Drive {
    /// Polls the drive until the goal is reached; gives how long it took.
    pub(super) async fn watch(&self, intent: &'static str, mut goal: Goal, limit: Duration) -> Result<Duration, Error> {
        let network = self.node.network();
        let began = network.now();
        let (mut before, mut at_rest) = (None, 0);
        loop {
            let statusword = self.still_enabled(intent).await?;
            let look = self.answered(intent, goal.look(self, intent, statusword, before).await).await?;
            let waited = network.now() - began;
            if look.reached {
                return Ok(waited);
            }
            if waited >= limit {
                return Err(self.not_reached(intent, goal.late(look.at, waited)).await);
            }
            at_rest = if look.rests { at_rest + 1 } else { 0 };
            if at_rest > 0 && at_rest % LOOKS_AT_REST == 0 {
                self.find_who_stopped_it(intent, &goal, look.at).await?;
            }
            before = Some(look.at);
            network.sleep(POLL).await;
        }
    }

    /// An error if another master has halted the drive or given it another target.
    async fn find_who_stopped_it(&self, intent: &'static str, goal: &Goal, at: f64) -> Result<(), Error> {
        let Some((target, unit, sent)) = goal.target() else { return Ok(()) };
        let elsewhere = |by| Trigger::Elsewhere { at, target, unit, by };
        // Without an answer there is nothing to report.
        if let Ok(controlword) = self.node.read::<u16>(self.place(CONTROLWORD)).await
            && Controlword(controlword).has(Controlword::HALT)
        {
            return Err(self.not_reached(intent, elsewhere(Interference::Halted)).await);
        }
        if let Ok(now) = self.read_number(sent.object).await
            && now != sent.raw
        {
            let by = Interference::Retargeted { object: sent.object, now, sent: sent.raw };
            return Err(self.not_reached(intent, elsewhere(by)).await);
        }
        Ok(())
    }

    /// Polls a drive that is to keep its speed for `duration`.
    pub(super) async fn watch_speed(&self, intent: &'static str, held: Held, duration: Duration) -> Result<(), Error> {
        // By the clock: looks take time as well, and a program that was frozen is late already.
        let (network, end) = (self.node.network(), self.node.network().now() + duration);
        let mut lost = 0;
        let mut goal = Goal::Speed(held);
        loop {
            let statusword = self.still_enabled(intent).await?;
            let look = self.answered(intent, goal.look(self, intent, statusword, None).await).await?;
            lost = if look.reached { 0 } else { lost + 1 };
            let last = network.now() >= end;
            if lost >= LOOKS_AT_REST && (last || lost % LOOKS_AT_REST == 0) {
                self.find_who_stopped_it(intent, &goal, look.at).await?;
                if last || look.rests {
                    let (at, target, unit) = (look.at, held.target_rpm, "r/min");
                    let elsewhere = Trigger::Elsewhere { at, target, unit, by: Interference::Unknown };
                    return Err(self.not_reached(intent, elsewhere).await);
                }
            }
            if last {
                return Ok(());
            }
            network.sleep(POLL.min(end - network.now())).await;
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
            if self.stands_at(Rpm(speed)) {
                break;
            }
            self.wait_poll(&mut waited).await;
        }
        Ok(())
    }

    /// The statusword, if the drive still follows set-points, and this program has kept it content.
    pub(super) async fn still_enabled(&self, intent: &'static str) -> Result<Statusword, Error> {
        if let Some(lapse) = self.node.network().lapse(self.node.id()) {
            return Err(self.not_reached(intent, Trigger::HeldUp(lapse)).await);
        }
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
