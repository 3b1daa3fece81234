//! cannelloni: CAN over UDP between two places that know each other, of the project of that name.
//!
//! Source: `cannelloni.h` and `README.md` of the project mguentner/cannelloni. UDP only; its TCP and SCTP are deliberately absent.
//! There is no greeting: a peer that is not there is noticed by what the system says of the first frame for it, if it does.

mod bus;
mod codec;

pub use bus::CannelloniBus;
pub use codec::{Datagram, Item, MalformedDatagram, emit};
