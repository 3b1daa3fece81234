//! Options of every command that mean nothing to one of them: typed there they are refused, so that nobody believes that
//! they were heeded. The environment may set them for all commands.

use std::collections::BTreeMap;

use clap::ArgMatches;
use clap::parser::ValueSource;
use transport::BusSpec;

use crate::args::Command;
use crate::command::objects::Whose;
use crate::failure::Failure;
use crate::global::Global;

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

const UNHEEDED: [Unheeded; 13] = [
    Unheeded {
        command: "run",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "a scenario has a machine and a bus of its own",
        next: "leave it away; the scenario's machine may be the path of a machine file",
    },
    Unheeded {
        command: "world",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "it speaks to a running simulator, not to a bus",
        next: "leave it away; --control says where the simulator is",
    },
    Unheeded {
        command: "events",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "it listens to a running simulator, not to a bus",
        next: "leave it away; --control says where the simulator is",
    },
    Unheeded {
        command: "sim",
        options: &[MODEL],
        why: "it makes its drives itself, each of the model that its --drive names",
        next: "give --drive MODEL@NODE, e.g. --drive zlac8030l@4",
    },
    Unheeded {
        command: "sim",
        options: &[TIMEOUT, VERBOSE],
        why: "it asks nobody anything, and waits for no answer",
        next: "leave it away; --record and --log keep the frames, and dump shows them",
    },
    Unheeded {
        command: "demo",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "it shows virtual drives on buses of their own",
        next: "leave it away; --drive MODEL chooses the drive",
    },
    Unheeded {
        command: "dump",
        options: &[TIMEOUT],
        why: "it only listens, and waits for no answer",
        next: "leave it away; --for TIME says how long it listens",
    },
    Unheeded {
        command: "decode",
        options: &[BUS, TIMEOUT],
        why: "it reads a log, and asks nobody anything",
        next: "leave it away",
    },
    Unheeded {
        command: "convert",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, LOG],
        why: "it reads a log and writes another, and looks at no frame",
        next: "leave it away; the second file is the log that is written",
    },
    Unheeded {
        command: "completions",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "a script for a shell depends on none of them",
        next: "leave it away",
    },
    Unheeded {
        command: "eds",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "it is about files, not about a node of a bus",
        next: "leave it away",
    },
    Unheeded {
        command: "check",
        options: &[MODEL, MACHINE],
        why: "the file that is checked says which models are where",
        next: "leave it away",
    },
    Unheeded {
        command: "readings",
        options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
        why: "it is about a model, not about a node of a bus",
        next: "leave it away",
    },
];

const OBJECTS_OF_A_MODEL: Unheeded = Unheeded {
    command: "objects",
    options: &[BUS, MODEL, MACHINE, TIMEOUT, VERBOSE, REALTIME, LOG],
    why: "the objects of a model are the same on every bus",
    next: "leave it away, or give a node-ID in place of the model",
};

const CHECK_OF_A_FILE: Unheeded = Unheeded {
    command: "check",
    options: &[TIMEOUT, VERBOSE, REALTIME, LOG],
    why: "without a bus it reads files, and sends nothing",
    next: "leave it away, or give --bus to have the drives asked that are there",
};

/// Refuses typed options that the command does not heed, and options that contradict each other.
pub(crate) fn refuse_unheeded(global: &Global, command: &Command, matches: &ArgMatches) -> Result<(), Failure> {
    let typed = |option: &str| matches.value_source(option) == Some(ValueSource::CommandLine);
    let own_bus = matches!(global.bus, BusSpec::Sim { .. });
    // The bus that every command has by itself is no contradiction.
    let given = |option: &&&str| typed(option) && (**option != BUS || global.bus != BusSpec::Sim { file: None });
    let of_model = matches!(command, Command::Objects(objects) if matches!(objects.whose, Whose::Model(_)));
    let name = matches.subcommand_name().unwrap_or_default();
    let of_file = matches!(command, Command::Check(_)) && global.bus == BusSpec::Sim { file: None };
    let special = of_model.then_some(&OBJECTS_OF_A_MODEL).into_iter().chain(of_file.then_some(&CHECK_OF_A_FILE));
    let rows = UNHEEDED.iter().filter(|row| row.command == name).chain(special);
    for row in rows {
        if let Some(option) = row.options.iter().find(given) {
            return Err(Failure::usage(format!("--{} means nothing to {name}", spelled(option)))
                .because(row.why)
                .next(row.next));
        }
    }
    if typed(MACHINE) && own_bus && name != "sim" {
        return Err(Failure::usage("--machine means nothing on a virtual bus of this command alone")
            .because("such a bus knows its drives")
            .next("give --bus sim:FILE.toml to have the drives of the file on it, or --bus with the bus that it describes"));
    }
    if typed(REALTIME) && own_bus && name != "sim" {
        return Err(Failure::usage("--realtime means nothing on a virtual bus of this command alone")
            .because("its time is that of the simulation, not of the clock")
            .next("give --bus with a real bus, or use it with sim"));
    }
    refuse_two_models(global)
}

/// The option as it is typed.
fn spelled(option: &str) -> &str {
    if option == MODEL { "model" } else { option }
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
