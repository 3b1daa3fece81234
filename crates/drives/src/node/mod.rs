//! A device of any kind whose objects come from a description: the services of CiA 301 over them, and no application.
//!
//! PDOs, limits, heartbeat, EMCY, error history and parameter store work by the objects that are there. What a sensor of
//! the device would measure is put into its objects from outside ([`DescribedNode::set`]); what a host writes stays there.

mod device;
mod memory;
mod services;

pub use device::DescribedNode;
pub use memory::{CAPACITY, MEMORY_SIZE, Memory, is_parameter};
pub use services::{Services, conditions};

use canopen::Mux;

/// Whether these services do something with an object.
pub const fn acts_on(mux: Mux) -> bool {
    matches!(
        mux.index,
        0x1000
            | 0x1001
            | 0x1003
            | 0x1005
            | 0x1008
            | 0x1009
            | 0x100A
            | 0x1010
            | 0x1011
            | 0x1014
            | 0x1015
            | 0x1016
            | 0x1017
            | 0x1018
            | 0x1200
            | 0x1400..=0x1BFF
    )
}
