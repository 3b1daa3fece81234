use core::fmt;

/// A node-ID, 1 to 127. Source: CiA 301, 7.4.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// Smallest node-ID.
    pub const MIN: Self = Self(1);
    /// Largest node-ID.
    pub const MAX: Self = Self(127);

    /// The node-ID `raw`, if it is in 1..=127.
    pub const fn new(raw: u8) -> Option<Self> {
        if raw >= 1 && raw <= 127 { Some(Self(raw)) } else { None }
    }

    /// The number, 1 to 127.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// All 127 of them.
    pub fn all() -> impl Iterator<Item = Self> {
        (1..=127).map(Self)
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
