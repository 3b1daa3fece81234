//! Fault confinement (ISO 11898-1, clause 12): error counters and what follows from them.
//!
//! The rules are numbered as in the Bosch CAN Specification 2.0, part A, chapter 7, which is free to read; the
//! standard has the same. Counted at the grain of a frame: rules 4 to 6 (dominant bits
//! during or long after an error flag) need a wire that is stuck, which is not modelled.

/// How far a controller trusts itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorState {
    /// Takes part and sends dominant error flags.
    ErrorActive,
    /// Takes part but sends only recessive error flags.
    ErrorPassive,
    /// Takes no part.
    BusOff,
}

/// Transmit and receive error counters with their rules.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorCounters {
    tec: u16,
    rec: u16,
}

/// A counter above this makes a node error-passive (rule 9).
const PASSIVE_ABOVE: u16 = 127;
/// A transmit counter above this makes a node bus-off (rule 11).
const BUS_OFF_ABOVE: u16 = 255;
/// Where a passive receiver's counter lands after a good frame: the standard allows 119 to 127 (rule 8).
const RECEIVER_RETURN: u16 = 127;
/// Controllers hold the receive counter in eight bits.
const REC_MAX: u16 = 255;

impl ErrorCounters {
    /// Transmit error counter.
    pub fn tec(&self) -> u16 {
        self.tec
    }

    /// Receive error counter.
    pub fn rec(&self) -> u16 {
        self.rec
    }

    /// The state that belongs to the counters.
    pub fn state(&self) -> ErrorState {
        if self.tec > BUS_OFF_ABOVE {
            ErrorState::BusOff
        } else if self.tec > PASSIVE_ABOVE || self.rec > PASSIVE_ABOVE {
            ErrorState::ErrorPassive
        } else {
            ErrorState::ErrorActive
        }
    }

    /// A transmitter sent an error flag: TEC + 8 (rule 3).
    pub fn transmit_error(&mut self) {
        self.tec = (self.tec + 8).min(BUS_OFF_ABOVE + 1);
    }

    /// Not acknowledged. An error-passive transmitter that reads no dominant bit during its passive
    /// error flag keeps its counter: alone, a node never goes bus-off (rule 3, exception 1).
    pub fn acknowledge_error(&mut self) {
        if self.state() == ErrorState::ErrorActive {
            self.transmit_error();
        }
    }

    /// A frame was sent: TEC - 1 (rule 7).
    pub fn transmit_success(&mut self) {
        self.tec = self.tec.saturating_sub(1);
    }

    /// A receiver saw an error: REC + 1 (rule 1).
    pub fn receive_error(&mut self) {
        self.rec = (self.rec + 1).min(REC_MAX);
    }

    /// A receiver was the first to see an error, and the others' flags answered its own: REC + 1, and
    /// + 8 for the dominant bit after its flag (rules 1 and 2).
    pub fn first_receive_error(&mut self) {
        self.rec = (self.rec + 9).min(REC_MAX);
    }

    /// A frame was received: REC - 1, or back into 119..=127 (rule 8).
    pub fn receive_success(&mut self) {
        self.rec = if self.rec > PASSIVE_ABOVE { RECEIVER_RETURN } else { self.rec.saturating_sub(1) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(steps: usize, step: fn(&mut ErrorCounters)) -> ErrorCounters {
        let mut counters = ErrorCounters::default();
        (0..steps).for_each(|_| step(&mut counters));
        counters
    }

    #[test]
    fn sixteen_transmit_errors_make_passive_and_thirty_two_bus_off() {
        let state_after = |n| after(n, ErrorCounters::transmit_error).state();
        assert_eq!(state_after(15), ErrorState::ErrorActive);
        assert_eq!(state_after(16), ErrorState::ErrorPassive);
        assert_eq!(state_after(31), ErrorState::ErrorPassive);
        assert_eq!(state_after(32), ErrorState::BusOff);
    }

    #[test]
    fn missing_acknowledges_stop_counting_at_128() {
        assert_eq!(after(16, ErrorCounters::acknowledge_error).tec(), 128);
        assert_eq!(after(10_000, ErrorCounters::acknowledge_error).tec(), 128);
    }

    /// Rules 1 and 2: 1 for the error, and 8 for the dominant bit behind the receiver's own flag; 15 of them are 135.
    #[test]
    fn who_sees_an_error_first_counts_nine() {
        assert_eq!(after(1, ErrorCounters::first_receive_error).rec(), 9);
        assert_eq!(after(14, ErrorCounters::first_receive_error).state(), ErrorState::ErrorActive);
        assert_eq!(after(15, ErrorCounters::first_receive_error).state(), ErrorState::ErrorPassive);
    }

    #[test]
    fn receive_errors_alone_never_make_bus_off() {
        assert_eq!(after(127, ErrorCounters::receive_error).state(), ErrorState::ErrorActive);
        assert_eq!(after(128, ErrorCounters::receive_error).state(), ErrorState::ErrorPassive);
        assert_eq!(after(10_000, ErrorCounters::first_receive_error).state(), ErrorState::ErrorPassive);
    }

    #[test]
    fn one_good_frame_brings_a_passive_receiver_back() {
        let mut counters = after(200, ErrorCounters::receive_error);
        counters.receive_success();
        assert!((119..=127).contains(&counters.rec()));
        assert_eq!(counters.state(), ErrorState::ErrorActive);
        let rec = counters.rec();
        counters.receive_success();
        assert_eq!(counters.rec(), rec - 1);
    }
}
