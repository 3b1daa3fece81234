//! Sweeps: one scenario with many seeds and values of its parameters.

pub mod file;
