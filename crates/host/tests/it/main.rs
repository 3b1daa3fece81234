//! The control connection, and a machine file made by looking at a bus; clients that share a network. One program: a file each.

mod clients;
mod control;
mod init;
