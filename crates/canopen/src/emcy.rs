//! Emergency (CiA 301, 7.2.7): the frame and its producer with inhibit time (1015h) and a bounded queue.
//!
//! Which fault has which code is the device's table; the error register and the five manufacturer bytes are
//! passed in. The error history (1003h) is not kept here: none of the drives has it.

use core::fmt;

use can::{CanId, Frame, Instant};
use heapless::Deque;

/// An EMCY error code. Open: a device may say anything. Source: CiA 301, table 26.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct EmcyErrorCode(pub u16);

impl EmcyErrorCode {
    /// 0000h: error reset or no error.
    pub const NO_ERROR: Self = Self(0x0000);
    /// 1000h: generic error.
    pub const GENERIC: Self = Self(0x1000);
    /// 8110h: CAN overrun, objects lost.
    pub const CAN_OVERRUN: Self = Self(0x8110);
    /// 8120h: CAN in error passive mode.
    pub const CAN_ERROR_PASSIVE: Self = Self(0x8120);
    /// 8130h: life guard error or heartbeat error.
    pub const HEARTBEAT: Self = Self(0x8130);
    /// 8140h: recovered from bus off.
    pub const RECOVERED_FROM_BUS_OFF: Self = Self(0x8140);
    /// 8210h: PDO not processed due to length error.
    pub const PDO_NOT_PROCESSED: Self = Self(0x8210);
    /// 8220h: PDO length exceeded.
    pub const PDO_TOO_LONG: Self = Self(0x8220);
    /// 8230h: MPDO in destination address mode not processed, destination object not available.
    pub const DESTINATION_NOT_AVAILABLE: Self = Self(0x8230);
    /// 8240h: unexpected SYNC data length.
    pub const SYNC_LENGTH: Self = Self(0x8240);
    /// 8250h: RPDO timeout.
    pub const RPDO_TIMEOUT: Self = Self(0x8250);

    /// The class of the code, in the words of the standard: the most specific row of table 26 that covers it.
    pub const fn class(self) -> &'static str {
        match self.0 {
            0x0000..=0x00FF => "error reset or no error",
            0x1000..=0x10FF => "generic error",
            0x2000..=0x20FF => "current",
            0x2100..=0x21FF => "current, CANopen device input side",
            0x2200..=0x22FF => "current inside the CANopen device",
            0x2300..=0x23FF => "current, CANopen device output side",
            0x3000..=0x30FF => "voltage",
            0x3100..=0x31FF => "mains voltage",
            0x3200..=0x32FF => "voltage inside the CANopen device",
            0x3300..=0x33FF => "output voltage",
            0x4000..=0x40FF => "temperature",
            0x4100..=0x41FF => "ambient temperature",
            0x4200..=0x42FF => "CANopen device temperature",
            0x5000..=0x50FF => "CANopen device hardware",
            0x6000..=0x60FF => "CANopen device software",
            0x6100..=0x61FF => "internal software",
            0x6200..=0x62FF => "user software",
            0x6300..=0x63FF => "data set",
            0x7000..=0x70FF => "additional modules",
            0x8110 => "CAN overrun (objects lost)",
            0x8120 => "CAN in error passive mode",
            0x8130 => "life guard error or heartbeat error",
            0x8140 => "recovered from bus off",
            0x8150 => "CAN-ID collision",
            0x8100..=0x81FF => "communication",
            0x8210 => "PDO not processed due to length error",
            0x8220 => "PDO length exceeded",
            0x8230 => "DAM MPDO not processed, destination object not available",
            0x8240 => "unexpected SYNC data length",
            0x8250 => "RPDO timeout",
            0x8200..=0x82FF => "protocol error",
            0x8000..=0x80FF => "monitoring",
            0x9000..=0x90FF => "external error",
            0xF000..=0xF0FF => "additional functions",
            0xFF00..=0xFFFF => "CANopen device specific",
            _ => "not a code of CiA 301",
        }
    }
}

/// `8130h (life guard error or heartbeat error)`. Codes 0001h to 00FFh are of the class "no error", and yet some devices
/// send their faults in them: they are not called that.
impl fmt::Display for EmcyErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self.0 {
            0x0000 => "error reset",
            0x0001..=0x00FF => "a code of the maker's",
            _ => self.class(),
        };
        write!(f, "{:04X}h ({words})", self.0)
    }
}

impl fmt::Debug for EmcyErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EmcyErrorCode({self})")
    }
}

/// The content of an EMCY frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emcy {
    /// Bytes 0 and 1.
    pub code: EmcyErrorCode,
    /// Byte 2: the error register, object 1001h.
    pub error_register: u8,
    /// Bytes 3 to 7: the manufacturer's.
    pub manufacturer: [u8; 5],
}

impl Emcy {
    /// Reads a data frame of eight bytes; `None` for any other. The identifier is the caller's to check.
    pub fn parse(frame: &Frame) -> Option<Self> {
        let [low, high, error_register, manufacturer @ ..] = <[u8; 8]>::try_from(frame.data()).ok()?;
        Some(Self { code: EmcyErrorCode(u16::from_le_bytes([low, high])), error_register, manufacturer })
    }

    /// The frame on `id`.
    pub const fn emit(self, id: CanId) -> Frame {
        let [low, high] = self.code.0.to_le_bytes();
        let [a, b, c, d, e] = self.manufacturer;
        Frame::full(id, [low, high, self.error_register, a, b, c, d, e])
    }
}

/// How many EMCY messages may wait for the inhibit time. When full, the oldest is dropped: the newest shows how
/// things are.
pub const QUEUE_LENGTH: usize = 8;

/// Waiting messages and the inhibit time between them.
#[derive(Clone, Debug)]
pub struct Producer {
    queue: Deque<Emcy, QUEUE_LENGTH>,
    inhibit_ns: u64,
    inhibited_until: Instant,
}

impl Default for Producer {
    fn default() -> Self {
        Self::new()
    }
}

impl Producer {
    /// Nothing waiting, no inhibit time.
    pub const fn new() -> Self {
        Self { queue: Deque::new(), inhibit_ns: 0, inhibited_until: Instant::ZERO }
    }

    /// Sets the inhibit time from 1015h, in multiples of 100 us.
    pub const fn set_inhibit_time(&mut self, raw: u16) {
        self.inhibit_ns = raw as u64 * 100_000;
    }

    /// Queues a message.
    pub fn raise(&mut self, emcy: Emcy) {
        if self.queue.is_full() {
            self.queue.pop_front();
        }
        // Cannot fail: there is room now.
        let _ = self.queue.push_back(emcy);
    }

    /// True if a message may be sent at `now`.
    pub fn is_ready(&self, now: Instant) -> bool {
        !self.queue.is_empty() && now >= self.inhibited_until
    }

    /// When after `now` a message that is held back may be sent; [`Instant::FAR_FUTURE`] if there is none.
    pub fn deadline(&self, now: Instant) -> Instant {
        let is_held_back = !self.queue.is_empty() && now < self.inhibited_until;
        if is_held_back { self.inhibited_until } else { Instant::FAR_FUTURE }
    }

    /// Takes the oldest message to offer it at `now`.
    pub fn take(&mut self, now: Instant) -> Option<Emcy> {
        let emcy = self.queue.pop_front()?;
        self.inhibited_until = now.plus_nanos(self.inhibit_ns);
        Some(emcy)
    }

    /// The wire took the message at `now`: the inhibit time counts from here.
    pub const fn handle_transmitted(&mut self, now: Instant) {
        self.inhibited_until = now.plus_nanos(self.inhibit_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_emitted_is_parsed_back() {
        let frame: Frame = "084#3081050102030405".parse().unwrap();
        let emcy = Emcy::parse(&frame).unwrap();
        assert_eq!(emcy.code, EmcyErrorCode::HEARTBEAT);
        assert_eq!(emcy.error_register, 5);
        assert_eq!(emcy.manufacturer, [1, 2, 3, 4, 5]);
        assert_eq!(emcy.emit(frame.id()), frame);
        for text in ["084#", "084#30810501020304", "084#R8"] {
            assert_eq!(Emcy::parse(&text.parse().unwrap()), None);
        }
    }

    #[test]
    fn a_full_queue_keeps_the_newest() {
        let mut producer = Producer::new();
        for code in 0..20 {
            producer.raise(Emcy { code: EmcyErrorCode(code), error_register: 0, manufacturer: [0; 5] });
        }
        let codes = core::iter::from_fn(|| producer.take(Instant::ZERO).map(|emcy| emcy.code.0));
        assert!(codes.eq(12..20));
    }

    #[test]
    fn every_code_has_a_class_and_the_specific_row_wins() {
        assert_eq!(EmcyErrorCode(0x8130).class(), "life guard error or heartbeat error");
        assert_eq!(EmcyErrorCode(0x8131).class(), "communication");
        assert_eq!(EmcyErrorCode(0x2310).class(), "current, CANopen device output side");
        assert_eq!(EmcyErrorCode(0xA000).class(), "not a code of CiA 301");
    }
}
