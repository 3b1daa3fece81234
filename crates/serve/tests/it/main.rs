//! A served world without a socket and a clock: what is typed, what clients of the bus and of the control connection do, and what
//! the clock shows are arguments. One program: a file each.

mod bench;
mod clients;
mod followed;
mod lines;
mod pace;
