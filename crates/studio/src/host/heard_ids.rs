//! Which identifiers were heard lately: whether SYNC comes, and whether a PDO does.

use std::time::Duration;

use can::{CanId, Frame, Instant};

/// Slower cycles than this are no cycles of a machine.
const LATELY: Duration = Duration::from_secs(1);

/// Identifiers of 11 bits.
const IDENTIFIERS: usize = 0x800;

/// See the [module](self).
#[derive(Debug)]
pub(super) struct HeardIds {
    since: Instant,
    last: Box<[Option<Instant>]>,
}

impl HeardIds {
    /// Listens from now on.
    pub(super) fn from(now: Instant) -> Self {
        Self { since: now, last: vec![None; IDENTIFIERS].into() }
    }

    /// A frame has passed. One that asks for a PDO is none.
    pub(super) fn note(&mut self, frame: &Frame, at: Instant) {
        let id = frame.standard_data_id();
        if let Some(last) = id.and_then(|id| self.last.get_mut(usize::from(id))) {
            *last = Some(at);
        }
    }

    /// Whether frames with this identifier come; `None` where that cannot be told, or not yet.
    pub(super) fn comes(&self, id: CanId, now: Instant) -> Option<bool> {
        let last = self.last.get(usize::from(id.as_standard()?))?;
        let comes = last.is_some_and(|last| now - last <= LATELY);
        (comes || now - self.since > LATELY).then_some(comes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_a_second_ago_comes_and_before_that_second_nobody_can_tell() {
        let mut heard = HeardIds::from(Instant::ZERO);
        let (sync, other) = (CanId::standard(0x80), CanId::standard(0x181));
        let at = Instant::from_millis;
        assert_eq!(heard.comes(sync, at(1000)), None);
        heard.note(&"080#".parse().expect("a frame"), at(900));
        heard.note(&"181#R".parse().expect("a frame"), at(1000));
        heard.note(&"00000181#01".parse().expect("a frame"), at(1000));
        assert_eq!((heard.comes(sync, at(1000)), heard.comes(sync, at(1900))), (Some(true), Some(true)));
        assert_eq!((heard.comes(sync, at(1901)), heard.comes(other, at(1001))), (Some(false), Some(false)));
        assert_eq!(heard.comes(CanId::extended(0x181), at(5000)), None);
    }
}
