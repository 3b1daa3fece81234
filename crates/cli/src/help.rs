//! Help that fits on a screen: the commands in groups, and the options that every command takes in one place
//! (`ferrodrive help options`).

use clap::{Arg, Command};

/// The commands of a group, as one looks for them.
struct CommandGroup {
    title: &'static str,
    commands: &'static [&'static str],
}

/// Every command that is shown is in exactly one group.
const GROUPS: &[CommandGroup] = &[
    CommandGroup { title: "Simulate", commands: &["demo", "sim", "run", "world", "events"] },
    CommandGroup {
        title: "Look",
        commands: &[
            "scan", "state", "explain", "report", "read", "watch", "objects", "pdo", "emcy", "dump", "top", "studio",
        ],
    },
    CommandGroup {
        title: "Move",
        commands: &[
            "enable",
            "disable",
            "velocity",
            "move",
            "torque",
            "home",
            "group",
            "drive-base",
            "test-motion",
            "stop",
            "quick-stop",
            "estop",
            "reset",
        ],
    },
    CommandGroup {
        title: "Configure",
        commands: &["init", "write", "params", "tune", "dcf", "save", "restore", "lss", "program"],
    },
    CommandGroup {
        title: "Network",
        commands: &[
            "boot",
            "supervise",
            "nmt",
            "sync",
            "time",
            "send",
            "latency",
            "gateway",
            "plan",
            "check",
            "conform",
        ],
    },
    CommandGroup {
        title: "Record and replay",
        commands: &["capture", "record", "plot", "decode", "convert", "replay"],
    },
    CommandGroup { title: "Tools", commands: &["eds", "export", "fmu", "readings", "completions", "help"] },
];

/// What the help of the whole command line is made of. Options are those of `help options`.
const TEMPLATE: &str = "{about-with-newline}\n{usage-heading} {usage}{after-help}";

/// The command whose help describes the options that every command takes.
pub(crate) const OPTIONS: &str = "options";

const EXAMPLES: &str = "Without --bus everything happens on a private virtual bus, in virtual time:
  ferrodrive demo
  ferrodrive move 4 90deg
  ferrodrive --bus can0 state 4";

/// The command line with help of this form. The options that every command takes are still parsed and completed everywhere.
pub(crate) fn dressed(command: Command) -> Command {
    let common: Vec<Arg> = command.get_arguments().filter(|arg| arg.is_global_set()).cloned().collect();
    let (short, long) = (overview(&command, false), overview(&command, true));
    let command = command.mut_args(|arg| only_in_help_options(arg, &common)).mut_subcommands(|its| {
        if its.get_name() == OPTIONS { with_shown(its, &common) } else { pointing_to_common(its, &common) }
    });
    with_negative_numbers(command).help_template(TEMPLATE).after_help(short).after_long_help(long)
}

/// A negative number is the value of what it stands behind, to be judged there; no option is spelt like one.
fn with_negative_numbers(command: Command) -> Command {
    let takes = |arg: &Arg| arg.get_action().takes_values() && !arg.is_allow_hyphen_values_set();
    command
        .mut_args(|arg| if takes(&arg) { arg.allow_negative_numbers(true) } else { arg })
        .mut_subcommands(with_negative_numbers)
}

/// The options of all commands, as `ferrodrive help options` shows them.
pub(crate) fn of_options(mut command: Command) -> String {
    command.build();
    command.find_subcommand_mut(OPTIONS).map(|its| its.render_long_help().to_string()).unwrap_or_default()
}

/// What is typed for the help of a command in place of `help -h` and `help COMMAND -h`: the parser's own `help` takes no options.
pub(crate) fn without_help_of_help(words: &[String]) -> Option<Vec<String>> {
    let asks = |word: &String| ["-h", "--help"].contains(&word.as_str());
    let place = words.iter().position(|word| word == "help")?;
    let rest = words.iter().enumerate().filter(|(other, _)| *other != place).map(|(_, word)| word.clone());
    words.iter().any(asks).then(|| rest.collect())
}

/// Options of all commands, left out of the help of each: `hide` would keep them from completion too.
fn only_in_help_options(arg: Arg, common: &[Arg]) -> Arg {
    let is_common = common.iter().any(|its| its.get_id() == arg.get_id());
    if is_common { arg.hide_short_help(true).hide_long_help(true) } else { arg }
}

fn with_shown(command: Command, common: &[Arg]) -> Command {
    command.args(common.iter().cloned()).help_template("{about-with-newline}\n{options}\n\n{after-help}")
}

/// Adds the line that names the common options that a command heeds, and to its own commands.
fn pointing_to_common(command: Command, common: &[Arg]) -> Command {
    let heeded = |arg: &&Arg| !command.get_arguments().any(|own| own.get_id() == arg.get_id() && own.is_hide_set());
    let names = common.iter().filter(heeded).filter_map(|arg| Some(format!("--{}", arg.get_long()?)));
    let names = names.collect::<Vec<_>>().join(" ");
    add_line(command, &format!("Common options, described by `ferrodrive help options`:\n  {names}"), common)
}

fn add_line(command: Command, line: &str, common: &[Arg]) -> Command {
    let below = |text: Option<&clap::builder::StyledStr>| text.map(|text| format!("{line}\n\n{}", text.ansi()));
    let (short, long) = (below(command.get_after_help()), below(command.get_after_long_help()));
    let command = command.after_help(short.unwrap_or_else(|| line.to_owned()));
    let command = match long {
        Some(long) => command.after_long_help(long),
        None => command,
    };
    command.mut_args(|arg| only_in_help_options(arg, common)).mut_subcommands(|its| add_line(its, line, common))
}

/// The groups, with a line for each command or its name alone.
fn overview(command: &Command, described: bool) -> String {
    let header = command.get_styles().get_header();
    let groups = GROUPS.iter().map(|CommandGroup { title, commands }| {
        let lines = if described {
            commands.iter().map(|name| format!("  {name:<12} {}", about(command, name))).collect::<Vec<_>>().join("\n")
        } else {
            in_lines(commands)
        };
        format!("{header}{title}:{header:#}\n{lines}")
    });
    let groups: Vec<_> = groups.collect();
    let help = if described { "" } else { "ferrodrive --help            what each command does\n" };
    format!(
        "{}\n\n{help}ferrodrive COMMAND -h        arguments and examples of a command\n\
         ferrodrive help options      options of every command: --bus, --json, --machine and others\n\n{EXAMPLES}",
        groups.join(if described { "\n\n" } else { "\n" })
    )
}

/// Names in lines that fit into any terminal.
fn in_lines(names: &[&str]) -> String {
    const WIDTH: usize = 76;
    let mut lines: Vec<String> = Vec::new();
    for name in names {
        match lines.last_mut().filter(|line| line.len() + name.len() < WIDTH) {
            Some(line) => *line = format!("{line}  {name}"),
            None => lines.push(format!("  {name}")),
        }
    }
    lines.join("\n")
}

fn about(command: &Command, name: &str) -> String {
    let about = command.find_subcommand(name).and_then(Command::get_about);
    about.map_or_else(|| "Print the help of a command".to_owned(), ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scope::command_line;

    /// A terminal of the usual size shows 40 lines or so without scrolling.
    const SCREEN: usize = 40;

    fn walk(command: &mut Command, path: &str, visit: &mut impl FnMut(&str, &mut Command)) {
        visit(path, command);
        let names: Vec<_> = command.get_subcommands().map(|its| its.get_name().to_owned()).collect();
        for name in names.iter().filter(|name| *name != "help") {
            let its = command.find_subcommand_mut(name).unwrap();
            walk(its, &format!("{path} {name}"), visit);
        }
    }

    #[test]
    fn each_command_is_in_exactly_one_group() {
        let mut grouped: Vec<_> = GROUPS.iter().flat_map(|group| group.commands).copied().collect();
        grouped.sort_unstable();
        let mut command = command_line();
        command.build();
        let mut shown: Vec<_> =
            command.get_subcommands().filter(|its| !its.is_hide_set()).map(|its| its.get_name()).collect();
        shown.sort_unstable();
        assert_eq!(grouped, shown);
    }

    #[test]
    fn the_short_help_of_everything_fits_on_a_screen() {
        let mut command = command_line().term_width(100);
        command.build();
        let mut too_long = Vec::new();
        walk(&mut command, "", &mut |path, its| {
            let text = its.render_help().to_string();
            if text.lines().count() > SCREEN && !path.ends_with(OPTIONS) {
                too_long.push(format!("ferrodrive{path} -h: {} lines\n{text}", text.lines().count()));
            }
        });
        assert!(too_long.is_empty(), "{}", too_long.join("\n\n"));
    }

    /// The words that a shell hands to `ferrodrive` from an example.
    fn words_of(example: &str) -> Vec<String> {
        let mut words = vec![String::new()];
        let mut quoted = false;
        for c in example.chars() {
            match c {
                '\'' => quoted = !quoted,
                ' ' if !quoted => words.push(String::new()),
                c => words.last_mut().unwrap().push(c),
            }
        }
        let ends = |word: &String| ["|", ">", ";"].contains(&word.as_str()) || word.starts_with('#');
        let words: Vec<_> = words.into_iter().filter(|word| !word.is_empty()).collect();
        let from = words.iter().position(|word| word.ends_with("ferrodrive")).unwrap();
        words[from..].iter().take_while(|word| !ends(word)).map(|word| word.trim_end_matches(')').to_owned()).collect()
    }

    /// An example is copied from the help of a terminal of 80 columns: it stands on one line there.
    #[test]
    fn every_command_has_examples_on_one_line_each_that_the_parser_takes() {
        const COLUMNS: usize = 80;
        let line = command_line();
        let mut command = command_line();
        command.build();
        let mut wrong = Vec::new();
        walk(&mut command, "", &mut |path, its| {
            if path.is_empty() || path.ends_with(OPTIONS) {
                return;
            }
            let below = [its.get_after_help(), its.get_after_long_help()].into_iter().flatten();
            let below = below.map(ToString::to_string).collect::<Vec<_>>().join("\n");
            let examples: Vec<&str> = below
                .lines()
                .filter(|line| line.split(' ').any(|word| word.trim_start_matches("<(") == "ferrodrive"))
                .filter(|line| line.starts_with(' ') || line.starts_with("ferrodrive"))
                .collect();
            let mut used = false;
            for example in examples {
                let words = words_of(example);
                let parsed = line.clone().try_get_matches_from(&words);
                if let Err(error) = parsed.as_ref() {
                    wrong.push(format!("{path}: {example}: {error}"));
                }
                if !example.starts_with("  ") || example.chars().count() > COLUMNS {
                    wrong.push(format!("{path}: indented by two, and of {COLUMNS} columns at most: {example}"));
                }
                used |= format!(" {} ", words.join(" ")).contains(&format!("{path} "));
            }
            if !used {
                wrong.push(format!("{path}: no example of it"));
            }
        });
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn options_of_every_command_are_described_in_one_place() {
        let mut command = command_line();
        command.build();
        let names = ["--bus", "--json", "--model", "--machine", "--verbose", "--realtime", "--log", "--timeout"];
        walk(&mut command, "", &mut |path, its| {
            let describes = |text: &str, name: &str| {
                let of_line = |line: &str| {
                    let rest = line.trim_start().trim_start_matches("-v, ").strip_prefix(name).map(str::to_owned);
                    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(" <"))
                };
                text.lines().any(of_line)
            };
            let long = its.render_long_help().to_string();
            let (before, after) = long.split_once("Common options").unwrap_or((&long, ""));
            let long = before.lines().chain(after.lines().skip(2)).collect::<Vec<_>>().join("\n");
            for name in names {
                // `sim` has a --verbose of its own.
                let own = its.get_arguments().any(|arg| arg.get_long() == name.get(2..) && !arg.is_global_set());
                assert_eq!(
                    describes(&long, name),
                    path == " options" || own && describes(&long, name),
                    "{path}: {name}"
                );
            }
        });
    }
}
