//! A CiA 402 drive by its intents, in physical units.
//!
//! In: what a person wants ("turn 90 degrees at 30 r/min"). Out: SDO requests to the node in the order that CiA 402-2
//! and the model's manual ask for, and either success or an [`Explanation`]. What a model's raw values are worth, and
//! where it departs from the standard, comes from its [`DriveProfile`]; no model is known here by its name, and 6502h is
//! never asked for. Without a profile only what the standard fixes is offered.
//! While a motion is supervised, the polling keeps the drive's watch over its host content.

mod conclude;
mod explain;
mod goal;
mod homing;
mod motion;
mod position;
mod power;
mod safety;
mod scale;
mod state;
mod store;

use std::time::Duration;

use canopen::Mux;
use canopen::od::Entry;
use cia402::{Controlword, ModeOfOperation, PowerState, Statusword};
use drives::profile::{DriveProfile, PowerStyle};

use crate::error::{Access, Error};
use crate::network::Node;

pub use explain::{Explanation, Fact, faults_in};
pub use homing::HomingOptions;
pub use motion::{MotionOptions, MotionReport, Note};
pub use safety::StopGuard;
pub use state::DriveState;

const CONTROLWORD: Mux = Mux::new(0x6040, 0);
const STATUSWORD: Mux = Mux::new(0x6041, 0);
const MODE: Mux = Mux::new(0x6060, 0);
const MODE_DISPLAY: Mux = Mux::new(0x6061, 0);
const POSITION_ACTUAL: Mux = Mux::new(0x6064, 0);
const TARGET_POSITION: Mux = Mux::new(0x607A, 0);
const ERROR_CODE: Mux = Mux::new(0x603F, 0);

/// How often a drive is looked at while something is waited for: quick to a person, about 10 % of a 500 kbit/s bus
/// for two objects.
const POLL: Duration = Duration::from_millis(10);

/// How long one step of the power state machine, or a change of mode, may take.
const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// A drive on a network.
#[derive(Clone)]
pub struct Drive {
    node: Node,
    profile: Option<&'static DriveProfile>,
}

impl core::fmt::Debug for Drive {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let model = self.profile.map(|profile| profile.model);
        f.debug_struct("Drive").field("node", &self.node.id()).field("model", &model).finish()
    }
}

impl Drive {
    /// A drive of a known model.
    pub const fn new(node: Node, profile: &'static DriveProfile) -> Self {
        Self { node, profile: Some(profile) }
    }

    /// A CiA 402 drive of unknown model: it can be enabled, disabled, quick-stopped and reset, not moved or stored.
    pub const fn of_unknown_model(node: Node) -> Self {
        Self { node, profile: None }
    }

    /// Its node.
    pub const fn node(&self) -> &Node {
        &self.node
    }

    /// What is known of its model.
    pub const fn profile(&self) -> Option<&'static DriveProfile> {
        self.profile
    }

    /// Checks that the node says it is this model, and has the object that tells it from others that say so too.
    ///
    /// # Errors
    /// [`Error::WrongModel`] when its device type or vendor differ, [`Error::OtherModel`] when it lacks that object;
    /// those of the SDO reads.
    pub async fn check_identity(&self) -> Result<(), Error> {
        let profile = self.known("compare its identity")?;
        let (node, model) = (self.node.id(), profile.title);
        let found = crate::identify::identity(&self.node).await?;
        if !found.matches(&profile.identity) {
            return Err(Error::WrongModel { node, model, found });
        }
        let Some(hallmark) = profile.hallmark else { return Ok(()) };
        match self.node.upload(hallmark).await {
            Ok(_) => Ok(()),
            Err(Error::Aborted { .. }) => Err(Error::OtherModel { node, model, hallmark }),
            Err(error) => Err(error),
        }
    }

    /// The statusword.
    ///
    /// # Errors
    /// Those of the SDO read.
    pub async fn statusword(&self) -> Result<Statusword, Error> {
        self.node.read::<u16>(STATUSWORD).await.map(Statusword)
    }

    /// The power state that a statusword of this model shows.
    fn power_state(&self, statusword: Statusword) -> Option<PowerState> {
        self.power_style().state(statusword)
    }

    fn power_style(&self) -> PowerStyle {
        self.profile.map_or(PowerStyle::Cia402, |profile| profile.power)
    }

    /// The mode that the drive is in.
    async fn mode(&self) -> Result<ModeOfOperation, Error> {
        let display = self.profile.map_or(MODE_DISPLAY, |profile| profile.mode_display);
        self.node.read::<i8>(display).await.map(ModeOfOperation)
    }

    async fn write_controlword(&self, controlword: Controlword) -> Result<(), Error> {
        self.node.write(CONTROLWORD, controlword.0).await
    }

    /// Sets 6060h and waits until the drive shows it.
    async fn set_mode(&self, mode: ModeOfOperation) -> Result<(), Error> {
        let profile = self.known("set its mode")?;
        if !profile.modes.contains(&mode) {
            return Err(Error::NoSuchMode { node: self.node.id(), model: profile.title, mode });
        }
        if self.mode().await? == mode {
            return Ok(());
        }
        self.node.write(MODE, mode.0).await?;
        let mut waited = Duration::ZERO;
        while self.mode().await? != mode {
            if waited >= STEP_TIMEOUT {
                return Err(self.not_reached("change its mode", explain::Trigger::Mode(mode)).await);
            }
            self.node.network().sleep(POLL).await;
            waited += POLL;
        }
        Ok(())
    }

    /// The model's profile, or an error that says what it was needed for.
    fn known(&self, intent: &'static str) -> Result<&'static DriveProfile, Error> {
        self.profile.ok_or(Error::UnknownModel { node: self.node.id(), intent })
    }

    /// The model's row of an object.
    fn row(&self, mux: Mux, intent: &'static str) -> Result<&'static Entry, Error> {
        let profile = self.known(intent)?;
        let slot = profile.table.find(mux);
        let slot = slot.map_err(|code| Error::Aborted { node: self.node.id(), mux, access: Access::Read, code })?;
        Ok(profile.table.row(slot))
    }

    /// Reads an object as the model's table types it.
    async fn read_number(&self, mux: Mux) -> Result<i64, Error> {
        let row = self.row(mux, "read an object by its model's table")?;
        let payload = self.node.upload(mux).await?;
        let (expected, received) = (row.data_type.size(), payload.as_bytes().len());
        if expected != received {
            return Err(Error::WrongLength { node: self.node.id(), mux, expected, received });
        }
        Ok(row.data_type.value(payload.raw()))
    }

    /// Writes an object as the model's table types it, after checking the table's limits.
    async fn write_number(&self, mux: Mux, value: i64) -> Result<(), Error> {
        let row = self.check_number(mux, value)?;
        let bytes = row.data_type.raw(value).to_le_bytes();
        self.node.download(mux, &bytes[..row.data_type.size()]).await
    }

    /// Checks a value against the limits of the model's table, and gives the object's row.
    fn check_number(&self, mux: Mux, value: i64) -> Result<&'static Entry, Error> {
        let row = self.row(mux, "write an object by its model's table")?;
        let (low, high) = row.limits.unwrap_or(row.data_type.range());
        let listed = row.values.is_empty() || row.meaning(value).is_some();
        if value < low || value > high || !listed {
            let (node, title, unit) = (self.node.id(), row.title, row.unit);
            return Err(Error::OutOfLimits { node, mux, title, unit, asked: value, low, high });
        }
        Ok(row)
    }
}
