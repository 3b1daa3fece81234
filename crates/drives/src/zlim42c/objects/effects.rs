//! What a write sets in motion, object by object. Objects that are not named here are parameters: the drive reads
//! them when it needs them.

use super::{
    CLEAR_CURRENT_POSITION, CONTROLWORD, FAULT_RESET, MODES_OF_OPERATION, REGISTER_PARAMETER_SETTING, ROW_COUNT,
    TARGET_POSITION, TARGET_VELOCITY,
};

/// The consequence of a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// 6040h: a command to the power state machine and the mode.
    Command,
    /// 6060h: another mode is asked for.
    SelectMode,
    /// 2010h: save or restore.
    Registers,
    /// 2011h: fault reset.
    FaultReset,
    /// 2012h: the position becomes zero.
    ClearPosition,
    /// 607Ah, 60FFh: read each period, or when a set-point is taken.
    Target,
    /// Parameters: taken over by the next parameter refresh.
    Parameter,
}

crate::row::effects! { ROW_COUNT else Parameter:
    CONTROLWORD => Command;
    TARGET_VELOCITY => Target;
    TARGET_POSITION => Target;
    MODES_OF_OPERATION => SelectMode;
    REGISTER_PARAMETER_SETTING => Registers;
    FAULT_RESET => FaultReset;
    CLEAR_CURRENT_POSITION => ClearPosition;
}
