//! The control connection, and a machine file made by looking at a bus. One program: a file each.

mod control;
mod init;
