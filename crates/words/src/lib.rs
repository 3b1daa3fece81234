//! What people type, read into what is meant: nodes, objects, values, drives.
//!
//! Every error says what was wrong, what is expected, and shows an example; clap prints it with exit status 2.

pub mod calls;
pub mod data_sheet;
pub mod decode;
pub mod document;
pub mod drive;
pub mod failure;
pub mod line;
pub mod mode;
pub mod models;
pub mod node;
pub mod object;
pub mod selection;
pub mod suggest;
pub mod time;
pub mod unit;
pub mod unresolved;
pub mod value;

pub use plot::escaped;

/// A number and what there are so many of: `1 value`, `2 values`.
pub fn counted(count: impl TryInto<u64>, what: &str) -> String {
    // A number beyond 64 bits counts nothing that there is.
    let count = count.try_into().unwrap_or(u64::MAX);
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

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

#[cfg(test)]
mod tests {
    use super::counted;

    #[test]
    fn one_is_singular_and_any_other_number_plural() {
        let said = [0, 1, 2, 1001].map(|count: usize| counted(count, "value"));
        assert_eq!(said, ["0 values", "1 value", "2 values", "1001 values"]);
    }
}
