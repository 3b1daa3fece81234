//! `ferrodrive world`: a world command to a running simulator.

use serde::Serialize;
use serde_json::{Value, json};
use sim::command::Command;

use crate::control_client::ControlArgs;
use crate::failure::Failure;
use crate::output::Report;
use crate::session::exit_on_signal;
use plot::Paint;

/// Change the surroundings of drives in a running simulator
///
/// Supply, load, switches, faults, cables: the commands are those of the simulator's standard input, NODE COMMAND, or
/// now, help, run TIME.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  ferrodrive sim --drive zlac8030l@4 --control 127.0.0.1:4000\n  \
    ferrodrive world --control 127.0.0.1:4000 4 supply 90\n  \
    FERRODRIVE_CONTROL=127.0.0.1:4000 ferrodrive world 4 load torque -2.5\n  ferrodrive world help")]
pub(crate) struct World {
    #[command(flatten)]
    control: ControlArgs,
    /// The command, e.g. 4 supply 90
    #[arg(required = true, value_name = "WORDS", allow_negative_numbers = true)]
    words: Vec<String>,
}

/// The simulator's answer.
#[derive(Serialize)]
#[serde(transparent)]
pub(crate) struct WorldAnswer(Value);

impl Report for WorldAnswer {
    fn text(&self, _: Paint) -> String {
        let fields = self.0.as_object().into_iter().flatten();
        let lines = fields.map(|(name, value)| match value {
            Value::Array(items) if items.iter().all(Value::is_string) && !items.is_empty() => {
                let items: Vec<&str> = items.iter().filter_map(Value::as_str).collect();
                format!("{name}:\n  {}", items.join("\n  "))
            }
            Value::String(text) => format!("{name}: {text}"),
            value => format!("{name}: {value}"),
        });
        lines.collect::<Vec<_>>().join("\n")
    }
}

impl World {
    /// Sends the command and hands back the answer.
    pub(crate) fn run(&self) -> Result<WorldAnswer, Failure> {
        exit_on_signal();
        let line = self.words.join(" ");
        let command = line
            .parse::<Command>()
            .map_err(|error| Failure::usage(format!("{error}")).next("ferrodrive world help lists the commands"))?;
        let mut client = self.control.connect()?;
        if matches!(command, Command::Run(_)) {
            // It is over when it is over.
            client.wait_at_most(None)?;
        }
        let mut answer = client.ask(json!({ "request": "world", "line": line }))?;
        // Every answer has "ok": it is omitted here.
        answer.as_object_mut().and_then(|fields| fields.remove("ok"));
        Ok(WorldAnswer(answer))
    }
}
