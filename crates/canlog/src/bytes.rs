//! Bytes of binary logs: numbers at their places, and a source that counts what was read.

use std::io::{self, Read};

/// Little-endian; 0 where the bytes end before.
pub(super) fn u16_at(bytes: &[u8], place: usize) -> u16 {
    bytes.get(place..place + 2).map_or(0, |bytes| u16::from_le_bytes([bytes[0], bytes[1]]))
}

/// Little-endian; 0 where the bytes end before.
pub(super) fn u32_at(bytes: &[u8], place: usize) -> u32 {
    u32::from(u16_at(bytes, place)) | u32::from(u16_at(bytes, place + 2)) << 16
}

/// Little-endian; 0 where the bytes end before.
pub(super) fn u64_at(bytes: &[u8], place: usize) -> u64 {
    u64::from(u32_at(bytes, place)) | u64::from(u32_at(bytes, place + 4)) << 32
}

/// Reads, and knows where it is.
#[derive(Debug)]
pub(super) struct ByteSource<R> {
    input: R,
    /// Bytes that were read too far.
    again: Vec<u8>,
    offset: u64,
}

impl<R: Read> ByteSource<R> {
    pub(super) const fn new(input: R) -> Self {
        Self { input, again: Vec::new(), offset: 0 }
    }

    /// Bytes read so far.
    pub(super) const fn offset(&self) -> u64 {
        self.offset
    }

    /// Fills `buffer` as far as there is something, and says how far.
    pub(super) fn read_up_to(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = self.again.len().min(buffer.len());
        buffer[..filled].copy_from_slice(&self.again[..filled]);
        self.again.drain(..filled);
        while filled < buffer.len() {
            match self.input.read(&mut buffer[filled..]) {
                Ok(0) => break,
                Ok(read) => filled += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.offset += filled as u64;
        Ok(filled)
    }

    /// Appends `count` bytes; false if there are fewer. Memory grows with what comes, not with what is asked for.
    pub(super) fn read_exactly(&mut self, count: usize, out: &mut Vec<u8>) -> io::Result<bool> {
        let mut piece = [0; 4096];
        let mut left = count;
        while left > 0 {
            let room = left.min(piece.len());
            let read = self.read_up_to(&mut piece[..room])?;
            out.extend_from_slice(&piece[..read]);
            left -= read;
            if read < room {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Passes over `count` bytes, or all that there are.
    pub(super) fn skip(&mut self, count: u64) -> io::Result<()> {
        let mut piece = [0; 4096];
        let mut left = count;
        while left > 0 {
            let room = left.min(piece.len() as u64) as usize;
            let read = self.read_up_to(&mut piece[..room])?;
            if read < room {
                return Ok(());
            }
            left -= read as u64;
        }
        Ok(())
    }

    /// Goes on to the next `mark`, in `begun` (which was read last) or behind; to the end if there is none.
    pub(super) fn find(&mut self, mark: &[u8; 4], begun: &[u8]) -> io::Result<()> {
        let mut piece = [0; 4096];
        let mut window = begun.to_vec();
        loop {
            if let Some(place) = window.windows(mark.len()).position(|bytes| bytes == mark) {
                let ahead = window.split_off(place);
                self.offset -= ahead.len() as u64;
                self.again.splice(0..0, ahead);
                return Ok(());
            }
            // A mark may lie across two pieces.
            window.drain(..window.len().saturating_sub(mark.len() - 1));
            match self.read_up_to(&mut piece)? {
                0 => return Ok(()),
                read => window.extend_from_slice(&piece[..read]),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_found_wherever_it_lies() {
        for gap in [0, 1, 4090, 4093, 4096, 9000] {
            let mut bytes = vec![b'x'; 8 + gap];
            bytes.extend_from_slice(b"LOBJ and more");
            let mut source = ByteSource::new(&bytes[..]);
            let mut begun = [0; 8];
            source.read_up_to(&mut begun).unwrap();
            source.find(b"LOBJ", &begun).unwrap();
            assert_eq!(source.offset(), 8 + gap as u64);
            let mut mark = [0; 8];
            assert_eq!(source.read_up_to(&mut mark).unwrap(), 8);
            assert_eq!(&mark, b"LOBJ and", "{gap}");
        }
    }

    #[test]
    fn what_is_not_there_is_not_asked_for_memory() {
        let mut out = Vec::new();
        assert!(!ByteSource::new(&b"abc"[..]).read_exactly(1_000_000_000, &mut out).unwrap());
        assert_eq!((out.as_slice(), out.capacity() < 10_000), (&b"abc"[..], true));
    }
}
