//! A world that is looked at and changed while its time passes on its own: by the world commands without those
//! that move time.

use serde_json::{Value, json};
use sim::World;
use sim::command::{Command, CommandError, Service, perform};
use sim::stimulus::{FORMS, GET, GET_BODY, RUN};

/// A world as its owner sees it, which is one of this program ([`World`]) or one of another, asked by its control connection.
pub trait Around {
    /// The answers of all drives to `get` in `nodes`, each with its `place`: the number under which it was added, as a word of a line.
    /// In `bodies` the names of the machines that several of them move, in `t` the time in s.
    fn look(&mut self) -> Value;

    /// Does what a line says.
    ///
    /// # Errors
    /// Why not, in a word that programs may rely on, and in words; nothing is changed then.
    fn change(&mut self, line: &str) -> Result<Changed, (&'static str, String)>;
}

/// Every form of a line that changes something.
pub fn forms() -> Vec<&'static str> {
    let left_out = [RUN, GET, GET_BODY, "now", "help", "quit"];
    FORMS.iter().copied().filter(|form| !left_out.contains(form)).collect()
}

impl Around for World {
    fn look(&mut self) -> Value {
        let places: Vec<String> = self.drive_numbers().map(|number| number.to_string()).collect();
        let nodes: Vec<Value> = places
            .into_iter()
            .filter_map(|place| {
                let get = format!("{place} get").parse::<Command>().ok()?;
                let mut got = value(&perform(self, &get, Service::default()).ok()?);
                got["place"] = place.into();
                Some(got)
            })
            .collect();
        let bodies: Vec<&str> = self.body_names().collect();
        json!({ "t": self.now().as_nanos() as f64 / 1e9, "nodes": nodes, "bodies": bodies })
    }

    fn change(&mut self, line: &str) -> Result<Changed, (&'static str, String)> {
        let (command, changed) = understand(line)?;
        let answer = value(&perform(self, &command, Service::default()).map_err(failed)?);
        Ok(Changed { note: answer["note"].as_str().map(str::to_owned), ..changed })
    }
}

/// What a line has done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// The node that it is about, by the number under which it was added.
    pub node: Option<u8>,
    /// The line as it was understood.
    pub line: String,
    /// What takes it back, where that does not depend on what was before.
    pub back: Option<String>,
    /// The consequence, where it may be unexpected.
    pub note: Option<String>,
}

fn failed(error: CommandError) -> (&'static str, String) {
    (error.kind(), error.to_string())
}

/// What a line will have changed once the owner of the world has performed it, without its note.
///
/// # Errors
/// Those of [`Around::change`] that need no world to be found.
pub fn understand(line: &str) -> Result<(Command, Changed), (&'static str, String)> {
    let command: Command = line.parse().map_err(failed)?;
    let (node, line, back) = match &command {
        Command::Apply(place, stimulus) => {
            let back = stimulus.way_back().map(|back| format!("{place} {back}"));
            (Some(place.node), format!("{place} {stimulus}"), back)
        }
        Command::Disturb(fault) => (None, fault.to_string(), fault.way_back().map(|back| back.to_string())),
        Command::ApplyToBody(name, stimulus) => (None, format!("body {name} {stimulus}"), None),
        Command::Now | Command::Help | Command::Quit | Command::Run(_) | Command::Get(_) | Command::GetBody(_) => {
            return Err(("usage", "that changes nothing in the world; its time passes on its own here".to_owned()));
        }
    };
    Ok((command, Changed { node, line, back, note: None }))
}

/// A line that a world answered with.
fn value(line: &str) -> Value {
    serde_json::from_str(line).unwrap_or_default()
}
