//! When the control periods of this drive change nothing any more.

use can::Instant;

use super::{Battery, INTERPOLATION_PERIODS, LAMP_TEST_MS, MJoint, SUPERVISION_DIVIDER};
use crate::Resting;

impl Resting for MJoint {
    const ROUND: u32 = SUPERVISION_DIVIDER as u32 * INTERPOLATION_PERIODS as u32;

    fn rests_since(&self, earlier: &Self, now: Instant) -> bool {
        // Each by name, so that no new one is forgotten.
        let Self {
            model: _,
            device,
            powered_at,
            host: _,
            host_lost,
            function: _,
            amplitude: _,
            parameters: _,
            parameters_changed,
            address,
            power_off_position,
            gear_numerator,
            origin_asked,
            set_origin,
            save_asked,
            output_was_enabled,
            controlword,
            mode,
            own_motion,
            next_point,
            axis,
            servo,
            weakening,
            demand,
            duty,
            alarms,
            protection,
            pulses,
            inputs,
            battery,
            dir,
            dir_changes,
            awake,
            angle_count,
            shaft_count,
            turns,
            position,
            shown_velocity_rpm,
            shown_current_a,
            periods,
            base_periods,
        } = self;
        // The lights go by the time in the lamp test, with an alarm and without a full battery.
        let tested = now.nanos_since(*powered_at) >= LAMP_TEST_MS * 1_000_000;
        let lights_are_steady = tested && alarms.latched().is_empty() && *battery == Battery::Full;
        lights_are_steady
            && !(*parameters_changed || *save_asked || *set_origin)
            && (awake, host_lost, output_was_enabled)
                == (&earlier.awake, &earlier.host_lost, &earlier.output_was_enabled)
            && (address, power_off_position) == (&earlier.address, &earlier.power_off_position)
            && (gear_numerator, origin_asked) == (&earlier.gear_numerator, &earlier.origin_asked)
            && (controlword, mode) == (&earlier.controlword, &earlier.mode)
            && (own_motion, next_point) == (&earlier.own_motion, &earlier.next_point)
            && (axis, servo, weakening) == (&earlier.axis, &earlier.servo, &earlier.weakening)
            && (demand, duty) == (&earlier.demand, &earlier.duty)
            && (alarms, protection) == (&earlier.alarms, &earlier.protection)
            && (pulses, inputs) == (&earlier.pulses, &earlier.inputs)
            && (dir, dir_changes) == (&earlier.dir, &earlier.dir_changes)
            && (angle_count, shaft_count, turns) == (&earlier.angle_count, &earlier.shaft_count, &earlier.turns)
            && *position == earlier.position
            && (shown_velocity_rpm, shown_current_a) == (&earlier.shown_velocity_rpm, &earlier.shown_current_a)
            && (periods, base_periods) == (&earlier.periods, &earlier.base_periods)
            && device.rests_since(&earlier.device)
    }

    fn next_event(&self) -> Option<Instant> {
        let host = self.host.and_then(|host| host.poll_timeout());
        self.device.next_event().into_iter().chain(host).min()
    }

    fn task_from(&self, at: Instant) -> Option<Instant> {
        self.device.task_from(at)
    }

    fn leave_out_tasks(&mut self, now: Instant) {
        self.device.leave_out_tasks(now);
    }
}
