//! `ferrodrive`: CANopen motor drives, virtual and real, on the command line.
//!
//! One file per command under [`command`], with its arguments, help and tests. [`session`] gives a command its network
//! on any bus; what a command returns is printed as text or JSON; what goes wrong is a [`failure::Failure`].

mod args;
mod command;
mod context;
mod decode;
mod embedded;
mod failure;
mod models;
mod output;
#[allow(dead_code, reason = "the commands that use all of it are under way")]
mod paint;
mod parse;
#[allow(dead_code, reason = "the commands that use all of it are under way")]
mod plot;
mod progress;
#[allow(dead_code, reason = "the commands that use all of it are under way")]
mod serve;
mod session;
mod table;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;

use crate::args::{Cli, Command, Global};
use crate::command::objects::Whose;
use crate::context::Context;
use crate::failure::Failure;
use crate::output::{Format, Report};
use crate::paint::Paint;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let format = Format { json: cli.global.json, paint: Paint::for_stream(&io::stdout()) };
    match run(&cli.global, format, &cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            let error = Paint::for_stream(&io::stderr()).bad("error:");
            // Nobody may be listening any more; the exit status still tells.
            let _ = writeln!(io::stderr(), "{error} {failure}");
            ExitCode::from(failure.status as u8)
        }
    }
}

fn run(global: &Global, format: Format, command: &Command) -> Result<(), Failure> {
    match command {
        Command::Scan(scan) => on_bus(global, format, async |context| scan.run(context).await),
        Command::Read(read) => on_bus(global, format, async |context| read.run(context).await),
        Command::Write(write) => on_bus(global, format, async |context| write.run(context).await),
        Command::Nmt(nmt) => on_bus(global, format, async |context| nmt.run(context).await),
        Command::Objects(objects) => match objects.whose {
            Whose::Model(model) => print(format, &objects.list(model)?),
            Whose::Node(node) => {
                on_bus(global, format, async |context| objects.list(context.known_model_of(node).await?))
            }
        },
        Command::Dump(dump) => dump.run(global, format),
        Command::Completions(completions) => {
            completions.run();
            Ok(())
        }
    }
}

fn on_bus<R: Report>(
    global: &Global,
    format: Format,
    command: impl AsyncFnOnce(&Context) -> Result<R, Failure>,
) -> Result<(), Failure> {
    print(format, &session::run(global, command)?)
}

fn print(format: Format, report: &impl Report) -> Result<(), Failure> {
    format.print(report).map_err(|error| Failure::new("cannot write to standard output").because(error))
}
