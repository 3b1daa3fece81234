//! Devices that are known at run time only: every data type, thousands of rows, hundreds of PDOs, fields of any length in
//! bits, and an application that has its word on downloads.

mod asked;
mod bits;
mod blocks;
mod blocks_over_a_bad_wire;
mod channels;
mod channels_over_a_bad_wire;
pub(crate) mod device;
mod giving_up;
mod long_values;
mod many_pdos;
mod model;
mod tables;
