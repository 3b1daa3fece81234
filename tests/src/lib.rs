//! What tests Ferrodrive from outside: the manuals' figures as data, the bench at which every virtual drive is tested, and
//! the laws that hold for any input.
//!
//! The data in `tests/data` was read from the manuals by hand, apart from the tables that the drives are built from,
//! so that the two can be laid side by side. The laws in [`laws`] are called by the seeded property tests of this
//! package and by the fuzz targets, with the same meaning.

pub mod bench;
pub mod cia402;
pub mod csv;
pub mod homing;
pub mod laws;
pub mod manual;
pub mod mjoint;
pub mod object_rows;
pub mod power_states;
pub mod random_frames;
pub mod random_host;
pub mod scenarios;
pub mod seeded;
pub mod sheet;
pub mod side_by_side;
pub mod zlac8030l;
pub mod zlim42c;
