//! The ZLAC8030L V2.0: a 30 A servo drive for hub motors with Hall sensors and incremental encoder.
//!
//! Source: "ZLAC8030L quick start guide V1.00" (2023-09-11). Where it contradicts itself or is silent, the choice stands beside
//! the row of [`objects`] or in [`assumptions`], with its reason.

pub mod assumptions;
pub mod faults;
pub mod objects;
pub mod statusword;
pub mod variations;

use can::Bitrate;
use canopen::Mux;
use canopen::pdo::MappingRules;
use cia402::ModeOfOperation;

use crate::description::{CountsPerTurn, Description, Faults, HostWatch, PdoRules, PowerStyle, Quantity, Quirk, Units};
use crate::zltech;
use faults::FAULTS;
use objects::TABLE;
use statusword::{EXTERNAL_STOP, IN_POSITION, RUNNING};
use variations::VARIATIONS;

/// The ZLAC8030L V2.0.
pub static ZLAC8030L: Description = Description {
    model: "zlac8030l",
    title: "ZLTECH ZLAC8030L V2.0",
    manual: "ZLAC8030L quick start guide V1.00",
    identity: zltech::IDENTITY,
    // The ZLIM42-C, of the same identity, has its bus voltage in 2069h.
    hallmark: Some(Mux::new(0x2029, 0)),
    table: &TABLE,
    node_id: 4,
    bitrate: Bitrate::K500,
    modes: &[ModeOfOperation::PROFILE_POSITION, ModeOfOperation::PROFILE_VELOCITY, ModeOfOperation::PROFILE_TORQUE],
    mode_display: Mux::new(0x6061, 0),
    power: PowerStyle::Cia402,
    statusword_bits: &[(IN_POSITION, "in position"), (RUNNING, "running"), (EXTERNAL_STOP, "external stop")],
    homing: None,
    host_watch: HostWatch::Silence { time: Mux::new(0x2000, 0) },
    units: Units {
        counts_per_turn: CountsPerTurn::Object { object: Mux::new(0x200B, 0), factor: 4, default: 1024 },
        target_velocity: Quantity::new(0x60FF, 0, 1.0),
        actual_velocity: Quantity::new(0x606C, 0, 0.1),
        profile_velocity: Quantity::new(0x6081, 0, 1.0),
        ramps: zltech::RAMPS,
        target_current: Some(Quantity::new(0x6071, 0, 1e-3)),
        actual_current: Some(Quantity::new(0x6077, 0, 0.1)),
        bus_voltage: Some(Quantity::new(0x2029, 0, 0.01)),
        motor_temperature: Some(Quantity::new(0x2026, 1, 0.1)),
        driver_temperature: Some(Quantity::new(0x2026, 2, 0.1)),
    },
    storage: zltech::parameter_storage(0x2009, 0x2010, RESTART),
    faults: Faults { code: Mux::new(0x603F, 0), bit_field: true, table: &FAULTS },
    pdo: PDO_RULES,
    quirks: QUIRKS,
    variations: VARIATIONS,
};

/// Working robots map 6077h with 32 bits; the maker's EDS counts empty entries in.
const PDO_RULES: PdoRules = PdoRules {
    mapping: MappingRules { longer_entries: true, empty_entries: true, tpdo_forms: &[] },
    ..zltech::PDO_RULES
};

const RESTART: &[Mux] = &[Mux::new(0x200D, 0), Mux::new(0x200E, 0), Mux::new(0x202F, 5)];

const QUIRKS: &[Quirk] = &[
    Quirk::NoSupportedDriveModes,
    Quirk::NoStandardStore,
    Quirk::NoErrorHistory,
    Quirk::NoHeartbeatConsumer,
    Quirk::DeviceTypeSaysStepper,
    Quirk::IdentityShared,
    Quirk::TorqueTargetIsCurrent,
    Quirk::TorqueActualIsCurrent,
    Quirk::VelocityUnitsDiffer,
    Quirk::RampsAreTimes,
    Quirk::PdoTimersInHalfMilliseconds,
    Quirk::SubIndexZeroIsUnsigned16,
    Quirk::VersionsAreNumbers,
    Quirk::InPositionInBit13,
    Quirk::WarningBitInFault,
    Quirk::HostWatchdogOnByDefault,
    Quirk::BrakeIsManual,
];
