//! Frames of Modbus RTU ("MODBUS over Serial Line V1.02", 2.5.1): address, request, check; a silence ends each.
//!
//! Silence is hard to see behind the buffers of an operating system, so a frame is taken as soon as its own length says
//! that it is whole and its check is right. Only what has no such length, or contradicts itself, waits for the silence.

use super::adu::Adu;

/// Longest frame (2.5.1.1).
const MAX_FRAME: usize = 256;
/// Address and check.
const AROUND: usize = 3;

/// What came in and has not been understood.
#[derive(Clone, Debug, Default)]
pub(super) struct SerialLine {
    input: Vec<u8>,
    /// No frame begins before this place, unless the whole input is one.
    start: usize,
}

impl SerialLine {
    pub(super) fn receive(&mut self, bytes: &[u8]) {
        self.input.extend_from_slice(bytes);
    }

    /// Something waits for more, or for silence.
    pub(super) fn is_waiting(&self) -> bool {
        !self.input.is_empty()
    }

    /// Takes the first frame that is whole.
    pub(super) fn take(&mut self) -> Option<Adu> {
        while self.start < self.input.len() {
            let rest = &self.input[self.start..];
            match request_length(rest) {
                Length::Known(length) if length > rest.len() => break,
                Length::Missing => break,
                Length::Known(length) if is_sound(&rest[..length]) => return Some(self.cut(self.start, length)),
                _ => self.start += 1,
            }
        }
        // Older bytes than a frame has belong to none any more.
        let old = self.input.len().saturating_sub(MAX_FRAME);
        self.input.drain(..old);
        self.start = self.start.saturating_sub(old);
        None
    }

    /// The line has been silent for longer than within a frame: what is here is a frame, ends with one, or is noise.
    pub(super) fn take_at_silence(&mut self) -> Option<Adu> {
        let length = self.input.len();
        let taken = if is_sound(&self.input) {
            Some(self.cut(0, length))
        } else {
            (self.start..length).find_map(|at| match request_length(&self.input[at..]) {
                Length::Known(length) if is_sound(self.input.get(at..at + length)?) => Some(self.cut(at, length)),
                _ => None,
            })
        };
        if taken.is_none() {
            self.input.clear();
            self.start = 0;
        }
        taken
    }

    fn cut(&mut self, at: usize, length: usize) -> Adu {
        let frame = &self.input[at..at + length];
        let adu = Adu { transaction: 0, unit: frame[0], pdu: frame[1..length - 2].to_vec() };
        self.input.drain(..at + length);
        self.start = 0;
        adu
    }
}

/// Appends a response, which `emit` writes.
pub(super) fn wrap(unit: u8, out: &mut Vec<u8>, emit: impl FnOnce(&mut Vec<u8>)) {
    let from = out.len();
    out.push(unit);
    emit(out);
    let check = crc(&out[from..]);
    out.extend(check.to_le_bytes());
}

/// How long a frame is by its own account.
enum Length {
    Known(usize),
    /// The byte that decides has not come.
    Missing,
    /// It says none, or one that no frame has.
    Unknown,
}

/// Length of the request that `frame` begins, address and check included (application protocol, chapter 6).
fn request_length(frame: &[u8]) -> Length {
    let Some(function) = frame.get(1) else { return Length::Missing };
    let counted = |at: usize| match frame.get(1 + at) {
        // A longer one would be awaited beyond the bytes that are kept.
        Some(bytes) => match AROUND + at + 1 + usize::from(*bytes) {
            length @ ..=MAX_FRAME => Length::Known(length),
            _ => Length::Unknown,
        },
        None => Length::Missing,
    };
    match function {
        0x01..=0x06 => Length::Known(AROUND + 5),
        0x0F | 0x10 => counted(5),
        0x17 => counted(9),
        _ => Length::Unknown,
    }
}

/// A frame with the right check.
fn is_sound(frame: &[u8]) -> bool {
    let Some((content, check)) = frame.split_last_chunk::<2>() else { return false };
    (AROUND + 1..=MAX_FRAME).contains(&frame.len()) && crc(content) == u16::from_le_bytes(*check)
}

/// The check of 6.2.2: x^16 + x^15 + x^2 + 1, low bit first.
fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte), |crc, _| if crc & 1 != 0 { crc >> 1 ^ 0xA001 } else { crc >> 1 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn framed(content: &[u8]) -> Vec<u8> {
        [content, &crc(content).to_le_bytes()].concat()
    }

    #[test]
    fn the_check_is_the_one_of_the_standard() {
        // 6.2.2, the example: address 02h, function 07h has the check 1241h, sent low byte first.
        assert_eq!(framed(&[0x02, 0x07]), [0x02, 0x07, 0x41, 0x12]);
    }

    #[test]
    fn frames_without_a_silence_between_them_are_taken_one_by_one() {
        let mut line = SerialLine::default();
        let read = framed(&[7, 3, 0, 0, 0, 1]);
        let write = framed(&[7, 0x10, 0, 0, 0, 1, 2, 0xBE, 0xEF]);
        // The answer of another unit, as long as it likes, then two requests.
        let all = [&framed(&[9, 3, 4, 0, 0, 0, 0])[..], &read, &write].concat();
        for byte in all {
            line.receive(&[byte]);
        }
        let taken: Vec<Adu> = std::iter::from_fn(|| line.take()).collect();
        assert_eq!(taken.iter().map(|adu| &adu.pdu[..]).collect::<Vec<_>>(), [&read[1..6], &write[1..9]]);
        assert!(!line.is_waiting());
    }

    #[test]
    fn what_has_no_length_of_its_own_or_a_wrong_one_is_whole_at_the_silence() {
        let mut line = SerialLine::default();
        for content in
            [&[7, 0x41, 1, 2, 3][..], &[7, 0x10, 0, 0, 0, 2, 2, 0, 1, 0, 2], &[7, 3, 0, 0, 0, 1, 0], &[7, 0x2B]]
        {
            line.receive(&framed(content));
            assert_eq!(line.take(), None, "{content:02X?}");
            let adu = line.take_at_silence().unwrap();
            assert_eq!(adu, Adu { transaction: 0, unit: 7, pdu: content[1..].to_vec() });
            assert!(!line.is_waiting());
        }
    }

    #[test]
    fn a_request_behind_noise_is_found_at_the_latest_at_the_silence() {
        let read = framed(&[7, 3, 0, 0, 0, 1]);
        // A write of F7h bytes is awaited for as long as the line is not silent.
        for noise in [&[0][..], &[0xFF; 40], &[9, 0x10, 0, 0, 0, 1, 0xF7], &read[..5], &[7, 3]] {
            let mut line = SerialLine::default();
            line.receive(&[noise, &read].concat());
            let adu = line.take().or_else(|| line.take_at_silence());
            assert_eq!(adu.map(|adu| adu.pdu), Some(read[1..6].to_vec()), "{noise:02X?}");
        }
    }

    #[test]
    fn what_is_longer_than_a_frame_by_its_own_account_hides_no_request_however_it_arrives() {
        let read = framed(&[7, 3, 0, 0, 0, 1]);
        // A write of FFh bytes and a read and write of FFh would be 264 and 268 bytes long.
        for head in [&[9, 0x10, 0, 0, 0, 1, 0xFF][..], &[9, 0x17, 0, 0, 0, 1, 0, 0, 0, 1, 0xFF]] {
            let all = [head, &read.repeat(32)].concat();
            for piece in [1, 7, 256, all.len()] {
                let mut line = SerialLine::default();
                let taken = all.chunks(piece).map(|bytes| {
                    line.receive(bytes);
                    std::iter::from_fn(|| line.take()).count()
                });
                assert_eq!(taken.sum::<usize>(), 32, "{head:02X?} in pieces of {piece}");
            }
        }
    }

    #[test]
    fn noise_is_forgotten_and_never_kept_beyond_a_frame() {
        let mut line = SerialLine::default();
        for byte in 0..10_000_u32 {
            line.receive(&[(byte % 251) as u8]);
            assert_eq!(line.take(), None);
            assert!(line.input.len() <= MAX_FRAME);
        }
        assert_eq!(line.take_at_silence(), None);
        assert!(!line.is_waiting());
    }
}
