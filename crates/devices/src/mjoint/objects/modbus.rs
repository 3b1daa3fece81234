//! Addresses of the control objects on the RS485 side ("M Robot Joint Motor CanOpen Manual", 5.04, column "Modbus
//! address"), for a Modbus server.
//!
//! Values of 32 bits take two addresses, the low word first. The low byte of most 26xxh indexes is the register number
//! of the older servos of the family, which the manual uses in one place ("special function (address 0x19)" is 2619h,
//! 1Bh here).

use canopen::Mux;

/// Where an object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Register {
    /// Its first address.
    pub address: u16,
    /// The object.
    pub object: Mux,
    /// Addresses that it takes: 1, or 2 with the low word first.
    pub words: u8,
}

/// All registers, ascending by address.
#[rustfmt::skip]
pub static REGISTERS: [Register; 33] = [
    one(0x00, 0x2600, 0), one(0x01, 0x2601, 0), two(0x02, 0x6081, 0), two(0x04, 0x6083, 0),
    one(0x06, 0x2604, 0), one(0x07, 0x60F9, 1), one(0x08, 0x60F9, 2), one(0x09, 0x60FB, 1),
    one(0x0A, 0x60FB, 2), one(0x0B, 0x2609, 0), one(0x0C, 0x260A, 0), one(0x0D, 0x260B, 0),
    two(0x0E, 0x260C, 0), one(0x10, 0x260E, 0), one(0x11, 0x6078, 0), one(0x12, 0x606C, 0),
    one(0x13, 0x6079, 0), one(0x14, 0x2612, 0), one(0x15, 0x2613, 0), one(0x16, 0x2614, 0),
    one(0x17, 0x2615, 0), two(0x18, 0x6064, 0), one(0x1A, 0x2618, 0), one(0x1B, 0x2619, 0),
    two(0x1C, 0x607A, 0), two(0x1E, 0x60FF, 0), one(0x20, 0x261C, 0), one(0x21, 0x261D, 0),
    one(0x22, 0x60FD, 0), one(0x23, 0x6040, 0), one(0x24, 0x6041, 0),
    one(0x25, 0x6060, 0), one(0x26, 0x6098, 0),
];

/// The register at `address`, and which of its words that is.
pub fn find(address: u16) -> Option<(&'static Register, usize)> {
    let after = REGISTERS.partition_point(|register| register.address <= address);
    let register = REGISTERS[..after].last()?;
    let word = address - register.address;
    (word < u16::from(register.words)).then_some((register, usize::from(word)))
}

const fn one(address: u16, index: u16, sub_index: u8) -> Register {
    Register { address, object: Mux::new(index, sub_index), words: 1 }
}

const fn two(address: u16, index: u16, sub_index: u8) -> Register {
    Register { words: 2, ..one(address, index, sub_index) }
}
