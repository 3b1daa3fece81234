//! The listed values that objects of both drives have, with their meaning.

use crate::row::Values;

pub(super) const CLEAR: Values = &[(0, "invalid"), (1, "clear the position")];
pub(super) const LIMIT_STOP: Values = &[(0, "stop"), (1, "emergency stop"), (2, "invalid")];
pub(super) const REGISTER_COMMANDS: Values =
    &[(0, "invalid"), (1, "restore factory settings"), (2, "save all RW/S parameters")];
pub(super) const SHAFT_LOCK: Values = &[(0, "free while not enabled"), (1, "locked while not enabled")];
pub(super) const SAVE_ON_WRITE: Values = &[(0, "each write is stored"), (1, "not stored")];
pub(super) const SHUTDOWN_OPTIONS: Values = &[(0, "power off at once"), (1, "normal stop, then ready to switch on")];
