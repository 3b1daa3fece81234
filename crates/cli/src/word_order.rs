//! Words in another order than the command line has them: `ferrodrive 4 read 6064` for `ferrodrive read 4 6064`.
//!
//! What is meant is found by trying: the command first and the node behind it, if exactly one such order makes sense to the
//! parser. What only looks is then done, with a word about it; what moves or changes something is only suggested.

use clap::error::ErrorKind;
use clap::{ArgMatches, Command};

use words::node::nodes;

/// Commands that change nothing on the bus.
const HARMLESS: [&str; 8] = ["read", "state", "objects", "watch", "pdo", "emcy", "readings", "scan"];

/// A command line that makes sense, of the same words in another order.
pub(crate) struct Mended {
    /// The words behind the program's name.
    words: Vec<String>,
    /// As the parser has them.
    pub(crate) matches: ArgMatches,
}

impl Mended {
    /// As it is typed.
    pub(crate) fn text(&self) -> String {
        text(&self.words)
    }

    /// True if it changes nothing on the bus.
    pub(crate) fn is_harmless(&self) -> bool {
        self.matches.subcommand_name().is_some_and(|name| HARMLESS.contains(&name))
    }
}

/// A command line of these words, as it is typed.
pub(crate) fn text(words: &[String]) -> String {
    let quoted = words.iter().map(|word| {
        let plain = !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./:=,@%+#*".contains(c));
        if plain { word.clone() } else { format!("'{}'", word.replace('\'', r"'\''")) }
    });
    format!("ferrodrive {}", quoted.collect::<Vec<_>>().join(" "))
}

/// Whether the parser takes these words.
pub(crate) fn parses(command: &Command, words: &[String]) -> bool {
    command.clone().try_get_matches_from(std::iter::once("ferrodrive").chain(words.iter().map(String::as_str))).is_ok()
}

/// The order that was meant, if there is exactly one.
pub(crate) fn mend(command: &Command, words: &[String], error: ErrorKind) -> Option<Mended> {
    let wrong_order = matches!(
        error,
        ErrorKind::InvalidSubcommand
            | ErrorKind::ValueValidation
            | ErrorKind::InvalidValue
            | ErrorKind::UnknownArgument
    );
    if !wrong_order || words.iter().any(|word| word == "--") {
        return None;
    }
    let is_command = |word: &String| command.get_subcommands().any(|known| known.get_name() == word.as_str());
    let mut found: Option<Mended> = None;
    // The value of an option may be spelt as a command is: `--bus sim`.
    for at in (0..words.len()).filter(|place| is_command(&words[*place])) {
        for node in (0..words.len()).filter(|place| *place != at && nodes(&words[*place]).is_ok()) {
            let order = node_behind(words, at, node);
            if order == words {
                continue;
            }
            let line = ["ferrodrive".to_owned()].into_iter().chain(order.iter().cloned());
            let Ok(matches) = command.clone().try_get_matches_from(line) else { continue };
            if found.as_ref().is_some_and(|other| other.words != order) {
                return None;
            }
            found = Some(Mended { words: order, matches });
        }
    }
    found
}

/// The line with a command that was typed in capitals as it is spelt: `VELOCITY 4 60rpm`.
pub(crate) fn in_lower_case(command: &Command, words: &[String], place: usize) -> Option<Vec<String>> {
    let mut made = words.to_vec();
    made[place].make_ascii_lowercase();
    (made != words && parses(command, &made)).then_some(made)
}

/// The line with each word that begins as a negative number and stands behind an option as its value: `--for -1s` is `--for=-1s`, which
/// the parser judges as a time.
pub(crate) fn with_negative_values(words: &[String]) -> Option<Vec<String>> {
    let is_negative = |word: &str| {
        word.strip_prefix('-').is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))
    };
    let is_option = |word: &String| word.strip_prefix("--").is_some_and(|name| !name.is_empty() && !name.contains('='));
    let mut made: Vec<String> = Vec::new();
    for word in words {
        match made.last_mut().filter(|before| is_negative(word) && is_option(before)) {
            Some(option) => *option = format!("{option}={word}"),
            None => made.push(word.clone()),
        }
    }
    (made != words && !words.iter().any(|word| word == "--")).then_some(made)
}

/// The words with that at `node` directly behind that at `at`.
pub(crate) fn node_behind(words: &[String], at: usize, node: usize) -> Vec<String> {
    let mut order: Vec<String> = words.to_vec();
    let moved = order.remove(node);
    let at = if node < at { at - 1 } else { at };
    order.insert(at + 1, moved);
    order
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::args::Cli;

    fn meant(line: &str) -> Option<(String, bool)> {
        let words: Vec<String> = line.split_whitespace().map(Into::into).collect();
        let all = ["ferrodrive".to_owned()].into_iter().chain(words.iter().cloned());
        let error = Cli::command().try_get_matches_from(all).unwrap_err();
        mend(&Cli::command(), &words, error.kind()).map(|mended| (mended.text(), mended.is_harmless()))
    }

    #[test]
    fn the_node_in_front_of_the_command_is_put_behind_it() {
        assert_eq!(meant("4 read 6064"), Some(("ferrodrive read 4 6064".into(), true)));
        assert_eq!(meant("--bus sim 4 state"), Some(("ferrodrive --bus sim state 4".into(), true)));
        assert_eq!(meant("4 velocity 60rpm"), Some(("ferrodrive velocity 4 60rpm".into(), false)));
    }

    #[test]
    fn the_node_behind_what_is_done_with_it_is_put_before_it() {
        assert_eq!(meant("read 6064 4"), Some(("ferrodrive read 4 6064".into(), true)));
        assert_eq!(meant("nmt start all"), Some(("ferrodrive nmt all start".into(), false)));
        assert_eq!(meant("move 90deg 4"), Some(("ferrodrive move 4 90deg".into(), false)));
    }

    #[test]
    fn a_negative_value_belongs_to_the_option_before_it() {
        let meant = |line: &str| {
            let words: Vec<String> = line.split_whitespace().map(Into::into).collect();
            with_negative_values(&words).map(|words| words.join(" "))
        };
        assert_eq!(meant("velocity 4 60rpm --for -1s").as_deref(), Some("velocity 4 60rpm --for=-1s"));
        for line in ["velocity 4 -60rpm", "velocity 4 60rpm --for=-1s", "scan --json -v", "read 4 -- --for -1s"] {
            assert_eq!(meant(line), None, "{line}");
        }
    }

    #[test]
    fn what_makes_no_sense_in_any_order_or_in_two_is_left_alone() {
        for line in ["4 fly", "reed 4 6064", "velocity 4 60deg", "4"] {
            assert_eq!(meant(line), None, "{line}");
        }
    }
}
