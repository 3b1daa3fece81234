use super::pdo_set::PdoSet;
use crate::od::Storage;

/// A service that may have a frame to send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    Emcy,
    Tpdo(usize),
    SdoReply,
    Heartbeat,
    BootUp,
    Sync,
    /// SDO servers beside the default one.
    Channel,
}

const EMCY: u8 = 1 << 0;
const SDO_REPLY: u8 = 1 << 1;
const HEARTBEAT: u8 = 1 << 2;
/// One or more of them.
const TPDOS: u8 = 1 << 3;
const BOOT_UP: u8 = 1 << 4;
const SYNC: u8 = 1 << 5;
const CHANNEL: u8 = 1 << 6;

impl Source {
    const fn bit(self) -> u8 {
        match self {
            Self::Emcy => EMCY,
            Self::SdoReply => SDO_REPLY,
            Self::Heartbeat => HEARTBEAT,
            Self::Tpdo(_) => TPDOS,
            Self::BootUp => BOOT_UP,
            Self::Sync => SYNC,
            Self::Channel => CHANNEL,
        }
    }
}

const SINGLE: [Source; 6] =
    [Source::Emcy, Source::SdoReply, Source::Heartbeat, Source::BootUp, Source::Sync, Source::Channel];

/// Which services have a frame that may be sent now.
#[derive(Clone)]
pub(super) struct Pending<S: Storage> {
    /// A bit for each service.
    services: u8,
    tpdos: PdoSet<S>,
}

impl<S: Storage> Pending<S> {
    /// None, of a node with this many TPDOs.
    pub(super) fn none(tpdos: usize) -> Self {
        Self { services: 0, tpdos: PdoSet::none(tpdos) }
    }

    pub(super) fn clear(&mut self) {
        self.services = 0;
        self.tpdos.clear();
    }

    #[inline]
    pub(super) const fn is_empty(&self) -> bool {
        self.services == 0
    }

    #[inline]
    pub(super) fn insert(&mut self, source: Source) {
        self.services |= source.bit();
        if let Source::Tpdo(position) = source {
            self.tpdos.set(position, true);
        }
    }

    #[inline]
    pub(super) fn set(&mut self, source: Source, ready: bool) {
        if ready { self.insert(source) } else { self.remove(source) }
    }

    #[inline]
    pub(super) fn remove(&mut self, source: Source) {
        if let Source::Tpdo(position) = source {
            self.tpdos.set(position, false);
            if !self.tpdos.is_empty() {
                return;
            }
        }
        self.services &= !source.bit();
    }

    /// Takes the one source that has a frame, if no other has and it is one of those with many frames.
    #[inline(always)]
    pub(super) fn take_only(&mut self) -> Option<Source> {
        let source = if self.services == SDO_REPLY {
            Source::SdoReply
        } else if self.services == TPDOS {
            Source::Tpdo(self.tpdos.take_only()?)
        } else {
            return None;
        };
        self.services = 0;
        Some(source)
    }

    /// All of them.
    pub(super) fn iter(&self) -> impl Iterator<Item = Source> {
        let mut from = 0;
        let tpdos = core::iter::from_fn(move || {
            let position = self.tpdos.next(from)?;
            from = position + 1;
            Some(Source::Tpdo(position))
        });
        SINGLE.into_iter().filter(|source| self.services & source.bit() != 0).chain(tpdos)
    }
}
