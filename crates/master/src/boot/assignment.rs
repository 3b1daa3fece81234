//! The bits that a CANopen manager's objects 1F80h and 1F81h are made of. Source: CiA 302-2.

use std::time::Duration;

/// NMT startup, 1F80h: what the master does on its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Startup(pub u32);

impl Startup {
    /// The device is the NMT master.
    pub const MASTER: u32 = 1;
    /// Nodes are started all together by one command, when the last mandatory one has booted; without it each on its
    /// own.
    pub const START_ALL: u32 = 1 << 1;
    /// The master starts no node; another device or program does.
    pub const STARTS_NONE: u32 = 1 << 3;
    /// When a mandatory node fails, all nodes are reset.
    pub const RESET_ALL: u32 = 1 << 4;
    /// When a mandatory node fails, all nodes are stopped. Counts before [`RESET_ALL`](Self::RESET_ALL).
    pub const STOP_ALL: u32 = 1 << 6;

    /// True if all of these bits are set.
    pub const fn has(self, bits: u32) -> bool {
        self.0 & bits == bits
    }
}

/// NMT slave assignment, one sub-index of 1F81h: what the master does with one node. Bits 8 to 31 are about node guarding.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Assignment(pub u32);

impl Assignment {
    /// It is a slave of this master.
    pub const SLAVE: u32 = 1;
    /// It is booted by the master, also after it was lost and came back.
    pub const BOOT: u32 = 1 << 2;
    /// Without it the network does not start.
    pub const MANDATORY: u32 = 1 << 3;
    /// If it is operational already, it must not be reset.
    pub const KEEP_ALIVE: u32 = 1 << 4;
    /// Its software version is checked (1F55h).
    pub const VERIFY_SOFTWARE: u32 = 1 << 5;
    /// Its software may be replaced.
    pub const UPDATE_SOFTWARE: u32 = 1 << 6;
    /// Its factory settings are restored before it is configured (1F8Ah).
    pub const RESTORE: u32 = 1 << 7;

    /// A mandatory slave that is booted, and never reset while it is operational: a motor may turn.
    pub const CAREFUL: Self = Self(Self::SLAVE | Self::BOOT | Self::MANDATORY | Self::KEEP_ALIVE);

    /// True if all of these bits are set.
    pub const fn has(self, bits: u32) -> bool {
        self.0 & bits == bits
    }

    /// Guard time (bits 16 to 31, in ms) and retry factor (bits 8 to 15) of the node guarding that it is watched by; `None` where the
    /// time is 0.
    pub const fn guarding(self) -> Option<(Duration, u8)> {
        match self.0 >> 16 {
            0 => None,
            ms => Some((Duration::from_millis(ms as u64), (self.0 >> 8) as u8)),
        }
    }

    /// The same without these bits.
    #[must_use]
    pub const fn without(self, bits: u32) -> Self {
        Self(self.0 & !bits)
    }
}
