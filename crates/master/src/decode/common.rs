//! What is known of an object of a node whose model is not known: what all models agree on that have it, else the name
//! and type that CiA 301 (7.5) and CiA 402-2 give it.

use canopen::Mux;
use canopen::od::{DataType, Entry};
use devices::all;

use DataType::{Integer16 as I16, Integer32 as I32};
use DataType::{Unsigned8 as U8, Unsigned16 as U16, Unsigned32 as U32};

/// The row of an object on which all models agree that have it, for a node whose model is not known.
pub fn common_row(mux: Mux) -> Option<&'static Entry> {
    all().common_row(mux)
}

/// The name of an object that all models that have it give it, whatever its type and unit, or that the standard gives it.
pub fn common_name(mux: Mux) -> Option<&'static str> {
    let mut names = all().rows(mux).map(|row| row.name);
    match names.next() {
        Some(first) => names.all(|name| name == first).then_some(first),
        None => standard(mux).map(|(_, name, _)| *name),
    }
}

/// The type of an object that came with this many bytes, where those models that have it with this length agree on it, or
/// the standard's. An object may have another form in TPDOs.
pub fn common_type(mux: Mux, length: usize) -> Option<DataType> {
    let forms = all().iter().flat_map(|profile| {
        let in_tpdo = profile.pdo.mapping.tpdo_form(mux).map(|form| form.data_type);
        [profile.row(mux).map(|row| row.data_type), in_tpdo]
    });
    let mut fitting = forms.flatten().filter(|data_type| data_type.size() == length && length > 0);
    match fitting.next() {
        Some(first) => fitting.all(|other| other == first).then_some(first),
        None => standard(mux).and_then(|(_, _, data_type)| *data_type).filter(|data_type| data_type.size() == length),
    }
}

type Standard = (u16, &'static str, Option<DataType>);

fn standard(mux: Mux) -> Option<&'static Standard> {
    let place = STANDARD.binary_search_by_key(&mux.index, |(index, ..)| *index).ok()?;
    // A type is that of a variable; what stands in an array or record differs by sub-index.
    Some(&STANDARD[place]).filter(|(_, _, data_type)| data_type.is_none() || mux.sub_index == 0)
}

/// Objects of the standards that none of the models has, ascending. Arrays and records have no type.
#[rustfmt::skip]
const STANDARD: [Standard; 68] = [
    (0x1002, "manufacturer_status_register", Some(U32)),
    (0x1003, "pre_defined_error_field", None),
    (0x1006, "communication_cycle_period", Some(U32)),
    (0x1007, "synchronous_window_length", Some(U32)),
    (0x1008, "manufacturer_device_name", None),
    (0x100C, "guard_time", Some(U16)),
    (0x100D, "life_time_factor", Some(U8)),
    (0x1010, "store_parameters", None),
    (0x1011, "restore_default_parameters", None),
    (0x1012, "cob_id_time", Some(U32)),
    (0x1013, "high_resolution_time_stamp", Some(U32)),
    (0x1015, "inhibit_time_emcy", Some(U16)),
    (0x1019, "synchronous_counter_overflow_value", Some(U8)),
    (0x1020, "verify_configuration", None),
    (0x1021, "store_eds", None),
    (0x1022, "store_format", None),
    (0x1028, "emcy_consumer", None),
    (0x1029, "error_behaviour", None),
    (0x1F80, "nmt_startup", Some(U32)),
    (0x6007, "abort_connection_option_code", Some(I16)),
    (0x605E, "fault_reaction_option_code", Some(I16)),
    (0x6062, "position_demand_value", Some(I32)),
    (0x6065, "following_error_window", Some(U32)),
    (0x6066, "following_error_time_out", Some(U16)),
    (0x6067, "position_window", Some(U32)),
    (0x6068, "position_window_time", Some(U16)),
    (0x6069, "velocity_sensor_actual_value", Some(I32)),
    (0x606A, "sensor_selection_code", Some(I16)),
    (0x606B, "velocity_demand_value", Some(I32)),
    (0x606D, "velocity_window", Some(U16)),
    (0x606E, "velocity_window_time", Some(U16)),
    (0x606F, "velocity_threshold", Some(U16)),
    (0x6070, "velocity_threshold_time", Some(U16)),
    (0x6072, "max_torque", Some(U16)),
    (0x6073, "max_current", Some(U16)),
    (0x6075, "motor_rated_current", Some(U32)),
    (0x6076, "motor_rated_torque", Some(U32)),
    (0x607B, "position_range_limit", None),
    (0x607D, "software_position_limit", None),
    (0x607E, "polarity", Some(U8)),
    (0x607F, "max_profile_velocity", Some(U32)),
    (0x6080, "max_motor_speed", Some(U32)),
    (0x6086, "motion_profile_type", Some(I16)),
    (0x6088, "torque_profile_type", Some(I16)),
    (0x608F, "position_encoder_resolution", None),
    (0x6090, "velocity_encoder_resolution", None),
    (0x6091, "gear_ratio", None),
    (0x6092, "feed_constant", None),
    (0x60B0, "position_offset", Some(I32)),
    (0x60B1, "velocity_offset", Some(I32)),
    (0x60B2, "torque_offset", Some(I16)),
    (0x60B8, "touch_probe_function", Some(U16)),
    (0x60B9, "touch_probe_status", Some(U16)),
    (0x60BA, "touch_probe_position_1_positive_value", Some(I32)),
    (0x60C0, "interpolation_sub_mode_select", Some(I16)),
    (0x60C1, "interpolation_data_record", None),
    (0x60C2, "interpolation_time_period", None),
    (0x60C4, "interpolation_data_configuration", None),
    (0x60C5, "max_acceleration", Some(U32)),
    (0x60C6, "max_deceleration", Some(U32)),
    (0x60E0, "positive_torque_limit_value", Some(U16)),
    (0x60E1, "negative_torque_limit_value", Some(U16)),
    (0x60F4, "following_error_actual_value", Some(I32)),
    (0x60FA, "control_effort", Some(I32)),
    (0x60FC, "position_demand_internal_value", Some(I32)),
    (0x60FE, "digital_outputs", None),
    (0x6402, "motor_type", Some(U16)),
    (0x6502, "supported_drive_modes", Some(U32)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_objects_ascend_and_no_model_has_them() {
        assert!(STANDARD.is_sorted_by(|(a, ..), (b, ..)| a < b));
        for (index, name, _) in STANDARD {
            let has = |profile: &&devices::Description| profile.row(Mux::new(index, 0)).is_some();
            assert!(!all().iter().any(|profile| has(&profile)), "{index:04X}h {name}: a model's own row speaks for it");
        }
    }

    #[test]
    fn a_name_needs_no_agreement_on_the_unit_and_a_type_none_between_lengths() {
        let speed = Mux::new(0x606C, 0);
        assert!(common_row(speed).is_none());
        assert_eq!(common_name(speed), Some("velocity_actual_value"));
        assert_eq!((common_type(speed, 2), common_type(speed, 4)), (Some(I16), Some(I32)));
        assert_eq!((common_type(speed, 1), common_type(speed, 0)), (None, None));
        // 200Ah is the motor's largest speed on one and the way of stopping at a limit on the other.
        assert_eq!(common_name(Mux::new(0x200A, 0)), None);
        assert_eq!(
            (common_name(Mux::new(0x60F4, 0)), common_type(Mux::new(0x60F4, 0), 4)),
            (Some("following_error_actual_value"), Some(I32))
        );
        assert_eq!(common_name(Mux::new(0x607D, 1)), Some("software_position_limit"));
        assert_eq!(common_name(Mux::new(0x5FFF, 0)), None);
    }
}
