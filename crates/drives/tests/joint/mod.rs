//! An M joint on a bench: the firmware joined to the physics of crate `plant`, without a bus in between.
#![allow(dead_code, reason = "each test file uses its own part of it")]

use can::{CanId, Frame, Instant, Station};
use drives::Firmware;
use drives::engine::storage::Image;
use drives::mjoint::pulses::PulseInput;
use drives::mjoint::{Actuation, Battery, Brake, Hardware, MJoint, Model, PowerStage, Sensors};
use plant::absolute_encoder::BatteryState;
use plant::{Angle, Inverter, JointMotor, JointMotorModel, joint_motor};

/// Control period in seconds.
const DT_S: f64 = 50e-6;

/// Counts of one turn.
pub(crate) const TURN: i64 = 32_768;

/// A switch on PU or DIR: on while the shaft is at these counts from where the bench began.
pub(crate) type Range = core::ops::Range<i64>;

/// The drive, its motor and everything that a hand could touch.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) drive: MJoint,
    pub(crate) hardware: Hardware,
    pub(crate) motor: JointMotor,
    pub(crate) now: Instant,
    /// Everything the drive has sent.
    pub(crate) sent: Vec<Frame>,
    pub(crate) pu: Range,
    pub(crate) dir: Range,
    pub(crate) pulses: PulseInput,
    pub(crate) actuation: Actuation,
    pub(crate) node: u16,
    start: i64,
}

impl Bench {
    /// A drive as delivered, at 36 V, switched on and booted.
    pub(crate) fn new() -> Self {
        let mut bench = Self::unpowered(&Model::M4230E17B50, JointMotorModel::M4230E17B50);
        bench.power_on();
        bench
    }

    /// Not switched on yet.
    pub(crate) fn unpowered(model: &'static Model, motor: JointMotorModel) -> Self {
        let motor = JointMotor::new(motor, Angle::new(0, 0.123), 36.0, 25.0);
        let start = motor.rotor.angle.count(TURN as u32);
        Self {
            drive: MJoint::new(model),
            hardware: Hardware::default(),
            motor,
            now: Instant::from_millis(1),
            sent: Vec::new(),
            pu: 0..0,
            dir: 0..0,
            pulses: PulseInput::default(),
            actuation: Actuation::default(),
            node: 1,
            start,
        }
    }

    pub(crate) fn power_on(&mut self) {
        self.motor.rig.supply.connected = true;
        self.drive.power_on(&self.hardware, self.now);
        self.run_ms(5);
    }

    pub(crate) fn power_off(&mut self) {
        self.drive.power_off(self.now);
        self.hardware.eeprom = Image::from_bytes(self.drive.eeprom().0);
        self.motor.rig.supply.connected = false;
        self.motor.rig.supply.bus_v = 0.0;
    }

    /// Off for a while and on again; the EEPROM keeps what it holds.
    pub(crate) fn power_cycle(&mut self) {
        self.power_off();
        self.run_ms(20);
        self.motor.rig.supply.bus_v = self.motor.rig.supply.source_v;
        self.power_on();
    }

    /// One control period.
    pub(crate) fn step(&mut self) {
        let sensors = self.sensors();
        self.actuation = self.drive.tick(&sensors, self.now);
        self.motor.step(DT_S, &self.plant_actuation());
        self.now = self.now.plus_nanos(MJoint::CONTROL_PERIOD_NS);
        if self.drive.poll_timeout().is_some_and(|deadline| deadline <= self.now) {
            self.drive.handle_timeout(self.now);
        }
        self.drain();
    }

    pub(crate) fn run_ms(&mut self, ms: u32) {
        (0..ms * 20).for_each(|_| self.step());
    }

    pub(crate) fn run_s(&mut self, s: f64) {
        self.run_ms((s * 1e3) as u32);
    }

    /// Milliseconds until `done`; panics after `limit_ms`.
    pub(crate) fn run_until(&mut self, limit_ms: u32, mut done: impl FnMut(&mut Self) -> bool) -> u32 {
        for ms in 0..limit_ms {
            if done(self) {
                return ms;
            }
            self.run_ms(1);
        }
        let (report, statusword) = (self.drive.report(), self.statusword());
        panic!("not within {limit_ms} ms: {report:?}, statusword {statusword:04X}h");
    }

    /// Counts of the shaft from where the bench began.
    pub(crate) fn shaft(&self) -> i64 {
        self.motor.rotor.angle.count(TURN as u32) - self.start
    }

    pub(crate) fn rpm(&self) -> f64 {
        self.motor.rotor.velocity_rad_s * 60.0 / std::f64::consts::TAU
    }

    pub(crate) fn sensors(&self) -> Sensors {
        let read = self.motor.sense();
        let angle = self.motor.rotor.angle.count(TURN as u32);
        Sensors {
            angle_count: angle.rem_euclid(TURN) as u16,
            position_counts: read.position_counts,
            turns_lost: read.turns_lost,
            battery: match read.battery {
                BatteryState::Full => Battery::Full,
                BatteryState::Charging => Battery::Charging,
                BatteryState::Disconnected => Battery::Missing,
            },
            phase_current_a: [read.phase_current_a[0] as f32, read.phase_current_a[1] as f32],
            bus_v: read.bus_v as f32,
            driver_c: read.heat_sink_c as f32,
            pu: self.pu.contains(&self.shaft()),
            dir: self.dir.contains(&self.shaft()),
            pulses: self.pulses,
            eeprom_fails: false,
        }
    }

    /// Hands the drive a frame in candump form.
    pub(crate) fn send(&mut self, frame: &str) {
        let frame: Frame = frame.parse().expect("a frame in candump form");
        self.drive.handle_frame(&frame, self.now);
        self.drain();
    }

    /// The answer to a frame, in candump form.
    pub(crate) fn ask(&mut self, frame: &str) -> Option<String> {
        let from = self.sent.len();
        self.send(frame);
        self.sent.get(from).map(ToString::to_string)
    }

    /// SDO download; the abort code if it is refused.
    pub(crate) fn try_write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let table = self.drive.values().table();
        let size = table.find(canopen::Mux::new(index, sub)).map_or(4, |slot| table.row(slot).data_type.size());
        let command = match size {
            1 => 0x2F,
            2 => 0x2B,
            _ => 0x23,
        };
        let reply = self.sdo(command, index, sub, value as u32);
        if reply[0] == 0x60 { Ok(()) } else { Err(last_four(&reply)) }
    }

    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64) {
        let result = self.try_write(index, sub, value);
        assert_eq!(result, Ok(()), "write {value} to {index:04X}h:{sub:02X}");
    }

    /// SDO upload, sign-extended by the object's own type.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> i64 {
        let reply = self.sdo(0x40, index, sub, 0);
        assert_eq!(reply[0] & 0xE0, 0x40, "read of {index:04X}h:{sub:02X}: {reply:02X?}");
        let table = self.drive.values().table();
        let slot = table.find(canopen::Mux::new(index, sub)).unwrap();
        table.row(slot).data_type.value(last_four(&reply))
    }

    /// The abort code that an upload is refused with.
    pub(crate) fn refused(&mut self, index: u16, sub: u8) -> Option<u32> {
        let reply = self.sdo(0x40, index, sub, 0);
        (reply[0] == 0x80).then(|| last_four(&reply))
    }

    pub(crate) fn position(&mut self) -> i64 {
        self.read(0x6064, 0)
    }

    pub(crate) fn controlword(&mut self, value: u16) {
        self.write(0x6040, 0, i64::from(value));
    }

    pub(crate) fn statusword(&mut self) -> u16 {
        self.read(0x6041, 0) as u16
    }

    pub(crate) fn alarm(&mut self) -> i64 {
        self.read(0x260E, 0)
    }

    /// Absolute moves, each new one at once (5.06.1).
    pub(crate) fn enable_absolute(&mut self) {
        self.write(0x6060, 0, 1);
        self.controlword(0x2F);
    }

    /// Speed mode (5.07.1).
    pub(crate) fn enable_speed(&mut self) {
        self.write(0x6060, 0, 3);
        self.controlword(0x0F);
    }

    pub(crate) fn until_reached(&mut self, limit_ms: u32) -> u32 {
        self.run_until(limit_ms, |bench| bench.statusword() & 0x0400 != 0)
    }

    /// Frames sent under an identifier since the first `from` of all, as text.
    pub(crate) fn sent_as(&self, id: u16, from: usize) -> Vec<String> {
        let frames = self.sent[from..].iter().filter(|frame| frame.id() == CanId::standard(id));
        frames.map(ToString::to_string).collect()
    }

    fn sdo(&mut self, command: u8, index: u16, sub: u8, value: u32) -> [u8; 8] {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let request = Frame::full(CanId::standard(0x600 + self.node), [command, low, high, sub, a, b, c, d]);
        self.drive.handle_frame(&request, self.now);
        let from = self.sent.len();
        self.drain();
        let reply = CanId::standard(0x580 + self.node);
        let frame = self.sent[from..].iter().find(|frame| frame.id() == reply).expect("an SDO reply");
        *frame.padded()
    }

    fn drain(&mut self) {
        while let Some(frame) = self.drive.poll_transmit() {
            self.drive.handle_transmitted(&frame, self.now);
            self.sent.push(frame);
        }
    }

    fn plant_actuation(&self) -> joint_motor::Actuation {
        joint_motor::Actuation {
            inverter: match self.actuation.power_stage {
                PowerStage::Off => Inverter::Open,
                PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            },
            brake_released: self.actuation.brake != Brake::Engaged,
            set_origin: self.actuation.set_origin,
        }
    }
}

fn last_four(reply: &[u8; 8]) -> u32 {
    u32::from_le_bytes([reply[4], reply[5], reply[6], reply[7]])
}
