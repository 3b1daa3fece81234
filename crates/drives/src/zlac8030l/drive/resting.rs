//! When the control periods of this drive change nothing any more.

use can::Instant;
use cia402::PowerState;

use super::{COMMUNICATION_OFFLINE_TIME, SUPERVISION_DIVIDER, Zlac8030l};
use crate::Resting;

impl Resting for Zlac8030l {
    const ROUND: u32 = SUPERVISION_DIVIDER as u32;

    fn rests_since(&self, earlier: &Self, _now: Instant) -> bool {
        // Each by name, so that no new one is forgotten. The watch over the host goes by the time while it is armed.
        let Self {
            device,
            dip_address: _,
            parameters: _,
            shell,
            servo,
            awake,
            speed_setting_wrong,
            position_offset,
            faults,
            protection,
            bleeder,
            watchdog: _,
            last_sync: _,
            shown_velocity_rpm,
            shown_current_a,
        } = self;
        let watched =
            shell.axis.state() == PowerState::OperationEnabled && self.values().get(COMMUNICATION_OFFLINE_TIME) != 0;
        !watched
            && !shell.parameters_changed
            && (*awake, *speed_setting_wrong) == (earlier.awake, earlier.speed_setting_wrong)
            && *position_offset == earlier.position_offset
            && *shell == earlier.shell
            && *servo == earlier.servo
            && *faults == earlier.faults
            && *protection == earlier.protection
            && *bleeder == earlier.bleeder
            && (shown_velocity_rpm, shown_current_a) == (&earlier.shown_velocity_rpm, &earlier.shown_current_a)
            && device.rests_since(&earlier.device)
    }

    fn next_event(&self) -> Option<Instant> {
        self.device.next_event()
    }

    fn task_from(&self, at: Instant) -> Option<Instant> {
        self.device.task_from(at)
    }

    fn task_is_idle(&self) -> bool {
        self.values().get(COMMUNICATION_OFFLINE_TIME) == 0 && self.device.is_task_idle()
    }

    fn leave_out_tasks(&mut self, now: Instant) {
        self.device.leave_out_tasks(now);
    }
}
