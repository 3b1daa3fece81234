//! What a write sets in motion, object by object. Objects that are not named here are parameters: the drive reads
//! them when it needs them.

use canopen::od::Slot;

use super::{
    CLEAR_CURRENT_POSITION, CLEAR_FEEDBACK_POSITION, CONTROLWORD, MODES_OF_OPERATION, REGISTER_PARAMETER_SETTING,
};

/// The consequence of a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// 6040h: a command to the power state machine and the mode.
    Command,
    /// 6060h: another mode is asked for.
    SelectMode,
    /// 2009h: save or restore.
    Registers,
    /// 2005h, 2006h: the position becomes zero.
    ClearPosition,
    /// Parameters: taken over by the next parameter refresh.
    Parameter,
}

/// What a write to `slot` does.
pub fn effect(slot: Slot) -> Effect {
    match slot {
        slot if slot == CONTROLWORD.slot() => Effect::Command,
        slot if slot == MODES_OF_OPERATION.slot() => Effect::SelectMode,
        slot if slot == REGISTER_PARAMETER_SETTING.slot() => Effect::Registers,
        slot if slot == CLEAR_FEEDBACK_POSITION.slot() || slot == CLEAR_CURRENT_POSITION.slot() => {
            Effect::ClearPosition
        }
        _ => Effect::Parameter,
    }
}
