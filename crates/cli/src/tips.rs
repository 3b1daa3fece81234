//! What helps where the words of the command line are known and something of them is missing or wrong: examples of the command, its
//! own commands, the error of the order that was meant.

use clap::Command;
use clap::error::ErrorKind;

use crate::word_order::node_behind;
use words::node::nodes;

/// How many examples are shown.
const EXAMPLES: usize = 2;

/// The command that the first words name.
fn named<'a>(command: &'a Command, words: &[String]) -> &'a Command {
    let mut found = command;
    for word in words {
        // Values of options stand between; the name of a command is looked for from left to right.
        found = found.find_subcommand(word).unwrap_or(found);
    }
    found
}

/// The first examples of the help of the command that is named, where what it needs was left out.
pub(crate) fn examples(command: &Command, words: &[String]) -> Vec<String> {
    let command = named(command, words);
    let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let lines = help.lines().map(|line| line.split("  #").next().unwrap_or(line).trim());
    let examples = lines.filter(|line| line.starts_with("ferrodrive ") && !line.contains(" #"));
    examples.take(EXAMPLES).map(|line| format!("e.g. {line}")).collect()
}

/// The commands of the command that is named, where none of them was typed.
pub(crate) fn commands(command: &Command, words: &[String]) -> Option<String> {
    let parent = named(command, words);
    let names: Vec<_> = parent.get_subcommands().filter(|its| !its.is_hide_set() && its.get_name() != "help").collect();
    let names: Vec<_> = names.into_iter().map(Command::get_name).collect();
    let is_whole = parent.get_name() == command.get_name() || names.is_empty();
    (!is_whole).then(|| format!("{} has: {}", parent.get_name(), names.join(", ")))
}

/// Those of the similar names that begin as the word does, where there are any: `velocty` is not meant as `plot`. The others serve
/// where the names are too many to name them all instead.
pub(crate) fn alike(word: &str, names: Vec<String>, are_few: bool) -> Vec<String> {
    let begins = |name: &String| name.chars().next() == word.chars().next().map(|first| first.to_ascii_lowercase());
    let (alike, others): (Vec<_>, Vec<_>) = names.into_iter().partition(begins);
    if alike.is_empty() && !are_few { others } else { alike }
}

/// The error of the line with its node directly behind its command, where that gets further: `nmt fly 4` has a node, and a word
/// that is not a command of `nmt`.
pub(crate) fn further(command: &Command, words: &[String], error: ErrorKind) -> Option<clap::Error> {
    if error != ErrorKind::ValueValidation {
        return None;
    }
    let at = words.iter().position(|word| command.find_subcommand(word).is_some())?;
    // A number behind an option is its value.
    let is_node = |place: &usize| nodes(&words[*place]).is_ok() && !words[*place - 1].starts_with('-');
    let node = (at + 2..words.len()).find(is_node)?;
    let order = node_behind(words, at, node);
    let line = std::iter::once("ferrodrive").chain(order.iter().map(String::as_str));
    let further = command.clone().try_get_matches_from(line).err()?;
    (further.kind() == ErrorKind::InvalidValue).then_some(further)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scope::command_line;

    fn words(line: &str) -> Vec<String> {
        line.split(' ').map(Into::into).collect()
    }

    #[test]
    fn who_leaves_out_what_a_command_needs_is_shown_examples_of_it() {
        let examples = examples(&command_line(), &words("group move"));
        assert!(examples[0].starts_with("e.g. ferrodrive group move 1=90deg"), "{examples:?}");
        assert!(examples.iter().any(|line| line.contains("machine.toml")), "{examples:?}");
    }

    #[test]
    fn the_commands_of_a_command_are_named() {
        assert_eq!(commands(&command_line(), &words("export zzz")).as_deref(), Some("export has: dbc"));
        assert_eq!(commands(&command_line(), &words("zzz")), None);
    }

    #[test]
    fn a_name_that_begins_otherwise_is_not_meant() {
        assert_eq!(alike("velocty", vec!["plot".into(), "velocity".into()], false), ["velocity"]);
        assert_eq!(alike("kcan", vec!["scan".into()], false), ["scan"]);
        // All of `params` are named.
        assert!(alike("frob", vec!["rollback".into()], true).is_empty());
        let all = commands(&command_line(), &words("params frob")).unwrap_or_default();
        assert!(all.starts_with("params has: backup, diff, plan, apply"), "{all}");
    }

    #[test]
    fn a_line_with_its_node_last_is_refused_for_what_is_wrong_in_it() {
        let further = |line: &str| further(&command_line(), &words(line), ErrorKind::ValueValidation);
        let error = further("nmt fly 4").map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("'fly'") && error.contains("pre-operational"), "{error}");
        assert!(further("run a.toml --seeds 20").is_none());
        assert!(further("nmt 4 start").is_none() && further("move 90deg 4").is_none());
    }
}
