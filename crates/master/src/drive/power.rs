use std::time::Duration;

use cia402::object::{CONTROLWORD, MODES_OF_OPERATION};
use cia402::{Controlword, ModeOfOperation, PowerCommand, PowerState, Statusword, next_command};
use devices::{HomingStart, PowerStyle, Quantity};

use super::conclude::Trigger;
use super::handle::{Drive, POLL, STEP_TIMEOUT};
use crate::error::Error;
use crate::units::Rpm;

/// Speed below which a shaft counts as standing still: the rounding of the coarsest velocity object.
pub(crate) const STANDSTILL_RPM: f64 = 1.0;

/// The assumed speed of a motor whose speed cannot be read, r/min: more than those of its kind turn.
const FASTEST_RPM: f64 = 10_000.0;

/// How many looks in a row have to find it so: a shaft that swings about its rest passes zero.
pub(super) const STANDSTILL_LOOKS: u32 = 5;

/// The power drive state machine (CiA 402-2, 8.2), and what replaces it on drives without one.
impl Drive {
    /// Brings the drive to Operation enabled, one step of the state machine at a time, or in one step where there is no
    /// state machine.
    ///
    /// A speed or torque left over from before is set to zero first: some drives follow it at once. A fault is
    /// not reset by itself: its cause comes first.
    ///
    /// # Errors
    /// [`Error::NotReached`] with an explanation when the drive does not follow; those of the SDO requests.
    pub async fn enable(&self) -> Result<(), Error> {
        const INTENT: &str = "enable it";
        let mut statusword = self.answered(INTENT, self.statusword().await).await?;
        if self.power_style() != PowerStyle::Cia402 {
            return self.enable_echoing(INTENT, statusword).await;
        }
        if statusword.state() != Some(PowerState::OperationEnabled) {
            self.clear_targets().await?;
        }
        let mut waited = Duration::ZERO;
        loop {
            match statusword.state() {
                Some(PowerState::OperationEnabled) => return Ok(()),
                Some(PowerState::Fault) => return Err(self.not_reached(INTENT, Trigger::Fault).await),
                Some(state) if next_command(state).is_some() => {
                    statusword = self.step(INTENT, state).await?;
                    waited = Duration::ZERO;
                }
                _ if waited >= STEP_TIMEOUT => return Err(self.not_reached(INTENT, Trigger::Waiting).await),
                _ => {
                    self.wait_poll(&mut waited).await;
                    statusword = self.answered(INTENT, self.statusword().await).await?;
                }
            }
        }
    }

    /// A drive that echoes its controlword: the statusword does not show bit 3, so the controlword is looked at too.
    async fn enable_echoing(&self, intent: &'static str, statusword: Statusword) -> Result<(), Error> {
        let command = PowerCommand::EnableOperation;
        let follows = self.power_state(statusword) == Some(PowerState::OperationEnabled);
        let present = self.node.read::<u16>(self.place(CONTROLWORD)).await.map(Controlword)?;
        if follows && present.command() == command {
            return Ok(());
        }
        self.leave_homing().await?;
        self.clear_targets().await?;
        self.write_controlword(command.controlword()).await?;
        let enabled = |state| state == PowerState::OperationEnabled;
        let result = self.wait_for(intent, command, STEP_TIMEOUT, enabled).await.map(drop);
        if result.is_err() {
            // Or it would take the motor over as soon as its alarm is reset.
            self.write_controlword(PowerCommand::DisableVoltage.controlword()).await?;
        }
        result
    }

    /// Stops by the drive's shutdown ramp and takes the power off the motor: Switch on disabled. What this program has set in motion
    /// and does not stand then, since it coasts, stays among [`Network::moved`](crate::Network::moved).
    ///
    /// # Errors
    /// [`Error::NotReached`]; those of the SDO requests.
    pub async fn disable(&self) -> Result<(), Error> {
        const INTENT: &str = "disable it";
        if self.power_state(self.statusword().await?) == Some(PowerState::OperationEnabled) {
            self.write_controlword(PowerCommand::Shutdown.controlword()).await?;
            self.wait_for(INTENT, PowerCommand::Shutdown, self.stop_time().await, |state| {
                state != PowerState::OperationEnabled
            })
            .await?;
        }
        // A fault has taken the power off already; a drive that echoes its controlword would act on an old one after it.
        self.write_controlword(PowerCommand::DisableVoltage.controlword()).await?;
        self.leave_homing().await?;
        if self.power_state(self.statusword().await?) != Some(PowerState::Fault) {
            let command = PowerCommand::DisableVoltage;
            self.wait_for(INTENT, command, STEP_TIMEOUT, |state| state == PowerState::SwitchOnDisabled).await?;
        }
        // A motor without power may coast, or be turned by its load: it is still in motion until it was seen to stand.
        if self.is_moved() && self.stands().await {
            self.note_stopped();
        }
        Ok(())
    }

    /// Quick stop: the steepest ramp that the drive is set to (605Ah). Ends at standstill. A motor without power is left so:
    /// a drive that echoes its controlword would energise it to hold it.
    ///
    /// # Errors
    /// [`Error::NotReached`]; those of the SDO requests.
    pub async fn quick_stop(&self) -> Result<(), Error> {
        const INTENT: &str = "quick-stop it";
        if let PowerStyle::EchoesControlword { live, .. } = self.power_style()
            && self.statusword().await.is_ok_and(|statusword| !statusword.has(live))
        {
            self.note_stopped();
            return Ok(());
        }
        let (id, controlword, stop) = (self.node.id(), self.place(CONTROLWORD), PowerCommand::QuickStop.controlword());
        self.node.network().with_core(|core| core.stop_axis(id, controlword, stop.0));
        self.write_controlword(stop).await?;
        self.leave_homing().await?;
        let stopping = |state| state != PowerState::OperationEnabled;
        self.wait_for(INTENT, PowerCommand::QuickStop, STEP_TIMEOUT, stopping).await?;
        if self.axis_description().is_some_and(|axis| axis.units.actual_velocity.is_some()) {
            self.wait_standstill(INTENT).await?;
        }
        self.note_stopped();
        Ok(())
    }

    /// Resets a fault or an alarm: a rising edge of controlword bit 7 (transition 15).
    ///
    /// # Errors
    /// [`Error::NotReached`] with the fault's cause and remedy when it stays or comes back.
    pub async fn reset_fault(&self) -> Result<(), Error> {
        const INTENT: &str = "reset its fault";
        let (style, statusword) = (self.power_style(), self.statusword().await?);
        if !style.is_faulted(statusword) {
            return Ok(());
        }
        self.forget_lost_host().await?;
        let rest = match self.power_state(statusword) {
            // A fault has taken the power off: what was commanded before must not come back unasked.
            Some(PowerState::Fault) | None => Controlword(0),
            // An alarm that has stopped nothing: a drive that follows or holds goes on.
            Some(_) => Controlword(self.node.read::<u16>(self.place(CONTROLWORD)).await? & !Controlword::FAULT_RESET),
        };
        self.write_controlword(rest).await?;
        self.write_controlword(Controlword(rest.0 | Controlword::FAULT_RESET)).await?;
        let mut waited = Duration::ZERO;
        while style.is_faulted(self.answered(INTENT, self.statusword().await).await?) {
            if waited >= STEP_TIMEOUT {
                self.write_controlword(rest).await?;
                return Err(self.not_reached(INTENT, Trigger::Fault).await);
            }
            self.wait_poll(&mut waited).await;
        }
        self.write_controlword(rest).await
    }

    /// Whether a shaft that shows this speed, as [`read_quantity`](Self::read_quantity) and [`state`](Self::state) have it behind a
    /// [`gear`](Self::gear), counts as standing. One look: a shaft that reverses passes zero.
    pub fn stands_at(&self, Rpm(speed): Rpm) -> bool {
        speed.abs() < self.gear.at_output(STANDSTILL_RPM)
    }

    /// Waits until the shaft stands still and goes on doing so, as long as the drive's ramps may take.
    pub(super) async fn wait_standstill(&self, intent: &'static str) -> Result<(), Error> {
        let velocity = self.has(self.motion(intent)?.units.actual_velocity, "the actual velocity")?;
        let limit = self.stop_time().await;
        let (mut waited, mut looks) = (Duration::ZERO, 0);
        loop {
            let speed = self.answered(intent, self.read_quantity(velocity).await).await?;
            looks = if self.stands_at(Rpm(speed)) { looks + 1 } else { 0 };
            if looks == STANDSTILL_LOOKS {
                return Ok(());
            }
            if waited >= limit {
                return Err(self.not_reached(intent, Trigger::StillTurning(speed)).await);
            }
            self.wait_poll(&mut waited).await;
        }
    }

    /// Sends the command that leads on from `state` and waits for the state machine to leave it.
    async fn step(&self, intent: &'static str, state: PowerState) -> Result<Statusword, Error> {
        let Some(command) = next_command(state) else { return self.statusword().await };
        let sent = self.write_controlword(command.controlword()).await;
        self.answered(intent, sent).await?;
        self.wait_for(intent, command, STEP_TIMEOUT, |now| now != state).await
    }

    async fn wait_for(
        &self,
        intent: &'static str,
        command: PowerCommand,
        limit: Duration,
        arrived: impl Fn(PowerState) -> bool,
    ) -> Result<Statusword, Error> {
        let mut waited = Duration::ZERO;
        loop {
            let statusword = self.answered(intent, self.statusword().await).await?;
            if self.power_state(statusword).is_some_and(&arrived) {
                return Ok(statusword);
            }
            if waited >= limit {
                return Err(self.not_reached(intent, Trigger::Ignored(command)).await);
            }
            self.wait_poll(&mut waited).await;
        }
    }

    /// How long a stop from full speed may take: twice the drive's slowest ramp, and a step.
    pub(super) async fn stop_time(&self) -> Duration {
        let fastest = self.gear.at_output(FASTEST_RPM);
        let turns = match self.axis_description().and_then(|axis| axis.units.actual_velocity) {
            Some(velocity) => self.read_quantity(velocity).await.map_or(fastest, f64::abs),
            None => fastest,
        };
        let ramp = match (self.ramp_times_s(turns).await, self.quick_stop_time_s(turns).await) {
            (Ok((_, down)), Ok(quick)) => down.max(quick),
            // The largest ramp of the drives known: 32767 ms.
            _ => 32.767,
        };
        STEP_TIMEOUT + Duration::from_secs_f64((2.0 * ramp).clamp(0.0, 3600.0))
    }

    pub(super) async fn wait_poll(&self, waited: &mut Duration) {
        self.node.network().sleep(POLL).await;
        *waited += POLL;
    }

    /// Ends homing where its mode alone keeps it going, whatever the controlword says.
    async fn leave_homing(&self) -> Result<(), Error> {
        let rules = self.axis_description().and_then(|axis| axis.homing);
        let by_mode = rules.is_some_and(|rules| rules.start == HomingStart::ModeWrite);
        if by_mode && self.mode().await? == ModeOfOperation::HOMING {
            self.node.write(self.place(MODES_OF_OPERATION), ModeOfOperation::PROFILE_POSITION.0).await?;
        }
        Ok(())
    }

    /// Zeroes a target speed or torque left over.
    async fn clear_targets(&self) -> Result<(), Error> {
        let Some(axis) = self.axis_description() else { return Ok(()) };
        match self.mode().await? {
            mode if mode == axis.velocity_mode() => self.write_zero(axis.units.target_velocity).await,
            ModeOfOperation::PROFILE_TORQUE => self.write_zero(axis.units.target_current).await,
            _ => Ok(()),
        }
    }

    /// Zero to a target, where the axis has it.
    pub(super) async fn write_zero(&self, target: Option<Quantity>) -> Result<(), Error> {
        match target {
            Some(target) => self.write_number(target.object, 0).await,
            None => Ok(()),
        }
    }
}
