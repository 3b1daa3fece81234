use crate::pdo::PdoNumber;

/// A service that may have a frame to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Emcy,
    Tpdo(usize),
    SdoReply,
    Heartbeat,
    BootUp,
}

const FIRST_TPDO: u8 = 3;
const BOOT_UP: u8 = 1 << 7;

impl Source {
    const fn bit(self) -> u8 {
        match self {
            Self::Emcy => 1 << 0,
            Self::SdoReply => 1 << 1,
            Self::Heartbeat => 1 << 2,
            Self::Tpdo(position) => 1 << (FIRST_TPDO + position as u8),
            Self::BootUp => BOOT_UP,
        }
    }

    const fn of_bit(number: u32) -> Self {
        match number {
            0 => Self::Emcy,
            1 => Self::SdoReply,
            2 => Self::Heartbeat,
            7 => Self::BootUp,
            number => Self::Tpdo(number as usize - FIRST_TPDO as usize),
        }
    }
}

const _: () = assert!(FIRST_TPDO as usize + PdoNumber::PREDEFINED == 7, "a bit for every source");

/// Which services have a frame that may be sent now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pending(u8);

impl Pending {
    pub(super) const NONE: Self = Self(0);

    pub(super) const fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) const fn insert(&mut self, source: Source) {
        self.0 |= source.bit();
    }

    pub(super) const fn set(&mut self, source: Source, ready: bool) {
        if ready { self.insert(source) } else { self.remove(source) }
    }

    pub(super) const fn remove(&mut self, source: Source) {
        self.0 &= !source.bit();
    }

    /// The one source that has a frame, if no other has.
    pub(super) const fn only(self) -> Option<Source> {
        if self.0.is_power_of_two() { Some(Source::of_bit(self.0.trailing_zeros())) } else { None }
    }

    pub(super) fn iter(self) -> impl Iterator<Item = Source> {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let number = rest.trailing_zeros();
            rest &= rest.wrapping_sub(1);
            (number < u8::BITS).then(|| Source::of_bit(number))
        })
    }
}
