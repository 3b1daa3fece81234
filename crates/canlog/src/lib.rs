//! Log files of CAN: [`LogReader`] and [`LogWriter`] over any of the [`Format`]s, as [`Record`]s.
//!
//! candump (can-utils), ASC and BLF (Vector), TRC (PEAK), pcap and pcapng (Wireshark) are read; candump, ASC, BLF and pcapng are
//! written. Readers and writers are pure, over [`std::io::Read`] and [`std::io::Write`]; only [`AnyLogReader::open`] opens a file.
//! What is torn, of another kind or unknown is a [`Finding`] and passed over.
//!
//! A log of candump, of which one line is torn, becomes one of Vector's:
//!
//! ```
//! use canlog::{Entry, Format, LogReader, LogWriter};
//! use std::io::Cursor;
//!
//! let log = b"(1700000000.123456) can0 604#4041600000000000\n(1700000000.2";
//! let mut asc = LogWriter::new(Cursor::new(Vec::new()), Format::Asc)?;
//! let mut findings = Vec::new();
//! for entry in LogReader::new(&log[..], Format::Candump) {
//!     match entry? {
//!         Entry::Record(record) => asc.write(&record)?,
//!         Entry::Finding(finding) => findings.push(finding.to_string()),
//!     }
//! }
//! let asc = String::from_utf8(asc.finish()?.into_inner())?;
//! assert!(asc.contains("604") && asc.contains("40 41 60 00 00 00 00 00"));
//! assert!(findings[0].starts_with("line 2 passed over, '(1700000000.2'"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Deliberately absent: what a frame means (`master::decode`), and a log as a bus (`transport::LogBus`).

mod asc;
mod blf;
mod blf_writer;
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
pub mod text;
mod trc;
mod writer;

pub use candump::{ParseRecordError, emit_line, parse_line};
pub use finding::{Finding, Place};
pub use format::Format;
pub use reader::{AnyLogReader, LogReader};
pub use record::{Content, Direction, Entry, Interface, RawErrorFrame, Record};
pub use writer::{LogWriter, NotWritten};
