//! The drive: the engine's parts joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`, in [`commands`]), the communication task every 0.5 ms
//! (`handle_timeout`), and the control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision
//! period ([`control`]).

mod commands;
mod control;
mod publish;
mod registers;

use can::{Bitrate, Frame, Instant, Station};
use canopen::NmtState;
use canopen::NodeId;
use canopen::heartbeat::{Consumer, ConsumerEvent};
use canopen::node::{Node, NodeProfile};
use canopen::od::Entry;
use canopen::pdo::EventTrigger;
use canopen::sdo::server::FrameLength;
use cia402::{Controlword, ModeOfOperation, PowerState};
use motion::filter::LowPass;

use super::alarms::{self, ALARM_COUNT, ALARMS, row};
use super::axis::Axis;
use super::hardware::{Actuation, Battery, Brake, Hardware, PowerStage, Sensors};
use super::homing::Run;
use super::leds::leds;
use super::model::Model;
use super::objects::*;
use super::parameters::Parameters;
use super::power_on::Function;
use super::protection::Protection;
use super::pulses::Pulses;
use super::readings::*;
use super::turns::Turns;
use super::{Values, storage};
use crate::engine::axis::Demand;
use crate::engine::faults::FaultMonitor;
use crate::engine::inputs::Inputs;
use crate::engine::servo::Servo;
use crate::engine::storage::Store;
use crate::{Firmware, Report};

/// How this drive communicates: operational from the start, SDO requests as short as they may be, TPDO n answers
/// RPDO n, no EMCY (5.05, 5.08, 5.11).
pub static NODE_PROFILE: NodeProfile = NodeProfile {
    start_state: NmtState::Operational,
    emcy: false,
    event_trigger: EventTrigger::AnswersRpdo,
    pdo_changes_while_valid: true,
    sdo_frame_length: FrameLength::Used,
    ..NodeProfile::cia_301(&TABLE)
};

/// State byte of heartbeats while there is an alarm (5.11.1).
const HEARTBEAT_ALARM: u8 = 0x04;

/// The firmware of an M joint motor.
#[derive(Clone)]
pub struct MJoint {
    model: &'static Model,
    node: Node<ROW_COUNT>,
    store: Store,
    bitrate: Bitrate,
    running: bool,
    powered_at: Instant,
    host: Option<Consumer>,
    host_lost: bool,
    /// 2619h as it was at power-on.
    function: Function,
    parameters: Parameters,
    parameters_changed: bool,
    /// 260Ah without the two values that set the origin.
    gear_numerator: u16,
    /// 60006 has been written to 260Ah.
    origin_asked: bool,
    set_origin: bool,
    save_asked: bool,
    eeprom_fails: bool,
    output_was_enabled: bool,

    controlword: Controlword,
    mode: ModeOfOperation,
    homing: Homing,
    own_motion: OwnMotion,
    /// A target of mode 7 that waits for the free-running time base.
    next_point: Option<i32>,

    axis: Axis,
    servo: Servo,
    demand: Demand,
    duty: [f32; 3],
    alarms: FaultMonitor<ALARM_COUNT>,
    protection: Protection,
    pulses: Pulses,
    inputs: Inputs<2>,
    battery: Battery,
    /// Level of DIR, and how often it has changed since the time base of the interpolation went on.
    dir: bool,
    dir_changes: u8,

    /// The sensors have been looked at since the start.
    awake: bool,
    angle_count: u16,
    /// Counts of the shaft, wrapping: the encoder's angle followed over its turns.
    shaft_count: u16,
    turns: Turns,
    position: i32,
    shown_velocity_rpm: LowPass,
    shown_current_a: LowPass,
    periods: u8,
    /// Supervision periods in the present 2 ms.
    base_periods: u8,
    next_task: Instant,
}

/// Where homing is.
#[derive(Clone, Copy, Debug)]
enum Homing {
    /// Not begun.
    None,
    Running(Run),
    Attained,
    Failed,
}

/// What the joint does without being told over CAN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OwnMotion {
    /// Nothing: it waits for a first pulse, or for a host.
    None,
    /// It has to find out where it is, and may then go somewhere (2619h).
    Starting,
    /// It goes where 2619h says.
    Returning,
    /// It follows pulses, and holds between them.
    Following,
}

impl MJoint {
    /// A drive without supply. [`Firmware::power_on`] starts it.
    pub fn new(model: &'static Model) -> Self {
        let node = Node::new(&NODE_PROFILE, NodeId::MIN);
        let function = Function::default();
        let parameters = Parameters::from(node.dictionary(), model, function);
        Self {
            model,
            gear_numerator: node.dictionary().get(GEAR_NUMERATOR),
            servo: Servo::new(&parameters.servo, 0, 0),
            node,
            store: Store::new(storage::factory()),
            bitrate: Bitrate::M1,
            running: false,
            powered_at: Instant::ZERO,
            host: None,
            host_lost: false,
            function,
            parameters,
            parameters_changed: false,
            origin_asked: false,
            set_origin: false,
            save_asked: false,
            eeprom_fails: false,
            output_was_enabled: true,
            controlword: Controlword(0),
            mode: ModeOfOperation::PROFILE_POSITION,
            homing: Homing::None,
            own_motion: OwnMotion::None,
            next_point: None,
            axis: Axis::new(),
            demand: Demand::Off,
            duty: [0.0; 3],
            alarms: FaultMonitor::new(&ALARMS),
            protection: Protection::default(),
            pulses: Pulses::default(),
            inputs: Inputs::default(),
            battery: Battery::Full,
            dir: false,
            dir_changes: 0,
            awake: false,
            angle_count: 0,
            shaft_count: 0,
            turns: Turns::default(),
            position: 0,
            shown_velocity_rpm: LowPass::default(),
            shown_current_a: LowPass::default(),
            periods: 0,
            base_periods: 0,
            next_task: Instant::ZERO,
        }
    }

    /// The model that it drives.
    pub const fn model(&self) -> &'static Model {
        self.model
    }

    /// The values of the objects, to look at.
    pub const fn values(&self) -> &Values {
        self.node.dictionary()
    }

    /// What the control loops are asked for, to look at.
    pub const fn demand(&self) -> &Demand {
        &self.demand
    }

    /// The communication side, to look at.
    pub const fn node(&self) -> &Node<ROW_COUNT> {
        &self.node
    }

    /// Starts the firmware over with the stored values: motor free, then what 2619h says.
    fn restart(&mut self, node_id: NodeId, now: Instant) {
        let mut started = Self::new(self.model);
        started.node = Node::new(&NODE_PROFILE, node_id);
        // An unreadable store leaves factory values.
        let _ = self.store.load(started.node.dictionary_mut(), |_| true);
        started.store = self.store.clone();
        started.bitrate = self.bitrate;
        started.running = true;
        started.powered_at = self.powered_at;
        started.eeprom_fails = self.eeprom_fails;
        started.turns = self.turns;
        started.function = Function::from_raw(started.values().get(MODE_SELECTION)).unwrap_or_default();
        started.own_motion = OwnMotion::Starting;
        started.gear_numerator = started.values().get(GEAR_NUMERATOR);
        let by_host = started.gear_numerator == 0 || started.function == Function::CommunicationControl;
        started.node.dictionary_mut().set(MODBUS_ENABLE, u16::from(by_host));
        started.host = Consumer::from_raw(started.values().get(CONSUMER_HEARTBEAT_TIME));
        started.parameters = Parameters::from(started.values(), self.model, started.function);
        started.next_task = now.plus_nanos(COMMUNICATION_PERIOD_NS);
        *self = started;
        self.publish_status();
        self.node.boot(now);
    }

    /// NMT reset communication: 1000h to 1FFFh as at power-on; motor and node-ID go on.
    fn restart_communication(&mut self, now: Instant) {
        self.node.restore_communication_defaults();
        let _ = self.store.load(self.node.dictionary_mut(), is_communication);
        self.host = Consumer::from_raw(self.values().get(CONSUMER_HEARTBEAT_TIME));
        self.node.boot(now);
        self.publish_alarms();
    }

    fn heard(&mut self, event: Option<ConsumerEvent>) {
        match event {
            Some(ConsumerEvent::Lost) => {
                self.host_lost = true;
                self.alarms.raise(row::COMMUNICATION);
            }
            Some(ConsumerEvent::Heard(_)) if self.host_lost => {
                self.host_lost = false;
                self.alarms.release(row::COMMUNICATION);
            }
            _ => return,
        }
        self.publish_alarms();
        self.publish_status();
    }

    /// Stores what 2614h asked for: reads 2 when it is done, and 1 for as long as the EEPROM does not answer.
    fn save(&mut self) {
        if !self.save_asked || self.eeprom_fails {
            return;
        }
        self.save_asked = false;
        let contents = storage::contents(self.node.dictionary(), self.node.node_id());
        if self.store.is_readable() {
            self.store.mark_all(&TABLE);
            self.store.commit(&contents);
        } else {
            self.store.format(&contents);
        }
        self.node.dictionary_mut().set(DATA_SAVE_FLAG, 2);
    }

    /// The last thing that the falling supply voltage lets it do.
    fn record_position(&mut self) {
        if self.running && self.awake && !self.eeprom_fails {
            self.store.mark(&TABLE, POSITION_ACTUAL_INTERNAL_VALUE.slot());
            self.store.commit(self.node.dictionary());
        }
    }

    fn actuation(&mut self, now: Instant) -> Actuation {
        let alarm = alarms::code(self.alarms.latched());
        let lit = leds(alarm, self.battery, now.nanos_since(self.powered_at) / 1_000_000);
        let driven = self.demand != Demand::Off;
        Actuation {
            running: true,
            power_stage: if driven { PowerStage::Modulate { duty: self.duty } } else { PowerStage::Off },
            brake: self.brake(),
            set_origin: core::mem::take(&mut self.set_origin),
            zero_output: self.position < 0,
            alarm_output: (alarm == 0) != self.parameters.alarm_conducts,
            red_led: lit.red,
            green_led: lit.green,
        }
    }

    fn brake(&self) -> Brake {
        match (self.function.has_brake(), self.axis.is_engaged()) {
            (false, _) => Brake::Absent,
            (true, true) => Brake::Released,
            (true, false) => Brake::Engaged,
        }
    }
}

impl Station for MJoint {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if self.running {
            let event = self.host.as_mut().and_then(|host| host.handle_frame(frame, now));
            self.heard(event);
            self.node.handle_frame(frame, now);
            self.handle_events(now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        if !self.running {
            return;
        }
        let event = self.host.as_mut().and_then(|host| host.handle_timeout(now));
        self.heard(event);
        self.node.handle_timeout(now);
        self.handle_events(now);
        if now >= self.next_task {
            // The task keeps its grid unless it was not called for long.
            let next = self.next_task.plus_nanos(COMMUNICATION_PERIOD_NS);
            self.next_task = if next > now { next } else { now.plus_nanos(COMMUNICATION_PERIOD_NS) };
            self.save();
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.node.poll_transmit()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let task = self.running.then_some(self.next_task)?;
        let node = self.node.poll_timeout().unwrap_or(Instant::FAR_FUTURE);
        let host = self.host.and_then(|host| host.poll_timeout()).unwrap_or(Instant::FAR_FUTURE);
        Some(task.min(node).min(host))
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.node.handle_transmitted(frame, now);
    }
}

impl Firmware for MJoint {
    type Sensors = Sensors;
    type Actuation = Actuation;
    type Hardware = Hardware;

    const CONTROL_PERIOD_NS: u64 = CONTROL_PERIOD_NS;

    fn power_on(&mut self, hardware: &Hardware, now: Instant) {
        self.store.reopen(hardware.eeprom);
        self.bitrate = hardware.bitrate;
        self.powered_at = now;
        let mut values = Values::new(&TABLE, NodeId::MIN);
        let readable = self.store.load(&mut values, |_| true).is_ok();
        let has_brake = Function::from_raw(values.get(MODE_SELECTION)).is_some_and(Function::has_brake);
        self.turns = Turns::new((readable && has_brake).then(|| values.get(POSITION_ACTUAL_INTERNAL_VALUE)));
        let address = u8::try_from(values.get(DEVICE_ADDRESS)).ok().and_then(NodeId::new);
        self.restart(address.unwrap_or(NodeId::MIN), now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.record_position();
        self.running = false;
        self.node.power_off();
        self.axis = Axis::new();
        self.demand = Demand::Off;
    }

    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.running {
            return Actuation::default();
        }
        self.eeprom_fails = sensors.eeprom_fails;
        self.sense(sensors);
        self.watch_for_origin(sensors);
        self.periods += 1;
        if self.periods >= SUPERVISION_DIVIDER {
            self.periods = 0;
            self.supervise(sensors);
        }
        self.modulate(sensors);
        self.actuation(now)
    }

    fn eeprom(&self) -> (&[u8], u32) {
        let (image, generation) = self.store.image();
        (&image.0, generation)
    }

    fn report(&self) -> Report {
        Report {
            powered: self.running,
            node_id: self.node.node_id(),
            bitrate: self.bitrate,
            state: self.power_state(),
            mode: self.mode,
            fault_code: alarms::code(self.alarms.latched()),
            position_counts: self.position,
            velocity_rpm: self.velocity_rpm(),
            current_a: self.shown_current_a.value,
            brake_engaged: self.running && self.brake() == Brake::Engaged,
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

fn is_communication(row: &Entry) -> bool {
    matches!(row.index, 0x1000..=0x1FFF)
}
