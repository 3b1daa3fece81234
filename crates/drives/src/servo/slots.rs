//! Where the objects are that the firmware acts on. Looked up once, when it starts: what the table lacks is not there.

use canopen::Mux;
use canopen::od::{Slot, Table};
use devices::Placement;

macro_rules! slots {
    ($(#[$doc:meta])* $name:ident { $($field:ident: $index:literal $sub:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default)]
        pub(super) struct $name {
            $(pub(super) $field: Option<Slot>,)*
        }

        impl $name {
            /// The objects, where a device of one axis has them.
            pub(super) const OBJECTS: &'static [Mux] = &[$(Mux::new($index, $sub),)*];

            /// Those of them that a table has, for an axis that is placed so.
            pub(super) fn of(table: &Table, placement: Placement) -> Self {
                let find = |index, sub| table.find(placement.place(Mux::new(index, sub))).ok();
                Self { $($field: find($index, $sub),)* }
            }
        }
    };
}

slots! {
    /// The objects of one axis (CiA 402-2).
    AxisSlots {
        abort_connection: 0x6007 0,
        error_code: 0x603F 0,
        controlword: 0x6040 0,
        statusword: 0x6041 0,
        vl_target: 0x6042 0,
        vl_demand: 0x6043 0,
        vl_actual: 0x6044 0,
        vl_min: 0x6046 1,
        vl_max: 0x6046 2,
        vl_acceleration_speed: 0x6048 1,
        vl_acceleration_time: 0x6048 2,
        vl_deceleration_speed: 0x6049 1,
        vl_deceleration_time: 0x6049 2,
        vl_quick_stop_speed: 0x604A 1,
        vl_quick_stop_time: 0x604A 2,
        vl_set_point_numerator: 0x604B 1,
        vl_set_point_denominator: 0x604B 2,
        vl_dimension_numerator: 0x604C 1,
        vl_dimension_denominator: 0x604C 2,
        quick_stop: 0x605A 0,
        shutdown: 0x605B 0,
        disable_operation: 0x605C 0,
        halt: 0x605D 0,
        fault_reaction: 0x605E 0,
        mode: 0x6060 0,
        mode_display: 0x6061 0,
        position_demand: 0x6062 0,
        position_internal: 0x6063 0,
        position: 0x6064 0,
        following_error_window: 0x6065 0,
        following_error_time: 0x6066 0,
        position_window: 0x6067 0,
        position_window_time: 0x6068 0,
        velocity_demand: 0x606B 0,
        velocity: 0x606C 0,
        velocity_window: 0x606D 0,
        velocity_window_time: 0x606E 0,
        velocity_threshold: 0x606F 0,
        velocity_threshold_time: 0x6070 0,
        target_torque: 0x6071 0,
        max_torque: 0x6072 0,
        max_current: 0x6073 0,
        torque_demand: 0x6074 0,
        rated_current: 0x6075 0,
        rated_torque: 0x6076 0,
        torque: 0x6077 0,
        current: 0x6078 0,
        bus_voltage: 0x6079 0,
        target_position: 0x607A 0,
        min_position_range: 0x607B 1,
        max_position_range: 0x607B 2,
        home_offset: 0x607C 0,
        min_position: 0x607D 1,
        max_position: 0x607D 2,
        polarity: 0x607E 0,
        max_profile_velocity: 0x607F 0,
        max_motor_speed: 0x6080 0,
        profile_velocity: 0x6081 0,
        end_velocity: 0x6082 0,
        acceleration: 0x6083 0,
        deceleration: 0x6084 0,
        quick_stop_deceleration: 0x6085 0,
        motion_profile_type: 0x6086 0,
        torque_slope: 0x6087 0,
        encoder_increments: 0x608F 1,
        encoder_turns: 0x608F 2,
        gear_motor: 0x6091 1,
        gear_shaft: 0x6091 2,
        feed: 0x6092 1,
        feed_turns: 0x6092 2,
        position_factor_numerator: 0x6093 1,
        position_factor_divisor: 0x6093 2,
        velocity_encoder_numerator: 0x6094 1,
        velocity_encoder_divisor: 0x6094 2,
        velocity_factor_1_numerator: 0x6095 1,
        velocity_factor_1_divisor: 0x6095 2,
        velocity_factor_numerator: 0x6096 1,
        velocity_factor_divisor: 0x6096 2,
        acceleration_factor_numerator: 0x6097 1,
        acceleration_factor_divisor: 0x6097 2,
        homing_method: 0x6098 0,
        homing_speed_switch: 0x6099 1,
        homing_speed_zero: 0x6099 2,
        homing_acceleration: 0x609A 0,
        jerk_use: 0x60A3 0,
        jerk_1: 0x60A4 1,
        jerk_2: 0x60A4 2,
        jerk_3: 0x60A4 3,
        jerk_4: 0x60A4 4,
        position_offset: 0x60B0 0,
        velocity_offset: 0x60B1 0,
        torque_offset: 0x60B2 0,
        touch_probe_function: 0x60B8 0,
        touch_probe_status: 0x60B9 0,
        touch_probe_1_positive: 0x60BA 0,
        touch_probe_1_negative: 0x60BB 0,
        touch_probe_2_positive: 0x60BC 0,
        touch_probe_2_negative: 0x60BD 0,
        interpolation_sub_mode: 0x60C0 0,
        interpolation_set_point: 0x60C1 1,
        interpolation_period_value: 0x60C2 1,
        interpolation_period_index: 0x60C2 2,
        interpolation_most_waiting: 0x60C4 1,
        interpolation_buffer_size: 0x60C4 2,
        interpolation_buffer_organisation: 0x60C4 3,
        interpolation_buffer_position: 0x60C4 4,
        interpolation_buffer_clear: 0x60C4 6,
        max_acceleration: 0x60C5 0,
        max_deceleration: 0x60C6 0,
        positive_torque_limit: 0x60E0 0,
        negative_torque_limit: 0x60E1 0,
        commutation_angle: 0x60EA 0,
        following_error: 0x60F4 0,
        control_effort: 0x60FA 0,
        position_demand_internal: 0x60FC 0,
        digital_inputs: 0x60FD 0,
        physical_outputs: 0x60FE 1,
        output_mask: 0x60FE 2,
        target_velocity: 0x60FF 0,
        supported_modes: 0x6502 0,
    }
}

impl AxisSlots {
    /// A target that is read each period: a write to it changes no parameter.
    pub(super) fn is_target(&self, slot: Slot) -> bool {
        let targets = [
            self.target_velocity,
            self.target_torque,
            self.velocity_offset,
            self.position_offset,
            self.torque_offset,
            self.physical_outputs,
            self.vl_target,
            self.commutation_angle,
        ];
        targets.contains(&Some(slot))
    }
}
