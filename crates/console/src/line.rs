//! Lines of the console of a page: read by the parser of the command line, carried out by a host, so that whatever stops a motion
//! there stops these too.

use std::cell::RefCell;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser};
use host::command::{NewValue, ParameterChange, PdoCommand};
use host::console::{Hands, Order, Said, Work};
use host::{Command as Asked, NodeCommand};
use master::explain::Overheard;
use plot::Paint;
use words::plain;

use crate::command::emcy::ShowErrors;
use crate::command::object::ObjectReport;
use crate::command::objects::Objects;
use crate::command::params::{DiffNodes, ShowParameters, text_of_differences, text_of_parameters};
use crate::command::pdo::ShowPdos;
use crate::command::read::Read;
use crate::command::{Command, CommandEffect};
use crate::context::{Context, Holding, Others, Shell, Stated};
use crate::failure::Failure;
use crate::guard::GuardArgs;

/// How often a line that listens looks at the frames that have come: a full bus has some 10 000 in that time.
const OVERHEARING: Duration = Duration::from_secs(1);

/// CANopen motor drives: look into them, move them.
#[derive(Debug, Parser)]
#[command(
    name = "ferrodrive",
    no_binary_name = true,
    disable_version_flag = true,
    override_usage = "COMMAND [OPTIONS]; help COMMAND describes one"
)]
struct CommandLine {
    #[command(subcommand)]
    command: LineCommand,
}

/// What a line asks for.
#[derive(Debug, clap::Subcommand)]
enum LineCommand {
    // Of the command line this one writes files too.
    Read(Read),
    Objects(Objects),
    /// Show the errors that a node remembers
    #[command(subcommand)]
    Emcy(EmcyLine),
    /// Show how the PDOs of a node are set up
    #[command(subcommand)]
    Pdo(PdoLine),
    /// Show all parameters of a node, or the differences between two
    #[command(subcommand)]
    Params(ParamsLine),
    #[command(flatten)]
    OnBus(Command),
}

/// What a page does not show as it comes, in a view of its own.
#[derive(Debug, clap::Subcommand)]
enum EmcyLine {
    Show(ShowErrors),
}

#[derive(Debug, clap::Subcommand)]
enum PdoLine {
    Show(ShowPdos),
}

/// What needs no file.
#[derive(Debug, clap::Subcommand)]
enum ParamsLine {
    Backup(ShowParameters),
    Diff(DiffNodes),
}

/// Reads lines for a host.
#[derive(Clone, Copy, Debug, Default)]
pub struct Reader;

impl host::console::Reader for Reader {
    fn read(&self, line: &str) -> Result<Order, Said> {
        let words = words_of(line).map_err(Said::senseless)?;
        // As a line is copied from the manual.
        let words = words.strip_prefix(&["ferrodrive".to_owned()][..]).unwrap_or(&words);
        let matches = parser().try_get_matches_from(words).map_err(|error| match words {
            [word, more @ ..] if error.kind() == ErrorKind::InvalidSubcommand => {
                let of_two = more.first().and_then(|part| elsewhere(&format!("{word} {part}")));
                of_two.or_else(|| elsewhere(word)).unwrap_or_else(|| said(&error))
            }
            _ => said(&error),
        })?;
        let CommandLine { command } = CommandLine::from_arg_matches(&matches).map_err(|error| said(&error))?;
        let effect = match &command {
            LineCommand::OnBus(command) => {
                check(command)?;
                command.effect()
            }
            _ => CommandEffect::None,
        };
        let asked = match effect {
            CommandEffect::None => None,
            CommandEffect::Writes(node, object, value) => {
                let values = vec![NewValue { object, value }];
                let write = ParameterChange::WriteParameters { values, file: None };
                Some(NodeCommand::Change(write).to(node))
            }
            CommandEffect::Stores(node) => Some(NodeCommand::Change(ParameterChange::Store {}).to(node)),
            CommandEffect::Manages(node, command) => Some(NodeCommand::Pdos(PdoCommand::Nmt { command }).to(node)),
            CommandEffect::ManagesMore => {
                let text = "error: a page resets and stops no node by NMT, and commands no two at once\n  next:    nmt NODE start, or nmt NODE pre-operational; the program does the others";
                return Err(Said::senseless(text.to_owned()));
            }
            CommandEffect::OnDrive(node, command) => Some(NodeCommand::from(command).to(node)),
            CommandEffect::OnEveryDrive => {
                let text = "error: a page enables, disables and resets drives one at a time\n  next:    name the node, e.g. enable 4; estop stops all";
                return Err(Said::senseless(text.to_owned()));
            }
            CommandEffect::StopAll => Some(Asked::STOP_ALL),
            CommandEffect::StopAllByRamp => {
                let text = "error: a page does not stop all drives by their ramps\n  next:    estop stops them at once; stop NODE one of them by its ramp";
                return Err(Said::senseless(text.to_owned()));
            }
        };
        let work = |hands: Hands| Box::pin(async move { carry_out(&command, hands).await }) as Work;
        Ok(Order { asked, work: Box::new(work) })
    }
}

/// Whether a page can do it.
fn check(command: &Command) -> Result<(), Said> {
    if let Command::Write(write) = command
        && write.is_from_file()
    {
        let text = "error: a page reads no files\n  next:    give the value, e.g. write 4 6083 600; the Parameters view opens parameter files";
        return Err(Said::senseless(text.to_owned()));
    }
    command.guard().map_or(Ok(()), GuardArgs::check_for_host).map_err(|failure| Said::failed(&failure))
}

/// Commands of the program that a line does not have, and the view of a page that does what they do; none where only a shell does.
const ELSEWHERE: &[(&str, &[&str])] = &[
    ("Drive", &["report"]),
    ("Faults", &["emcy watch"]),
    ("Motion", &["drive-base", "group"]),
    ("PDO", &["pdo apply", "pdo plan", "pdo watch"]),
    ("Parameters", &["dcf", "params apply", "params plan", "params rollback", "params verify"]),
    ("Scope", &["capture", "record", "test-motion", "tune", "watch"]),
    ("Trace", &["dump", "send"]),
    ("World", &["events", "world"]),
    (
        "",
        &[
            "boot",
            "check",
            "completions",
            "conform",
            "convert",
            "decode",
            "demo",
            "eds",
            "export",
            "fmu",
            "gateway",
            "init",
            "latency",
            "lss",
            "man-pages",
            "options",
            "plan",
            "plot",
            "program",
            "readings",
            "replay",
            "restore",
            "run",
            "sim",
            "studio",
            "supervise",
            "sync",
            "time",
            "top",
        ],
    ),
];

/// What is said of a command that the program has and a line has not.
fn elsewhere(word: &str) -> Option<Said> {
    let (view, _) = ELSEWHERE.iter().find(|(_, words)| words.contains(&word))?;
    let next = match *view {
        "" => format!("ferrodrive {word}, in a shell"),
        view => format!("the {view} view does that here; ferrodrive {word}, in a shell"),
    };
    Some(Said::senseless(format!("error: the console of a page has no command '{word}'\n  next:    {next}")))
}

/// Options that a line does not have.
const HIDDEN: [&str; 2] = ["guard", "from"];

/// The parser of the command line; its help names nothing that a line does not have.
fn parser() -> clap::Command {
    CommandLine::command().mut_subcommands(of_a_line)
}

fn of_a_line(command: clap::Command) -> clap::Command {
    let examples = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let is_had = |line: &&str| ![" -v ", " all", "--model ", "--from "].iter().any(|of| line.contains(of));
    let mut lines: Vec<String> = Vec::new();
    for line in examples.lines().filter(is_had) {
        let without = [" --bus can0", " --machine machine.toml", " --json"];
        let line = without.iter().fold(line.to_owned(), |line, of| line.replace(of, ""));
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    let guards = |arg: clap::Arg| {
        if HIDDEN.iter().any(|id| arg.get_id().as_str().ends_with(id)) { arg.hide(true) } else { arg }
    };
    command.after_help(lines.join("\n")).mut_args(guards).mut_subcommands(of_a_line)
}

/// What the parser says: help, or what is wrong with the line.
fn said(error: &clap::Error) -> Said {
    let text = plain(&error.render().to_string());
    let text = text.trim_end().to_owned();
    if error.use_stderr() { Said::senseless(text) } else { Said::done(text) }
}

async fn carry_out(command: &LineCommand, hands: Hands) -> Said {
    let notes = Rc::new(RefCell::new(Vec::new()));
    let context = Context {
        network: hands.network.clone(),
        bus_name: hands.bus.clone(),
        timeout: hands.timeout,
        models: hands.models.iter().map(|(node, model)| (*node, Stated::ByBus(model))).collect(),
        gears: hands.gears.clone(),
        json: false,
        holding: Holding::Host { in_control: hands.in_control },
        shell: Rc::new(Page { hands, notes: Rc::clone(&notes) }),
    };
    let mut printed = Vec::new();
    let failure = match command {
        LineCommand::Read(read) => {
            let show = |report: &ObjectReport| {
                printed.push(report.text(Paint::OFF));
                Ok(())
            };
            read.run(&context, show).await.err()
        }
        LineCommand::Objects(objects) => text_of(objects.text(&context, Paint::OFF).await, &mut printed),
        LineCommand::Emcy(EmcyLine::Show(show)) => {
            text_of(show.run(&context).await.map(|errors| errors.text(Paint::OFF)), &mut printed)
        }
        LineCommand::Pdo(PdoLine::Show(show)) => {
            text_of(show.run(&context).await.map(|pdos| pdos.text(Paint::OFF)), &mut printed)
        }
        LineCommand::Params(ParamsLine::Backup(show)) => {
            text_of(show.run(&context).await.map(|report| text_of_parameters(&report).to_owned()), &mut printed)
        }
        LineCommand::Params(ParamsLine::Diff(diff)) => {
            text_of(diff.run(&context).await.map(|report| text_of_differences(&report, Paint::OFF)), &mut printed)
        }
        LineCommand::OnBus(command) => match command.run(&context).await {
            Ok(outcome) => {
                printed.push(outcome.text(Paint::OFF));
                outcome.failure()
            }
            Err(failure) => Some(failure),
        },
    };
    let said = failure.map_or_else(|| Said::done(String::new()), |failure| Said::failed(&of_a_page(failure.reason)));
    let complaint = said.trouble.is_some().then(|| said.text.clone());
    let lines: Vec<String> = notes.take().into_iter().chain(printed).chain(complaint).collect();
    Said { text: lines.join("\n"), ..said }
}

/// Takes what is printed, or gives why there is nothing.
fn text_of(text: Result<String, Failure>, printed: &mut Vec<String>) -> Option<Failure> {
    text.map(|text| printed.push(text)).err()
}

/// A failure whose advice is for people who type into a page.
fn of_a_page(mut failure: words::failure::Failure) -> words::failure::Failure {
    failure.next.iter_mut().for_each(|advice| *advice = advice_of_a_page(advice));
    failure
}

/// A model is named where the host of the page is started, not in a line.
fn advice_of_a_page(advice: &str) -> String {
    let more = if advice.contains("--model ") { ", where the host of this page is started" } else { "" };
    format!("{advice}{more}")
}

/// The words of a line, as a shell would have them: quotes keep a word together.
fn words_of(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for sign in line.chars() {
        match (quote, sign) {
            (Some(open), sign) if sign == open => quote = None,
            (None, '\'' | '"') => {
                quote = Some(sign);
                word.get_or_insert_default();
            }
            (None, sign) if sign.is_whitespace() => words.extend(word.take()),
            (_, sign) => word.get_or_insert_default().push(sign),
        }
    }
    if let Some(open) = quote {
        return Err(format!("error: a quotation mark is left open: {open}\n  next:    close it"));
    }
    words.extend(word);
    Ok(words)
}

/// A page: what is noted comes before what is reported, and what is going on meanwhile is not shown.
struct Page {
    hands: Hands,
    notes: Rc<RefCell<Vec<String>>>,
}

impl Shell for Page {
    fn show(&self, _: String) {}

    fn is_shown(&self) -> bool {
        false
    }

    fn note(&self, text: &str) {
        self.notes.borrow_mut().push(format!("note: {}", plain(&advice_of_a_page(text))));
    }

    fn is_new(&self, _: &str) -> bool {
        true
    }

    fn others(&self) -> Others {
        let trace = Arc::clone(&self.hands.trace);
        let mut number = trace.next();
        Box::new(move |counted, decoder| {
            number = trace.others_from(number, |passed| counted.note(decoder, &passed.frame));
        })
    }

    fn overhear(&self, time: Duration) -> Pin<Box<dyn Future<Output = Overheard> + '_>> {
        Box::pin(async move {
            let network = &self.hands.network;
            let began = network.now();
            let (mut heard, mut number) = (Overheard::from(began), self.hands.trace.next());
            // The trace keeps the newest frames alone; those of the host itself, which reads the drives meanwhile, tell nothing.
            while network.now() - began < time {
                network.sleep(OVERHEARING.min(time - (network.now() - began))).await;
                number = self.hands.trace.others_from(number, |passed| {
                    if passed.at >= began {
                        heard.note(&passed.frame, passed.at);
                    }
                });
            }
            heard.until(network.now());
            heard
        })
    }
}

#[cfg(test)]
mod tests {
    use super::words_of;

    #[test]
    fn a_line_has_the_words_that_a_shell_would_make_of_it() {
        let words = |line: &str| words_of(line).map(|words| words.join("|"));
        assert_eq!(words("  move 4\t90deg "), Ok("move|4|90deg".into()));
        assert_eq!(words("write 4 6060 'profile velocity'"), Ok("write|4|6060|profile velocity".into()));
        assert_eq!(words("write 4 1008 \"a 'b'\"c ''"), Ok("write|4|1008|a 'b'c|".into()));
        assert_eq!(words(""), Ok(String::new()));
        assert!(words("write 4 1008 'left").is_err_and(|why| why.contains("left open: '")));
    }
}
