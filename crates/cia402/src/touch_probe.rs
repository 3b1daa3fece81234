//! Touch probe: two channels that latch the position at edges. Source: CiA 402-2, touch probe functionality, objects 60B8h
//! to 60BDh, 60D0h (source) and 60D5h to 60D8h (counters).
//!
//! One channel is one byte of 60B8h and of 60B9h. It is a pure state machine: function, level and index pulse in, what is
//! latched out. The position itself is the caller's.

/// Which signal a channel looks at: bits 2 and 3 of its byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TouchProbeSource {
    /// 0: the probe's input.
    Input,
    /// 1: the encoder's index pulse; it has a positive edge only.
    IndexPulse,
    /// 2: what 60D0h names.
    Configured,
    /// 3: reserved.
    Reserved,
}

/// The function of one channel: the low byte of 60B8h for probe 1, the high byte for probe 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TouchProbeFunction(pub u8);

impl TouchProbeFunction {
    /// Bit 0: the channel is on.
    pub const ENABLE: u8 = 1 << 0;
    /// Bit 1: every edge is latched, not only the first.
    pub const CONTINUOUS: u8 = 1 << 1;
    /// Bit 4: positive edges are latched.
    pub const POSITIVE_EDGE: u8 = 1 << 4;
    /// Bit 5: negative edges are latched.
    pub const NEGATIVE_EDGE: u8 = 1 << 5;

    /// Of both channels, from the value of 60B8h.
    pub const fn of(object: u16) -> [Self; 2] {
        let [first, second] = object.to_le_bytes();
        [Self(first), Self(second)]
    }

    /// True if all bits of `mask` are set.
    pub const fn has(self, mask: u8) -> bool {
        self.0 & mask == mask
    }

    /// The signal that is looked at.
    pub const fn source(self) -> TouchProbeSource {
        match self.0 >> 2 & 3 {
            0 => TouchProbeSource::Input,
            1 => TouchProbeSource::IndexPulse,
            2 => TouchProbeSource::Configured,
            _ => TouchProbeSource::Reserved,
        }
    }
}

/// The state of one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TouchProbe {
    function: TouchProbeFunction,
    level: bool,
    status: u8,
}

/// What one look at the signal latched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latched {
    /// The position now is the value at the positive edge (60BAh, 60BCh).
    pub positive: bool,
    /// The position now is the value at the negative edge (60BBh, 60BDh).
    pub negative: bool,
}

impl TouchProbe {
    /// Status bit 0: the channel is on.
    pub const ENABLED: u8 = 1 << 0;
    /// Status bit 1: a value at a positive edge is stored.
    pub const POSITIVE_STORED: u8 = 1 << 1;
    /// Status bit 2: a value at a negative edge is stored.
    pub const NEGATIVE_STORED: u8 = 1 << 2;

    /// The channel's byte of 60B9h.
    pub const fn status(self) -> u8 {
        self.status
    }

    /// The signal that is looked at.
    pub const fn source(self) -> TouchProbeSource {
        self.function.source()
    }

    /// The value of 60B9h.
    pub const fn object(channels: [Self; 2]) -> u16 {
        u16::from_le_bytes([channels[0].status, channels[1].status])
    }

    /// Takes a new function. Switching the channel off clears what is stored; so does switching an edge off for that edge.
    /// `level` is the signal now: that is not an edge.
    pub fn set_function(&mut self, function: TouchProbeFunction, level: bool) {
        if function.source() != self.function.source() {
            self.status = 0;
        }
        self.function = function;
        self.level = level;
        if !function.has(TouchProbeFunction::ENABLE) {
            self.status = 0;
            return;
        }
        self.status |= Self::ENABLED;
        if !function.has(TouchProbeFunction::POSITIVE_EDGE) {
            self.status &= !Self::POSITIVE_STORED;
        }
        if !function.has(TouchProbeFunction::NEGATIVE_EDGE) {
            self.status &= !Self::NEGATIVE_STORED;
        }
    }

    /// One look at the signal: its level, or for an index pulse whether it came since the last look.
    #[must_use]
    pub fn update(&mut self, level: bool) -> Latched {
        let pulse = self.function.source() == TouchProbeSource::IndexPulse;
        let rises = level && (pulse || !self.level);
        let falls = !level && self.level && !pulse;
        self.level = level;
        let positive = rises && self.takes(TouchProbeFunction::POSITIVE_EDGE, Self::POSITIVE_STORED);
        let negative = falls && self.takes(TouchProbeFunction::NEGATIVE_EDGE, Self::NEGATIVE_STORED);
        if positive {
            self.status |= Self::POSITIVE_STORED;
        }
        if negative {
            self.status |= Self::NEGATIVE_STORED;
        }
        Latched { positive, negative }
    }

    const fn takes(self, edge: u8, stored: u8) -> bool {
        let first = self.status & stored == 0;
        self.function.has(TouchProbeFunction::ENABLE | edge)
            && (first || self.function.has(TouchProbeFunction::CONTINUOUS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(function: u8) -> TouchProbe {
        let mut probe = TouchProbe::default();
        probe.set_function(TouchProbeFunction(function), false);
        probe
    }

    fn latched<const N: usize>(probe: &mut TouchProbe, levels: [bool; N]) -> [(bool, bool); N] {
        levels.map(|level| {
            let Latched { positive, negative } = probe.update(level);
            (positive, negative)
        })
    }

    const SQUARE: [bool; 4] = [true, false, true, false];

    #[test]
    fn the_first_event_is_latched_once_at_each_edge_asked_for() {
        let mut probe = with(0x31);
        assert_eq!(probe.status(), 0x01);
        assert_eq!(latched(&mut probe, SQUARE), [(true, false), (false, true), (false, false), (false, false)]);
        assert_eq!(probe.status(), 0x07);
        let mut probe = with(0x11);
        assert_eq!(latched(&mut probe, SQUARE), [(true, false), (false, false), (false, false), (false, false)]);
        assert_eq!(probe.status(), 0x03);
        let mut probe = with(0x21);
        assert_eq!(latched(&mut probe, SQUARE), [(false, false), (false, true), (false, false), (false, false)]);
        assert_eq!(probe.status(), 0x05);
    }

    #[test]
    fn continuously_every_edge_is_latched() {
        let mut probe = with(0x33);
        assert_eq!(latched(&mut probe, SQUARE), [(true, false), (false, true), (true, false), (false, true)]);
    }

    #[test]
    fn a_channel_that_is_off_latches_nothing_and_forgets() {
        let mut probe = with(0x30);
        assert_eq!(latched(&mut probe, SQUARE), [(false, false); 4]);
        assert_eq!(probe.status(), 0);
        let mut probe = with(0x31);
        let _ = latched(&mut probe, SQUARE);
        probe.set_function(TouchProbeFunction(0x30), false);
        assert_eq!(probe.status(), 0);
        probe.set_function(TouchProbeFunction(0x31), false);
        assert_eq!(latched(&mut probe, SQUARE)[0], (true, false), "armed again");
    }

    #[test]
    fn an_edge_switched_off_forgets_its_own_value_only() {
        let mut probe = with(0x31);
        let _ = latched(&mut probe, SQUARE);
        probe.set_function(TouchProbeFunction(0x11), false);
        assert_eq!(probe.status(), 0x03);
    }

    #[test]
    fn a_level_that_is_there_when_the_channel_goes_on_is_no_edge() {
        let mut probe = TouchProbe::default();
        probe.set_function(TouchProbeFunction(0x31), true);
        assert_eq!(latched(&mut probe, [true, true, false]), [(false, false), (false, false), (false, true)]);
    }

    #[test]
    fn index_pulses_that_follow_each_other_are_edges_of_their_own() {
        let mut probe = with(0x17);
        assert_eq!(latched(&mut probe, [true, true, false]), [(true, false), (true, false), (false, false)]);
        let mut once = with(0x15);
        assert_eq!(latched(&mut once, [true, true, false]), [(true, false), (false, false), (false, false)]);
    }

    #[test]
    fn the_two_channels_are_the_two_bytes() {
        assert_eq!(TouchProbeFunction::of(0x1437), [TouchProbeFunction(0x37), TouchProbeFunction(0x14)]);
        assert_eq!(TouchProbeFunction(0x14).source(), TouchProbeSource::IndexPulse);
        assert_eq!(TouchProbe::object([with(0x01), with(0x00)]), 0x0001);
        assert_eq!(TouchProbe::object([with(0x00), with(0x01)]), 0x0100);
    }
}
