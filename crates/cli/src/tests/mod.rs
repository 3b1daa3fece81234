//! Commands on a bus that outlives them, in virtual time: what a simulator of another program would show, without a process and
//! without a clock. What only processes show (signals, sockets, terminals) is in `tests/processes`.

mod console;
mod estop;
mod guards;
mod images;
mod interrupted;
mod latency;
mod limits;
pub(crate) mod lines;
mod looks;
mod lss;
mod machines;
mod models;
mod motion_ends;
mod pages;
mod params;
mod records;
mod report;
mod servers;
mod several;
mod virtual_bus;
