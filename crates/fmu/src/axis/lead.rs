//! The master of a drive: sets it up, and gives it its target in each cycle, while it may.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use can::Instant;
use cia402::{ModeOfOperation, PowerState};
use devices::{AxisDescription, Description};
use master::cyclic::{CyclicDrive, CyclicError, CyclicOptions, CyclicState, Demand, Refusal};
use master::units::{Amperes, Rpm, Turns};
use master::{Drive, Network, NoCycle};

use crate::config::TargetKind;

/// How long it is waited for a drive to boot, and after a set-up that failed.
const BOOT_LIMIT: Duration = Duration::from_secs(60);
const RETRY: Duration = Duration::from_millis(100);

/// What importer and master say to each other.
#[derive(Clone, Debug, Default)]
pub(super) struct Shared {
    pub(super) wishes: Wishes,
    pub(super) led: Led,
}

/// What the importer wants.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wishes {
    pub(super) enable: bool,
    pub(super) stop: bool,
    pub(super) reset_fault: bool,
    /// In rad/s, rad or A.
    pub(super) target: f64,
}

/// What the master makes of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Led {
    pub(super) ready: bool,
    pub(super) follows: bool,
    pub(super) refusal: Why,
    pub(super) position_rad: f64,
    pub(super) velocity_rad_s: f64,
    pub(super) current_a: f64,
}

/// Why the drive does not follow. It becomes a text when the variable is read, not in each cycle.
#[derive(Clone, Debug, Default)]
pub(super) enum Why {
    /// It follows, or is not to.
    #[default]
    Nothing,
    /// It could not be set up, or lost its cycle.
    Failed(String),
    /// The demand of this cycle was refused.
    Refused(Refusal),
    /// It was stopped.
    Locked,
}

impl fmt::Display for Why {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing => Ok(()),
            Self::Failed(what) => f.write_str(what),
            Self::Refused(refusal) => refusal.fmt(f),
            Self::Locked => f.write_str("it was stopped: it moves again when enable has been false"),
        }
    }
}

/// The mode in which a model follows such targets, a new one each cycle; `None` if it has none.
pub(super) fn mode_of(description: &Description, kind: TargetKind) -> Option<ModeOfOperation> {
    use ModeOfOperation as Mode;
    let axis: &AxisDescription = description.axes.first()?;
    let modes: &[ModeOfOperation] = match kind {
        TargetKind::Velocity => &[Mode::PROFILE_VELOCITY, Mode::CYCLIC_SYNCHRONOUS_VELOCITY],
        TargetKind::Position => &[Mode::CYCLIC_SYNCHRONOUS_POSITION, Mode::INTERPOLATED_POSITION],
        TargetKind::Torque => &[Mode::PROFILE_TORQUE, Mode::CYCLIC_SYNCHRONOUS_TORQUE],
    };
    modes.iter().copied().find(|mode| axis.modes.contains(mode))
}

/// Sets the drive up whenever it has booted, and leads it from there.
pub(super) async fn lead(drive: Drive, kind: TargetKind, period: Duration, shared: Arc<Mutex<Shared>>) {
    let network = drive.node().network().clone();
    let mut gate = Gate::default();
    let mut boots = 0;
    loop {
        let booted =
            drive.node().wait(|seen| seen.facts.boot_up.map(|(_, count)| count).filter(|it| *it > boots), BOOT_LIMIT);
        let Ok(count) = booted.await else { continue };
        boots = count;
        let Some(mode) = drive.description().and_then(|description| mode_of(description, kind)) else { return };
        let failure = match set_up(&drive, mode).await {
            Ok(mut axis) => {
                network.sync(Some(period));
                let mut cycles = Cycles { drive: &drive, boots, kind, shared: &shared };
                let ended = cycles.follow(&network, &mut axis, &mut gate).await;
                network.sync(None);
                ended.err().map(|error| error.to_string())
            }
            Err(error) => {
                network.sleep(RETRY).await;
                // Once more, if it has not booted since.
                boots -= 1;
                Some(error.to_string())
            }
        };
        let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
        shared.led = Led { refusal: failure.map_or(Why::Nothing, Why::Failed), ..Led::default() };
    }
}

async fn set_up(drive: &Drive, mode: ModeOfOperation) -> Result<CyclicDrive, CyclicError> {
    drive.configure_cyclic(mode).await?;
    drive.cyclic(mode, CyclicOptions::default()).await
}

/// A drive in its cycles since one boot-up.
struct Cycles<'a> {
    drive: &'a Drive,
    boots: u32,
    kind: TargetKind,
    shared: &'a Mutex<Shared>,
}

impl Cycles<'_> {
    /// Until the drive boots again.
    async fn follow(&mut self, network: &Network, axis: &mut CyclicDrive, gate: &mut Gate) -> Result<(), NoCycle> {
        loop {
            network.next_sync().await?;
            if network.facts(self.drive.node().id()).boot_up.is_some_and(|(_, count)| count != self.boots) {
                gate.is_locked |= gate.was_enabled;
                return Ok(());
            }
            let mut shared = self.shared.lock().unwrap_or_else(PoisonError::into_inner);
            let wishes = shared.wishes;
            let state = network.exchange(|io| {
                let demand = gate.demand(&wishes, axis, io.now()).unwrap_or_else(|| self.target(wishes.target));
                axis.step(io, demand)
            });
            gate.look(&state);
            shared.led.take(&state, gate, &wishes);
        }
    }

    fn target(&self, target: f64) -> Demand {
        match self.kind {
            TargetKind::Velocity => Demand::Velocity(Rpm(target * 30.0 / std::f64::consts::PI)),
            TargetKind::Position => Demand::Position(Turns(target / std::f64::consts::TAU).into()),
            TargetKind::Torque => Demand::Current(Amperes(target)),
        }
    }
}

/// What stands between a target and the drive.
#[derive(Default)]
struct Gate {
    was_enabled: bool,
    /// It was stopped, by the importer or by itself: it does not move before `enable` has been false.
    is_locked: bool,
    /// It had power, and has not been seen to stand since it is to be without.
    may_move: bool,
    off_since: Option<Instant>,
    power: Option<PowerState>,
}

impl Gate {
    /// What the drive is to do instead of following its target; `None` if it may.
    fn demand(&mut self, wishes: &Wishes, axis: &CyclicDrive, now: Instant) -> Option<Demand> {
        self.was_enabled = wishes.enable;
        if wishes.reset_fault && matches!(self.power, Some(PowerState::Fault | PowerState::FaultReactionActive)) {
            self.is_locked |= wishes.enable;
            return Some(Demand::ResetFault);
        }
        if wishes.enable {
            self.off_since = None;
            self.is_locked |= wishes.stop;
            return self.is_locked.then_some(Demand::QuickStop);
        }
        self.is_locked = false;
        let since = *self.off_since.get_or_insert(now);
        // By quick stop until it was seen to stand: without power it would coast.
        if self.may_move && axis.at_rest(now - since).is_none_or(|rest| rest.is_err()) {
            return Some(Demand::QuickStop);
        }
        self.may_move = false;
        Some(Demand::Off)
    }

    fn look(&mut self, state: &CyclicState) {
        self.power = state.power;
        self.may_move |= state.follows;
        let ends = |refusal| {
            matches!(refusal, Refusal::Remapped | Refusal::Stopped(_) | Refusal::Fault(_) | Refusal::LostOperation(_))
        };
        self.is_locked |= state.refused.is_some_and(ends);
    }
}

impl Led {
    fn take(&mut self, state: &CyclicState, gate: &Gate, wishes: &Wishes) {
        (self.ready, self.follows) = (state.statusword.is_some(), state.follows);
        self.refusal = match state.refused {
            Some(refusal) => Why::Refused(refusal),
            None if wishes.enable && gate.is_locked => Why::Locked,
            None => Why::Nothing,
        };
        if let Some(Turns(turns)) = state.position {
            self.position_rad = turns * std::f64::consts::TAU;
        }
        if let Some(Rpm(rpm)) = state.velocity {
            self.velocity_rad_s = rpm * std::f64::consts::PI / 30.0;
        }
        if let Some(Amperes(current_a)) = state.current {
            self.current_a = current_a;
        }
    }
}
