//! candump log files: one frame a line, as can-utils write and replay them.

mod bus;
mod reader;
mod record;

pub use bus::LogBus;
pub use reader::{LogError, LogReader, LogWriter};
pub use record::{ParseRecordError, Record, parse_line};
