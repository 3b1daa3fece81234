//! The ZLIM42-C: an integrated open-loop stepper, motor and drive in one, in two lengths (70 and 82 mm) that differ in their
//! motors only.
//!
//! Source: "ZLIM42-C user manual V1.03" (2022-03-03, Chinese; names are translated). Where it contradicts itself or is silent,
//! the choice stands beside the row of [`objects`] or in [`assumptions`], with its reason.

pub mod assumptions;
pub mod faults;
pub mod homing;
pub mod objects;
pub mod statusword;
pub mod tables;
pub mod variations;

use can::Bitrate;
use canopen::{Mux, NodeId};
use cia402::{ModeOfOperation, Statusword, object};

use crate::axis::{AxisDescription, BitPattern, HomingRules, HomingStart, NewSetPoint, PowerStyle};
use crate::description::{Description, HostWatch, NmtRules, Section};
use crate::faults::Faults;
use crate::loops::OpenLoop;
use crate::placement::Placement;
use crate::stated::Stated;
use crate::terminals::{Input, InputSignal, Terminals};
use crate::timing::Timing;
use crate::units::{CountsPerTurn, Quantity, Units};
use crate::zltech;
use faults::FAULTS;
use objects::TABLE;
use statusword::{BIT_4_OF_CONTROLWORD, ENERGISED, HOMING_ATTAINED, IN_POSITION, RUNNING};
use tables::{PEAK_CURRENTS_A, PULSES_PER_TURN, STEP_FREQUENCY_HZ};
use variations::VARIATIONS;

/// The ZLIM42-C of 70 mm.
pub static ZLIM42C: Description = stepper("zlim42c", "ZLTECH ZLIM42-C (70 mm)");

/// The ZLIM42-C of 82 mm.
pub static ZLIM42C_82: Description = stepper("zlim42c-82", "ZLTECH ZLIM42-C (82 mm)");

const fn stepper(name: &'static str, title: &'static str) -> Description {
    Description {
        name,
        title,
        manual: "ZLIM42-C user manual V1.03",
        sections: SECTIONS,
        identity: zltech::IDENTITY,
        // The ZLAC8030L has its bus voltage in 2029h.
        distinguishing_object: Some(Mux::new(0x2069, 0)),
        dictionary: &TABLE,
        node_id: NodeId::new(1),
        bitrate: Some(Bitrate::K500),
        axes: &[AXIS],
        host_watch: HostWatch::None,
        storage: zltech::parameter_storage(0x2010, 0x200C, RESTART, ADDRESS),
        faults: Faults { code: Some(object::ERROR_CODE), bit_field: false, table: &FAULTS, section: "3.4 and 5.4" },
        nmt: NmtRules::CIA_301,
        lss: false,
        sdo_block_transfer: false,
        pdo: zltech::PDO_RULES,
        timing: Timing::GUESSED,
        stated_departures: DEPARTURES,
        variations: VARIATIONS,
        editions: &[],
    }
}

const AXIS: AxisDescription = AxisDescription {
    placement: Placement::FIRST,
    modes: &[ModeOfOperation::PROFILE_POSITION, ModeOfOperation::PROFILE_VELOCITY, ModeOfOperation::HOMING],
    mode_display: object::MODES_OF_OPERATION_DISPLAY,
    power: PowerStyle::Cia402,
    new_set_point: NewSetPoint::Handshake,
    statusword_bits: STATUSWORD_BITS,
    interpolation: None,
    homing: Some(HOMING),
    terminals: TERMINALS,
    loops: None,
    max_motor_rpm: None,
    open_loop: Some(OPEN_LOOP),
    units: UNITS,
};

/// All objects are in one list.
const SECTIONS: &[Section] = &[
    Section::of(0x1000, 0x6FFF, "5.4"),
    // The sibling's manual has the unit.
    Section::stating("pdo_timers", "6.1 of the ZLAC8030L's"),
    Section::stating("homing_shown_by", "5.3.6"),
    Section::stating("status_bit", "5.3.2"),
    Section::stating("warning_bit_in_fault", "5.3.1 and 5.3.2"),
    Section::stating("energised_when_switched_on", "5.3.2"),
];

/// 3.2 and 2030h: each input may be any of these; the drive has no brake.
const TERMINALS: Terminals = Terminals {
    levels: Some(Mux::new(0x2003, 0)),
    polarity: Some(Mux::new(0x2030, 1)),
    inputs: &[input("X0", 0), input("X1", 1), input("X2", 2), input("X3", 3)],
    brake: None,
};

const fn input(name: &'static str, bit: u8) -> Input {
    zltech::input(
        name,
        bit,
        &[
            (1, InputSignal::Home),
            (2, InputSignal::PositiveLimit),
            (3, InputSignal::NegativeLimit),
            (9, InputSignal::EmergencyStop),
        ],
    )
}

const STATUSWORD_BITS: &[(u16, &str)] = &[
    (HOMING_ATTAINED, "homing attained"),
    (BIT_4_OF_CONTROLWORD, "controlword bit 4 set"),
    (ENERGISED, "energised"),
    (RUNNING, "running"),
    (IN_POSITION, "in position"),
];

/// Bits of 5.3.6: at the end 10 is on and 14 off, and 8 shows whether the home position was found.
const AT_THE_END: u16 = HOMING_ATTAINED | Statusword::TARGET_REACHED | RUNNING;

const HOMING: HomingRules = HomingRules {
    method: object::HOMING_METHOD,
    search_speed: Some(Quantity::speed(0x6099, 1, 1.0)),
    start: HomingStart::ControlwordBit4,
    attained: BitPattern { mask: AT_THE_END, value: HOMING_ATTAINED | Statusword::TARGET_REACHED },
    failed: BitPattern { mask: AT_THE_END, value: Statusword::TARGET_REACHED },
    own_methods: &homing::BY_LABEL,
    switches: TERMINALS,
    remark: "The manual's labels and its paragraphs (5.3.6) name opposite directions; this is by the labels.",
};

/// 2.1; 5.3.4 to 5.4. Of microsteps 1.2 says only that they are quiet: from an eighth of a full step on the drive shakes its
/// rotor little (`docs/drives/zlim42c.md`, Smoothness).
const OPEN_LOOP: OpenLoop = OpenLoop {
    current: Mux::new(0x2005, 0),
    currents_a: &PEAK_CURRENTS_A,
    standstill: (Mux::new(0x2007, 0), &[0.5, 1.0]),
    step_frequency_hz: STEP_FREQUENCY_HZ,
    smooth_pulses: 1600,
    start_speed: Quantity::speed(0x200E, 0, 1.0),
    end_speed: Quantity::speed(0x6082, 0, 1.0),
};

const UNITS: Units = Units {
    counts_per_turn: CountsPerTurn::Table { object: Mux::new(0x2006, 0), counts: &PULSES_PER_TURN, default: 10 },
    target_velocity: Some(Quantity::speed(0x60FF, 0, 1.0)),
    actual_velocity: Some(Quantity::speed(0x606C, 0, 1.0)),
    profile_velocity: Some(Quantity::speed(0x6081, 0, 1.0)),
    ramps: Some(zltech::RAMPS),
    target_current: None,
    actual_current: None,
    bus_voltage: Some(Quantity::new(0x2069, 0, 1.0)),
    motor_temperature: None,
    driver_temperature: None,
};

/// Node number and bit rate.
const ADDRESS: &[Mux] = &[Mux::new(0x2008, 0), Mux::new(0x2009, 0)];

const RESTART: &[Mux] = ADDRESS;

const DEPARTURES: &[Stated] = &[
    zltech::WARNING_IN_FAULT,
    Stated {
        key: "no_position_sensor",
        object: object::POSITION_ACTUAL_VALUE,
        what: "6064h and 606Ch are commanded values: nothing measures the rotor, and a stall is not seen",
        remedy: "home again after whatever may have made the motor lose steps",
    },
    Stated {
        key: "energised_when_switched_on",
        object: object::CONTROLWORD,
        what: "the motor is energised from switched on",
        remedy: "go to ready to switch on where the shaft has to be free",
    },
];
