//! The drive: the engine's parts joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`, in [`commands`]), the communication task every 0.5 ms
//! (`handle_timeout`), and the control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision
//! period ([`control`]).

mod commands;
mod control;
mod publish;
mod registers;
mod resting;

use can::{Bitrate, Frame, Instant, Station};
use canopen::NodeId;
use canopen::node::{Node, NodeProfile};
use canopen::sdo::server::FrameLength;
use cia402::PowerState;
use devices::AxisId;

use super::alarms::{self, ALARM_COUNT, ALARMS, row};
use super::assumptions::*;
use super::encoder::Encoder;
use super::hardware::{Actuation, Battery, Brake, Hardware, Sensors};
use super::host_heartbeat::{HostEvent, HostHeartbeat};
use super::leds::{LAMP_TEST_MS, leds};
use super::model::Model;
use super::objects::*;
use super::orders::{Orders, OwnMotion};
use super::origin::Origin;
use super::output::Output;
use super::parameters::Parameters;
use super::power_on::Function;
use super::protection::Protection;
use super::rhythm::Rhythm;
use super::terminals::InputTerminals;
use super::variations::{self, VARIANT};
use super::{Values, storage};
use crate::communication::communication;
use crate::engine::actuator::servo::CurrentGains;
use crate::engine::axis::{Axis, Demand};
use crate::engine::device::{Application, Device, ResetTimes};
use crate::engine::faults::FaultMonitor;
use crate::engine::storage::StoredImage;
use crate::{Fidelity, Firmware, Report};
use devices::variant::Variant;

/// How this drive communicates: operational from the start, SDO requests as short as they may be, TPDO n answers
/// RPDO n, no EMCY (5.05, 5.08, 5.11).
pub static NODE_PROFILE: NodeProfile = NodeProfile {
    conditions: &CONDITIONS,
    sdo_frame_length: FrameLength::Used,
    ..communication(&devices::mjoint::M4230E17B50)
};

/// The same with firmware 1.66.
static NODE_PROFILE_1_66: NodeProfile = NodeProfile {
    conditions: &CONDITIONS,
    sdo_frame_length: FrameLength::Used,
    ..communication(&devices::mjoint::M4230E17B50_1_66)
};

/// State byte of heartbeats while there is an alarm (5.11.1).
const HEARTBEAT_ALARM: u8 = 0x04;

/// The firmware of an M joint motor.
#[derive(Clone)]
pub struct MJoint {
    model: &'static Model,
    device: Device<TableStorage>,
    powered_at: Instant,
    host: HostHeartbeat,
    parameters: Parameters,
    parameters_changed: bool,
    /// 2615h, which the identifiers of PDOs follow at once.
    address: u32,
    save_asked: bool,
    origin: Origin,
    orders: Orders,
    axis: Axis,
    output: Output,
    alarms: FaultMonitor<ALARM_COUNT>,
    protection: Protection,
    terminals: InputTerminals,
    battery: Battery,
    encoder: Encoder,
    rhythm: Rhythm,
}

impl MJoint {
    /// A drive without supply. [`Firmware::power_on`] starts it.
    pub fn new(model: &'static Model) -> Self {
        Self::of(model, VARIANT)
    }

    /// The same of another variant.
    pub fn of(model: &'static Model, variant: Variant) -> Self {
        let image = StoredImage::of(&storage::delivered(&variant));
        let profile = if variant.is(variations::FIRMWARE_1_66) { &NODE_PROFILE_1_66 } else { &NODE_PROFILE };
        Self::over(model, Device::new(profile, Bitrate::M1, image, COMMUNICATION_PERIOD_NS, variant), Fidelity::Full)
    }

    /// Motor free, and the values of `device` in effect.
    fn over(model: &'static Model, device: Device<TableStorage>, fidelity: Fidelity) -> Self {
        let function = Function::from_raw(device.values().get(MODE_SELECTION)).unwrap_or_default();
        let amplitude = variations::amplitude_per_a(device.variant());
        let parameters = Parameters::from(device.values(), model, function, amplitude, fidelity);
        Self {
            model,
            origin: Origin::new(device.values().get(GEAR_NUMERATOR)),
            address: u32::from(device.values().get(DEVICE_ADDRESS)),
            output: Output::new(&parameters),
            device,
            powered_at: Instant::ZERO,
            host: HostHeartbeat::default(),
            parameters,
            parameters_changed: false,
            save_asked: false,
            orders: Orders::new(OwnMotion::None),
            axis: Axis::new(),
            alarms: FaultMonitor::new(&ALARMS, &alarms::DEBOUNCE),
            protection: Protection::default(),
            terminals: InputTerminals::default(),
            battery: Battery::Full,
            encoder: Encoder::default(),
            rhythm: Rhythm::default(),
        }
    }

    const fn fidelity(&self) -> Fidelity {
        self.parameters.servo.fidelity
    }

    /// The model that it drives.
    pub const fn model(&self) -> &'static Model {
        self.model
    }

    /// The values of the objects, to look at.
    pub const fn values(&self) -> &Values {
        self.device.values()
    }

    /// How long the next resets by NMT take, which depends on the microcontroller: none unless it is set.
    pub const fn set_reset_times(&mut self, times: ResetTimes) {
        self.device.set_reset_times(times);
    }

    /// What the control loops are asked for, to look at.
    pub const fn demand(&self) -> &Demand {
        &self.output.demand
    }

    /// How the current loop is set, for a power stage that follows by itself.
    pub fn current_gains(&self) -> CurrentGains {
        CurrentGains::of(&self.parameters.gains.foc, &self.parameters.servo)
    }

    /// The communication side, to look at.
    pub const fn node(&self) -> &Node<TableStorage> {
        self.device.node()
    }

    /// Starts the firmware over with the stored values: motor free, then what 2619h says.
    fn start(&mut self, node_id: NodeId, bitrate: Bitrate, now: Instant) {
        self.device.restart(node_id, bitrate, now);
        let started = Self::over(self.model, self.device.clone(), self.fidelity());
        let (powered_at, encoder) = (self.powered_at, self.encoder.restarted());
        *self = Self { powered_at, encoder, orders: Orders::new(OwnMotion::Starting), ..started };
        if self.values().get(POSITION_ACTUAL_INTERNAL_VALUE) == NO_RECORD {
            self.device.values_mut().set(POSITION_ACTUAL_INTERNAL_VALUE, 0);
        }
        let by_host = self.origin.gear_numerator() == 0 || self.parameters.function == Function::CommunicationControl;
        self.device.values_mut().set(MODBUS_ENABLE, u16::from(by_host));
        self.host.configure(self.values().get(CONSUMER_HEARTBEAT_TIME));
        self.publish_status();
        self.device.boot(now);
    }

    fn on_host(&mut self, event: Option<HostEvent>) {
        match event {
            Some(HostEvent::Lost) => {
                self.alarms.raise(row::COMMUNICATION);
            }
            Some(HostEvent::Back) => self.alarms.release(row::COMMUNICATION),
            None => return,
        }
        self.publish_alarms();
        self.publish_status();
    }

    /// Stores what 2614h asked for: reads 2 when it is done, and 1 for as long as the EEPROM does not answer.
    fn save(&mut self) {
        let node_id = self.device.node().node_id();
        if self.save_asked && self.device.save(&storage::contents(self.values(), node_id)) {
            self.save_asked = false;
            self.device.values_mut().set(DATA_SAVE_FLAG, 2);
        }
    }

    /// The last thing that the falling supply voltage lets it do.
    fn record_position(&mut self) {
        if self.device.is_running() && self.encoder.is_awake() {
            self.device.mark(POSITION_ACTUAL_INTERNAL_VALUE.slot());
            self.device.commit();
        }
    }

    fn actuation(&mut self, now: Instant) -> Actuation {
        let alarm = alarms::code(self.alarms.latched());
        let lit = leds(alarm, self.battery, now.nanos_since(self.powered_at) / 1_000_000);
        Actuation {
            running: true,
            power_stage: self.output.power_stage(),
            brake: self.brake(),
            set_origin: self.origin.take(),
            zero_output: self.encoder.position() < 0,
            alarm_output: (alarm != 0) == self.parameters.alarm_conducts,
            red_led: lit.red,
            green_led: lit.green,
        }
    }

    fn brake(&self) -> Brake {
        match (self.parameters.function.has_brake(), self.axis.is_engaged()) {
            (false, _) => Brake::Absent,
            (true, true) => Brake::Released,
            (true, false) => Brake::Engaged,
        }
    }
}

/// As the others' but for the heartbeat of the host, which the joint listens to by itself.
impl Station for MJoint {
    fn ignores(&self, frame: &Frame) -> bool {
        self.device.ignores(frame) && self.host.ignores(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let event = self.host.handle_frame(frame, now);
        self.on_host(event);
        self.device.handle_frame(frame, now);
        self.handle_events(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        let event = self.host.handle_timeout(now);
        self.on_host(event);
        self.device.handle_timeout(now);
        self.finish_reset(now);
        self.handle_events(now);
        if self.device.is_task_due(now) {
            self.communication_task(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.device.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let host = self.host.poll_timeout().unwrap_or(Instant::FAR_FUTURE);
        self.device.poll_timeout().map(|device| device.min(host))
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.device.handle_transmitted(frame, now);
    }
}

impl Firmware for MJoint {
    type Sensors = Sensors;
    type Actuation = Actuation;
    type Hardware = Hardware;

    const CONTROL_PERIOD_NS: u64 = CONTROL_PERIOD_NS;
    const MECHANICAL_PERIODS: Option<[u32; 2]> = Some([SUPERVISION_DIVIDER as u32; 2]);

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        *self = Self::over(self.model, self.device.clone(), fidelity);
    }

    fn power_on(&mut self, hardware: &Hardware, now: Instant) {
        self.device.power_on(hardware.eeprom);
        self.powered_at = now;
        let values = self.device.stored_values();
        let readable = self.device.is_eeprom_sound();
        let has_brake = Function::from_raw(values.get(MODE_SELECTION)).is_some_and(Function::has_brake);
        let record = Some(values.get(POSITION_ACTUAL_INTERNAL_VALUE)).filter(|record| readable && *record != NO_RECORD);
        self.encoder.power_on(record, has_brake);
        let address = u8::try_from(values.get(DEVICE_ADDRESS)).ok().and_then(NodeId::new);
        self.start(address.unwrap_or(NodeId::MIN), hardware.bitrate, now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.record_position();
        self.device.power_off();
        self.host.power_off();
        self.axis = Axis::new();
        self.output.demand = Demand::Off;
    }

    // Inlined by force: a run of a machine that wakes up calls it too, and the frequent caller would not get it.
    #[inline(always)]
    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.device.is_running() {
            return Actuation::default();
        }
        self.device.set_eeprom_ok(!sensors.eeprom_fails);
        self.sense(sensors);
        self.watch_for_origin(sensors);
        if self.rhythm.is_supervision_due(self.fidelity().tick(SUPERVISION_DIVIDER, 1)) {
            self.supervise(sensors);
        }
        self.output.modulate(&self.parameters, sensors);
        self.actuation(now)
    }

    fn eeprom(&self) -> (&[u8], u32) {
        self.device.eeprom()
    }

    fn is_storing(&self) -> bool {
        self.device.is_storing() || (self.save_asked && self.device.takes_stores())
    }

    fn report(&self, _axis: AxisId) -> Report {
        Report {
            powered: self.device.is_running(),
            node_id: self.device.node().node_id(),
            bitrate: self.device.bitrate(),
            nmt: self.device.node().state(),
            state: self.power_state(),
            mode: self.orders.mode,
            fault_code: alarms::code(self.alarms.latched()),
            position_counts: self.encoder.position(),
            velocity_rpm: self.output.servo.velocity_rpm(),
            current_a: self.output.shown_current_a(),
            brake_engaged: self.device.is_running() && self.brake() == Brake::Engaged,
        }
    }
}

impl MJoint {
    /// The nearest states of CiA 402, for people.
    fn power_state(&self) -> PowerState {
        if (self.alarms.latched().0 & alarms::RELEASING.0) != 0 {
            PowerState::Fault
        } else if self.axis.is_engaged() {
            PowerState::OperationEnabled
        } else {
            PowerState::SwitchOnDisabled
        }
    }
}
