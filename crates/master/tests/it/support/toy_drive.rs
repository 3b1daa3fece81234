//! A CiA 402 drive in a few lines with the ZLAC8030L's objects, written by hand from CiA 402-2 and the
//! "ZLAC8030L quick start guide V1.00". It moves at constant speed, without ramps.

use std::collections::BTreeMap;

use can::Instant;

use super::toy::Toy;

type Objects = BTreeMap<(u16, u8), Vec<u8>>;

const COUNTS_PER_TURN: f64 = 4096.0;

#[derive(Clone, Default)]
pub(crate) struct ToyDrive {
    /// At this time it faults with this code.
    pub(crate) fault_at: Option<(Instant, u16)>,
    /// From this time on it answers nothing.
    pub(crate) silent_at: Option<Instant>,
    /// The fault's cause stays: a reset does nothing.
    pub(crate) fault_stays: bool,
    /// It takes controlwords and does nothing.
    pub(crate) stubborn: bool,
    /// It never acknowledges a set-point.
    pub(crate) deaf_to_set_points: bool,
    /// It stops within the move and says nothing.
    pub(crate) blocked: bool,
    /// Controlwords written, in order.
    pub(crate) controlwords: Vec<u16>,
    /// Longest time between two requests while it was moving, in ns.
    pub(crate) longest_gap_ns: u64,
    low: u16,
    acknowledge: bool,
    motion: Option<Motion>,
    last_request: Option<Instant>,
}

#[derive(Clone, Copy)]
struct Motion {
    from: f64,
    to: f64,
    began: Instant,
    counts_per_s: f64,
}

/// A drive as it leaves the factory, in Switch on disabled.
pub(crate) fn zlac8030l(id: u8) -> Toy {
    let mut toy = Toy::new(id)
        .u32(0x1000, 0, 0x0004_0192)
        .u32(0x1018, 1, 0x100)
        .u32(0x1018, 2, 1)
        .u32(0x1018, 3, 0)
        .u16(0x2000, 0, 1000)
        .u16(0x2009, 0, 0)
        .u16(0x200B, 0, 1024)
        .u16(0x2026, 1, 250)
        .u16(0x2026, 2, 300)
        .u16(0x2029, 0, 4800)
        .u16(0x200A, 0, 1000)
        .u16(0x2015, 0, 300)
        .u16(0x202F, 5, 1)
        .u16(0x603F, 0, 0)
        .u16(0x6040, 0, 0)
        .u16(0x6041, 0, 0x0270)
        .u8(0x6060, 0, 0)
        .u8(0x6061, 0, 0)
        .u32(0x6064, 0, 0)
        .u32(0x606C, 0, 0)
        .u16(0x6071, 0, 0)
        .u16(0x6077, 0, 0)
        .u32(0x607A, 0, 0)
        .u32(0x6081, 0, 120)
        .u32(0x6083, 0, 500)
        .u32(0x6084, 0, 500)
        .u32(0x6085, 0, 10)
        .u32(0x60FF, 0, 0);
    toy.drive = Some(ToyDrive { low: 0x0270, ..ToyDrive::default() });
    toy
}

impl ToyDrive {
    /// Brings the objects up to `now`. False if it has fallen silent.
    pub(crate) fn update(&mut self, objects: &mut Objects, now: Instant) -> bool {
        if self.silent_at.is_some_and(|at| at <= now) {
            return false;
        }
        if let (Some(last), Some(_)) = (self.last_request, self.motion) {
            self.longest_gap_ns = self.longest_gap_ns.max(now.nanos_since(last));
        }
        self.last_request = Some(now);
        if let Some((_, code)) = self.fault_at.take_if(|(at, _)| *at <= now) {
            self.low = 0x0298;
            self.motion = None;
            put(objects, 0x603F, &code.to_le_bytes());
        }
        let mut reached = self.motion.is_none();
        if let Some(Motion { from, to, began, counts_per_s }) = self.motion {
            let way = if self.blocked { 100.0 } else { (now - began).as_secs_f64() * counts_per_s };
            let at = if (to - from).abs() <= way { to } else { from + (to - from).signum() * way };
            reached = at == to;
            put(objects, 0x6064, &(at as i32).to_le_bytes());
        }
        if reached {
            self.motion = None;
        }
        let enabled = self.low & 0x6F == 0x27;
        let speed = if enabled && objects[&(0x6061, 0)] == [3] { value(objects, 0x60FF) as i32 * 10 } else { 0 };
        put(objects, 0x606C, &speed.to_le_bytes());
        let bits = u16::from(reached) << 10 | u16::from(self.acknowledge) << 12;
        put(objects, 0x6041, &(self.low | bits).to_le_bytes());
        true
    }

    /// An object was written at `now`.
    pub(crate) fn written(&mut self, key: (u16, u8), objects: &mut Objects, now: Instant) {
        match key.0 {
            0x6040 => self.command(value(objects, 0x6040) as u16, objects, now),
            0x6060 => put(objects, 0x6061, &objects[&(0x6060, 0)].clone()),
            _ => {}
        }
    }

    fn command(&mut self, word: u16, objects: &mut Objects, now: Instant) {
        let before = self.controlwords.last().copied().unwrap_or(0);
        self.controlwords.push(word);
        if self.stubborn {
            return;
        }
        let fault = self.low & 0x08 != 0;
        self.low = match (fault, word & 0x8F) {
            (true, 0x80..) if before & 0x80 == 0 && !self.fault_stays => {
                put(objects, 0x603F, &[0, 0]);
                0x0270
            }
            (true, _) => self.low,
            (_, 0x06) => 0x0231,
            (_, 0x07) if matches!(self.low, 0x0231 | 0x0237) => 0x0233,
            (_, 0x0F) if matches!(self.low, 0x0233 | 0x0237 | 0x0217) => 0x0237,
            (_, 0x02) if matches!(self.low, 0x0237 | 0x0217) => 0x0217,
            (_, command) if command & 2 == 0 => 0x0270,
            _ => self.low,
        };
        let enabled = self.low == 0x0237;
        if !enabled || word & 0x0100 != 0 {
            self.motion = None;
        }
        let edge = word & 0x10 != 0 && before & 0x10 == 0;
        if enabled && edge && !self.deaf_to_set_points {
            let from = f64::from(value(objects, 0x6064) as i32);
            let target = f64::from(value(objects, 0x607A) as i32);
            let to = if word & 0x40 != 0 { from + target } else { target };
            let counts_per_s = f64::from(value(objects, 0x6081)) / 60.0 * COUNTS_PER_TURN;
            self.motion = Some(Motion { from, to, began: now, counts_per_s });
        }
        self.acknowledge = enabled && word & 0x10 != 0 && !self.deaf_to_set_points;
    }
}

fn value(objects: &Objects, index: u16) -> u32 {
    let mut cell = [0; 4];
    let bytes = &objects[&(index, 0)];
    cell[..bytes.len()].copy_from_slice(bytes);
    u32::from_le_bytes(cell)
}

fn put(objects: &mut Objects, index: u16, bytes: &[u8]) {
    objects.insert((index, 0), bytes.to_vec());
}
