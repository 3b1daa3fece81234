//! The drive: axes, communication and protection joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`), the communication task every 0.5 ms (`handle_timeout`), and the
//! control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision period.

mod station;

use can::{Bitrate, Instant};
use canopen::NodeId;
use canopen::node::NodeProfile;
use canopen::od::{Dictionary, Entry, Storage};
use cia402::{AbortConnectionOption, FaultReactionOption, PowerCommand};
use devices::faults::FaultRow;
use devices::servo::faults::{FAULT_COUNT, FAULTS, row};
use devices::variant::Variant;
use devices::{AxisId, Description};

use super::hardware::{Actuation, Hardware, MAX_AXES, Sensors};
use super::motor::{CONTROL_PERIOD_NS, CONTROL_PERIOD_S, Motor, SUPERVISION_DIVIDER};
use super::protection::{BLEEDER_OFF, BLEEDER_ON, Protection};
use super::shaft::Shaft;
use super::write;
use crate::engine::actuator::bleeder::{Bleeder, BleederLimits};
use crate::engine::device::Device;
use crate::engine::faults::{FaultMonitor, FaultSet};
use crate::engine::storage::StoredImage;
use crate::node::{Memory, Services};
use crate::{Firmware, Report};

const COMMUNICATION_PERIOD_NS: u64 = 500_000;

/// Faults of all axes: those of the first, then those of the second. What the axes share is with the first.
const ALL_FAULTS: usize = FAULT_COUNT * MAX_AXES;

static AXES_FAULTS: [FaultRow; ALL_FAULTS] = {
    let mut rows = [FAULTS[0]; ALL_FAULTS];
    let mut at = 0;
    while at < ALL_FAULTS {
        rows[at] = FAULTS[at % FAULT_COUNT];
        at += 1;
    }
    rows
};

/// How many supervision periods a cause lasts before it counts: disturbances are shorter.
static DEBOUNCE: [u16; ALL_FAULTS] = [3; ALL_FAULTS];

/// Faults after which the motor cannot be stopped by the power stage.
const POWERLESS: [usize; 4] = [row::OVER_CURRENT, row::OVER_VOLTAGE, row::UNDER_VOLTAGE, row::ENCODER];

/// Energy that the braking resistor takes at once, in seconds of its rated power.
const BLEEDER_OVERLOAD_S: f32 = 5.0;

/// The firmware of a described servo.
#[derive(Clone)]
pub struct ServoDrive<S: Storage> {
    description: &'static Description,
    device: Device<S>,
    services: Services,
    shafts: [Option<Shaft>; MAX_AXES],
    motors: [Motor; MAX_AXES],
    node_id: NodeId,
    bitrate: Bitrate,
    faults: FaultMonitor<ALL_FAULTS>,
    protection: Protection,
    bleeder: Bleeder,
    bleeder_limits: BleederLimits,
    /// A heartbeat that is watched has stayed away.
    silent: bool,
    /// The last levels of the touch probes, for a probe that is switched on.
    probes: [[bool; 2]; MAX_AXES],
    periods: u8,
}

impl<S: Storage> ServoDrive<S> {
    /// A drive without supply: [`Firmware::power_on`] starts it. `profile` is how `description` communicates
    /// ([`communication`](crate::communication::communication)).
    ///
    /// # Panics
    /// If the description has more rows than a firmware holds, or no axis.
    pub fn new(description: &'static Description, profile: &'static NodeProfile, hardware: &Hardware) -> Self {
        assert!(!description.axes.is_empty(), "a servo has an axis");
        let variant = Variant::first_of(description.variations);
        let device = Device::new(profile, hardware.bitrate, StoredImage::BLANK, COMMUNICATION_PERIOD_NS, variant);
        let mut drive = Self {
            description,
            device,
            services: Services::new(hardware.memory),
            shafts: [const { None }; MAX_AXES],
            motors: hardware.motors,
            node_id: hardware.node_id,
            bitrate: hardware.bitrate,
            faults: FaultMonitor::new(&AXES_FAULTS, &DEBOUNCE),
            protection: Protection::default(),
            bleeder: Bleeder::default(),
            bleeder_limits: bleeder_limits(&hardware.motors[0]),
            silent: false,
            probes: [[false; 2]; MAX_AXES],
            periods: 0,
        };
        drive.make_shafts();
        drive
    }

    /// What it is built from.
    pub const fn description(&self) -> &'static Description {
        self.description
    }

    /// The values of the objects, to look at.
    pub const fn values(&self) -> &Dictionary<S> {
        self.device.values()
    }

    /// What the control loops of an axis are asked for, to look at.
    pub fn demand(&self, axis: usize) -> Option<&crate::engine::axis::Demand> {
        Some(self.shaft(axis)?.demand())
    }

    /// The statusword of an axis, where it has one.
    pub fn statusword(&self, axis: usize) -> Option<u16> {
        let slot = self.shaft(axis)?.slots().statusword?;
        Some(self.values().raw(slot) as u16)
    }

    /// Position of an axis in encoder increments.
    pub fn increments(&self, axis: usize) -> Option<i32> {
        Some(self.shaft(axis)?.position())
    }

    fn shaft(&self, axis: usize) -> Option<&Shaft> {
        self.shafts.get(axis)?.as_ref()
    }

    fn make_shafts(&mut self) {
        let table = self.description.dictionary;
        for ((shaft, axis), motor) in self.shafts.iter_mut().zip(self.description.axes).zip(self.motors) {
            *shaft = Some(Shaft::new(axis, table, motor, self.device.values()));
        }
    }

    /// Starts over with the stored values.
    fn restart_firmware(&mut self, now: Instant) {
        self.device.restart(self.node_id, self.bitrate, now);
        self.services.start(&mut self.device, |_| true);
        self.faults = FaultMonitor::new(&AXES_FAULTS, &DEBOUNCE);
        self.protection = Protection::default();
        self.silent = false;
        self.make_shafts();
        let values = self.device.values_mut();
        for shaft in self.shafts.iter_mut().flatten() {
            shaft.start(values);
            shaft.publish_status(values);
        }
        self.device.boot(now);
    }

    fn restart_communication_only(&mut self, now: Instant) {
        self.device.restart_communication(now);
        self.services.start(&mut self.device, Entry::is_communication);
        self.device.boot(now);
    }

    /// Every supervision period.
    fn supervise(&mut self, sensors: &Sensors, now: Instant) {
        let values = self.device.values();
        let feedbacks = each(&mut self.shafts, sensors, |shaft, sensors| shaft.measure(values, sensors));
        let latched = self.faults.latched();
        let rated_v = self.motors[0].bus_v;
        let mut causes = self.protection.causes(sensors, rated_v, self.services.is_sound(), self.silent, latched);
        for (at, (shaft, sensors)) in self.shafts.iter_mut().zip(&sensors.axes).enumerate() {
            let Some(shaft) = shaft else { continue };
            let own = shaft.causes(sensors, of_axis(latched, at));
            causes = own.rows().fold(causes, |all, row| all.with(at * FAULT_COUNT + row, true));
        }
        let new = self.faults.observe(causes);
        self.enter_faults(new, now);
        let values = self.device.values_mut();
        for ((shaft, sensors_of), feedback) in self.shafts.iter_mut().zip(&sensors.axes).zip(feedbacks) {
            if let (Some(shaft), Some(feedback)) = (shaft, feedback) {
                shaft.supervise(values, sensors_of, feedback, sensors.bus_v);
            }
        }
    }

    /// New faults stop the axes, and are reported.
    fn enter_faults(&mut self, new: FaultSet, now: Instant) {
        if new.is_empty() {
            return;
        }
        for (at, shaft) in self.shafts.iter_mut().enumerate() {
            let Some(shaft) = shaft else { continue };
            // What is with the first axis and shared stops every axis.
            let mut concerns = new.rows().filter(|row| row / FAULT_COUNT == at || is_shared(*row)).peekable();
            let Some(first) = concerns.peek().copied() else { continue };
            let powerless = concerns.any(|row| POWERLESS.contains(&(row % FAULT_COUNT)));
            let reaction = shaft.parameters().fault_reaction;
            shaft.fault(if powerless { FaultReactionOption::DISABLE } else { reaction });
            let code = AXES_FAULTS[first].code;
            let error_code = shaft.slots().error_code;
            write(self.device.values_mut(), error_code, i64::from(code));
            shaft.publish_status(self.device.values_mut());
        }
        self.device.report_faults(new, &self.faults, now);
    }

    /// Forgets the faults whose cause is gone; with the last one all axes leave Fault.
    fn reset_faults(&mut self, now: Instant) {
        for shaft in self.shafts.iter_mut().flatten() {
            shaft.forget_causes();
        }
        let all_gone = self.faults.reset();
        self.device.report_reset(&self.faults, now);
        let values = self.device.values_mut();
        for shaft in self.shafts.iter_mut().flatten() {
            if all_gone {
                write(values, shaft.slots().error_code, 0);
                shaft.reset_fault();
            }
            shaft.publish_status(values);
        }
    }

    /// A heartbeat that is watched has stayed away: 6007h says what that does. A fault reports itself.
    fn lose_connection(&mut self, now: Instant) {
        let mut fault = false;
        for shaft in self.shafts.iter_mut().flatten() {
            match shaft.parameters().abort_connection {
                AbortConnectionOption::FAULT => fault = true,
                AbortConnectionOption::DISABLE_VOLTAGE => shaft.command_itself(PowerCommand::DisableVoltage),
                AbortConnectionOption::QUICK_STOP => shaft.command_itself(PowerCommand::QuickStop),
                _ => {}
            }
        }
        self.silent = fault;
        if !fault {
            self.device.report_heartbeat(false, now);
        }
    }

    /// A heartbeat that is watched is there: a fault for its absence can be reset.
    fn regain_connection(&mut self, now: Instant) {
        self.silent = false;
        let _ = self.faults.forget(row::HEARTBEAT);
        self.device.report_heartbeat(true, now);
    }
}

/// A fault of the device, not of one axis.
const fn is_shared(row: usize) -> bool {
    matches!(row, row::OVER_VOLTAGE | row::UNDER_VOLTAGE | row::DRIVE_TEMPERATURE | row::STORE | row::HEARTBEAT)
}

/// The faults of one axis, with the numbers that they have there.
fn of_axis(faults: FaultSet, axis: usize) -> FaultSet {
    let own = faults.rows().filter(|row| row / FAULT_COUNT == axis);
    own.fold(FaultSet::NONE, |set, row| set.with(row % FAULT_COUNT, true))
}

fn each<T>(
    shafts: &mut [Option<Shaft>; MAX_AXES],
    sensors: &Sensors,
    mut act: impl FnMut(&mut Shaft, &super::hardware::AxisSensors) -> T,
) -> [Option<T>; MAX_AXES] {
    let mut at = 0;
    shafts.each_mut().map(|shaft| {
        at += 1;
        shaft.as_mut().map(|shaft| act(shaft, &sensors.axes[at - 1]))
    })
}

fn bleeder_limits(motor: &Motor) -> BleederLimits {
    BleederLimits {
        enabled: motor.braking_w > 0.0 && motor.braking_ohm > 0.0,
        on_v: motor.bus_v * BLEEDER_ON,
        off_v: motor.bus_v * BLEEDER_OFF,
        conductance_s: if motor.braking_ohm > 0.0 { 1.0 / motor.braking_ohm } else { 0.0 },
        rated_w: motor.braking_w,
        overload_j: motor.braking_w * BLEEDER_OVERLOAD_S,
    }
}

impl<S: Storage> Firmware for ServoDrive<S> {
    type Sensors = Sensors;
    type Actuation = Actuation;
    type Hardware = Hardware;

    const CONTROL_PERIOD_NS: u64 = CONTROL_PERIOD_NS;

    fn power_on(&mut self, hardware: &Hardware, now: Instant) {
        self.node_id = hardware.node_id;
        self.bitrate = hardware.bitrate;
        self.motors = hardware.motors;
        self.device.power_on(StoredImage::BLANK);
        self.services.power_on(hardware.memory);
        self.restart_firmware(now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.device.power_off();
        self.make_shafts();
    }

    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.device.is_running() {
            return Actuation::default();
        }
        let mut shorted = FaultSet::NONE;
        for (at, (shaft, sensors)) in self.shafts.iter_mut().zip(&sensors.axes).enumerate() {
            let Some(shaft) = shaft else { continue };
            self.probes[at] = sensors.probes;
            let fault = at * FAULT_COUNT + row::OVER_CURRENT;
            if shaft.sense(sensors) && self.faults.raise(fault) {
                shorted = shorted.with(fault, true);
            }
        }
        self.enter_faults(shorted, now);
        self.periods += 1;
        if self.periods >= SUPERVISION_DIVIDER {
            self.periods = 0;
            self.supervise(sensors, now);
        }
        let mut actuation = Actuation {
            bleeder_on: self.bleeder.update(&self.bleeder_limits, sensors.bus_v, CONTROL_PERIOD_S),
            ..Actuation::default()
        };
        let values = self.device.values();
        for ((shaft, sensors_of), out) in self.shafts.iter_mut().zip(&sensors.axes).zip(&mut actuation.axes) {
            if let Some(shaft) = shaft {
                *out = shaft.actuate(values, sensors_of, sensors.bus_v);
            }
        }
        actuation
    }

    fn eeprom(&self) -> (&[u8], u32) {
        let (memory, generation): (&Memory, u32) = self.services.memory();
        (memory.bytes(), generation)
    }

    fn is_storing(&self) -> bool {
        false
    }

    fn report(&self, axis: AxisId) -> Report {
        let shaft = self.shaft(usize::from(axis.0)).or(self.shaft(0)).expect("a servo has an axis");
        Report {
            powered: self.device.is_running(),
            node_id: self.device.node().node_id(),
            bitrate: self.device.bitrate(),
            nmt: self.device.node().state(),
            state: shaft.power().state(),
            mode: shaft.power().mode(),
            fault_code: super::read(self.values(), shaft.slots().error_code, 0) as u16,
            position_counts: shaft.parameters().scales.position(shaft.position()) as i32,
            velocity_rpm: shaft.velocity_rpm(),
            current_a: shaft.current_a(),
            brake_engaged: *shaft.demand() == crate::engine::axis::Demand::Off,
        }
    }
}
