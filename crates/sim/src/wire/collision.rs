//! Two nodes that send one identifier with different contents: arbitration cannot distinguish them, a bit error does.

use can::Frame;

/// Order of two frames with one identifier after arbitration: by data length code, then bytes, dominant first.
/// The greater of two sends the first recessive bit that the other overwrites, and sees a bit error there.
pub(crate) fn contents(frame: &Frame) -> (u8, &[u8]) {
    (frame.dlc(), frame.data())
}

/// The bit, counted from start of frame with stuff bits, in which two frames with equal identifiers differ first.
///
/// `None` if they are the same frame.
pub(crate) fn first_difference(a: &Frame, b: &Frame) -> Option<u32> {
    let (mut left, mut right) = (Bits::of(a), Bits::of(b));
    let mut stuffing = Stuffing::default();
    loop {
        match (left.next(), right.next()) {
            (None, None) => return None,
            (Some(x), Some(y)) if x == y => stuffing.put(x),
            // The stuff bit due before this one is the same in both frames.
            _ => return Some(stuffing.count + 1),
        }
    }
}

/// The bits of a frame from start of frame to the end of data, before stuffing.
struct Bits {
    fields: [(u64, u32); 4],
    field: usize,
}

impl Bits {
    fn of(frame: &Frame) -> Self {
        let raw = u64::from(frame.id().raw());
        let remote = u64::from(frame.is_remote());
        let data = u64::from_be_bytes(*frame.padded());
        let data_bits = 8 * frame.data().len() as u32;
        // Arbitration field with start of frame, control bits, data length code, data.
        let arbitration = if frame.id().is_extended() {
            (((raw >> 18) << 21) | (0b11 << 19) | ((raw & 0x3_FFFF) << 1) | remote, 33)
        } else {
            ((raw << 1) | remote, 13)
        };
        let data = if data_bits == 0 { (0, 0) } else { (data >> (64 - data_bits), data_bits) };
        Self { fields: [arbitration, (0, 2), (u64::from(frame.dlc()), 4), data], field: 0 }
    }
}

impl Iterator for Bits {
    type Item = bool;

    fn next(&mut self) -> Option<bool> {
        while let Some((value, left)) = self.fields.get_mut(self.field) {
            if *left > 0 {
                *left -= 1;
                return Some(*value >> *left & 1 != 0);
            }
            self.field += 1;
        }
        None
    }
}

/// Counts bits as they go out, stuff bits included.
#[derive(Default)]
struct Stuffing {
    count: u32,
    run: u8,
    last: Option<bool>,
}

impl Stuffing {
    fn put(&mut self, bit: bool) {
        self.count += 1;
        self.run = if self.last == Some(bit) { self.run + 1 } else { 1 };
        self.last = Some(bit);
        if self.run == 5 {
            self.count += 1;
            self.run = 1;
            self.last = Some(!bit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn differ(a: &str, b: &str) -> Option<u32> {
        first_difference(&a.parse().unwrap(), &b.parse().unwrap())
    }

    #[test]
    fn finds_the_first_differing_bit_counted_by_hand() {
        // SOF 0, identifier 10101010101, RTR IDE r0 000, DLC 1000: nothing to stuff in the first 19 bits.
        let zeros = "555#0000000000000000";
        assert_eq!(differ(zeros, "555#8000000000000000"), Some(20));
        // Three zeros of the DLC and two of the byte: stuff bit; five more zeros: another.
        assert_eq!(differ(zeros, "555#0100000000000000"), Some(27 + 2));
        // DLC 0001 against 0010: r0 and the codes' first bits make five zeros, so the third bit is the 19th.
        assert_eq!(differ("555#00", "555#0000"), Some(18 + 1));
        assert_eq!(differ("555#00", "555#00"), None);
    }

    #[test]
    fn extended_frames_have_thirty_two_bits_before_the_control_field() {
        // SOF, 01010101010, SRR IDE 11, 010101010101010101, RTR 0, r1 r0 00, DLC 1000: the run RTR..r0 ends
        // an alternating identifier with 1, so nothing is stuffed before the data: 39 bits.
        let id = (0b010_1010_1010 << 18) | 0b01_0101_0101_0101_0101;
        let a = Frame::new(can::CanId::extended(id), &[0x80; 8]);
        let b = Frame::new(can::CanId::extended(id), &[0x00; 8]);
        assert_eq!(first_difference(&a, &b), Some(40));
    }
}
