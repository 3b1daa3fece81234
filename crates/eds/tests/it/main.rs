//! Data sheets of makers. One program: a file each.

mod vendor_files;
