//! What a write sets in motion, object by object. Objects that are not named here are parameters: the drive takes
//! them over at its next supervision period.

use canopen::od::Slot;

use super::*;
use crate::row::effects;

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
    /// 2601h: the power stage; from 0 to 1 it resets alarms.
    OutputEnabled,
    /// 260Eh: 0 clears the alarm.
    AlarmCode,
    /// 260Ah: the gear, or a step of setting the multi-turn origin.
    GearNumerator,
    /// 2614h.
    Save,
    /// 1016h:01: another watch over the host.
    ConsumerHeartbeat,
    /// Anything else.
    Parameter,
}

/// What a write to `slot` does.
#[inline]
pub fn effect(slot: Slot) -> Effect {
    EFFECTS[slot.position()]
}

static EFFECTS: [Effect; ROW_COUNT] = effects(
    &[
        (CONTROLWORD.slot(), Effect::Command),
        (MODES_OF_OPERATION.slot(), Effect::SelectMode),
        (TARGET_POSITION.slot(), Effect::Target),
        (TARGET_VELOCITY.slot(), Effect::Follow),
        (INCREMENTAL_POSITION.slot(), Effect::Increment),
        (OUTPUT_ENABLED.slot(), Effect::OutputEnabled),
        (ALARM_CODE.slot(), Effect::AlarmCode),
        (GEAR_NUMERATOR.slot(), Effect::GearNumerator),
        (DATA_SAVE_FLAG.slot(), Effect::Save),
        (CONSUMER_HEARTBEAT_TIME.slot(), Effect::ConsumerHeartbeat),
    ],
    Effect::Parameter,
);
