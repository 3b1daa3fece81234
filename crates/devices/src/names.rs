//! Names of objects: one for every file and every place where a name is typed.
//!
//! A name has two forms: as an EDS has it ("Target velocity") and in snake case, to type (`target_velocity`), which is derived
//! from it ([`name!`](crate::name)).
//!
//! An object of 1000h to 1FFFh or 6000h to 67FFh has the name of CiA 301 or CiA 402-2, whatever its maker prints: they are the
//! table here, and a row of a device's table names its place only ([`row::cia`](crate::row::cia)). Objects that share a name in
//! the standard, as those of the PDOs do, are numbered. An object of the maker has the maker's name, in the row of its device.

use canopen::Mux;

/// What a place of an object dictionary is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Name {
    /// As an EDS has it: `ParameterName` of CiA 306.
    pub title: &'static str,
    /// In snake case, to search and type.
    pub name: &'static str,
}

struct Object {
    index: u16,
    name: Name,
    /// Of an array or record its sub-indexes.
    parts: &'static [(u8, Name)],
}

/// The name of a place, where it is one of the table.
///
/// Sub-index 00h of an array or record is typed as the object is: `homing_speeds`.
pub const fn standard(mux: Mux) -> Option<Name> {
    let Some(object) = find(mux.index) else { return None };
    if object.parts.is_empty() {
        return if mux.sub_index == 0 { Some(object.name) } else { None };
    }
    let mut i = 0;
    while i < object.parts.len() {
        let (sub_index, name) = object.parts[i];
        if sub_index == mux.sub_index {
            return Some(if sub_index == 0 { Name { name: object.name.name, ..name } } else { name });
        }
        i += 1;
    }
    None
}

/// The name of an object as a whole, where it is one of the table: of an array or record not that of its sub-index 00h.
pub const fn standard_object(index: u16) -> Option<Name> {
    match find(index) {
        Some(object) => Some(object.name),
        None => None,
    }
}

/// The object of the standard with this name to type, where one alone has it.
pub fn by_name(name: &str) -> Option<Mux> {
    let whole = OBJECTS.iter().filter(|object| object.parts.is_empty()).map(|object| Mux::new(object.index, 0));
    let parts = |object: &'static Object| object.parts.iter().map(|(sub_index, _)| Mux::new(object.index, *sub_index));
    let all = whole.chain(OBJECTS.iter().flat_map(parts));
    let mut found = all.filter(|mux| standard(*mux).is_some_and(|its| its.name == name));
    let first = found.next();
    first.filter(|_| found.next().is_none())
}

/// True if an object that is called `name` was called `former` in an earlier version.
///
/// Two makers' objects may have had one name: look in the table of one model, and for its present names first.
pub fn is_former(former: &str, name: &str) -> bool {
    FORMER.contains(&(former, name))
}

const fn find(index: u16) -> Option<&'static Object> {
    let (mut low, mut high) = (0, OBJECTS.len());
    while low < high {
        let middle = low + (high - low) / 2;
        let found = OBJECTS[middle].index;
        if found == index {
            return Some(&OBJECTS[middle]);
        } else if found < index {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    None
}

/// Letters and digits in lower case, and one `_` for all that is between them: the bytes, and how many of them count.
#[doc(hidden)]
pub const fn snake<const N: usize>(title: &str) -> ([u8; N], usize) {
    let (title, mut name, mut length, mut i) = (title.as_bytes(), [0; N], 0, 0);
    while i < title.len() {
        if title[i].is_ascii_alphanumeric() {
            name[length] = title[i].to_ascii_lowercase();
            length += 1;
        } else if length > 0 && name[length - 1] != b'_' {
            name[length] = b'_';
            length += 1;
        }
        i += 1;
    }
    if length > 0 && name[length - 1] == b'_' {
        length -= 1;
    }
    (name, length)
}

/// The first `length` of `bytes`.
///
/// # Panics
/// If they are not ASCII, at compile time in a `const`.
#[doc(hidden)]
pub const fn text(bytes: &'static [u8], length: usize) -> &'static str {
    match core::str::from_utf8(bytes.split_at(length).0) {
        Ok(text) => text,
        Err(_) => panic!("a name is ASCII"),
    }
}

/// A [`Name`]: a title, and the name to type that comes of it or, where it alone would not say what it is of, of other words.
///
/// ```
/// let name = devices::name!("X0/X1 input filter time");
/// assert_eq!(name.name, "x0_x1_input_filter_time");
///
/// let count = devices::name!("Number of sub-indexes", "Bleed resistor");
/// assert_eq!((count.title, count.name), ("Number of sub-indexes", "bleed_resistor"));
/// ```
#[macro_export]
macro_rules! name {
    ($title:expr) => {
        $crate::name!($title, $title)
    };
    ($title:expr, $words:expr) => {{
        const SNAKE: ([u8; $words.len()], usize) = $crate::names::snake($words);
        $crate::names::Name { title: $title, name: $crate::names::text(&SNAKE.0, SNAKE.1) }
    }};
}

/// An object, and its sub-indexes where it has some. The name to type of a sub-index has that of its object in front where
/// its title is written with `..`: alone it would not say what it is of.
macro_rules! object {
    ($index:literal, $title:expr) => {
        Object { index: $index, name: name!($title), parts: &[] }
    };
    ($index:literal, $title:expr; $($sub:literal $part:tt),+) => {
        Object { index: $index, name: name!($title), parts: &[$(($sub, part!($title, $part))),+] }
    };
}

macro_rules! part {
    ($object:expr, [.. $title:expr]) => {
        name!($title, concat!($object, " ", $title))
    };
    ($object:expr, $title:expr) => {
        name!($title)
    };
}

const HIGHEST: &str = "Highest sub-index supported";

macro_rules! receive {
    ($index:literal, $number:literal) => {
        object!($index, concat!("RPDO communication parameter ", $number);
            0 HIGHEST, 1 [.. "COB-ID used by RPDO"], 2 [.. "Transmission type"], 3 [.. "Inhibit time"],
            4 [.. "Compatibility entry"], 5 [.. "Event timer"])
    };
}

macro_rules! transmit {
    ($index:literal, $number:literal) => {
        object!($index, concat!("TPDO communication parameter ", $number);
            0 HIGHEST, 1 [.. "COB-ID used by TPDO"], 2 [.. "Transmission type"], 3 [.. "Inhibit time"],
            4 [.. "Reserved"], 5 [.. "Event timer"])
    };
}

macro_rules! mapped {
    ($index:literal, $title:literal, $number:literal) => {
        object!($index, concat!($title, " ", $number);
            0 "Number of mapped application objects in PDO",
            1 [.. "Application object 1"], 2 [.. "Application object 2"], 3 [.. "Application object 3"],
            4 [.. "Application object 4"], 5 [.. "Application object 5"], 6 [.. "Application object 6"],
            7 [.. "Application object 7"], 8 [.. "Application object 8"])
    };
}

/// Ascending. Sources: CiA 301, 7.5; CiA 402-2, clauses 6 to 18.
#[rustfmt::skip]
const OBJECTS: &[Object] = &[
    object!(0x1000, "Device type"),
    object!(0x1001, "Error register"),
    object!(0x1002, "Manufacturer status register"),
    object!(0x1003, "Pre-defined error field";
        0 "Number of errors", 1 "Standard error field 1", 2 "Standard error field 2", 3 "Standard error field 3",
        4 "Standard error field 4", 5 "Standard error field 5", 6 "Standard error field 6",
        7 "Standard error field 7", 8 "Standard error field 8"),
    object!(0x1005, "COB-ID SYNC message"),
    object!(0x1006, "Communication cycle period"),
    object!(0x1007, "Synchronous window length"),
    object!(0x1008, "Manufacturer device name"),
    object!(0x1009, "Manufacturer hardware version"),
    object!(0x100A, "Manufacturer software version"),
    object!(0x100C, "Guard time"),
    object!(0x100D, "Life time factor"),
    object!(0x1010, "Store parameters";
        0 HIGHEST, 1 "Save all parameters", 2 "Save communication parameters", 3 "Save application parameters"),
    object!(0x1011, "Restore default parameters";
        0 HIGHEST, 1 "Restore all default parameters", 2 "Restore communication default parameters",
        3 "Restore application default parameters"),
    object!(0x1012, "COB-ID time stamp object"),
    object!(0x1013, "High resolution time stamp"),
    object!(0x1014, "COB-ID EMCY"),
    object!(0x1015, "Inhibit time EMCY"),
    object!(0x1016, "Consumer heartbeat time";
        0 HIGHEST, 1 "Consumer heartbeat time 1", 2 "Consumer heartbeat time 2", 3 "Consumer heartbeat time 3",
        4 "Consumer heartbeat time 4", 5 "Consumer heartbeat time 5", 6 "Consumer heartbeat time 6",
        7 "Consumer heartbeat time 7", 8 "Consumer heartbeat time 8"),
    object!(0x1017, "Producer heartbeat time"),
    object!(0x1018, "Identity object";
        0 HIGHEST, 1 "Vendor-ID", 2 "Product code", 3 "Revision number", 4 "Serial number"),
    object!(0x1019, "Synchronous counter overflow value"),
    object!(0x1020, "Verify configuration"),
    object!(0x1021, "Store EDS"),
    object!(0x1022, "Store format"),
    object!(0x1028, "Emergency consumer object"),
    object!(0x1029, "Error behavior object"; 0 HIGHEST, 1 "Communication error"),
    object!(0x1200, "SDO server parameter";
        0 HIGHEST, 1 [.. "COB-ID client to server (rx)"], 2 [.. "COB-ID server to client (tx)"]),
    receive!(0x1400, "1"), receive!(0x1401, "2"), receive!(0x1402, "3"), receive!(0x1403, "4"),
    mapped!(0x1600, "RPDO mapping parameter", "1"), mapped!(0x1601, "RPDO mapping parameter", "2"),
    mapped!(0x1602, "RPDO mapping parameter", "3"), mapped!(0x1603, "RPDO mapping parameter", "4"),
    transmit!(0x1800, "1"), transmit!(0x1801, "2"), transmit!(0x1802, "3"), transmit!(0x1803, "4"),
    mapped!(0x1A00, "TPDO mapping parameter", "1"), mapped!(0x1A01, "TPDO mapping parameter", "2"),
    mapped!(0x1A02, "TPDO mapping parameter", "3"), mapped!(0x1A03, "TPDO mapping parameter", "4"),
    object!(0x1F80, "NMT startup"),
    object!(0x6007, "Abort connection option code"),
    object!(0x603F, "Error code"),
    object!(0x6040, "Controlword"),
    object!(0x6041, "Statusword"),
    object!(0x6042, "vl target velocity"),
    object!(0x6043, "vl velocity demand"),
    object!(0x6044, "vl velocity actual value"),
    object!(0x6046, "vl velocity min max amount"; 0 HIGHEST, 1 "vl velocity min amount", 2 "vl velocity max amount"),
    object!(0x6048, "vl velocity acceleration"; 0 HIGHEST, 1 [.. "Delta speed"], 2 [.. "Delta time"]),
    object!(0x6049, "vl velocity deceleration"; 0 HIGHEST, 1 [.. "Delta speed"], 2 [.. "Delta time"]),
    object!(0x604A, "vl velocity quick stop"; 0 HIGHEST, 1 [.. "Delta speed"], 2 [.. "Delta time"]),
    object!(0x604B, "vl set-point factor"; 0 HIGHEST, 1 [.. "Numerator"], 2 [.. "Denominator"]),
    object!(0x604C, "vl dimension factor"; 0 HIGHEST, 1 [.. "Numerator"], 2 [.. "Denominator"]),
    object!(0x605A, "Quick stop option code"),
    object!(0x605B, "Shutdown option code"),
    object!(0x605C, "Disable operation option code"),
    object!(0x605D, "Halt option code"),
    object!(0x605E, "Fault reaction option code"),
    object!(0x6060, "Modes of operation"),
    object!(0x6061, "Modes of operation display"),
    object!(0x6062, "Position demand value"),
    object!(0x6063, "Position actual internal value"),
    object!(0x6064, "Position actual value"),
    object!(0x6065, "Following error window"),
    object!(0x6066, "Following error time out"),
    object!(0x6067, "Position window"),
    object!(0x6068, "Position window time"),
    object!(0x6069, "Velocity sensor actual value"),
    object!(0x606A, "Sensor selection code"),
    object!(0x606B, "Velocity demand value"),
    object!(0x606C, "Velocity actual value"),
    object!(0x606D, "Velocity window"),
    object!(0x606E, "Velocity window time"),
    object!(0x606F, "Velocity threshold"),
    object!(0x6070, "Velocity threshold time"),
    object!(0x6071, "Target torque"),
    object!(0x6072, "Max torque"),
    object!(0x6073, "Max current"),
    object!(0x6074, "Torque demand"),
    object!(0x6075, "Motor rated current"),
    object!(0x6076, "Motor rated torque"),
    object!(0x6077, "Torque actual value"),
    object!(0x6078, "Current actual value"),
    object!(0x6079, "DC link circuit voltage"),
    object!(0x607A, "Target position"),
    object!(0x607B, "Position range limit"; 0 HIGHEST, 1 "Min position range limit", 2 "Max position range limit"),
    object!(0x607C, "Home offset"),
    object!(0x607D, "Software position limit"; 0 HIGHEST, 1 "Min position limit", 2 "Max position limit"),
    object!(0x607E, "Polarity"),
    object!(0x607F, "Max profile velocity"),
    object!(0x6080, "Max motor speed"),
    object!(0x6081, "Profile velocity"),
    object!(0x6082, "End velocity"),
    object!(0x6083, "Profile acceleration"),
    object!(0x6084, "Profile deceleration"),
    object!(0x6085, "Quick stop deceleration"),
    object!(0x6086, "Motion profile type"),
    object!(0x6087, "Torque slope"),
    object!(0x6088, "Torque profile type"),
    object!(0x608F, "Position encoder resolution"; 0 HIGHEST, 1 "Encoder increments", 2 [.. "Motor revolutions"]),
    object!(0x6090, "Velocity encoder resolution"),
    object!(0x6091, "Gear ratio"; 0 HIGHEST, 1 [.. "Motor revolutions"], 2 [.. "Shaft revolutions"]),
    object!(0x6092, "Feed constant"; 0 HIGHEST, 1 "Feed", 2 [.. "Shaft revolutions"]),
    object!(0x6096, "Velocity factor"; 0 HIGHEST, 1 [.. "Numerator"], 2 [.. "Divisor"]),
    object!(0x6097, "Acceleration factor"; 0 HIGHEST, 1 [.. "Numerator"], 2 [.. "Divisor"]),
    object!(0x6098, "Homing method"),
    object!(0x6099, "Homing speeds";
        0 HIGHEST, 1 "Speed during search for switch", 2 "Speed during search for zero"),
    object!(0x609A, "Homing acceleration"),
    object!(0x60A3, "Profile jerk use"),
    object!(0x60A4, "Profile jerk";
        0 HIGHEST, 1 "Profile jerk 1", 2 "Profile jerk 2", 3 "Profile jerk 3", 4 "Profile jerk 4"),
    object!(0x60B0, "Position offset"),
    object!(0x60B1, "Velocity offset"),
    object!(0x60B2, "Torque offset"),
    object!(0x60B8, "Touch probe function"),
    object!(0x60B9, "Touch probe status"),
    object!(0x60BA, "Touch probe 1 positive edge"),
    object!(0x60BB, "Touch probe 1 negative edge"),
    object!(0x60BC, "Touch probe 2 positive edge"),
    object!(0x60BD, "Touch probe 2 negative edge"),
    object!(0x60C0, "Interpolation sub mode select"),
    object!(0x60C1, "Interpolation data record"; 0 HIGHEST, 1 [.. "1st set-point"]),
    object!(0x60C2, "Interpolation time period";
        0 HIGHEST, 1 "Interpolation time period value", 2 "Interpolation time index"),
    object!(0x60C4, "Interpolation data configuration";
        0 HIGHEST, 1 [.. "Maximum buffer size"], 2 [.. "Actual buffer size"], 3 [.. "Buffer organization"],
        4 [.. "Buffer position"], 5 [.. "Size of data record"], 6 [.. "Buffer clear"]),
    object!(0x60C5, "Max acceleration"),
    object!(0x60C6, "Max deceleration"),
    object!(0x60E0, "Positive torque limit value"),
    object!(0x60E1, "Negative torque limit value"),
    object!(0x60E3, "Supported homing methods";
        0 HIGHEST, 1 "Supported homing method 1", 2 "Supported homing method 2", 3 "Supported homing method 3",
        4 "Supported homing method 4", 5 "Supported homing method 5", 6 "Supported homing method 6",
        7 "Supported homing method 7", 8 "Supported homing method 8", 9 "Supported homing method 9",
        10 "Supported homing method 10", 11 "Supported homing method 11", 12 "Supported homing method 12",
        13 "Supported homing method 13", 14 "Supported homing method 14", 15 "Supported homing method 15",
        16 "Supported homing method 16", 17 "Supported homing method 17", 18 "Supported homing method 18",
        19 "Supported homing method 19", 20 "Supported homing method 20", 21 "Supported homing method 21",
        22 "Supported homing method 22", 23 "Supported homing method 23", 24 "Supported homing method 24",
        25 "Supported homing method 25", 26 "Supported homing method 26", 27 "Supported homing method 27",
        28 "Supported homing method 28", 29 "Supported homing method 29", 30 "Supported homing method 30",
        31 "Supported homing method 31", 32 "Supported homing method 32"),
    object!(0x60EA, "Commutation angle"),
    object!(0x60F4, "Following error actual value"),
    // What stands in these two is the maker's.
    object!(0x60F9, "Velocity control parameter set"; 0 HIGHEST),
    object!(0x60FA, "Control effort"),
    object!(0x60FB, "Position control parameter set"; 0 HIGHEST),
    object!(0x60FC, "Position demand internal value"),
    object!(0x60FD, "Digital inputs"),
    object!(0x60FE, "Digital outputs"; 0 HIGHEST, 1 "Physical outputs", 2 [.. "Bit mask"]),
    object!(0x60FF, "Target velocity"),
    object!(0x6402, "Motor type"),
    object!(0x6502, "Supported drive modes"),
    object!(0x67FE, "Version number"),
];

/// Names to type of earlier versions, and what the object is called now.
#[rustfmt::skip]
const FORMER: &[(&str, &str)] = &[
    ("cob_id_sync", "cob_id_sync_message"),
    ("hardware_version", "manufacturer_hardware_version"),
    ("software_version", "manufacturer_software_version"),
    ("consumer_heartbeat", "consumer_heartbeat_time"),
    ("error_behaviour", "error_behavior_object"),
    ("sdo_cob_id_client_to_server", "sdo_server_parameter_cob_id_client_to_server_rx"),
    ("sdo_cob_id_server_to_client", "sdo_server_parameter_cob_id_server_to_client_tx"),
    ("motor_revolutions", "position_encoder_resolution_motor_revolutions"),
    ("gear_motor_revolutions", "gear_ratio_motor_revolutions"),
    ("gear_shaft_revolutions", "gear_ratio_shaft_revolutions"),
    ("feed_shaft_revolutions", "feed_constant_shaft_revolutions"),
    ("homing_speed_switch", "speed_during_search_for_switch"),
    ("homing_speed_zero", "speed_during_search_for_zero"),
    ("interpolation_set_point", "interpolation_data_record_1st_set_point"),
    ("interpolation_maximum_buffer_size", "interpolation_data_configuration_maximum_buffer_size"),
    ("interpolation_actual_buffer_size", "interpolation_data_configuration_actual_buffer_size"),
    ("interpolation_buffer_organisation", "interpolation_data_configuration_buffer_organization"),
    ("interpolation_buffer_position", "interpolation_data_configuration_buffer_position"),
    ("interpolation_data_record_size", "interpolation_data_configuration_size_of_data_record"),
    ("interpolation_buffer_clear", "interpolation_data_configuration_buffer_clear"),
    ("positive_torque_limit", "positive_torque_limit_value"),
    ("negative_torque_limit", "negative_torque_limit_value"),
    ("velocity_loop", "velocity_control_parameter_set"),
    ("position_loop", "position_control_parameter_set"),
    ("output_bit_mask", "digital_outputs_bit_mask"),
    // The makers'.
    ("alarm_pwm", "alarm_pwm_processing_method"),
    ("bleeder", "bleed_resistor"),
    ("bleeder_enable", "bleed_resistor_function_control"),
    ("bleeder_off_voltage", "bleed_resistor_turns_off_voltage"),
    ("bleeder_on_voltage", "bleed_resistor_turns_on_voltage"),
    ("bleeder_power", "bleed_resistor_power"),
    ("bleeder_resistance", "bleed_resistor_value"),
    ("brake_b0", "output_terminal_b0_function_selection"),
    ("can_baud_rate", "can_custom_communication_baud_rate"),
    ("can_node_id", "can_custom_driver_node_number"),
    ("current_ki", "current_loop_integral_gain"),
    ("current_kp", "current_loop_proportional_coefficient"),
    ("custom_node_id", "custom_drive_node_number"),
    ("driver_temperature", "system_temperature"),
    ("driver_temperature_threshold", "driver_temperature_protection_threshold"),
    ("fault_reset", "fault_reset_command"),
    ("feedforward_smoothing", "feedforward_output_smoothing_coefficient"),
    ("hall_offset_angle", "offset_angle_of_motor_and_hall"),
    ("hall_status", "hall_input_status"),
    ("input_polarity", "input_terminal_effective_level"),
    ("input_status", "input_signal_status"),
    ("input_x0_function", "input_terminal_x0_function_selection"),
    ("input_x1_function", "input_terminal_x1_function_selection"),
    ("input_x2_function", "input_terminal_x2_function_selection"),
    ("input_x2_function", "input_terminal_x2_nc"),
    ("input_x3_function", "input_terminal_x3_function_selection"),
    ("input_x3_function", "input_terminal_x3_nc"),
    ("io_stop_processing", "io_emergency_stop_processing_method"),
    ("max_allowable_current", "maximum_allowable_current"),
    ("max_current", "maximum_current"),
    ("max_motor_speed", "maximum_speed_of_motor"),
    ("motor_direction", "motor_default_rotation_direction"),
    ("motor_speed", "motor_running_speed"),
    ("motor_status", "motor_status_register"),
    ("motor_temperature_threshold", "motor_temperature_protection_threshold"),
    ("node_id", "drive_node_number"),
    ("out_of_tolerance_threshold", "out_of_tolerance_alarm_threshold"),
    ("output_enabled", "drive_output_enabled"),
    ("output_polarity", "output_terminal_effective_level"),
    ("output_pwm", "pwm_of_system_output"),
    ("output_status", "output_signal_status"),
    ("output_y0_function", "output_terminal_y0_function_selection"),
    ("output_y1_function", "output_terminal_y1_function_selection"),
    ("overload_processing", "overload_processing_method"),
    ("overload_time", "overload_protection_time"),
    ("position_kf", "position_feedforward_gain_kf"),
    ("position_kp", "position_proportional_gain_kp"),
    ("position_kp", "proportional_coefficient_of_position_ring"),
    ("rs485_baud_rate", "rs485_custom_communication_baud_rate"),
    ("rs485_node_id", "rs485_custom_driver_node_number"),
    ("shaft_lock_when_disabled", "shaft_lock_method_when_power_on"),
    ("stationary_max_output", "stationary_maximum_allowable_output"),
    ("synchronous_control_word", "can_communication_synchronous_control_word"),
    ("torque_smoothing", "torque_output_smoothing_factor"),
    ("velocity_feed_forward", "rate_feed_forward"),
    ("velocity_integral_time", "velocity_loop_integration_time"),
    ("velocity_kf", "speed_feedforward_gain_kf"),
    ("velocity_ki", "speed_integral_gain_ki"),
    ("velocity_kp", "speed_proportional_gain_kp"),
    ("velocity_kp", "velocity_ring_proportionality_coefficient"),
    ("velocity_observer_1", "speed_observer_coefficient_1"),
    ("velocity_observer_2", "speed_observer_coefficient_2"),
    ("velocity_observer_3", "speed_observer_coefficient_3"),
    ("velocity_observer_4", "speed_observer_coefficient_4"),
    ("velocity_resolution", "set_speed_resolution"),
    ("velocity_smoothing", "velocity_smoothing_factor"),
    ("x0_x1_filter_time", "x0_x1_input_filter_time"),
    ("x2_x3_filter_time", "x2_x3_input_filter_time"),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::vec::Vec;

    use super::*;

    fn all() -> impl Iterator<Item = (Mux, Name)> {
        OBJECTS.iter().flat_map(|object| {
            let subs = object.parts.iter().map(|(sub_index, _)| *sub_index);
            let subs: Vec<u8> = if object.parts.is_empty() { std::vec![0] } else { subs.collect() };
            subs.into_iter().map(|sub| Mux::new(object.index, sub)).map(|mux| (mux, standard(mux).expect("a name")))
        })
    }

    /// Every model, and every edition of one.
    fn models() -> impl Iterator<Item = &'static crate::Description> {
        let editions = crate::all().iter().flat_map(|model| model.editions.iter().map(|edition| edition.description));
        crate::all().iter().chain(editions)
    }

    #[test]
    fn objects_ascend_and_no_two_places_are_typed_alike() {
        assert!(OBJECTS.is_sorted_by(|a, b| a.index < b.index));
        let names: BTreeSet<&str> = all().map(|(_, name)| name.name).collect();
        assert_eq!(names.len(), all().count());
        let titles: BTreeSet<&str> = OBJECTS.iter().map(|object| object.name.title).collect();
        assert_eq!(titles.len(), OBJECTS.len(), "two objects of one EDS would share a name");
        for object in OBJECTS {
            let titles: BTreeSet<&str> = object.parts.iter().map(|(_, name)| name.title).collect();
            assert_eq!(titles.len(), object.parts.len(), "{:04X}h", object.index);
        }
    }

    #[test]
    fn a_name_is_its_title_in_snake_case() {
        let name = |index, sub_index| standard(Mux::new(index, sub_index)).map(|name| name.name);
        assert_eq!(name(0x6041, 0), Some("statusword"));
        assert_eq!(name(0x1018, 1), Some("vendor_id"));
        assert_eq!(name(0x1200, 1), Some("sdo_server_parameter_cob_id_client_to_server_rx"));
        assert_eq!(name(0x1801, 2), Some("tpdo_communication_parameter_2_transmission_type"));
        assert_eq!((name(0x6091, 0), name(0x6091, 1)), (Some("gear_ratio"), Some("gear_ratio_motor_revolutions")));
        assert_eq!([(0x6041, 1), (0x60FB, 1), (0x2000, 0)].map(|(index, sub)| name(index, sub)), [None; 3]);
        for (mux, name) in all() {
            let plain = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'_';
            assert!(
                name.name.bytes().all(plain) && !name.name.starts_with(|first: char| first.is_ascii_digit()),
                "{mux}"
            );
        }
    }

    #[test]
    fn the_constants_of_the_standards_objects_have_these_names() {
        for objects in [canopen::object::ALL, cia402::object::ALL] {
            assert!(objects.is_sorted_by_key(|(_, mux)| mux.key()));
            // 1F56h and the parts of 1020h have no names here: no model has them.
            let named = objects.iter().filter_map(|(constant, mux)| Some((*constant, standard(*mux)?.name)));
            let unlike: Vec<_> =
                named.clone().filter(|(constant, name)| !constant.eq_ignore_ascii_case(name)).collect();
            assert_eq!(unlike, []);
            assert!(named.count() >= objects.len() - 3);
        }
    }

    #[test]
    fn a_former_name_is_of_one_object_of_a_model_and_is_not_the_name_of_anything_else_there() {
        let mut current = BTreeSet::new();
        for model in models() {
            let names: BTreeSet<&str> = model.dictionary.rows().iter().map(|row| row.name).collect();
            for (former, _) in FORMER {
                let now = names.iter().filter(|name| is_former(former, name)).count();
                assert!(now + usize::from(names.contains(former)) <= 1, "{}: {former}", model.name);
            }
            current.extend(names);
        }
        current.extend(all().map(|(_, name)| name.name));
        for (_, now) in FORMER {
            assert!(current.contains(now), "{now}");
        }
        assert!(is_former("homing_speed_switch", "speed_during_search_for_switch"));
        assert!(!is_former("statusword", "statusword"));
    }

    #[test]
    fn the_name_of_a_makers_object_is_its_title_in_snake_case() {
        let mut checked = 0;
        for model in models() {
            let rows = model.dictionary.rows();
            for row in rows.iter().filter(|row| standard(row.mux()).is_none()) {
                // Sub-index 00h of a record is typed as the record is called.
                let is_count =
                    row.sub_index == 0 && rows.iter().any(|other| other.index == row.index && other.sub_index > 0);
                let (name, length) = snake::<100>(row.title);
                let derived = core::str::from_utf8(&name[..length]).expect("ASCII");
                assert!(is_count || derived == row.name, "{} {} {}", model.name, row.mux(), row.title);
                checked += 1;
            }
            let names: BTreeSet<&str> = rows.iter().map(|row| row.name).collect();
            assert_eq!(names.len(), rows.len(), "{}: two rows are typed alike", model.name);
        }
        assert!(checked > 200);
    }

    #[test]
    fn every_model_and_edition_has_the_names_of_the_standards() {
        let (mut all, mut count) = (0, 0);
        for model in models() {
            let rows = model.dictionary.rows().iter();
            let of_standards = rows.filter(|row| matches!(row.index, 0x1000..=0x1FFF | 0x6000..=0x67FF));
            let mut checked = 0;
            for row in of_standards.filter(|row| !matches!((row.index, row.sub_index), (0x60F9 | 0x60FB, 1..))) {
                let name = standard(row.mux());
                assert_eq!(name, Some(Name { title: row.title, name: row.name }), "{} {}", model.name, row.mux());
                checked += 1;
            }
            assert!(checked > 0, "{}", model.name);
            (all, count) = (all + checked, count + 1);
        }
        // A small drive has few of them; the tables as a whole have many.
        assert!(all > 80 * count, "{all} of {count} models");
    }
}
