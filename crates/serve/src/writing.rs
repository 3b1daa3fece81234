//! What is written about a run while it runs: the frames as a log, the signals as a record.

mod background;
mod command_log;
mod frame_log;
mod record_file;
mod record_output;

pub use background::{Pace, ROOM};
pub use command_log::{CommandLog, NewLog, Writing};
pub use frame_log::FrameLog;
pub use record_file::RecordFile;
pub use record_output::RecordOutput;
