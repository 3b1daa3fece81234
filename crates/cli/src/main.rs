//! `ferrodrive`: CANopen motor drives, virtual and real, on the command line.
//!
//! One file per command under [`command`], with its arguments, help and tests. [`session`] gives a command its network
//! on any bus; what a command returns is printed as text or JSON; what goes wrong is a [`failure::Failure`].

mod args;
mod command;
mod completion;
mod context;
mod control_client;
mod embedded;
mod failure;
mod far_world;
mod frames;
mod global;
mod help;
mod machine_option;
mod output;
mod plain;
mod progress;
mod readings;
mod recording;
mod remembered;
mod scope;
mod senses;
mod served;
mod session;
mod signals;
#[cfg(test)]
mod tests;
mod tips;
mod wire;
mod word_order;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::parser::ValueSource;
use clap::{ArgMatches, FromArgMatches};
use clap_complete::env::CompleteEnv;

use crate::args::{Cli, Command};
use crate::command::network::check::Check;
use crate::command::tools::completions::ASKED_BY;
use crate::context::Context;
use crate::failure::{Failure, FailureReport};
use crate::global::Global;
use crate::output::{Format, Report, print_line};
use crate::plain::{plain, short};
use crate::recording::LogPath;
use crate::scope::command_line;
use console::command::departures::DepartureList;
use console::command::objects::{ModelList, Objects, Whose};
use plot::Paint;

fn main() -> ExitCode {
    // A shell asks for what a line may go on with: answered here, and nothing else is done.
    CompleteEnv::with_factory(|| completion::with_values(command_line())).var(ASKED_BY).complete();
    let parsed = matches().and_then(|matches| {
        let cli = Cli::from_arg_matches(&matches)?;
        Ok((cli, matches))
    });
    let (cli, matches) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return refuse_command_line(&error),
    };
    let format = Format { json: cli.global.json, paint: Paint::for_stream(&io::stdout()) };
    let log = cli.global.log.clone();
    let ran = scope::refuse_unheeded(&cli.global, &cli.command, &matches)
        .and_then(|()| cli.global.with_machine_file(&matches))
        .and_then(|global| run(&global, format, &cli.command, Typed::of(&matches)));
    let ran = match (ran, log.as_ref().and_then(LogPath::failure)) {
        (ran, None) => ran,
        // What the command found out has been printed.
        (Ok(()), Some(torn)) => Err(torn),
        (Err(failure), Some(torn)) => Err(torn.because.iter().fold(failure.because(&torn.what), Failure::because)),
    };
    match ran {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            complain(format, &failure);
            ExitCode::from(failure.status as u8)
        }
    }
}

/// The command line as it was typed, or with its words in the order that was meant, where that does no harm.
fn matches() -> Result<ArgMatches, clap::Error> {
    let mut error = match command_line().try_get_matches() {
        Ok(matches) => return Ok(matches),
        Err(error) => error,
    };
    let command = command_line();
    drop_advice_to_quote(&mut error);
    let Some(words) = std::env::args_os().skip(1).map(|word| word.into_string().ok()).collect::<Option<Vec<_>>>()
    else {
        return Err(error);
    };
    if error.kind() == ErrorKind::UnknownArgument
        && let Some(joined) = word_order::with_negative_values(&words)
    {
        match parse(&command, &joined) {
            Ok(matches) => return Ok(matches),
            Err(judged) if judged.kind() == ErrorKind::ValueValidation => return Err(judged),
            Err(_) => {}
        }
    }
    if let Some(Err(help)) = help::without_help_of_help(&words).map(|words| parse(&command, &words))
        && !help.use_stderr()
    {
        return Err(help);
    }
    let meant = match word_order::mend(&command, &words, error.kind()) {
        Some(mended) if mended.is_harmless() => {
            if !words.iter().any(|word| word == "--json") {
                // The reader may have gone.
                let _ = writeln!(io::stderr(), "note: interpreted as: {}", plain(&mended.text()));
            }
            return Ok(mended.matches);
        }
        Some(mended) => Some(mended.text()),
        None => {
            let meant = senses::joined(&command, &words).or_else(|| senses::with_option(&command, &words));
            meant.map(|words| word_order::text(&words))
        }
    };
    let meant = meant.map(|text| format!("did you mean: {text}"));
    let other = senses::restore_of_file(&command, &words);
    match other.or(meant).or_else(|| senses::stop_of_one(&command, &words)) {
        Some(tip) => suggest(&mut error, vec![tip]),
        None => match tips::further(&command, &words, error.kind()) {
            Some(further) => return Err(further),
            None => suggest_by_sense(&mut error, &command, &words),
        },
    }
    Err(error)
}

fn parse(command: &clap::Command, words: &[String]) -> Result<ArgMatches, clap::Error> {
    command.clone().try_get_matches_from(std::iter::once("ferrodrive").chain(words.iter().map(String::as_str)))
}

/// An unknown option is hardly ever meant as a value behind `--`.
fn drop_advice_to_quote(error: &mut clap::Error) {
    if let Some(ContextValue::StyledStrs(tips)) = error.remove(ContextKind::Suggested) {
        let others: Vec<_> = tips.into_iter().filter(|tip| !tip.to_string().contains("as a value, use '")).collect();
        if !others.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(others));
        }
    }
}

fn suggest(error: &mut clap::Error, tips: Vec<String>) {
    let tips = tips.into_iter().map(StyledStr::from).collect();
    error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
}

/// In place of commands that are spelt like an unknown one, those that do what it is the word for elsewhere. Where something is
/// missing, how it is typed.
fn suggest_by_sense(error: &mut clap::Error, command: &clap::Command, words: &[String]) {
    if error.kind() == ErrorKind::MissingRequiredArgument {
        let examples = tips::examples(command, words);
        if !examples.is_empty() {
            suggest(error, examples);
        }
        return;
    }
    // A wrong command of `eds` is taken for a model.
    let model = words.iter().position(|word| word == "eds").and_then(|eds| words.get(eds + 1));
    let (word, is_model) = match (error.get(ContextKind::InvalidSubcommand), error.get(ContextKind::InvalidValue)) {
        (Some(ContextValue::String(word)), _) => (word.clone(), false),
        (_, Some(ContextValue::String(word))) if model == Some(word) => (word.clone(), true),
        _ => return,
    };
    let by_spelling = match error.remove(ContextKind::SuggestedSubcommand) {
        Some(ContextValue::Strings(names)) => names,
        Some(ContextValue::String(name)) => vec![name],
        _ => Vec::new(),
    };
    let place = words.iter().position(|other| *other == word);
    if let Some(meant) = place.and_then(|place| word_order::in_lower_case(command, words, place)) {
        return suggest(error, vec![format!("did you mean: {}", word_order::text(&meant))]);
    }
    let by_sense = place.and_then(|place| senses::tips(command, words, place));
    // The spelling of a model has its own suggestion.
    match by_sense {
        Some(tips) => return suggest(error, tips),
        None if is_model => return,
        None => {}
    }
    let all = place.and_then(|place| tips::commands(command, &words[..place]));
    let names = by_spelling.into_iter().filter(|name| senses::may_be_meant(&word, name)).collect();
    let names = tips::alike(&word, names, all.is_some());
    if !names.is_empty() {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(names));
    } else if let Some(all) = all {
        suggest(error, vec![all]);
    }
}

/// A command line that makes no sense, or asks for help. It has not been parsed, but it may say in which form to complain.
fn refuse_command_line(error: &clap::Error) -> ExitCode {
    let before_dashes = std::env::args_os().take_while(|argument| argument != "--");
    let json = before_dashes.into_iter().any(|argument| argument == "--json");
    if let Some(failure) = crate::failure::of_named_file(error) {
        complain(Format { json, paint: Paint::for_stream(&io::stdout()) }, &failure);
        return ExitCode::from(failure.status as u8);
    }
    if !json || !error.use_stderr() {
        return show_usage(error);
    }
    let failure = crate::failure::of_command_line(error);
    complain(Format { json, paint: Paint::for_stream(&io::stdout()) }, &failure);
    ExitCode::from(failure.status as u8)
}

/// Help, or what is wrong with the command line, in the parser's own words and colours; what was typed may have brought
/// commands for the terminal along, which are spelled out.
fn show_usage(error: &clap::Error) -> ExitCode {
    let text = error.render().to_string();
    let shown = short(&plain(&text));
    if shown == text {
        error.exit();
    }
    let _ = write!(io::stderr(), "{shown}");
    ExitCode::from(error.exit_code() as u8)
}

/// Says why: to people on standard error, to programs as a line of JSON on standard output. Who sent a signal knows,
/// unless there is more to report.
fn complain(format: Format, failure: &Failure) {
    let Some(line) = complaint(format, Paint::for_stream(&io::stderr()), failure) else { return };
    // The reader may have gone; the exit status remains.
    let _ = if format.json { writeln!(io::stdout(), "{line}") } else { writeln!(io::stderr(), "{line}") };
}

/// What is said of a failure, where anything is.
fn complaint(format: Format, paint: Paint, failure: &Failure) -> Option<String> {
    if failure.reported {
        return None;
    }
    if format.json {
        return sim::json::to_string(&FailureReport::from(failure)).ok().map(|line| short(&line));
    }
    let is_silent = failure.status.is_signal() && failure.because.is_empty();
    (!is_silent).then(|| format!("{} {}", paint.bad("error:"), short(&plain(&failure.to_string()))))
}

/// What was given on the command line, not by the environment.
#[derive(Clone, Copy)]
struct Typed {
    bus: bool,
}

impl Typed {
    fn of(matches: &ArgMatches) -> Self {
        let typed = |option| matches.value_source(option) == Some(ValueSource::CommandLine);
        Self { bus: typed("bus") }
    }
}

fn run(global: &Global, format: Format, command: &Command, typed: Typed) -> Result<(), Failure> {
    match command {
        Command::Demo(demo) => demo.run(global).and_then(|report| format.print_judged(&report, report.failure())),
        Command::Sim(sim) => sim.run(global, typed.bus.then_some(&global.bus)),
        Command::Run(run) => run.run(format),
        Command::Read(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Watch(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Params(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Pdo(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Emcy(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Sync(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Time(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Send(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Lss(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Report(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Conform(command) => command.run(global, format),
        Command::OfConsole(command) => of_console(global, format, command),
        Command::Restore(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Program(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Tune(command) => {
            command.check()?;
            on_bus(global, format, async |context| command.run(context).await)
        }
        Command::Objects(objects) => list_objects(global, format, objects),
        Command::Latency(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Boot(boot) => boot.run(global, format),
        Command::Supervise(command) => command.run(global, format),
        Command::TestMotion(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Group(group) => group.run(global, format),
        Command::DriveBase(base) => base.run(global, format),
        Command::Plan(plan) => plan.run(global, format),
        Command::Check(command) => check(global, format, command),
        Command::Init(init) => {
            init.run(global, typed.bus).and_then(|report| print_whole(format, &report, report.failure()))
        }
        Command::Plot(plot) => print(format, &plot.draw(global)?),
        Command::Readings(readings) => print(format, &readings.list()?),
        Command::Eds(eds) => eds.run(format),
        Command::Dcf(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::World(world) => print(format, &world.run()?),
        Command::Events(events) => events.run(format),
        Command::Dump(dump) => dump.run(global, format),
        Command::Decode(decode) => decode.run(global, format),
        Command::Convert(convert) => print(format, &convert.run(format.json)?),
        Command::Capture(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Record(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Export(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Fmu(fmu) => print(format, &fmu.run(format.json)?),
        Command::Gateway(command) => session::run(global, async |context| command.run(context, format).await),
        Command::Top(command) => session::run_live(global, async |context| command.run(context, format).await),
        Command::Studio(command) => session::run_live(global, async |context| command.run(context, format).await),
        Command::Replay(command) => on_bus(global, format, async |context| command.run(context).await),
        Command::Completions(completions) => completions.run(),
        Command::ManPages(pages) => pages.run(scope::heeded()),
        Command::Options => print_line(&help::of_options(command_line())).map_err(Failure::of_stdout),
    }
}

fn check(global: &Global, format: Format, check: &Check) -> Result<(), Failure> {
    check.run(global).and_then(|report| print_whole(format, &report, report.failure(check.strict())))
}

fn list_objects(global: &Global, format: Format, objects: &Objects) -> Result<(), Failure> {
    match objects.whose {
        None => print(format, &ModelList::of_all()),
        Some(Whose::Model(model)) if objects.departures => print(format, &DepartureList::of(model, None)),
        Some(Whose::Node(node)) if objects.departures => {
            on_bus(global, format, async |context| objects.departures_of_node(context, node).await)
        }
        Some(Whose::Model(model)) => print(format, &objects.list(model)?),
        Some(Whose::Node(node)) => on_bus(global, format, async |context| objects.of_node(context, node).await),
    }
}

fn of_console(global: &Global, format: Format, command: &console::command::Command) -> Result<(), Failure> {
    let outcome = session::run(global, async |context| command.run(context).await)?;
    format.print_judged(&outcome, outcome.failure())
}

fn on_bus<R: Report>(
    global: &Global,
    format: Format,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<(), Failure> {
    print(format, &session::run(global, command)?)
}

/// Prints a report that has why the command fails, and fails with that.
fn print_whole(format: Format, report: &impl Report, failure: Option<words::failure::Failure>) -> Result<(), Failure> {
    print(format, report)?;
    format.ended(failure.map(Failure::from))
}

fn print(format: Format, report: &impl Report) -> Result<(), Failure> {
    format.print(report).map_err(Failure::of_stdout)
}
