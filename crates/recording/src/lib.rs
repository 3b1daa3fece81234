//! Records of a run as files: what was sampled, what was carried, what happened.
//!
//! A [`Record`] is written piece by piece, so that a long run needs little memory, and [`read`] takes a file back, also one
//! whose end is missing. Two kinds of file:
//!
//! - MCAP (<https://mcap.dev/spec>), which Foxglove, PlotJuggler and Rerun open: a topic for each axis (`/node/4`,
//!   `/node/5/2`) and body (`/body/base`), whose schema gives the units, `/can` with the frames and `/events` with what
//!   happened, as log lines. [`Channels`] has them, for the file and for those who watch a run.
//! - CSV: `t_s`, a column for each signal (`4.velocity_rpm`), and `mark`, what happened since the line before. It has no
//!   frames.
//!
//! Times are seconds, in MCAP nanoseconds, from the start of the world or of the connection.

mod capture;
mod cdr;
mod channels;
mod column;
mod convert;
mod csv;
mod difference;
mod mcap_file;
mod mcap_read;
mod mcap_writer;
mod packing;
mod picture;
mod piece;
mod read;
mod record;
mod trail;

pub use capture::{Capture, Trace};
pub use channels::{Channel, Channels, MESSAGE_ENCODING, SCHEMA_ENCODING, Sink};
pub use column::{Column, Subject, columns_of_drives, ending_of, is_called, select};
pub use convert::{csv_of_mcap, mcap_of_csv};
pub use picture::{overlay, picture};
pub use piece::{Batch, Entry, Kind, Mark, Recorded, Series, Severity, Target};
pub use read::{read, read_csv};
pub use record::Record;
pub use trail::Trail;
