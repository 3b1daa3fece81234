//! slcan: CAN over a serial line as text lines, the protocol of Lawicel's CAN232 and CANUSB and of many adapters since.
//!
//! Source: LAWICEL CANUSB manual, section 3 "Commands". Host commands end with CR; the adapter answers CR, BEL for a
//! refusal, or a line of its own. Polling (`P`, `A`), acceptance filters and the CAN FD extensions of some firmwares are
//! deliberately absent: a server refuses them with BEL.

mod client;
mod codec;
mod session;
mod status;

pub use client::SlcanBus;
pub(crate) use client::SlcanPlace;
pub use codec::{Answer, Command, Decoder, Line, MAX_LINE_LENGTH, Malformed, bitrate_code, bitrate_of_code};
pub(crate) use session::SlcanSession;
