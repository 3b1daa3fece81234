//! What a write sets in motion, object by object. Objects that are not named here are parameters: the drive takes
//! them over at its next supervision period.

use super::*;

/// The consequence of a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// 6040h.
    Command,
    /// 6060h: another mode; 6 starts homing.
    SelectMode,
    /// 607Ah: caches, or starts a move.
    Target,
    /// 260Ch: moves by so much at once.
    Increment,
    /// 60FFh: read each period.
    Follow,
    /// 2600h: 1 takes the motor away from pulses.
    ModbusEnable,
    /// 2601h: the power stage; from 0 to 1 it resets alarms.
    OutputEnabled,
    /// 260Eh: 0 clears the alarm.
    AlarmCode,
    /// 260Ah: the gear, or a step of setting the multi-turn origin.
    GearNumerator,
    /// 2614h.
    Save,
    /// 2615h: the identifiers of PDOs.
    DeviceAddress,
    /// 1016h:01: another watch over the host.
    ConsumerHeartbeat,
    /// Anything else.
    Parameter,
}

crate::row::effects! { ROW_COUNT_1_66 else Parameter:
    CONTROLWORD => Command;
    MODES_OF_OPERATION => SelectMode;
    TARGET_POSITION => Target;
    TARGET_VELOCITY => Follow;
    INCREMENTAL_POSITION => Increment;
    MODBUS_ENABLE => ModbusEnable;
    OUTPUT_ENABLED => OutputEnabled;
    DEVICE_ADDRESS => DeviceAddress;
    ALARM_CODE => AlarmCode;
    GEAR_NUMERATOR => GearNumerator;
    DATA_SAVE_FLAG => Save;
    CONSUMER_HEARTBEAT_TIME => ConsumerHeartbeat;
}
