//! Data sheets: those of makers, and one wrong for each rule. One program: a file each.

mod rules;
mod vendor_files;
