//! Identifiers seen recently: whether SYNC is on the bus, and whether a PDO is.

use std::time::Duration;

use can::{CanId, Frame, Instant};

/// Longest cycle that is expected of a machine.
const LATELY: Duration = Duration::from_secs(1);

/// Identifiers of 11 bits.
const IDENTIFIERS: usize = 0x800;

/// See the [module](self).
#[derive(Debug)]
pub(crate) struct HeardIds {
    since: Instant,
    last: Box<[Option<Instant>]>,
}

impl HeardIds {
    /// Starts to listen now.
    pub(crate) fn from(now: Instant) -> Self {
        Self { since: now, last: vec![None; IDENTIFIERS].into() }
    }

    /// Records a frame. A remote frame requests a PDO and does not count.
    pub(crate) fn note(&mut self, frame: &Frame, at: Instant) {
        let id = frame.standard_data_id();
        if let Some(last) = id.and_then(|id| self.last.get_mut(usize::from(id))) {
            *last = Some(at);
        }
    }

    /// Whether frames with this identifier are sent; `None` if that is not known, or not yet.
    pub(crate) fn comes(&self, id: CanId, now: Instant) -> Option<bool> {
        let last = self.last.get(usize::from(id.as_standard()?))?;
        let comes = last.is_some_and(|last| now - last <= LATELY);
        (comes || now - self.since > LATELY).then_some(comes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_counts_for_one_second_and_before_the_first_second_nothing_is_known() {
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
