//! What a host sets in motion: its writes, and NMT resets.

use can::Instant;
use canopen::node::Via;
use canopen::od::Slot;
use cia402::{Controlword, ModeOfOperation, PowerState};

use super::Zlim42c;
use crate::engine::device::{self, Application, Device};
use crate::zlim42c::faults::row;
use crate::zlim42c::objects::effects::{Effect, effect};
use crate::zlim42c::objects::*;
use crate::zlim42c::restart;
use crate::zlim42c::variations::FAULTS_STAY;
use crate::zltech;

impl Application<TableStorage> for Zlim42c {
    fn device(&mut self) -> &mut Device<TableStorage> {
        &mut self.device
    }

    fn restart(&mut self, now: Instant) {
        let stored = self.device.stored_values();
        let node_id = restart::node_id(self.dip_address, &stored);
        self.device.restart(node_id, restart::bitrate(&stored), now);
        self.device.values_mut().set(NODE_ID, u16::from(node_id.raw()));
        let (before, mut stepper) = (self.parameters.model, self.stepper.restarted());
        *self = Self { dip_address: self.dip_address, ..Self::over(self.device.clone(), self.fidelity) };
        stepper.rescale(before.pulses_per_electrical_turn, self.parameters.model.pulses_per_electrical_turn);
        self.stepper = stepper;
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
            Effect::SelectMode => self.shell.axis.request_mode(ModeOfOperation(raw as u8 as i8)),
            Effect::Registers => self.registers(raw, now),
            Effect::FaultReset => self.fault_reset(raw, now),
            Effect::ClearPosition => self.clear_position(raw),
            Effect::Target => {}
            Effect::Parameter => self.shell.parameters_changed = true,
        }
        matches!(effect, Effect::Command | Effect::SelectMode)
    }

    fn communication_task(&mut self, now: Instant) {
        self.device.commit();
        self.device.notice_changes(now);
    }

    fn show_status(&mut self) {
        self.publish_status();
    }
}

device::station!(Zlim42c);

impl Zlim42c {
    fn command(&mut self, controlword: Controlword, now: Instant) {
        self.refresh_parameters();
        self.controlword = controlword;
        let target = self.values().get(TARGET_POSITION);
        if self.shell.axis.command(controlword, target, &self.parameters.axis) && self.can_reset_faults() {
            self.reset_faults(now);
        }
    }

    /// Save or restore. An EEPROM fault ends with the factory settings.
    fn registers(&mut self, command: u32, now: Instant) {
        if zltech::register_command(&mut self.device, REGISTER_PARAMETER_SETTING, command, |_| true) {
            self.shell.parameters_changed = true;
            if self.faults.forget(row::EEPROM) {
                self.reset_faults(now);
            }
        }
    }

    /// 2011h: reads 0 again when it is done.
    fn fault_reset(&mut self, raw: u32, now: Instant) {
        if raw == 1 && self.shell.axis.state() == PowerState::Fault && self.can_reset_faults() {
            self.reset_faults(now);
        }
        self.device.values_mut().set(FAULT_RESET, 0);
    }

    fn can_reset_faults(&self) -> bool {
        !self.device.variant().is(FAULTS_STAY)
    }

    /// 2012h: reads 0 again when it is done.
    fn clear_position(&mut self, raw: u32) {
        if raw == 1 {
            self.shift_position(self.stepper.position());
        }
        self.device.values_mut().set(CLEAR_CURRENT_POSITION, 0);
    }
}
