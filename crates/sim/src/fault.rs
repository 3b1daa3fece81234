//! Faults of a CAN bus, seeded and honest: what a real bus can do to frames and nodes, nothing else.
//!
//! A corrupted frame is never delivered corrupted (the CRC's residual error is not modelled): it costs
//! an error frame, error counters, a resend and at worst bus-off (ISO 11898-1).
//! Cable cut and join are [`World::cut`](crate::World::cut) and [`World::join`](crate::World::join).

use std::collections::BTreeMap;

use can::Frame;

use crate::Prng;

/// Which frames on the bus are destroyed by a disturbance.
#[derive(Clone, Debug, Default)]
pub struct Corruption {
    probability: f64,
    nth: BTreeMap<u64, u32>,
    seen: u64,
}

impl Corruption {
    /// A wire on which no frame is destroyed.
    pub fn none() -> Self {
        Self::default()
    }

    /// Each frame (each attempt to send one) is destroyed with `probability`, at a random bit.
    pub fn with_probability(probability: f64) -> Self {
        Self { probability: probability.clamp(0.0, 1.0), ..Self::default() }
    }

    /// Also destroys the `n`-th attempt from here on (the next is 1), so that every node sees the error in the
    /// `bit`-th bit of the frame (start of frame is 1, stuff bits count).
    pub fn and_nth_at_bit(mut self, n: u64, bit: u32) -> Self {
        self.nth.insert(n, bit);
        self
    }

    /// From here on each frame is destroyed with `probability`; planned strikes stay.
    pub(crate) fn set_probability(&mut self, probability: f64) {
        self.probability = probability.clamp(0.0, 1.0);
    }

    /// Also destroys the `n`-th attempt from here on, at its `bit`-th bit.
    pub(crate) fn strike_nth(&mut self, n: u64, bit: u32) {
        self.nth.insert(self.seen.saturating_add(n), bit);
    }

    /// Decides on the next attempt of a frame `bits` long: the bit with the error, 1..=`bits`.
    pub(crate) fn strike(&mut self, bits: u32, prng: &mut Prng) -> Option<u32> {
        self.seen += 1;
        let planned = self.nth.remove(&self.seen);
        let by_chance = self.probability > 0.0 && prng.chance(self.probability);
        match planned {
            Some(bit) => Some(bit.clamp(1, bits)),
            None => by_chance.then(|| 1 + prng.below(bits.into()) as u32),
        }
    }
}

/// What is wrong with one node's access to the bus. The default: nothing.
#[derive(Clone, Debug, Default)]
pub struct NodeFaults {
    /// Listens only: sends no frames (they wait in its mailboxes), no acknowledge, no error flags.
    pub silent: bool,
    /// Its frames are offered to the bus later than its firmware gave them away.
    pub late: Option<Delay>,
    /// Sends a frame of its own accord, again and again.
    pub babble: Option<Babble>,
    /// Loses frames that come too fast.
    pub overrun: Option<Overrun>,
    /// The probability with which an attempt to send fails for a bad contact of its own: every node sees the error, and
    /// its error counter rises towards bus-off.
    pub corrupt: f64,
}

impl NodeFaults {
    /// Decides on an attempt of its own, `bits` long: the bit with the error. Draws nothing while its contact is good.
    pub(crate) fn strike(&self, bits: u32, prng: &mut Prng) -> Option<u32> {
        (self.corrupt > 0.0 && prng.chance(self.corrupt)).then(|| 1 + prng.below(bits.into()) as u32)
    }
}

/// A delay drawn uniformly from a range, in nanoseconds. Frames keep their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    /// Shortest delay.
    pub min_ns: u64,
    /// Longest delay.
    pub max_ns: u64,
}

impl Delay {
    /// Always the same delay.
    pub const fn fixed(nanos: u64) -> Self {
        Self { min_ns: nanos, max_ns: nanos }
    }

    pub(crate) fn draw(self, prng: &mut Prng) -> u64 {
        let span = self.max_ns.saturating_sub(self.min_ns);
        self.min_ns.saturating_add(prng.below(span.saturating_add(1)))
    }
}

/// A babbling node ("babbling idiot"): `frame` is offered again `gap_ns` after it went out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Babble {
    /// The frame sent over and over.
    pub frame: Frame,
    /// Pause between the end of one and the offer of the next; 0 fills the bus as priority allows.
    pub gap_ns: u64,
}

/// A receiver with a buffer of `depth` frames and firmware that needs `service_ns` for each.
///
/// A frame that finds the buffer full is lost; it was acknowledged all the same, as on a real controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overrun {
    /// Frames the controller can hold.
    pub depth: u32,
    /// Time the firmware takes to fetch one.
    pub service_ns: u64,
}
