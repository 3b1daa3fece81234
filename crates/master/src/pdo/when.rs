//! When a PDO is sent or takes effect, in words.

use canopen::pdo::{AddressMode, Direction};

use super::config::PdoConfig;

impl PdoConfig {
    /// When it is sent, or takes effect. Source: CiA 301, tables 66 and 71.
    pub fn when(&self) -> String {
        match (self.pdo.direction, self.transmission.0) {
            _ if self.multiplexed == Some(AddressMode::Source) => "multiplexed, by source address".into(),
            _ if self.multiplexed == Some(AddressMode::Destination) => "multiplexed, by destination address".into(),
            (Direction::Tpdo, 0) => "after SYNC, if changed".into(),
            (Direction::Tpdo, 1) => "after every SYNC".into(),
            (Direction::Tpdo, every @ 2..=240) => format!("after every {every}. SYNC"),
            (Direction::Rpdo, 0..=240) => "with the next SYNC".into(),
            (Direction::Tpdo, 252) => "sampled at SYNC, sent on a remote frame".into(),
            (Direction::Tpdo, 253) => "on a remote frame".into(),
            (Direction::Tpdo, 254 | 255) => "on events".into(),
            (Direction::Rpdo, 254 | 255) => "at once".into(),
            (_, reserved) => format!("{reserved}, which is reserved"),
        }
    }
}
