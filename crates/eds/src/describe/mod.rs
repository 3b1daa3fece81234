//! Between data sheets and descriptions: [`sheet`] says of a model what an EDS can say, [`keep`] makes a description of what
//! a file says.
//!
//! An EDS carries of each object: index, sub-index, type, access, whether and which way it may be mapped, the default, the
//! limits, and one text, the manual's words. It does not carry: units, the meanings of values, what is kept in the parameter
//! store, resolutions, faults, and all that a description says about behaviour.

mod axis;
mod keep;
mod names;
mod rows;
mod sheet;
mod sheet_values;

pub use keep::{Unkept, keep, keep_of};
pub(crate) use rows::bytes as bytes_of_text;
pub use sheet::{Flavour, Sheet};
pub(crate) use sheet_values::of_bytes as value_of_bytes;

#[cfg(test)]
mod tests;
