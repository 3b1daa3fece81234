//! The search for every device of one make, with a node-ID or without: ranges of revision and serial numbers are asked for, and halved
//! where a slave answers (CiA 305, 6.5.1, LSS identify remote slave).

use heapless::Vec;

use super::wire::{Address, Bound, Request};

/// 32 bits of a revision number and 32 of a serial number are halved, and the other half of each waits meanwhile.
const DEPTH: usize = 65;
/// Every number of 32 bits.
const ALL: Range = Range { lowest: 0, highest: u32::MAX };

/// The search. Ask every [`poll_request`](Self::poll_request); to the sixth wait for [`Reply::Identified`](super::Reply::Identified), and report with
/// [`note`](Self::note) whether it came, until there is none.
#[derive(Clone, Debug)]
pub struct Search {
    vendor_id: u32,
    product_code: u32,
    /// What is still to be asked for; the last is under way.
    left: Vec<Devices, DEPTH>,
    /// How many of its six frames have been sent.
    sent: usize,
}

/// The devices of the make whose numbers are within.
#[derive(Clone, Copy, Debug)]
struct Devices {
    revision: Range,
    serial: Range,
}

/// Both ends belong to it.
#[derive(Clone, Copy, Debug)]
struct Range {
    lowest: u32,
    highest: u32,
}

impl Range {
    /// Its halves, the lower first; `None` where it is one number.
    const fn halves(self) -> Option<(Self, Self)> {
        if self.lowest == self.highest {
            return None;
        }
        let middle = self.lowest + (self.highest - self.lowest) / 2;
        Some((Self { highest: middle, ..self }, Self { lowest: middle + 1, ..self }))
    }
}

impl Devices {
    const fn halves(self) -> Option<(Self, Self)> {
        if let Some((low, high)) = self.revision.halves() {
            return Some((Self { revision: low, ..self }, Self { revision: high, ..self }));
        }
        match self.serial.halves() {
            Some((low, high)) => Some((Self { serial: low, ..self }, Self { serial: high, ..self })),
            None => None,
        }
    }
}

impl Search {
    /// A search that begins, for devices of this vendor and product (1018h:01 and 02), of one revision (1018h:03) or of any, which
    /// takes twice as long.
    pub fn new(vendor_id: u32, product_code: u32, revision: Option<u32>) -> Self {
        let mut left = Vec::new();
        let revision = revision.map_or(ALL, |number| Range { lowest: number, highest: number });
        // There is room for one.
        let _ = left.push(Devices { revision, serial: ALL });
        Self { vendor_id, product_code, left, sent: 0 }
    }

    /// The next frame; `None` once every device is found. The sixth of a question is the one that is answered.
    pub fn poll_request(&mut self) -> Option<Request> {
        let Devices { revision, serial } = *self.left.last()?;
        let bound = *Bound::ALL.get(self.sent)?;
        self.sent += 1;
        Some(Request::Identify(
            bound,
            match bound {
                Bound::VendorId => self.vendor_id,
                Bound::ProductCode => self.product_code,
                Bound::LowestRevision => revision.lowest,
                Bound::HighestRevision => revision.highest,
                Bound::LowestSerial => serial.lowest,
                Bound::HighestSerial => serial.highest,
            },
        ))
    }

    /// Whether a slave has answered; the address of the device that is found by that, if one is.
    pub fn note(&mut self, identified: bool) -> Option<Address> {
        self.sent = 0;
        let asked = self.left.pop().filter(|_| identified)?;
        match asked.halves() {
            Some((low, high)) => {
                // Each halving leaves one more; there are no more halvings than bits.
                let _ = self.left.push(high);
                let _ = self.left.push(low);
                None
            }
            None => Some(Address {
                numbers: [self.vendor_id, self.product_code, asked.revision.lowest, asked.serial.lowest],
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::{Reply, Server};
    use super::*;
    use crate::NodeId;

    /// Every device that the search finds among these, in its order, and how many questions it took.
    fn found(devices: &mut [Server], revision: Option<u32>) -> (std::vec::Vec<[u32; 4]>, usize) {
        let mut search = Search::new(0x100, 7, revision);
        let (mut found, mut questions) = (std::vec::Vec::new(), 0);
        while let Some(request) = search.poll_request() {
            let answers = devices.iter_mut().map(|device| device.handle(request).0);
            let identified = answers.fold(false, |any, answer| any | (answer == Some(Reply::Identified)));
            if matches!(request, Request::Identify(Bound::HighestSerial, _)) {
                found.extend(search.note(identified).map(|address| address.numbers));
                questions += 1;
            } else {
                // Only the sixth is answered.
                assert!(!identified, "{request:?}");
            }
        }
        (found, questions)
    }

    #[test]
    fn every_device_of_a_make_is_found_whether_it_has_a_node_id_or_not() {
        let device = |numbers, node| Server::new(Address { numbers }, NodeId::new(node));
        let same_make = [[0x100, 7, 0, 0], [0x100, 7, 1, u32::MAX], [0x100, 7, u32::MAX, 9], [0x100, 7, u32::MAX, 10]];
        let others = [[0x101, 7, 0, 0], [0x100, 8, 0, 0]];
        let nodes = [4, 0, 5, 0, 6, 0];
        let all = same_make.iter().chain(&others).zip(nodes);
        let mut devices: std::vec::Vec<_> = all.map(|(numbers, node)| device(*numbers, node)).collect();
        let (addresses, questions) = found(&mut devices, None);
        assert_eq!(addresses, same_make);
        // At most both halves of each of the 64 bits, for each device.
        assert!(questions <= 1 + 4 * 2 * 64, "{questions}");
        assert_eq!(found(&mut devices[4..], None), (std::vec::Vec::new(), 1));
        let (of_one_revision, questions) = found(&mut devices, Some(u32::MAX));
        assert_eq!(of_one_revision, same_make[2..]);
        assert!(questions <= 1 + 2 * 2 * 32, "{questions}");
    }
}
