//! Watch over the host: fires once when no frame for this node has come for a time.

use can::Instant;

/// Whether the present silence has been reported.
#[derive(Clone, Copy, Debug, Default)]
pub struct HostWatchdog {
    fired_at_frame: Option<Instant>,
}

impl HostWatchdog {
    /// True once for each silence longer than `timeout_ns` while `armed`; a timeout of 0 is off.
    ///
    /// `last_frame` is when the last frame for this node came. Nothing fires before the first one.
    pub fn poll(&mut self, armed: bool, last_frame: Option<Instant>, timeout_ns: u64, now: Instant) -> bool {
        let Some(last) = last_frame else { return false };
        let silent = timeout_ns != 0 && now.nanos_since(last) >= timeout_ns;
        if !armed || !silent || self.fired_at_frame == Some(last) {
            return false;
        }
        self.fired_at_frame = Some(last);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;

    #[test]
    fn fires_once_a_silence_and_again_after_the_next_frame() {
        let mut watchdog = HostWatchdog::default();
        let frame = Some(Instant::from_secs(1));
        assert!(!watchdog.poll(true, frame, SECOND, Instant::from_millis(1999)));
        assert!(watchdog.poll(true, frame, SECOND, Instant::from_secs(2)));
        assert!(!watchdog.poll(true, frame, SECOND, Instant::from_secs(3)));
        let frame = Some(Instant::from_secs(4));
        assert!(!watchdog.poll(true, frame, SECOND, Instant::from_secs(4)));
        assert!(watchdog.poll(true, frame, SECOND, Instant::from_secs(5)));
    }

    #[test]
    fn zero_is_off_and_nothing_fires_unarmed_or_before_the_first_frame() {
        let mut watchdog = HostWatchdog::default();
        assert!(!watchdog.poll(true, Some(Instant::ZERO), 0, Instant::from_secs(9)));
        assert!(!watchdog.poll(false, Some(Instant::ZERO), SECOND, Instant::from_secs(9)));
        assert!(!watchdog.poll(true, None, SECOND, Instant::from_secs(9)));
    }
}
