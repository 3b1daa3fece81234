//! Options of every command that have no effect on one of them: its help does not show them, and typed there they are refused, so
//! that no option is silently ignored. The environment may set them for all commands.

use std::collections::BTreeMap;

use clap::builder::Resettable;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory};
use transport::BusSpec;

use crate::args::{Cli, Command};
use crate::failure::Failure;
use crate::global::Global;
use crate::help;
use console::command::objects::Whose;

/// Options that a command does not heed, by their names in the parser, and why.
struct Unheeded {
    command: &'static str,
    options: &'static [&'static str],
    why: &'static str,
    next: &'static str,
}

const BUS: &str = "bus";
const MODEL: &str = "models";
const MACHINE: &str = "machine";
const TIMEOUT: &str = "timeout";
const VERBOSE: &str = "verbose";
const REALTIME: &str = "realtime";
const LOG: &str = "log";
const SDO_SERVER: &str = "sdo_servers";
const SYNC_COUNTER: &str = "sync_counter";
const JSON: &str = "json";

const ALL: &[&str] = &[BUS, MODEL, SDO_SERVER, SYNC_COUNTER, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG];

const UNHEEDED: [Unheeded; 19] = [
    Unheeded {
        command: "run",
        options: ALL,
        why: "a scenario has a machine and a bus of its own",
        next: "omit it; the scenario's machine may be the path of a machine file",
    },
    Unheeded {
        command: "world",
        options: ALL,
        why: "it talks to a running simulator, not to a bus",
        next: "omit it; --control names the simulator",
    },
    Unheeded {
        command: "events",
        options: ALL,
        why: "it listens to a running simulator, not to a bus",
        next: "omit it; --control names the simulator",
    },
    Unheeded {
        command: "sim",
        options: &[MODEL],
        why: "it creates its drives itself, each of the model that --drive names",
        next: "give --drive MODEL@NODE, e.g. --drive zlac8030l@4",
    },
    Unheeded {
        command: "sim",
        options: &[TIMEOUT, SDO_SERVER, SYNC_COUNTER],
        why: "it sends no requests and no SYNC, and waits for no answer",
        next: "omit it",
    },
    Unheeded {
        command: "demo",
        options: ALL,
        why: "it shows virtual drives on buses of their own",
        next: "omit it; --drive MODEL chooses the drive",
    },
    Unheeded {
        command: "dump",
        options: &[TIMEOUT, VERBOSE, SDO_SERVER, SYNC_COUNTER],
        why: "it only listens, waits for no answer, and shows every frame that it hears",
        next: "omit it; --for TIME says how long it listens",
    },
    Unheeded {
        command: "decode",
        options: &[BUS, TIMEOUT, VERBOSE, REALTIME, SDO_SERVER, SYNC_COUNTER],
        why: "it reads a log, and sends no requests",
        next: "omit it",
    },
    Unheeded {
        command: "convert",
        options: ALL,
        why: "it reads a log and writes another, and looks at no frame",
        next: "omit it; the second file is the log that is written",
    },
    Unheeded {
        command: "plot",
        options: &[BUS, TIMEOUT, VERBOSE, REALTIME, LOG, SDO_SERVER, SYNC_COUNTER],
        why: "it draws a file; of a log, --model and --machine name the models",
        next: "omit it",
    },
    Unheeded { command: "fmu", options: ALL, why: "it packs a file, and asks no bus", next: "omit it" },
    Unheeded { command: "man-pages", options: ALL, why: "a manual page depends on none of them", next: "omit it" },
    Unheeded {
        command: "completions",
        options: ALL,
        why: "a script for a shell depends on none of them",
        next: "omit it",
    },
    Unheeded {
        command: "top",
        options: &[JSON],
        why: "it draws on a terminal and has no JSON output",
        next: "ferrodrive watch NODE OBJECT .. --json prints what changes, a line each; ferrodrive studio serves /api/state",
    },
    Unheeded { command: "completions", options: &[JSON], why: "what it prints is a script", next: "omit it" },
    Unheeded { command: "man-pages", options: &[JSON], why: "it writes files, and prints nothing", next: "omit it" },
    Unheeded { command: "eds", options: ALL, why: "it is about files, not about a node of a bus", next: "omit it" },
    Unheeded {
        command: "check",
        options: &[MODEL],
        why: "the file that is checked says which models are where",
        next: "omit it",
    },
    Unheeded {
        command: "readings",
        options: ALL,
        why: "it is about a model, not about a node of a bus",
        next: "omit it",
    },
];

const OBJECTS_OF_A_MODEL: Unheeded = Unheeded {
    command: "objects",
    options: ALL,
    why: "the objects of a model are the same on every bus",
    next: "omit it, or give a node-ID in place of the model",
};

const CHECK_OF_A_FILE: Unheeded = Unheeded {
    command: "check",
    options: &[TIMEOUT, VERBOSE, REALTIME, LOG, SDO_SERVER, SYNC_COUNTER],
    why: "without a bus it reads files, and sends nothing",
    next: "omit it, or give --bus to ask the drives on it",
};

const INIT_OF_DRIVES: Unheeded = Unheeded {
    command: "init",
    options: ALL,
    why: "the drives come from --drive, not from the bus",
    next: "omit it, or give --bus in place of --drive",
};

/// The command line as it is parsed and shown.
pub(crate) fn command_line() -> clap::Command {
    without_empty_variables(help::dressed(heeded()))
}

/// An environment variable that is empty counts as one that is not set: `FERRODRIVE_BUS= ferrodrive scan`.
fn without_empty_variables(command: clap::Command) -> clap::Command {
    let is_empty = |name: &std::ffi::OsStr| std::env::var_os(name).is_some_and(|value| value.is_empty());
    let command = command.mut_args(|argument| match argument.get_env().is_some_and(is_empty) {
        true => argument.env(Resettable::Reset),
        false => argument,
    });
    command.mut_subcommands(without_empty_variables)
}

/// The command line with, of each command, the options that it heeds.
pub(crate) fn heeded() -> clap::Command {
    let mut command = Cli::command();
    for row in UNHEEDED {
        for option in row.options {
            // As the parser hands it down to every command, but not shown.
            let handed_down = command.get_arguments().find(|argument| argument.get_id() == *option).cloned();
            let hidden = handed_down.map(|argument| argument.hide(true));
            command = command.mut_subcommand(row.command, |its| its.args(hidden));
        }
    }
    command
}

/// Whether a machine file has an effect on a command.
pub(crate) fn heeds_machine(command: &str) -> bool {
    !UNHEEDED.iter().any(|row| row.command == command && row.options.contains(&MACHINE))
}

/// Refuses typed options that the command does not heed, and options that contradict each other.
pub(crate) fn refuse_unheeded(global: &Global, command: &Command, matches: &ArgMatches) -> Result<(), Failure> {
    let typed = |option: &str| matches.value_source(option) == Some(ValueSource::CommandLine);
    let own_bus = matches!(global.bus, BusSpec::Sim { .. });
    let of_model = matches!(command, Command::Objects(objects) if !matches!(objects.whose, Some(Whose::Node(_))));
    let name = matches.subcommand_name().unwrap_or_default();
    let of_file = matches!(command, Command::Check(_)) && global.bus == BusSpec::Sim { file: None };
    let of_drives = matches!(command, Command::Init(init) if init.is_without_bus());
    // The bus that every command has by itself is not a contradiction, but for one that would look at it.
    let is_own = |option: &str| option == BUS && global.bus == (BusSpec::Sim { file: None }) && !of_drives;
    let given = |option: &&&str| typed(option) && !is_own(option);
    let special = [(of_model, &OBJECTS_OF_A_MODEL), (of_file, &CHECK_OF_A_FILE), (of_drives, &INIT_OF_DRIVES)];
    let special = special.iter().filter_map(|(is_so, row)| is_so.then_some(*row));
    let rows = UNHEEDED.iter().filter(|row| row.command == name).chain(special);
    for row in rows {
        if let Some(option) = row.options.iter().find(given) {
            return Err(Failure::usage(format!("--{} has no effect on {name}", spelled(option)))
                .because(row.why)
                .next(row.next));
        }
    }
    // A command that has no bus is not on one of its own.
    let own_bus =
        own_bus && name != "sim" && !UNHEEDED.iter().any(|row| row.command == name && row.options.contains(&BUS));
    if typed(REALTIME) && own_bus {
        return Err(Failure::usage("--realtime has no effect on a virtual bus of this command alone")
            .because("its time is simulated, and does not follow the clock")
            .next("give --bus with a real bus, or use it with sim"));
    }
    refuse_two_models(global)
}

/// The option as it is typed.
fn spelled(option: &str) -> &str {
    match option {
        MODEL => "model",
        SDO_SERVER => "sdo-server",
        SYNC_COUNTER => "sync-counter",
        other => other,
    }
}

fn refuse_two_models(global: &Global) -> Result<(), Failure> {
    let mut said = BTreeMap::new();
    for (node, model) in &global.models {
        if let Some(other) = said.insert(*node, model.name) {
            return Err(Failure::usage(format!("two models for node {node}: {other} and {}", model.name))
                .because("a node is one drive")
                .next(format!("give one --model {node}=MODEL")));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::FromArgMatches;

    use super::*;
    use crate::tests::lines::{OF_A_MACHINE, OTHERS};

    const REAL_BUS: &str = "socketcand://127.0.0.1:1/can0";

    /// What is typed for each option that every command has.
    fn typed(option: &str) -> Vec<&'static str> {
        let machine = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/machine.toml");
        match option {
            BUS => vec!["--bus", REAL_BUS],
            MODEL => vec!["--model", "4=zlac8030l"],
            MACHINE => vec!["--machine", machine],
            TIMEOUT => vec!["--timeout", "1s"],
            VERBOSE => vec!["--verbose"],
            REALTIME => vec!["--realtime"],
            LOG => vec!["--log", "frames.log"],
            SDO_SERVER => vec!["--sdo-server", "4=2"],
            SYNC_COUNTER => vec!["--sync-counter", "10"],
            JSON => vec!["--json"],
            other => panic!("what is typed for {other}?"),
        }
    }

    /// Whether a line with an option is taken, on this bus.
    fn is_taken(parser: &mut clap::Command, line: &[&str], bus: &[&str], option: &str) -> bool {
        let all = [&["ferrodrive"], bus, line].concat();
        let matches = parser.try_get_matches_from_mut(&all).unwrap_or_else(|e| panic!("{all:?}: {e}"));
        let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| panic!("{all:?}: {e}"));
        let refused = refuse_unheeded(&cli.global, &cli.command, &matches).err();
        let said = refused.as_ref().map(|failure| failure.what.as_str());
        let of_option = format!("--{} has no effect on", spelled(option));
        assert!(said.is_none_or(|said| said.starts_with(&of_option)), "{all:?}: {said:?}");
        said.is_none()
    }

    #[test]
    fn every_option_that_the_help_of_a_command_shows_is_taken_by_it_and_no_other() {
        let mut built = command_line();
        built.build();
        let options: Vec<_> = Cli::command()
            .get_arguments()
            .filter(|argument| argument.is_global_set())
            .map(|argument| argument.get_id().to_string())
            .collect();
        assert_eq!(options.len(), ALL.len() + 1, "{options:?}");
        // Made once: that takes longer than to parse a line.
        let mut parser = command_line();
        for its in built.get_subcommands().filter(|its| !["help", help::OPTIONS].contains(&its.get_name())) {
            let name = its.get_name();
            let line = OF_A_MACHINE.iter().chain(OTHERS).find(|line| line.split(' ').next() == Some(name));
            let line = line.unwrap_or_else(|| panic!("a line of {name} is missing here"));
            let words: Vec<_> = line.split(' ').collect();
            let shows = |option: &str| {
                its.get_arguments().any(|argument| argument.get_id() == option && !argument.is_hide_set())
            };
            for option in &options {
                let bus: &[&str] = if shows(BUS) && option != BUS { &["--bus", REAL_BUS] } else { &[] };
                let typed = typed(option);
                for line in [[&words[..], &typed[..]].concat(), [&typed[..], &words[..]].concat()] {
                    assert_eq!(is_taken(&mut parser, &line, bus, option), shows(option), "{line:?}");
                }
            }
        }
    }
}
