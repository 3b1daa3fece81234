//! What a host sets in motion: its writes, and NMT resets.

use can::Instant;
use canopen::node::Via;
use canopen::od::{Entry, Slot};
use cia402::{Controlword, ModeOfOperation, PowerState};

use super::Zlac8030l;
use crate::engine::device::{self, Application, Device};
use crate::zlac8030l::faults::row;
use crate::zlac8030l::objects::effects::{Effect, effect};
use crate::zlac8030l::objects::*;
use crate::zlac8030l::restart;
use crate::zlac8030l::variations::{MODE_NOT_SAVED, SYNC_FEEDS_WATCHDOG};
use crate::zltech;

impl Application<TableStorage> for Zlac8030l {
    fn device(&mut self) -> &mut Device<TableStorage> {
        &mut self.device
    }

    fn restart(&mut self, now: Instant) {
        let stored = self.device.stored_values();
        self.device.restart(restart::node_id(self.dip_address, &stored), restart::bitrate(&stored), now);
        *self = Self { dip_address: self.dip_address, ..Self::over(self.device.clone(), self.fidelity()) };
        self.select_mode();
        self.shell.axis.self_test_done();
        self.publish_status();
        self.device.boot(now);
    }

    #[inline]
    fn written(&mut self, slot: Slot, raw: u32, _via: Via, now: Instant) -> bool {
        zltech::mark_if_saving(&mut self.device, SAVE_ON_WRITE, slot);
        let effect = effect(slot);
        match effect {
            Effect::Command => self.command(Controlword(raw as u16), now),
            Effect::SelectMode => self.select_mode(),
            Effect::Registers => self.registers(raw, now),
            Effect::ClearPosition => self.clear_position(slot, raw),
            Effect::Target => {}
            Effect::Parameter => self.shell.parameters_changed = true,
        }
        matches!(effect, Effect::Command | Effect::SelectMode)
    }

    fn synchronised(&mut self, now: Instant) {
        if self.device.variant().is(SYNC_FEEDS_WATCHDOG) {
            self.last_sync = Some(now);
        }
    }

    fn communication_task(&mut self, now: Instant) {
        let timeout_ns = u64::from(self.values().get(COMMUNICATION_OFFLINE_TIME)) * 1_000_000;
        let armed = self.shell.axis.state() == PowerState::OperationEnabled;
        let heard = self.device.last_addressed().max(self.last_sync);
        if self.watchdog.poll(armed, heard, timeout_ns, now) {
            self.shell.axis.on_host_timeout();
            self.drop_targets();
        }
        self.device.commit();
        self.device.notice_changes(now);
    }

    fn show_status(&mut self) {
        self.publish_status();
    }
}

device::station!(Zlac8030l);

impl Zlac8030l {
    fn command(&mut self, controlword: Controlword, now: Instant) {
        self.refresh_parameters();
        let target = self.values().get(TARGET_POSITION);
        let relative = controlword.has(Controlword::RELATIVE);
        // An SDO write was refused for this already; an RPDO can only be ignored.
        let in_range = relative || target.unsigned_abs() <= ABSOLUTE_TARGET_LIMIT.unsigned_abs();
        let taken = if in_range { controlword } else { Controlword(controlword.0 & !Controlword::NEW_SET_POINT) };
        if self.shell.axis.command(taken, target, &self.parameters.axis) {
            self.reset_faults(now);
        }
    }

    /// 6060h.
    fn select_mode(&mut self) {
        self.shell.axis.request_mode(ModeOfOperation(self.values().get(MODES_OF_OPERATION)));
    }

    /// Save or restore. An EEPROM fault ends with the factory settings.
    fn registers(&mut self, command: u32, now: Instant) {
        let about = if self.device.variant().is(MODE_NOT_SAVED) { |row: &Entry| row.stored } else { Entry::is_kept };
        if zltech::register_command(&mut self.device, REGISTER_PARAMETER_SETTING, command, about) {
            self.shell.parameters_changed = true;
            self.select_mode();
            if self.faults.forget(row::EEPROM) {
                self.reset_faults(now);
            }
        }
    }

    /// 2005h and 2006h: 6064h becomes 0, whatever moves goes on moving. They read 0 again when it is done.
    fn clear_position(&mut self, slot: Slot, raw: u32) {
        if raw == 1 {
            let position = self.position();
            self.position_offset = self.position_offset.wrapping_sub(position);
            self.shell.shift_position(position);
            self.device.values_mut().set(POSITION_ACTUAL_VALUE, 0);
        }
        self.device.values_mut().set_raw(slot, 0);
    }
}
