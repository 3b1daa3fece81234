//! A scenario as its file has it. Each key is described in `docs/scenarios.md`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use canopen::NodeId;
use host::group_follow::RecordedPath;
use host::network::params::source;
use sim::Place;

use super::command::Command;
use super::condition::Condition;
use super::entries::{MOST, Many, bounded, entries, expect, figures, host, kept, single, step};
use super::plan::{Act, Base, Expect, Host, HostLine, Measure, Paths, PlannedFigure, ScenarioStep, Sheets};
use crate::sweep::file::{SweepAxis, axes};
use machine::file::Machine;
use sim::Fidelity;
use words::document::reader::{self, Parameters, Table};
use words::document::{BadFile, Located, Problem, read_text};
use words::suggest::{did_you_mean, near};

/// What a scenario may say.
pub const KEYS: &[&str] = &[
    "title",
    "about",
    "machine",
    "seed",
    "limit",
    "end",
    "sample",
    "parameters",
    "sweep",
    "figures",
    "step",
    "host",
    "expect",
];
/// Virtual time after which a run ends in any case, by default.
const LIMIT: Duration = Duration::from_secs(60);

/// How often values are looked at by default, and the shortest interval that may be given.
const SAMPLE: Duration = Duration::from_millis(1);
const SHORTEST_SAMPLE: Duration = Duration::from_micros(10);

/// A machine, what is done to it and by it, and what is expected.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// What it is called.
    pub title: String,
    /// What it shows.
    pub about: String,
    /// The machine.
    pub machine: Machine,
    /// How much of its drives is computed, in place of what its machine says; a drive may have its own.
    pub fidelity: Option<Fidelity>,
    /// The seed of everything random, where it is given.
    pub seed: Option<u64>,
    /// The parameters and their values.
    pub parameters: Parameters,
    /// What a sweep goes through.
    pub sweep: Vec<SweepAxis>,
    pub(super) limit: Duration,
    pub(super) end: Option<Duration>,
    pub(super) sample: Duration,
    pub(super) steps: Vec<ScenarioStep>,
    pub(super) hosts: Vec<Host>,
    pub(super) expects: Vec<Expect>,
    pub(super) figures: Vec<PlannedFigure>,
    text: String,
    /// The text of the machine file that it names; empty where its machine stands in it.
    machine_text: String,
    folder: PathBuf,
    /// The files of parameters that its hosts name.
    pub(super) sheets: Sheets,
    /// The recorded paths that its hosts name.
    pub(super) paths: Paths,
}

impl Scenario {
    /// Its machine, of the fidelity that is asked for.
    pub(crate) fn whole_machine(&self) -> Machine {
        let mut machine = self.machine.clone();
        machine.fidelity = self.fidelity.or(machine.fidelity);
        machine
    }

    /// The names of its figures.
    pub(crate) fn figure_names(&self) -> impl Iterator<Item = &str> {
        self.figures.iter().map(|figure| figure.name.as_str())
    }

    /// Hash over its text and that of the machine file that it names. Data sheets (EDS) of that are not in it.
    pub(crate) fn text_digest(&self) -> u64 {
        // Both texts are UTF-8, which has no byte FFh.
        sim::Digest::of(&[self.text.as_bytes(), &[0xFF], self.machine_text.as_bytes()].concat()).value()
    }

    /// What those of its drives that are not of fidelity full do not show; `None` if there is none.
    pub fn not_shown(&self) -> Option<String> {
        self.whole_machine().not_shown()
    }

    /// The scenario of a file; files that it names are looked for beside it.
    ///
    /// # Errors
    /// That it cannot be read, or everything that is wrong with it.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = read_text(path)?;
        let parsed = Self::parse(&text, path.parent().unwrap_or(Path::new("")));
        parsed.map_err(|bad| bad.named(path.display().to_string()).to_string())
    }

    /// Reads the text of a scenario; files that it names are looked for in `folder`.
    ///
    /// # Errors
    /// Everything that is wrong, with its place and what is expected there.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, BadFile> {
        Self::parse_with(text, folder, &Parameters::new())
    }

    /// The same scenario with other values of some of its parameters. What is given a value is not swept any more.
    ///
    /// # Errors
    /// A name that is not a parameter of it, or what the value breaks.
    pub fn with(&self, values: &Parameters) -> Result<Self, BadFile> {
        let scenario = Self::parse_with(&self.text, &self.folder, values)?;
        Ok(Self { fidelity: self.fidelity, ..scenario })
    }

    fn parse_with(text: &str, folder: &Path, values: &Parameters) -> Result<Self, BadFile> {
        let bad = |problems| BadFile::new(text, problems);
        let mut parameters = reader::read(text, &Parameters::new(), "a scenario", parameters).map_err(bad)?;
        for (name, value) in values {
            if parameters.insert(name.clone(), value.clone()).is_none() {
                let near =
                    did_you_mean(&near(name, parameters.keys().map(String::as_str).filter(|known| known != name)));
                let what = format!("there is no parameter '{name}'{near}; [parameters] gives each a value");
                return Err(bad(vec![Problem::new(0..0, what)]));
            }
        }
        let read = |file: &Table<'_>| Self::from_table(file, text, folder, &parameters);
        let mut scenario = reader::read(text, &parameters, "a scenario", read).map_err(bad)?;
        scenario.sweep.retain(|axis| !values.contains_key(&axis.name));
        Ok(scenario)
    }

    fn from_table(file: &Table<'_>, text: &str, folder: &Path, parameters: &Parameters) -> Many<Self> {
        let mut problems = file.strangers(KEYS);
        let (machine, machine_text) = kept(machine(file, folder), &mut problems).unwrap_or_default();
        let title = file.get("title").map(|field| field.words("a title as text")).transpose().map_err(single);
        let about = file.get("about").map(|field| field.words("a text")).transpose().map_err(single);
        let seed = file.get("seed").map(|field| field.whole("a whole number from 0 on")).transpose().map_err(single);
        let end = file.get("end").map(|field| bounded(&field, Duration::ZERO)).transpose().map_err(single);
        let limit = file.get("limit").map(|field| bounded(&field, Duration::ZERO)).transpose().map_err(single);
        let sample = file.get("sample").map(|field| bounded(&field, SHORTEST_SAMPLE)).transpose().map_err(single);
        let mut scenario = Self {
            title: kept(title, &mut problems).flatten().unwrap_or_else(|| "scenario".into()),
            about: kept(about, &mut problems).flatten().unwrap_or_default(),
            machine,
            fidelity: None,
            seed: kept(seed, &mut problems).flatten(),
            parameters: parameters.clone(),
            sweep: kept(axes(file, parameters), &mut problems).unwrap_or_default(),
            limit: kept(limit, &mut problems).flatten().unwrap_or(LIMIT),
            end: kept(end, &mut problems).flatten(),
            sample: kept(sample, &mut problems).flatten().unwrap_or(SAMPLE),
            steps: entries(file, "step", "a step", &mut problems, |table, _| step(table)),
            hosts: entries(file, "host", "a host", &mut problems, host),
            expects: entries(file, "expect", "an expectation", &mut problems, expect),
            figures: kept(figures(file), &mut problems).unwrap_or_default(),
            text: text.to_owned(),
            machine_text,
            folder: folder.to_owned(),
            sheets: Sheets::new(),
            paths: Paths::new(),
        };
        scenario.limit = scenario.limit.max(scenario.end.unwrap_or_default());
        if problems.is_empty() {
            problems = scenario.check(file);
        }
        if problems.is_empty() {
            problems = scenario.read_sheets(file);
            problems.extend(scenario.read_paths(file));
        }
        if problems.is_empty() { Ok(scenario) } else { Err(problems) }
    }

    /// What fits each other badly: nodes and names that are not there, and too much of it.
    fn check(&self, file: &Table<'_>) -> Vec<Problem> {
        let mut problems = Vec::new();
        let lines: usize = self.hosts.iter().map(|host| host.lines.len()).sum();
        if self.steps.len() + lines + self.expects.len() > MOST {
            let what = format!("it has more than {MOST} steps, lines and expectations");
            problems.push(Problem::new(file.place(), what));
        }
        let names: Vec<&str> = self.names().collect();
        let mut named = |name: &str, at: &Located| {
            if !names.contains(&name) {
                let near = did_you_mean(&near(name, names.iter().copied()));
                let known = if names.is_empty() { "none has a name".into() } else { names.join(", ") };
                problems.push(placed(
                    at,
                    file.text(),
                    format!("there is no step or host '{name}'{near}; there is: {known}"),
                ));
            }
        };
        for base in self.steps.iter().map(|step| &step.base).chain(self.expects.iter().map(|expect| &expect.from)) {
            if let Base::After(name, at) = base {
                named(name, at);
            }
        }
        for (condition, at) in self.conditions() {
            let mut places = Vec::new();
            condition.names(&mut |place| places.push(place), &mut |name| named(name, at));
            let strange = places.iter().find(|place| !self.has_node(place.node));
            if let Some(place) = strange {
                problems.push(placed(at, file.text(), self.no_such(*place)));
                break;
            }
        }
        for step in &self.steps {
            let strange = step.acts.iter().find_map(|act| match act {
                Act::World(place, _) if !self.has_node(place.node) => Some(self.no_such(*place)),
                Act::Body(name, _) if !self.machine.has_body(name) => Some(self.no_such_body(name)),
                _ => None,
            });
            problems.extend(strange.map(|reason| placed(&step.place, file.text(), reason)));
        }
        problems.extend(self.check_hosts(file));
        if problems.is_empty() {
            problems = self.check_bodies(file);
        }
        problems
    }

    /// Moves of axes that are not there, or not in one group; a base that is not there, or cannot do it; nodes that are not there.
    fn check_hosts(&self, file: &Table<'_>) -> Vec<Problem> {
        let stranger = |nodes: &[NodeId]| {
            let node = nodes.iter().find(|node| !self.has_node(node.raw()))?;
            Some(self.no_such(Place::node(node.raw())))
        };
        let problem = |line: &HostLine| {
            let what = match &line.command {
                Command::Group(asked) => match asked.axes(Some(&self.machine)) {
                    Err(failure) => Some(failure.one_line()),
                    Ok((nodes, _)) => stranger(&nodes),
                },
                Command::Base(asked) => match &self.machine.base {
                    None => Some("the machine has no [base]: give it one (docs/machine-file.md)".to_owned()),
                    Some(plan) => asked.check(plan, &plan.limits).err().map(|failure| failure.one_line()),
                },
                Command::Boot(options) => stranger(&options.nodes),
                // What is moved has to be known; a line that is to fail may ask a node that is not there.
                Command::Drive(place, _)
                | Command::Capture(place, _)
                | Command::TestMotion(place, _)
                | Command::Tune(place, _)
                    if line.wanted.fails.is_none() && !self.has_node(place.node) =>
                {
                    Some(self.no_such(*place))
                }
                Command::Parameters(node, ..) => stranger(&[*node]),
                _ => None,
            };
            Some(placed(&line.place, file.text(), what?))
        };
        self.hosts.iter().flat_map(|host| &host.lines).filter_map(problem).collect()
    }

    /// Reads the files of parameters that hosts name, beside the scenario. A node of the machine is behind each of these names.
    fn read_sheets(&mut self, file: &Table<'_>) -> Vec<Problem> {
        let mut problems = Vec::new();
        for line in self.hosts.iter().flat_map(|host| &host.lines) {
            let Command::Parameters(node, _, named) = &line.command else { continue };
            let model = self.machine.models().find(|(known, _)| known == node).map(|(_, model)| model);
            let read = match named {
                Some(path) => source::read(&self.folder.join(path), model, Some(*node)),
                None => source::of_machine(&self.machine, *node).map(|(parameters, _)| parameters),
            };
            match read {
                Ok(parameters) => drop(self.sheets.insert((*node, named.clone()), parameters)),
                Err(failure) => {
                    let reasons = std::iter::once(&failure.what).chain(&failure.because);
                    let what = reasons.map(String::as_str).collect::<Vec<_>>().join(": ");
                    problems.push(placed(&line.place, file.text(), what));
                }
            }
        }
        problems
    }

    /// Reads the paths that hosts name, beside the scenario, and looks whether their axes are there and of one group.
    fn read_paths(&mut self, file: &Table<'_>) -> Vec<Problem> {
        let mut problems = Vec::new();
        for line in self.hosts.iter().flat_map(|host| &host.lines) {
            let Command::Follow(asked) = &line.command else { continue };
            let path = RecordedPath::read(&self.folder.join(&asked.file));
            let nodes = path.and_then(|path| {
                self.paths.insert(asked.file.clone(), path.clone());
                asked.of(path).axes(Some(&self.machine)).map(|(nodes, _)| nodes)
            });
            let what = match nodes {
                Err(failure) => {
                    std::iter::once(&failure.what).chain(&failure.because).cloned().collect::<Vec<_>>().join(": ")
                }
                Ok(nodes) => match nodes.iter().find(|node| !self.has_node(node.raw())) {
                    Some(node) => self.no_such(Place::node(node.raw())),
                    None => continue,
                },
            };
            problems.push(placed(&line.place, file.text(), what));
        }
        problems
    }

    /// Bodies that are not there, and numbers that they do not have. Only a world knows which these are.
    fn check_bodies(&self, file: &Table<'_>) -> Vec<Problem> {
        let mut spoken_of = Vec::new();
        for (condition, at) in self.conditions() {
            condition.bodies(&mut |name, signal| spoken_of.push((name, signal, at)));
        }
        let figures = self.figures.iter().filter_map(|figure| match &figure.of {
            Measure::Body(_, name, signal) => Some((name.as_str(), signal.as_str(), &figure.place)),
            _ => None,
        });
        spoken_of.extend(figures);
        // What is wrong with a machine that cannot be built is reported when it is built to run.
        let Some(mut world) = (!spoken_of.is_empty()).then(|| self.machine.build().ok()).flatten() else {
            return Vec::new();
        };
        let problem = |(name, signal, at): (&str, &str, &Located)| {
            let what = match world.body(name) {
                None => self.no_such_body(name),
                Some(body) => {
                    let known: Vec<_> = body.kind.signals().into_iter().map(|(name, _)| name).collect();
                    if known.iter().any(|known| known == signal) {
                        return None;
                    }
                    let near = did_you_mean(&near(signal, known.iter().map(String::as_str)));
                    format!("the body '{name}' has no '{signal}'{near}; it has: {}", known.join(", "))
                }
            };
            Some(placed(at, file.text(), what))
        };
        spoken_of.into_iter().filter_map(problem).collect()
    }

    fn has_node(&self, node: u8) -> bool {
        self.machine.drives.iter().any(|drive| drive.spec.node.raw() == node)
    }

    fn no_such_body(&self, name: &str) -> String {
        let known: Vec<_> = self.machine.body_names().collect();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        format!("the machine has no body {name:?}; it has: {known}")
    }

    fn no_such(&self, place: Place) -> String {
        let known: Vec<_> = self.machine.drives.iter().map(|drive| drive.spec.node.to_string()).collect();
        format!("the machine has no node {}; it has: {}", place.node, known.join(", "))
    }

    /// Every condition of it, and where it stands.
    fn conditions(&self) -> impl Iterator<Item = (&Condition, &Located)> {
        let steps = self.steps.iter().filter_map(|step| step.when.as_ref().map(|when| (&when.condition, &when.place)));
        let lines = self.hosts.iter().flat_map(|host| &host.lines).filter_map(|line| match &line.command {
            Command::WaitFor(condition, _) => Some((condition, &line.place)),
            _ => None,
        });
        steps.chain(lines).chain(self.expects.iter().map(|expect| (&expect.condition, &expect.place)))
    }

    /// Whether it waits for events that only a watched world reports.
    pub(super) fn needs_events(&self) -> bool {
        self.conditions().any(|(condition, _)| condition.needs_events())
    }

    /// Whether it has hosts of its own.
    pub fn has_hosts(&self) -> bool {
        !self.hosts.is_empty()
    }

    /// The names of steps and hosts, which `after` and `done` may give.
    fn names(&self) -> impl Iterator<Item = &str> {
        let steps = self.steps.iter().filter_map(|step| step.name.as_deref());
        steps.chain(self.hosts.iter().map(|host| host.name.as_str()))
    }
}

/// A problem at a place that is known by its line already.
fn placed(at: &Located, text: &str, what: String) -> Problem {
    let begin: usize = text.split_inclusive('\n').take(at.line - 1).map(str::len).sum();
    let skipped: usize = text[begin..].chars().take(at.column - 1).map(char::len_utf8).sum();
    let width: usize = text[begin + skipped..].chars().take(at.width).map(char::len_utf8).sum();
    Problem::new(begin + skipped..begin + skipped + width, what)
}

/// The machine, written here or in a file of its own.
fn machine(file: &Table<'_>, folder: &Path) -> Many<(Machine, String)> {
    const EXPECTED: &str = "a machine: [machine] with [[machine.drive]], or the path of a machine file";
    let field = file.need("machine", EXPECTED).map_err(single)?;
    if field.is_table() {
        let machine = Machine::from_table(&field.table("a machine", EXPECTED).map_err(single)?, folder)?;
        return Ok((machine, String::new()));
    }
    let path = folder.join(field.words(EXPECTED).map_err(single)?);
    let unusable =
        |reason: String| vec![field.problem(format!("the machine file {} cannot be used:\n{reason}", path.display()))];
    machine::file::read_with_text(&path).map_err(unusable)
}

/// The parameters and their values, in the words that they are put into texts with.
fn parameters(file: &Table<'_>) -> Many<Parameters> {
    const EXPECTED: &str = "a table of names and values, e.g. [parameters] torque = 0.5";
    let Some(field) = file.get("parameters") else { return Ok(Parameters::new()) };
    let table = field.table("the parameters", EXPECTED).map_err(single)?;
    let values = table.fields().map(|field| {
        let value = crate::sweep::file::value(&field).map_err(single)?;
        Ok((field.name().to_owned(), value))
    });
    values.collect()
}
