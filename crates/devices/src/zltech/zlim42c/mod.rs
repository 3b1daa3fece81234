//! The ZLIM42-C: an integrated open-loop stepper, motor and drive in one, in two lengths (70 and 82 mm) that differ in their
//! motors only.
//!
//! Source: "ZLIM42-C user manual V1.03" (2022-03-03, Chinese; names are translated). Where it contradicts itself or is silent,
//! the choice stands beside the row of [`objects`] or in [`assumptions`], with its reason.

pub mod assumptions;
pub mod faults;
pub mod objects;
pub mod statusword;
pub mod tables;
pub mod variations;

use can::Bitrate;
use canopen::Mux;
use cia402::{ModeOfOperation, Statusword};

use crate::description::{
    BitPattern, CountsPerTurn, Description, Faults, HomingRules, HomingStart, HostWatch, PowerStyle, Quantity, Quirk,
    Units,
};
use crate::zltech;
use faults::FAULTS;
use objects::TABLE;
use statusword::{BIT_4_OF_CONTROLWORD, ENERGISED, HOMING_ATTAINED, IN_POSITION, RUNNING};
use tables::PULSES_PER_TURN;
use variations::VARIATIONS;

/// The ZLIM42-C of 70 mm.
pub static ZLIM42C: Description = stepper("zlim42c", "ZLTECH ZLIM42-C (70 mm)");

/// The ZLIM42-C of 82 mm.
pub static ZLIM42C_82: Description = stepper("zlim42c-82", "ZLTECH ZLIM42-C (82 mm)");

const fn stepper(model: &'static str, title: &'static str) -> Description {
    Description {
        model,
        title,
        manual: "ZLIM42-C user manual V1.03",
        identity: zltech::IDENTITY,
        // The ZLAC8030L has its bus voltage in 2029h.
        hallmark: Some(Mux::new(0x2069, 0)),
        table: &TABLE,
        node_id: 1,
        bitrate: Bitrate::K500,
        modes: &[ModeOfOperation::PROFILE_POSITION, ModeOfOperation::PROFILE_VELOCITY, ModeOfOperation::HOMING],
        mode_display: Mux::new(0x6061, 0),
        power: PowerStyle::Cia402,
        statusword_bits: STATUSWORD_BITS,
        homing: Some(HOMING),
        host_watch: HostWatch::None,
        units: UNITS,
        storage: zltech::parameter_storage(0x2010, 0x200C, RESTART),
        faults: Faults { code: Mux::new(0x603F, 0), bit_field: false, table: &FAULTS },
        pdo: zltech::PDO_RULES,
        quirks: QUIRKS,
        variations: VARIATIONS,
    }
}

const STATUSWORD_BITS: &[(u16, &str)] = &[
    (HOMING_ATTAINED, "homing attained"),
    (BIT_4_OF_CONTROLWORD, "controlword bit 4 set"),
    (ENERGISED, "energised"),
    (RUNNING, "running"),
    (IN_POSITION, "in position"),
];

/// Bits of 5.3.6: at the end 10 is on and 14 off, and 8 tells whether the home position was found.
const AT_THE_END: u16 = HOMING_ATTAINED | Statusword::TARGET_REACHED | RUNNING;

const HOMING: HomingRules = HomingRules {
    method: Mux::new(0x6098, 0),
    search_speed: Some(Quantity::new(0x6099, 1, 1.0)),
    start: HomingStart::ControlwordBit4,
    attained: BitPattern { mask: AT_THE_END, value: HOMING_ATTAINED | Statusword::TARGET_REACHED },
    failed: BitPattern { mask: AT_THE_END, value: Statusword::TARGET_REACHED },
};

const UNITS: Units = Units {
    counts_per_turn: CountsPerTurn::Table { object: Mux::new(0x2006, 0), counts: &PULSES_PER_TURN, default: 10 },
    target_velocity: Quantity::new(0x60FF, 0, 1.0),
    actual_velocity: Quantity::new(0x606C, 0, 1.0),
    profile_velocity: Quantity::new(0x6081, 0, 1.0),
    ramps: zltech::RAMPS,
    target_current: None,
    actual_current: None,
    bus_voltage: Some(Quantity::new(0x2069, 0, 1.0)),
    motor_temperature: None,
    driver_temperature: None,
};

const RESTART: &[Mux] = &[Mux::new(0x2008, 0), Mux::new(0x2009, 0)];

const QUIRKS: &[Quirk] = &[
    Quirk::NoSupportedDriveModes,
    Quirk::NoStandardStore,
    Quirk::NoErrorHistory,
    Quirk::NoHeartbeatConsumer,
    Quirk::IdentityShared,
    Quirk::RampsAreTimes,
    Quirk::PdoTimersInHalfMilliseconds,
    Quirk::SubIndexZeroIsUnsigned16,
    Quirk::VersionsAreNumbers,
    Quirk::InPositionInBit15,
    Quirk::WarningBitInFault,
    Quirk::NoPositionSensor,
    Quirk::EnergisedWhenSwitchedOn,
    Quirk::HomingAttainedInBit8,
    Quirk::BitRateWhereSiblingSaves,
];
