//! A drive on its motor, on a bench: the firmware joined to the physics of crate `plant`, without a bus in between.
#![allow(dead_code, reason = "each test file uses its own part of it")]

pub(crate) mod hub_wheel;
pub(crate) mod joint;

use can::{CanId, Frame, Instant, Station};
use canopen::Mux;
use canopen::od::Table;
use devices::AxisId;
use drives::Firmware;

/// Control period of all drives, s.
const DT_S: f64 = 50e-6;

/// What a drive is bolted to.
pub(crate) trait Rig {
    type Drive: Firmware;

    /// The drive's objects.
    const TABLE: &'static Table;

    fn sensors(&self) -> <Self::Drive as Firmware>::Sensors;

    /// Goes on by `dt_s`.
    fn step(&mut self, dt_s: f64, actuation: &<Self::Drive as Firmware>::Actuation);

    /// Speed of the motor's shaft.
    fn velocity_rad_s(&self) -> f64;
}

/// The drive, what it is bolted to, and everything that it has sent.
pub(crate) struct Bench<R: Rig> {
    pub(crate) drive: R::Drive,
    pub(crate) hardware: <R::Drive as Firmware>::Hardware,
    pub(crate) rig: R,
    pub(crate) now: Instant,
    pub(crate) sent: Vec<Frame>,
    pub(crate) node: u16,
}

impl<R: Rig> Bench<R> {
    /// Not switched on yet.
    pub(crate) fn unpowered(drive: R::Drive, rig: R, node: u16) -> Self
    where
        <R::Drive as Firmware>::Hardware: Default,
    {
        Self { drive, hardware: Default::default(), rig, now: Instant::from_millis(1), sent: Vec::new(), node }
    }

    pub(crate) fn power_on(&mut self) {
        self.drive.power_on(&self.hardware, self.now);
        self.run_ms(10);
    }

    /// One control period.
    pub(crate) fn step(&mut self) {
        let actuation = self.drive.tick(&self.rig.sensors(), self.now);
        self.rig.step(DT_S, &actuation);
        self.now = self.now.plus_nanos(R::Drive::CONTROL_PERIOD_NS);
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
        let (report, statusword) = (self.drive.report(AxisId::FIRST), self.statusword());
        panic!("not within {limit_ms} ms: {report:?}, statusword {statusword:04X}h");
    }

    pub(crate) fn rpm(&self) -> f64 {
        self.rig.velocity_rad_s() * 60.0 / std::f64::consts::TAU
    }

    /// SDO download.
    pub(crate) fn write(&mut self, index: u16, sub: u8, value: i64) {
        let result = self.try_write(index, sub, value);
        assert_eq!(result, Ok(()), "write {value} to {index:04X}h:{sub:02X}");
    }

    /// SDO download; the abort code if it is refused.
    pub(crate) fn try_write(&mut self, index: u16, sub: u8, value: i64) -> Result<(), u32> {
        let command = match row(R::TABLE, index, sub).data_type.size() {
            1 => 0x2F,
            2 => 0x2B,
            _ => 0x23,
        };
        let reply = self.sdo(command, index, sub, value as u32);
        if reply[0] == 0x60 { Ok(()) } else { Err(last_four(&reply)) }
    }

    /// SDO upload, sign-extended by the object's own type.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> i64 {
        let reply = self.sdo(0x40, index, sub, 0);
        assert_eq!(reply[0] & 0xE0, 0x40, "read of {index:04X}h:{sub:02X}: {reply:02X?}");
        row(R::TABLE, index, sub).data_type.value(last_four(&reply))
    }

    pub(crate) fn controlword(&mut self, value: u16) {
        self.write(0x6040, 0, i64::from(value));
    }

    pub(crate) fn statusword(&mut self) -> u16 {
        self.read(0x6041, 0) as u16
    }

    pub(crate) fn position(&mut self) -> i64 {
        self.read(0x6064, 0)
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
}

fn row(table: &'static Table, index: u16, sub: u8) -> &'static canopen::od::Entry {
    table.row(table.find(Mux::new(index, sub)).expect("an object of the drive"))
}

fn last_four([.., a, b, c, d]: &[u8; 8]) -> u32 {
    u32::from_le_bytes([*a, *b, *c, *d])
}
