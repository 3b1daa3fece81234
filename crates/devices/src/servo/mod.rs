//! The standard's own servo: a drive with the objects, modes and defaults of CiA 402-2 and nothing else.
//!
//! It is what a drive of any vendor is simulated as when there is no file of it, and what its file is held against.
//! [`axis`] and [`FAULTS`](faults::FAULTS) are also those of a drive that is described by a file.

pub mod faults;
pub mod objects;
pub mod variations;

use canopen::Mux;
use cia402::{ModeOfOperation, Statusword, object};

use crate::axis::{AxisDescription, BitPattern, HomingRules, HomingStart, NewSetPoint, PowerStyle};
use crate::description::{Description, HostWatch, Identity, NmtRules, ParameterStorage, PdoRules, Section};
use crate::faults::Faults;
use crate::placement::Placement;
use crate::terminals::Terminals;
use crate::timing::Timing;
use crate::units::{CountsPerTurn, Quantity, Ramps, Scale, Units};

/// A CiA 402 servo as the standard has it.
pub static CIA402: Description = Description {
    name: "cia402",
    title: "CiA 402 servo",
    manual: "CiA 301 V4.2.0, CiA 402-2 V4.0",
    sections: SECTIONS,
    identity: Identity { device_type: 0x0002_0192, vendor_id: 0, product_code: 402, revision_number: 0x0001_0000 },
    distinguishing_object: None,
    dictionary: &objects::TABLE,
    node_id: None,
    bitrate: None,
    axes: &[axis(Placement::FIRST, MODES)],
    host_watch: HostWatch::Heartbeat {
        consumer: Mux::new(0x1016, 1),
        fault: cia402::ErrorCode::LIFE_GUARD_OR_HEARTBEAT.0,
    },
    storage: ParameterStorage::CIA_301,
    faults: FAULTS,
    nmt: NmtRules::CIA_301,
    lss: true,
    sdo_block_transfer: true,
    pdo: PdoRules { max_objects: 8, ..PdoRules::CIA_301 },
    timing: Timing::GUESSED,
    stated_departures: &[],
    variations: variations::VARIATIONS,
    editions: &[],
};

/// How a CiA 402 drive reports its faults: by the codes of the standard.
pub const FAULTS: Faults = Faults {
    code: Some(object::ERROR_CODE),
    bit_field: false,
    table: &faults::FAULTS,
    section: "error codes of 603Fh",
};

/// All modes of the standard.
pub const MODES: &[ModeOfOperation] = &[
    ModeOfOperation::PROFILE_POSITION,
    ModeOfOperation::VELOCITY,
    ModeOfOperation::PROFILE_VELOCITY,
    ModeOfOperation::PROFILE_TORQUE,
    ModeOfOperation::HOMING,
    ModeOfOperation::INTERPOLATED_POSITION,
    ModeOfOperation::CYCLIC_SYNCHRONOUS_POSITION,
    ModeOfOperation::CYCLIC_SYNCHRONOUS_VELOCITY,
    ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE,
    ModeOfOperation::CYCLIC_SYNCHRONOUS_TORQUE_WITH_COMMUTATION_ANGLE,
];

/// An axis as the standard has it, where it is placed, with its modes: all units are the standard's.
pub const fn axis(placement: Placement, modes: &'static [ModeOfOperation]) -> AxisDescription {
    AxisDescription {
        placement: Placement::FIRST,
        modes,
        mode_display: object::MODES_OF_OPERATION_DISPLAY,
        power: PowerStyle::Cia402,
        new_set_point: NewSetPoint::Handshake,
        statusword_bits: &[],
        interpolation: None,
        homing: Some(HOMING),
        terminals: Terminals::CIA402,
        loops: None,
        max_motor_rpm: None,
        open_loop: None,
        units: UNITS,
    }
    .placed(placement)
}

const SECTIONS: &[Section] =
    &[Section::of(0x1000, 0x1FFF, "CiA 301, 7.5.2"), Section::of(0x6000, 0x9FFF, "CiA 402-2, clauses 8 to 18")];

const HOMING_BITS: u16 = Statusword::HOMING_ATTAINED | Statusword::HOMING_ERROR | Statusword::TARGET_REACHED;

const HOMING: HomingRules = HomingRules {
    method: object::HOMING_METHOD,
    search_speed: Some(Quantity { object: object::SPEED_DURING_SEARCH_FOR_SWITCH, scale: Scale::Positions(1.0) }),
    start: HomingStart::ControlwordBit4,
    attained: BitPattern { mask: HOMING_BITS, value: Statusword::HOMING_ATTAINED | Statusword::TARGET_REACHED },
    failed: BitPattern { mask: HOMING_BITS & !Statusword::TARGET_REACHED, value: Statusword::HOMING_ERROR },
    own_methods: &[],
    switches: Terminals::CIA402,
    remark: "",
};

const UNITS: Units = Units {
    // Feed over gear: position units in a turn of the motor.
    counts_per_turn: CountsPerTurn::Ratio {
        times: [Some(Mux::new(0x6092, 1)), Some(Mux::new(0x6091, 2))],
        over: [Some(Mux::new(0x6092, 2)), Some(Mux::new(0x6091, 1))],
    },
    target_velocity: Some(velocity(0x60FF)),
    actual_velocity: Some(velocity(0x606C)),
    profile_velocity: Some(velocity(0x6081)),
    ramps: Some(Ramps::Rates {
        acceleration: object::PROFILE_ACCELERATION,
        deceleration: object::PROFILE_DECELERATION,
        quick_stop: Some(object::QUICK_STOP_DECELERATION),
        scale: Scale::Positions(1.0),
        none_from: None,
    }),
    target_current: Some(current(0x6071)),
    actual_current: Some(current(0x6078)),
    bus_voltage: Some(Quantity::new(0x6079, 0, 1e-3)),
    motor_temperature: None,
    driver_temperature: None,
};

/// What differs on an axis that turns in velocity mode (vl) alone: its target, what it measures, and its ramps, in r/min of the motor
/// while 604Bh and 604Ch are 1. 6044h and the ramps are scaled by 604Ch alone.
pub const VELOCITY_MODE: (Quantity, Quantity, Ramps) = {
    (
        Quantity {
            object: Mux::new(0x6042, 0),
            scale: Scale::Factors {
                times: [Some(Mux::new(0x604B, 1)), Some(Mux::new(0x604C, 1))],
                over: [Some(Mux::new(0x604B, 2)), Some(Mux::new(0x604C, 2))],
            },
        },
        Quantity {
            object: Mux::new(0x6044, 0),
            scale: Scale::Factors { times: [Some(Mux::new(0x604C, 1)), None], over: [Some(Mux::new(0x604C, 2)), None] },
        },
        Ramps::Rates {
            acceleration: Mux::new(0x6048, 1),
            deceleration: Mux::new(0x6049, 1),
            quick_stop: Some(Mux::new(0x604A, 1)),
            scale: Scale::InTime { times: Some(Mux::new(0x604C, 1)), over: Some(Mux::new(0x604C, 2)) },
            none_from: None,
        },
    )
};

const fn velocity(index: u16) -> Quantity {
    Quantity { object: Mux::new(index, 0), scale: Scale::Positions(1.0) }
}

/// Thousandths of the rated current, which is in mA. A target torque counts as that share of it too.
const fn current(index: u16) -> Quantity {
    Quantity { object: Mux::new(index, 0), scale: Scale::Rated { rated: Mux::new(0x6075, 0), per_count: 1e-6 } }
}
