//! Exact length of a classical CAN frame on the wire, stuff bits included (ISO 11898-1, 8.4 and 8.5).

use crate::{Frame, MAX_DATA_LENGTH};

/// Intermission between frames, in bits.
pub const INTERFRAME_SPACE_BITS: u32 = 3;

/// An active error flag, the delimiter and intermission: what a destroyed frame costs at least, in bits.
pub const ERROR_FRAME_BITS: u32 = 6 + 8 + INTERFRAME_SPACE_BITS;

/// CRC delimiter, ACK slot, ACK delimiter, end of frame: never stuffed.
const TAIL_BITS: u32 = 1 + 1 + 1 + 7;
const STUFF_RUN: u8 = 5;
const CRC_BITS: u32 = 15;
const CRC_POLYNOMIAL: u16 = 0x4599;

/// Bits from start of frame to the last bit of end of frame, with every stuff bit of the real contents.
///
/// The interframe space ([`INTERFRAME_SPACE_BITS`]) comes on top.
pub fn frame_bits(frame: &Frame) -> u32 {
    let raw = u64::from(frame.id().raw());
    let control = u64::from(frame.is_remote()) << 6 | u64::from(frame.dlc());
    // A recessive bit of the idle bus makes whole nibbles of the head: start of frame follows it.
    let (head, head_bits) = if frame.id().is_extended() {
        let (srr_and_ide, base, extension) = (0b11 << 25, raw >> 18, raw & 0x3_FFFF);
        (1 << 39 | base << 27 | srr_and_ide | extension << 7 | control, 39)
    } else {
        (1 << 19 | raw << 7 | control, 19)
    };
    let mut wire = Wire::IDLE;
    for place in (0..=head_bits / 4).rev() {
        wire.put((head >> (4 * place)) as u8 & 15);
    }
    for byte in frame.data() {
        wire.put(byte >> 4);
        wire.put(byte & 15);
    }
    // The delimiter is not stuffed. What stands for it here differs from the bit before it, and so adds none.
    let crc = wire.crc << 1 | (!wire.crc & 1);
    for place in (0..4).rev() {
        wire.stuff((crc >> (4 * place)) as u8 & 15);
    }
    head_bits + 8 * frame.data().len() as u32 + CRC_BITS + wire.stuff_bits + TAIL_BITS
}

/// The most bits that a data frame of `data_length` bytes can have, whatever its contents: a stuff bit after each four of those
/// that are stuffed, but for the first. Without interframe space, as [`frame_bits`].
///
/// Source: ISO 11898-1, 8.4 and 8.5; the count is that of Davis, Burns, Bril and Lukkien, "Controller Area Network (CAN)
/// schedulability analysis: Refuted, revisited and revised", 2007.
pub const fn most_frame_bits(extended: bool, data_length: u8) -> u32 {
    let data = 8 * if data_length as usize > MAX_DATA_LENGTH { MAX_DATA_LENGTH as u32 } else { data_length as u32 };
    let head = if extended { 39 } else { 19 };
    let stuffed = head + data + CRC_BITS;
    stuffed + (stuffed - 1) / 4 + TAIL_BITS
}

/// The fewest bits that a data frame of `data_length` bytes can have: none of them a stuff bit.
pub const fn fewest_frame_bits(extended: bool, data_length: u8) -> u32 {
    let data = 8 * if data_length as usize > MAX_DATA_LENGTH { MAX_DATA_LENGTH as u32 } else { data_length as u32 };
    let head = if extended { 39 } else { 19 };
    head + data + CRC_BITS + TAIL_BITS
}

/// Counts stuff bits as a transmitter puts bits out, four at a time.
struct Wire {
    crc: u16,
    /// The last bit, and how many like it stand in a row, stuff bits among them.
    run: u8,
    stuff_bits: u32,
}

impl Wire {
    /// Before the recessive bit of an idle bus, which leaves a CRC of 0 and begins a row of its own.
    const IDLE: Self = Self { crc: 1 << (CRC_BITS - 1), run: run(false, 1), stuff_bits: 0 };

    fn put(&mut self, nibble: u8) {
        let feedback = (self.crc >> (CRC_BITS - 4)) as u8 ^ nibble;
        self.crc = self.crc << 4 & 0x7FFF ^ CRC_OF_NIBBLE[usize::from(feedback & 15)];
        self.stuff(nibble);
    }

    fn stuff(&mut self, nibble: u8) {
        let (run, stuff_bits) = STUFFED[usize::from(self.run & 7)][usize::from(nibble & 15)];
        self.run = run;
        self.stuff_bits += u32::from(stuff_bits);
    }
}

/// One of eight: a fifth bit of a kind is followed by a stuff bit, with which the next row begins.
const fn run(bit: bool, length: u8) -> u8 {
    (bit as u8) << 2 | (length - 1)
}

/// What four bits add to the CRC.
const CRC_OF_NIBBLE: [u16; 16] = {
    let mut table = [0; 16];
    let mut nibble = 0;
    while nibble < 16 {
        let mut crc = (nibble as u16) << (CRC_BITS - 4);
        let mut bit = 0;
        while bit < 4 {
            let feedback = crc >> (CRC_BITS - 1) & 1;
            crc = crc << 1 & 0x7FFF ^ (feedback * CRC_POLYNOMIAL);
            bit += 1;
        }
        table[nibble] = crc;
        nibble += 1;
    }
    table
};

/// The row that is there behind four bits, and the stuff bits among them, by the row before them.
const STUFFED: [[(u8, u8); 16]; 8] = {
    let mut table = [[(0, 0); 16]; 8];
    let mut place = 0;
    while place < 128 {
        let (before, nibble) = (place / 16, place % 16);
        let (mut last, mut length, mut stuff_bits) = (before >> 2 == 1, (before & 3) as u8 + 1, 0);
        let mut shift = 4;
        while shift > 0 {
            shift -= 1;
            let bit = nibble >> shift & 1 == 1;
            length = if bit == last { length + 1 } else { 1 };
            last = bit;
            if length == STUFF_RUN {
                (last, length) = (!bit, 1);
                stuff_bits += 1;
            }
        }
        table[before][nibble] = (run(last, length), stuff_bits);
        place += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::CanId;
    use std::vec::Vec;

    /// An independent count: build the bit string, divide by the CRC polynomial, stuff with a string scan.
    fn by_strings(frame: &Frame) -> u32 {
        let id = frame.id().raw();
        let mut bits: Vec<u8> = Vec::from([0]);
        let push = |bits: &mut Vec<u8>, value: u32, width: usize| {
            let text = std::format!("{value:0width$b}");
            bits.extend(text.bytes().map(|b| b - b'0'));
        };
        if frame.id().is_extended() {
            push(&mut bits, id >> 18, 11);
            push(&mut bits, 3, 2);
            push(&mut bits, id & 0x3_FFFF, 18);
            push(&mut bits, frame.is_remote() as u32, 1);
            push(&mut bits, 0, 2);
        } else {
            push(&mut bits, id, 11);
            push(&mut bits, frame.is_remote() as u32, 1);
            push(&mut bits, 0, 2);
        }
        push(&mut bits, frame.dlc() as u32, 4);
        frame.data().iter().for_each(|b| push(&mut bits, *b as u32, 8));
        // Long division by x15+x14+x10+x8+x7+x4+x3+1.
        let divisor: Vec<u8> = "1100010110011001".bytes().map(|b| b - b'0').collect();
        let mut rest = bits.clone();
        rest.extend([0; 15]);
        for i in 0..bits.len() {
            if rest[i] == 1 {
                for (j, d) in divisor.iter().enumerate() {
                    rest[i + j] ^= d;
                }
            }
        }
        let crc = rest[bits.len()..].to_vec();
        bits.extend(crc);
        let mut stuffed: Vec<u8> = Vec::new();
        for bit in bits {
            stuffed.push(bit);
            let n = stuffed.len();
            if n >= 5 && stuffed[n - 5..].iter().all(|b| *b == bit) {
                // A run that a stuff bit already broke cannot reach five again unnoticed.
                stuffed.push(1 - bit);
            }
        }
        stuffed.len() as u32 + 10
    }

    #[test]
    fn agrees_with_long_division_and_a_string_scan() {
        let mut seed = 0x1234_5678_u32;
        let mut next = || {
            seed ^= seed << 13;
            seed ^= seed >> 17;
            seed ^= seed << 5;
            seed
        };
        for round in 0..2_000 {
            let length = (next() % 9) as u8;
            let id = if round % 3 == 0 { CanId::extended(next()) } else { CanId::standard(next() as u16) };
            let mask = [0xFF, 0x00, 0x81][round % 3];
            let bytes: Vec<u8> = (0..length).map(|_| next() as u8 & mask).collect();
            let frame = if round % 7 == 0 { Frame::remote(id, length) } else { Frame::new(id, &bytes) };
            assert_eq!(frame_bits(&frame), by_strings(&frame), "{frame}");
        }
    }

    #[test]
    fn stays_within_the_standard_bounds() {
        // Unstuffed: 44 + 8n bits without interframe space. Stuff bits: at most (34 + 8n - 1) / 4.
        for n in 0..=8u8 {
            for fill in [0x00, 0xFF, 0x55, 0x3C, 0x0F, 0x1E, 0x87, 0xC3] {
                for (extended, id) in [(false, CanId::standard(0x2AA)), (true, CanId::extended(0x0F0F_0F0F))] {
                    let bits = frame_bits(&Frame::new(id, &[fill; 8][..usize::from(n)]));
                    assert!(bits >= fewest_frame_bits(extended, n) && bits <= most_frame_bits(extended, n));
                }
            }
            let n = u32::from(n);
            assert_eq!(fewest_frame_bits(false, n as u8), 44 + 8 * n);
            assert_eq!(most_frame_bits(false, n as u8), 44 + 8 * n + (34 + 8 * n - 1) / 4);
        }
        // The paper's: (55 + 10 s) and (80 + 10 s) bit times with three of interframe space.
        for n in 0..=8u8 {
            assert_eq!(most_frame_bits(false, n) + INTERFRAME_SPACE_BITS, 55 + 10 * u32::from(n));
            assert_eq!(most_frame_bits(true, n) + INTERFRAME_SPACE_BITS, 80 + 10 * u32::from(n));
        }
        // Runs of equal bits must be broken.
        assert!(frame_bits(&Frame::full(CanId::standard(0), [0; 8])) > 108);
    }
}
