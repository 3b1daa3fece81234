//! What a host's writes set in motion.

use can::Instant;
use canopen::node::Via;
use canopen::od::{DefaultValue, Slot};
use cia402::{Controlword, ModeOfOperation};

use super::{MJoint, OwnMotion};
use crate::engine::axis::{Control, Demand, HomingState, Task};
use crate::engine::device::{Application, Device};
use crate::mjoint::assumptions::{INTERPOLATION_PERIODS, SUPERVISION_PERIOD_S};
use crate::mjoint::homing::switches;
use crate::mjoint::objects::effects::{Effect, effect};
use crate::mjoint::objects::*;
use crate::mjoint::origin::OriginWrite;
use crate::mjoint::parameters::TimeBase;
use crate::mjoint::variations::ORIGIN_AT_EDGE;

/// From one point of an interpolation to the next.
const INTERPOLATION_PERIOD_S: f64 = INTERPOLATION_PERIODS as f64 * SUPERVISION_PERIOD_S as f64;

/// The RPDO whose position waits for SYNC.
const SYNCHRONOUS_RPDO: u16 = 4;

impl Application<TableStorage> for MJoint {
    fn device(&mut self) -> &mut Device<TableStorage> {
        &mut self.device
    }

    fn restart(&mut self, now: Instant) {
        self.start(self.device.node().node_id(), self.device.bitrate(), now);
    }

    fn restart_communication(&mut self, now: Instant) {
        self.device.restart_communication(now);
        self.host.restart_communication(self.values().get(CONSUMER_HEARTBEAT_TIME));
    }

    /// Any write may change the status, and the answer to the same frame may carry it.
    fn written(&mut self, slot: Slot, raw: u32, via: Via, _now: Instant) -> bool {
        self.act_on(slot, raw, via);
        true
    }

    fn show_status(&mut self) {
        self.publish_status();
    }

    fn communication_task(&mut self, _now: Instant) {
        self.save();
    }
}

impl MJoint {
    /// A peer wrote `raw` to `slot`.
    pub(super) fn act_on(&mut self, slot: Slot, raw: u32, via: Via) {
        match effect(slot) {
            Effect::Command => self.command(Controlword(raw as u16)),
            Effect::SelectMode => self.mode_written(ModeOfOperation(raw as u8 as i8), via),
            Effect::Target => self.target_written(raw as i32, via),
            Effect::Increment => self.increment(raw as i32),
            Effect::Follow => {}
            Effect::ModbusEnable => self.modbus_enable(raw == 1),
            Effect::DeviceAddress => self.device_address(raw),
            Effect::OutputEnabled => self.output_enabled(raw == 1),
            Effect::AlarmCode => self.clear_alarm(raw == 0),
            Effect::GearNumerator => self.gear_numerator(raw as u16),
            Effect::Save => self.save_asked = raw == 1,
            Effect::ConsumerHeartbeat => self.configure_host(raw),
            Effect::Parameter => self.parameters_changed = true,
        }
    }

    /// 6040h. The host takes the motor over with bit 0; bit 7 resets alarms; bit 4 clears itself.
    fn command(&mut self, asked: Controlword) {
        self.refresh_parameters();
        // RPDO1 and 3 carry a mode behind the controlword, which is meant in that mode.
        let mode = ModeOfOperation(self.values().get(MODES_OF_OPERATION));
        if mode != ModeOfOperation::HOMING {
            self.select_mode(mode);
        }
        if asked.has(Controlword::FAULT_RESET) {
            self.reset_alarms();
        }
        if asked.has(Controlword::SWITCH_ON) {
            self.take_from_pulses();
        }
        self.orders.controlword = Controlword(asked.0 & !Controlword::NEW_SET_POINT);
        self.device.values_mut().set(CONTROLWORD, self.orders.controlword.0);
        self.update_power_stage();
        if !self.may_move() {
            self.orders.next_point = None;
        }
        if asked.has(Controlword::NEW_SET_POINT) && self.orders.mode == ModeOfOperation::PROFILE_POSITION {
            let target = self.values().get(TARGET_POSITION);
            self.start_move(target);
        }
    }

    /// 6060h. An RPDO repeats the mode with whatever it brings, and means a new homing only when the mode is new.
    fn mode_written(&mut self, mode: ModeOfOperation, via: Via) {
        let repeated = mode == self.orders.mode && matches!(via, Via::Rpdo(_));
        if !repeated {
            self.select_mode(mode);
        }
    }

    /// Homing starts with the write, each time, unless it is under way.
    fn select_mode(&mut self, mode: ModeOfOperation) {
        self.refresh_parameters();
        if mode == ModeOfOperation::HOMING {
            if !self.is_homing() {
                self.begin_homing(mode);
            }
        } else if mode != self.orders.mode {
            self.orders.next_point = None;
            self.rest();
            self.axis.forget_homing();
        }
        self.orders.mode = mode;
        self.update_power_stage();
    }

    fn begin_homing(&mut self, mode: ModeOfOperation) {
        self.orders.mode = mode;
        self.orders.next_point = None;
        self.orders.own_motion = OwnMotion::None;
        let levels = self.terminals.levels();
        let (pu, dir) = (levels & 1 != 0, levels & 2 != 0);
        let mut homing = self.parameters.homing;
        self.axis.set_switches(switches(homing.sequence, pu, dir));
        if self.can_be_live() {
            self.engage();
        } else {
            homing.sequence = None;
        }
        self.axis.begin(Task::Home(homing));
    }

    /// Homing is on its way.
    pub(super) fn is_homing(&self) -> bool {
        matches!(self.homing(), HomingState::Running | HomingState::Stopping)
    }

    /// Homing has the motor: on the way, and holding at its end.
    pub(super) fn has_homing_the_motor(&self) -> bool {
        self.is_homing() || self.homing() == HomingState::Attained
    }

    /// Where homing stands; the origin may be made at the edge, before the shaft has come to rest.
    pub(super) fn homing(&self) -> HomingState {
        match self.axis.homing() {
            HomingState::Stopping if self.device.variant().is(ORIGIN_AT_EDGE) => HomingState::Attained,
            state => state,
        }
    }

    /// Slows down and stays: whatever was under way is over.
    pub(super) fn rest(&mut self) {
        self.axis.begin(Task::Hold { control: Control::Position, ramp: self.parameters.ramp });
    }

    /// 607Ah: with bit 5 each write starts a move, and so does SYNC with the position of RPDO4. Else it waits.
    fn target_written(&mut self, target: i32, via: Via) {
        let with_sync = matches!(via, Via::Rpdo(number) if number.number() == SYNCHRONOUS_RPDO);
        let immediately = with_sync || self.orders.controlword.has(Controlword::CHANGE_SET_IMMEDIATELY);
        match self.orders.mode {
            ModeOfOperation::PROFILE_POSITION if immediately => self.start_move(target),
            ModeOfOperation::INTERPOLATED_POSITION if self.may_move() => self.interpolate_to(target),
            _ => {}
        }
    }

    /// 261Ch: above 0 the time base begins with SYNC, and the next point is taken up at once; else it runs by itself and
    /// takes the point up when it is over. With 255 it begins with SYNC too, and goes on with DIR.
    fn interpolate_to(&mut self, target: i32) {
        if self.parameters.time_base != TimeBase::Own {
            self.terminals.take_dir_changes();
            let at_rest = self.axis.is_resting();
            self.interpolate(target);
            self.rhythm.synchronise(at_rest);
        } else {
            self.orders.next_point = Some(target);
        }
    }

    /// To the next point of an interpolation.
    pub(super) fn interpolate(&mut self, target: i32) {
        let max_speed = self.parameters.max_speed;
        self.axis.begin(Task::Interpolate { target, time_s: INTERPOLATION_PERIOD_S, max_speed });
    }

    fn start_move(&mut self, target: i32) {
        if !self.may_move() {
            return;
        }
        self.refresh_parameters();
        let relative = self.orders.controlword.has(Controlword::RELATIVE);
        let target = if relative { self.axis.target().wrapping_add(target) } else { target };
        self.axis.begin(Task::Move { target, limits: self.parameters.moves });
    }

    /// 260Ch: so many counts more, at once.
    fn increment(&mut self, by: i32) {
        if self.may_move() && self.orders.mode == ModeOfOperation::PROFILE_POSITION {
            self.refresh_parameters();
            let target = self.axis.target().wrapping_add(by);
            self.axis.begin(Task::Move { target, limits: self.parameters.moves });
        }
    }

    /// 2600h: 1 makes pulses invalid, as bit 0 of the controlword does.
    fn modbus_enable(&mut self, enabled: bool) {
        if enabled {
            self.take_from_pulses();
            self.update_power_stage();
        }
    }

    /// The motor is the host's: what it did by itself ends where it is.
    fn take_from_pulses(&mut self) {
        if self.orders.end_own_motion() {
            self.rest();
        }
    }

    /// 2615h: "setting the device address via SDO sets this value as well" (5.08.2), the identifiers of PDOs, at once. The
    /// node-ID itself waits for a power cycle.
    fn device_address(&mut self, address: u32) {
        let before = core::mem::replace(&mut self.address, address);
        for (slot, row) in self.values().table().iter() {
            let DefaultValue::NodeIdPlus(base) = row.default else { continue };
            // After an NMT reset of communication they may be those of the node-ID again.
            let raw = self.values().raw(slot);
            if raw == base + before || raw == base + u32::from(self.device.node().node_id().raw()) {
                self.device.write_own(slot, base + address);
            }
        }
    }

    /// 2601h: 0 takes the power stage away, a 1 after it resets alarms.
    fn output_enabled(&mut self, enabled: bool) {
        if self.orders.enable_output(enabled) {
            self.reset_alarms();
        }
        if !enabled {
            self.orders.own_motion = OwnMotion::None;
            self.fail_homing();
        }
        self.update_power_stage();
    }

    fn clear_alarm(&mut self, clear: bool) {
        if clear {
            self.reset_alarms();
        }
        self.publish_alarms();
    }

    /// 260Ah: 60006 and then 60016 make the present position the origin, and neither stays.
    fn gear_numerator(&mut self, value: u16) {
        match self.origin.write(value) {
            OriginWrite::Numerator => {
                self.parameters_changed = true;
                return;
            }
            OriginWrite::First => {}
            OriginWrite::Second => self.make_origin(),
        }
        let kept = self.origin.gear_numerator();
        self.device.values_mut().set(GEAR_NUMERATOR, kept);
    }

    /// The present position becomes 0 with the next control period; the turns are known again.
    pub(super) fn make_origin(&mut self) {
        self.origin.make();
        self.protection.origin_set();
        self.alarms.release(crate::mjoint::alarms::row::BATTERY);
        self.publish_alarms();
    }

    /// 1016h:01. The watch begins anew with the next heartbeat.
    fn configure_host(&mut self, raw: u32) {
        self.host.configure(raw);
        self.alarms.release(crate::mjoint::alarms::row::COMMUNICATION);
        self.publish_alarms();
    }

    /// Pulses are ignored and the host's targets count: bit 0 of the controlword, or 2600h.
    pub(super) fn is_host_in_control(&self) -> bool {
        self.orders.controlword.has(Controlword::SWITCH_ON) || self.values().get(MODBUS_ENABLE) == 1
    }

    /// The host's targets may move the motor.
    pub(super) fn may_move(&self) -> bool {
        self.axis.is_engaged() && self.is_host_in_control() && self.orders.allow_motion()
    }

    /// Nothing forbids the power stage.
    pub(super) fn can_be_live(&self) -> bool {
        let releasing = self.alarms.latched().0 & crate::mjoint::alarms::RELEASING.0;
        self.encoder.is_awake() && self.values().get(OUTPUT_ENABLED) == 1 && releasing == 0
    }

    /// The power stage drives the motor: bit 1 of the controlword, homing in mode 6, or the joint's own motion.
    fn wants_to_be_live(&self) -> bool {
        self.can_be_live() && (self.orders.want_power() || self.has_homing_the_motor())
    }

    /// Takes the shaft over or lets go of it, as it has become right.
    pub(super) fn update_power_stage(&mut self) {
        let live = self.wants_to_be_live();
        if live {
            self.engage();
        } else if !live && self.axis.is_engaged() {
            self.axis.release();
            self.orders.next_point = None;
            self.output.demand = Demand::Off;
        }
    }

    /// Takes the shaft over as it turns, and brings it to rest.
    fn engage(&mut self) {
        if !self.axis.is_engaged() {
            self.axis.engage();
            self.rest();
        }
    }
}
