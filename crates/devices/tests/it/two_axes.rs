//! Two axes on one node, as the standard has them and as makers of two-wheel drives do: both are descriptions like any other.

use canopen::Mux;
use canopen::od::{Entry, Index, Table};
use cia402::ModeOfOperation;
use devices::name;
use devices::row::{I8, I16, I32, U16, U32, ro, rw};
use devices::servo::{CIA402, axis};
use devices::{AxisDescription, CountsPerTurn, Description, Placement, Quantity, Ramps, Units};

const MODES: &[ModeOfOperation] = &[ModeOfOperation::PROFILE_VELOCITY];

/// What both kinds have at each of their axes.
const AXIS: AxisDescription = AxisDescription {
    interpolation: None,
    homing: None,
    units: Units {
        counts_per_turn: CountsPerTurn::Fixed(4096),
        target_velocity: Some(Quantity::speed(0x60FF, 0, 1.0)),
        actual_velocity: Some(Quantity::speed(0x606C, 0, 0.1)),
        profile_velocity: None,
        ramps: Some(Ramps::Times {
            acceleration: Mux::new(0x6083, 0),
            deceleration: Mux::new(0x6084, 0),
            quick_stop: Mux::new(0x6085, 0),
        }),
        target_current: None,
        actual_current: Some(Quantity::new(0x6077, 0, 0.1)),
        bus_voltage: Some(Quantity::new(0x2035, 0, 0.01)),
        motor_temperature: None,
        driver_temperature: None,
    },
    ..axis(Placement::FIRST, MODES)
};

/// CiA 402: the second axis is 800h further on; the supply is the device's.
static BY_INDEX_ROWS: [Entry; 22] = [
    ro(0x1000, 0, U32, name!("Device type")).default(0x0002_0192),
    ro(0x2035, 0, U16, name!("Bus voltage")).unit("0.01 V"),
    rw(0x6040, 0, U16, name!("Controlword")),
    ro(0x6041, 0, U16, name!("Statusword")),
    rw(0x6060, 0, I8, name!("Modes of operation")),
    ro(0x6061, 0, I8, name!("Modes of operation display")),
    ro(0x606C, 0, I32, name!("Velocity actual value")).unit("0.1 r/min"),
    ro(0x6077, 0, I16, name!("Torque actual value")).unit("0.1 A"),
    rw(0x6083, 0, U32, name!("Acceleration time", "profile acceleration")).unit("ms"),
    rw(0x6084, 0, U32, name!("Deceleration time", "profile deceleration")).unit("ms"),
    rw(0x6085, 0, U32, name!("Quick stop time", "quick stop deceleration")).unit("ms"),
    rw(0x60FF, 0, I32, name!("Target velocity")).unit("r/min"),
    rw(0x6840, 0, U16, name!("Controlword", "controlword 2")),
    ro(0x6841, 0, U16, name!("Statusword", "statusword 2")),
    rw(0x6860, 0, I8, name!("Modes of operation", "modes of operation 2")),
    ro(0x6861, 0, I8, name!("Modes of operation display", "modes of operation display 2")),
    ro(0x686C, 0, I32, name!("Velocity actual value", "velocity actual value 2")).unit("0.1 r/min"),
    ro(0x6877, 0, I16, name!("Torque actual value", "torque actual value 2")).unit("0.1 A"),
    rw(0x6883, 0, U32, name!("Acceleration time", "profile acceleration 2")).unit("ms"),
    rw(0x6884, 0, U32, name!("Deceleration time", "profile deceleration 2")).unit("ms"),
    rw(0x6885, 0, U32, name!("Quick stop time", "quick stop deceleration 2")).unit("ms"),
    rw(0x68FF, 0, I32, name!("Target velocity", "target velocity 2")).unit("r/min"),
];
static BY_INDEX_INDEX: Index<22> = Index::of(&BY_INDEX_ROWS);
static BY_INDEX_TABLE: Table = Table::new(&BY_INDEX_ROWS, &BY_INDEX_INDEX);
static BY_INDEX: Description = Description {
    name: "two_axes",
    dictionary: &BY_INDEX_TABLE,
    axes: &[AXIS, AXIS.placed(Placement::IndexOffset(0x800))],
    ..CIA402
};

/// A maker's way: left at sub-index 01h and right at 02h, one controlword, statusword and mode for both.
const SHARED: &[u16] = &[0x6040, 0x6041, 0x6060, 0x6061];
static BY_SUB_INDEX_ROWS: [Entry; 18] = [
    ro(0x1000, 0, U32, name!("Device type")).default(0x0002_0192),
    ro(0x2035, 0, U16, name!("Bus voltage")).unit("0.01 V"),
    rw(0x6040, 0, U16, name!("Controlword")),
    ro(0x6041, 0, U16, name!("Statusword")),
    rw(0x6060, 0, I8, name!("Modes of operation")),
    ro(0x6061, 0, I8, name!("Modes of operation display")),
    ro(0x606C, 1, I32, name!("Velocity actual value", "velocity actual value left")).unit("0.1 r/min"),
    ro(0x606C, 2, I32, name!("Velocity actual value", "velocity actual value right")).unit("0.1 r/min"),
    ro(0x6077, 1, I16, name!("Torque actual value", "torque actual value left")).unit("0.1 A"),
    ro(0x6077, 2, I16, name!("Torque actual value", "torque actual value right")).unit("0.1 A"),
    rw(0x6083, 1, U32, name!("Acceleration time", "profile acceleration left")).unit("ms"),
    rw(0x6083, 2, U32, name!("Acceleration time", "profile acceleration right")).unit("ms"),
    rw(0x6084, 1, U32, name!("Deceleration time", "profile deceleration left")).unit("ms"),
    rw(0x6084, 2, U32, name!("Deceleration time", "profile deceleration right")).unit("ms"),
    rw(0x6085, 1, U32, name!("Quick stop time", "quick stop deceleration left")).unit("ms"),
    rw(0x6085, 2, U32, name!("Quick stop time", "quick stop deceleration right")).unit("ms"),
    rw(0x60FF, 1, I32, name!("Target velocity", "target velocity left")).unit("r/min"),
    rw(0x60FF, 2, I32, name!("Target velocity", "target velocity right")).unit("r/min"),
];
static BY_SUB_INDEX_INDEX: Index<18> = Index::of(&BY_SUB_INDEX_ROWS);
static BY_SUB_INDEX_TABLE: Table = Table::new(&BY_SUB_INDEX_ROWS, &BY_SUB_INDEX_INDEX);
static BY_SUB_INDEX: Description = Description {
    name: "two_wheels",
    dictionary: &BY_SUB_INDEX_TABLE,
    axes: &[
        AXIS.placed(Placement::SubIndex { sub_index: 1, shared: SHARED }),
        AXIS.placed(Placement::SubIndex { sub_index: 2, shared: SHARED }),
    ],
    ..CIA402
};

/// Every object that the axis names.
fn named(axis: &AxisDescription) -> Vec<Mux> {
    let units = &axis.units;
    let quantities = [units.target_velocity, units.actual_velocity, units.actual_current, units.bus_voltage];
    let mut named: Vec<Mux> = quantities.into_iter().flatten().map(|quantity| quantity.object).collect();
    let Some(Ramps::Times { acceleration, deceleration, quick_stop }) = units.ramps else { panic!("ramps are times") };
    named.extend([acceleration, deceleration, quick_stop, axis.mode_display]);
    named.extend([0x6040, 0x6041, 0x6060].map(|index| axis.object(Mux::new(index, 0))));
    named
}

#[test]
fn every_object_that_an_axis_names_is_in_the_dictionary_and_each_axis_has_its_own() {
    for (description, in_common) in [(&BY_INDEX, 1), (&BY_SUB_INDEX, 5)] {
        let [first, second] = description.axes else { panic!("{} has two axes", description.name) };
        let (first, second) = (named(first), named(second));
        for object in first.iter().chain(&second) {
            assert!(description.row(*object).is_some(), "{}: {object}", description.name);
        }
        let shared = first.iter().filter(|object| second.contains(object)).count();
        assert_eq!(shared, in_common, "{}", description.name);
    }
}

#[test]
fn an_object_of_both_axes_means_the_same_at_both() {
    for description in [&BY_INDEX, &BY_SUB_INDEX] {
        let [first, second] = description.axes else { panic!("{} has two axes", description.name) };
        for (one, other) in named(first).into_iter().zip(named(second)) {
            let form = |mux| description.row(mux).map(|row| (row.title, row.data_type, row.unit, row.access));
            assert_eq!(form(one), form(other), "{one} and {other}");
        }
    }
}

#[test]
fn departures_name_the_objects_of_the_axis_that_departs() {
    let ramps = |description: &Description| {
        let departures = description.departures(devices::all());
        let of_ramps = departures.filter(|departure| departure.key() == "ramps_are_times");
        of_ramps.filter_map(|departure| departure.object()).collect::<Vec<_>>()
    };
    assert_eq!(ramps(&BY_INDEX), [Mux::new(0x6083, 0), Mux::new(0x6883, 0)]);
    assert_eq!(ramps(&BY_SUB_INDEX), [Mux::new(0x6083, 1), Mux::new(0x6083, 2)]);
}
