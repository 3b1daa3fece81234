//! A device's side of LSS: its two states, and what a request makes of it (CiA 305, clause 6).

use super::wire::{Address, BIT_RATES_KBIT, Bound, Outcome, Part, Reply, Request, UNCONFIGURED};
use crate::NodeId;

/// A device's side (CiA 305, clause 6): it waits, or lets itself be configured.
#[derive(Clone, Debug)]
pub struct Server {
    address: Address,
    /// As it is on the bus now; `None` without one.
    node_id: Option<NodeId>,
    /// What it is from the next NMT reset communication on.
    pending: Option<NodeId>,
    configuring: bool,
    /// How many numbers of a selective switch have fitted so far.
    fitted: usize,
    /// How many bounds of a question who is there have fitted so far.
    within: usize,
    /// Which number a fastscan is at.
    scanned: u8,
}

/// What the device has to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// It has no node-ID, was given one, and waits again: NMT reset communication by itself (CiA 305, 5.3).
    BecomeNode,
    /// Take this bit rate, in kbit/s, when it is commanded.
    SetBitRate(u16),
    /// Change to the bit rate that was set, silent for this long in ms before and after.
    ActivateBitRate(u16),
    /// Keep both.
    Store,
}

impl Server {
    /// A device with this address and node-ID, waiting.
    pub const fn new(address: Address, node_id: Option<NodeId>) -> Self {
        Self { address, node_id, pending: node_id, configuring: false, fitted: 0, within: 0, scanned: 0 }
    }

    /// NMT reset communication: the node-ID that was configured takes effect. `None`: the device stays silent but for LSS.
    pub const fn take_node_id(&mut self) -> Option<NodeId> {
        self.node_id = self.pending;
        self.configuring = false;
        self.node_id
    }

    /// The node-ID on the bus now.
    pub const fn node_id(&self) -> Option<NodeId> {
        self.node_id
    }

    /// The node-ID that [`take_node_id`](Self::take_node_id) will give: what is to be stored.
    pub const fn pending_node_id(&self) -> Option<NodeId> {
        self.pending
    }

    /// True if it lets itself be configured.
    pub const fn is_configuring(&self) -> bool {
        self.configuring
    }

    /// What a request makes of it: an answer, and something to do. Who waits answers nothing but questions who is there.
    pub fn handle(&mut self, request: Request) -> (Option<Reply>, Option<Action>) {
        match request {
            Request::SwitchGlobal(configure) => {
                let becomes_node = !configure && self.node_id.is_none() && self.pending.is_some();
                self.configuring = configure;
                self.fitted = 0;
                (None, becomes_node.then_some(Action::BecomeNode))
            }
            Request::SwitchSelective(part, number) => (self.switch_selective(part, number), None),
            Request::IdentifyNonConfigured => (self.is_unconfigured().then_some(Reply::NonConfigured), None),
            Request::Identify(bound, number) => (self.identify(bound, number), None),
            Request::FastScan { number, bit, part, next } => (self.fast_scan(number, bit, part, next), None),
            _ if !self.configuring => (None, None),
            Request::ConfigureNodeId(node) => {
                let id = NodeId::new(node);
                if id.is_none() && node != UNCONFIGURED {
                    return (Some(Reply::NodeIdConfigured(Outcome::REFUSED)), None);
                }
                self.pending = id;
                (Some(Reply::NodeIdConfigured(Outcome::DONE)), None)
            }
            Request::ConfigureBitRate { table, index } => {
                let rate = BIT_RATES_KBIT.get(usize::from(index)).copied().flatten().filter(|_| table == 0);
                match rate {
                    Some(rate) => (Some(Reply::BitRateConfigured(Outcome::DONE)), Some(Action::SetBitRate(rate))),
                    None => (Some(Reply::BitRateConfigured(Outcome::REFUSED)), None),
                }
            }
            Request::ActivateBitRate(ms) => (None, Some(Action::ActivateBitRate(ms))),
            Request::Store => (Some(Reply::Stored(Outcome::DONE)), Some(Action::Store)),
            Request::Inquire(part) => (Some(Reply::Number(part, self.number(part))), None),
            Request::InquireNodeId => (Some(Reply::NodeId(self.node_id.map_or(UNCONFIGURED, NodeId::raw))), None),
            Request::Unknown(_) => (None, None),
        }
    }

    const fn is_unconfigured(&self) -> bool {
        self.node_id.is_none() && self.pending.is_none()
    }

    const fn number(&self, part: Part) -> u32 {
        self.address.numbers[part as usize]
    }

    fn switch_selective(&mut self, part: Part, number: u32) -> Option<Reply> {
        let expected = part as usize == self.fitted && self.number(part) == number;
        self.fitted = if expected { self.fitted + 1 } else { 0 };
        if self.fitted < Part::ALL.len() {
            return None;
        }
        self.fitted = 0;
        self.configuring = true;
        Some(Reply::Selected)
    }

    /// Six frames in their order, and every number within: whatever its state and node-ID.
    fn identify(&mut self, bound: Bound, number: u32) -> Option<Reply> {
        let fits = match bound {
            Bound::VendorId => self.number(Part::VendorId) == number,
            Bound::ProductCode => self.number(Part::ProductCode) == number,
            Bound::LowestRevision => self.number(Part::RevisionNumber) >= number,
            Bound::HighestRevision => self.number(Part::RevisionNumber) <= number,
            Bound::LowestSerial => self.number(Part::SerialNumber) >= number,
            Bound::HighestSerial => self.number(Part::SerialNumber) <= number,
        };
        let place = bound as usize;
        // The first frame begins anew, whatever came before.
        let expected = fits && (place == 0 || place == self.within);
        self.within = if expected { place + 1 } else { 0 };
        (self.within == Bound::ALL.len()).then(|| {
            self.within = 0;
            Reply::Identified
        })
    }

    /// Only who has no node-ID and waits takes part.
    fn fast_scan(&mut self, number: u32, bit: u8, part: u8, next: u8) -> Option<Reply> {
        if !self.is_unconfigured() || self.configuring {
            return None;
        }
        if bit == 128 {
            self.scanned = 0;
            return Some(Reply::Identified);
        }
        let own = *self.address.numbers.get(usize::from(part))?;
        if part != self.scanned || bit > 31 || (own ^ number) >> bit != 0 {
            return None;
        }
        if bit == 0 && next != part {
            self.scanned = next;
            self.configuring = next < part;
        }
        Some(Reply::Identified)
    }
}

#[cfg(test)]
mod tests {
    use super::super::FastScan;
    use super::*;

    const ADDRESS: Address = Address { numbers: [0x0000_0100, 0x8000_0001, 0xFFFF_FFFF, 0] };

    #[test]
    fn a_fastscan_finds_the_smallest_address_and_leaves_its_device_to_be_configured() {
        let other = Address { numbers: [0x0000_0100, 0x8000_0001, 0xFFFF_FFFF, 7] };
        let mut devices = [Server::new(other, None), Server::new(ADDRESS, None), Server::new(ADDRESS, NodeId::new(4))];
        let mut found = || {
            let (mut scan, mut asked) = (FastScan::new(), 0);
            while let Some(request) = scan.next() {
                let answers = devices.iter_mut().map(|device| device.handle(request).0);
                scan.note(answers.fold(false, |any, answer| any | (answer == Some(Reply::Identified))));
                asked += 1;
            }
            (scan.found(), asked)
        };
        // One question whether there is a device, then 32 bits and a confirmation for each number (CiA 305, 6.5.3).
        assert_eq!(found(), (Some(ADDRESS), 1 + 4 * 33));
        assert_eq!(found(), (Some(other), 1 + 4 * 33));
        assert_eq!(found(), (None, 1));
        assert_eq!(
            [devices[0].is_configuring(), devices[1].is_configuring(), devices[2].is_configuring()],
            [true, true, false]
        );
    }

    /// CiA 305, 6.5.3: bits 31 down to the one that is checked are compared, and no lower one.
    #[test]
    fn a_fastscan_compares_the_bit_that_it_is_at_and_those_above() {
        for (bit, own) in (0..32).flat_map(|bit| [0, 0x8000_0001, 0xFFFF_FFFF].map(|own| (bit, own))) {
            let mut device = Server::new(Address { numbers: [own; 4] }, None);
            let mut answers = |number| {
                device.handle(Request::FastScan { number: 0, bit: 128, part: 0, next: 0 });
                device.handle(Request::FastScan { number, bit, part: 0, next: 0 }).0.is_some()
            };
            let (itself, lower) = (1 << bit, (1 << bit) - 1);
            assert!(answers(own) && answers(own ^ lower) && !answers(own ^ itself), "{own:X}h, bit {bit}");
            assert!(bit == 31 || !answers(own ^ itself << 1), "{own:X}h, bit {bit}");
        }
    }

    #[test]
    fn who_is_selected_is_asked_and_configured_and_who_waits_says_nothing() {
        let mut device = Server::new(ADDRESS, NodeId::new(4));
        assert_eq!(device.handle(Request::InquireNodeId), (None, None));
        let select = |device: &mut Server, serial| {
            let numbers = [ADDRESS.numbers[0], ADDRESS.numbers[1], ADDRESS.numbers[2], serial];
            let asked = Part::ALL.into_iter().zip(numbers);
            asked.filter_map(|(part, number)| device.handle(Request::SwitchSelective(part, number)).0).last()
        };
        assert_eq!(select(&mut device, 1), None);
        assert_eq!(select(&mut device, 0), Some(Reply::Selected));
        assert_eq!(device.handle(Request::InquireNodeId).0, Some(Reply::NodeId(4)));
        assert_eq!(
            device.handle(Request::Inquire(Part::ProductCode)).0,
            Some(Reply::Number(Part::ProductCode, 0x8000_0001))
        );
        let configured = device.handle(Request::ConfigureNodeId(5));
        assert_eq!(configured, (Some(Reply::NodeIdConfigured(Outcome::DONE)), None));
        // It takes effect with NMT reset communication, and is asked for until then as it was (CiA 305, 6.3.1).
        assert_eq!(device.handle(Request::InquireNodeId).0, Some(Reply::NodeId(4)));
        assert_eq!(device.handle(Request::ConfigureNodeId(0)), (Some(Reply::NodeIdConfigured(Outcome::REFUSED)), None));
        let rate = |device: &mut Server, table, index| device.handle(Request::ConfigureBitRate { table, index }).1;
        assert_eq!(
            (rate(&mut device, 0, 2), rate(&mut device, 0, 5), rate(&mut device, 1, 2)),
            (Some(Action::SetBitRate(500)), None, None)
        );
        assert_eq!(device.handle(Request::SwitchGlobal(false)), (None, None));
        assert_eq!(device.handle(Request::Store), (None, None));
        assert_eq!(device.handle(Request::IdentifyNonConfigured).0, None);
        assert_eq!(device.take_node_id(), NodeId::new(5));
    }

    #[test]
    fn who_has_no_node_id_becomes_a_node_when_it_waits_again() {
        let mut device = Server::new(ADDRESS, None);
        assert_eq!(device.handle(Request::IdentifyNonConfigured).0, Some(Reply::NonConfigured));
        device.handle(Request::SwitchGlobal(true));
        assert_eq!(device.handle(Request::InquireNodeId).0, Some(Reply::NodeId(UNCONFIGURED)));
        device.handle(Request::ConfigureNodeId(9));
        assert_eq!(device.handle(Request::SwitchGlobal(false)), (None, Some(Action::BecomeNode)));
        assert_eq!(device.take_node_id(), NodeId::new(9));
        assert_eq!(device.handle(Request::IdentifyNonConfigured).0, None);
    }
}
