//! Where the objects of CiA 402-2 stand that programs ask for by themselves, by their names.
//!
//! They are those of the first axis: a further one has each 800h higher. Numbers in brackets are clauses of CiA 402-2.

canopen::objects! {
    /// Error code of the last error.
    ERROR_CODE = 0x603F, 0;
    /// Controlword (8.4.1).
    CONTROLWORD = 0x6040, 0;
    /// Statusword (8.4.2).
    STATUSWORD = 0x6041, 0;
    /// vl target velocity (velocity mode), in r/min of the motor while 604Bh and 604Ch are 1.
    VL_TARGET_VELOCITY = 0x6042, 0;
    /// vl velocity min max amount (velocity mode): the least speed but standstill, in units of 6044h.
    VL_VELOCITY_MIN_AMOUNT = 0x6046, 1;
    /// vl velocity min max amount (velocity mode): the greatest speed, in units of 6044h.
    VL_VELOCITY_MAX_AMOUNT = 0x6046, 2;
    /// Quick stop option code: by which ramp, and whether the drive stays in Quick stop active.
    QUICK_STOP_OPTION_CODE = 0x605A, 0;
    /// Modes of operation: the mode that is asked for.
    MODES_OF_OPERATION = 0x6060, 0;
    /// Modes of operation display: the mode in effect.
    MODES_OF_OPERATION_DISPLAY = 0x6061, 0;
    /// Position actual value, in user units of position.
    POSITION_ACTUAL_VALUE = 0x6064, 0;
    /// Position window: how far from its target a drive has reached it.
    POSITION_WINDOW = 0x6067, 0;
    /// Velocity actual value, in user units of velocity.
    VELOCITY_ACTUAL_VALUE = 0x606C, 0;
    /// Target torque, in thousandths of what is rated.
    TARGET_TORQUE = 0x6071, 0;
    /// Max torque, in thousandths of what is rated.
    MAX_TORQUE = 0x6072, 0;
    /// Max current, in thousandths of what is rated.
    MAX_CURRENT = 0x6073, 0;
    /// Target position (profile position).
    TARGET_POSITION = 0x607A, 0;
    /// Home offset (homing).
    HOME_OFFSET = 0x607C, 0;
    /// Software position limit (10.4) at the negative end.
    MIN_POSITION_LIMIT = 0x607D, 1;
    /// Software position limit (10.4) at the positive end.
    MAX_POSITION_LIMIT = 0x607D, 2;
    /// Max profile velocity (10.3).
    MAX_PROFILE_VELOCITY = 0x607F, 0;
    /// Max motor speed (10.3), r/min.
    MAX_MOTOR_SPEED = 0x6080, 0;
    /// Profile velocity (profile position).
    PROFILE_VELOCITY = 0x6081, 0;
    /// Profile acceleration.
    PROFILE_ACCELERATION = 0x6083, 0;
    /// Profile deceleration.
    PROFILE_DECELERATION = 0x6084, 0;
    /// Quick stop deceleration.
    QUICK_STOP_DECELERATION = 0x6085, 0;
    /// Position encoder resolution: increments (factor group).
    ENCODER_INCREMENTS = 0x608F, 1;
    /// Position encoder resolution: motor revolutions that those increments are of (factor group).
    POSITION_ENCODER_RESOLUTION_MOTOR_REVOLUTIONS = 0x608F, 2;
    /// Homing method (homing).
    HOMING_METHOD = 0x6098, 0;
    /// Homing speeds: while a switch is looked for (homing).
    SPEED_DURING_SEARCH_FOR_SWITCH = 0x6099, 1;
    /// Homing speeds: while the zero is looked for (homing).
    SPEED_DURING_SEARCH_FOR_ZERO = 0x6099, 2;
    /// Homing acceleration (homing).
    HOMING_ACCELERATION = 0x609A, 0;
    /// Interpolation data record (12.3): the first set-point.
    INTERPOLATION_DATA_RECORD_1ST_SET_POINT = 0x60C1, 1;
    /// Interpolation time period (12.3.4): how many units of time.
    INTERPOLATION_TIME_PERIOD_VALUE = 0x60C2, 1;
    /// Interpolation time period (12.3.4): the unit of time as a power of ten seconds.
    INTERPOLATION_TIME_INDEX = 0x60C2, 2;
    /// Positive torque limit value, in thousandths of what is rated.
    POSITIVE_TORQUE_LIMIT_VALUE = 0x60E0, 0;
    /// Negative torque limit value, in thousandths of what is rated.
    NEGATIVE_TORQUE_LIMIT_VALUE = 0x60E1, 0;
    /// Target velocity (profile velocity).
    TARGET_VELOCITY = 0x60FF, 0;
    /// Supported drive modes.
    SUPPORTED_DRIVE_MODES = 0x6502, 0;
}
