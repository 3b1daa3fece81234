//! Defects put in on purpose: a place each, what is there, what is written instead, and the tests that have to notice.
//!
//! A line each, of the kind that a person writes by mistake: a limit by one, a sign, a word for its neighbour. Where a defect was not
//! noticed a test was missing, and has been written.

mod drives;
mod standards;
mod tools;

use super::defect::Defect;

/// All of them, in the order of their numbers.
pub(super) fn defects() -> Vec<&'static Defect> {
    [standards::DEFECTS, drives::DEFECTS, tools::DEFECTS].into_iter().flatten().collect()
}
