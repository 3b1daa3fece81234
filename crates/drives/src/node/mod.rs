//! A device of any kind whose objects come from a description: the services of CiA 301 over them.
//!
//! PDOs, limits, heartbeat, EMCY, error history and parameter store work by the objects that are there. What a sensor of
//! the device would measure is put into its objects from outside ([`DescribedNode::set`]); what a host writes stays there. Inputs and
//! outputs of CiA 401 and encoders of CiA 406 act as their profile has it.

pub(crate) mod described;
mod device;
mod encoder;
mod io;
mod lss;
mod memory;
mod overheard;
mod profile;
mod program;
mod scanner;
mod services;

pub use described::{DescribedDevice, Loss};
pub use device::DescribedNode;
pub use memory::{Memory, image_size, is_makers_mark, is_storable};
pub use overheard::Overheard;
pub use profile::profile_conditions;
pub(crate) use profile::refused;
pub(crate) use services::no_destinations;
pub use services::{Services, Written};

use canopen::Mux;
use canopen::object::COMMUNICATION_ERROR;
use canopen::od::{Condition, Dictionary, Slot, Storage, Table};

/// What a device with these objects refuses beyond its rows: for [`Conditions`](canopen::od::Conditions).
pub fn conditions(table: &'static Table) -> impl Iterator<Item = (Slot, Condition)> {
    services::conditions(table).chain(program::conditions(table))
}

/// Whether these services do something with an object. The SDO channels on which the device is the client (1280h to 12FFh) are not among
/// them: what it would ask for there is its application's, which no description knows.
pub const fn acts_on(mux: Mux) -> bool {
    let has_effect = match mux.index {
        0x1029 => mux.sub_index <= 1,
        _ => true,
    };
    has_effect
        && matches!(
            mux.index,
            0x1000
                | 0x1001
                | 0x1002
                | 0x1003
                | 0x1005
                | 0x1006
                | 0x1007
                | 0x1008
                | 0x1009
                | 0x100A
                | 0x100C
                | 0x100D
                | 0x1010
                | 0x1012
                | 0x1011
                | 0x1014
                | 0x1015
                | 0x1016
                | 0x1017
                | 0x1018
                | 0x1019
                | 0x1020
                | 0x1028
                | 0x1029
                | 0x1200..=0x127F
                | 0x1400..=0x1BFF
                | 0x1F50
                | 0x1F51
                | 0x1F56
                | 0x1F57
                | 0x1FA0..=0x1FFF
        )
}

/// Whether a device that is not a drive does something with an object, by CiA 301 or by its profile.
pub fn device_acts_on(description: &devices::Description, mux: Mux) -> bool {
    acts_on(mux) || profile::acts_on(description, mux)
}

/// 1029h:01, where the device has it (CiA 301, 7.5.2.32): 0 to pre-operational, 1 no change, 2 stopped.
fn error_behaviour(values: &Dictionary<impl Storage>) -> Option<i64> {
    values.view().value(COMMUNICATION_ERROR).ok()
}
