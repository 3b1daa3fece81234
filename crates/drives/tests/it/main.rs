//! Firmware against a motor of the tests. One program: a file each.

mod bench;
mod mjoint_motion;
mod mjoint_registers;
mod zlac8030l_faults;
mod zlac8030l_motion;
mod zlim42c_faults;
