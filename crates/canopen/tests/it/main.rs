//! The CANopen services as one sees them on the bus. One program: a file each.

mod any_device;
mod node;
mod wire_types;
