//! Commands of the command line that a page has too: their arguments, what they do on a bus, and what they say. `ferrodrive move 4
//! 90deg` in a shell and `move 4 90deg` in the console of a page are one parser and one text.
//!
//! In: the words of a command ([`command`]) and what it has in its hands ([`context::Context`]). Out: an [`command::Outcome`], as lines for
//! people or as JSON, or a [`failure::Failure`]. What is around a command, a terminal or a page, is a [`context::Shell`].

pub mod command;
pub mod context;
pub mod failure;
pub mod guard;
pub mod line;
pub mod numbers;
pub mod status;
