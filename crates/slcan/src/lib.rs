//! slcan: CAN over a serial line as text lines, the protocol of Lawicel's CAN232 and CANUSB and of many adapters since.
//!
//! Source: LAWICEL CANUSB manual, section 3 "Commands". Host commands end with CR; the adapter answers CR, BEL for a
//! refusal, or a line of its own. Polling (`P`, `A`), acceptance filters and the CAN FD extensions of some firmwares are
//! deliberately absent: an [`Adapter`] refuses them with BEL.
//!
//! Nothing here has a port, a socket or a clock: [`Client`] is the host's side and [`Adapter`] the other one, both bytes in and
//! bytes out, with time as an argument.
//!
//! ```
//! use can::Instant;
//! use slcan::{Client, Event};
//!
//! // A client that selects no bit rate, and an adapter that acknowledges the empty lines, closes, names its version and opens.
//! let mut client = Client::open(None, Instant::ZERO).expect("any adapter");
//! client.handle_input(b"\r\r\rV1013\r\r", Instant::ZERO);
//! assert_eq!(client.poll_event(), Some(Event::Opened));
//! client.transmit(&"604#40".parse()?);
//! assert_eq!(client.take_output(), b"\r\rC\rV\rO\rF\rt604140\r");
//! # Ok::<(), can::ParseFrameError>(())
//! ```

mod adapter;
mod client;
mod codec;
mod status;

pub use adapter::Adapter;
pub use client::{Client, Event, OpenError};
pub use codec::{Answer, Command, Decoder, Line, MAX_LINE_LENGTH, Malformed, bitrate_code, bitrate_of_code};
pub use status::Status;
