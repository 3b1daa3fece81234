//! Requests and replies in words: what a bus monitor shows.

use core::fmt;

use super::wire::{Address, BIT_RATES_KBIT, Bound, Outcome, Part, Reply, Request, UNCONFIGURED};

/// The lowest bit of a fastscan's question that asks whether there is a device (CiA 305, 6.5.3).
const PRESENCE: u8 = 128;

/// Vendor-ID, product code, revision and serial number in hexadecimal: `100:1:0:2A`.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [vendor, product, revision, serial] = self.numbers;
        write!(f, "{vendor:X}:{product:X}:{revision:X}:{serial:X}")
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::VendorId => "vendor-ID",
            Self::ProductCode => "product code",
            Self::RevisionNumber => "revision number",
            Self::SerialNumber => "serial number",
        })
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::VendorId => "vendor-ID",
            Self::ProductCode => "product code",
            Self::LowestRevision => "revision number from",
            Self::HighestRevision => "revision number to",
            Self::LowestSerial => "serial number from",
            Self::HighestSerial => "serial number to",
        })
    }
}

/// `done`, or the error code and the maker's.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self { code: 0, .. } => f.write_str("done"),
            Self { code: 255, specific } => write!(f, "refused, maker's error {specific}"),
            Self { code, .. } => write!(f, "refused, error {code}"),
        }
    }
}

/// A node-ID as LSS gives it.
struct NodeWord(u8);

impl fmt::Display for NodeWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            UNCONFIGURED => f.write_str("no node-ID"),
            node => write!(f, "node-ID {node}"),
        }
    }
}

/// One line without an end, the names of the services by CiA 305, clause 6.
impl fmt::Display for Request {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LSS ")?;
        match *self {
            Self::SwitchGlobal(true) => f.write_str("switch state global: configuration"),
            Self::SwitchGlobal(false) => f.write_str("switch state global: waiting"),
            Self::SwitchSelective(part, number) => write!(f, "switch state selective: {part} {number:X}h"),
            Self::ConfigureNodeId(node) => write!(f, "configure {}", NodeWord(node)),
            Self::ConfigureBitRate { table: 0, index } => {
                match BIT_RATES_KBIT.get(usize::from(index)).copied().flatten() {
                    Some(rate) => write!(f, "configure bit rate {rate} kbit/s"),
                    None => write!(f, "configure bit rate, invalid index {index}"),
                }
            }
            Self::ConfigureBitRate { table, index } => write!(f, "configure bit rate, index {index} of table {table}"),
            Self::ActivateBitRate(ms) => write!(f, "activate bit rate, silent for {ms} ms before and after"),
            Self::Store => f.write_str("store configuration"),
            Self::Inquire(part) => write!(f, "inquire {part}"),
            Self::InquireNodeId => f.write_str("inquire node-ID"),
            Self::IdentifyNonConfigured => f.write_str("identify devices without a node-ID"),
            Self::Identify(bound, number) => write!(f, "identify: {bound} {number:X}h"),
            Self::FastScan { bit: PRESENCE, .. } => f.write_str("fastscan: is there a device without a node-ID?"),
            Self::FastScan { number, bit, part, next } => {
                match Part::ALL.get(usize::from(part)) {
                    Some(part) => write!(f, "fastscan: {part} {number:X}h from bit {bit} up")?,
                    None => write!(f, "fastscan: invalid number {part}")?,
                }
                match Part::ALL.get(usize::from(next)).filter(|_| next != part) {
                    Some(next) => write!(f, ", next {next}"),
                    None => Ok(()),
                }
            }
            Self::Unknown(specifier) => write!(f, "command specifier {specifier:02X}h"),
        }
    }
}

/// One line without an end.
impl fmt::Display for Reply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LSS reply: ")?;
        match *self {
            Self::Selected => f.write_str("selected"),
            Self::NodeIdConfigured(outcome) => write!(f, "node-ID: {outcome}"),
            Self::BitRateConfigured(outcome) => write!(f, "bit rate: {outcome}"),
            Self::Stored(outcome) => write!(f, "store: {outcome}"),
            Self::Number(part, number) => write!(f, "{part} {number:X}h"),
            Self::NodeId(node) => write!(f, "{}", NodeWord(node)),
            Self::Identified => f.write_str("identified"),
            Self::NonConfigured => f.write_str("a device without a node-ID"),
            Self::Unknown(specifier) => write!(f, "command specifier {specifier:02X}h"),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    fn request(frame: &str) -> std::string::String {
        Request::parse(&frame.parse().unwrap()).unwrap().to_string()
    }

    fn reply(frame: &str) -> std::string::String {
        Reply::parse(&frame.parse().unwrap()).unwrap().to_string()
    }

    /// The bytes by CiA 305, clause 7.
    #[test]
    fn frames_are_put_in_the_words_of_the_standard() {
        assert_eq!(request("7E5#0401000000000000"), "LSS switch state global: configuration");
        assert_eq!(request("7E5#432A000000000000"), "LSS switch state selective: serial number 2Ah");
        assert_eq!(request("7E5#1105000000000000"), "LSS configure node-ID 5");
        assert_eq!(request("7E5#11FF000000000000"), "LSS configure no node-ID");
        assert_eq!(request("7E5#1300020000000000"), "LSS configure bit rate 500 kbit/s");
        assert_eq!(request("7E5#1300050000000000"), "LSS configure bit rate, invalid index 5");
        assert_eq!(request("7E5#15E8030000000000"), "LSS activate bit rate, silent for 1000 ms before and after");
        assert_eq!(request("7E5#4B2A000000000000"), "LSS identify: serial number to 2Ah");
        assert_eq!(request("7E5#5100000000800000"), "LSS fastscan: is there a device without a node-ID?");
        assert_eq!(request("7E5#5100010000000001"), "LSS fastscan: vendor-ID 100h from bit 0 up, next product code");
        assert_eq!(request("7E5#C800000000000000"), "LSS command specifier C8h");
        assert_eq!(reply("7E4#4400000000000000"), "LSS reply: selected");
        assert_eq!(reply("7E4#1101000000000000"), "LSS reply: node-ID: refused, error 1");
        assert_eq!(reply("7E4#13FF070000000000"), "LSS reply: bit rate: refused, maker's error 7");
        assert_eq!(reply("7E4#5B92010000000000"), "LSS reply: product code 192h");
        assert_eq!(reply("7E4#5EFF000000000000"), "LSS reply: no node-ID");
    }
}
