//! A drive on a motor, on a bench: the firmware joined to the physics of crate `plant`, without a bus in between.
#![allow(dead_code, reason = "each test file uses its own part of it")]

use can::{CanId, Frame, Instant, Station};
use drives::Firmware;
use drives::zlac8030l::{Actuation, Hardware, PowerStage, Sensors, Zlac8030l};
use plant::{Angle, HubMotor, HubMotorModel, Inverter};

/// Control period in seconds.
const DT_S: f64 = 50e-6;

/// The drive, its motor and everything that a hand could touch.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) drive: Zlac8030l,
    pub(crate) hardware: Hardware,
    pub(crate) motor: HubMotor,
    pub(crate) now: Instant,
    /// Everything the drive has sent.
    pub(crate) sent: Vec<Frame>,
    pub(crate) inputs: [bool; 2],
    pub(crate) actuation: Actuation,
    /// Changes what the drive measures.
    pub(crate) tamper: fn(&mut Sensors),
    pub(crate) node: u16,
}

impl Bench {
    /// A drive as delivered, on the slow winding at 48 V, switched on and booted, without the watch over the host.
    pub(crate) fn new() -> Self {
        let mut bench = Self::with_watchdog();
        bench.write(0x2000, 0, 2, 0);
        bench
    }

    /// The same with 2000h as delivered.
    pub(crate) fn with_watchdog() -> Self {
        let mut bench = Self::unpowered(HubMotorModel::ZLLG65ASM250_L, 48.0);
        bench.power_on();
        bench
    }

    /// Not switched on yet.
    pub(crate) fn unpowered(model: HubMotorModel, supply_v: f64) -> Self {
        Self {
            drive: Zlac8030l::new(),
            hardware: Hardware::default(),
            motor: HubMotor::new(model, Angle::new(0, 0.123), supply_v, 25.0),
            now: Instant::from_millis(1),
            sent: Vec::new(),
            inputs: [false; 2],
            actuation: Actuation::default(),
            tamper: |_| {},
            node: 4,
        }
    }

    pub(crate) fn power_on(&mut self) {
        self.drive.power_on(&self.hardware, self.now);
        self.run_ms(10);
    }

    /// Off and on again; the EEPROM keeps what it holds.
    pub(crate) fn power_cycle(&mut self) {
        self.drive.power_off(self.now);
        self.hardware.eeprom = drives::engine::storage::Image::from_bytes(self.drive.eeprom().0);
        self.run_ms(5);
        self.power_on();
    }

    /// One control period.
    pub(crate) fn step(&mut self) {
        let sensors = self.sensors();
        self.actuation = self.drive.tick(&sensors, self.now);
        self.motor.step(DT_S, &self.plant_actuation());
        self.now = self.now.plus_nanos(Zlac8030l::CONTROL_PERIOD_NS);
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
        panic!("not within {limit_ms} ms: {:?}", self.drive.report());
    }

    pub(crate) fn sensors(&self) -> Sensors {
        let read = self.motor.sense();
        let mut sensors = Sensors {
            encoder_count: read.encoder_count,
            encoder_wired: true,
            hall: read.hall,
            phase_current_a: [read.phase_current_a[0] as f32, read.phase_current_a[1] as f32],
            bus_v: read.bus_v as f32,
            motor_c: read.winding_c as f32,
            driver_c: read.heat_sink_c as f32,
            inputs: self.inputs,
            ..Sensors::default()
        };
        (self.tamper)(&mut sensors);
        sensors
    }

    /// Hands the drive a frame in candump form.
    pub(crate) fn send(&mut self, frame: &str) {
        let frame: Frame = frame.parse().expect("a frame in candump form");
        self.drive.handle_frame(&frame, self.now);
        self.drain();
    }

    /// SDO download; the abort code if it is refused.
    pub(crate) fn try_write(&mut self, index: u16, sub: u8, size: u8, value: i64) -> Result<(), u32> {
        let command = match size {
            1 => 0x2F,
            2 => 0x2B,
            _ => 0x23,
        };
        let reply = self.sdo(command, index, sub, value as u32);
        if reply[0] == 0x60 { Ok(()) } else { Err(last_four(&reply)) }
    }

    pub(crate) fn write(&mut self, index: u16, sub: u8, size: u8, value: i64) {
        let result = self.try_write(index, sub, size, value);
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

    pub(crate) fn controlword(&mut self, value: u16) {
        self.write(0x6040, 0, 2, i64::from(value));
    }

    pub(crate) fn statusword(&mut self) -> u16 {
        self.read(0x6041, 0) as u16
    }

    /// 06, 07, 0F in a mode.
    pub(crate) fn enable(&mut self, mode: i64) {
        self.write(0x6060, 0, 1, mode);
        for word in [0x06, 0x07, 0x0F] {
            self.controlword(word);
            self.run_ms(1);
        }
        assert_eq!(self.statusword() & 0x6F, 0x27);
    }

    pub(crate) fn rpm(&self) -> f64 {
        self.motor.rotor.velocity_rad_s * 60.0 / std::f64::consts::TAU
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

    fn plant_actuation(&self) -> plant::Actuation {
        plant::Actuation {
            inverter: match self.actuation.power_stage {
                PowerStage::Off => Inverter::Open,
                PowerStage::Shorted => Inverter::Shorted,
                PowerStage::Modulate { duty } => Inverter::Driven(duty.map(f64::from)),
            },
            bleeder_on: self.actuation.bleeder_on,
            brake_released: !self.actuation.brake_engaged,
        }
    }
}

fn last_four(reply: &[u8; 8]) -> u32 {
    u32::from_le_bytes([reply[4], reply[5], reply[6], reply[7]])
}
