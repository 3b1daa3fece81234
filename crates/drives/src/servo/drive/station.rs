//! The drive on the bus.

use can::{Frame, Instant, Station};
use canopen::node::Via;
use canopen::od::{Slot, Storage};

use super::ServoDrive;
use crate::engine::device::{Application, Device};
use crate::servo::shaft::Written;

impl<S: Storage> Application<S> for ServoDrive<S> {
    fn device(&mut self) -> &mut Device<S> {
        &mut self.device
    }

    fn written(&mut self, slot: Slot, raw: u32, _via: Via, now: Instant) -> bool {
        if self.services.written(&mut self.device, slot, raw) {
            return false;
        }
        let mut reset = false;
        let mut commanded = false;
        for (shaft, probes) in self.shafts.iter_mut().zip(self.probes) {
            let Some(shaft) = shaft else { continue };
            match shaft.written(self.device.values(), slot, probes) {
                Written::Elsewhere => continue,
                Written::Command => commanded = true,
                Written::FaultReset => reset = true,
                Written::Value => {}
            }
        }
        if reset {
            self.reset_faults(now);
        }
        commanded
    }

    fn show_status(&mut self) {
        let values = self.device.values_mut();
        for shaft in self.shafts.iter().flatten() {
            shaft.publish_status(values);
        }
    }

    fn restart(&mut self, now: Instant) {
        self.restart_firmware(now);
    }

    fn restart_communication(&mut self, now: Instant) {
        self.restart_communication_only(now);
    }

    fn communication_task(&mut self, now: Instant) {
        self.device.notice_changes(now);
    }
}

impl<S: Storage> Station for ServoDrive<S> {
    fn ignores(&self, frame: &Frame) -> bool {
        self.device.ignores(frame) && !self.services.wants(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.device.is_running() && self.services.wants(frame) && self.services.handle_frame(frame, now) {
            self.regain_connection(now);
        }
        self.device.handle_frame(frame, now);
        self.handle_events(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.device.handle_timeout(now);
        self.handle_events(now);
        if self.device.is_running() && self.services.handle_timeout(now) {
            self.lose_connection(now);
        }
        if self.device.is_task_due(now) {
            self.communication_task(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        let frame = self.device.poll_transmit()?;
        self.services.sent(self.device.values_mut(), &frame);
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = self.device.poll_timeout();
        let watch = self.services.poll_timeout().filter(|_| self.device.is_running());
        match (own, watch) {
            (Some(own), Some(watch)) => Some(own.min(watch)),
            (own, watch) => own.or(watch),
        }
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.device.handle_transmitted(frame, now);
    }
}
