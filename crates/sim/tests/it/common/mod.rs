//! Stations and short words that the tests of this crate share.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses a part of it")]

use std::collections::VecDeque;
use std::time::Duration;

use can::{Bitrate, CanId, Frame, Instant, Station};
use sim::stimulus::{Component, Power, Source, Stimulus, TemperatureSensor};
use sim::wire::{ErrorCause, ErrorState, WireEvent};
use sim::{AxisId, Brake, Levels, PowerPhase, Refused, Report, StationId, VirtualDrive, World};

pub fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

/// Frames that got through: start and end in nanoseconds, candump form.
pub fn frames(world: &World) -> Vec<(u64, u64, String)> {
    let frames = world.log().iter().filter_map(|event| match event {
        WireEvent::Frame { start, end, frame, .. } => Some((start.as_nanos(), end.as_nanos(), frame.to_string())),
        _ => None,
    });
    frames.collect()
}

pub fn texts(world: &World) -> Vec<String> {
    frames(world).into_iter().map(|(.., text)| text).collect()
}

/// Errors: when, in nanoseconds, and why.
pub fn errors(world: &World) -> Vec<(u64, ErrorCause)> {
    let errors = world.log().iter().filter_map(|event| match event {
        WireEvent::Error { at, cause, .. } => Some((at.as_nanos(), *cause)),
        _ => None,
    });
    errors.collect()
}

/// Changes of a controller's error state.
pub fn states(world: &World, id: StationId) -> Vec<(u64, ErrorState)> {
    let states = world.log().iter().filter_map(|event| match event {
        WireEvent::State { at, controller, state } if *controller == id.index() => Some((at.as_nanos(), *state)),
        _ => None,
    });
    states.collect()
}

pub fn heard(world: &mut World, probe: StationId) -> Vec<String> {
    std::iter::from_fn(|| world.poll_received(probe)).map(|(_, frame)| frame.to_string()).collect()
}

/// Sends one frame again and again.
#[derive(Clone)]
pub struct Chatter {
    pub frame: Frame,
    pub period: Duration,
    pub next: Instant,
    pub pending: bool,
    pub heard: u64,
    pub transmitted: u64,
}

impl Chatter {
    pub fn new(frame: Frame, first: Instant, period: Duration) -> Self {
        Self { frame, period, next: first, pending: false, heard: 0, transmitted: 0 }
    }
}

impl Station for Chatter {
    fn handle_frame(&mut self, _: &Frame, _: Instant) {
        self.heard += 1;
    }

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.next {
            self.pending = true;
            self.next += self.period;
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        std::mem::take(&mut self.pending).then_some(self.frame)
    }

    fn poll_timeout(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn handle_transmitted(&mut self, _: &Frame, _: Instant) {
        self.transmitted += 1;
    }
}

/// A machine of one line: it turns with constant speed, answers `600h + node` with `580h + node` and boots.
#[derive(Clone)]
pub struct TestDrive {
    pub node: u8,
    pub rate: Bitrate,
    pub powered: bool,
    pub answer_after: Duration,
    pub speed_rpm: f64,
    pub position: i64,
    pub inputs: [bool; 2],
    pub supply_v: f64,
    pub motor_c: Option<f64>,
    pub torque_nm: f64,
    angle_rad: f64,
    advanced_to: Instant,
    answers: VecDeque<Instant>,
    out: VecDeque<Frame>,
    stored: Vec<u8>,
    generation: u64,
}

impl TestDrive {
    pub fn new(node: u8) -> Self {
        Self {
            node,
            rate: Bitrate::K500,
            powered: false,
            answer_after: Duration::from_micros(500),
            speed_rpm: 60.0,
            position: 0,
            inputs: [false; 2],
            supply_v: 48.0,
            motor_c: None,
            torque_nm: 0.0,
            angle_rad: 0.0,
            advanced_to: Instant::ZERO,
            answers: VecDeque::new(),
            out: VecDeque::new(),
            stored: Vec::new(),
            generation: 0,
        }
    }
}

impl TestDrive {
    fn switch(&mut self, on: bool) {
        self.powered = on;
        self.answers.clear();
        self.out.clear();
        if on {
            self.out.push_back(Frame::new(CanId::standard(0x700 + u16::from(self.node)), &[0]));
        }
    }
}

impl Station for TestDrive {
    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        if frame.standard_data_id() == Some(0x600 + u16::from(self.node)) && self.powered {
            self.answers.push_back(now + self.answer_after);
        }
    }

    fn handle_timeout(&mut self, now: Instant) {
        while self.answers.front().is_some_and(|at| *at <= now) {
            self.answers.pop_front();
            self.out.push_back(Frame::full(CanId::standard(0x580 + u16::from(self.node)), [0; 8]));
        }
    }

    fn poll_transmit(&mut self) -> Option<Frame> {
        self.out.pop_front()
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.answers.front().copied()
    }
}

impl VirtualDrive for TestDrive {
    fn model(&self) -> &'static str {
        "testdrive"
    }

    fn apply(&mut self, axis: AxisId, stimulus: &Stimulus, now: Instant) -> Result<(), Refused> {
        self.check_axis(axis)?;
        let absent = |what| Refused::Absent { model: "testdrive", what };
        if !matches!(stimulus, Stimulus::Input { .. } | Stimulus::LoadTorque(_)) {
            self.advance(now);
        }
        match *stimulus {
            Stimulus::Power(Power::Cycle) => {
                self.switch(false);
                self.switch(true);
            }
            Stimulus::Power(power) => self.switch(power == Power::On),
            Stimulus::Input { ref name, level } => self.inputs[self.input_number(name)?] = level,
            Stimulus::Switch { ref name, range } => {
                self.inputs[self.input_number(name)?] = range.contains(self.position);
            }
            Stimulus::LoadTorque(torque_nm) => self.torque_nm = torque_nm,
            Stimulus::RotorLock(locked) => self.speed_rpm = if locked { 0.0 } else { 60.0 },
            Stimulus::Supply(Source { voltage_v: Some(value), limit_a: None, resistance_ohm: None }) => {
                if value > 100.0 {
                    return Err(Refused::OutOfRange { what: "supply voltage", expected: "0 to 100 V", value });
                }
                self.supply_v = value;
            }
            Stimulus::Supply(_) => return Err(absent("limit or resistance of its supply")),
            Stimulus::Temperature(TemperatureSensor::Motor, celsius) => self.motor_c = celsius,
            Stimulus::Temperature(TemperatureSensor::Driver, _) => return Err(absent("driver temperature sensor")),
            Stimulus::Fault(Component::Hall, _) => return Err(absent("Hall sensor")),
            Stimulus::Battery(_) => return Err(absent("battery")),
            Stimulus::Pulses(_) => return Err(absent("pulse input")),
            Stimulus::Object { mux, .. } => return Err(Refused::OwnObjects { model: "testdrive", object: mux }),
            Stimulus::LoadInertia(_) | Stimulus::Fault(..) | Stimulus::CableCut(_) | Stimulus::Bus(_) => {}
            Stimulus::Load(_) => return Err(absent("such load")),
            Stimulus::Mpdo { .. } => return Err(absent("multiplexed PDO")),
        }
        Ok(())
    }

    fn bitrate(&self) -> Option<Bitrate> {
        self.powered.then_some(self.rate)
    }

    fn advance(&mut self, now: Instant) {
        assert!(!self.torque_nm.is_nan(), "a test drive with a load that is NaN");
        if self.powered {
            let turns = self.speed_rpm / 60.0 * (now - self.advanced_to).as_secs_f64();
            self.angle_rad += turns * std::f64::consts::TAU;
            self.position = (self.angle_rad / std::f64::consts::TAU * 4096.0) as i64;
        }
        self.advanced_to = now;
    }

    fn report(&self) -> Report {
        Report {
            node: self.node,
            powered: self.powered,
            power: if self.powered { PowerPhase::On } else { PowerPhase::Off },
            position: self.position,
            velocity_rpm: if self.powered { self.speed_rpm } else { 0.0 },
            current_a: 1.25,
            supply_v: self.supply_v,
            motor_c: self.motor_c,
            outputs: Levels { names: &["Y0", "Y1"], bits: 0b10 },
            brake: Some(Brake::Released),
            shaft_angle_rad: self.angle_rad,
            ..Report::default()
        }
    }

    fn inputs(&self) -> &'static [&'static str] {
        &["X0", "X1"]
    }

    fn nvm_generation(&self) -> u64 {
        self.generation
    }

    fn nvm_image(&self) -> Vec<u8> {
        self.stored.clone()
    }

    fn load_nvm(&mut self, image: &[u8]) -> Result<(), Refused> {
        self.stored = image.to_vec();
        Ok(())
    }
}
