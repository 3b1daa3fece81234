//! What is written about a run while it runs: the frames as a log, the signals as a record.

mod background;
mod command_log;
mod file;
mod frame_log;
mod log_options;
mod object_record;
mod options;

pub(crate) use background::Pace;
pub(crate) use command_log::CommandLog;
pub(crate) use file::{Batch, RecordFile};
pub(crate) use frame_log::FrameLog;
pub(crate) use log_options::{LogPath, NewLog, ROOM, interface_of, log_path};
pub(crate) use object_record::{ObjectBatch, ObjectRecord};
pub(crate) use options::RecordOptions;
