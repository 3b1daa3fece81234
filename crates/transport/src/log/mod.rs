//! Log files of CAN: [`LogReader`] and [`LogWriter`] over any of the [`Format`]s, as [`Record`]s.
//!
//! candump (can-utils), ASC and BLF (Vector), TRC (PEAK), pcap and pcapng (Wireshark) are read; candump, ASC, BLF and pcapng are
//! written. Readers and writers are pure, over [`std::io::Read`] and [`std::io::Write`]; only [`LogBus`] and
//! [`AnyLogReader::open`] open files. What is torn, of another kind or unknown is a [`Finding`] and passed over.

mod asc;
mod blf;
mod blf_writer;
mod bus;
mod bytes;
mod calendar;
mod candump;
mod finding;
mod format;
mod lines;
mod packet;
mod pcap;
mod pcapng;
mod reader;
mod record;
mod trc;
mod writer;

pub use bus::LogBus;
pub use candump::{ParseRecordError, emit_line, parse_line};
pub use finding::{Finding, Place};
pub use format::Format;
pub use reader::{AnyLogReader, LogReader};
pub use record::{Content, Direction, Entry, Interface, RawErrorFrame, Record};
pub use writer::{LogWriter, NotWritten};
