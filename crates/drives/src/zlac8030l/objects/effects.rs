//! What a write sets in motion, object by object. Objects that are not named here are parameters: the drive reads
//! them when it needs them.

use super::{
    CLEAR_CURRENT_POSITION, CLEAR_FEEDBACK_POSITION, CONTROLWORD, MODES_OF_OPERATION, REGISTER_PARAMETER_SETTING,
    ROW_COUNT_2_01, TARGET_POSITION, TARGET_TORQUE, TARGET_VELOCITY,
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
    /// 607Ah, 60FFh, 6071h: read each period, or when a set-point is taken.
    Target,
    /// Parameters: taken over by the next parameter refresh.
    Parameter,
}

crate::row::effects! { ROW_COUNT_2_01 else Parameter:
    CONTROLWORD => Command;
    TARGET_VELOCITY => Target;
    TARGET_POSITION => Target;
    TARGET_TORQUE => Target;
    MODES_OF_OPERATION => SelectMode;
    REGISTER_PARAMETER_SETTING => Registers;
    CLEAR_FEEDBACK_POSITION => ClearPosition;
    CLEAR_CURRENT_POSITION => ClearPosition;
}
