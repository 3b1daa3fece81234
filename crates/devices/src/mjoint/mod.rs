//! The M-series robot joint motors M4230E17B50, M4230E17B80, M8025E25B50 and M8025E25B80: a servo motor with its drive,
//! a multi-turn absolute encoder on a battery, and a reducer. To a host the four are alike but for their names.
//!
//! Source: "M Robot Joint Motor CanOpen Manual" (Zhengzhou Defy Mechanical & Electrical Equipment). Where it contradicts itself
//! or is silent, the choice stands beside the row of [`objects`] or in [`assumptions`], with its reason.

pub mod alarms;
pub mod assumptions;
pub mod objects;
pub mod statusword;
pub mod variations;

use core::time::Duration;

use can::Bitrate;
use canopen::od::DataType;
use canopen::pdo::{EventTrigger, MappingRules, TpdoForm};
use canopen::{Mux, NmtState, NodeId};
use cia402::{ModeOfOperation, Statusword, object};

use crate::axis::{AxisDescription, BitPattern, HomingRules, HomingStart, NewSetPoint, PowerStyle};
use crate::description::{
    Description, Edition, HostWatch, Identity, NmtRules, ParameterStorage, PdoRules, Section, Write,
};
use crate::faults::Faults;
use crate::loops::{Integral, Loops, StatedLoop};
use crate::placement::Placement;
use crate::terminals::{Input, InputSignal, Meaning, Terminals};
use crate::timing::Timing;
use crate::units::{CountsPerTurn, Quantity, Ramps, Scale, Units};
use crate::variant::Pick;
use alarms::ALARMS;
use assumptions::{COUNTS_PER_TURN, NO_RAMP_FROM};
use objects::{TABLE, TABLE_1_66};
use statusword::{HOMING_ATTAINED, HOMING_ERROR, LIVE};
use variations::VARIATIONS;

/// A model, and what it is with firmware 1.66.
macro_rules! joints {
    ($($(#[$what:meta])* $joint:ident, $edition:ident = $name:literal, $title:literal, $axes:ident;)*) => {$(
        $(#[$what])*
        pub static $joint: Description = Description {
            editions: &[Edition { pick: Pick::of(VARIATIONS, "firmware", "1.66"), description: &$edition }],
            ..joint($name, $title, $axes)
        };
        /// The same with firmware 1.66.
        pub static $edition: Description = Description {
            dictionary: &TABLE_1_66,
            pdo: PdoRules { fixed_mapping: false, ..PDO_RULES },
            ..joint($name, $title, $axes)
        };
    )*};
}

joints! {
    /// The M4230E17B50.
    M4230E17B50, M4230E17B50_1_66 = "m4230e17b50", "M4230E17B50 joint motor", M4230_AXES;
    /// The M4230E17B80.
    M4230E17B80, M4230E17B80_1_66 = "m4230e17b80", "M4230E17B80 joint motor", M4230_AXES;
    /// The M8025E25B50.
    M8025E25B50, M8025E25B50_1_66 = "m8025e25b50", "M8025E25B50 joint motor", M8025_AXES;
    /// The M8025E25B80.
    M8025E25B80, M8025E25B80_1_66 = "m8025e25b80", "M8025E25B80 joint motor", M8025_AXES;
}

/// Highest speed of the motor of the M4230, r/min ("Parameters": 2000).
pub const M4230_MAX_RPM: f64 = 2000.0;

/// Highest speed of the motor of the M8025, r/min ("Parameters": 1500, which is 30 r/min behind a gear of 50).
pub const M8025_MAX_RPM: f64 = 1500.0;

const M4230_AXES: &[AxisDescription] = &[AxisDescription { max_motor_rpm: Some(M4230_MAX_RPM), ..AXIS }];
const M8025_AXES: &[AxisDescription] = &[AxisDescription { max_motor_rpm: Some(M8025_MAX_RPM), ..AXIS }];

const fn joint(name: &'static str, title: &'static str, axes: &'static [AxisDescription]) -> Description {
    Description {
        name,
        title,
        manual: "M Robot Joint Motor CanOpen Manual",
        sections: SECTIONS,
        identity: Identity { device_type: 0x0002_0192, vendor_id: 0x331, product_code: 1, revision_number: 0x100 },
        // The four models of the identity have the same objects.
        distinguishing_object: None,
        dictionary: &TABLE,
        node_id: NodeId::new(1),
        bitrate: Some(Bitrate::M1),
        axes,
        host_watch: HostWatch::Heartbeat { consumer: Mux::new(0x1016, 1), fault: 0x20 },
        storage: STORAGE,
        faults: Faults {
            code: Some(Mux::new(0x260E, 0)),
            bit_field: false,
            table: &ALARMS,
            section: "Status indication and alarm",
        },
        nmt: NmtRules { start_state: NmtState::Operational, heartbeat_tells_alarm: true },
        lss: false,
        sdo_block_transfer: false,
        pdo: PDO_RULES,
        timing: Timing::GUESSED,
        stated_departures: &[],
        variations: VARIATIONS,
        editions: &[],
    }
}

/// 606Ch in TPDO3: 32 bits of r/min (5.10.2), of the 16 bits of 0.1 r/min that SDO shows (5.04).
static IN_TPDO: [TpdoForm; 1] =
    [TpdoForm { object: object::VELOCITY_ACTUAL_VALUE, data_type: DataType::Integer32, unit: "r/min", divisor: 10 }];

const AXIS: AxisDescription = AxisDescription {
    placement: Placement::FIRST,
    modes: &[
        ModeOfOperation::PROFILE_POSITION,
        ModeOfOperation::PROFILE_VELOCITY,
        ModeOfOperation::HOMING,
        ModeOfOperation::INTERPOLATED_POSITION,
    ],
    mode_display: object::MODES_OF_OPERATION,
    power: PowerStyle::EchoesControlword { following: 0b10_0111, live: LIVE, alarm: Statusword::FAULT },
    new_set_point: NewSetPoint::ClearsItself,
    statusword_bits: STATUSWORD_BITS,
    // "The interpolation cycle is completed every 2ms" (5.10.3).
    interpolation: Some(Duration::from_millis(2)),
    homing: Some(HOMING),
    terminals: Terminals::NONE,
    loops: Some(LOOPS),
    max_motor_rpm: None,
    open_loop: None,
    units: UNITS,
};

/// 5.04 prints the gains' ranges, and of units those of the integral time alone. What a count is worth is assumed, as are filter and
/// delays (`drives::mjoint::gains`): the window and the hold of a period, the current loop's 3000 rad/s. The ones digits of 60F9h:01
/// and 60FBh:01 choose the polarities of an input and an output.
const LOOPS: Loops = Loops {
    demand: None,
    speed_proportional: Mux::new(0x60F9, 1),
    speed_integral: Integral::Time(Mux::new(0x60F9, 2)),
    speed_filter: None,
    position_proportional: Some(Quantity::new(0x60FB, 1, 0.02)),
    current: None,
    without_ramps: &[(object::PROFILE_ACCELERATION, NO_RAMP_FROM as i64)],
    period: Duration::from_micros(500),
    stated: Some(StatedLoop {
        a_s_rad: 0.2 / 3000.0,
        integral_s: 1e-3,
        filter_s: 0.2e-3,
        late_s: 0.25e-3 + 0.25e-3 + 1.0 / 3000.0,
        amplitude: core::f64::consts::SQRT_2,
    }),
    gain_step: 10,
    usual_rpm: 600.0,
    usual_a: 15.0,
    torque_constant_nm_a: None,
    rated: None,
};

const STORAGE: ParameterStorage = ParameterStorage {
    save: Some(Write { object: Mux::new(0x2614, 0), value: 1 }),
    // "1: Save the parameters. 2: Finish storage." (5.04)
    saved: Some(2),
    restore: None,
    save_on_write: None,
    effective_after_restart: &[Mux::new(0x2615, 0), Mux::new(0x2619, 0)],
    address: &[Mux::new(0x2615, 0)],
};

/// The mapping is fixed; an identifier may be changed at any time, since no bit of it makes a PDO invalid (5.08).
const PDO_RULES: PdoRules = PdoRules {
    inhibit_unit_ns: 100_000,
    event_timer_unit_ns: 1_000_000,
    rpdo_deadline: false,
    max_objects: 3,
    // The manual is silent; CiA advises against remote frames (application note 802).
    remote_requests: false,
    remap_while_valid: true,
    fixed_mapping: true,
    first_in_manual: 1,
    mapping: MappingRules { dummy_entries: 0, tpdo_forms: &IN_TPDO, multiplexed: false, ..MappingRules::CIA_301 },
    event_trigger: EventTrigger::AnswersRpdo,
    // It has no EMCY.
    short_rpdo: None,
};

/// The lists of 5.04 and 5.08. 1001h is not printed; CiA 301 has it.
const SECTIONS: &[Section] = &[
    Section::of(0x1000, 0x1000, "5.04 device"),
    Section::of(0x1001, 0x1001, "CiA 301"),
    Section::of(0x1005, 0x1005, "5.04 device"),
    Section::of(0x1016, 0x1017, "5.04 heartbeat"),
    Section::of(0x1018, 0x1018, "5.04 device"),
    Section::of(0x1400, 0x1603, "5.08.2"),
    Section::of(0x1800, 0x1A03, "5.08.3"),
    Section::of(0x2600, 0x60FF, "5.04 control"),
    // What is not there stands in none of them.
    Section::stating("no_error_history", "5.04"),
    Section::stating("no_store_parameters", "5.04, 2614h"),
    Section::stating("no_emcy", "5.04; Status indication and alarm"),
    Section::stating("no_supported_drive_modes", "5.04"),
    Section::stating("starts_operational", "5.11.1"),
    Section::stating("heartbeat_tells_alarm", "5.11.1"),
    Section::stating("tpdo_answers_rpdo", "5.08, 5.10"),
    Section::stating("new_set_point_clears_itself", "note at 5.06.2"),
    Section::stating("homing_starts_with_mode", "5.09"),
];

/// Bits of 5.04 as the examples show them.
const STATUSWORD_BITS: &[(u16, &str)] = &[
    (0b11, "follows its host"),
    (1 << 2, "output enabled"),
    (Statusword::FAULT, "alarm"),
    (LIVE, "power stage live"),
    (1 << 5, "no quick stop"),
    (Statusword::TARGET_REACHED, "target reached"),
    (HOMING_ATTAINED, "homing attained"),
    (HOMING_ERROR, "homing error"),
];

const HOMING_METHOD: Mux = object::HOMING_METHOD;

const HOMING: HomingRules = HomingRules {
    method: HOMING_METHOD,
    search_speed: None,
    start: HomingStart::ModeWrite,
    attained: BitPattern { mask: HOMING_ATTAINED | HOMING_ERROR, value: HOMING_ATTAINED },
    failed: BitPattern { mask: HOMING_ATTAINED | HOMING_ERROR, value: HOMING_ERROR },
    own_methods: &[],
    switches: SWITCHES,
    remark: "It has one speed for the whole run, and the manual does not say where that is set (5.09).",
};

/// PU and DIR are switches to homing alone, each to the methods that look for it (5.09). Their bits in 60FDh are a guess.
const SWITCHES: Terminals = Terminals {
    levels: Some(Mux::new(0x60FD, 0)),
    inputs: &[
        Input { name: "PU", bit: 0, meaning: by_method(&[(18, InputSignal::PositiveLimit)]) },
        Input {
            name: "DIR",
            bit: 1,
            meaning: by_method(&[
                (17, InputSignal::NegativeLimit),
                (19, InputSignal::Home),
                (20, InputSignal::Home),
                (21, InputSignal::Home),
                (22, InputSignal::Home),
            ]),
        },
    ],
    ..Terminals::NONE
};

const fn by_method(signals: &'static [(i64, InputSignal)]) -> Meaning {
    Meaning::Chosen { function: HOMING_METHOD, signals }
}

const UNITS: Units = Units {
    counts_per_turn: CountsPerTurn::Fixed(COUNTS_PER_TURN),
    target_velocity: Some(Quantity::speed(0x60FF, 0, 1.0)),
    actual_velocity: Some(Quantity::speed(0x606C, 0, 0.1)),
    profile_velocity: Some(Quantity::speed(0x6081, 0, 1.0)),
    ramps: Some(Ramps::Rates {
        acceleration: object::PROFILE_ACCELERATION,
        deceleration: object::PROFILE_ACCELERATION,
        quick_stop: None,
        scale: Scale::Shaft(1.0),
        none_from: Some(NO_RAMP_FROM),
    }),
    target_current: None,
    actual_current: Some(Quantity::new(0x6078, 0, 1.0 / 2000.0)),
    bus_voltage: Some(Quantity::new(0x6079, 0, 1.0 / 327.0)),
    motor_temperature: None,
    driver_temperature: Some(Quantity::new(0x2612, 0, 1.0)),
};
