//! What people type, read into what is meant: nodes, objects, values, drives.
//!
//! Every error says what was wrong, what is expected, and shows an example; clap prints it with exit status 2.

pub mod drive;
pub mod mode;
pub mod node;
pub mod object;
pub mod selection;
pub mod suggest;
pub mod unit;
pub mod unresolved;
pub mod value;

/// `text` with its control characters escaped, but for the ends of lines: file names, machine files and commands may carry
/// sequences that a terminal obeys.
pub fn plain(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() && letter != '\n' {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    shown
}
