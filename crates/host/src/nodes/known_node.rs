//! A node that was found, and its last known state.

use can::Instant;
use cia402::PowerState;
use master::Drive;
use master::drive::HostLoss;
use master::identify::Identity;

use crate::snapshot::DriveView;

/// A node that was found.
#[derive(Debug)]
pub(crate) struct KnownNode {
    pub(crate) identity: Option<Identity>,
    /// What is uncertain about its model.
    pub(crate) remark: Option<String>,
    /// The handle to move it, if it is a drive.
    pub(crate) drive: Option<Drive>,
    /// It is being read already.
    pub(crate) is_looked_at: bool,
    pub(crate) view: Option<Box<DriveView>>,
    /// What it would do if this program died during a motion, and when that was read.
    pub(crate) loss: Option<(HostLoss, Instant)>,
    /// Why its values are unknown now.
    pub(crate) trouble: Option<String>,
}

impl KnownNode {
    /// True unless it has reported that its motor has no power.
    pub(crate) fn may_move(&self) -> bool {
        self.drive.is_some() && self.view.as_ref().is_none_or(|view| has_power(view.state))
    }
}

/// True in the states in which the power stage is on or may be.
pub(crate) fn has_power(state: Option<&'static str>) -> bool {
    let powerless = [
        PowerState::NotReadyToSwitchOn,
        PowerState::SwitchOnDisabled,
        PowerState::ReadyToSwitchOn,
        PowerState::SwitchedOn,
        PowerState::Fault,
    ];
    !state.is_some_and(|state| powerless.iter().any(|power| power.name() == state))
}
