//! What a shell completes beside commands and options: buses, nodes, models, objects and modes. The script of `ferrodrive completions`
//! has the shell ask this program, with the line as it stands.

use std::ffi::OsStr;

use canopen::NodeId;
use canopen::od::Entry;
use clap::{Arg, ArgMatches, Command, CommandFactory};
use clap_complete::engine::{ArgValueCompleter, CompletionCandidate};
use sim::machine::models as all_models;

use words::drive::node_model;
use words::mode::ABBREVIATIONS;
use words::models::{self, Description};

use crate::args::Cli;
use crate::remembered::Remembered;

type Completer = fn(&TypedLine, &str) -> Vec<CompletionCandidate>;

/// By the names that help gives to values.
const COMPLETERS: [(&str, Completer); 12] = [
    ("BUS", buses),
    ("NODE", nodes),
    ("NODES", nodes),
    ("NODE|all", nodes),
    ("NODE=MODEL", models_of_nodes),
    ("MODEL", models),
    ("FILE|MODEL", models),
    ("MODEL|FILE.eds|NODE", models_and_nodes),
    ("MODEL@NODE[,KEY=VALUE..]", models),
    ("OBJECT", objects),
    ("OBJECTS", objects),
    ("[NODE=]MODE", modes),
];

/// The command line with what completes its values.
pub(crate) fn with_values(command: Command) -> Command {
    command.mut_args(with_completer).mut_subcommands(with_values)
}

fn with_completer(arg: Arg) -> Arg {
    let name = arg.get_value_names().and_then(|names| names.first()).map(|name| name.to_string()).unwrap_or_default();
    match COMPLETERS.iter().find(|(known, _)| *known == name) {
        Some((_, completer)) => {
            let complete = |current: &OsStr| {
                let current = current.to_string_lossy();
                let all = completer(&TypedLine::typed(), &current);
                all.into_iter().filter(|one| one.get_value().to_string_lossy().starts_with(&*current)).collect()
            };
            arg.add(ArgValueCompleter::new(complete))
        }
        None => arg,
    }
}

/// The line that is being typed.
struct TypedLine {
    words: Vec<String>,
}

impl TypedLine {
    /// The engine hands the words to this program behind `--`; the first is its name.
    fn typed() -> Self {
        let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
        Self { words: words.skip_while(|word| word != "--").skip(2).collect() }
    }

    /// The values of an option, in either spelling.
    fn values<'a>(&'a self, option: &'a str) -> impl Iterator<Item = &'a str> {
        self.words.iter().enumerate().filter_map(move |(place, word)| match word.strip_prefix(option)? {
            "" => self.words.get(place + 1).map(String::as_str),
            rest => rest.strip_prefix('='),
        })
    }

    fn bus(&self) -> String {
        let given = self.values("--bus").last().map(str::to_owned);
        let of_environment = || std::env::var("FERRODRIVE_BUS").ok().filter(|bus| !bus.is_empty());
        given.or_else(of_environment).unwrap_or_else(|| "sim".to_owned())
    }

    /// The node that the command is about, as far as the line says it yet.
    fn node(&self) -> Option<NodeId> {
        let command = Cli::command().ignore_errors(true);
        let words = std::iter::once("ferrodrive").chain(self.words.iter().map(String::as_str));
        node_of(&command, &command.clone().try_get_matches_from(words).ok()?)
    }

    /// What is known of the nodes: from --model, of the machine, of an own bus, or from earlier calls.
    fn nodes(&self) -> Vec<(u8, Option<&'static Description>)> {
        let bus = self.bus();
        let stated = self.values("--model").filter_map(|text| node_model(text).ok());
        let machine =
            self.values("--machine").last().map(str::to_owned).or_else(|| std::env::var("FERRODRIVE_MACHINE").ok());
        let machine = bus.strip_prefix("sim:").map(str::to_owned).or(machine.filter(|_| bus != "sim"));
        let of_machine = machine.and_then(|path| machine::file::machine(&path).ok());
        let of_machine = of_machine.iter().flat_map(machine::file::Machine::models);
        let own = models::embedded().into_iter().filter(|_| bus == "sim");
        let stated = stated.chain(of_machine).chain(own).map(|(node, model)| (node.raw(), Some(model)));
        let remembered = Remembered::for_completion();
        let earlier = remembered.nodes(&bus).map(|(node, model)| (node, model.and_then(named)));
        let mut all: Vec<_> = stated.chain(earlier).collect();
        all.sort_by_key(|(node, model)| (*node, model.is_none()));
        all.dedup_by_key(|(node, _)| *node);
        all
    }
}

/// The first number among the values that help calls a node, of this command or the one below it.
fn node_of(command: &Command, matches: &ArgMatches) -> Option<NodeId> {
    if let Some((name, below)) = matches.subcommand() {
        return node_of(command.find_subcommand(name)?, below);
    }
    let is_node =
        |arg: &&Arg| arg.get_value_names().is_some_and(|names| names.iter().any(|name| name.starts_with("NODE")));
    let values =
        command.get_arguments().filter(is_node).filter_map(|arg| matches.try_get_raw(arg.get_id().as_str()).ok()?);
    let number = |value: &OsStr| NodeId::new(value.to_str()?.parse().ok()?);
    values.flatten().find_map(number)
}

/// A model that is not in a file.
fn named(name: &str) -> Option<&'static Description> {
    all_models().find(|model| model.name == name)
}

fn candidate(value: impl Into<String>, help: impl Into<String>) -> CompletionCandidate {
    CompletionCandidate::new(value.into()).help(Some(help.into().into()))
}

fn buses(_: &TypedLine, _: &str) -> Vec<CompletionCandidate> {
    let of_machine =
        transport::can_interfaces().into_iter().map(|name| candidate(name, "CAN interface of this machine"));
    let remembered = Remembered::for_completion();
    let used = remembered.buses().map(|bus| candidate(bus, "used before"));
    let mut all: Vec<_> = of_machine.chain(used).collect();
    all.push(candidate("sim", "a virtual bus of this command alone"));
    let mut seen = std::collections::BTreeSet::new();
    all.retain(|one| seen.insert(one.get_value().to_owned()));
    all
}

fn nodes(line: &TypedLine, _: &str) -> Vec<CompletionCandidate> {
    let title = |model: Option<&Description>| model.map_or("heard before", |model| model.name).to_owned();
    line.nodes().into_iter().map(|(node, model)| candidate(node.to_string(), title(model))).collect()
}

fn models(_: &TypedLine, _: &str) -> Vec<CompletionCandidate> {
    all_models().map(|model| candidate(model.name, model.title)).collect()
}

fn models_and_nodes(line: &TypedLine, current: &str) -> Vec<CompletionCandidate> {
    models(line, current).into_iter().chain(nodes(line, current)).collect()
}

fn models_of_nodes(line: &TypedLine, _: &str) -> Vec<CompletionCandidate> {
    let of_node = |node: u8| all_models().map(move |model| candidate(format!("{node}={}", model.name), model.title));
    line.nodes().into_iter().flat_map(|(node, _)| of_node(node)).collect()
}

/// Names; indices where a digit is typed.
fn objects(line: &TypedLine, current: &str) -> Vec<CompletionCandidate> {
    let node = line.node().map(NodeId::raw);
    let model = line.nodes().into_iter().find(|(known, _)| Some(*known) == node).and_then(|(_, model)| model);
    // A node of which nothing is known may have what CiA 301 and 402 have.
    let Some(model) = model.or_else(|| named("cia402")) else { return Vec::new() };
    let by_number = current.starts_with(|first: char| first.is_ascii_digit());
    let one = |row: &Entry| {
        let mux = row.mux();
        match by_number {
            true if mux.sub_index == 0 => candidate(format!("{:04X}", mux.index), row.name),
            true => candidate(format!("{mux:X}"), row.name),
            false => candidate(row.name, mux.to_string()),
        }
    };
    model.dictionary.rows().iter().map(one).collect()
}

fn modes(_: &TypedLine, _: &str) -> Vec<CompletionCandidate> {
    ABBREVIATIONS.iter().map(|(short, mode)| candidate(*short, mode.name().unwrap_or_default())).collect()
}
