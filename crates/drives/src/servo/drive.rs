//! The drive: axes, communication and protection joined over the dictionary.
//!
//! Three rhythms: frames as they come (`handle_frame`), the communication task every 1 ms (`handle_timeout`), and the
//! control period of 50 us ([`Firmware::tick`]), of which every tenth is a supervision period.

mod connection;
mod faults;
mod resting;

use can::Instant;
use canopen::node::NodeProfile;
use canopen::od::{Dictionary, Storage};
use cia402::{ModeOfOperation, PowerState};
use devices::servo::faults::row;
use devices::variant::Variant;
use devices::{AxisId, Description};

use super::faults::{Faults, NewFaults, no_faults};
use super::hardware::{Actuation, Hardware, MAX_AXES, Sensors};
use super::motor::{CONTROL_PERIOD_NS, CONTROL_PERIOD_S, Motor, SUPERVISION_DIVIDER, SUPERVISION_PERIOD_S};
use super::protection::{Protection, bleeder_limits};
use super::shaft::Shaft;
use crate::engine::actuator::bleeder::{Bleeder, BleederLimits};
use crate::engine::actuator::servo::CurrentGains;
use crate::engine::device::ResetTimes;
use crate::engine::faults::FaultSet;
use crate::node::described::DescribedDevice;
use crate::{Fidelity, Firmware, Report};

/// The firmware of a described servo.
#[derive(Clone)]
pub struct ServoDrive<S: Storage> {
    description: &'static Description,
    base: DescribedDevice<S>,
    shafts: [Option<Shaft>; MAX_AXES],
    motors: [Motor; MAX_AXES],
    /// Of what all axes share.
    faults: Faults,
    protection: Protection,
    bleeder: Bleeder,
    bleeder_limits: BleederLimits,
    /// The last levels of the touch probes, for a probe that is switched on.
    probes: [[bool; 2]; MAX_AXES],
    periods: u8,
    fidelity: Fidelity,
}

impl<S: Storage> ServoDrive<S> {
    /// A drive without supply: [`Firmware::power_on`] starts it. `profile` is how `description` communicates
    /// ([`communication`](crate::communication::communication)).
    ///
    /// # Panics
    /// If the description has more rows than a firmware holds, or not one to [`MAX_AXES`] axes.
    pub fn new(description: &'static Description, profile: &'static NodeProfile, hardware: &Hardware<S>) -> Self {
        assert!((1..=MAX_AXES).contains(&description.axes.len()), "a servo has one to eight axes");
        let variant = Variant::first_of(description.variations);
        let Hardware { node_id, bitrate, motors, memory } = hardware.clone();
        let mut drive = Self {
            description,
            base: DescribedDevice::new(profile, node_id, bitrate, memory, variant, description.lss),
            shafts: [const { None }; MAX_AXES],
            motors,
            faults: no_faults(),
            protection: Protection::default(),
            bleeder: Bleeder::default(),
            bleeder_limits: bleeder_limits(&motors[0]),
            probes: [[false; 2]; MAX_AXES],
            periods: 0,
            fidelity: Fidelity::Full,
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
        self.base.device.values()
    }

    /// How long the next resets by NMT take, which depends on the microcontroller: none unless it is set.
    pub const fn set_reset_times(&mut self, times: ResetTimes) {
        self.base.device.set_reset_times(times);
    }

    /// What the control loops of an axis are asked for, to look at.
    pub fn demand(&self, axis: usize) -> Option<&crate::engine::axis::Demand> {
        Some(self.shaft(axis)?.demand())
    }

    /// How the current loop of an axis is set, for a power stage that follows by itself.
    pub fn current_gains(&self, axis: usize) -> Option<CurrentGains> {
        Some(self.shaft(axis)?.current_gains())
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
            *shaft = Some(Shaft::new(axis, table, motor, self.fidelity, self.base.device.values()));
        }
    }

    /// Starts over with the stored values: the power stage is off until a host enables it again.
    fn restart_firmware(&mut self, now: Instant) {
        self.base.restart(now);
        self.faults = no_faults();
        self.protection = Protection::default();
        self.make_shafts();
        let values = self.base.device.values_mut();
        for shaft in self.shafts.iter_mut().flatten() {
            shaft.start(values);
            shaft.publish_status(values);
        }
        self.base.boot(now);
    }

    /// Every supervision period.
    fn supervise(&mut self, sensors: &Sensors, now: Instant) {
        let values = self.base.device.values();
        let feedbacks = each(&mut self.shafts, sensors, |shaft, sensors| shaft.measure(values, sensors));
        let store_sound = self.base.services.is_sound();
        let causes = self.protection.causes(sensors, self.motors[0].bus_v, store_sound, self.faults.latched());
        let own = each(&mut self.shafts, sensors, Shaft::observe);
        let new =
            NewFaults { shared: self.faults.observe(causes), own: own.map(|faults| faults.unwrap_or(FaultSet::NONE)) };
        self.enter_faults(&new, now);
        let values = self.base.device.values_mut();
        for ((shaft, sensors_of), feedback) in self.shafts.iter_mut().zip(&sensors.axes).zip(feedbacks) {
            if let (Some(shaft), Some(feedback)) = (shaft, feedback) {
                shaft.supervise(values, sensors_of, feedback, sensors.bus_v);
            }
        }
    }
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

impl<S: Storage> Firmware for ServoDrive<S> {
    type Sensors = Sensors;
    type Actuation = Actuation;
    type Hardware = Hardware<S>;

    const CONTROL_PERIOD_NS: u64 = CONTROL_PERIOD_NS;
    const MECHANICAL_PERIODS: Option<[u32; 2]> = Some([SUPERVISION_DIVIDER as u32; 2]);

    fn set_fidelity(&mut self, fidelity: Fidelity) {
        self.fidelity = fidelity;
        self.make_shafts();
    }

    fn power_on(&mut self, hardware: &Hardware<S>, now: Instant) {
        self.base.node_id = hardware.node_id;
        self.base.bitrate = hardware.bitrate;
        self.motors = hardware.motors;
        self.base.power_on(hardware.memory.clone());
        self.restart_firmware(now);
    }

    fn power_off(&mut self, _now: Instant) {
        self.base.device.power_off();
        self.make_shafts();
    }

    fn tick(&mut self, sensors: &Sensors, now: Instant) -> Actuation {
        if !self.base.device.is_running() {
            return Actuation::default();
        }
        let mut shorted = NewFaults::default();
        for (at, (shaft, sensors)) in self.shafts.iter_mut().zip(&sensors.axes).enumerate() {
            let Some(shaft) = shaft else { continue };
            self.probes[at] = sensors.probes;
            if shaft.sense(sensors) && shaft.faults_mut().raise(row::OVER_CURRENT) {
                shorted.own[at] = FaultSet::row(row::OVER_CURRENT);
            }
        }
        self.enter_faults(&shorted, now);
        self.periods += 1;
        if self.periods >= self.fidelity.tick(SUPERVISION_DIVIDER, 1) {
            self.periods = 0;
            self.supervise(sensors, now);
        }
        let mut actuation = Actuation {
            bleeder_on: self.bleeder.update(
                &self.bleeder_limits,
                sensors.bus_v,
                self.fidelity.tick(CONTROL_PERIOD_S, SUPERVISION_PERIOD_S),
            ),
            ..Actuation::default()
        };
        let values = self.base.device.values();
        for ((shaft, sensors_of), out) in self.shafts.iter_mut().zip(&sensors.axes).zip(&mut actuation.axes) {
            if let Some(shaft) = shaft {
                *out = shaft.actuate(values, sensors_of, sensors.bus_v);
            }
        }
        actuation
    }

    fn eeprom(&self) -> (&[u8], u32) {
        let (memory, generation) = self.base.services.memory();
        (memory.bytes(), generation)
    }

    fn is_storing(&self) -> bool {
        false
    }

    fn report(&self, axis: AxisId) -> Report {
        let device = &self.base.device;
        let of_device = Report {
            powered: device.is_running(),
            node_id: device.node().node_id(),
            bitrate: device.bitrate(),
            nmt: device.node().state(),
            state: PowerState::NotReadyToSwitchOn,
            mode: ModeOfOperation::NONE,
            fault_code: 0,
            position_counts: 0,
            velocity_rpm: 0.0,
            current_a: 0.0,
            brake_engaged: true,
        };
        let Some(shaft) = self.shaft(usize::from(axis.0)) else { return of_device };
        Report {
            state: shaft.power().state(),
            mode: shaft.power().mode(),
            fault_code: super::read(self.values(), shaft.slots().error_code, 0) as u16,
            position_counts: shaft.shown(shaft.position()) as i32,
            velocity_rpm: shaft.velocity_rpm(),
            current_a: shaft.current_a(),
            brake_engaged: *shaft.demand() == crate::engine::axis::Demand::Off,
            ..of_device
        }
    }
}
