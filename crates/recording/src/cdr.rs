//! Common Data Representation (OMG DDS-XTypes 1.3, clause 7.4.1), plain and little-endian, as messages of ROS 2 are written.
//!
//! Each value stands at a multiple of its size, counted from the end of the four bytes that name the representation.

/// The representation: plain CDR, little-endian, no options.
const REPRESENTATION: [u8; 4] = [0, 1, 0, 0];

/// A message that is put together.
#[derive(Default)]
pub(super) struct Encoder(Vec<u8>);

impl Encoder {
    /// Begins the next message in the same memory.
    pub(super) fn begin(&mut self) -> &mut Self {
        self.0.clear();
        self.0.extend(REPRESENTATION);
        self
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.0
    }

    pub(super) fn f64(&mut self, value: f64) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(super) fn u32(&mut self, value: u32) -> &mut Self {
        self.aligned(value.to_le_bytes())
    }

    pub(super) fn u8(&mut self, value: u8) -> &mut Self {
        self.aligned([value])
    }

    /// Its length with the zero at its end, then both.
    pub(super) fn text(&mut self, text: &str) -> &mut Self {
        // A text that could be taken for two is cut where the first ends.
        let text = text.split('\0').next().unwrap_or_default();
        self.u32(text.len() as u32 + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.u8(0)
    }

    fn aligned<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Self {
        let place = (self.0.len() - REPRESENTATION.len()).next_multiple_of(N);
        self.0.resize(REPRESENTATION.len() + place, 0);
        self.0.extend(bytes);
        self
    }
}

/// A message that is read; `None` where it ends too early, or is of another representation.
pub(super) struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    pub(super) fn new(message: &'a [u8]) -> Option<Self> {
        message.strip_prefix(&REPRESENTATION).map(|body| Self { body, at: 0 })
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.aligned().map(f64::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.aligned().map(u32::from_le_bytes)
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.aligned().map(|[byte]| byte)
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let text = self.body.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        std::str::from_utf8(text.strip_suffix(&[0])?).ok()
    }

    fn aligned<const N: usize>(&mut self) -> Option<[u8; N]> {
        let from = self.at.next_multiple_of(N);
        let bytes = self.body.get(from..from + N)?;
        self.at = from + N;
        bytes.try_into().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The bytes are those of the specification's rules, counted by hand.
    #[test]
    fn each_value_stands_at_a_multiple_of_its_size() {
        let mut message = Encoder::default();
        message.begin().u8(7).u32(1).text("ab").f64(1.0);
        let expected = [
            &[0, 1, 0, 0][..],
            &[7, 0, 0, 0, 1, 0, 0, 0],
            &[3, 0, 0, 0, b'a', b'b', 0, 0],
            &[0, 0, 0, 0, 0, 0, 0xF0, 0x3F],
        ];
        assert_eq!(message.bytes(), expected.concat());
        let mut read = CdrReader::new(message.bytes()).expect("the representation");
        assert_eq!((read.u8(), read.u32(), read.text(), read.f64()), (Some(7), Some(1), Some("ab"), Some(1.0)));
        assert_eq!((read.u8(), read.f64()), (None, None));
    }

    #[test]
    fn what_is_torn_or_of_another_representation_is_nothing() {
        assert!(CdrReader::new(&[0, 0, 0, 0, 1]).is_none() && CdrReader::new(&[]).is_none());
        for body in [&[0xFF, 0xFF, 0xFF, 0xFF, 0][..], &[0, 0, 0, 0], &[2, 0, 0, 0, b'a', b'b'], &[2, 0, 0, 0, 0xFF, 0]]
        {
            let message = [&REPRESENTATION[..], body].concat();
            assert_eq!(CdrReader::new(&message).expect("the representation").text(), None, "{body:?}");
        }
    }
}
