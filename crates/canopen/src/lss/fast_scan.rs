//! LSS fastscan (CiA 305, 6.5.3): which question comes next, and what the answers say.

use super::wire::{Address, Request};

/// Asks whether there is a device without a node-ID. Source: CiA 305, 6.5.3.
const PRESENCE: u8 = 128;
const HIGHEST_BIT: u8 = 31;

/// The search for one device of which nothing is known, bit by bit (CiA 305, 6.5.3): the smallest address that is there.
///
/// Ask [`next`](Self::next), wait for [`Reply::Identified`](super::Reply::Identified), and report with [`note`](Self::note) whether it came.
#[derive(Clone, Debug)]
pub struct FastScan {
    address: Address,
    step: ScanStep,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ScanStep {
    Presence,
    Bit {
        part: u8,
        bit: u8,
    },
    /// All bits of a number are known, and the slaves that fit go on to the next.
    Confirm {
        part: u8,
    },
    Found,
    /// There is no slave, or one went away.
    Unanswered,
}

impl Default for FastScan {
    fn default() -> Self {
        Self::new()
    }
}

impl FastScan {
    /// A search that begins.
    pub const fn new() -> Self {
        Self { address: Address { numbers: [0; 4] }, step: ScanStep::Presence }
    }

    /// The next question; `None` once it is over.
    pub fn next(&self) -> Option<Request> {
        let number = |part: u8| self.address.numbers[usize::from(part & 3)];
        match self.step {
            ScanStep::Presence => Some(Request::FastScan { number: 0, bit: PRESENCE, part: 0, next: 0 }),
            ScanStep::Bit { part, bit } => Some(Request::FastScan { number: number(part), bit, part, next: part }),
            ScanStep::Confirm { part } => {
                Some(Request::FastScan { number: number(part), bit: 0, part, next: (part + 1) & 3 })
            }
            ScanStep::Found | ScanStep::Unanswered => None,
        }
    }

    /// Whether a slave has answered.
    pub fn note(&mut self, identified: bool) {
        self.step = match self.step {
            ScanStep::Presence if identified => ScanStep::Bit { part: 0, bit: HIGHEST_BIT },
            ScanStep::Bit { part, bit } => {
                if !identified {
                    // No slave has 0 there, so all that are there have 1.
                    self.address.numbers[usize::from(part & 3)] |= 1 << bit;
                }
                if bit > 0 { ScanStep::Bit { part, bit: bit - 1 } } else { ScanStep::Confirm { part } }
            }
            ScanStep::Confirm { part: 3 } if identified => ScanStep::Found,
            ScanStep::Confirm { part } if identified => ScanStep::Bit { part: part + 1, bit: HIGHEST_BIT },
            ScanStep::Presence | ScanStep::Confirm { .. } | ScanStep::Unanswered => ScanStep::Unanswered,
            ScanStep::Found => ScanStep::Found,
        };
    }

    /// The address, once it is found. That device lets itself be configured from then on.
    pub fn found(&self) -> Option<Address> {
        (self.step == ScanStep::Found).then_some(self.address)
    }
}
