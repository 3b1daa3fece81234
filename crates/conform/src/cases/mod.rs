//! The cases, a file for each group. Numbers below 51 are CiA's, as its tool prints them; the others are ours.

mod cia402;
mod cia402_motion;
mod dictionary;
mod emcy;
mod guarding;
mod heartbeat;
mod lss;
mod nmt;
mod other;
mod pdo;
mod pdo_mapping;
mod sdo;
mod sdo_block;
mod sdo_servers;
mod sdo_transfer;
mod sync;

use crate::case::Case;

const TABLES: &[&[Case]] = &[
    sdo::CASES,
    sdo_transfer::CASES,
    sdo_block::CASES,
    sdo_servers::CASES,
    pdo::CASES,
    pdo_mapping::CASES,
    dictionary::CASES,
    emcy::CASES,
    sync::CASES,
    guarding::CASES,
    heartbeat::CASES,
    other::CASES,
    nmt::CASES,
    lss::CASES,
    cia402::CASES,
    cia402_motion::CASES,
];

/// All cases, in the order in which they run.
pub fn all() -> impl Iterator<Item = &'static Case> {
    TABLES.iter().flat_map(|table| table.iter())
}
