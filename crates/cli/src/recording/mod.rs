//! What is written about a run while it runs, as it is asked for: the frames as a log, the signals as a record.

mod log_options;
mod options;

pub(crate) use log_options::{LogPath, interface_of, log_path};
pub(crate) use options::RecordOptions;
