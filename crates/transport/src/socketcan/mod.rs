//! CAN of the Linux kernel.

mod error_class;

pub(crate) use error_class::notes_of;
