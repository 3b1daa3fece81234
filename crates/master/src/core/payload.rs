use core::fmt;

/// Largest value kept without an allocation: what an expedited transfer carries.
const SHORT: usize = 4;

/// The bytes of an object, little endian as on the wire. Values of up to four bytes are held in place.
#[derive(Clone)]
pub struct Payload(PayloadForm);

#[derive(Clone)]
enum PayloadForm {
    Short([u8; SHORT], u8),
    Long(Vec<u8>),
}

impl Payload {
    /// No bytes.
    pub const EMPTY: Self = Self(PayloadForm::Short([0; SHORT], 0));

    /// A copy of `bytes`.
    pub fn new(bytes: &[u8]) -> Self {
        if bytes.len() > SHORT {
            return Self(PayloadForm::Long(bytes.to_vec()));
        }
        let mut short = [0; SHORT];
        short[..bytes.len()].copy_from_slice(bytes);
        Self(PayloadForm::Short(short, bytes.len() as u8))
    }

    /// The bytes as an SDO carries them: little endian, without padding.
    pub fn as_bytes(&self) -> &[u8] {
        match &self.0 {
            PayloadForm::Short(bytes, length) => &bytes[..usize::from(*length)],
            PayloadForm::Long(bytes) => bytes,
        }
    }

    /// The low four bytes as a little-endian cell, missing ones zero.
    pub fn raw(&self) -> u32 {
        let mut cell = [0; 4];
        let bytes = self.as_bytes();
        let length = bytes.len().min(4);
        cell[..length].copy_from_slice(&bytes[..length]);
        u32::from_le_bytes(cell)
    }
}

impl From<Vec<u8>> for Payload {
    fn from(bytes: Vec<u8>) -> Self {
        if bytes.len() > SHORT { Self(PayloadForm::Long(bytes)) } else { Self::new(&bytes) }
    }
}

impl From<Payload> for Vec<u8> {
    fn from(payload: Payload) -> Self {
        match payload.0 {
            PayloadForm::Short(bytes, length) => bytes[..usize::from(length)].to_vec(),
            PayloadForm::Long(bytes) => bytes,
        }
    }
}

impl PartialEq for Payload {
    fn eq(&self, other: &Self) -> bool {
        self.as_bytes() == other.as_bytes()
    }
}

impl Eq for Payload {}

/// Bytes in wire order: `40 60 00 00`.
impl fmt::Debug for Payload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        self.as_bytes().iter().try_for_each(|byte| {
            write!(f, "{separator}{byte:02X}")?;
            separator = " ";
            Ok(())
        })
    }
}
