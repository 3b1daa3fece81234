//! `ferrodrive events`: what happens in a running simulator, as it happens.

use host::events::Filter;
use serde_json::{Value, json};

use crate::control_client::ControlArgs;
use crate::failure::Failure;
use crate::output::{Format, print_line};
use crate::plain::plain;
use crate::session::exit_on_signal;
use console::numbers::whole;

/// Show the events of a running simulator
///
/// Boot-ups, changes of state, faults with remedies, targets reached, bus errors. Runs until the simulator ends, or
/// Ctrl-C. Times are those of the bus.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Kinds: power, boot, nmt, state, mode, fault, fault_reset, emcy, target_reached, internal_limit,\n\
    store_begun, store_done, damage, bus_error, bus_state, cable, stimulus, behind, caught_up, missed\n\n\
    Examples:\n  ferrodrive events --control 127.0.0.1:4000\n  \
    ferrodrive events --control 127.0.0.1:4000 --node 4 --kind fault --json"
)]
pub(crate) struct Events {
    #[command(flatten)]
    control: ControlArgs,
    /// Show only events of this node; may be repeated
    #[arg(long = "node", value_name = "NODE", value_parser = |text: &str| whole(text, 1..=127_u8))]
    nodes: Vec<u8>,
    /// Show only events of this kind; may be repeated
    #[arg(long = "kind", value_name = "KIND")]
    kinds: Vec<String>,
    /// End after this many events
    #[arg(long, value_name = "N", value_parser = |text: &str| whole(text, 1..=u64::MAX))]
    count: Option<u64>,
}

impl Events {
    /// Shows events until there are no more.
    pub(crate) fn run(&self, format: Format) -> Result<(), Failure> {
        Filter::new(self.nodes.iter().copied(), &self.kinds)
            .map_err(|error| Failure::usage(error.to_string()).next("omit --kind to show all events"))?;
        exit_on_signal();
        let mut client = self.control.connect()?;
        let events = json!({ "nodes": self.nodes, "kinds": self.kinds });
        client.ask(json!({ "request": "subscribe", "events": events }))?;
        client.wait_at_most(None)?;
        let mut shown = 0;
        while self.count.is_none_or(|count| shown < count)
            && let Some(line) = client.next()?
        {
            let Some(event) = line.get("event").or_else(|| line.get("dropped")) else { continue };
            let printed = if format.json { format.print_json(event) } else { print_line(&plain(&words(event))) };
            printed.map_err(Failure::of_stdout)?;
            shown += 1;
        }
        Ok(())
    }
}

/// `(  1.234567)  node 4: fault 0001h, over-voltage`, and what to do below.
fn words(event: &Value) -> String {
    let Some(t) = event["t"].as_f64() else {
        return format!("{} events are missing here: they were not read in time", event["events"]);
    };
    let place = match (&event["node"], &event["axis"]) {
        (Value::Null, _) => String::new(),
        (node, Value::Null) => format!("node {node}: "),
        (node, axis) => format!("node {node}.{axis}: "),
    };
    let text = event["text"].as_str().unwrap_or_default();
    let by = event["by"].as_str().filter(|by| !text.contains(by)).map(|by| format!(" (by {by})")).unwrap_or_default();
    let remedy = event["remedy"].as_str().map(|remedy| format!("\n{:14}what to do: {remedy}", "")).unwrap_or_default();
    format!("({t:11.6}) {place}{text}{by}{remedy}")
}
