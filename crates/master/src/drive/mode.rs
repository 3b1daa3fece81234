//! Changing the mode of operation (CiA 402-2, 8.5): at standstill, and until the drive shows it.

use std::time::Duration;

use cia402::object::MODES_OF_OPERATION;
use cia402::{ModeOfOperation, PowerState};
use devices::AxisDescription;

use super::conclude::Trigger;
use super::handle::{Drive, POLL, STEP_TIMEOUT};
use super::motion::Note;
use crate::error::Error;
use crate::units::Rpm;

impl Drive {
    /// Sets 6060h and waits until the drive shows it. A shaft that turns in another mode is stopped first: drives change
    /// their mode at standstill, or jump.
    pub(crate) async fn set_mode(&self, mode: ModeOfOperation) -> Result<Option<Note>, Error> {
        let axis = self.motion("set its mode")?;
        if !axis.modes.contains(&mode) {
            return Err(self.no_such_mode(axis, mode));
        }
        let before = self.mode().await?;
        if before == mode {
            return Ok(None);
        }
        let stopped = self.stop_if_turning(axis).await?;
        self.node.write(self.place(MODES_OF_OPERATION), mode.0).await?;
        let mut waited = Duration::ZERO;
        while self.mode().await? != mode {
            if waited >= STEP_TIMEOUT {
                return Err(self.not_reached("change its mode", Trigger::Mode(mode)).await);
            }
            self.node.network().sleep(POLL).await;
            waited += POLL;
        }
        Ok(stopped.then_some(Note::StoppedFirst { before }))
    }

    async fn stop_if_turning(&self, axis: &AxisDescription) -> Result<bool, Error> {
        let Some(velocity) = axis.units.actual_velocity else { return Ok(false) };
        let turning = !self.stands_at(Rpm(self.read_quantity(velocity).await?));
        let follows = self.power_state(self.statusword().await?) == Some(PowerState::OperationEnabled);
        if turning && follows {
            self.stop().await?;
        }
        Ok(turning && follows)
    }
}
