//! What is written about a run while it runs, as it is asked for: the frames as a log, the signals as a record.

mod host_viewers;
mod log_options;
mod options;
mod viewers;

pub(crate) use host_viewers::HostViewers;
pub(crate) use log_options::{LogPath, interface_of, log_path};
pub(crate) use options::RecordOptions;
pub(crate) use viewers::ViewerOptions;
