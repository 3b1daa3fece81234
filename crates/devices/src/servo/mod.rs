//! The standard's own servo: a drive with the objects, modes and defaults of CiA 402-2 and nothing else.
//!
//! It is what a drive of any vendor is simulated as when there is no file of it, and what its file is held against.

pub mod objects;
