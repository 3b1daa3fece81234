//! What is written about a run while it runs: the frames as a candump log, the signals as a record.

mod background;
mod file;
mod frame_log;
mod options;

pub(crate) use file::{Batch, Pace, RecordFile};
pub(crate) use frame_log::FrameLog;
pub(crate) use options::RecordOptions;
