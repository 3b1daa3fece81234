//! Profile objects, 6007h to 6502h (CiA 402-2). Where the standard leaves a default to the maker it is chosen for the
//! motor below, and for position units that are encoder increments.

use canopen::od::Entry;

use super::values::{ABORT_CONNECTION, FAULT_REACTION, HALT, HOMING_METHODS, MODES, QUICK_STOP, SHUTDOWN};
use crate::row::{I8, I16, I32, U8, U16, U32, ro, rw, wo};

/// Encoder increments in a turn: the 17 bits of the default motor's encoder.
pub const INCREMENTS_PER_TURN: i64 = 131_072;

/// Turns per second in the motor's rated 3000 r/min.
const RATED_TURNS_S: i64 = 50;

const TURN: i64 = INCREMENTS_PER_TURN;

const INC: &str = "inc";
const INC_S: &str = "inc/s";
const INC_S2: &str = "inc/s^2";
const PER_MILLE: &str = "0.1 %";

/// Number of rows.
pub(super) const ROW_COUNT: usize = 103;

#[rustfmt::skip]
pub(super) static ROWS: [Entry; ROW_COUNT] = [
    rw(0x6007, 0, I16, "abort_connection_option_code", "What a lost connection does").values(ABORT_CONNECTION).default(1).saved(),
    ro(0x603F, 0, U16, "error_code", "Code of the latest error").mappable(),
    rw(0x6040, 0, U16, "controlword", "Controlword").mappable(),
    ro(0x6041, 0, U16, "statusword", "Statusword").mappable(),
    rw(0x605A, 0, I16, "quick_stop_option_code", "What a quick stop does").values(QUICK_STOP).default(2).saved(),
    rw(0x605B, 0, I16, "shutdown_option_code", "What shutdown does").values(SHUTDOWN).default(0).saved(),
    rw(0x605C, 0, I16, "disable_operation_option_code", "What disable operation does").values(SHUTDOWN).default(1).saved(),
    rw(0x605D, 0, I16, "halt_option_code", "What halt does").values(HALT).default(1).saved(),
    rw(0x605E, 0, I16, "fault_reaction_option_code", "What a fault does").values(FAULT_REACTION).default(2).saved(),
    rw(0x6060, 0, I8, "modes_of_operation", "Mode asked for").values(MODES).mappable(),
    ro(0x6061, 0, I8, "modes_of_operation_display", "Mode in effect").values(MODES).mappable(),
    ro(0x6062, 0, I32, "position_demand_value", "Position demand").unit(INC).mappable(),
    ro(0x6063, 0, I32, "position_actual_internal_value", "Position by the encoder").unit(INC).mappable(),
    ro(0x6064, 0, I32, "position_actual_value", "Position").unit(INC).mappable(),
    rw(0x6065, 0, U32, "following_error_window", "Following error that is tolerated; FFFFFFFFh is any").default(TURN / 4).unit(INC).mappable().saved(),
    rw(0x6066, 0, U16, "following_error_time_out", "How long more than that is tolerated").default(100).unit("ms").mappable().saved(),
    rw(0x6067, 0, U32, "position_window", "How near a target position is reached; FFFFFFFFh is any").default(TURN / 1000).unit(INC).mappable().saved(),
    rw(0x6068, 0, U16, "position_window_time", "How long it has to be as near").default(10).unit("ms").mappable().saved(),
    ro(0x606B, 0, I32, "velocity_demand_value", "Velocity demand").unit(INC_S).mappable(),
    ro(0x606C, 0, I32, "velocity_actual_value", "Velocity").unit(INC_S).mappable(),
    // The standard leaves it to makers. A thousandth of the rated speed, 3 r/min: three times the increment that one supervision
    // period of 0.5 ms may see more or less, and less than what a host that turns anything at all asks for.
    rw(0x606D, 0, U16, "velocity_window", "How near a target velocity is reached").default(RATED_TURNS_S * TURN / 1000).unit(INC_S).mappable().saved(),
    rw(0x606E, 0, U16, "velocity_window_time", "How long it has to be as near").default(10).unit("ms").mappable().saved(),
    rw(0x606F, 0, U16, "velocity_threshold", "Velocity that counts as standstill").default(TURN / 10).unit(INC_S).mappable().saved(),
    rw(0x6070, 0, U16, "velocity_threshold_time", "How long it has to be as slow").default(10).unit("ms").mappable().saved(),
    rw(0x6071, 0, I16, "target_torque", "Target torque").unit(PER_MILLE).mappable(),
    rw(0x6072, 0, U16, "max_torque", "Torque limit").default(3000).unit(PER_MILLE).mappable().saved(),
    rw(0x6073, 0, U16, "max_current", "Current limit").default(3000).unit(PER_MILLE).saved(),
    ro(0x6074, 0, I16, "torque_demand", "Torque demand").unit(PER_MILLE).mappable(),
    rw(0x6075, 0, U32, "motor_rated_current", "Rated current of the motor").default(2800).unit("mA").saved(),
    rw(0x6076, 0, U32, "motor_rated_torque", "Rated torque of the motor").default(1270).unit("mN m").saved(),
    ro(0x6077, 0, I16, "torque_actual_value", "Torque").unit(PER_MILLE).mappable(),
    ro(0x6078, 0, I16, "current_actual_value", "Current").unit(PER_MILLE).mappable(),
    ro(0x6079, 0, U32, "dc_link_circuit_voltage", "Bus voltage").unit("mV").mappable(),
    rw(0x607A, 0, I32, "target_position", "Target position").unit(INC).mappable(),
    rw(0x607C, 0, I32, "home_offset", "Zero position seen from the home position").unit(INC).saved(),
    ro(0x607D, 0, U8, "software_position_limit", "Number of entries").default(2),
    rw(0x607D, 1, I32, "min_position_limit", "Lowest target position").default(i32::MIN as i64).unit(INC).saved(),
    rw(0x607D, 2, I32, "max_position_limit", "Highest target position").default(i32::MAX as i64).unit(INC).saved(),
    rw(0x607E, 0, U8, "polarity", "Bit 7: positions, bit 6: velocities change their sign").saved(),
    rw(0x607F, 0, U32, "max_profile_velocity", "Highest velocity of profiles").default(RATED_TURNS_S * 5 / 3 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6080, 0, U32, "max_motor_speed", "Highest speed of the motor").default(5000).unit("r/min").mappable().saved(),
    rw(0x6081, 0, U32, "profile_velocity", "Velocity of position moves").default(10 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6083, 0, U32, "profile_acceleration", "Acceleration").default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6084, 0, U32, "profile_deceleration", "Deceleration").default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6085, 0, U32, "quick_stop_deceleration", "Deceleration of a quick stop").default(1000 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x6086, 0, I16, "motion_profile_type", "Shape of ramps").values(&[(0, "linear")]).mappable().saved(),
    rw(0x6087, 0, U32, "torque_slope", "Change of torque").default(10_000).unit("0.1 %/s").mappable().saved(),
    rw(0x6088, 0, I16, "torque_profile_type", "Shape of torque ramps").values(&[(0, "linear")]).mappable().saved(),
    ro(0x608F, 0, U8, "position_encoder_resolution", "Number of entries").default(2),
    ro(0x608F, 1, U32, "encoder_increments", "Encoder increments").default(TURN),
    ro(0x608F, 2, U32, "motor_revolutions", "in so many turns of the motor").default(1),
    ro(0x6091, 0, U8, "gear_ratio", "Number of entries").default(2),
    rw(0x6091, 1, U32, "gear_motor_revolutions", "Turns of the motor").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6091, 2, U32, "gear_shaft_revolutions", "for so many turns of the driving shaft").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6092, 0, U8, "feed_constant", "Number of entries").default(2),
    rw(0x6092, 1, U32, "feed", "Position units").default(TURN).range(1, u32::MAX as i64).saved(),
    rw(0x6092, 2, U32, "feed_shaft_revolutions", "for so many turns of the driving shaft").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6096, 0, U8, "velocity_factor", "Number of entries").default(2),
    rw(0x6096, 1, U32, "velocity_factor_numerator", "Velocity units").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6096, 2, U32, "velocity_factor_divisor", "for so many position units per second").default(1).range(1, u32::MAX as i64).saved(),
    ro(0x6097, 0, U8, "acceleration_factor", "Number of entries").default(2),
    rw(0x6097, 1, U32, "acceleration_factor_numerator", "Acceleration units").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6097, 2, U32, "acceleration_factor_divisor", "for so many velocity units per second").default(1).range(1, u32::MAX as i64).saved(),
    rw(0x6098, 0, I8, "homing_method", "Homing method").values(HOMING_METHODS).mappable().saved(),
    ro(0x6099, 0, U8, "homing_speeds", "Number of entries").default(2),
    rw(0x6099, 1, U32, "homing_speed_switch", "Velocity of the search for a switch").default(5 * TURN).unit(INC_S).mappable().saved(),
    rw(0x6099, 2, U32, "homing_speed_zero", "Velocity of the search for the home position").default(TURN / 2).unit(INC_S).mappable().saved(),
    rw(0x609A, 0, U32, "homing_acceleration", "Acceleration and deceleration of homing").default(200 * TURN).unit(INC_S2).mappable().saved(),
    rw(0x60B0, 0, I32, "position_offset", "Added to the target position").unit(INC).mappable(),
    rw(0x60B1, 0, I32, "velocity_offset", "Added to the velocity demand").unit(INC_S).mappable(),
    rw(0x60B2, 0, I16, "torque_offset", "Added to the torque demand").unit(PER_MILLE).mappable(),
    rw(0x60B8, 0, U16, "touch_probe_function", "What the two touch probes do").mappable(),
    ro(0x60B9, 0, U16, "touch_probe_status", "What the two touch probes have").mappable(),
    ro(0x60BA, 0, I32, "touch_probe_1_positive_edge", "Position at the rising edge of probe 1").unit(INC).mappable(),
    ro(0x60BB, 0, I32, "touch_probe_1_negative_edge", "Position at the falling edge of probe 1").unit(INC).mappable(),
    ro(0x60BC, 0, I32, "touch_probe_2_positive_edge", "Position at the rising edge of probe 2").unit(INC).mappable(),
    ro(0x60BD, 0, I32, "touch_probe_2_negative_edge", "Position at the falling edge of probe 2").unit(INC).mappable(),
    rw(0x60C0, 0, I16, "interpolation_sub_mode_select", "How set-points are joined").values(&[(-1, "cubic"), (0, "linear")]).mappable().saved(),
    ro(0x60C1, 0, U8, "interpolation_data_record", "Number of entries").default(1),
    rw(0x60C1, 1, I32, "interpolation_set_point", "Next set-point").unit(INC).mappable(),
    ro(0x60C2, 0, U8, "interpolation_time_period", "Number of entries").default(2),
    rw(0x60C2, 1, U8, "interpolation_time_period_value", "Time between two set-points").default(1).range(1, 255).mappable().saved(),
    rw(0x60C2, 2, I8, "interpolation_time_index", "times ten to the power of this, in seconds").default(-3).range(-6, 0).mappable().saved(),
    ro(0x60C4, 0, U8, "interpolation_data_configuration", "Number of entries").default(6),
    ro(0x60C4, 1, U32, "interpolation_maximum_buffer_size", "Most set-points that may wait").default(64),
    rw(0x60C4, 2, U32, "interpolation_actual_buffer_size", "Set-points that may wait; 1: each acts as it comes").default(1).range(1, 64).saved(),
    rw(0x60C4, 3, U8, "interpolation_buffer_organisation", "How they wait").values(&[(0, "first in, first out"), (1, "ring")]).saved(),
    rw(0x60C4, 4, U16, "interpolation_buffer_position", "First in, first out: how many wait; ring: the place to fill").range(0, 64),
    ro(0x60C4, 5, U8, "interpolation_data_record_size", "Bytes of a set-point").default(4),
    wo(0x60C4, 6, U8, "interpolation_buffer_clear", "Whether set-points may wait").values(&[(0, "cleared and closed"), (1, "open")]),
    rw(0x60C5, 0, U32, "max_acceleration", "Highest acceleration").default(u32::MAX as i64).unit(INC_S2).mappable().saved(),
    rw(0x60C6, 0, U32, "max_deceleration", "Highest deceleration").default(u32::MAX as i64).unit(INC_S2).mappable().saved(),
    rw(0x60E0, 0, U16, "positive_torque_limit", "Torque limit towards larger positions").default(3000).unit(PER_MILLE).mappable().saved(),
    rw(0x60E1, 0, U16, "negative_torque_limit", "Torque limit towards smaller positions").default(3000).unit(PER_MILLE).mappable().saved(),
    ro(0x60F4, 0, I32, "following_error_actual_value", "Following error").unit(INC).mappable(),
    ro(0x60FC, 0, I32, "position_demand_internal_value", "Position demand by the encoder").unit(INC).mappable(),
    ro(0x60FD, 0, U32, "digital_inputs", "Bit 0: negative limit, 1: positive limit, 2: home switch").mappable(),
    ro(0x60FE, 0, U8, "digital_outputs", "Number of entries").default(2),
    rw(0x60FE, 1, U32, "physical_outputs", "Levels of the outputs").mappable(),
    rw(0x60FE, 2, U32, "output_bit_mask", "Outputs that the host drives").saved(),
    rw(0x60FF, 0, I32, "target_velocity", "Target velocity").unit(INC_S).mappable(),
    // Permanent magnets, sine.
    ro(0x6402, 0, U16, "motor_type", "Type of the motor").default(10),
    // pp, pv, tq, hm, ip, csp, csv, cst.
    ro(0x6502, 0, U32, "supported_drive_modes", "Modes that there are").default(0x03ED),
];
