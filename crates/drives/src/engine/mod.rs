//! The parts that drives are made of. Each takes plain values and knows no object of any drive.

pub mod faults;
pub mod storage;
