//! CANopen (CiA 301) as passive state machines: one file per service.
//!
//! No I/O, no clock, no allocation. Frames and `now` go in; frames, deadlines and events come out.
//! What a device offers is data: a [`od::Table`] of object rows, known when it is compiled or read from a file.
//! [`od::Dictionary`] holds the values, [`node::Node`] joins all services of a device over them, [`sdo::Client`] is the
//! other side of an SDO channel, [`node::SdoClient`] that of one which the device's own record names. A firmware has its values in arrays ([`od::Fixed`]), a program that learns of its objects
//! at run time in boxes ([`od::Storage`]).
//!
//! A temperature sensor with a name that can be written, and its temperature in TPDO 1 whenever it changes:
//!
//! ```
//! use can::{Instant, Station};
//! use canopen::od::{Access, DataType, Entry, Fixed, Index, Object, Table};
//! use canopen::{Node, NodeId, NodeProfile};
//!
//! use Access::{Const, ReadOnly, ReadWrite};
//! use DataType::{Integer16, Unsigned8, Unsigned32, VisibleString};
//!
//! static ROWS: [Entry; 7] = [
//!     Entry::new(0x1000, 0, Unsigned32, Const, "device_type", "Device type"),
//!     Entry::new(0x1800, 1, Unsigned32, ReadWrite, "cob_id", "COB-ID used by TPDO").node_id_plus(0x180),
//!     Entry::new(0x1800, 2, Unsigned8, ReadWrite, "transmission_type", "Transmission type").default(255),
//!     Entry::new(0x1A00, 0, Unsigned8, ReadWrite, "mapped_objects", "Number of mapped objects").default(1),
//!     Entry::new(0x1A00, 1, Unsigned32, ReadWrite, "mapped_object_1", "First object").default(0x2001_0010),
//!     Entry::new(0x2000, 0, VisibleString, ReadWrite, "name", "Name").text("boiler").capacity(16),
//!     Entry::new(0x2001, 0, Integer16, ReadOnly, "temperature", "Temperature").unit("0.1 degC").mappable(),
//! ];
//! static INDEX: Index<7> = Index::of(&ROWS);
//! static TABLE: Table = Table::new(&ROWS, &INDEX);
//! static PROFILE: NodeProfile = NodeProfile::cia_301(&TABLE);
//! const TEMPERATURE: Object<i16> = TABLE.object(0x2001, 0);
//!
//! let now = Instant::ZERO;
//! let mut sensor: Node<Fixed<7, { TABLE.byte_count() }>> = Node::new(&PROFILE, NodeId::new(5).unwrap());
//! sensor.boot(now);
//! assert_eq!(sensor.poll_transmit().unwrap().to_string(), "705#00");
//!
//! // A master reads the name: six bytes, in a segment.
//! sensor.handle_frame(&"605#4000200000000000".parse().unwrap(), now);
//! assert_eq!(sensor.poll_transmit().unwrap().to_string(), "585#4100200006000000");
//! sensor.handle_frame(&"605#6000000000000000".parse().unwrap(), now);
//! assert_eq!(sensor.poll_transmit().unwrap().to_string(), "585#03626F696C657200");
//!
//! // NMT start; then 21.5 degrees.
//! sensor.handle_frame(&"000#0105".parse().unwrap(), now);
//! assert_eq!(sensor.poll_transmit().unwrap().to_string(), "185#0000");
//! sensor.dictionary_mut().set(TEMPERATURE, 215);
//! sensor.notice_changes(now);
//! assert_eq!(sensor.poll_transmit().unwrap().to_string(), "185#D700");
//! ```
#![no_std]

mod abort;
mod cob_id;
pub mod concise;
pub mod connection_set;
pub mod emcy;
pub mod guarding;
pub mod heartbeat;
pub mod lss;
mod mux;
pub mod nmt;
pub mod node;
mod node_id;
pub mod object;
pub mod od;
pub mod pdo;
mod period;
pub mod sdo;
pub mod sync;
pub mod time_stamp;

pub use abort::AbortCode;
pub use cob_id::CobId;
pub use emcy::EmcyErrorCode;
pub use mux::Mux;
pub use nmt::{NmtCommand, NmtState};
pub use node::{Node, NodeEvent, NodeProfile};
pub use node_id::NodeId;
