//! [`Machine`] is the part that all drives share: the supply switch, the fixed grid of control periods, the wires of
//! the digital inputs, the memory over power cycles. An [`Assembly`] is one model's motor, load, supply and sensors.
//! Control periods are computed lazily, before anything from outside is let in: the world sees the firmware's
//! communication deadlines only, and the result does not depend on when it looked.

pub(super) mod assembly;
mod chip;
mod fidelity;
mod load;
mod power;
pub(super) mod quantity;
pub(super) mod realism;
mod rest;
mod resting;
mod switch;
pub(super) mod timing;

use can::{Bitrate, Frame, Instant, Station};
use devices::{AxisId, Description, Timing};
use drives::{Fidelity, Firmware, RegisterError, Resting};
use plant::FreeRun;
use plant::motor::Motor;
use plant::shaft::{Motion, Push};

use crate::mechanics::Mechanics;
use crate::stimulus::{Stimulus, SwitchRange};
use crate::{Levels, MotorData, PowerPhase, Refused, Report, StepperData, VirtualDrive, nmt_reset};
use assembly::Assembly;
use realism::{Noise, Realism};
use rest::Rest;
use switch::{Inputs, stretch};
use timing::{OwnTime, TimingMode};

/// How often a drive without enough voltage to run looks whether it has come.
const WAKE_PERIOD_NS: u64 = 1_000_000;

/// The identifier of NMT commands (CiA 301, 7.3.5).
pub(super) const NMT: u16 = 0;

/// A drive's firmware on its hardware, as a station of a world.
#[derive(Clone)]
pub struct Machine<A: Assembly> {
    firmware: A::Firmware,
    assembly: A,
    actuation: <A::Firmware as Firmware>::Actuation,
    inputs: Inputs,
    noise: Option<Noise>,
    supply: Supply,
    life: Life,
    /// What it takes between bus and firmware; none if it takes no time.
    own_time: Option<Box<OwnTime>>,
    /// Its control periods are run by the machine that it is coupled to.
    coupled: bool,
    rest: Rest<A::Firmware>,
    kept_awake: bool,
    fidelity: Fidelity,
    /// From one tick to the next.
    period_ns: u64,
    next_tick: Instant,
}

/// What the drive's converter has made of the supply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Life {
    /// Too little voltage.
    Dead,
    /// There is voltage; the firmware starts then.
    Booting(Instant),
    /// The firmware runs.
    Running,
}

/// The switch between the supply and the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Supply {
    On,
    Off,
    /// Off, and on again when the drive has died of it, or now at the latest.
    Cycling(Instant),
}

impl<A: Assembly> Machine<A> {
    /// A machine without power: [`set_power`](VirtualDrive::set_power) starts it.
    pub fn new(firmware: A::Firmware, assembly: A) -> Self {
        Self {
            firmware,
            assembly,
            actuation: Default::default(),
            inputs: Inputs::default(),
            noise: None,
            supply: Supply::Off,
            life: Life::Dead,
            own_time: None,
            coupled: false,
            rest: Rest::from(Instant::ZERO),
            kept_awake: false,
            fidelity: Fidelity::Full,
            period_ns: A::Firmware::CONTROL_PERIOD_NS,
            next_tick: Instant::ZERO,
        }
    }

    /// The firmware, to look at.
    pub fn firmware(&self) -> &A::Firmware {
        &self.firmware
    }

    /// Motor, load, supply and sensors.
    pub fn assembly(&self) -> &A {
        &self.assembly
    }

    /// Motor, load, supply and sensors, to change what no command reaches. Call
    /// [`advance`](VirtualDrive::advance) first.
    pub fn assembly_mut(&mut self) -> &mut A {
        self.disturb();
        &mut self.assembly
    }

    /// One control period that begins at `at`.
    fn tick(&mut self, at: Instant) {
        if self.fidelity == Fidelity::Mechanical {
            return self.tick_mechanical(at);
        }
        if !self.is_settled() {
            self.watch_supply(at);
        }
        if self.life == Life::Running {
            let levels = self.inputs.levels(|axis| self.assembly.shaft_counts(axis));
            let sensors =
                if self.noise.is_none() { self.assembly.sense(levels) } else { self.sense_with_noise(levels) };
            let next = self.firmware.tick(&sensors, at);
            if let Rest::Watching(watch) = &mut self.rest {
                watch.note(&sensors, &next);
            }
            self.assembly.step(&self.actuation);
            self.actuation = next;
        } else {
            self.step_without_firmware();
        }
    }

    #[cold]
    #[inline(never)]
    fn sense_with_noise(&mut self, levels: u64) -> <A::Firmware as Firmware>::Sensors {
        let mut sensors = self.assembly.sense(levels);
        if let Some(noise) = &mut self.noise {
            self.assembly.disturb(&mut sensors, noise);
        }
        sensors
    }

    /// A control period while the firmware does not run.
    // Apart, so that the frequent caller has the step inlined.
    #[cold]
    #[inline(never)]
    fn step_without_firmware(&mut self) {
        self.assembly.step(&self.actuation);
    }

    /// Its supply changes nothing now: all that most periods have to know of it.
    #[inline(always)]
    fn is_settled(&self) -> bool {
        self.life == Life::Running
            && !matches!(self.supply, Supply::Cycling(_))
            && self.assembly.supplies_firmware(true)
    }

    /// The firmware may have stored something.
    #[inline]
    fn note_store(&mut self, now: Instant) {
        if let Some(own_time) = &mut self.own_time {
            own_time.chip.advance(now);
            let (image, generation) = self.firmware.eeprom();
            own_time.store(image, u64::from(generation), now);
        }
    }

    /// Hands a frame to the firmware.
    fn hand_over(&mut self, frame: &Frame, now: Instant) {
        self.disturb();
        if let Some(own_time) = self.own_time.as_mut().filter(|_| frame.standard_data_id() == Some(NMT)) {
            A::set_reset_times(&mut self.firmware, own_time.reset_times());
            if nmt_reset::is_asked_of(frame, || self.firmware.report(AxisId::FIRST).node_id.raw()) {
                own_time.chip.forget_answers();
            }
        }
        self.firmware.handle_frame(frame, now);
    }

    /// Hands over the frames whose time has come.
    #[inline]
    fn serve_mailboxes(&mut self, now: Instant) {
        while let Some(frame) = self.own_time.as_mut().and_then(|own_time| own_time.take_out(now)) {
            self.hand_over(&frame, now);
        }
    }

    /// The store that an SDO answer given now stands for: the last one, or the one that is due.
    fn store_needed(&self) -> u64 {
        u64::from(self.firmware.eeprom().1) + u64::from(self.firmware.is_storing())
    }

    fn tie_switch(&mut self, axis: AxisId, input: usize, range: SwitchRange) {
        let shaft = self.assembly.shaft_counts(axis);
        let scale = self.assembly.shaft_counts_per_count(&self.firmware, axis);
        let position = i64::from(self.firmware.report(axis).position_counts);
        let reversed = self.assembly.counts_reversed(&self.firmware, axis);
        self.inputs.tie(input, axis, stretch(range, position, shaft, scale, reversed));
    }
}

impl<A: Assembly> Station for Machine<A> {
    fn ignores(&self, frame: &Frame) -> bool {
        self.life != Life::Running || self.firmware.ignores(frame)
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        self.advance(now);
        if self.life != Life::Running {
            return;
        }
        let frame = match &mut self.own_time {
            None => Some(*frame),
            Some(own_time) => own_time.take_in(frame, now),
        };
        if let Some(frame) = frame {
            self.hand_over(&frame, now);
            self.note_store(now);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        self.advance(now);
        if self.life == Life::Running {
            self.serve_mailboxes(now);
            self.wake_for_own_event(now);
            self.firmware.handle_timeout(now);
            self.note_store(now);
            self.foretell(now);
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        if self.life != Life::Running {
            return None;
        }
        let frame = if self.own_time.is_none() {
            self.firmware.poll_transmit()
        } else {
            let needed = self.store_needed();
            self.own_time.as_mut()?.next_frame(needed, || self.firmware.poll_transmit())
        }?;
        self.disturb();
        Some(frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let own = self.own_time.as_ref().and_then(|own_time| own_time.next_due());
        let firmware = || self.firmware_timeout().into_iter().chain(own).min();
        match (self.life, self.supply) {
            (Life::Running, Supply::On) => firmware(),
            (Life::Dead, Supply::Off) => None,
            // Its life or its supply may change without a frame or a deadline of its own.
            (life, _) => {
                let look = self.next_tick.plus_nanos(WAKE_PERIOD_NS);
                let sooner = match life {
                    Life::Dead => None,
                    Life::Booting(due) => Some(due),
                    Life::Running => firmware(),
                };
                Some(sooner.map_or(look, |sooner| sooner.min(look)))
            }
        }
    }

    fn handle_transmitted(&mut self, frame: &Frame, now: Instant) {
        self.advance(now);
        self.disturb();
        self.firmware.handle_transmitted(frame, now);
    }

    fn handle_bus_off(&mut self, off: bool, now: Instant) {
        self.advance(now);
        self.disturb();
        if self.life == Life::Running {
            self.firmware.handle_bus_off(off, now);
        }
    }
}

impl<A: Assembly> Mechanics for Machine<A> {
    fn couple(&mut self, axis: AxisId) -> Result<f64, Refused> {
        self.check_couple(axis)?;
        self.disturb();
        self.assembly.couple(axis);
        self.coupled = true;
        Ok(1.0 / self.assembly.shaft_facts(axis).reducer.unwrap_or(1.0))
    }

    fn next_period(&self) -> (Instant, u64) {
        (self.next_tick, self.period_while_coupled_ns())
    }

    fn run_period(&mut self) {
        self.tick(self.next_tick);
        self.next_tick = self.next_tick.plus_nanos(self.period_ns);
    }

    fn push(&self, axis: AxisId) -> Push {
        self.assembly.shaft_and_rig(axis).1.push().unwrap_or_default()
    }

    fn follow(&mut self, axis: AxisId, motion: &Motion) {
        self.assembly.follow(axis, motion);
    }
}

impl<A: Assembly> VirtualDrive for Machine<A> {
    fn model(&self) -> &'static str {
        self.assembly.model()
    }

    fn description(&self) -> Option<&'static Description> {
        A::description(&self.firmware, &self.assembly)
    }

    fn axes(&self) -> u8 {
        self.assembly.axes()
    }

    fn apply(&mut self, axis: AxisId, stimulus: &Stimulus, now: Instant) -> Result<(), Refused> {
        self.check_axis(axis)?;
        self.advance(now);
        self.disturb();
        match *stimulus {
            Stimulus::Power(power) => self.switch_supply(power, now),
            Stimulus::Input { ref name, level } => self.inputs.set(self.input_number(name)?, level),
            Stimulus::Switch { ref name, range } => self.tie_switch(axis, self.input_number(name)?, range),
            Stimulus::LoadTorque(torque_nm) => self.assembly.set_load_torque(axis, torque_nm)?,
            Stimulus::LoadInertia(inertia_kg_m2) => self.assembly.set_load_inertia(axis, inertia_kg_m2)?,
            Stimulus::Load(ref part) => self.join_load(axis, part)?,
            Stimulus::RotorLock(locked) => self.assembly.set_rotor_locked(axis, locked),
            Stimulus::Supply(source) => self.assembly.set_source(source)?,
            Stimulus::Temperature(sensor, celsius) => self.assembly.hold_temperature(axis, sensor, celsius)?,
            Stimulus::Fault(component, broken) => self.set_fault(axis, component, broken)?,
            Stimulus::Battery(connected) => self.assembly.set_battery(connected)?,
            Stimulus::Pulses(train) => self.assembly.set_pulses(train)?,
            Stimulus::CableCut(_) | Stimulus::Bus(_) => {
                return Err(Refused::Absent { model: self.model(), what: "cable but the world's" });
            }
            Stimulus::Object { mux, .. } => {
                return Err(Refused::OwnObjects { model: self.model(), object: mux });
            }
            Stimulus::Mpdo { .. } => {
                return Err(Refused::Absent { model: self.model(), what: "application that writes to other nodes" });
            }
        }
        Ok(())
    }

    fn set_timing(&mut self, mode: TimingMode, seed: u64, now: Instant) {
        self.advance(now);
        self.disturb();
        let (image, generation) = (self.nvm_image(), self.nvm_generation());
        let timing = A::description(&self.firmware, &self.assembly).map_or(Timing::GUESSED, |model| model.timing);
        self.own_time = (mode == TimingMode::Device).then(|| Box::new(OwnTime::new(timing, seed, &image, generation)));
        let times = self.own_time.as_mut().map(|own_time| own_time.reset_times()).unwrap_or_default();
        A::set_reset_times(&mut self.firmware, times);
    }

    fn set_realism(&mut self, realism: Realism, seed: u64, now: Instant) {
        self.advance(now);
        self.disturb();
        self.noise = (realism == Realism::Full).then(|| Noise::new(seed));
        self.assembly.set_realism(realism);
    }

    fn set_fidelity(&mut self, fidelity: Fidelity, now: Instant) -> Result<(), Refused> {
        self.advance(now);
        self.change_fidelity(fidelity)
    }

    fn bitrate(&self) -> Option<Bitrate> {
        let own = (self.life == Life::Running).then(|| self.firmware.report(AxisId::FIRST));
        own.filter(|own| own.powered).map(|own| own.bitrate)
    }

    fn advance(&mut self, now: Instant) {
        // The world has run a coupled machine's periods by now.
        if self.rest.is_resting() {
            self.firmware.leave_out_tasks(now);
        }
        while self.next_tick <= now && !self.coupled {
            if self.rest.is_resting() {
                self.rest_until(now);
                continue;
            }
            self.tick(self.next_tick);
            self.next_tick = self.next_tick.plus_nanos(self.period_ns);
            self.look_for_rest();
        }
    }

    fn keep_awake(&mut self) {
        self.disturb();
        self.kept_awake = true;
    }

    fn report(&self) -> Report {
        self.report_of(AxisId::FIRST)
    }

    fn report_of(&self, axis: AxisId) -> Report {
        let own = self.firmware.report(axis);
        let (shaft, rig) = self.assembly.shaft_and_rig(axis);
        let direction = if self.assembly.counts_reversed(&self.firmware, axis) { -1.0 } else { 1.0 };
        let mut physics = self.assembly.physics(axis);
        physics.motor_torque_nm *= direction;
        let common = Report {
            node: own.node_id.raw(),
            powered: self.life == Life::Running,
            nmt: (self.life == Life::Running).then_some(own.nmt),
            state: (self.life == Life::Running).then_some(own.state),
            mode: (self.life == Life::Running).then_some(own.mode),
            error_code: u32::from(own.fault_code),
            position: i64::from(own.position_counts),
            velocity_rpm: direction * shaft.velocity_rad_s * cia402::RPM_PER_RAD_S,
            // A drive that is off measures nothing: it has the last value still.
            current_a: if self.life == Life::Running { f64::from(own.current_a) } else { 0.0 },
            supply_v: rig.supply.bus_v,
            motor_c: Some(rig.winding.temperature_c),
            driver_c: Some(rig.heat_sink.temperature_c),
            shaft_angle_rad: shaft.angle.as_rad(),
            physics: Some(physics),
            ..Report::default()
        };
        let report = self.assembly.report(&self.firmware, axis, common);
        let power = self.phase();
        // Before the firmware has booted it is what CiA 402 calls NOT READY TO SWITCH ON.
        let statusword = if power == PowerPhase::Booting { Some(0) } else { report.statusword };
        Report { power, powered: self.life != Life::Dead, statusword, ..report }
    }

    fn mechanics(&mut self) -> Option<&mut dyn Mechanics> {
        Some(self)
    }

    fn motor(&self, axis: AxisId) -> Option<MotorData> {
        let motor = self.assembly.motor_at(axis);
        let (rotor, gear) = (*motor.rotor_model(), self.assembly.gear().copied());
        motor.pmsm_model().map(|windings| MotorData { rotor, windings: *windings, gear })
    }

    fn stepper(&self, axis: AxisId) -> Option<StepperData> {
        let motor = self.assembly.motor_at(axis);
        motor.stepping().map(|stepping| StepperData { rotor: *motor.rotor_model(), stepping })
    }

    fn check_couple(&self, axis: AxisId) -> Result<(), Refused> {
        match self.assembly.shaft_and_rig(axis).1.attachment().gear {
            Some(_) => Err(Refused::GearInTheWay),
            None => Ok(()),
        }
    }

    fn free_run(&self, axis: AxisId) -> Option<FreeRun> {
        let turned = |velocity_rad_s: f64| {
            if self.assembly.counts_reversed(&self.firmware, axis) { -velocity_rad_s } else { velocity_rad_s }
        };
        Some(match self.assembly.free_run(axis)? {
            FreeRun::Held => FreeRun::Held,
            FreeRun::Turns { velocity_rad_s } => FreeRun::Turns { velocity_rad_s: turned(velocity_rad_s) },
            FreeRun::Seizes { velocity_rad_s } => FreeRun::Seizes { velocity_rad_s: turned(velocity_rad_s) },
        })
    }

    fn inputs(&self) -> &'static [&'static str] {
        self.assembly.inputs()
    }

    fn input_levels(&self) -> Levels {
        let levels = self.inputs.levels(|axis| self.assembly.shaft_counts(axis));
        Levels { names: self.assembly.inputs(), bits: levels }
    }

    fn modbus_unit(&self) -> Option<u8> {
        if self.life == Life::Running { A::modbus_unit(&self.firmware) } else { None }
    }

    fn read_registers(&mut self, address: u16, words: &mut [u16], now: Instant) -> Result<(), RegisterError> {
        self.advance(now);
        A::read_registers(&self.firmware, address, words)
    }

    fn write_registers(&mut self, address: u16, words: &[u16], now: Instant) -> Result<(), RegisterError> {
        self.advance(now);
        self.disturb();
        let written = A::write_registers(&mut self.firmware, address, words);
        self.note_store(now);
        written
    }

    fn nvm_generation(&self) -> u64 {
        let own = u64::from(self.firmware.eeprom().1);
        self.own_time.as_ref().map_or(own, |own_time| own_time.chip.generation())
    }

    fn is_storing(&self) -> bool {
        self.firmware.is_storing() || self.own_time.as_ref().is_some_and(|own_time| own_time.chip.is_writing())
    }

    fn nvm_image(&self) -> Vec<u8> {
        match &self.own_time {
            Some(own_time) => own_time.chip.contents().to_vec(),
            None if self.life == Life::Running => self.firmware.eeprom().0.to_vec(),
            None => self.assembly.image().to_vec(),
        }
    }

    fn load_nvm(&mut self, image: &[u8]) -> Result<(), Refused> {
        if image.len() != self.assembly.image().len() {
            return Err(Refused::BadImage { model: self.assembly.model(), reason: "it has another length" });
        }
        self.disturb();
        self.assembly.keep_image(image);
        if let Some(own_time) = &mut self.own_time {
            own_time.chip.replace(image);
        }
        Ok(())
    }
}
