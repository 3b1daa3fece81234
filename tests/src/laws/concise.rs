//! Concise DCFs: what is read is written again byte for byte, and what is refused is refused at a place that it has.

use canopen::concise::{Concise, ConciseError, emit};

pub(super) const SAMPLES: &[&[u8]] = &[
    b"\x00\x00\x00\x00",
    b"\x02\x00\x00\x00\x17\x10\x00\x02\x00\x00\x00\xC8\x00\x00\x18\x02\x01\x00\x00\x00\x01",
    b"\x03\x00\x00\x00\x00\x1A\x00\x01\x00\x00\x00\x00\x00\x1A\x01\x04\x00\x00\x00\x10\x00\x41\x60\x00\x1A\x00\x01\x00\x00\x00\x01",
];

pub(super) fn concise_dcf(data: &[u8]) {
    match Concise::parse(data) {
        Ok(concise) => {
            assert_eq!(concise.entries().count() as u64, u64::from(concise.len()));
            let mut written = Vec::new();
            emit(concise.entries(), |bytes| written.extend_from_slice(bytes));
            assert_eq!(written, data, "what is read is written again");
        }
        Err(ConciseError::NoCount { length }) => assert!(length == data.len() && length < 4),
        Err(ConciseError::Ends { entry, of, at, needed, left, .. }) => {
            assert!((1..=of).contains(&entry) && at + left == data.len() && needed > left as u64);
        }
        Err(ConciseError::Goes { at, left, .. }) => assert!(left > 0 && at + left == data.len()),
    }
}
