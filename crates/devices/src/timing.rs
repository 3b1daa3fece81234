//! How long a device takes for what a bus does not show: to start, to answer, to store.
//!
//! The manuals that are here give none of these times, so that each is a guess with a reason, until a measurement of a real
//! device. A firmware has the rhythm of its own tasks besides; these are the times around it. A simulator of a device
//! draws a time from each [`Span`] as often as the thing happens.

/// The times of one model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// From enough supply voltage to the boot-up message. The device is silent and deaf, its state is NOT READY TO SWITCH ON.
    pub boot: Span,
    /// From NMT reset node to the boot-up message: likewise.
    pub reset_node: Span,
    /// From NMT reset communication to the boot-up message: silent and deaf, the motor goes on.
    pub reset_communication: Span,
    /// From an SDO request to when the firmware acts on it; its answer goes out then.
    pub sdo_answer: Span,
    /// From an RPDO or SYNC to when the firmware takes it; a TPDO that answers goes out then.
    pub pdo_reaction: Span,
    /// For the non-volatile memory to take a store. A supply that fails in it leaves the contents of before.
    pub store: Span,
}

/// A time that is never the same twice: anywhere between two bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The shortest, in microseconds.
    pub least_us: u32,
    /// The longest, in microseconds.
    pub most_us: u32,
    /// Where it is from: a manual's section, or *guess* with a reason.
    pub source: &'static str,
}

impl Span {
    /// From `least_us` to `most_us`.
    pub const fn new(least_us: u32, most_us: u32, source: &'static str) -> Self {
        Self { least_us, most_us, source }
    }
}

impl core::fmt::Display for Span {
    /// `500 to 1500 us`, `800 to 1200 ms`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { least_us, most_us, .. } = self;
        if least_us % 1_000 == 0 && most_us % 1_000 == 0 {
            write!(f, "{} to {} ms", least_us / 1_000, most_us / 1_000)
        } else {
            write!(f, "{least_us} to {most_us} us")
        }
    }
}

impl Timing {
    /// A motor drive of which nothing is known: what a microcontroller of this class takes.
    pub const GUESSED: Self = Self {
        boot: Span::new(800_000, 1_200_000, "guess: one second, mostly self-test"),
        reset_node: Span::new(400_000, 600_000, "guess: half a boot, since supply and oscillator are there"),
        reset_communication: Span::new(10_000, 30_000, "guess: the communication objects are loaded from the EEPROM"),
        sdo_answer: Span::new(
            500,
            1_500,
            "guess: about a millisecond; programs that work with such drives wait 20 ms for an answer",
        ),
        pdo_reaction: Span::new(100, 400, "guess: within the communication task's 0.5 ms"),
        store: Span::new(5_000, 15_000, "guess: one to three pages of a serial EEPROM, each 5 ms by its data sheets"),
    };

    /// Each time with its name.
    pub const fn spans(&self) -> [(&'static str, &Span); 6] {
        [
            ("boot", &self.boot),
            ("NMT reset node", &self.reset_node),
            ("NMT reset communication", &self.reset_communication),
            ("SDO answer", &self.sdo_answer),
            ("PDO reaction", &self.pdo_reaction),
            ("store", &self.store),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn no_model_has_a_time_that_ends_before_it_begins_or_comes_from_nowhere() {
        for model in crate::all().iter() {
            for (what, span) in model.timing.spans() {
                assert!(span.least_us <= span.most_us, "{}: {what} {span}", model.name);
                assert!(!span.source.is_empty(), "{}: {what}", model.name);
            }
        }
    }

    #[test]
    fn a_span_is_written_in_the_unit_that_fits() {
        assert_eq!(Span::new(800_000, 1_200_000, "").to_string(), "800 to 1200 ms");
        assert_eq!(Span::new(500, 1_500, "").to_string(), "500 to 1500 us");
    }
}
