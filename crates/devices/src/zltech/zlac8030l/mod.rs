//! The ZLAC8030L V2.0: a 30 A servo drive for hub motors with Hall sensors and incremental encoder.
//!
//! Source: "ZLAC8030L quick start guide V1.00" (2023-09-11). Where it contradicts itself or is silent, the choice stands beside
//! the row of [`objects`] or in [`assumptions`], with its reason.

pub mod assumptions;
pub mod faults;
pub mod objects;
pub mod statusword;
pub mod variations;

use core::time::Duration;

use can::Bitrate;
use canopen::od::Table;
use canopen::pdo::MappingRules;
use canopen::{Mux, NodeId};
use cia402::{ModeOfOperation, object};

use crate::axis::{AxisDescription, NewSetPoint, PowerStyle};
use crate::description::{Description, Edition, HostWatch, NmtRules, PdoRules, Section};
use crate::faults::Faults;
use crate::loops::{Integral, Loops};
use crate::placement::Placement;
use crate::stated::Stated;
use crate::terminals::{BrakeOutput, Input, InputSignal, Terminals};
use crate::timing::Timing;
use crate::units::{CountsPerTurn, Quantity, Units};
use crate::variant::Pick;
use crate::zltech;
use faults::FAULTS;
use objects::{TABLE, TABLE_2_01};
use statusword::{EXTERNAL_STOP, IN_POSITION, RUNNING};
use variations::VARIATIONS;

/// The ZLAC8030L V2.0.
pub static ZLAC8030L: Description = Description {
    editions: &[Edition { pick: Pick::of(VARIATIONS, "firmware", "2.01"), description: &ZLAC8030L_2_01 }],
    ..described(&TABLE)
};

/// The same with firmware 2.01.
pub static ZLAC8030L_2_01: Description = described(&TABLE_2_01);

const fn described(dictionary: &'static Table) -> Description {
    Description {
        name: "zlac8030l",
        title: "ZLTECH ZLAC8030L V2.0",
        manual: "ZLAC8030L quick start guide V1.00",
        sections: SECTIONS,
        identity: zltech::IDENTITY,
        // The ZLIM42-C, of the same identity, has its bus voltage in 2069h.
        distinguishing_object: Some(Mux::new(0x2029, 0)),
        dictionary,
        node_id: NodeId::new(4),
        bitrate: Some(Bitrate::K500),
        axes: &[AXIS],
        host_watch: HostWatch::Silence { time: Mux::new(0x2000, 0) },
        storage: zltech::parameter_storage(0x2009, 0x2010, RESTART, ADDRESS),
        faults: Faults { code: Some(object::ERROR_CODE), bit_field: true, table: &FAULTS, section: "chapters 8 and 9" },
        nmt: NmtRules::CIA_301,
        lss: false,
        sdo_block_transfer: false,
        pdo: PDO_RULES,
        timing: Timing::GUESSED,
        stated_departures: DEPARTURES,
        variations: VARIATIONS,
        editions: &[],
    }
}

const AXIS: AxisDescription = AxisDescription {
    placement: Placement::FIRST,
    modes: &[ModeOfOperation::PROFILE_POSITION, ModeOfOperation::PROFILE_VELOCITY, ModeOfOperation::PROFILE_TORQUE],
    mode_display: object::MODES_OF_OPERATION_DISPLAY,
    power: PowerStyle::Cia402,
    new_set_point: NewSetPoint::Handshake,
    statusword_bits: &[(IN_POSITION, "in position"), (RUNNING, "running"), (EXTERNAL_STOP, "external stop")],
    interpolation: None,
    homing: None,
    terminals: TERMINALS,
    units: Units {
        counts_per_turn: CountsPerTurn::Object { object: Mux::new(0x200B, 0), factor: 4 },
        target_velocity: Some(Quantity::speed(0x60FF, 0, 1.0)),
        actual_velocity: Some(Quantity::speed(0x606C, 0, 0.1)),
        profile_velocity: Some(Quantity::speed(0x6081, 0, 1.0)),
        ramps: Some(zltech::RAMPS),
        target_current: Some(Quantity::new(0x6071, 0, 1e-3)),
        actual_current: Some(Quantity::new(0x6077, 0, 0.1)),
        bus_voltage: Some(Quantity::new(0x2029, 0, 0.01)),
        motor_temperature: Some(Quantity::new(0x2026, 1, 0.1)),
        driver_temperature: Some(Quantity::new(0x2026, 2, 0.1)),
    },
    loops: Some(LOOPS),
    max_motor_rpm: None,
    open_loop: None,
};

/// Chapter 9: 6074h is printed as "real-time target torque", 2018h to 2020h without units. Those
/// that stand here, and the period, are assumed (`drives::zlac8030l::gains`).
const LOOPS: Loops = Loops {
    demand: Some(Quantity::new(0x6074, 0, 1e-3)),
    speed_proportional: Mux::new(0x201D, 0),
    speed_integral: Integral::Gain(Mux::new(0x201E, 0)),
    speed_filter: Some(Quantity::new(0x2018, 0, 1e-6)),
    position_proportional: Some(Quantity::new(0x2020, 0, 0.2)),
    current: Some((Quantity::new(0x2019, 0, 1e-3), Quantity::new(0x201A, 0, 1.0))),
    without_ramps: &[(Mux::new(0x6083, 0), 0), (Mux::new(0x6084, 0), 0)],
    period: Duration::from_micros(500),
    stated: None,
    gain_step: 1,
    usual_rpm: 120.0,
    usual_a: 15.0,
    torque_constant_nm_a: None,
    rated: None,
};

/// All objects are in one list.
const SECTIONS: &[Section] = &[
    Section::of(0x1000, 0x6FFF, "chapter 9"),
    Section::stating("pdo_timers", "6.1"),
    Section::stating("status_bit", "chapter 7"),
    Section::stating("warning_bit_in_fault", "both siblings' manuals"),
];

/// Chapter 5 and 2030h: of the functions of X0 and X1 only 9 stops the motor; B0 holds it with 1.
const TERMINALS: Terminals = Terminals {
    levels: Some(Mux::new(0x2003, 0)),
    polarity: Some(Mux::new(0x2030, 1)),
    inputs: &[input("X0", 0), input("X1", 1)],
    brake: Some(BrakeOutput { name: "B0", object: Mux::new(0x2030, 0x0E), bit: 0, mask: None }),
};

const fn input(name: &'static str, bit: u8) -> Input {
    zltech::input(name, bit, &[(9, InputSignal::EmergencyStop)])
}

/// Working robots map 6077h with 32 bits; the maker's EDS counts empty entries in.
const PDO_RULES: PdoRules = PdoRules {
    mapping: MappingRules {
        longer_entries: true,
        empty_entries: true,
        dummy_entries: 0,
        tpdo_forms: &[],
        multiplexed: false,
    },
    ..zltech::PDO_RULES
};

/// CAN node number and bit rate.
const ADDRESS: &[Mux] = &[Mux::new(0x200D, 0), Mux::new(0x200E, 0)];

const RESTART: &[Mux] = &[Mux::new(0x200D, 0), Mux::new(0x200E, 0), Mux::new(0x202F, 5)];

const DEPARTURES: &[Stated] = &[
    Stated {
        key: "device_type_says_stepper",
        object: Mux::new(0x1000, 0),
        what: "bits 16 to 23 say stepper though the motor is a servo",
        remedy: "do not choose by the type of motor in 1000h",
    },
    zltech::WARNING_IN_FAULT,
    Stated {
        key: "brake_is_manual",
        object: Mux::new(0x2030, 0x0E),
        what: "the drive never moves the brake output by itself",
        remedy: "open the brake with 0 before the motor is to turn, and close it with 1 when it stands",
    },
];
