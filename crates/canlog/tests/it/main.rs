//! Files of logs, in every form.

mod log_formats;
