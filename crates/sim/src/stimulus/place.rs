//! Whom a stimulus is for.

use std::fmt;
use std::str::FromStr;

use devices::AxisId;

/// A node by the number under which it was added, and one of its axes: `5`, or `5.2` for the second axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// 1 to 127.
    pub node: u8,
    /// Its axis.
    pub axis: AxisId,
}

impl Place {
    /// The first axis of a node, or the node itself.
    pub const fn node(node: u8) -> Self {
        Self { node, axis: AxisId::FIRST }
    }
}

impl FromStr for Place {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (node, axis) = text.split_once('.').unwrap_or((text, "1"));
        let number = |text: &str| text.parse::<u8>().ok().filter(|_| !text.starts_with('+'));
        let node = number(node).filter(|node| (1..=127).contains(node)).ok_or(())?;
        let axis = number(axis).and_then(|axis| axis.checked_sub(1)).ok_or(())?;
        Ok(Self { node, axis: AxisId(axis) })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.axis {
            AxisId::FIRST => self.node.fmt(f),
            AxisId(axis) => write!(f, "{}.{}", self.node, u16::from(axis) + 1),
        }
    }
}
